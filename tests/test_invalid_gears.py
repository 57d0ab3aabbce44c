"""Every impossible gear, pair, resolution or load is refused in one line: what, how much, and what is allowed."""

import re
from dataclasses import replace

import jax
import jax.numpy as jnp
import pytest
from catalogue import LINE, gear_pair, high_contact_ratio_pair

import jaxgear as jg


def gear(teeth=20, module=3.0, pressure_angle=20.0, shift=0.0, **changes):
    return jg.Gear(teeth, module, pressure_angle, shift, **{"face_width": 10.0, **changes})


def refused(make, *expected):
    """The message of the ValueError that `make` raises; it must contain every expected text."""
    with pytest.raises(ValueError) as error:
        make()
    message = str(error.value)
    assert "\n" not in message
    for text in expected:
        assert text in message, message


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"teeth": 20.5}, ("Gear: teeth = 20.5", "whole number")),
        ({"teeth": 4}, ("Gear: teeth = 4", "at least 5")),
        ({"teeth": -20}, ("Gear: teeth = -20", "at least 5")),
        ({"module": 0.0}, ("Gear: module = 0 mm", "greater than 0 mm")),
        ({"module": -2.0}, ("Gear: module = -2 mm", "greater than 0 mm")),
        ({"pressure_angle": 5.0}, ("Gear: pressure_angle = 5 deg", "at least 10 deg", "at most 35 deg")),
        ({"pressure_angle": 40.0}, ("Gear: pressure_angle = 40 deg", "at most 35 deg")),
        ({"shift": 3.0}, ("Gear: profile_shift = 3 x module", "at most 2 x module")),
        ({"face_width": 0.0}, ("Gear: face_width = 0 mm", "greater than 0 mm")),
        ({"addendum": -1.0}, ("Gear: addendum = -1 x module", "at least 0.5 x module")),
        ({"dedendum": 3.0}, ("Gear: dedendum = 3 x module", "at most 2 x module")),
        ({"root_radius": 0.6}, ("Gear: root_radius = 0.6 x module", "at most 0.47")),
        ({"root_radius": -0.1}, ("Gear: root_radius = -0.1 x module", "at least 0 x module")),
        ({"tip_diameter": -60.0}, ("Gear: tip_diameter = -60 mm", "greater than 0 mm")),
        ({"grinding_allowance": 50.0}, ("Gear: protuberance: missing", "grinding_allowance needs it")),
        (
            {"grinding_allowance": 100.0, "protuberance": 0.02},
            ("Gear: grinding_allowance = 100 um", "at most 60 um, the protuberance"),
        ),
        ({"rim_thickness": 5.0}, ("Gear: web_thickness: missing", "rim_thickness needs it")),
        ({"rim_thickness": 500.0, "web_thickness": 5.0}, ("Gear: rim_thickness = 500 mm", "must be at most")),
        ({"tip_edge_radius": 1.2}, ("Gear: tip_edge_radius = 1.2 mm", "at most 1.042 mm", "half the tip land")),
        ({"tip_edge_radius": 0.0}, ("Gear: tip_edge_radius = 0 mm", "greater than 0 mm")),
    ],
)
def test_numbers_out_of_range(changes, expected):
    refused(lambda: gear(**changes), *expected)


@pytest.mark.parametrize(
    "name",
    ["teeth", "module", "pressure_angle", "shift", "face_width", "addendum", "dedendum", "root_radius", "tip_diameter",
     "bore_diameter", "tip_edge_radius"],
)  # fmt: skip
@pytest.mark.parametrize("value", [jnp.nan, jnp.inf])
def test_numbers_that_are_none(name, value):
    shown = "profile_shift" if name == "shift" else name
    refused(lambda: gear(**{name: value}), f"Gear: {shown} = {value}")


def test_pointed_tooth():
    """A 12-tooth gear with x = 0.9 comes to a point below its nominal tip circle."""
    refused(lambda: gear(12, shift=0.9), "Gear: addendum", "tip diameter = 47.4 mm", "pointed", "tip land", "0 mm")
    refused(lambda: gear(30, tip_diameter=105.0), "Gear: tip_diameter", "105 mm", "pointed")
    gear(12, shift=0.9, tip_diameter=45.5)


def test_a_default_tip_edge_gives_way_to_a_narrow_tip_land():
    """0.05 modules, or half the tip land; of a chamfered tip the room is where the chamfer begins."""
    assert float(gear().edge_radius) == pytest.approx(0.15) and "tip_edge_radius=0.15 mm (0.05 modules)" in str(gear())
    narrow = gear(12, shift=0.9, tip_diameter=47.0)
    assert float(narrow.edge_radius) < 0.15
    assert float(narrow.edge_radius) == pytest.approx(0.5 * float(narrow.tip_land), rel=1e-12)
    assert "(half the tip land)" in str(narrow)
    gear(12, shift=0.9, tip_diameter=47.0, tip_form_diameter=46.9, tip_edge_radius=float(narrow.edge_radius) + 0.01)


