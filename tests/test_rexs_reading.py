"""REXS files of others: what they say by other places and shapes, and what is refused in one line."""

import base64
import contextlib
import io
import os
import random
import re
from dataclasses import replace
from types import SimpleNamespace

import equinox as eqx
import jax
import numpy as np
import pytest
from catalogue import LINE, gear_pair, prepare

import jaxgear as jg
from jaxgear.cli import main
from jaxgear.geometry import over_balls, span
from jaxgear.io import DesignFileError, load_design
from jaxgear.rexs import read_rexs, write_rexs
from jaxgear.rexs.frame import frames

PAIR = jg.GearPair(
    jg.Gear(teeth=19, module=3.0, face_width=20.0, bore_diameter=24.0),
    jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0),
    100.5,
)
PINION, _ = frames(PAIR)
RELIEFS = jg.TipRelief(6.0, 3.0, jg.Linear()) + jg.LeadSlope(4.0)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The text of a file in which the pinion is modified, and where changed ones go."""
    path = tmp_path_factory.mktemp("rexs") / "pair.rexs"
    write_rexs(path, PAIR, pinion=RELIEFS, torque=50.0, speed=3000.0)
    return SimpleNamespace(text=path.read_text("utf-8-sig"), path=path)


def attribute(name, value, unit="mm"):
    inner = value if isinstance(value, str) else "<array>" + "".join(f"<c>{v!r}</c>" for v in value) + "</array>"
    return f'<attribute id="{name}" unit="{unit}">{inner}</attribute>'


def flank(written, kind, **values):
    """What is read where a component of values (value, unit or mm) stands in place of the modifications."""
    text = re.sub(
        r'<component id="\d+" type="(tip_relief|helix_slope)".*?</component>', "", written.text, flags=re.DOTALL
    )
    text = re.sub(r'<relation id="\d+" type="reference">\s*<ref id="\d+" role="origin" hint="cylindrical_gear_flank"'
                  r".*?</relation>", "", text, flags=re.DOTALL)  # fmt: skip
    held = "".join(attribute(name, *(v if isinstance(v, tuple) else (v,))) for name, v in values.items())
    part = f'<component id="90" type="{kind}">{held}</component>'
    relation = (
        '<relation id="{}" type="reference"><ref id="{}" role="origin"/><ref id="90" role="referenced"/></relation>'
    )
    names = "pinion left flank", "pinion right flank"
    flanks = [
        re.search(rf'<component id="(\d+)" type="cylindrical_gear_flank" name="{each}"', text)[1] for each in names
    ]
    relations = "".join(relation.format(900 + i, flanks[i]) for i in (0, 1))
    text = text.replace("</components>", part + "</components>").replace("</relations>", relations + "</relations>")
    written.path.write_text(text)
    return read_rexs(written.path).pinion


def removed(modification, roll, face=0.0):
    roll, face = np.broadcast_arrays(np.asarray(roll, float), np.asarray(face, float))
    return PINION.removed(modification, roll, face)


ALONG = np.linspace(PINION.start, PINION.tip, 301)
ACROSS = np.linspace(-9.0, 9.0, 181)  # the datum face is at -10


@pytest.mark.parametrize("shape, power", [("linear", 1), ("parabolic", 2)])
def test_a_relief_given_below_the_tip_goes_on_to_the_tip(written, shape, power):
    start, given = PINION.tip - 4.0, PINION.tip - 1.0
    found = flank(
        written,
        "tip_relief",
        shape_of_relief=(shape, "none"),
        tip_relief_depth="0.006",
        tip_relief_datum_diameter=str(PINION.diameter(start)),
        tip_relief_evaluation_reference=str(PINION.diameter(given)),
    )
    wanted = 6.0 * np.maximum((ALONG - start) / (given - start), 0.0) ** power
    np.testing.assert_allclose(removed(found, ALONG), wanted, atol=1e-11)


def test_a_root_relief_given_below_the_active_profile(written):
    given, end = PINION.start - 1.0, PINION.start + 2.0
    found = flank(
        written,
        "root_relief",
        shape_of_relief=("linear", "none"),
        root_relief_depth="0.006",
        root_relief_datum_diameter=str(PINION.diameter(end)),
        root_relief_evaluation_reference=str(PINION.diameter(given)),
    )
    np.testing.assert_allclose(removed(found, ALONG), 6.0 * np.maximum((end - ALONG) / 3.0, 0.0), atol=1e-11)


def test_an_end_relief_is_counted_from_the_gears_own_face(written):
    found = flank(
        written,
        "end_relief_datum_face",
        shape_of_relief=("parabolic", "none"),
        end_relief_depth_datum_face="0.01",
        end_relief_length_datum_face="5.0",
    )
    wanted = 10.0 * np.maximum((5.0 - (ACROSS + 10.0)) / 5.0, 0.0) ** 2
    np.testing.assert_allclose(removed(found, ALONG[0], ACROSS), wanted, atol=1e-11)


def test_crownings_are_parabolas_through_the_amounts_that_are_given(written):
    found = flank(
        written,
        "helix_crowning",
        helix_crowning_amount_datum_face="0.008",
        helix_crowning_amount_non_datum_face="0.004",
        helix_highest_point="2.0",
    )
    wanted = np.where(ACROSS < 2.0, 8.0 * ((2.0 - ACROSS) / 12.0) ** 2, 4.0 * ((ACROSS - 2.0) / 8.0) ** 2)
    np.testing.assert_allclose(removed(found, ALONG[0], ACROSS), wanted, atol=1e-11)

    symmetric = flank(
        written,
        "helix_crowning",
        helix_crowning_amount_datum_face="0.008",
        helix_crowning_amount_non_datum_face="0.008",
    )
    assert isinstance(symmetric, jg.LeadCrowning)
    np.testing.assert_allclose(symmetric.amount, 8.0, rtol=1e-12)

    top, root = PINION.start + 6.0, PINION.start + 1.0
    found = flank(
        written,
        "profile_crowning",
        shape_of_profile_crowning=("circular", "none"),
        profile_crowning_at_root="0.003",
        profile_crowning_at_tip="0.005",
        diameter_where_profile_crowning_root_is_specified=str(PINION.diameter(root)),
        profile_highest_point=str(PINION.diameter(top)),
    )
    below, above = 3.0 * ((top - ALONG) / 5.0) ** 2, 5.0 * ((ALONG - top) / (PINION.tip - top)) ** 2
    np.testing.assert_allclose(removed(found, ALONG), np.where(ALONG < top, below, above), atol=1e-10)


def test_an_arc_is_read_as_a_parabola_where_none_can_tell(written):
    """The bound of the error holds for a true circle, and an arc beyond it is refused."""

    def relief(depth):
        return flank(
            written,
            "tip_relief",
            shape_of_relief=("circular", "none"),
            tip_relief_depth=str(depth),
            tip_relief_datum_diameter=str(PINION.diameter(PINION.tip - 2.0)),
        )

    depth, length = 0.05, 2.0
    radius = (length**2 + depth**2) / (2 * depth)
    place = ALONG - (PINION.tip - length)
    arc = 1e3 * np.where(place > 0, radius - np.sqrt(radius**2 - place**2), 0.0)
    error = np.abs(removed(relief(depth), ALONG) - arc).max()
    assert 0.5 * 1e3 * depth**3 / (4 * length**2) < error < 1.01 * 1e3 * depth**3 / (4 * length**2) < 0.01
    with pytest.raises(DesignFileError, match='shape_of_relief: "circular" is 0.017 um off the parabola'):
        relief(0.065)


def test_slopes_are_those_between_the_places_that_are_given(written):
    found = flank(
        written,
        "profile_slope",
        profile_slope="0.004",
        profile_evaluation_start=str(PINION.diameter(PINION.start + 1.0)),
        profile_evaluation_end=str(PINION.diameter(PINION.tip - 3.0)),
    )
    np.testing.assert_allclose(
        np.diff(removed(found, ALONG)) / np.diff(ALONG), 4.0 / (PINION.tip - PINION.start - 4.0), rtol=1e-9
    )
    found = flank(written, "helix_slope", helix_slope="0.004")
    np.testing.assert_allclose(removed(found, ALONG[0], ACROSS), 4.0 * ACROSS / 20.0, atol=1e-12)


def test_a_datum_face_at_the_other_end_mirrors_the_face(written):
    datum, other = 'unit="none">negative<', 'unit="none">positive<'
    turned = SimpleNamespace(text=written.text.replace(datum, other), path=written.path)
    for kind, values in (
        ("helix_slope", {"helix_slope": "0.004"}),
        (
            "end_relief_datum_face",
            {
                "shape_of_relief": ("linear", "none"),
                "end_relief_depth_datum_face": "0.01",
                "end_relief_length_datum_face": "6.0",
            },
        ),
        (
            "helix_crowning",
            {
                "helix_crowning_amount_datum_face": "0.008",
                "coordinate_where_helix_crowning_is_specified_datum_face": "-7.0",
                "helix_crowning_amount_non_datum_face": "0.003",
                "coordinate_where_helix_crowning_is_specified_non_datum_face": "6.0",
                "helix_highest_point": "1.0",
            },
        ),
    ):
        opposite = {name: value.lstrip("-") if "-" in value else f"-{value}" for name, value in values.items()
                    if "coordinate" in name or "point" in name}  # fmt: skip
        usual, mirrored = flank(written, kind, **values), flank(turned, kind, **(values | opposite))
        roll = np.full_like(ACROSS, ALONG[150])
        assert np.ptp(removed(usual, roll, ACROSS)) > 1
        np.testing.assert_allclose(removed(mirrored, roll, ACROSS), removed(usual, roll, -ACROSS), atol=1e-12)


def test_the_gear_that_drives_is_the_pinion(written):
    driving, driven = ('id="is_driving_gear" unit="none">true', 'id="is_driving_gear" unit="none">false')
    text = written.text.replace(driving, "*").replace(driven, driving).replace("*", driven)
    written.path.write_text(text)
    found = read_rexs(written.path)
    assert float(found.pair.pinion.teeth) == 48 and isinstance(found.pinion, jg.NoModification)
    assert found.torque is None  # the file names that of the other gear
    written.path.write_text(re.sub(r'<attribute id="is_driving_gear".*?</attribute>', "", written.text))
    assert float(read_rexs(written.path).pair.pinion.teeth) == 19


def test_gears_that_count_along_their_faces_in_opposite_directions_are_refused(written):
    text = written.text
    for gear, axis in (("pinion", [1.0, 0.0, 0.0]), ("wheel", [-1.0, 0.0, 0.0])):
        start = f'type="cylindrical_gear" name="{gear}">'
        assert start in text
        text = text.replace(start, start + attribute("u_axis_vector", axis))
    written.path.write_text(text)
    with pytest.raises(DesignFileError, match="u_axis_vector: must point in the direction of that of gear 3"):
        read_rexs(written.path)
    written.path.write_text(text.replace("-1.0</c>", "1.0</c>"))
    assert read_rexs(written.path).torque == 50.0


def test_a_file_without_units_is_taken_in_those_of_the_standard_with_a_word(written, caplog):
    written.path.write_text(written.text)
    assert read_rexs(written.path) and caplog.messages == []
    written.path.write_text(re.sub(r' unit="[^"]*"', "", written.text))
    assert float(read_rexs(written.path).pair.pinion.face_width) == 20.0
    (line,) = caplog.messages
    assert re.search(r"names no units, those of the REXS standard are taken: .* \d+: \w+ in .*, the first of", line)


def test_names_and_units_of_earlier_versions(written):
    text = written.text.replace('version="2.0.0"', 'version="1.4"').replace(
        "tip_corner_radius_factor_reference_profile", "tip_radius_factor"
    )
    text = text.replace("thermal_contact_coefficient_agma_925_2003", "thermal_contact_coefficient_agma_925_a03")
    text = (
        text.replace('unit="MPa"', 'unit="N / mm^2"')
        .replace('unit="none"', 'unit=""')
        .replace('unit="deg"', 'unit="\u00b0"')
    )
    written.path.write_text(re.sub(r'<attribute id="is_additive_modification".*?</attribute>', "", text), "utf-8")
    found = read_rexs(written.path)
    written.path.write_text(written.text)
    assert eqx.tree_equal(found.pair, read_rexs(written.path).pair)
    np.testing.assert_allclose(removed(found.pinion, ALONG, 3.0), removed(RELIEFS, ALONG, 3.0), atol=1e-12)


def test_which_end_of_the_face_is_meant_has_to_be_said_where_it_matters(written):
    silent = re.sub(r'<attribute id="datum_face_orientation".*?</attribute>', "", written.text)
    unsaid = SimpleNamespace(text=silent, path=written.path)
    both = {"helix_crowning_amount_datum_face": "0.008", "helix_crowning_amount_non_datum_face": "0.008"}
    assert isinstance(flank(unsaid, "helix_crowning", **both), jg.LeadCrowning)
    with pytest.raises(DesignFileError, match="cylindrical_gear 3: datum_face_orientation: missing, the ends"):
        flank(unsaid, "helix_slope", helix_slope="0.004")


def test_arrays_may_be_in_base64(written):
    roll = PINION.diameter(np.array([8.0, 11.0, 14.0]))
    coded = base64.b64encode(roll.astype("<f8").tobytes()).decode()
    found = flank(
        written,
        "topographical_modification",
        coordinates_of_topographical_modification=[0.0, 0.0, 0.0],
        diameters_of_topographical_modification=f'<array code="float64">{coded}</array>',
        topographical_modification_amounts=[0.001, -0.002, 0.004],
    )
    assert isinstance(found, jg.TabulatedProfile)
    np.testing.assert_allclose(found.position, [8.0, 11.0, 14.0], rtol=1e-13)
    np.testing.assert_array_equal(found.amount, [1.0, -2.0, 4.0])


def gear_with(written, *attributes):
    """The pinion of the file with attributes beside its own."""
    text = written.text.replace(TEETH, "".join(attribute(*each) for each in attributes) + TEETH, 1)
    written.path.write_text(text)
    return read_rexs(written.path).pair.pinion


def test_tooth_thickness_by_every_measure_of_a_drawing(written):
    """Deviations of chord, span and dimension over balls that one tooth has are read as that tooth."""
    thick, thin = (replace(PAIR.pinion, tooth_thickness_allowance=np.asarray(each)) for each in (-60.0, -100.0))
    spans = [1e3 * float(span(each, 3) - span(PAIR.pinion, 3)) for each in (thick, thin)]
    balls = [float(over_balls(each, 5.5) - over_balls(PAIR.pinion, 5.5)) for each in (thick, thin)]
    ways = {
        "referenced_to_span": ("mum", spans, ()),
        "balls_or_pins": ("mm", balls, (("diameter_of_measuring_ball_or_pin", "5.5"),)),
    }
    for name, (unit, limits, more) in ways.items():
        names = [f"{end}_backlash_allowance_{name}" for end in ("upper", "lower")]
        found = gear_with(written, *((each, repr(limit), unit) for each, limit in zip(names, limits)), *more)
        assert float(found.tooth_thickness_allowance) == pytest.approx(-60.0, abs=1e-6), name
        assert float(found.tooth_thickness_tolerance) == pytest.approx(40.0, abs=1e-6), name


def test_a_tooth_without_deviation_over_balls_is_read_in_single_precision(written):
    name = "backlash_allowance_balls_or_pins"
    limits = ((f"upper_{name}", "0.0"), (f"lower_{name}", "-0.1"), ("diameter_of_measuring_ball_or_pin", "5.5"))
    tolerances = []
    for double in (False, True):
        with jax.enable_x64(double):
            written.path.write_text(written.text)
            found = gear_with(written, *limits)
        assert float(found.tooth_thickness_allowance) == 0.0
        tolerances.append(float(found.tooth_thickness_tolerance))
    assert tolerances[0] == pytest.approx(tolerances[1], rel=1e-3) and tolerances[1] > 40.0


def test_a_chamfered_tip_by_its_diameter_or_its_height(written):
    assert float(gear_with(written, ("tip_form_diameter", "62.5")).tip_form_diameter) == 62.5
    assert gear_with(written, ("tip_form_diameter", "63.0")).tip_form_diameter is None
    name = "addendum_modification_coefficient"
    height = attribute("tooth_tip_chamfer", "0.25")
    written.path.write_text(written.text.replace(f'<attribute id="{name}"', f'{height}<attribute id="{name}"'))
    assert float(read_rexs(written.path).pair.pinion.tip_form_diameter) == pytest.approx(62.5, abs=1e-12)


def test_an_active_tip_ends_a_flank_that_nothing_else_ends(written, caplog):
    """d_Na of the stage data: below the tip circle it is the tip form circle, equal to it and above it says nothing."""
    data = '<component id="15" type="cylindrical_stage_gear_data">'
    assert data in written.text

    def read(value, text=written.text, **given):
        written.path.write_text(text.replace(data, data + attribute("active_tip_diameter", value)))
        return read_rexs(written.path, **given).pair.pinion.tip_form_diameter

    assert float(read("62.5")) == 62.5
    assert "pinion.tip_form_diameter = 62.5 (active_tip_diameter)" in caplog.text
    assert read("62.999") is None and read("64.0") is None
    assert float(read("62.5", given={"pinion.tip_form_diameter": 62.7})) == 62.7
    with pytest.raises(DesignFileError, match="15: active_tip_diameter: 62.5 mm must be 62.8 mm, by the tip form"):
        read("62.5", written.text.replace(TEETH, attribute("tip_form_diameter", "62.8") + TEETH, 1))


TEETH = '<attribute id="number_of_teeth" unit="none">19<'
HELIX = '<attribute id="helix_angle_reference_diameter" unit="deg">0.0<'
SHAPE = '<attribute id="shape_of_relief" unit="none">linear<'
DEPTH = '<attribute id="tip_relief_depth" unit="mm">0.006<'
WIDTH = '<attribute id="face_width" unit="mm">20.0<'
RACK = '<attribute id="tip_corner_radius_factor_reference_profile" unit="none">0.38</attribute>'
REFUSED = {
    "one hand": (HELIX, HELIX.replace("0.0", "-12.5"), "wheel helix_angle = -12.5 deg must be 12.5 deg"),
    "two rings": ('type="cylindrical_gear"', 'type="ring_gear"', "has two ring gears, must have one at most"),
    "bevel gear": ('type="cylindrical_gear"', 'type="bevel_gear"', "must be a cylindrical_gear or a ring_gear"),
    "protuberance": (RACK, RACK + attribute("protuberance_amount", "0.1"), "protuberance_amount: 0.1 must be 0"),
    "chamfer": (TEETH, attribute("chamfer_at_tooth_end", "0.5") + TEETH, "chamfer_at_tooth_end: 0.5 must be 0"),
    "no tip form": (TEETH, attribute("tip_form_diameter", "63.5") + TEETH, "tip_form_diameter = 63.5 mm must be"),
    "no class": (TEETH, attribute("global_tolerance_class_iso_1328_2013", "12", "none") + TEETH,
                 'global_tolerance_class_iso_1328_2013: "12" is not supported, must be one of 1, 2,'),
    "one class": (TEETH, attribute("global_tolerance_class_iso_1328_2013", "6", "none") + TEETH,
                  "global_tolerance_class_iso_1328_2013: missing, the other gear has one"),
    "no ball": (TEETH, attribute("upper_backlash_allowance_balls_or_pins", "-0.1") + TEETH,
                "diameter_of_measuring_ball_or_pin: missing"),
    "reversed": (TEETH, attribute("upper_backlash_allowance_referenced_to_span", "-90", "mum")
                 + attribute("lower_backlash_allowance_referenced_to_span", "-60", "mum") + TEETH,
                 "lower_backlash_allowance_referenced_to_span: -60 must be at most the upper one, -90"),
    "not a length": (WIDTH, WIDTH.replace("20.0", "1e7"), "face_width: 1e+07 mm must be at least"),
    "length alone": ('id="tip_relief_datum_diameter"', 'id="tip_relief_datum_length"', "datum_diameter: missing"),
    "no module": ('id="normal_module" unit="mm">3.0', 'id="normal_module" unit="mm">0', "0 mm must be greater than 0"),
    "thicker tooth": (TEETH, attribute("chordal_tooth_thickness_upper_deviation", "0.05") + TEETH,
                      "upper_deviation: 0.05 makes the tooth 50.17 um thicker, must be at most 0"),
    "another tool": ('type="rack_shaped_tool"', 'type="profile_tool"', "makes a flank, must be a rack_shaped_tool"),
    "another module": ('name="pinion tool">\n      <attribute id="normal_module" unit="mm">3.0',
                       'name="pinion tool">\n      <attribute id="normal_module" unit="mm">3.5',
                       "normal_module: 3.5 mm must be that of the gear, 3 mm"),
    "no width": ('id="face_width" unit="mm">20.0', 'id="width" unit="mm">20.0', "gear 3: face_width: missing"),
    "solid": ('id="inner_diameter" unit="mm">24.0', 'id="inner_diameter" unit="mm">0', "inner_diameter: 0 mm: give"),
    "no distance": ('id="center_distance"', 'id="distance"', "cylindrical_stage 2: center_distance: missing"),
    "unit": ('id="face_width" unit="mm"', 'id="face_width" unit="inch"', 'face_width: unit "inch" must be "mm"'),
    "no number": (WIDTH, WIDTH.replace("20.0", "20,0"), 'face_width: "20,0" is not a finite number'),
    "not finite": (WIDTH, WIDTH.replace("20.0", "1e999"), 'face_width: "1e999" is not a finite number'),
    "not a gear": (">24.0<", ">60.0<", "cylindrical_gear 3: bore_diameter = 60 mm must be less than 49.5 mm"),
    "not a pair": (">100.5<", ">99.0<", "cylindrical_stage 2: center_distance = 99 mm"),
    "exponential": (SHAPE, SHAPE.replace("linear", "exponential"), 'shape_of_relief: "exponential" is not supported'),
    "no shape": (SHAPE, SHAPE.replace("shape_of_relief", "shape"), "shape_of_relief: missing, must be one of linear"),
    "transition": (DEPTH, attribute("specify_tangential_transition", "true", "none") + DEPTH, "transition: is not"),
    "no depth": (DEPTH, DEPTH.replace("depth", "deep"), "tip_relief_depth: missing"),
    "not additive": ('id="is_additive_modification" unit="none">true',
                     'id="is_additive_modification" unit="none">false',
                     "is_additive_modification: must be true beside other modifications"),
    "unknown kind": ('type="helix_slope"', 'type="profile_twist"', "profile_twist 18: is not a supported modification"),
    "offset faces": ('id="common_face_width" unit="mm">18.0', 'id="common_face_width" unit="mm">15', "15 mm must be"),
    "no component": ('<ref id="9" role="gear_2"', '<ref id="99" role="gear_2"', "names component 99, which"),
    "no gear": ('role="gear_2"', 'role="gear_3"', "cylindrical_stage 2: gear_2: missing"),
    "twice": ('<component id="4"', '<component id="3"', "material 3: is given twice in the file"),
    "old": ('version="2.0.0"', 'version="1.3"', "is a modification of REXS 1.3, must be of 1.4 or later"),
    "new": ('version="2.0.0"', 'version="3.0"', "is of REXS 3.0, must be of 1 to 2"),
    "no version": ('version="2.0.0"', 'version="DEV"', 'model: version: "DEV" is not a version of REXS'),
    "no id": ('<component id="4"', '<component id="four"', 'component: id: "four" is not a whole number'),
    "no flank": ('type="flank"', 'type="flanks"', "cylindrical_gear 3: has no left or right flank"),
    "no stage": ('type="cylindrical_stage"', 'type="bevel_stage"', "has no cylindrical_stage"),
    "not closed": ("</components>", "", "not valid XML: mismatched tag"),
    "cut off": ("</model>", "", "not valid XML: no element found"),
    "something else": ("<model ", "<other ", "not valid XML: mismatched tag"),
    "not text": ("pinion left flank", "\x01", "not valid XML: not well-formed (invalid token)"),
    "nested": ("</components>", "<a>" * 40 + "</a>" * 40 + "</components>", "elements are nested too deeply"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_meant_is_refused_in_one_line(written, name):
    old, new, wanted = REFUSED[name]
    assert old in written.text
    changed = written.text.replace(old, new) if name != "twice" else written.text.replace(old, new, 1)
    written.path.write_text(changed)
    with pytest.raises(DesignFileError) as caught:
        read_rexs(written.path)
    message = str(caught.value)
    assert wanted in message and message.startswith(f"{written.path}: ") and "\n" not in message


@pytest.mark.parametrize("times", [60, pytest.param(200, marks=pytest.mark.slow)])
def test_whatever_is_changed_is_read_or_refused_in_one_line(written, times):
    """Slips of a hand: a value, an attribute, an id, a part or a letter."""
    rng, values = (
        random.Random(1),
        ["", "0", "-1", "1e300", "nan", "abc", "0.5", "true", "1,5", "<array><c>1</c></array>"],
    )
    pieces = [
        (r"(<attribute [^>]*>)[^<]*(</attribute>)", lambda found: found[1] + rng.choice(values) + found[2]),
        (r"<attribute [^>]*>[^<]*</attribute>", lambda found: ""),
        (
            r'(id|role|type|unit|order)="[^"]*"',
            lambda found: f'{found[1]}="{rng.choice(["2", "99", "", "mm", "gear"])}"',
        ),
        (r"<(component|relation)\b.*?</\1>", lambda found: ""),
        (r"(?s).", lambda found: rng.choice(["<", "&", "\0", "5"])),
    ]
    places = [[*re.finditer(pattern, written.text, re.DOTALL)] for pattern, _ in pieces]
    refused = 0
    for _ in range(times):
        kind = rng.randrange(len(pieces))
        found = rng.choice(places[kind])
        written.path.write_text(written.text[: found.start()] + pieces[kind][1](found) + written.text[found.end() :])
        try:
            read_rexs(written.path)
        except DesignFileError as error:
            refused += 1
            assert str(error).startswith(f"{written.path}: ") and "\n" not in str(error)
    assert refused > times / 2


@pytest.mark.parametrize(
    "declaration",
    [
        '<!DOCTYPE model [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>',
        '<!DOCTYPE model [<!ENTITY secret SYSTEM "file:///etc/hostname">]>',
        '<!DOCTYPE model SYSTEM "http://localhost/model.dtd">',
    ],
)
def test_no_entity_is_ever_expanded(written, declaration):
    written.path.write_text(written.text.replace("<model ", declaration + "<model ").replace(">20.0<", ">&b;<"))
    with pytest.raises(DesignFileError, match="line 2: declares a document type, which REXS does not have$"):
        read_rexs(written.path)


def test_a_stage_of_several_is_chosen_by_its_id(written):
    written.path.write_text(
        written.text.replace("</components>", '<component id="70" type="cylindrical_stage"/></components>')
    )
    with pytest.raises(DesignFileError, match=r"has 2 cylindrical stages, choose one of 2, 70 by its id \(stage\)"):
        read_rexs(written.path)
    assert read_rexs(written.path, stage=2).torque == 50.0
    with pytest.raises(DesignFileError, match="has no cylindrical_stage 5, must be one of 2, 70"):
        read_rexs(written.path, stage=5)


def test_a_load_case_of_several_is_chosen_by_its_id(written):
    case = re.search(r'<load_case id="1">.*</load_case>', written.text, re.DOTALL)[0]
    other = case.replace('id="1"', 'id="2"').replace("50.0", "-70.0")
    written.path.write_text(written.text.replace(case, case + other))
    with pytest.raises(DesignFileError, match=r"has 2 load cases, choose one of 1, 2 by its id \(load_case\)"):
        read_rexs(written.path)
    assert read_rexs(written.path, load_case=2).torque == 70.0  # its sign tells which way the gears turn
    with pytest.raises(DesignFileError, match="has no load_case 3, must be one of 1, 2"):
        read_rexs(written.path, load_case=3)


def test_a_gear_turns_with_its_shaft(written):
    """Where the file names no speed of the gear."""
    text = re.sub(r'<attribute id="rotational_speed".*?</attribute>', "", written.text)
    shaft = f'<component id="80" type="shaft">{attribute("rotational_speed", "-1234.5", "1 / min")}</component>'
    relation = '<relation id="99" type="assembly"><ref id="80" role="assembly"/><ref id="3" role="part"/></relation>'
    written.path.write_text(text.replace("</components>", shaft + "</components>"))
    assert read_rexs(written.path).speed is None
    with_shaft = text.replace("</components>", shaft + "</components>").replace(
        "</relations>", relation + "</relations>"
    )
    written.path.write_text(with_shaft)
    assert read_rexs(written.path).speed == 1234.5


@pytest.mark.parametrize(
    "points, wanted",
    [
        (([0.0, 0.0], [60.0, 61.0], [0.001]), "must be one per point, with its coordinate and diameter, not 2 coord"),
        (([0.0, 0.0, 5.0], [60.0, 61.0, 60.0], [0.001, 0.0, 0.0]), "must be a full grid of at least 2 diameters"),
        (([0.0, 0.0], [60.0, 60.0], [0.001, 0.0]), "must be a full grid of at least 2 diameters"),
        (([0.0, 5.0], [60.0, 60.0], [0.001, 0.0]), "must be a full grid of at least 2 diameters"),
        (([0.0, 0.0], [50.0, 60.0], [0.001, 0.0]), "50 mm must be at least 53.5624794 mm, the base diameter"),
    ],
)
def test_points_that_make_no_flank_are_refused(written, points, wanted):
    names = "coordinates_of_{}", "diameters_of_{}", "{}_amounts"
    kind = "topographical_modification"
    with pytest.raises(DesignFileError, match=re.escape(wanted)):
        flank(written, kind, **{name.format(kind): values for name, values in zip(names, points)})
    usual = {name.format(kind): values for name, values in zip(names, ([0.0, 0.0], [60.0, 61.0], [0.001, 0.002]))}
    with pytest.raises(DesignFileError, match='type_of_interpolation_topographical_modification: "spline" is not'):
        flank(written, kind, **usual, type_of_interpolation_topographical_modification=("spline", "none"))


def test_flanks_that_differ_have_to_be_chosen(written):
    relation = re.search(r'<relation id="\d+" type="reference">\s*<ref id="8" .*?</relation>', written.text, re.DOTALL)[
        0
    ]
    written.path.write_text(written.text.replace(relation, ""))  # the right flank has no tip relief now
    with pytest.raises(DesignFileError, match=r"flank 7: has other modifications than flank 8, choose left or right"):
        read_rexs(written.path)
    roll = PINION.tip
    said = attribute("loaded_tooth_flank", "right", "none")
    data = '<component id="15" type="cylindrical_stage_gear_data">'
    assert removed(read_rexs(written.path, flank="left").pinion, roll) == pytest.approx(6.0, abs=1e-12)
    assert removed(read_rexs(written.path, flank="right").pinion, roll) == 0.0
    changed = written.path.read_text()
    assert data in changed
    written.path.write_text(changed.replace(data, data + said))
    assert removed(read_rexs(written.path).pinion, roll) == 0.0


def test_a_file_that_is_none_is_refused(tmp_path):
    for path, wanted in ((tmp_path / "none.rexs", "No such file or directory"), (tmp_path, "is a folder, not a file")):
        with pytest.raises(DesignFileError, match=wanted):
            read_rexs(path)
    (tmp_path / "empty.rexs").write_bytes(b"")
    with pytest.raises(DesignFileError, match="empty.rexs: line 1, column 1: not valid XML: no element found"):
        read_rexs(tmp_path / "empty.rexs")


@pytest.mark.parametrize(
    "given, wanted",
    [
        ({"pinion": jg.TipRelief(9.0, 3.0, jg.Quadratic(0.5, 0.5, 0.0))}, "pinion: TipRelief has a step"),
        ({"error": 0.0}, "error = 0 um must be greater than 0 um"),
        ({"torque": -1.0}, "torque = -1 N m must be at least 0 N m"),
        ({"speed": np.nan}, "speed = nan"),
    ],
)
def test_what_cannot_be_written_is_refused_and_leaves_nothing(tmp_path, given, wanted):
    with pytest.raises(ValueError, match=re.escape(wanted)):
        write_rexs(tmp_path / "pair.rexs", PAIR, **given)
    assert not [*tmp_path.iterdir()]


def test_a_cycle_says_its_own_torque_and_pair(tmp_path):
    path, pair = tmp_path / "pair.rexs", gear_pair()
    cycle = jg.solve(prepare(pair, resolution=LINE), 20.0)
    for given, wanted in (
        ({"torque": 20.0}, "torque has no effect with cycle"),
        ({"pinion": jg.TipRelief(1.0, 1.0)}, "pinion has no effect with cycle"),
    ):
        with pytest.raises(ValueError, match=wanted):
            write_rexs(path, pair, cycle=cycle, **given)
    with pytest.raises(ValueError, match="cycle is of another pair"):
        write_rexs(path, PAIR, cycle=cycle)
    with pytest.raises(ValueError, match="cannot be written"):
        write_rexs(tmp_path / "missing" / "pair.rexs", PAIR)
    assert not [*tmp_path.iterdir()]


def call(*arguments):
    """Exit code, stdout and stderr of the command."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as exit_:
        main([str(argument) for argument in arguments])
    return SimpleNamespace(code=exit_.value.code, out=out.getvalue(), err=err.getvalue())


