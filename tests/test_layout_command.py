"""The command `jaxgear layout` and its tables: what it writes and says, and one line for what is wrong."""

import csv
import importlib
import json
from types import SimpleNamespace

import equinox as eqx
import numpy as np
import pytest
from commands import FACE, LINE, call
from report_page import check_report

import jaxgear as jg
from jaxgear import plot
from jaxgear.io import load_design
from jaxgear.layout import LayoutResult, LayoutStudy, at_stations, layout_flank_lines
from jaxgear.metrics import face_load_factor
from jaxgear.report import Figure
from jaxgear.vocabulary import quantities

pytestmark = pytest.mark.usefixtures("no_cache")

FILE = """
[pinion]
teeth = 19
module = 3.0
face_width = 18.0
bore_diameter = 24.0
tip_diameter = 63.0
[wheel]
teeth = 48
module = 3.0
face_width = 18.0
bore_diameter = 70.0
tip_diameter = 150.0
[load]
torque = 150.0
[resolution]
SIZES
[housing]
file = "housing.csv"
[[shafts]]
name = "in"
sections = [{ length = 40.0, diameter = 34.0 }, { length = 120.0, diameter = 40.0 }]
bearings = [
    { name = "A", position = 60.0, radial = 250.0, axial = 80.0 },
    { name = "B", position = 140.0, radial = 250.0 },
]
gears = [{ name = "pinion", position = 20.0, integral = true }]
couplings = [{ position = 160.0, torque = 150.0 }]
[[shafts]]
name = "out"
sections = [{ length = 190.0, diameter = 45.0 }]
bearings = [
    { name = "C", position = 20.0, radial = 300.0, axial = 100.0 },
    { name = "D", position = 130.0, radial = 300.0 },
]
gears = [{ name = "wheel", position = 45.0, body_diameter = 70.0 }]
couplings = [{ position = 190.0 }]
[layout]
quality_class = 6
misalignment = { skew = 15.0, inclination = 30.0, bearing_span = 80.0 }
stations = 21
""".replace("SIZES", FACE)
PROFILE = """
[layout.profile]
pinion_amounts = [10.0, 20.0]
"""
ONE_PROFILE = PROFILE.replace(", 20.0", "") + "wheel_amounts = [10.0]\n"
END_RELIEF = 'further = "end_relief"\n'
AXES = "{ skew = 15.0, inclination = 30.0, bearing_span = 80.0 }"
LIFE = """
torques = [60.0, 150.0]
hours = [1000.0, 50.0]
speeds = [900.0, 600.0]
[strength]
pitting = 1500.0
pitting_exponent = 13.2
pitting_cycles = 5e7
bending = 900.0
bending_exponent = 8.7
bending_cycles = 3e6
"""
# the same with all torques of a quick run from 60 to 300 N m, as many as in `test_layout`
IDLE = LIFE.replace("[60.0,", "[60.0, 300.0,").replace("[1000.0,", "[1000.0, 0.0,").replace("[900.0,", "[900.0, 600.0,")
HOUSING = """compliance um/N, A.x, B.x, C.x, D.x
A.x, 1e-3, 0, 0, 0
B.x, 0, 1e-3, 0, 0
C.x, 0, 0, 2e-3, 0
D.x, 0, 0, 0, 8e-3
"""


def replaced(old, new):
    assert old in FILE
    return FILE.replace(old, new, 1)


@pytest.fixture
def file(file, tmp_path):
    def written(text, housing=HOUSING):
        (tmp_path / "housing.csv").write_text(housing)
        return file(text)

    return written


DOUBTFUL = FILE.replace("bore_diameter = 70.0", "bore_diameter = 44.0")  # less than the shaft


@pytest.fixture
def two_torques(monkeypatch):
    """Flank lines for a duty cycle, whose torques are all there are: one program for both."""
    for name in "_TORQUES", "_QUICK_TORQUES":
        monkeypatch.setattr(importlib.import_module("jaxgear.layout.study"), name, 2)
    return (DOUBTFUL + IDLE).replace("torque = 150.0\n", "torque = 150.0\ntorque_range = [60.0, 300.0]\n", 1)


def test_the_command_writes_what_it_says(file, tmp_path, two_torques):
    text = two_torques.replace('[housing]\nfile = "housing.csv"\n', "")
    found, _ = laid_out(file(text), tmp_path / "out", "--quick")
    assert list(found["layouts"]) == list(found["bearings"]) == ["rigid seats"]