def test_tip_inside_the_base_circle():
    base = 60 * float(jnp.cos(jnp.deg2rad(20.0)))
    refused(lambda: gear(tip_diameter=54.0), "Gear: tip_diameter", "54 mm", f"greater than {base:g} mm")


def test_bore_beyond_the_root_circle():
    refused(lambda: gear(bore_diameter=53.0), "Gear: bore_diameter = 53 mm", "less than 52.5 mm")
    refused(lambda: gear(bore_diameter=-1.0), "Gear: bore_diameter = -1 mm", "greater than 0 mm")
    gear(bore_diameter=52.0)


def test_gears_of_many_numbers():
    """Whether or not they are being traced; `jax.vmap` makes many gears, each of which is checked."""
    three = jnp.asarray([0.0, 0.1, 0.2])
    refused(lambda: gear(shift=three), "Gear: profile_shift has shape (3,), must be a single number", "jax.vmap")
    refused(lambda: jax.jit(lambda x: gear(shift=x).tip_radius)(three), "Gear: profile_shift has shape (3,)")
    refused(lambda: gear(module=three[None]), "Gear: module has shape (1, 3)")
    many = jax.vmap(lambda x: gear(shift=x))(three)
    assert many.profile_shift.shape == (3,)
    refused(lambda: jg.GearPair(many, many), "GearPair: pinion holds gears of shape (3,), must be one", "jax.vmap")
    assert jax.vmap(jg.GearPair)(many, many).working_center_distance.shape == (3,)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"elastic_modulus": 0.0}, ("Material: elastic_modulus = 0 MPa", "greater than 0 MPa")),
        ({"poisson_ratio": 0.51}, ("Material: poisson_ratio = 0.51", "at most 0.5")),
        ({"poisson_ratio": -0.1}, ("Material: poisson_ratio = -0.1", "at least 0")),
        ({"density": -1.0}, ("Material: density = -1 kg/m^3", "greater than 0")),
        ({"thermal_contact_coefficient": jnp.nan}, ("Material: thermal_contact_coefficient = nan",)),
    ],
)
def test_materials(changes, expected):
    refused(lambda: jg.Material(**changes), *expected)


def test_mismatch_of_the_basic_racks():
    refused(lambda: jg.GearPair(gear(module=3.0), gear(module=2.0)), "GearPair: wheel module = 2 mm", "3 mm")
    refused(lambda: jg.GearPair(gear(), gear(pressure_angle=22.0)), "GearPair: wheel pressure_angle = 22 deg", "20 deg")


def test_center_distance_too_small():
    base = 60 * float(jnp.cos(jnp.deg2rad(20.0)))
    pair = lambda a: jg.GearPair(gear(), gear(), a)  # noqa: E731
    refused(lambda: pair(55.0), "GearPair: center_distance = 55 mm", f"greater than {base:g} mm")
    refused(lambda: pair(59.9), "GearPair: center_distance = 59.9 mm", "backlash-free", "at least 59.9999 mm")
    refused(lambda: pair(jnp.nan), "GearPair: center_distance = nan mm")
    pair(60.0)


def test_contact_ratio_below_one():
    refused(
        lambda: jg.GearPair(gear(), gear(), 62.0), "GearPair: center_distance = 62 mm", "contact ratio", "at least 1"
    )
    low = gear(tip_diameter=62.0)
    refused(lambda: jg.GearPair(low, low), "GearPair: contact ratio", "at least 1", "tip_diameter")


def test_interference_below_the_form_circle():
    """The 100-tooth wheel's tip reaches below the form circle of a pinion whose rack leaves no clearance; the undercut
    of a full rack clears it."""
    refused(
        lambda: jg.GearPair(gear(16, dedendum=1.0, root_radius=0.3), gear(100)),
        "GearPair: wheel tip_diameter reaches the pinion's flank", "mm", "form diameter",
    )  # fmt: skip
    jg.GearPair(gear(16), gear(100))
    refused(
        lambda: jg.GearPair(gear(60, addendum=1.3, dedendum=1.5, root_radius=0.3), gear(17)),
        "GearPair: pinion tip_diameter reaches the wheel's flank", "below the base circle",
    )  # fmt: skip
    jg.GearPair(gear(12, shift=0.5), gear(60, shift=-0.5))


SHALLOW = {"dedendum": 1.0, "root_radius": 0.3}  # a rack no deeper than the mate's tooth


