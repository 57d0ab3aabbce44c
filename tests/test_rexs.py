"""REXS files: what is written reads back as it was, is of the schema, and values without a meaning are refused."""

import dataclasses
import re
from functools import cache
from xml.etree import ElementTree

import jax
import numpy as np
import pytest
from catalogue import LINE, gear_pair, prepare
from rexs_schema import FOLDER, faults

import jaxgear as jg
from jaxgear.geometry import span
from jaxgear.io import describe
from jaxgear.io.table_keys import family
from jaxgear.microgeometry import AbstractCurve, AbstractModification, TabulatedFlank
from jaxgear.numerics import number
from jaxgear.rexs import read_rexs, write_rexs
from jaxgear.rexs.frame import frames
from jaxgear.rexs.gears import SPANS

PINION = jg.Gear(
    teeth=19,
    module=3.0,
    profile_shift=0.13,
    face_width=20.0,
    bore_diameter=24.0,
    tip_diameter=63.7,
    tip_edge_radius=0.07,
    tip_form_diameter=63.4,
    tooth_thickness_allowance=-41.3,
    tooth_thickness_tolerance=27.1,
    material=jg.Material(elastic_modulus=210_000.0, density=7812.5, thermal_contact_coefficient=13_456.7),
)
WHEEL = jg.Gear(teeth=48, module=3.0, face_width=18.0, addendum=0.98, dedendum=1.2, root_radius=0.3, tip_diameter=149.5)
PAIR = jg.GearPair(PINION, WHEEL, 101.2)
EXACT, POINTS = 1e-12, 0.01  # um

# every curve, and by how much a relief of this curve may differ after it was written and read [um]
CURVES = {
    "linear": (jg.Linear(), EXACT),
    "parabolic": (jg.Parabolic(), EXACT),
    "parabolic_linear": (jg.ParabolicLinear(0.4), POINTS),
    "power": (jg.Power(1.5), POINTS),
    "quadratic": (jg.Quadratic(0.0, 0.3, 0.7), EXACT),
    "polynomial": (jg.Polynomial([0.0, 0.2, 0.3, 0.5]), POINTS),
    "sinusoidal": (jg.microgeometry.Sinusoidal(1.2, 0.0, -np.pi / 2), POINTS),
    "spline": (jg.microgeometry.Spline([0.0, 0.2, 0.5, 1.0]), POINTS),
}
# every modification, likewise
MODIFICATIONS = {
    "tip_relief": (jg.TipRelief(6.9, 3.4, jg.Linear()), EXACT),
    "root_relief": (jg.RootRelief(4.3, 2.1, jg.Power(2.0)), EXACT),
    "profile_crowning": (jg.ProfileCrowning(3.7), EXACT),
    "profile_slope": (jg.ProfileSlope(-2.9), EXACT),
    "lead_crowning": (jg.LeadCrowning(5.3), EXACT),
    "lead_slope": (jg.LeadSlope(-7.1), EXACT),
    "end_relief": (jg.EndRelief(6.1, 3.3, jg.Parabolic(), side="positive"), EXACT),
    "tabulated_profile": (jg.TabulatedProfile([0.9, 1.1, 1.4], [0.0, -1.3, 6.2], "roll_angle"), EXACT),
    "tabulated_flank": (TabulatedFlank([8.0, 11.0, 15.0], [-4.0, 1.0, 7.0], np.arange(9.0).reshape(3, 3)), EXACT),
    "no_modification": (jg.NoModification(), EXACT),
}
OTHERS = {
    "sum with factors": (
        2.0 * (jg.TipRelief(3.1, 3.0, jg.Linear()) + 0.3 * jg.LeadCrowning(5.0)) - jg.ProfileSlope(1.0),
        EXACT,
    ),
    "end relief of another curve": (jg.EndRelief(6.0, 4.0, jg.Power(1.6)), POINTS),
    "cubic table": (jg.TabulatedProfile([8.0, 10.0, 14.0, 16.0], [0.0, 3.0, 1.0, 6.0], method="natural_cubic"), POINTS),
    "relief longer than the involute": (jg.TipRelief(3.0, 40.0, jg.Linear()), EXACT),
}


@cache
def frame_of(gear):
    """Of the pinion or the wheel; not at import, so that one worker alone works it out."""
    return dict(zip(("pinion", "wheel"), frames(PAIR)))[gear]


class Blunt(jg.Linear):
    """A curve of a user's own, derived from one of the library."""

    def __call__(self, d):
        return d * d * (3.0 - 2.0 * d)