@pytest.mark.slow
def test_the_command_compares_with_rigid_seats(file, tmp_path, two_torques):
    """A whole run, which evaluates the flank lines on a finer grid as well."""
    found, out = laid_out(file(two_torques), tmp_path / "out")
    housed, rigid = found["layouts"]["housing"], found["layouts"]["rigid seats"]
    assert housed["step_1"]["slope_um"] != pytest.approx(rigid["step_1"]["slope_um"], abs=0.01)
    assert housed["further_amount_um"] == pytest.approx(rigid["further_amount_um"])
    assert f"{rigid['step_1']['slope_um']:.2f}" in out
    seats = {name: np.abs(each["seat_um"]).max() for name, each in found["bearings"]["housing"].items()}
    assert max(seats, key=seats.get) in ("A", "D")
    assert not any(np.any(each["seat_um"]) for each in found["bearings"]["rigid seats"].values())


HELICAL = FILE.replace("[pinion]", "[pinion]\nhelix_angle = 15.0").replace("tip_diameter = 63.0\n", "")
HELICAL = HELICAL.replace("tip_diameter = 150.0\n", "").replace("pairs = 2", "pairs = 3")


@pytest.mark.slow
def test_the_command_lays_out_helical_pairs(file, tmp_path):
    done = call("layout", str(file(HELICAL + PROFILE)), "--output", str(tmp_path / "out"), "--quick")
    assert done.code == 0, done.err
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    main = found["layouts"]["rigid seats"]
    assert main["face_load_factor"]["step_1"] < main["face_load_factor"]["unmodified"]
    force = {name: each["force_N"][2] for name, each in found["bearings"]["rigid seats"].items()}
    axial = 2e3 * 150.0 * np.sin(np.deg2rad(15.0)) / (3.0 * 19)  # to positive z: right hand, counterclockwise
    np.testing.assert_allclose([force[name] for name in "ABCD"], [axial, 0.0, -axial, 0.0], atol=1e-3)
    (ratio,) = {each["contact_ratio"] for each in found["profiles"].values()}
    assert ratio == pytest.approx(1.570 + 18.0 / 20.0 * 0.5492, abs=1e-3)  # with overlap


def test_a_helical_pinion_turns_counterclockwise(file):
    text = HELICAL.replace("[layout]", '[layout]\ndirection = "clockwise"')
    with pytest.raises(ValueError, match="layout.direction: makes the helical pinion turn clockwise") as refused:
        load_design(file(text))
    assert len(str(refused.value).splitlines()) == 1
    loose = HELICAL.replace(", axial = 80.0", "")
    with pytest.raises(ValueError, match='axial force of gear "pinion" needs a bearing of axial stiffness'):
        load_design(file(loose))


