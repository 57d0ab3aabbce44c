"""Design files say everything the library can do, and every slip in one is a single line that names the key."""

import functools
import json
import math
import os
import re
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from commands import LINE
from design_texts import asked_sweep, flank, loaded, text

import jaxgear as jg
from jaxgear.compliance.laws import LinearLaw
from jaxgear.geometry import path_of_contact
from jaxgear.io import (
    DesignFileError,
    Search,
    describe,
    flank_rows,
    load_design,
    reference,
    result_folder,
    write_design,
    write_summary,
)
from jaxgear.io.design_file import file_section
from jaxgear.io.gears import GearSection
from jaxgear.io.model_table import ModelSection
from jaxgear.io.optimize_table import METHODS_WITHOUT_VARIABLES, method_options, optimize_of
from jaxgear.io.table_keys import family, section_of
from jaxgear.io.tables import LoadSection, further_tables
from jaxgear.io.tolerance_table import tolerance_of
from jaxgear.microgeometry import AbstractCurve, AbstractModification, NoModification, ParabolicLinear
from jaxgear.numerics import number

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.toml"))

RELIEF = """
[[pinion.modification]]
type = "tip_relief"
amount = "height"
length = 3.4
"""


@pytest.fixture
def load(tmp_path):
    """Loads a design file with the given content, text or bytes."""
    return functools.partial(loaded, tmp_path)


@eqx.filter_jit
def at_points(modification, points):
    return modification(points)


def removed(modification):
    """Material removed [um] over profile and face, by one program per kind of modification."""
    with jax.numpy_rank_promotion("allow"):  # the points of `flank` have axes of their own
        return np.broadcast_to(at_points(modification, flank()), (7, 33))


MODIFICATIONS = [
    ('type = "tip_relief"\namount = 7\nlength = 3.4', jg.TipRelief(7.0, 3.4)),
    (
        'type = "root_relief"\namount = 5.0\nlength = 4.0\ncurve = { type = "linear" }',
        jg.RootRelief(5.0, 4.0, jg.Linear()),
    ),
    ('type = "profile_crowning"\namount = 3.0', jg.ProfileCrowning(3.0)),
    ('type = "profile_slope"\namount = -2.0', jg.ProfileSlope(-2.0)),
    ('type = "lead_crowning"\namount = 5.0', jg.LeadCrowning(5.0)),
    ('type = "lead_slope"\namount = 4.0', jg.LeadSlope(4.0)),
    ('type = "end_relief"\namount = 6.0\nlength = 2.0', jg.EndRelief(6.0, 2.0)),
    ('type = "end_relief"\namount = 6.0\nlength = 2.0\nside = "negative"', jg.EndRelief(6.0, 2.0, side="negative")),
    (
        'type = "tabulated_profile"\nposition = [2, 9, 18]\namount = [0.0, 1.0, 4.0]',
        jg.TabulatedProfile([2.0, 9.0, 18.0], [0.0, 1.0, 4.0]),
    ),
    (
        'type = "tabulated_profile"\nposition = [5.0, 20.0, 38.0]\namount = [0.0, 1.0, 4.0]\n'
        'coordinate = "roll_angle"\nmethod = "monotonic"',
        jg.TabulatedProfile([5.0, 20.0, 38.0], [0.0, 1.0, 4.0], coordinate="roll_angle", method="monotonic"),
    ),
]
CURVES = [
    ('{ type = "linear" }', jg.Linear()),
    ('{ type = "parabolic" }', jg.Parabolic()),
    ('{ type = "parabolic_linear", node = 0.3 }', ParabolicLinear(0.3)),
    ('{ type = "power", exponent = 1.5 }', jg.Power(1.5)),
    ('{ type = "quadratic", b0 = 0.1, b1 = 0.4, b2 = 0.5 }', jg.Quadratic(0.1, 0.4, 0.5)),
    ('{ type = "polynomial", coefficients = [0.0, 0.2, 0.3, 0.5] }', jg.Polynomial([0.0, 0.2, 0.3, 0.5])),
    ('{ type = "sinusoidal", b0 = 1.5, b1 = 0.0, b2 = 3.1415 }', jg.Sinusoidal(1.5, 0.0, 3.1415)),
    ('{ type = "spline", values = [0.0, 0.3, 0.6, 1.0] }', jg.Spline([0.0, 0.3, 0.6, 1.0])),
]


@pytest.mark.parametrize("table, expected", MODIFICATIONS, ids=lambda value: type(value).__name__)
def test_every_modification_can_be_written(load, table, expected):
    _, wheel = load(text(wheel=f"[[wheel.modification]]\n{table}")).design({})
    assert type(wheel) is type(expected)
    np.testing.assert_allclose(removed(wheel), removed(expected), rtol=1e-14, atol=1e-14)
    assert np.ptp(removed(wheel)) > 1  # the comparison has something to compare


@pytest.mark.parametrize("table, curve", CURVES, ids=lambda value: type(value).__name__)
def test_every_curve_can_be_written(load, table, curve):
    tail = f'[[pinion.modification]]\ntype = "tip_relief"\namount = 8.0\nlength = 5.0\ncurve = {table}\n'
    pinion, _ = load(text(pinion=tail)).design({})
    np.testing.assert_allclose(removed(pinion), removed(jg.TipRelief(8.0, 5.0, curve)), rtol=1e-14, atol=1e-14)


def test_every_modification_and_curve_of_the_library_has_a_name_in_design_files():
    from jaxgear.microgeometry import Scaled, Sum

    def of_library(base):
        return {cls for cls in base.__subclasses__() if cls.__module__.startswith("jaxgear.microgeometry")}

    assert set(family(AbstractModification).values()) >= of_library(AbstractModification) - {Scaled, Sum}
    assert set(family(AbstractCurve).values()) >= of_library(AbstractCurve)


def test_modifications_of_one_gear_add_up(load):
    tables = "".join(f"[[pinion.modification]]\n{table}\n" for table, _ in MODIFICATIONS)
    pinion, wheel = load(text(pinion=tables)).design({})
    np.testing.assert_allclose(removed(pinion), sum(removed(expected) for _, expected in MODIFICATIONS), atol=1e-12)
    assert not removed(wheel).any()


def test_a_described_modification_reads_back_as_itself(load):
    original = sum((expected for _, expected in MODIFICATIONS[1:]), MODIFICATIONS[0][1]) + jg.TipRelief(
        4.0, 5.0, jg.Polynomial([0.0, 0.5, 0.5])
    )

    def toml(value):
        if isinstance(value, dict):
            return "{ " + ", ".join(f"{name} = {toml(item)}" for name, item in value.items()) + " }"
        return json.dumps(value)

    tables = ", ".join(toml(part) for part in describe(original))
    pinion, _ = load(text(pinion=f"modification = [{tables}]")).design({})
    np.testing.assert_allclose(removed(pinion), removed(original), rtol=1e-14, atol=1e-14)
    assert eqx.tree_equal(pinion, original, rtol=1e-14)


