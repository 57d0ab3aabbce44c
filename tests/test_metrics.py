"""Metrics against published numbers and closed forms."""

import dataclasses
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair

import jaxgear as jg
from jaxgear.contact.cycle import corner_pressure
from jaxgear.metrics.stress import single_contact_root_stress
from jaxgear.vocabulary import quantities


# FZG type C gears with untrimmed tips: published form and stress correction factors and loss factor
@cache
def fzg():
    return jg.GearPair(
        jg.Gear(16, 4.5, profile_shift=0.1817, face_width=14.0, tip_diameter=82.636, root_radius=0.375),
        jg.Gear(24, 4.5, profile_shift=0.1715, face_width=14.0, tip_diameter=118.544, root_radius=0.375),
        91.5,
    )


EDGES = {"pinion": 0.1, "wheel": 0.3}  # mm


def test_ohlendorf_loss_factor():
    assert float(jax.jit(jg.metrics.ohlendorf_loss_factor)(fzg())) == pytest.approx(0.1986, abs=5e-5)


def test_root_factors_at_the_outer_point_of_single_contact():
    @jax.jit
    def factors(gear, beyond):
        return jg.metrics.root_factors(gear, gear.tip_roll_length - beyond)

    beyond = 0.4624 * fzg().base_pitch  # the published contact ratio, 1.4624, fixes the load point
    pinion, wheel = (factors(gear, beyond) for gear in fzg().gears)
    np.testing.assert_allclose([pinion.form, wheel.form], [1.6889, 1.5832], atol=1e-4)
    np.testing.assert_allclose([pinion.correction, wheel.correction], [1.8514, 1.9165], atol=1e-4)
    np.testing.assert_allclose([pinion.lever_arm, wheel.lever_arm], [5.0586, 5.2769], atol=1e-3)


def test_root_stress_of_the_standard_with_tips_cut_back():
    """FZG C under 200 N m with the tips of the test gears: S_F 3.235 and 3.338 with 900 MPa."""
    gears = [dataclasses.replace(gear, tip_diameter=tip) for gear, tip in zip(fzg().gears, (82.46, 118.36))]
    pair = jg.GearPair(*gears, 91.5)
    per_load = single_contact_root_stress(pair, jg.path_of_contact(pair))
    line_load = 200e3 / (36.0 * np.cos(np.deg2rad(20.0))) / 14.0
    np.testing.assert_allclose(900.0 / (line_load * np.array(per_load)), [3.235, 3.338], atol=5e-4)


@pytest.mark.parametrize(
    ("teeth", "single", "mesh"),
    [
        ((17, 43), 12.5049, 18.3300),
        ((19, 48), 12.8315, 19.0448),
        ((20, 30), 12.2637, 17.8299),
        ((23, 23), 11.9623, 17.2700),
        ((30, 30), 12.7846, 19.0509),
        ((50, 50), 14.0545, 22.0094),
    ],
)
def test_iso_stiffness(teeth, single, mesh):
    pair = jg.GearPair(*(jg.Gear(z, 3.0, face_width=20.0) for z in teeth))
    stiffness = jg.sizing.iso_stiffness(pair)
    np.testing.assert_allclose([stiffness.single, stiffness.mesh], [single, mesh], rtol=5e-5)


def test_iso_stiffness_does_not_depend_on_which_gear_drives():
    """A published pair whose pinion has more teeth, and gears of equal teeth with different profile shifts."""

    def both(first, second, distance):
        return [float(jg.sizing.iso_stiffness(jg.GearPair(*gears, distance)).single) for gears in
                ((first, second), (second, first))]  # fmt: skip

    slow, fast = (
        jg.Gear(z, 45.0, 20.0, x, face_width=491.0, tip_diameter=d)
        for z, x, d in ((19, 0.6170, 978.808), (17, 0.8021, 905.470))
    )
    assert both(slow, fast, 863.0) == pytest.approx([14.34, 14.34], abs=5e-3)
    one, other = both(*(jg.Gear(25, 3.0, 20.0, x, face_width=20.0) for x in (0.1, 0.4)), None)
    assert one == pytest.approx(other, rel=1e-12)