class Bump(AbstractModification):
    """A hollow in the middle of the flank, of a user's own class."""

    amount: jax.Array = number("um")

    varies_along_face = True

    def __call__(self, flank):
        along = (flank.roll_length - 0.5 * (frame_of("pinion").start + frame_of("pinion").tip)) / 2.0
        return self.amount * jax.numpy.exp(-(along**2) - (flank.face_coordinate / 5.0) ** 2)


def again(path, pair=PAIR, **given):
    """What is written, read."""
    write_rexs(path, pair, **given)
    return read_rexs(path)


def difference(frame, first, second):
    """Largest difference of two modifications on the flank [um], between whatever points a table may have."""
    roll = np.sort(np.concatenate([np.linspace(frame.start, frame.tip, 331), [frame.tip - 3.4, frame.start + 2.1]]))
    along, across = np.meshgrid(roll, np.linspace(-0.5, 0.5, 47) * frame.width)
    return np.abs(frame.removed(first, along, across) - frame.removed(second, along, across)).max()


def test_a_pair_comes_back_as_it_was(tmp_path):
    given = {"torque": 51.7, "speed": 2987.3, "quality_classes": (6, 11), "title": 'a <pair> & "more"\n'}
    found = again(tmp_path / "pair.rexs", **given)
    assert jax.tree.structure(found.pair) == jax.tree.structure(PAIR)
    for name in ("teeth", "module", "pressure_angle", "profile_shift", "face_width", "addendum", "dedendum"):
        for gear in ("pinion", "wheel"):
            assert getattr(getattr(found.pair, gear), name) == getattr(getattr(PAIR, gear), name)
    for name in ("root_radius", "tip_diameter", "tip_form_diameter", "bore_diameter", "tip_edge_radius"):
        assert getattr(found.pair.pinion, name) == getattr(PINION, name)
    for name in ("elastic_modulus", "poisson_ratio", "density", "thermal_contact_coefficient"):
        assert getattr(found.pair.pinion.material, name) == getattr(PINION.material, name)
    # to every digit, and with no further ones
    allowance = found.pair.pinion.tooth_thickness_allowance, found.pair.pinion.tooth_thickness_tolerance
    assert tuple(map(float, allowance)) == (-41.3, 27.1)
    # and as a drawing has it, for programs that read no chord
    text = (tmp_path / "pair.rexs").read_text()
    attributes = dict(re.findall(r'<attribute id="([a-z_]*(?:span|span_measurement))" unit="m+u?m?">([^<]+)<', text))
    thick = span(dataclasses.replace(PINION, tooth_thickness_tolerance=0.0 * PINION.module), 3)
    wanted = float(attributes["span_measurement"]) + 1e-3 * float(attributes[SPANS[0]])
    assert wanted == pytest.approx(float(thick), abs=1e-9) and ">3</attribute>" in text
    width = float(attributes[SPANS[0]]) - float(attributes[SPANS[1]])
    assert width == pytest.approx(27.1 * np.cos(np.deg2rad(20.0)), rel=1e-12)
    assert found.pair.center_distance == 101.2 and found.pair.wheel.bore_diameter is None
    assert (found.torque, found.speed, found.title) == (51.7, 2987.3, 'a <pair> & "more"')
    assert found.quality_classes == (6, 11)


def test_materials_have_their_names(tmp_path):
    write_rexs(tmp_path / "pair.rexs", PAIR, materials=("18CrNiMo7-6", None))
    written = (tmp_path / "pair.rexs").read_text("utf-8")
    assert 'name="18CrNiMo7-6"' in written and 'name="wheel material"' in written


def test_a_parabolic_relief_comes_back_as_one(tmp_path):
    """REXS has a linear and a quadratic part of it; parts of other shares or lengths stay apart."""
    apart = jg.TipRelief(2.0, 3.0, jg.Linear()) + jg.TipRelief(3.0, 3.0, jg.Power(2.0))
    found = again(tmp_path / "pair.rexs", pinion=jg.TipRelief(6.5, 3.0) + jg.ProfileSlope(1.0), wheel=apart)
    first, second = describe(found.pinion)
    assert (first["type"], first["curve"], second["type"]) == ("tip_relief", {"type": "parabolic"}, "profile_slope")
    assert (first["amount"], first["length"]) == pytest.approx((6.5, 3.0), rel=1e-9)
    assert [part["curve"]["type"] for part in describe(found.wheel)] == ["linear", "power"]