def test_gear_numbers_reach_the_gears(load):
    pinion = (
        "profile_shift = 0.3\nbore_diameter = 24.0\ntip_edge_radius = 0.05\nroot_radius = 0.3\n"
        "material = { elastic_modulus = 71000, poisson_ratio = 0.33, density = 2700 }"
    )
    pair = load(text(pinion=pinion, tail="[pair]\ncenter_distance = 101.4")).pair()
    values = {name: float(getattr(pair.pinion, name)) for name in ("teeth", "module", "face_width", "profile_shift")}
    assert values == {"teeth": 19.0, "module": 3.0, "face_width": 20.0, "profile_shift": 0.3}
    assert float(pair.pinion.bore_diameter) == 24.0 and float(pair.pinion.root_radius) == 0.3
    assert float(pair.pinion.tip_edge_radius) == 0.05
    assert float(pair.pinion.material.elastic_modulus) == 71000.0
    assert float(pair.wheel.material.elastic_modulus) == 206000.0
    assert float(pair.center_distance) == 101.4


def test_defaults_are_those_of_the_library(load):
    file = load(text())
    pinion = jg.Gear(19, 3.0, face_width=20.0, material=jg.Material())
    assert eqx.tree_equal(file.pair(), jg.GearPair(pinion, jg.Gear(48, 3.0, face_width=18.0, material=jg.Material())))
    assert eqx.tree_equal(file.resolution(), jg.Resolution(pairs=2))
    assert eqx.tree_equal(file._middle.compliance, jg.default_compliance())
    assert file.torque == 50.0 and file.torque_range == (25.0, 100.0)
    assert file.title == "gear" and file.bounds == {} and file.tables == {} and optimize_of(file).method is None


MODELS = [
    ('preset = "legacy"', jg.legacy_compliance()),
    (
        'plane = "strain"\nbody = { type = "elastic_ring", hub_windup = false }',
        jg.default_compliance("strain", hub_windup=False),
    ),
    (
        'body = { type = "elastic_ring", coupling = false }',
        jg.Compliance(
            jg.compliance.Beam(), jg.compliance.ElasticRing(coupling=False), jg.compliance.DepthReferenced(), "auto"
        ),
    ),
    (
        'body = "sainsot"\ncontact = "constant_hertz"',
        jg.Compliance(jg.compliance.Beam(), jg.compliance.Sainsot(), jg.compliance.ConstantHertz()),
    ),
    (
        'body = "half_plane"\ncontact = "weber"',
        jg.Compliance(jg.compliance.Beam(), jg.compliance.HalfPlane(), jg.compliance.Weber()),
    ),
    (
        'contact = "palmgren"',
        jg.Compliance(jg.compliance.Beam(), jg.compliance.ElasticRing(), jg.compliance.Palmgren()),
    ),
    (
        'contact = { type = "nonlinear_power" }',
        jg.Compliance(jg.compliance.Beam(), jg.compliance.ElasticRing(), jg.compliance.NonlinearPower()),
    ),
    (
        'contact = "center_distance"',
        jg.Compliance(jg.compliance.Beam(), jg.compliance.ElasticRing(), jg.compliance.CenterDistance()),
    ),
    (
        'contact = "kovalskii"',
        jg.Compliance(jg.compliance.Beam(), jg.compliance.ElasticRing(), jg.compliance.Kovalskii()),
    ),
]


@pytest.mark.parametrize("model, expected", MODELS, ids=lambda value: value if isinstance(value, str) else "")
def test_model_table_chooses_the_compliance(load, model, expected):
    assert eqx.tree_equal(load(text(tail=f"[model]\n{model}"))._middle.compliance, expected)


def test_design_is_traceable_and_a_variable_may_serve_both_gears(load):
    relief = '[[{}.modification]]\ntype = "tip_relief"\namount = "height"\nlength = "reach"\n'
    variables = (
        "[variables]\nheight = { low = 0, high = 20.0 }\nreach = { low = 1.0, high = 5.0, unit = 'mm' }\n"
        "k = { low = 0, high = 2.0 }\n"
    )
    curve = 'curve = { type = "polynomial", coefficients = [0.0, "k", 0.5] }\n'
    file = load(text(pinion=relief.format("pinion") + curve, wheel=relief.format("wheel"), tail=variables))
    assert file.bounds == {"height": (0.0, 20.0), "reach": (1.0, 5.0), "k": (0.0, 2.0)}
    assert file.units == {"height": "um", "reach": "mm", "k": ""}

    def total(height):
        pinion, wheel = file.design({"height": height, "reach": jnp.asarray(4.0), "k": jnp.asarray(0.5)})
        return jnp.sum(pinion(flank())) + jnp.sum(wheel(flank()))

    heights = jnp.asarray([2.0, 7.0])
    values, slopes = map(np.asarray, jax.jit(jax.vmap(jax.value_and_grad(total)))(heights))
    np.testing.assert_allclose(values, slopes * np.asarray(heights), rtol=1e-12)  # both are proportional to the height
    pinion, wheel = file.design({"height": 7.0, "reach": 4.0, "k": 0.5})
    np.testing.assert_allclose(removed(pinion), removed(jg.TipRelief(7.0, 4.0, jg.Polynomial([0.0, 0.5, 0.5]))))
    np.testing.assert_allclose(removed(wheel), removed(jg.TipRelief(7.0, 4.0)))
    with pytest.raises(ValueError, match="must be those of the file: height, k, reach"):
        file.design({"height": 7.0})


VARIABLE = "[variables]\nheight = { low = 0.0, high = 20.0 }\n"

