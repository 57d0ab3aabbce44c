"""The table [rating] of design files: what it means, what it refuses, and its quantities."""

import re
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from commands import LINE
from design_texts import asked_sweep, loaded
from helical_pairs import SIZES, flanks, pair_of

import jaxgear as jg
from jaxgear.contact.kinematics import kinematics
from jaxgear.geometry import margins
from jaxgear.io import DesignFileError, quantities_of_tables
from jaxgear.metrics import MESH_QUANTITIES, Analysis, Lubricant
from jaxgear.numerics import quick_jit
from jaxgear.rating import GearRating, Rating, rate
from jaxgear.rating.quantities import RATING_QUANTITIES, ends_relief

GEAR = """
[{name}]
teeth = {teeth}
module = 3.0
face_width = 18.0
quality_class = 5
"""
TEXT = (
    GEAR.format(name="pinion", teeth=19)
    + GEAR.format(name="wheel", teeth=48)
    + f"""
[resolution]
{LINE}
[load]
torque = 150.0
speed = 3000.0
[lubricant]
viscosity_40 = 100.0
viscosity_100 = 11.0
temperature = 70.0
roughness = 0.5
[rating]
service_life = 20000.0
application_factor = 1.25
[rating.pinion]
heat_treatment = "case_hardened"
flank_roughness_ra = 0.5
root_roughness_rz = 16.0
[rating.wheel]
heat_treatment = "through_hardened"
hardness = 300.0
yield_strength = 800.0
flank_roughness_rz = 4.0
root_roughness_rz = 16.0
"""
)
SPECTRUM = "service_life = 20000.0\ntorques = [200.0, 100.0]\nweights = [{}]\n"


def with_lines(**replaced):
    text = TEXT
    for old, new in replaced.items():
        line = re.search(rf"^{old} = .*$", text, re.MULTILINE)
        text = text[: line.start()] + new + text[line.end() :]
    return text


def test_settings_of_a_file(tmp_path):
    design = loaded(tmp_path, TEXT)
    made = design.tables["rating"].settings(design)
    assert made.pinion.quality_class == 5 and float(made.lubricant.viscosity_40) == 100
    assert float(made.wheel.pitting_strength) == pytest.approx(1.313 * 300 + 373)
    names = {quantity.name for quantity in quantities_of_tables(design) if quantity.takes is Rating}
    assert {"pinion_pitting_safety", "wheel_root_safety", "pinion_service_life"} <= names
    spectrum = loaded(tmp_path, with_lines(application_factor="", service_life=SPECTRUM.format("0.25, 0.75")))
    loads = spectrum.tables["rating"].settings(spectrum).loads
    assert np.allclose(loads.torques, [200.0, 100.0]) and np.allclose(loads.speeds, 3000.0)


def test_what_both_gears_have_in_common_is_said_once(tmp_path):
    def settings(text):
        design = loaded(tmp_path, text)
        return design.tables["rating"].settings(design)

    twice = TEXT[: TEXT.index("[rating.pinion]")] + "[rating.gears]\n"
    twice += 'heat_treatment = "through_hardened"\nhardness = 300.0\nyield_strength = 800.0\nflank_roughness_rz = 4.0\n'
    both = settings(twice + "root_roughness_rz = 16.0\n")
    assert eqx.tree_equal(both.pinion, both.wheel) and float(both.pinion.hardness) == 300
    other = settings(twice + "root_roughness_rz = 16.0\n[rating.pinion]\nhardness = 320.0\n")
    assert eqx.tree_equal(other.wheel, both.wheel) and float(other.pinion.hardness) == 320
    with pytest.raises(DesignFileError, match=r"rating.pinion.root_roughness_rz: missing, Y_RrelT needs it"):
        settings(twice)


def test_a_quantity_named_like_one_of_strengths_is_that_of_the_table(tmp_path):
    asked = TEXT + '[variables]\na = { low = 1.0, high = 9.0, unit = "um" }\n'
    asked += '[[pinion.modification]]\ntype = "tip_relief"\namount = "a"\nlength = 4.0\n'
    asked += '[sweep]\nsamples = 2\nresults = ["ppte", "pinion_pitting_safety", "rated_dynamic_factor"]\n'
    results = asked_sweep(loaded(tmp_path, asked)).results
    assert results[1].takes is Rating and results[2].takes is Rating
    with pytest.raises(DesignFileError, match=r"needs the table \[strength\] or the table \[rating\]"):
        start, end = asked.index("[rating]"), asked.index("[variables]")
        asked_sweep(loaded(tmp_path, asked[:start] + asked[end:]))