def test_what_a_pair_leaves_open_comes_back_as_the_number_it_means(tmp_path):
    pair = jg.GearPair(jg.Gear(teeth=20, module=2.0, face_width=9.0), jg.Gear(teeth=30, module=2.0, face_width=9.0))
    found = again(tmp_path / "pair.rexs", pair).pair
    assert found.pinion.tip_diameter == 44.0 and found.pinion.addendum == 1.0
    np.testing.assert_allclose(found.center_distance, 50.0, rtol=1e-14)
    assert found.pinion.bore_diameter is None and found.pinion.tooth_thickness_allowance == 0


def test_every_modification_and_curve_of_the_library_is_tried():
    assert set(MODIFICATIONS) == set(family(AbstractModification, users=False))
    assert set(CURVES) == set(family(AbstractCurve, users=False))


@pytest.mark.parametrize("name", [*MODIFICATIONS, *CURVES, *OTHERS])
def test_a_modification_comes_back_as_it_was(tmp_path, name):
    if name in CURVES:
        curve, most = CURVES[name]
        modification = jg.TipRelief(9.7, 5.2, curve)
    else:
        modification, most = (MODIFICATIONS | OTHERS)[name]
    found = again(tmp_path / "flank.rexs", pinion=modification, wheel=modification)
    assert difference(frame_of("pinion"), modification, found.pinion) <= most
    assert difference(frame_of("wheel"), modification, found.wheel) <= most
    if name != "no_modification":  # or the test could not fail
        assert difference(frame_of("pinion"), modification, jg.NoModification()) > 1.0


@pytest.mark.parametrize("most", [0.1, 0.01])
def test_a_modification_of_a_users_own_goes_through_points(tmp_path, most):
    found = again(tmp_path / "flank.rexs", pinion=-0.5 * Bump(18.0), error=most).pinion
    assert isinstance(found, TabulatedFlank)
    error = difference(frame_of("pinion"), -0.5 * Bump(18.0), found)
    assert most / 50 < error <= most  # no more points than needed


def test_a_curve_of_a_users_own_is_not_taken_for_what_it_derives_from(tmp_path):
    found = again(tmp_path / "flank.rexs", pinion=jg.TipRelief(9.0, 5.0, Blunt())).pinion
    assert difference(frame_of("pinion"), jg.TipRelief(9.0, 5.0, Blunt()), found) <= POINTS


def test_points_serve_programs_that_interpolate_over_the_diameter(tmp_path):
    relief = jg.TipRelief(20.0, 8.0, jg.Power(1.5))
    found = again(tmp_path / "flank.rexs", pinion=relief).pinion
    roll = np.linspace(frame_of("pinion").start, frame_of("pinion").tip, 901)
    by_diameter = np.interp(
        frame_of("pinion").diameter(roll), frame_of("pinion").diameter(np.asarray(found.position)), found.amount
    )
    assert np.abs(by_diameter - frame_of("pinion").removed(relief, roll, 0 * roll)).max() <= 0.01


def test_a_file_is_written_again_as_it_was(tmp_path):
    pinion = jg.TipRelief(6.9, 3.4) + jg.LeadSlope(3.0) + MODIFICATIONS["tabulated_flank"][0]
    wheel = jg.ProfileCrowning(2.0) + jg.EndRelief(4.0, 3.0, side="negative") + jg.RootRelief(3.0, 2.0)
    first = again(tmp_path / "first.rexs", pinion=pinion, wheel=wheel, torque=50.0, speed=1000.0, title="both")
    write_rexs(tmp_path / "second.rexs", **vars(first))
    texts = [ElementTree.parse(tmp_path / name).getroot() for name in ("first.rexs", "second.rexs")]
    for one, other in zip(*(root.iter() for root in texts), strict=True):
        assert one.tag == other.tag and (one.tag == "model" or one.attrib == other.attrib)
        if re.fullmatch(r"[-+.\deE]+", (one.text or "").strip()):
            np.testing.assert_allclose(float(other.text), float(one.text), rtol=1e-12, atol=1e-15)
        else:
            assert one.text == other.text


@pytest.fixture(scope="module")
def mesh():
    return prepare(gear_pair(), resolution=LINE)


@pytest.fixture(scope="module")
def solved(mesh):
    relief = jg.TipRelief(4.0, 3.0)
    return jg.solve(mesh, jg.OperatingPoint(20.0, 3000.0, 0.05), pinion=relief, wheel=relief)


@pytest.fixture(scope="module")
def results(solved, tmp_path_factory):
    path = tmp_path_factory.mktemp("rexs") / "results.rexs"
    write_rexs(path, solved.kinematics.pair, cycle=solved)
    return path