# what is wrong -> content, and what the message says after the name of the file
MALFORMED = {
    "unknown table": (text(tail="[lode]\ntorque = 1.0"), 'lode: unknown key, did you mean "load"?'),
    "unknown gear key": (text(pinion="face_widht = 3.0"), 'pinion.face_widht: unknown key, did you mean "face_width"?'),
    "unknown material key": (
        text(wheel="material = { stiff = 206000.0 }"),
        "wheel.material.stiff: unknown key, must be one of density, elastic_modulus,",
    ),
    "unknown load key": (text(load="torqe = 3"), 'load.torqe: unknown key, did you mean "torque"?'),
    "unknown modification key": (
        text(pinion=RELIEF.replace('"height"', "1.0") + RELIEF.replace('"height"', "1.0").replace("length", "lenght")),
        'pinion.modification[1].lenght: unknown key, did you mean "length"?',
    ),
    "unknown curve key": (
        text(pinion=RELIEF.replace('"height"', "1.0") + 'curve = { type = "power", expnent = 2.0 }'),
        'pinion.modification[0].curve.expnent: unknown key, did you mean "exponent"?',
    ),
    "unknown variable key": (
        text(pinion=RELIEF, tail="[variables]\nheight = { low = 0.0, hihg = 1.0 }"),
        'variables.height.hihg: unknown key, did you mean "high"?',
    ),
    "unknown modification": (
        text(pinion='[[pinion.modification]]\ntype = "tip_releif"\namount = 1.0'),
        'pinion.modification[0].type: "tip_releif" is not known, did you mean "tip_relief"?',
    ),
    "modification without type": (
        text(pinion="[[pinion.modification]]\namount = 1.0"),
        "pinion.modification[0].type: missing, must be one of no_modification, tip_relief,",
    ),
    "unknown curve": (
        text(pinion=RELIEF.replace('"height"', "1.0") + 'curve = { type = "cubic" }'),
        'pinion.modification[0].curve.type: "cubic" is not known',
    ),
    "unknown plane": (
        text(tail='[model]\nplane = "stres"'),
        'model.plane: "stres" is not known, did you mean "stress"?',
    ),
    "unknown body": (
        text(tail='[model]\nbody = "half_plain"'),
        'model.body: "half_plain" is not known, did you mean "half_plane"?',
    ),
    "unknown contact": (text(tail='[model]\ncontact = "hertz"'), 'model.contact: "hertz" is not known'),
    "missing key": (text().replace("teeth = 48\n", ""), "wheel.teeth: missing, this key is required"),
    "missing table": (text().partition("[load]")[0], "load: missing, this key is required"),
    "string for a number": (
        text().replace("module = 3.0", 'module = "3.0"'),
        "pinion.module: must be a number, not a string",
    ),
    "fraction for a count": (
        text().replace("teeth = 19", "teeth = 19.5"),
        "pinion.teeth: must be a whole number, not a number",
    ),
    "list for a value": (
        text(pinion=RELIEF.replace('"height"', "[1.0]")),
        "pinion.modification[0].amount: must be a number or the name of a variable, not a list",
    ),
    "true for a number": (
        text(load="speed = true"),
        "load.speed: must be a number or the name of a variable, not true or false",
    ),
    "number for a table": ("pinion = 3\n" + text().replace("[pinion]", "[other]"), "pinion: must be a table, not"),
    "wrong length": (text(load="torque_range = [1.0]"), "load.torque_range: must be a list of length 2, not 1"),
    "wrong list element": (
        text(wheel='[[wheel.modification]]\ntype = "tabulated_profile"\nposition = [1.0, "x"]\namount = [1.0, 2.0]'),
        'wheel.modification[0].position[1]: "x" is not a variable, there is no [variables] table',
    ),
    "torque of zero": (text().replace("torque = 50.0", "torque = 0.0"), "load.torque: 0 N m must be greater than 0"),
    "torque not a number": (text().replace("torque = 50.0", "torque = nan"), "load.torque: nan must be finite"),
    "range reversed": (
        text(load="torque_range = [80.0, 20.0]"),
        "load.torque_range[1]: 20 N m must be greater than 80 N m",
    ),
    "physical error of a gear": (
        text().replace("face_width = 20.0", "face_width = -20.0"),
        "pinion.face_width: -20 mm must be greater than 0 mm",
    ),
    "physical error of a material": (
        text(pinion="material = { poisson_ratio = 0.7 }"),
        "pinion.material.poisson_ratio: 0.7 must be at least 0 and at most 0.5",
    ),
    "physical error of the pair": (
        text().replace("module = 3\n", "module = 4.0\n"),
        "wheel.module: 4 mm must equal the pinion's, 3 mm",
    ),
    "faces apart": (text(tail="[pair]\naxial_offset = 90.0"), "pair.axial_offset: 90 mm must be greater than"),
    "impossible centre distance": (text(tail="[pair]\ncenter_distance = 90.0"), "pair.center_distance: 90 mm must be"),
    "physical error of a modification": (
        text(pinion=RELIEF.replace('"height"', "1.0").replace("3.4", "-3.4")),
        "pinion.modification[0].length: -3.4 mm must be at least 0 mm",
    ),
    "bound outside what is possible": (
        text(
            pinion=RELIEF.replace("3.4", '"height"').replace('amount = "height"', "amount = 1.0"), tail=VARIABLE
        ).replace("low = 0.0", "low = -1.0"),
        "variables.height.low: -1 mm must be at least 0 mm and at most 1000 mm as pinion.modification[0].length",
    ),
    "table that does not increase": (
        text(wheel='[[wheel.modification]]\ntype = "tabulated_profile"\nposition = [2, 1]\namount = [1.0, 2.0]'),
        "wheel.modification[0]: position must increase strictly",
    ),
    "variable not declared": (
        text(pinion=RELIEF),
        'pinion.modification[0].amount: "height" is not a variable, there is no [variables] table',
    ),
    "variable misspelt": (
        text(pinion=RELIEF.replace('"height"', '"heigth"'), tail=VARIABLE),
        'pinion.modification[0].amount: "heigth" is not a variable, did you mean "height"?',
    ),
    "variable in a list not declared": (
        text(wheel='[[wheel.modification]]\ntype = "tabulated_profile"\nposition = [1, 2]\namount = [1.0, "h"]'),
        'wheel.modification[0].amount[1]: "h" is not a variable',
    ),
    "variable not used": (
        text(tail=VARIABLE),
        "variables.height: is declared but used nowhere: no number of the file has",
    ),
    "variable and no modification": (
        text(pinion="modification = []", tail=VARIABLE),
        "variables.height: is declared but used nowhere: pinion.modification = [] has no modification, write",
    ),
    "variable of two units": (
        text(pinion=RELIEF.replace("3.4", '"height"'), tail=VARIABLE),
        "pinion.modification[0].length: height stands for a quantity in mm here and for a quantity in um elsewhere",
    ),
    "unit against use": (
        text(pinion=RELIEF, tail=VARIABLE.replace("20.0 ", '20.0, unit = "mm" ')),
        'variables.height.unit: "mm" must be "um" as it is used',
    ),
    "bounds reversed": (
        text(pinion=RELIEF, tail=VARIABLE.replace("low = 0.0", "low = 30.0")),
        "variables.height.high: 20 must be greater than 30",
    ),
    "bound not finite": (
        text(pinion=RELIEF, tail=VARIABLE.replace("high = 20.0", "high = inf")),
        "variables.height.high: inf must be finite",
    ),
    "variable is a number": (
        text(pinion=RELIEF, tail="[variables]\nheight = 3.0"),
        "variables.height: must be a table, not a number",
    ),
    "optimize without variables": (text(tail="[optimize]\nstarts = 4"), "optimize: has no effect without [variables]"),
    "verified by itself": (
        text(pinion=RELIEF, tail=f'{VARIABLE}[optimize]\nverify = true\n[model]\nstructure = "finite_element"'),
        'optimize.verify: has no effect with model.structure = "finite_element"',
    ),
    "legacy with options": (
        text(tail='[model]\npreset = "legacy"\nplane = "strain"'),
        'model.plane: cannot be combined with preset = "legacy"',
    ),
    "option of another body": (
        text(tail='[model]\nbody = { type = "sainsot", coupling = false }'),
        "model.body.coupling: unknown key",
    ),
    "resolution too coarse": (
        text(tail="[resolution]\npositions = 3"),
        "resolution.positions: 3 must be at least 4 and at most 4096",
    ),
    "resolution absurd": (
        text(tail="[resolution]\nslices = 100000000"),
        "resolution.slices: 100000000 must be at least 1 and at most 1024",
    ),
    "syntax": (text() + "[model\n", f"line {text().count(chr(10)) + 1}, column 7: "),
    "unfinished string": (text() + 'title = "x', f"line {text().count(chr(10)) + 1}"),
    "key twice": (text().replace("teeth = 19", "teeth = 19\nteeth = 20"), "line 4, column"),
    "not text": (text().encode() + b"\ntitle = '\xff'", f"line {text().count(chr(10)) + 2}: not UTF-8 text"),
    "number of seventy bits": (
        text(tail=f"[tolerance]\nquality_class = 5\nseed = {2**70}"),
        "tolerance.seed: a whole number of about 22 digits must be at least 0 and at most 2147483647",
    ),
    "number of absurd length": (text(tail="x = 1" + "0" * 5000), "a whole number has more than 4300 digits"),
    "empty name of a body": (text(tail='[model]\nbody = ""'), 'model.body: "" is not known, must be one of'),
    "empty name of a method": (text(tail='[optimize]\nmethod = ""'), 'optimize.method: "" is empty'),
    "no objective": (text(tail="[optimize]\nobjective = []"), "optimize.objective: [] is empty"),
    "torque absurd": (
        text().replace("torque = 50.0", "torque = 1e300"),
        "load.torque: 1e+300 N m must be at least 1e-06 N m and at most 1e+09 N m",
    ),
    "torque of the range not finite": (
        text(load="torque_range = [10.0, inf]"),
        "load.torque_range[1]: inf must be finite",
    ),
    "application factor of zero": (
        text(tail="[optimize]\napplication_factor = 0"),
        "optimize.application_factor: 0 must be greater than 0 and at most 100",
    ),
    "face width of nothing": (
        text().replace("face_width = 20.0", "face_width = 1e-300"),
        "pinion.face_width: 1e-300 mm must be at least 0.001 mm and at most 100000 mm",
    ),
    "modulus in pascal": (
        text(wheel="material = { elastic_modulus = 2.06e11 }"),
        "wheel.material.elastic_modulus: 2.06e+11 MPa must be at least 1 MPa and at most 1e+07 MPa",
    ),
    "number not finite": (text().replace("module = 3.0", "module = nan"), "pinion.module: nan must be finite"),
    "amount absurd": (
        text(pinion=RELIEF.replace('"height"', "1e300")),
        "pinion.modification[0].amount: 1e+300 um must be at least -100000 um and at most 100000 um",
    ),
    "coefficient not finite": (
        text(pinion=RELIEF.replace('"height"', "1.0") + 'curve = { type = "power", exponent = inf }'),
        "pinion.modification[0].curve.exponent: inf must be finite",
    ),
    "lower bound absurd": (
        text(pinion=RELIEF, tail=VARIABLE.replace("low = 0.0", "low = -1e300")),
        "variables.height.low: -1e+300 um must be at least -100000 um and at most 100000 um as pinion.modification[0]",
    ),
    "bound of a length below zero": (
        text(pinion=RELIEF.replace("3.4", '"l"'), tail=VARIABLE + "l = { low = -1.0, high = 3.0 }"),
        "variables.l.low: -1 mm must be at least 0 mm and at most 1000 mm as pinion.modification[0].length",
    ),
    "teeth absurd": (text().replace("teeth = 19", f"teeth = {2**70}"), "pinion.teeth: a whole number of about 22"),
    "teeth too few": (text().replace("teeth = 19", "teeth = 3"), "pinion.teeth: 3 must be at least 5"),
    "tip of the file": (
        text(wheel="tip_diameter = 30.0"),
        "wheel.tip_diameter: tip diameter = 30 mm must be greater than",
    ),
    "bore of the file": (text(wheel="bore_diameter = 140.0"), "wheel.bore_diameter: 140 mm must be less than 136.5"),
    "symbol of the field": (text().replace("teeth = 19", "z = 19"), 'pinion.z: unknown key, did you mean "teeth"?'),
    "symbol with an index": (text(pinion="d_a1 = 60.0"), 'pinion.d_a1: unknown key, did you mean "tip_diameter"?'),
    "symbol of two tables": (text(load="m = 3.0"), 'load.m: unknown key, did you mean "torque"?'),
    "symbol of helical gears": (
        text(pinion="beta = 10.0"),
        'pinion.beta: unknown key, did you mean "helix_angle"?',
    ),
    "unit with a number": (
        text().replace("torque = 50.0", 'torque = "250 Nm"'),
        'load.torque: "250 Nm" must be a number in N m alone',
    ),
    "decimal comma": (text(wheel='profile_shift = "0,5"'), 'wheel.profile_shift: "0,5" must be a number in x module'),
    "curve without type": (
        text(pinion=RELIEF.replace('"height"', "1.0") + 'curve = { typx = "linear" }'),
        'pinion.modification[0].curve.typx: unknown key, did you mean "type"?',
    ),
    "centre distance of another pair": (
        text(tail="[pair]\ncenter_distance = 1311.0"),
        "pair.center_distance: 1311 mm must be less than 106.5 mm, the sum of both tip radii",
    ),
    "centre distance too large": (
        text(tail="[pair]\ncenter_distance = 104.5"),
        "pair.center_distance: 104.5 mm leaves a contact ratio of 0.",
    ),
    "escape in a title": (
        'title = "\\u001b[2J"' + text(),
        "title: contains the control character U+001B, leave it out",
    ),
    "override in a list": (
        text(pinion=RELIEF, tail=VARIABLE + '[optimize]\nobjective = ["a\\u202Eb"]'),
        "optimize.objective[0]: contains the control character U+202E, leave it out",
    ),
    "escape in a name": (
        text(tail='[variables]\n"\\u009bA" = { low = 0.0, high = 1.0 }'),
        "variables.\\x9bA: contains the control character U+009B, leave it out",
    ),
    "relief of metres": (
        text(pinion=RELIEF.replace('"height"', "20.0").replace("3.4", "5000.0")),
        "pinion.modification[0].length: 5000 mm must be at least 0 mm and at most 1000 mm",
    ),
    "bore of nothing": (
        text(wheel="bore_diameter = 0.01"),
        "wheel.bore_diameter: 0.01 mm must be at least 2.73 mm, 2 %",
    ),
    "key of absurd depth": ("a = 1\n" + "a." * 3000 + "b = 1", "line 2: a key has more than 32 parts between dots"),
    "table of absurd depth": ("[" + '"a" . ' * 40 + "'b']", "line 1: a key has more than 32 parts between dots"),
    "nested absurdly": ("a = " + "[" * 100_000, "tables or lists are nested too deeply"),
    "bound beyond all numbers": (
        text(pinion=RELIEF, tail=VARIABLE.replace("high = 20.0", "high = 1" + "0" * 400)),
        "variables.height.high: a whole number of about 401 digits must be at most 1.79769e+308",
    ),
    "number beyond all bounds": (text().replace("module = 3.0", "module = 1" + "0" * 400), "pinion.module: "),
    "empty": ("", "pinion: missing, this key is required"),
}