def test_blank_factor_of_iso_stiffness():
    """C_R = 0.898 of a report for b_s = 0.25 b and s_R = 5 m_n; a web wider than 1.2 b counts as that."""
    solid = jg.Gear(24, 14.0, face_width=360.0)
    plain = float(jg.sizing.iso_stiffness(jg.GearPair(solid, solid)).mesh)

    def ratio(*gears):
        return float(jg.sizing.iso_stiffness(jg.GearPair(*gears)).mesh) / plain

    webbed = dataclasses.replace(solid, rim_thickness=70.0, web_thickness=90.0)
    assert ratio(webbed, webbed) == pytest.approx(0.898, abs=5e-4)
    assert ratio(webbed, solid) == pytest.approx(0.5 * (1 + ratio(webbed, webbed)), rel=1e-12)
    wide, wider = (dataclasses.replace(webbed, web_thickness=b) for b in (432.0, 500.0))
    assert ratio(wide, wide) == pytest.approx(ratio(wider, wider), rel=1e-12)


def test_harmonics_of_a_known_curve():
    psi = np.arange(32.0) / 32.0 - 0.5
    angle = 2 * np.pi * psi
    curve = 4.0 + 3.0 * np.cos(angle + np.deg2rad(40.0)) + 0.5 * np.cos(3 * angle - np.deg2rad(100.0))
    found = jax.jit(jg.harmonics, static_argnums=1)(curve, 4, first_phase=psi[0])
    np.testing.assert_allclose(found.amplitude, [3.0, 0.0, 0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(np.asarray(found.phase)[[0, 2]], [40.0, -100.0], atol=1e-9)


def test_peak_to_peak_does_not_hide_a_failure():
    assert jnp.isnan(jg.peak_to_peak(jnp.full(8192, jnp.nan)))
    assert float(jg.peak_to_peak(jnp.asarray([1.0, 4.0, 2.0]))) == 3.0


def test_smooth_peak_to_peak_rises_to_the_true_one():
    curve, smooth = np.sin(2 * np.pi * np.arange(64.0) / 64.0), jax.jit(jg.metrics.smooth_peak_to_peak)
    values = [float(smooth(curve, width)) for width in (1.0, 0.1, 0.01, 0.001)]
    assert np.all(np.diff(values) > 0)
    assert values[-1] == pytest.approx(2.0, abs=0.01)


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), compliance=jg.default_compliance("strain"), resolution=LINE)


@pytest.fixture(scope="module")
def cycle(mesh):
    return jg.solve(mesh, 50.0)


def test_pressure_at_the_pitch_point_is_hertz(cycle):
    """One pair, 103.7 N/mm, R = 6.98 mm, steel in plane strain: 731 MPa."""
    pressure = np.asarray(cycle.contact_pressure)[:, 0, 0].max()
    line_load, radius, modulus = 103.72, 6.984, 206e3 / (2 * (1 - 0.3**2))
    assert pressure == pytest.approx(np.sqrt(line_load * modulus / (np.pi * radius)), rel=2e-3)
    assert pressure == pytest.approx(700.0, abs=40.0)


@pytest.mark.parametrize("module", [0.2, 25.0])
def test_corner_pressure_is_the_same_at_every_size(cycle, module):
    """Of one pair scaled with its tip edges, under the torque that keeps the pressure of its flanks."""
    scale = module / 3.0
    pair = gear_pair(module=module, face_width=18.0 * scale, bores=(24.0 * scale, 70.0 * scale))
    scaled = jg.solve(jg.prepare(pair, compliance=jg.default_compliance("strain"), resolution=LINE), 50.0 * scale**3)
    for name in ("max_flank_pressure", "max_corner_pressure"):
        assert float(quantities[name](scaled)) == pytest.approx(float(quantities[name](cycle)), rel=1e-9)


def test_largest_contact_pressure_is_that_of_the_tip_edge_where_corners_touch(cycle, mesh):
    largest = {name: float(quantities[f"max_{name}_pressure"](cycle)) for name in ("flank", "corner", "contact")}
    assert largest["corner"] > largest["flank"] > 0
    assert largest["contact"] == largest["corner"]
    assert quantities["max_contact_pressure"].key == "max_contact_pressure_MPa"
    # with less load than the corner gap needs, only flanks touch
    light = jg.solve(mesh, 0.01, pinion=jg.TipRelief(20.0, 5.0), wheel=jg.TipRelief(20.0, 5.0))
    assert float(quantities["max_corner_pressure"](light)) == 0.0
    assert float(quantities["max_contact_pressure"](light)) == float(quantities["max_flank_pressure"](light)) > 0