@pytest.mark.parametrize(
    ("pinion", "wheel"),
    [
        ({"teeth": 19, "shift": -0.3, **SHALLOW}, {"teeth": 48}),
        ({"teeth": 12, **SHALLOW}, {"teeth": 20}),
        ({"teeth": 12, **SHALLOW}, {"teeth": 40}),
        ({"teeth": 19, "pressure_angle": 14.5, **SHALLOW}, {"teeth": 48, "pressure_angle": 14.5}),
    ],
)
def test_interference_compares_what_grows_along_the_flank(pinion, wheel):
    """Below the base circle diameters grow again: the numbers of the message must be in the order that it claims."""
    with pytest.raises(ValueError) as error:
        jg.GearPair(gear(**pinion), gear(**wheel))
    numbers = re.search(r" (?:diameter|of) (-?[\d.]+) mm.*?must be at least \D*([\d.]+) mm", str(error.value))
    assert numbers is not None and float(numbers[1]) < float(numbers[2]), str(error.value)


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda: jg.TipRelief(5.0, -1.0), ("TipRelief: length = -1 mm", "at least 0 mm")),
        (lambda: jg.TipRelief(jnp.nan, 1.0), ("TipRelief: amount = nan um",)),
        (lambda: jg.RootRelief(5.0, -1.0), ("RootRelief: length = -1 mm", "at least 0 mm")),
        (lambda: jg.ProfileCrowning(jnp.inf), ("ProfileCrowning: amount = inf um",)),
        (lambda: jg.ProfileSlope(jnp.nan), ("ProfileSlope: amount = nan um",)),
        (lambda: jg.LeadCrowning(jnp.nan), ("LeadCrowning: amount = nan um",)),
        (lambda: jg.LeadSlope(jnp.nan), ("LeadSlope: amount = nan um",)),
        (lambda: jg.EndRelief(5.0, -1.0), ("EndRelief: length = -1 mm", "at least 0 mm")),
        (lambda: jg.EndRelief(5.0, 1.0, side="left"), ("EndRelief: side = 'left'", '"negative"')),
        (lambda: jg.Power(0.0), ("Power: exponent = 0", "greater than 0")),
        (lambda: jg.Spline([0.0, 1.0]), ("Spline: values", "at least 3")),
        (lambda: jg.Polynomial([0.0, jnp.nan]), ("Polynomial: coefficients = nan",)),
        (lambda: jg.TabulatedProfile([0.0, 1.0], [1.0]), ("TabulatedProfile: position", "same length")),
        (lambda: jg.TabulatedProfile([0.0, 0.0], [1.0, 2.0]), ("TabulatedProfile: position", "increase")),
        (lambda: jg.TabulatedProfile([0.0, 1.0], [1.0, jnp.nan]), ("TabulatedProfile: amount = nan um",)),
        (lambda: jg.TabulatedProfile([0.0, 1.0], [1.0, 2.0], coordinate="radius"), ("coordinate = 'radius'",)),
        (lambda: jg.TabulatedProfile([0.0, 1.0], [1.0, 2.0], method="cubic"), ("method = 'cubic'", '"monotonic"')),
    ],
)
def test_modifications(make, expected):
    refused(make, *expected)


def test_resolution():
    refused(lambda: jg.Resolution(positions=2), "Resolution: positions = 2", "at least 4")
    refused(lambda: jg.Resolution(slices=0), "Resolution: slices = 0", "at least 1")
    refused(lambda: jg.Resolution(pairs=1), "Resolution: pairs = 1", "at least 2")
    refused(lambda: jg.Resolution(positions=32.0), "Resolution: positions = 32.0", "whole number")


def test_too_few_pairs_for_the_path_of_contact():
    """Contact ratio 2.36: the path reaches farther than one base pitch to either side of the pitch point."""
    pair = high_contact_ratio_pair()
    refused(
        lambda: jg.prepare(pair, resolution=replace(LINE, pairs=2)),
        "Resolution: pairs = 2", "at least 3", "base pitches",
    )  # fmt: skip


def test_plane_and_load():
    refused(lambda: jg.default_compliance(plane="shell"), "plane = 'shell'", '"auto", "stress" or "strain"')
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    refused(lambda: jg.solve(mesh, -5.0), "torque = -5 N m", "at least 0 N m")
    refused(lambda: jg.solve(mesh, jnp.nan), "torque = nan N m")


def test_traced_values_pass_the_door():
    """Checks need concrete values; under a transformation an impossible gear must not raise."""
    pointed = jax.jit(lambda x: gear(12, shift=x).tip_roll_length)
    assert bool(jnp.isfinite(pointed(0.9)))