FREE = text(pinion=RELIEF, load="speed = 3000.0", tail=VARIABLE)
SWEPT = FREE + "[sweep]\nsamples = 8\n"
# of a table that a command passes over -> content, and what every command says of it
OF_OTHER_COMMANDS = {
    "option of a method": (
        FREE + '[optimize.te_iteration]\nsteps = "abc"',
        "optimize.te_iteration.steps: must be a whole number, not a string",
    ),
    "option misspelt": (FREE + "[optimize.genetic]\npopulaton = 9", "optimize.genetic.populaton: unknown key, did you"),
    "curve of a method": (FREE + '[optimize.free_form]\ncurve = "x"', 'optimize.free_form.curve: "x" is not known'),
    "levels of a method": (
        FREE + "[optimize.factorial]\nlevels = { h = 2 }",
        "optimize.factorial.levels: must name all",
    ),
    "method": (FREE + '[optimize]\nmethod = "simplex"', 'optimize.method: "simplex" is not known'),
    "objective": (FREE + '[optimize]\nobjective = "noise"', 'optimize.objective: "noise" is not known'),
    "objective without its table": (
        FREE + '[optimize]\nobjective = "mean_ppte_over_life"',
        'optimize.objective: "mean_ppte_over_life" needs the table [wear]',
    ),
    "constraint": (FREE + "[optimize]\nconstraint = [{ off = 1 }]", "optimize.constraint[0].off: unknown key, did you"),
    "measure": (FREE + '[optimize]\nmeasure = "worst"', "optimize.measure: has no effect on a single case"),
    "weights": (FREE + "[optimize]\ntorques = [9.0]\nweights = [1.0, 2.0]", "optimize.weights: "),
    "manufactured": (FREE + "[optimize]\nmanufactured = 4", "optimize.manufactured: needs the table [tolerance]"),
    "results": (SWEPT + 'results = ["ppte", "noise"]', 'sweep.results[1]: "noise" is not known'),
    "sampling": (SWEPT + "levels = 3", 'sweep.levels: has no effect with sampling = "sobol"'),
    "levels": (
        SWEPT.replace("samples = 8", 'sampling = "full_factorial"\nlevels = { width = 3 }'),
        "sweep.levels: levels must be",
    ),
    "speeds": (text(tail="[dynamics]\nnumber = 9"), "dynamics: needs mesh_frequencies [Hz] or speeds [rpm]"),
    "wear": (
        text(tail="[wear]\nrevolutions = 1e6\ncoefficient = 1e-18\nweights = [1.0]"),
        "wear.weights: has no effect",
    ),
}
SHAFTS = """
[layout]
quality_class = 6
[[shafts]]
name = "in"
sections = [{ length = 160.0, diameter = 40.0 }]
bearings = [{ name = "A", position = 60.0, radial = 250.0 }, { name = "B", position = 140.0, radial = 250.0 }]
gears = [{ name = "pinion", position = 20.0, integral = true }]
couplings = [{ position = 160.0, torque = 50.0 }]
[[shafts]]
name = "out"
sections = [{ length = 190.0, diameter = 45.0 }]
bearings = [{ name = "C", position = 20.0, radial = 300.0 }, { name = "D", position = 130.0, radial = 300.0 }]
gears = [{ name = "wheel", position = 45.0, integral = true }]
couplings = [{ position = 190.0 }]
"""
LAYOUTS = {
    "[layout.misalignment]\nskew = nan\nbearing_span = 80.0": "layout.misalignment.skew: nan must be finite",
    "[layout.misalignment]\nskw = 9.0\nbearing_span = 80.0": "layout.misalignment.skw: unknown key, did you mean",
    "[layout.profile]\npinion_amounts = [1.0, 1.0]": "layout.profile.pinion_amounts: must all be different",
}