def test_pressure_of_a_tip_edge_is_hertz_with_that_edge_and_the_flank_of_its_mate(mesh):
    """Before the path the wheel's tip touches the pinion's flank, behind it the pinion's tip the wheel's."""
    gears = {name: dataclasses.replace(getattr(mesh.pair, name), tip_edge_radius=edge) for name, edge in EDGES.items()}
    kinematics = dataclasses.replace(mesh.kinematics, pair=dataclasses.replace(mesh.pair, **gears))
    path, contact = np.asarray(kinematics.path)[:, 0], kinematics.path_of_contact
    pressure = np.asarray(corner_pressure(kinematics, jnp.full((*path.shape[:1], 1, path.shape[1]), 100.0)))[:, 0]
    flanks = [np.asarray(side.contact_roll_length)[:, 0] for side in kinematics.sides]
    before, behind = path < float(contact.start), path > float(contact.end)
    assert before.any() and behind.any() and not pressure[~before & ~behind].any()
    for there, edge, mate in ((before, EDGES["wheel"], flanks[0]), (behind, EDGES["pinion"], flanks[1])):
        curvature = 1 / edge + 1 / mate[there]
        wanted = np.sqrt(100.0 * 206e3 / (2 * (1 - 0.3**2)) * curvature / np.pi)
        np.testing.assert_allclose(pressure[there], wanted, rtol=1e-12)


def test_stiffness_definitions(cycle, mesh):
    secant_of = jax.jit(jg.secant_stiffness)
    secant = secant_of(cycle)
    np.testing.assert_allclose(np.multiply(secant, cycle.transmission_error), float(cycle.force), rtol=1e-12)
    # flanks that are apart without a load are not deflected by what brings them together
    apart = {name: getattr(cycle, name) + 3.0 for name in ("transmission_error", "unloaded_transmission_error")}
    np.testing.assert_allclose(secant_of(dataclasses.replace(cycle, **apart)), secant, rtol=1e-12)
    more = jg.solve(mesh, 50.01)
    slope = float(more.force - cycle.force) / np.subtract(more.transmission_error, cycle.transmission_error)
    np.testing.assert_allclose(cycle.tangent_stiffness, slope, rtol=2e-3)


def test_loaded_teeth_touch_beyond_the_theoretical_path(cycle):
    ratio = float(cycle.kinematics.path_of_contact.contact_ratio)
    effective, shock = jax.jit(lambda cycle: (jg.effective_contact_ratio(cycle), jg.metrics.contact_shock(cycle)))(
        cycle
    )
    assert float(effective) > ratio + 0.05
    assert float(shock.approach) > 0.0 and float(shock.recess) > 0.0 and float(shock.force) > 0.0


@pytest.mark.parametrize("speed", [1000.0, 4000.0])
def test_flash_temperature_is_that_of_blok_on_steel(cycle, speed):
    """2 / sqrt(pi) is rounded to 1.13; the half width of the contact follows from its load and Hertzian pressure."""
    there = np.asarray(cycle.contact_pressure)[:, 0] > 0
    load, pressure = (np.asarray(of)[:, 0][there] for of in (1e3 * cycle.line_load, 1e6 * cycle.contact_pressure))
    turning = speed * 2 * np.pi / 60 * np.array([1.0, 19 / 48])
    first, second = (
        1e-3 * np.asarray(of.contact_roll_length)[:, 0][there] * rate for of, rate in zip(cycle.sides, turning)
    )
    heat = 0.05 * load * np.abs(first - second)
    sink = 13_800.0 * (np.sqrt(first) + np.sqrt(second)) * np.sqrt(2 * 2 * load / (np.pi * pressure))
    rise = np.asarray(jg.metrics.flash_temperature(cycle, speed, friction=0.05))[:, 0]
    np.testing.assert_allclose(rise[there], 2 / np.sqrt(np.pi) * heat / sink, rtol=2e-3, atol=1e-9)
    assert rise[:, 0].max() == pytest.approx(0.0, abs=1e-9)  # at the pitch point