@pytest.mark.parametrize(
    ("replaced", "message"),
    [
        ({"hardness": "hardness = 500.0"}, r"rating.wheel.hardness: 500 HV must be from 200 to 360 HV"),
        ({"hardness": ""}, r"rating.wheel.hardness: missing"),
        ({"heat_treatment": ""}, r"rating.pinion.heat_treatment: missing, the group of materials"),
        ({"heat_treatment": 'heat_treatment = "hard"'}, r"rating.pinion.heat_treatment"),
        ({"flank_roughness_ra": ""}, r"rating.pinion.flank_roughness_rz: missing, Z_R needs it"),
        ({"root_roughness_rz": ""}, r"rating.pinion.root_roughness_rz: missing, Y_RrelT needs it"),
        ({"quality_class": "", "teeth": "quality_class = 5\nteeth = 19"}, None),
        ({"speed": ""}, r"load.speed"),
        ({"viscosity_40": "viscosity_40 = 0.0"}, r"lubricant.viscosity_40"),
        ({"application_factor": "application_factor = 0.2"}, r"rating.application_factor: 0.2 must be"),
        ({"application_factor": "edition = 2006"}, r"rating.edition"),
        ({"application_factor": "", "service_life": SPECTRUM.format("0.5, 0.6")}, r"rating.weights.*sum to 1.1"),
        ({"service_life": SPECTRUM.format("0.5, 0.5")}, r"rating.application_factor: has no effect beside a load"),
        ({"application_factor": "", "service_life": "torques = [1.0]"}, r"rating.service_life: missing"),
        ({"application_factor": "", "service_life": "torques = [-1.0]"}, r"rating.torques\[0\]"),
    ],
)
def test_files_that_are_refused(tmp_path, replaced, message):
    if message is None:
        loaded(tmp_path, with_lines(**replaced))
        return
    with pytest.raises(DesignFileError, match=message):
        loaded(tmp_path, with_lines(**replaced))


def test_what_does_not_go_with_the_table(tmp_path):
    with pytest.raises(DesignFileError, match=r"strength.pitting: has no effect beside \[rating\]"):
        loaded(tmp_path, TEXT + "[strength]\npitting = 1500.0\n")
    loaded(tmp_path, TEXT + "[strength]\npressure = 1500.0\n")
    polymer = TEXT.replace("quality_class = 5", 'quality_class = 5\nmaterial = "pom"', 1)
    with pytest.raises(DesignFileError, match=r"pinion.material.*VDI 2736"):
        loaded(tmp_path, polymer + "[materials.pom]\nelastic_modulus = 3000.0\n")
    without_oil = TEXT[: TEXT.index("[lubricant]")] + TEXT[TEXT.index("[rating]") :]
    with pytest.raises(DesignFileError, match=r"rating: Z_L needs the table \[lubricant\]"):
        loaded(tmp_path, without_oil)


def cycle_of(pair, flanks, torque, load):
    """A mesh cycle with a load over the face, (slices,), that all positions have."""
    of = kinematics(pair, jnp.asarray(0.0), SIZES, "strain")
    none, curve = jnp.zeros((3, 5, 8)), jnp.zeros(8)
    line_load = none.at[1].set(jnp.broadcast_to(load[:, None], (5, 8)))
    force, status = jnp.sum(line_load, axis=1) * pair.face_width / 5, jnp.zeros(8, jnp.int8)
    point = jg.OperatingPoint(torque, 2000.0)
    known = line_load, force, none, none, none, none, curve, curve, status
    return jg.MeshCycle(of, margins(pair), point, flanks["pinion"], flanks["wheel"], curve, curve, *known)


def test_quantities_take_the_load_over_the_face_and_the_relief_of_the_contact_analysis():
    pair, load = pair_of(None), jnp.linspace(100.0, 140.0, 5)
    cycle = cycle_of(pair, flanks(slope=10.0, relief=20.0), 150.0, load)
    gear = GearRating("case_hardened", flank_roughness_rz=4.0, root_roughness_rz=16.0, quality_class=5)
    rating = Rating(pinion=gear, wheel=gear, lubricant=Lubricant(100.0, 11.0, 70.0, 0.5), service_life=1e4)
    factor = 140 / 120
    known = {"path": cycle.kinematics.path_of_contact, "face_load_factor": factor, "tip_relief": 20.0}

    @quick_jit
    def both(cycle):
        analysis = Analysis(cycle)
        found = rate(pair, cycle.torque, cycle.operating_point.speed, rating, **known)
        numbers = {
            "rated_face_load_factor": factor,
            "pinion_pitting_safety": found.pitting.safety[0],
            "wheel_root_safety": found.bending.safety[1],
            "rated_dynamic_factor": found.factors.dynamic,
        }
        relief, stress = ends_relief(analysis), found.bending.stress[0]
        return relief, stress, {name: (rating.quantity(name)(analysis), of) for name, of in numbers.items()}

    relief, stress, numbers = both(cycle)
    assert float(relief) == pytest.approx(20.0, rel=1e-6)
    for name, (found, expected) in numbers.items():
        assert float(found) == pytest.approx(float(expected), rel=1e-6), name
    # by the same stresses, without load factors, the strengths as a whole
    assert float(MESH_QUANTITIES["pinion_root_stress"](cycle)) < float(stress)
    with pytest.raises(ValueError, match="needs service_life"):
        replace(rating, service_life=None).quantity("pinion_service_life")
    assert all(quantity.label and quantity.takes is Rating for quantity in RATING_QUANTITIES.values())