@pytest.mark.parametrize("case", OF_OTHER_COMMANDS)
def test_a_file_is_wrong_whatever_the_command(load, case):
    content, expected = OF_OTHER_COMMANDS[case]
    with pytest.raises(DesignFileError) as caught:
        load(content)
    assert f"gear.toml: {expected}" in str(caught.value)


def test_tables_of_a_layout_are_looked_into(load):
    assert load(text(tail=SHAFTS)).tables["layout"].quality_class == 6
    for tail, expected in LAYOUTS.items():
        with pytest.raises(DesignFileError) as caught:
            load(text(tail=SHAFTS + tail))
        assert f"gear.toml: {expected}" in str(caught.value)


def test_what_options_of_a_command_can_change_is_left_to_it(load):
    load(FREE + '[optimize]\nobjective = ["ppte", "mean_te"]')  # --method pareto
    load(FREE + "[optimize]\nlevel = 0.5\nmeasure = 'cvar'\ntorques = [40.0, 50.0]\nstarts = 3\n[optimize.genetic]")
    load(FREE + "[sweep]")  # --samples
    load(FREE + '[sweep]\nsampling = "list"\nfile = "not_made_yet.csv"')


@pytest.mark.parametrize("case", MALFORMED)
def test_a_malformed_file_is_one_line_that_names_file_and_key(load, tmp_path, case):
    content, expected = MALFORMED[case]
    with pytest.raises(DesignFileError) as caught:
        load(content)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{tmp_path / 'gear.toml'}: {expected}")


def test_a_torque_in_newton_millimetres_is_named_as_one(load):
    with pytest.raises(DesignFileError, match=r"load\.torque: 50000 N m deflects a pair of teeth of module 3 mm by"):
        load(text().replace("torque = 50.0", "torque = 50000.0") + "torque_range = [49999.0, 50000.0]").resolution()


def test_a_modulus_in_another_unit_is_named_as_one(load):
    for pinion, key in (
        ("material = { elastic_modulus = 206.0 }", "pinion.material.elastic_modulus"),
        ('material = "s"', "materials.s.elastic_modulus"),
    ):
        with pytest.raises(DesignFileError, match=rf"{key}: 206 MPa is less than 500 MPa \(.*GPa.*100 N m deflects"):
            load(text(pinion=pinion, tail="[materials.s]\nelastic_modulus = 206.0")).resolution()