def laid_out(path, folder, *quick):
    """Summary and output of the command, after what holds with and without a housing."""
    done = call("layout", str(path), "--output", str(folder), "--report", *quick)
    assert done.code == 0, done.err
    findings = [line for line in done.out.splitlines() if line.startswith("warning")]
    assert len(findings) == 1 and findings[0].startswith(
        'warning: gear "wheel", shaft diameter over bore 1.023 is more'
    )
    assert "warning" in (folder / "report.html").read_text()
    names = {entry.name for entry in folder.iterdir()}
    figures = {"tolerance_cases.png", "face_load_factors.png", "face_load_over_torque.png", "shaft_deflection.png"}
    assert names == {"summary.json", "report.html", "flanks.csv", *figures}
    check_report(folder, path, "layout", path, "--output", folder, "--report", *quick)
    found = json.loads((folder / "summary.json").read_text())
    main = next(iter(found["layouts"].values()))
    assert main["face_load_factor"]["unmodified"] > 1.3 and main["face_load_factor"]["step_1"] < 1.1
    for case in ("statistical", "maximum"):
        *_, last = main["step_1_cases"][case]["edge_contact"]
        assert last and not any(main["step_2_cases"][case]["edge_contact"])
    assert f"{main['step_1']['slope_um']:.2f}" in done.out
    before, level, after = main["relative_life"]
    assert main["torque_Nm"] == 150.0 and before < 0.9 and level == pytest.approx(1.0, rel=1e-12)
    unmodified, uncrowned, crowned = main["worst_relative_life"]["maximum"]
    assert unmodified < uncrowned < crowned < after and "worst case of maximum deviations" in done.out
    bare = main["unmodified_cases"]["maximum"]
    assert bare["face_load_factor"][0] == pytest.approx(main["face_load_factor"]["unmodified"])
    assert f"{max(bare['face_load_factor']):.3f}" in done.out and "unmodified / step 1 / step 2" in done.out
    assert f"the least is {main['least_further_amount_um']:.1f} um" in done.out
    assert min(main["step_2_cases"]["maximum"]["life_h"]) == pytest.approx(crowned * main["life_h"][1])
    factor = main["face_load_factor"]["unmodified"]
    assert 1 < main["root_face_load_factor"]["unmodified"] < factor and "K_Fbeta, worst case" in done.out
    over = found["face_load_over_torque"]
    assert {60.0, 150.0, 300.0} <= set(over["torque_Nm"])  # of the duty cycle and of the range of the file
    assert over["unmodified"] == pytest.approx([factor] * len(over["torque_Nm"]))
    with (folder / "flanks.csv").open() as rows:
        flanks = {row["design"]: row for row in csv.DictReader(rows) if row["gear"] == "wheel"}
    # the last row of a flank is its tip at the end of the face
    end = main["wheel"]["slope_um"] / 2 + main["wheel"]["crowning_um"]
    assert float(flanks["step 2"]["modification_um"]) == pytest.approx(end, abs=1e-5)
    assert float(flanks["step 1"]["modification_um"]) < end
    if quick:
        assert "change_at_twice_the_stations" not in found and found["quick"] and "quick run, " in done.out
    else:
        changes = {step: of["face_load_factor"] for step, of in found["change_at_twice_the_stations"].items()}
        assert 0 < abs(changes["unmodified"]) < 0.02 * factor and list(changes) == ["unmodified", "step_1", "step_2"]
        said = f"twice as many change face load factor K_Hbeta: unmodified by {changes['unmodified']:+.2g}"
        assert f"evaluated at 21 stations (ISO 6336-1 Annex E); {said}" in done.out
    assert "life relative to the even load" in done.out and "life after step 1 [h]" in done.out
    assert found["profiles"] == {}
    for one in found["layouts"].values():
        assert [(each["name"], each["where"]) for each in one["findings"]] == [
            ("shaft diameter over bore", 'gear "wheel"')
        ]
    return found, done.out


@pytest.mark.slow
def test_twice_the_slices_are_those_of_the_file(file, tmp_path):
    """What twice the slices are said to change is what the contact of a file with so many has more."""

    def written(slices):
        text = replaced("slices = 6", f"slices = {slices}").replace('[housing]\nfile = "housing.csv"\n', "")
        return file(text + ONE_PROFILE)

    done = call("layout", str(written(4)), "--output", str(tmp_path / "out"), "--no-figures")
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert " slices (contact analysis); twice as many change face load factor K_Hbeta: unm" in done.out, done.err
    finer = load_design(written(8))
    study, size = LayoutStudy.of(finer), finer.resolution()
    held = at_stations(study.supports["rigid seats"], study.profile_torque, stations=size.slices)
    after = face_load_factor(jg.solve(finer.mesh(size, held, rigid=False), study.profile_torque))
    before = found["contact"]["rigid seats"]["unmodified"]["face_load_factor"]
    change = found["change_at_twice_the_slices"]["unmodified"]["face_load_factor"]
    assert change == pytest.approx(float(after) - before, rel=1e-6) and change > 0.01


@pytest.mark.slow
def test_the_radar_has_the_lives_of_both_gears(file, monkeypatch):
    """Where there is a duty cycle; that without any K_Hbeta has no life."""
    design = load_design(file(FILE + LIFE))
    asked, drawn = LayoutStudy.of(design, quick=True), []
    monkeypatch.setattr(plot, "panels", lambda *given, **options: None)
    monkeypatch.setattr(Figure, "of", lambda draw, *given, **_: drawn.append(given[0]) if draw is plot.radar else None)
    profile = SimpleNamespace(
        table=SimpleNamespace(
            column=lambda name: np.asarray([1.2, 1.0, np.nan]),
        ),
        radar_table=lambda: {quantities["ppte"]: np.ones(3)},
        radar_variants=lambda: ([0, 1], ["no profile modification", "best"]),
    )
    layout = SimpleNamespace(after={"maximum": None}, cases=[])
    study = SimpleNamespace(**{**vars(asked), "profile": profile}, main=layout, over_torque={}, cycles={}, profiles={})
    study.lives = lambda profile: LayoutResult.lives(study, profile)
    list(LayoutResult.figures(study))
    (values,) = drawn
    lives = list(values)[-2:]
    assert [(of.key, of.better) for of in lives] == [("pinion_life_h", "larger"), ("wheel_life_h", "larger")]
    for of in lives:
        uneven, even, none = values[of]
        assert uneven / even == pytest.approx(1.2**-6.6, rel=1e-9) and np.isnan(none)
    study.options = {}
    list(LayoutResult.figures(study))
    assert list(drawn[1]) == list(values)[:-2]