def arrays(path):
    """Arrays of point list and load case by their names."""
    root = ElementTree.parse(path).getroot()
    found = {}
    for item in root.iter("attribute"):
        if item.find("array") is not None:
            found[item.get("id")] = np.array([float(c.text) for c in item.iter("c")])
    return found


def test_contact_results_carry_the_torque(results, solved):
    """One base pitch apart on the line of action, the pairs together transmit the base tangential force."""
    found, pair = arrays(results), solved.kinematics.pair
    roll = np.sqrt(found["point_coordinates_radius"] ** 2 - float(pair.pinion.base_radius) ** 2)
    force = found["local_normal_line_load"] * float(pair.face_width)  # one slice
    path = solved.kinematics.path_of_contact
    pitch, start, end = float(path.base_pitch), *map(float, path.pinion_roll_length(np.array([path.start, path.end])))
    low = (roll >= start) & (roll <= end - pitch)
    mate = [np.argmin(np.abs(roll - rho - pitch)) for rho in roll[low]]
    np.testing.assert_allclose(roll[mate], roll[low] + pitch, rtol=1e-9)
    both = force[low] + force[mate]
    # where no tip corner takes part of the load
    np.testing.assert_allclose(np.median(both), 1e3 * 20.0 / float(pair.pinion.base_radius), rtol=1e-9)


def test_contact_results_are_those_of_hertz_and_blok(results, solved):
    found, kinematics = arrays(results), solved.kinematics
    path, pair = kinematics.path_of_contact, kinematics.pair
    base = float(pair.pinion.base_radius)
    roll = np.sqrt(found["point_coordinates_radius"] ** 2 - base**2)
    position = roll - float(path.pinion_pitch_roll_length)
    omega = 3000.0 * np.pi / 30
    sliding = 1e-3 * omega * position * (1 + base / float(pair.wheel.base_radius))
    np.testing.assert_allclose(found["local_sliding_velocity"], sliding, atol=1e-9)
    reduced = np.asarray(path.reduced_radius(position))
    modulus = 206_000.0 / (2 * (1 - 0.3**2))
    flat = (np.abs(position) < 1.0) & (found["local_normal_line_load"] > 0)  # away from the relief
    stress = np.sqrt(found["local_normal_line_load"] * modulus / np.pi / reduced)
    assert flat.any()
    np.testing.assert_allclose(found["local_hertzian_contact_stress"][flat], stress[flat], rtol=1e-6)
    flash = found["local_flash_temperature_blok_1937"]
    assert flash[flat].min() >= 0 and flash.max() > 1.0
    np.testing.assert_array_equal(found["set_ids"], found["point_ids"])


def test_files_are_of_the_xml_schema(tmp_path, results):
    schema = pytest.importorskip("xmlschema").XMLSchema(FOLDER / "rexs-file.xsd")
    write_rexs(tmp_path / "all.rexs", PAIR, pinion=everything(), wheel=everything(), torque=1.0, speed=2.0, title="x")
    schema.validate(tmp_path / "all.rexs")
    schema.validate(results)
    text = (tmp_path / "all.rexs").read_text("utf-8-sig").replace('role="workpiece"', "", 1)
    (tmp_path / "bad.rexs").write_text(text)
    assert not schema.is_valid(tmp_path / "bad.rexs")


def everything():
    """Every modification of the library at once."""
    return sum(each for each, _ in [*MODIFICATIONS.values(), *OTHERS.values()])


def test_files_are_of_the_data_model(tmp_path, results):
    path = tmp_path / "all.rexs"
    write_rexs(path, PAIR, pinion=everything(), torque=1.0, speed=2.0, quality_classes=(1, 10), title="x")
    assert faults(path.read_bytes()) == []
    assert faults(results.read_bytes()) == []


@pytest.mark.parametrize(
    "old, new",
    [
        ('id="face_width" unit="mm"', 'id="face_width" unit="mum"'),
        ('id="face_width"', 'id="width_of_face"'),
        ('type="tip_relief"', 'type="tip_reliefs"'),
        (">linear<", ">straight<"),
        ('role="gear_2"', 'role="wheel"'),
        (' order="1"', ""),
        ('<attribute id="number_of_teeth" unit="none">19<', '<attribute id="number_of_teeth" unit="none">19.5<'),
    ],
)
def test_the_check_of_the_data_model_sees_faults(tmp_path, old, new):
    write_rexs(tmp_path / "pair.rexs", PAIR, pinion=jg.TipRelief(1.0, 2.0, jg.Linear()))
    content = (tmp_path / "pair.rexs").read_text("utf-8-sig")
    assert old in content
    assert faults(content.replace(old, new).encode())
