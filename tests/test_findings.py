"""Doubts: usual designs raise none, and every slip of a unit or of a digit raises the one that names it."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import pytest
from catalogue import LINE, gear_pair, high_contact_ratio_pair

import jaxgear as jg
from jaxgear.contact.kinematics import kinematics
from jaxgear.metrics import Lubricant, findings_of


def names(cycle, **options):
    return {(finding.key, finding.where) for finding in findings_of(cycle, **options)}


def oil(**values):
    return Lubricant(**{"viscosity_40": 100.0, "viscosity_100": 11.1, "temperature": 90.0, "roughness": 0.5, **values})


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=LINE)


@pytest.fixture(scope="module")
def cycle(mesh):
    relief = jg.TipRelief(6.9, 3.4)
    return jg.solve(mesh, 50.0, pinion=relief, wheel=relief)


def replaced(cycle, where, **values):
    """The cycle with other numbers of a gear or of its material."""
    for name, value in values.items():

        def number(cycle, name=name):
            gear = getattr(cycle.kinematics.pair, where)
            return getattr(gear if hasattr(gear, name) else gear.material, name)

        cycle = eqx.tree_at(number, cycle, jnp.asarray(value), is_leaf=lambda leaf: leaf is None)
    return cycle


def test_a_usual_design_has_no_finding(cycle):
    assert findings_of(cycle, torque_range=(25.0, 100.0), speed=3000.0, friction=0.06) == ()
    assert findings_of(cycle, oil_friction=0.06, bulk_temperature=95.0, lubricant=oil()) == ()
    assert names(cycle, pinion=jg.ProfileSlope(-4.0) + jg.LeadCrowning(-4.0)) == set()  # which may have either sign


def test_tip_edges_that_dig_in_are_asked_about(mesh):
    """Under the full load those of unmodified gears do, beyond what any flank endures; without load nothing does."""
    assert names(jg.solve(mesh, 50.0)) == {("corner pressure", "")}
    assert names(jg.solve(mesh, 1.0)) == set()


@pytest.mark.parametrize(
    "options, expected",
    [
        ({"pinion": jg.TipRelief(7000.0, 3.4)}, ("depth of the modification in modules", "pinion")),
        ({"wheel": jg.TipRelief(0.007, 3.4)}, ("depth of the modification", "wheel")),
        ({"wheel": jg.TipRelief(7.0, 34.0)}, ("length of the modification", "wheel")),
        ({"pinion": jg.TipRelief(7.0, 3.0) + jg.RootRelief(7.0, 30.0)}, ("length of the modification", "pinion")),
        ({"pinion": jg.TipRelief(-7.0, 3.4)}, ("amount of the modification", "pinion")),
        ({"pinion": jg.ProfileCrowning(3.0) + jg.EndRelief(-7.0, 2.0)}, ("amount of the modification", "pinion")),
        ({"lubricant": oil(temperature=-50.0)}, ("temperature of the oil", "")),
        ({"lubricant": oil(cooling_factor=1e-300)}, ("cooling factor", "")),
        ({"pinion": jg.EndRelief(7.0, 15.0)}, ("length of the modification", "pinion")),
        ({"friction": 3.7}, ("coefficient of friction", "")),
        ({"oil_friction": 0.3}, ("coefficient of friction of the oil", "")),
        ({"oil_friction": float("nan")}, ("coefficient of friction of the oil", "")),
        ({"bulk_temperature": 190.0}, ("bulk temperature", "")),
        ({"speed": 1e6}, ("pitch line velocity", "")),
        ({"torque_range": (60.0, 100.0)}, ("torque", "")),
    ],
)
def test_slips_of_flanks_and_operation(cycle, options, expected):
    assert names(cycle, **options) == {expected}


@pytest.mark.parametrize(
    "values, expected",
    [
        ({"elastic_modulus": 2e11}, "elastic modulus"),
        ({"elastic_modulus": 206.0}, "elastic modulus"),
        ({"density": 7.85}, "density"),
        ({"tip_edge_radius": 5.0}, "tip edge radius in modules"),
        ({"face_width": 5000.0}, "face width in modules"),
        ({"face_width": 5.0}, "face width in modules"),
    ],
)
def test_slips_of_gears(cycle, values, expected):
    wrong = replaced(replaced(cycle, "wheel", **values), "pinion", **values)
    assert expected in {name for name, _ in names(wrong)}


def test_end_reliefs_beyond_the_mate(cycle):
    """A gear that overhangs the load by 2 mm at both ends has 2 mm of relief without effect."""
    width = float(cycle.kinematics.pair.wheel.face_width)
    wide, relief = replaced(cycle, "pinion", face_width=width + 4.0), ("length of the end relief", "pinion")
    assert relief in names(wide, pinion=jg.EndRelief(7.0, 1.9))
    assert relief in names(wide, pinion=jg.TipRelief(7.0, 3.0) + jg.EndRelief(7.0, 1.9, side="positive"))
    assert relief not in names(wide, pinion=jg.EndRelief(7.0, 2.1))
    assert not {name for name, where in names(wide, wheel=jg.EndRelief(7.0, 1.9)) if where == "wheel"}
    aside = replaced(wide, "pinion", face_width=width + 2.0)
    aside = eqx.tree_at(lambda c: c.kinematics.pair.axial_offset, aside, jnp.asarray(1.0))
    assert relief in names(aside, pinion=jg.EndRelief(7.0, 1.9, side="negative"))
    assert relief not in names(aside, pinion=jg.EndRelief(7.0, 1.9, side="positive"))


@pytest.mark.parametrize("wider, found_so", [(0.7, False), (2.0, True)])
def test_one_slice_does_not_show_load_beside_an_overhang(cycle, wider, found_so):
    wheel = cycle.kinematics.pair.wheel
    wide = replaced(cycle, "pinion", face_width=float(wheel.face_width + wider * wheel.module))
    assert (("overhang in modules, one slice", "") in names(wide)) == found_so


def test_wide_teeth_are_not_in_plane_stress(cycle):
    """20 modules are usual between the planes."""
    wide = replaced(replaced(cycle, "wheel", face_width=63.0), "pinion", face_width=63.0)
    assert names(wide) == set()
    stress = eqx.tree_at(lambda c: c.kinematics, wide, replace(wide.kinematics, plane="stress"))
    assert names(stress) == {("face width in modules, plane stress", "")}


def test_results_beyond_materials_and_contact(cycle, mesh):
    heavy = jg.solve(mesh, 2000.0)
    assert {("flank pressure", ""), ("root stress", "pinion"), ("root stress", "wheel")} <= names(heavy)
    deep = jg.solve(mesh, 2.0, pinion=jg.TipRelief(60.0, 5.5), wheel=jg.TipRelief(60.0, 5.5))
    assert ("effective contact ratio", "") in names(deep)


def test_nominal_stress_is_not_made_for_contact_ratios_above_two(cycle):
    slim = kinematics(high_contact_ratio_pair(), cycle.kinematics.first_phase, LINE, "strain")
    assert float(slim.path_of_contact.contact_ratio) > 2
    assert ("contact ratio", "") in names(replace(cycle, kinematics=slim))


def test_a_finding_reads_like_a_question_of_a_colleague(cycle):
    (finding,) = findings_of(cycle, friction=3.7)
    usual = "lubricated gears 0.03 to 0.12, dry steel 0.4 to 0.6"
    assert str(finding) == f"coefficient of friction 3.7 is more than 0.5 ({usual})"