@pytest.mark.slow
def test_profiles_follow_the_flank_lines(file, tmp_path):
    folder = tmp_path / "out"
    text = replaced("slices = 6", "slices = 4") + PROFILE + "[tolerance]\nquality_class = 7\n"
    done = call("layout", str(file(text)), "--output", str(folder), "--quick")
    assert done.code == 0, done.err
    assert "[tolerance] is not part" in done.err and "flank lines deviate by the limits of [layout]" in done.err
    names = {entry.name for entry in folder.iterdir()}
    figures = {"tolerance_cases.png", "face_load_factors.png", "face_load_over_torque.png", "shaft_deflection.png"}
    figures |= {"radar.png", "transmission_error.png", "load_sharing.png", "lead_chart.png"}
    figures |= {"contact_pattern_unmodified.png", "contact_pattern_layout.png"}
    assert names == {"summary.json", "flanks.csv", "profiles.csv", *figures} and names
    found = json.loads((folder / "summary.json").read_text())
    assert "change_at_twice_the_slices" not in found and "change_at_twice_the_stations" not in found
    assert found["quick"] and found["layouts"]["housing"]["face_load_factor"]["step_1"] < 1.01
    profile, other = (found["profiles"][name] for name in ("housing", "rigid seats"))
    assert profile["best"]["ppte_um"] == pytest.approx(other["best"]["ppte_um"], rel=0.05)  # both are level
    assert profile["variants"] == 5 and profile["torque_Nm"] == pytest.approx(135.0)
    assert profile["best"]["ppte_um"] < profile["unmodified"]["ppte_um"]
    contact = found["contact"]["housing"]
    bare, level, crowned = (contact[step]["face_load_factor"] for step in ("unmodified", "step_1", "step_2"))
    assert level < 1.1 < 1.3 < min(bare, crowned)
    assert contact["step_2"]["edge_load_factor"] < 1.0 < contact["unmodified"]["edge_load_factor"]
    assert 1 < contact["unmodified"]["root_face_load_factor"] < bare
    assert contact["annex_e_face_load_factor"]["unmodified"] == pytest.approx(bare, rel=0.25)
    of_cases = contact["cases_face_load_factor"]["maximum"]
    assert of_cases["step_2"][0] == contact["step_2"]["face_load_factor"] and max(of_cases["unmodified"]) > bare
    assert f"{max(of_cases['step_2']):.3f}" in done.out
    with (folder / "profiles.csv").open() as rows:
        head = rows.readline()
    assert all(name in head for name in ("face_load_factor", "root_face_load_factor", "edge_load_factor"))
    kinds = [one["type"] for one in found["designs"]["step 3"]["wheel_modification"]]
    assert kinds == ["lead_slope", "lead_crowning", "tip_relief"]


@pytest.mark.slow
def test_the_file_is_the_script(file):
    """What the command finds is what the library finds for the same gearbox; a mesh angle turns the plane of action."""
    design = load_design(file(FILE))
    study = LayoutStudy.of(design)
    assert LayoutStudy.of(design, quick=True).options["stations"] == 21
    assert list(study.supports) == ["housing", "rigid seats"]
    assert study.supports["housing"].gearbox.housing.nodes == ("A.x", "B.x", "C.x", "D.x")
    assert study.supports["rigid seats"].gearbox.housing is None
    turned = FILE.replace("[layout]", '[[meshes]]\npinion = "pinion"\nwheel = "wheel"\nangle = 70.0\n[layout]')
    other = LayoutStudy.of(load_design(file(turned)))
    bent = [np.asarray(at_stations(one.supports["housing"], 150.0, stations=6).bent) for one in (study, other)]
    # of the soft corner in x alone, whatever lies in the line of action: cos of its angle with the plane
    tilts = [each[-1] - each[0] for each in bent]
    assert abs(tilts[0] - tilts[1]) > 0.1