def test_the_command_converts_both_ways(tmp_path):
    rexs, design, again = tmp_path / "pair.rexs", tmp_path / "pair.toml", tmp_path / "again.rexs"
    pinion = jg.TipRelief(6.0, 3.0, jg.Power(1.5)) + jg.LeadCrowning(4.0)
    write_rexs(rexs, PAIR, pinion=pinion, torque=50.0, speed=3000.0, title='19/48 "x"')
    done = call("convert", rexs, design)
    assert done.code == 0 and "19/48 teeth, module 3 mm, centre distance 100.5 mm" in done.out
    found, read = load_design(design), read_rexs(rexs)
    assert (found.torque, found.speed, found.title) == (50.0, 3000.0, '19/48 "x"')
    assert eqx.tree_equal(found.pair(), read.pair)
    design.write_text(design.read_text() + "\n[resolution]\npositions = 16\n")
    done = call("convert", design, again)
    assert done.code == 0 and "left out, REXS has no place for it: [resolution]" in done.out
    first, last = (read_rexs(path) for path in (rexs, again))
    assert eqx.tree_equal(first.pair, last.pair)
    points = np.meshgrid(ALONG, ACROSS)
    np.testing.assert_allclose(removed(last.pinion, *points), removed(first.pinion, *points), atol=1e-12)