def test_a_gear_for_which_no_tolerances_are_made_is_named(load):
    file = load(text(tail="[tolerance]\nquality_class = 5").replace("face_width = 18.0", "face_width = 2.0"))
    with pytest.raises(DesignFileError, match=r"^wheel\.face_width: 2 mm must be at least 4 mm and at most 1200 mm"):
        tolerance_of(file)


# tables that refer to a file, and what stands before its name
REFERRING = {
    "pinion.modification[0].file": '[[pinion.modification]]\ntype = "file"\nfile = "FILE"\n',
    "lubricant.file": 'lubricant = { file = "FILE", temperature = 50.0 }\n',
    "strength.file": 'strength = { file = "FILE" }\n',
    "sweep.file": f'{RELIEF}{VARIABLE}[sweep]\nsampling = "list"\nfile = "FILE"\n',
    "housing.file": SHAFTS + '[housing]\nfile = "FILE"\n',
    "model.wheel_table": '[model]\nstructure = "finite_element"\nwheel_table = "FILE"\n',
}


@pytest.mark.parametrize("key", REFERRING)
def test_a_file_that_cannot_be_read_is_named_by_its_key(load, tmp_path, key):
    """A pipe or a device would be read for ever."""
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "link.csv").symlink_to("/dev/zero")
    for name, problem in (
        ("pipe.csv", "is not a regular file"),
        ("link.csv", "is not a regular file"),
        ("folder.csv", "is a folder, not a file"),
        ("none.csv", "No such file or directory"),
        ("a\\u0000.csv", "contains the control character U+0000, leave it out"),
        (f"{'a' * 300}.csv", "File name too long"),
    ):
        table = REFERRING[key].replace("FILE", name)
        content = f"{table}{text()}" if table.startswith(("lubricant", "strength")) else text(tail=table)
        with pytest.raises(DesignFileError) as caught:
            asked_sweep(load(content))
        message = str(caught.value)
        assert f"/gear.toml: {key}: " in message and message.endswith(problem)
        assert f"{name}: " in message or "U+0000" in message


WRONG = [
    *("nan", "-inf", "1e300", "-1e300", "1e-300", "0", "-1", "0.0", str(2**70), "1" + "0" * 400),
    *('""', '"x"', '"ppte"', "true", "[]", "{}", "[[]]", "[1.0, nan]", "[{}]", "{ a = nan }", "1979-05-27", "3.5"),
]
EVERYTHING = """
[optimize]
method = "slp"
objective = "ppte"
measure = "cvar"
level = 0.9
torques = [40.0, 50.0]
weights = [1.0, 2.0]
manufactured = 4
seed = 1
starts = 4
steps = 20
application_factor = 1.2
constraint = [{ of = "max_contact_pressure", high = 900.0 }, { variables = { height = 1.0 }, low = 1.0 }]
slp = { rounds = 2 }
free_form = { points = 20, max_relief = 10.0, curvature = 0.01 }
te_iteration = { start = "unmodified", max_relief = 8.0, max_pressure = 2000.0 }
factorial = { levels = { height = 3 } }
genetic = { population = 20, crossover = 0.4 }
[sweep]
sampling = "full_factorial"
levels = { height = [1.0, 2.0, 4.0] }
torques = [40.0, 50.0]
results = ["ppte", "mean_te"]
part_rows = 100
[tolerance]
quality_class = [5, 6]
samples = 8
seed = 3
[model]
plane = "stress"
body = { type = "elastic_ring", coupling = false }
contact = "weber"
[resolution]
positions = 16
pairs = 2
[pair]
center_distance = 101.0
"""


@pytest.mark.parametrize("times", [30, pytest.param(200, marks=pytest.mark.slow)])
def test_whatever_is_written_in_a_file_it_is_read_or_refused_in_one_line(load, times):
    """Every value of a file that says everything is replaced by values that nobody means: never a traceback."""
    gear = "profile_shift = 0.1\nbore_diameter = 20.0\ntip_edge_radius = 0.1\nmaterial = { density = 7800.0 }\n"
    curve = 'curve = { type = "quadratic", b0 = 0.0, b1 = 0.4, b2 = 0.6 }\n'
    whole = text(pinion=gear + RELIEF + curve, load="speed = 1000.0\nfriction = 0.05", tail=VARIABLE + EVERYTHING)
    rng, refusals = np.random.default_rng(0), 0
    places = list(re.finditer(r"(?<= = )(\"[^\"]*\"|\[[^\]]*\]|\{[^{}]*\}|[-\w.]+)", whole))

    def run(content):
        file = load(content)
        Search.of(file)
        asked_sweep(file)

    run(whole)  # the control: this one is right
    for place in rng.choice(len(places), times):
        value = WRONG[rng.integers(len(WRONG))]
        start, end = places[place].span()
        try:
            run(whole[:start] + value + whole[end:])
        except DesignFileError as error:
            refusals += 1
            problem = str(error).partition("gear.toml: ")[2]
            assert "\n" not in problem
            assert re.match(r"[\w.\[\]]+: ", problem), problem  # a key, then what is wrong with it
            assert not re.search(r"\b(Gear|GearPair|Material|TipRelief|LoadSpectrum|Quadratic)\b", problem)
    assert refusals > 0.75 * times


def test_the_reference_mentions_every_key_and_the_guide_is_up_to_date():
    text = reference()
    further = further_tables(users=False)
    sections = [file_section(further), GearSection, LoadSection, ModelSection, *further.values()]
    sections += method_options().values()
    sections += [section_of(cls) for cls in (*family(AbstractModification, users=False).values(), jg.Material)]
    for section in sections:
        assert not [name for name in section.keys if f"| `{name}` | " not in text]
    assert "| `module` | a number or the name of a variable | mm | greater than 0 | required |" in text
    assert "| `density` | a number or the name of a variable | kg/m^3 | greater than 0 | `7850` | " in text
    assert '| `side` | one of "both", "negative", "positive" |  |  | `"both"` | ' in text
    guide = Path(__file__).parent.parent / "examples" / "guides" / "design_files.md"
    rows = [line for line in text.splitlines() if line.startswith("| `")]
    assert not [row for row in rows if re.search(r"\|\s*\|$", row)], "every key has a meaning"
    assert guide.read_text(encoding="utf-8") == text, "python -m jaxgear.io > examples/guides/design_files.md"


def test_the_shortest_file_of_the_guide_is_one(load):
    (shortest,) = re.findall(r"^```toml\n(.*?)^```", reference(), flags=re.DOTALL | re.MULTILINE)
    file = load(shortest)
    assert len(shortest.split("\n\n")) == 3 and file.torque == 50.0 and not file.bounds
    assert (int(file.pair().pinion.teeth), int(file.pair().wheel.teeth)) == (19, 48)