@pytest.mark.slow
def test_the_flank_line_follows_the_plane_of_action(file):
    turned = FILE.replace("[layout]", '[[meshes]]\npinion = "pinion"\nwheel = "wheel"\nangle = 70.0\n[layout]')
    studies = [LayoutStudy.of(load_design(file(text))) for text in (FILE, turned)]
    slopes = [
        float(layout_flank_lines(one.supports["housing"], one.tolerances, **one.options).line.slope) for one in studies
    ]
    assert abs(slopes[0] - slopes[1]) > 0.1


def test_a_second_stage_loads_the_shaft(file):
    """A further gear with keys of its own, on the wheel's shaft, and its mesh."""
    third = '{ name = "third", position = 90.0, gear = { teeth = 20, module = 4.0, face_width = 25.0 } }'
    fourth = """
[[shafts]]
name = "last"
sections = [{ length = 190.0, diameter = 55.0 }]
bearings = [{ name = "E", position = 20.0, radial = 400.0 }, { name = "F", position = 130.0, radial = 400.0 }]
gears = [{ name = "fourth", position = 90.0, gear = { teeth = 60, module = 4.0, face_width = 25.0 } }]
couplings = [{ position = 190.0 }]
[[meshes]]
pinion = "pinion"
wheel = "wheel"
[[meshes]]
pinion = "third"
wheel = "fourth"
angle = 45.0
misalignment = { direct = 5.0 }
[layout]"""
    text = FILE.replace("body_diameter = 70.0 }", f"body_diameter = 70.0 }}, {third}")
    text = text.replace("couplings = [{ position = 190.0 }]\n", "", 1).replace("[layout]", fourth, 1)
    text = text.replace('[housing]\nfile = "housing.csv"\n', "")
    study = LayoutStudy.of(load_design(file(text)))
    (found,) = study.supports.values()
    np.testing.assert_allclose(found.gearbox.pinion_torques(), [150.0, 150.0 * 48 / 19])
    assert float(found.gearbox.meshes[1].misalignment.direct) == 5.0


def test_step_2_may_add_end_reliefs(file):
    """Their width is that of the standard, a tenth of the face, or given; the amounts are those of crowning here."""
    texts = (FILE, replaced("stations = 21", 'stations = 21\nfurther = "end_relief"'))
    texts = (*texts, texts[1] + 'end_relief_width = 2.5\nfurther_amount = "least"\n')
    crowned, relieved, least = (LayoutStudy.of(load_design(file(text))).options for text in texts)
    assert [one["end_relief"] for one in (crowned, relieved, least)] == [None, pytest.approx(1.8), 2.5]
    np.testing.assert_allclose(relieved["further"], crowned["further"])
    assert least["further"] is None


def test_the_bearing_span_of_a_drawing_matters(file):
    """Of half the span twice the deviation is left over the face; by class no span is asked for."""
    texts = {span: replaced("span = 80.0", f"span = {span}") for span in ("40.0", "80.0")}
    spans = {span: LayoutStudy.of(load_design(file(text))).tolerances for span, text in texts.items()}
    for kind in ("maximum", "statistical"):
        near, far = (spans[span][kind].misalignment for span in ("40.0", "80.0"))
        assert float(far) > 1.0 and float(near) == pytest.approx(2 * float(far))
    given = {}
    for text in ('"class"', "{ direct = 5.0 }"):
        study = LayoutStudy.of(load_design(file(replaced(AXES, text))))
        given[text] = float(study.tolerances["maximum"].misalignment)
    assert given["{ direct = 5.0 }"] == pytest.approx(5.0) and given['"class"'] > 5.0
    parallel = LayoutStudy.of(load_design(file(replaced(f"misalignment = {AXES}\n", ""))))
    assert float(parallel.tolerances["maximum"].misalignment) == 0.0


@pytest.mark.slow
def test_an_analysis_stands_on_the_shafts_of_the_file(file, monkeypatch):
    """What they do holds at every torque: the mesh of the file is that of its gearbox, at any."""
    design = load_design(file(FILE))
    mesh = design.mesh()
    assert design.left_out == "" and mesh.support_torque is None
    own = LayoutStudy.of(design).supports["housing"]
    for torque in (75.0, 150.0):
        held, y = at_stations(own, torque, stations=6), mesh.face_coordinate
        np.testing.assert_allclose(mesh.support.influence(y), held.influence(y), rtol=1e-9)
        np.testing.assert_allclose(mesh.support.gap(y), held.gap(y), atol=1e-12)
    with monkeypatch.context() as patch:  # without preparing one more
        patch.setattr("jaxgear.io.design_file.prepare", lambda pair, **options: SimpleNamespace(**options))
        assert design.mesh(rigid=True).support is None
    # shafts bend where no number of slices is said either
    assert load_design(file(replaced("slices = 6\n", ""))).resolution().slices == 11