def test_what_a_drawing_says_is_converted_both_ways(tmp_path):
    """Limits of the tooth thickness, backlash, tip form diameter, material and class."""
    drawn, rexs, again = tmp_path / "drawn.toml", tmp_path / "drawn.rexs", tmp_path / "again.toml"
    drawn.write_text(
        "[materials.bronze]\nelastic_modulus = 110000.0\n"
        "[pinion]\nteeth = 19\nmodule = 3.0\nface_width = 20.0\nspan = [22.85, 22.88]\nteeth_spanned = 3\n"
        'tip_form_diameter = 62.6\nquality_class = 6\nmaterial = "STEEL"\n'
        '[wheel]\nteeth = 48\nmodule = 3.0\nface_width = 18.0\nquality_class = 7\nmaterial = "bronze"\n'
        "[pair]\nbacklash = 250.0\n[load]\ntorque = 50.0\n"
    )
    done = call("convert", drawn, rexs)
    assert done.code == 0 and "left out" not in done.out
    assert call("convert", rexs, again).code == 0
    first, last = load_design(drawn), load_design(again)
    assert last.quality_classes == first.quality_classes == (6, 7)
    assert float(last.pair().pinion.tip_form_diameter) == 62.6
    assert float(last.pair().wheel.material.elastic_modulus) == 110_000.0
    np.testing.assert_allclose(last.pair().backlash_limits, first.pair().backlash_limits, atol=1e-6)
    tolerances = [float(each.pair().pinion.tooth_thickness_tolerance) for each in (first, last)]
    assert tolerances[0] == pytest.approx(30.0 / np.cos(np.deg2rad(20)), rel=1e-9) == pytest.approx(tolerances[1])