def test_material_and_measured_thickness_are_known_by_what_the_file_says(load):
    both = "[materials.case_hardened]\nelastic_modulus = 206000.0\npoisson_ratio = 0.3\n"
    measured = 'material = "case_hardened"\nspan = [22.85, 22.90]\nteeth_spanned = 3'
    file = load(text(pinion=measured, tail=both))
    assert file.drawn["pinion"] == {"material": "case_hardened", "span_mm": [22.85, 22.90], "teeth_spanned": 3}
    assert file.drawn["wheel"] == {"material": "STEEL"}


def test_the_contents_of_the_reference_lead_to_its_tables():
    """GitHub makes the anchor of a heading of its letters, digits, hyphens and underscores."""
    text = reference()
    linked = re.findall(r"^- \[(.+)\]\(#(.+)\)$", text, flags=re.MULTILINE)
    headings = re.findall(r"^## (.+)$", text, flags=re.MULTILINE)
    assert [title for title, _ in linked] == headings and len(set(anchor for _, anchor in linked)) == len(headings)
    assert all(re.sub(r"[^\w -]", "", title).lower().replace(" ", "-") == anchor for title, anchor in linked)
    assert not any("--" in anchor for _, anchor in linked), "which the site would make one hyphen of"


def test_a_variable_may_name_the_value_that_an_analysis_takes(load):
    free = text(tail='[variables]\nheight = { low = 0.0, high = 9.0, value = 4.0, unit = "um" }\n', pinion="").replace(
        "[wheel]", '[[pinion.modification]]\ntype = "tip_relief"\namount = "height"\nlength = 3.0\n[wheel]'
    )
    assert load(free).values == {"height": 4.0}
    assert load(free.replace("value = 4.0, ", "")).values == {}
    with pytest.raises(DesignFileError, match=r"variables\.height\.value: 11 must be at least 0 and at most 9"):
        load(free.replace("value = 4.0", "value = 11.0"))


def open_case():
    """Profile shift, centre distance and torque are variables of a sweep."""
    variables = "[variables]\nx = { low = 0.0, high = 0.2 }\na = { low = 101.4, high = 101.8 }\n"
    variables += 't = { low = 20.0, high = 60.0, unit = "N m" }\n'
    tail = '[pair]\ncenter_distance = "a"\n[resolution]\npositions = 8\n' + variables
    tail += '[sweep]\nsampling = "full_factorial"\nlevels = 2\nresults = ["mean_te"]\n'
    return text(pinion='profile_shift = "x"', tail=tail).replace("torque = 50.0", 'torque = "t"')


def test_variables_stand_for_numbers_of_gears_pair_and_load(load):
    whole = open_case()
    file = load(whole)
    assert file.units == {"x": "x module", "a": "mm", "t": "N m"} and file.torque == 40.0
    assert float(file.pair().pinion.profile_shift) == pytest.approx(0.1)
    request = asked_sweep(file)
    assert request.highest_torque == 60.0 and request.plan.size == 8
    assert file.resolution(request.highest_torque).pairs == 4  # other variants can have a larger contact ratio
    low = {name: jnp.asarray(bounds[0]) for name, bounds in file.bounds.items()}
    assert float(file.pair(low).center_distance) == 101.4 and float(request.load(low).torque) == 20.0
    for old, new, problem in (
        ("results", "torques = [30.0]\nresults", 'sweep.torques: has no effect, load.torque is "t"'),
        ("high = 0.2", "high = 3.0", "variables.x.high: 3 x module must be at least -1.5 x module and at most 2"),
        ('[pair]\ncenter_distance = "a"', "", "variables.a: is declared but used nowhere"),
        ("high = 101.8", "high = 301.8", "pair.center_distance: 201.6 mm must be less than 106.8 mm"),
    ):
        with pytest.raises(DesignFileError, match=re.escape(problem)):
            asked_sweep(load(whole.replace(old, new)))
    with pytest.raises(DesignFileError, match=r'pinion\.profile_shift: "x" is a variable, which a sweep alone'):
        Search.of(file)


class SoftLaw(jg.compliance.AbstractContact):
    """A user's own contact law: so many times the compliance of the half spaces."""

    softness: float = number("", low=0.0, open_low=True, default=1.0)

    def prepare(self, geometry):
        return LinearLaw(self.softness * geometry.compliance)


def test_a_contact_law_of_a_user_needs_no_line_in_the_package(load):
    file = load(text(tail='[model]\ncontact = { type = "soft_law", softness = 3.0 }'))
    assert eqx.tree_equal(file._middle.compliance, jg.Compliance(contact=SoftLaw(3.0)))
    with pytest.raises(DesignFileError, match=r"model\.contact\.softness: 0 must be greater than 0"):
        load(text(tail='[model]\ncontact = { type = "soft_law", softness = 0.0 }'))
    assert "soft_law" not in reference()


FLASH = """[optimize]
objective = "max_flash_temperature"
constraint = [{ of = "max_flash_temperature", high = 90.0 }]
[sweep]
samples = 4
results = ["max_flash_temperature"]
"""


def test_speed_and_friction_reach_objective_constraint_and_sweep(load):
    whole = text(pinion=RELIEF, load="speed = 1000.0\nfriction = 0.05", tail=VARIABLE + FLASH)
    file = load(whole)
    for spectrum in (Search.of(file).problem["torque"], asked_sweep(file).load):
        assert float(spectrum.speeds[0]) == 1000.0 and float(spectrum.friction) == pytest.approx(0.05)
    # a variable: every variant has its own
    variable = 'n = { low = 500.0, high = 1500.0, unit = "rpm" }\n'
    free = load(whole.replace("speed = 1000.0", 'speed = "n"').replace("[optimize]", variable + "[optimize]"))
    assert free.speed == 1000.0 and free.units["n"] == "rpm"
    request = asked_sweep(free)
    operating_point = request.load({"height": jnp.asarray(1.0), "n": jnp.asarray(700.0)})
    assert (
        float(operating_point.speed) == 700.0
        and float(operating_point.torque) == 50.0
        and request.highest_torque == 50.0
    )
    with pytest.raises(DesignFileError, match=r'load\.speed: "n" is a variable, which a sweep alone'):
        Search.of(free)


@pytest.mark.slow
def test_a_sweep_of_gears_pair_and_load_solves_each_as_the_library_does(load):
    file = load(open_case())
    request = asked_sweep(file)
    mesh = file.sweep_mesh(file.resolution(request.highest_torque))
    table = jg.sweep(mesh, request.load, file.design, request.plan, results=request.results, units=file.units)
    rows = {key: table.column(key) for key in ("x", "a", "t", "mean_te_um", "converged")}
    assert table.units["t"] == "N m" and rows["converged"].all()
    for row in range(8):
        x, a, t, deflection, _ = (column[row] for column in rows.values())
        pair = jg.GearPair(
            jg.Gear(19, 3.0, profile_shift=x, face_width=20.0, material=jg.Material()),
            jg.Gear(48, 3.0, face_width=18.0, material=jg.Material()),
            center_distance=a,
        )
        cycle = jg.solve(jg.prepare(pair, resolution=jg.Resolution(positions=8, pairs=4)), t)
        assert deflection == pytest.approx(float(jnp.mean(cycle.transmission_error)), rel=1e-9)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(DesignFileError, match=r"nowhere\.toml: No such file"):
        load_design(tmp_path / "nowhere.toml")
    with pytest.raises(DesignFileError, match="is a folder, not a file"):
        load_design(tmp_path)
    with pytest.raises(DesignFileError, match="null byte"):
        load_design("gear\0.toml")