PLASTIC = "[materials.pom]\nelastic_modulus = 3000.0\npoisson_ratio = 0.35\n"
SOFT = replaced("bore_diameter = 24.0", 'bore_diameter = 24.0\nmaterial = "pom"')


def test_a_shaft_is_of_its_own_material(file):
    """Steel without a word; a gear that is cut into it is of the same, within what tables of steel differ by."""
    of = [PLASTIC + SOFT.replace('name = "in"', 'name = "in"\nmaterial = "pom"'), FILE]
    of.append(replaced("bore_diameter = 24.0", "bore_diameter = 24.0\nmaterial = { elastic_modulus = 210000.0 }"))
    boxes = [load_design(file(text)).support.gearbox for text in of]
    assert [float(box.shafts[0].material.elastic_modulus) for box in boxes] == [3000.0, 206000.0, 206000.0]
    assert float(boxes[0].shafts[0].material.poisson_ratio) == 0.35
    assert float(boxes[0].shafts[1].material.elastic_modulus) == 206000.0


PLAY = "radial = 250.0, clearance = 10.0"
RIGID = [
    (replaced("slices = 6", "slices = 1"), "resolution.slices = 1"),
    (replaced("slices = 6", "slices = 6\ncoupled_slices = false"), "coupled_slices = false"),
    (replaced("radial = 250.0", PLAY), "bearings with clearance"),
    (FILE + "[dynamics]\nspeeds = [100.0, 900.0]\n", "[dynamics]"),
]


@pytest.mark.parametrize("text, why", RIGID)
def test_what_an_analysis_leaves_out_has_a_reason(file, text, why):
    line = load_design(file(text)).left_out
    assert line.startswith("shafts, bearings and housing are not part of this analysis, the gears stand rigid")
    assert why in line and line.endswith("jaxgear layout takes them")


AXIS = '[[meshes]]\npinion = "pinion"\nwheel = "wheel"\nmisalignment = { direct = 5.0 }\n[layout]'
BARE = replaced(FACE, f"{LINE}\nslices = 1").replace("[layout]", AXIS)


def test_axes_that_an_analysis_leaves_out_are_named(file):
    line = load_design(file(BARE)).left_out
    assert line.startswith("shafts, bearings, housing and the misalignment of [[meshes]] are not part")


@pytest.mark.slow
def test_an_analysis_says_what_it_leaves_out(file, tmp_path):
    """On stderr, in the summary and in the report; nothing of it where the file has no shafts."""
    folder = tmp_path / "out"
    done = call("analyze", str(file(BARE)), "--output", str(folder), "--report", "--no-figures")
    assert done.code == 0
    line = load_design(file(BARE)).left_out
    assert line in done.err and json.loads((folder / "summary.json").read_text())["left_out"] == line
    report = (folder / "report.html").read_text("utf-8")
    assert line[1:] in report and "Shafts, bearings and housing are those of the design file" not in report


def test_shafts_carry_the_gears_without_a_layout(file):
    """Turning as with the default direction of [layout]."""
    alone, with_layout = (load_design(file(content)).support for content in (FILE[: FILE.index("[layout]")], FILE))
    assert eqx.tree_equal(alone, with_layout)
    clockwise = load_design(file(replaced("[layout]", '[layout]\ndirection = "clockwise"'))).support
    assert clockwise.gearbox.direction != alone.gearbox.direction