def test_values_of_variables_are_converted(tmp_path):
    """As `jaxgear analyze` takes them; their bounds are left out."""
    design, rexs = tmp_path / "pair.toml", tmp_path / "pair.rexs"
    assert call("new", design, *"--teeth 19 48 --module 3 --torque 50 --face-width 18".split()).code == 0
    done = call("convert", design, rexs)
    assert done.code == 0 and "left out, REXS has no place for it: [variables]" in done.out
    found, given = read_rexs(rexs).pinion, load_design(design)
    points = np.meshgrid(ALONG, ACROSS)
    np.testing.assert_allclose(removed(found, *points), removed(given.design(given.values)[0], *points), atol=1e-9)


def test_the_command_refuses_in_one_line_and_writes_nothing(tmp_path):
    rexs, free, there = tmp_path / "pair.rexs", tmp_path / "free.toml", tmp_path / "there.toml"
    write_rexs(rexs, PAIR)
    there.write_text("# mine\n")
    (tmp_path / "link.toml").symlink_to("nowhere.toml")
    free.write_text(
        "[pinion]\nteeth = 19\nmodule = 3.0\nface_width = 20.0\n[wheel]\nteeth = 48\nmodule = 3.0\nface_width = 18.0\n"
        '[[wheel.modification]]\ntype = "lead_slope"\namount = "free"\n[load]\ntorque = 50.0\n'
        "[variables]\nfree = { low = 0.0, high = 9.0 }\n"
    )

    def everything():
        return {path: os.readlink(path) if path.is_symlink() else path.read_bytes() for path in tmp_path.iterdir()}

    before = everything()
    for arguments, wanted in (
        ((rexs, tmp_path / "new.toml"), "names no torque of the pinion, give it with --torque"),
        ((rexs, there, "--torque", "50"), "there.toml: exists already, choose another name"),
        ((rexs, tmp_path / "link.toml", "--torque", "50"), "link.toml: exists already, choose another name"),
        ((rexs, tmp_path / f"{'a' * 300}.toml", "--torque", "50"), "aaa.toml: cannot be written: File name too long"),
        (
            (rexs, tmp_path / "new.txt"),
            "pair.rexs to new.txt: one name must end in .toml, the other in .rexs, .xml, .rexsj, .json, .rexsz, .zip",
        ),
        ((rexs, tmp_path / "new.toml", "--stage", "7"), "has no cylindrical_stage 7, must be one of 2"),
        ((rexs, tmp_path / "new.toml", "--torque", "0"), "torque = 0 N m must be greater than 0 N m"),
        ((free, tmp_path / "new.rexs"), "convert needs numbers, these are free: free"),
        ((free, tmp_path / "new.rexs", "--torque", "5"), "--torque has no effect on a design file, leave it out"),
    ):
        done = call("convert", *arguments)
        assert done.code == 2 and done.out == "" and wanted in done.err and done.err.count("\n") == 1
        assert everything() == before
    assert call("convert", rexs, tmp_path / "new.toml", "--torque", "50").code == 0