def test_what_a_terminal_would_obey_is_shown_instead(tmp_path):
    path = tmp_path / "a\x1b[2Jb.toml"
    path.write_text(text())
    assert load_design(path).title == "a\\x1b[2Jb"
    path.write_text("")
    with pytest.raises(DesignFileError, match=r"a\\x1b\[2Jb\.toml: pinion: missing") as caught:
        load_design(path)
    assert "\x1b" not in str(caught.value)
    plain = NoModification()
    write_design(path, load_design(EXAMPLES[0]).pair(), torque=50.0, pinion=plain, wheel=plain, title="\u202egears")
    assert load_design(path).title == "\\u202egears"


def test_a_byte_order_mark_and_carriage_returns_are_no_error(load):
    assert load(b"\xef\xbb\xbf" + text().replace("\n", "\r\n").encode()).torque == 50.0


def test_a_resolution_that_misses_part_of_the_path_is_refused(load):
    gear = "teeth = 70\nmodule = 3.0\nface_width = 20.0\naddendum = 1.3\ndedendum = 1.5\nroot_radius = 0.2\n"
    tail = f"[load]\ntorque = 50.0\n[resolution]\n{LINE}\n"
    file = load(f"[pinion]\n{gear}[wheel]\n{gear}{tail}")
    with pytest.raises(DesignFileError, match="resolution: pairs = 2 must be at least"):
        file.mesh()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_load_and_are_what_their_name_says(path):
    file = load_design(path)
    teeth = [int(gear.teeth) for gear in (file.pair().pinion, file.pair().wheel)]
    kinds = {
        "rated": "rating" in file.tables,
        "lubricated": "lubricant" in file.tables,
        "sweep": "sweep" in file.tables,
        "dynamics": "dynamics" in file.tables,
        "robust": bool(optimize_of(file).manufactured),
        "wear": "wear" in file.tables,
        "teeth": "teeth" in file.tables,
        "layout": "layout" in file.tables,
        "planetary": "stage" in file.tables,
    }
    hand = "spur" if file.pair().is_spur else "helical"
    kind = next((name for name, is_so in kinds.items() if is_so), hand)
    assert path.stem == f"{kind}_{teeth[0]}_{teeth[1]}"
    seeks = optimize_of(file).method in METHODS_WITHOUT_VARIABLES or kinds["layout"] or kinds["rated"]
    assert (file.bounds or seeks) and file.title
    file.design({name: 0.5 * (low + high) for name, (low, high) in file.bounds.items()})


def test_the_cut_tip_of_the_50_50_pair_gives_its_contact_ratio():
    pair = load_design(next(path for path in EXAMPLES if path.stem == "spur_50_50")).pair()
    assert float(path_of_contact(pair).contact_ratio) == pytest.approx(1.37, abs=5e-4)


def test_summaries_hold_no_nan(tmp_path):
    path = tmp_path / "summary.json"
    write_summary(path, {"a": math.nan, "b": [np.float64(1.5), np.inf], "c": {"d": jnp.asarray([1.0, jnp.nan])}})
    assert json.loads(path.read_text(), parse_constant=pytest.fail) == {
        "a": None,
        "b": [1.5, None],
        "c": {"d": [1, None]},
    }


def test_flank_rows_run_from_the_start_of_the_active_profile_to_the_tip(load):
    mesh = load(text(tail=f"[resolution]\n{LINE}").replace("20.0", "18.0")).mesh()
    relief = jg.TipRelief(7.0, 3.0)
    rows = list(flank_rows(mesh, {"a": (relief, jg.NoModification()), "b": (relief + jg.LeadCrowning(2.0), relief)}))

    def select(design, gear):
        return np.array([row[2:] for row in rows if row[:2] == (design, gear)])

    pinion = select("a", "pinion")
    assert not pinion[:, 0].any()  # no modification along the face: only its middle
    face, angle, rho, size, amount = pinion.T
    gear, contact = mesh.pair.pinion, mesh.path_of_contact
    assert rho[0] == pytest.approx(float(contact.pinion_roll_length(contact.start)))
    assert size[-1] == pytest.approx(2 * float(gear.tip_radius))
    assert amount[-1] == pytest.approx(7.0) and amount[0] == 0.0
    np.testing.assert_allclose(np.deg2rad(angle) * float(gear.base_radius), rho)
    np.testing.assert_allclose((size / 2) ** 2 - float(gear.base_radius) ** 2, rho**2)
    crowned = select("b", "pinion")
    ends = crowned[np.abs(crowned[:, 0]) == 0.5 * float(gear.face_width)]  # of its own face
    np.testing.assert_allclose(ends[:, 4], np.tile(amount + 2.0, 2))
    assert select("a", "wheel")[:, 4].tolist() == [0.0] * len(rho)


def test_a_result_folder_is_complete_or_absent(tmp_path):
    target = tmp_path / "deep" / "results"
    with pytest.raises(KeyboardInterrupt), result_folder(target) as folder:
        (folder / "summary.json").write_text("half")
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
    held = {"contents": ["summary.json"]}
    first, second = (json.dumps({"versions": {"jaxgear": version}, **held}) for version in ("1", "2"))
    for content in (first, second):
        with result_folder(target) as folder:
            (folder / "summary.json").write_text(content)
        assert [path.name for path in target.parent.iterdir()] == ["results"]
        assert (target / "summary.json").read_text() == content
    with pytest.raises(RuntimeError), result_folder(target) as folder:
        (folder / "summary.json").write_text("third")
        raise RuntimeError
    assert (target / "summary.json").read_text() == second
    assert [path.name for path in target.parent.iterdir()] == ["results"]


def test_a_folder_of_other_things_is_never_replaced(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    refusal = r"holds other files than results of jaxgear \(thesis.tex\)"
    with pytest.raises(ValueError, match=refusal), result_folder(tmp_path):
        pytest.fail("the folder was accepted")
    for target in (tmp_path / "thesis.tex", tmp_path / "thesis.tex" / "below"):
        with pytest.raises(ValueError, match="is a file|cannot be written"), result_folder(target):
            pytest.fail("the file was accepted")
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    assert re.match("years", (tmp_path / "thesis.tex").read_text())