WRONG = [
    (FILE[: FILE.index("[housing]")] + "[layout]\nquality_class = 6\n", "layout: has no effect without [[shafts]]"),
    (replaced("quality_class = 6\n", ""), "layout.quality_class: missing, this key is required"),
    (replaced("quality_class = 6", "quality_class = 14"), "layout.quality_class: 14 must be at least 1 and at most 11"),
    (
        replaced("stations = 21", "negative_crownin = true"),
        'layout.negative_crownin: unknown key, did you mean "negative_crowning"?',
    ),
    (FILE + "end_relief_width = 2.0\n", 'layout.end_relief_width: has no effect with further = "crowning"'),
    (FILE + END_RELIEF + "end_relief_width = 9.5\n", "layout.end_relief_width: 9.5 mm must be at most 9 mm, half the"),
    (
        FILE + END_RELIEF + "end_relief_width = 0.4\n",
        "layout.stations: the outermost is 0.857 mm wide, must be less than 0.8 mm, twice the width of the end relief",
    ),
    (
        FILE + END_RELIEF + "end_relief_width = 1.0\n" + PROFILE,
        "resolution.slices: the outermost is 3 mm wide, must be less than 2 mm",
    ),
    (replaced(f"misalignment = {AXES}", "bearing_span = 80.0"), "layout.bearing_span: has no effect without skew or"),
    (replaced("span = 80.0", "span = 17.0"), "misalignment.bearing_span: 17 mm must be at least 18 mm, the face width"),
    (replaced("skew = 15.0", "skew = -1.0"), "layout.misalignment.skew: -1 um must be at least 0 um"),
    (replaced(", bearing_span = 80.0", ""), "layout.misalignment.skew: 15 um needs bearing_span"),
    (
        replaced("skew = 15.0, inclination = 30.0", "direct = 3.0"),
        "layout.misalignment.bearing_span: has no effect without skew or inclination",
    ),
    (replaced(AXES, "{}"), "layout.misalignment: must have skew or inclination over a bearing_span, or direct"),
    (replaced(AXES, '"clas"'), 'layout.misalignment: "clas" is not known, did you mean "class"?'),
    (
        replaced("position = 140.0, radial", "position = 240.0, radial"),
        'shafts[0].bearings[1].position: bearing "B" at 240 mm must lie within',
    ),
    (
        replaced("radial = 250.0 },\n]", "radial = 0.0 },\n]"),
        'shafts[0].bearings: bearings "A", "B" do not hold it',
    ),
    (
        replaced('name = "pinion", position = 20.0, integral = true', 'name = "19", position = 20.0'),
        "shafts[0].gears[0].gear: missing",
    ),
    (
        replaced("integral = true", "integral = true, body_diameter = 40.0"),
        "body_diameter: has no effect on an integral",
    ),
    (
        replaced("diameter = 34.0 }", "diameter = -34.0 }"),
        "shafts[0].sections[0].diameter: -34 mm must be greater than 0",
    ),
    (
        replaced("torque = 150.0 }]", "torque = 100.0 }]"),
        "load.torque: 150 N m must be 100 N m, that of the couplings",
    ),
    (
        replaced("[{ position = 190.0 }]", "[{ position = 190.0, torque = 3.0 }]"),
        "couplings have no torque, must be 1",
    ),
    (
        replaced('name = "D"', 'name = "A"'),
        'shafts[1].bearings[1].name: "A" is given twice, first as shafts[0].bearings[0].name',
    ),
    (
        replaced("radial = 250.0, axial = 80.0", "stiffness = [[1.0, 0.0], [0.0]]"),
        "shafts[0].bearings[0].stiffness: row 1 has 1 numbers, must have 2 as the first",
    ),
    (PLASTIC + SOFT, "shafts[0].gears[0].integral: a gear that is cut into its shaft is of its material, but these"),
    (replaced('name = "in"', 'name = "in"\nmaterial = "stel"'), 'shafts[0].material: "stel" is not known'),
    (replaced("radial = 250.0, axial", "radial = -250.0, axial"), "bearings[0].radial: -250 N/um must be at least 0"),
    (replaced("position = 60.0, radial", "position = 140.0, radial"), 'bearings "A", "B" do not hold it'),
    (
        replaced("couplings = [{ position = 160.0,", "couplings = [{ position = 500.0,"),
        "shafts[0].couplings[0].position: coupling 0 at 500 mm must lie within",
    ),
    (
        replaced(
            '[{ name = "wheel", position',
            '[{ name = "pinion", position = 9.0, body_diameter = 900.0 }, { name = "wheel", position',
        ),
        'shafts[1].gears[0].name: "pinion" is given twice, first as shafts[0].gears[0].name',
    ),
    (replaced("position = 20.0, integral", "position = 5.0, integral"), 'gear "pinion" at -4 to 14 mm must lie within'),
    (replaced("torque = 150.0 }]", "torque = -150.0 }]"), "the pinion of a mesh drives its wheel"),
    (FILE + LIFE.replace("[1000.0, 50.0]", "[1000.0, -50.0]"), "layout.hours[1]: -50 h must be at least 0 h"),
    (FILE + LIFE.replace("[900.0, 600.0]", "[900.0, 0.0]"), "layout.speeds[1]: 0 rpm must be greater than 0 rpm"),
    (FILE + LIFE.partition("[strength]")[0], "strength.pitting_cycles: missing, layout.torques needs it"),
    (FILE + "torques = [10.0]\n", "layout.hours: missing, layout.torques needs it"),
    (FILE + "hours = [10.0]\n", "layout.hours: has no effect without layout.torques"),
    (FILE + LIFE.replace("[900.0, 600.0]", "[900.0]"), "layout.speeds: 1 numbers must be as many as the 2 torques"),
    (FILE + LIFE.replace("exponent = 8.7", "exponent = 0.5"), "strength.bending_exponent: 0.5 must be at least 1"),
    (
        FILE + "[layout.profile]\npinion_amounts = [-1.0]\n",
        "layout.profile.pinion_amounts[0]: -1 um must be at least 0 um",
    ),
    (FILE + "[layout.profile]\npinion_amounts = [1.0, 1.0]\n", "layout.profile.pinion_amounts: must all be different"),
    (FILE + PROFILE + 'type = "profile_crowning"\nlength = 3.0\n', "layout.profile.length: has no effect with type"),
    (
        replaced("slices = 6", "slices = 1") + PROFILE,
        "resolution.slices: must be at least 2, 1 cannot show the flank lines",
    ),
    (FILE + "[[wheel.modification]]\ntype = 'lead_slope'\namount = 3.0\n", "wheel.modification: layout finds the"),
    (
        replaced("[layout]", '[[meshes]]\npinion = "wheel"\nwheel = "pinion"\n[layout]'),
        'meshes: missing, one must have pinion = "pinion"',
    ),
    (replaced("[layout]", '[[meshes]]\npinion = "x"\nwheel = "wheel"\n[layout]'), "meshes: missing, one must have"),
    (FILE.replace("housing.csv", "none.csv"), "housing.file: none.csv: No such file"),
]
WRONG_HOUSINGS = [
    (HOUSING.replace("D.x", "G.x"), 'housing.file: seat of the housing "G" is not known'),
    (HOUSING.replace("D.x", "D.w"), "node 'D.w' must be SEAT.DIRECTION"),
    (HOUSING.replace("A.x, 1e-3, 0,", "A.x, 1e-3, 5e-4,"), "must be symmetric"),
    (HOUSING.replace("8e-3", "-8e-3"), "compliance of D.x is -0.008, must be at least 0"),
    (HOUSING.replace("8e-3", "x"), "(D.x, D.x) = 'x' must be a number"),
    (HOUSING.replace("um/N", "in/lb"), '"compliance in/lb" is not a kind and unit of a housing'),
    ("\n".join(HOUSING.splitlines()[:-1]), "rows must have the names of the columns"),
]


@pytest.mark.parametrize(
    "text, housing, message", [(t, HOUSING, m) for t, m in WRONG] + [(FILE, h, m) for h, m in WRONG_HOUSINGS]
)
def test_what_is_wrong_is_one_line(file, tmp_path, text, housing, message):
    done = call("layout", str(file(text, housing)), "--output", str(tmp_path / "out"))
    lines = done.err.strip().splitlines()
    assert done.code == 2 and done.out == ""
    assert message in lines[-1] and lines[-1].startswith("jaxgear: error: ")
    assert not (tmp_path / "out").exists()


def test_torques_without_a_load_over_the_face_are_told():
    """Of shafts afloat in their clearances at some torques only."""
    nothing: dict = {"layouts": {}, "contacts": {}, "profiles": {}}
    over = {"unmodified": np.array([1.2, np.nan, 1.1]), "step 1": np.array([1.0, np.nan, 1.0])}
    study = SimpleNamespace(**nothing, over_torque=over, torques=np.array([50.0, 75.0, 100.0]))
    assert list(LayoutResult.failures(study)) == ["LOAD OVER THE FACE NOT CONVERGED at 75 N m"]


def test_a_layout_needs_its_table(file, tmp_path):
    text = FILE[: FILE.index("[housing]")]
    done = call("layout", str(file(text)), "--output", str(tmp_path / "out"))
    assert done.code == 2 and "layout: missing; it says for which tolerances" in done.err
