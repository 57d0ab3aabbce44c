"""The command `jaxgear layout` and its tables: what it writes and says, and one line for what is wrong."""

import json

import numpy as np
import pytest
from report_page import check_report
from test_cli import call

from jaxgear.io import layout_request, load_design
from jaxgear.io.folder import RESULT_FILES
from jaxgear.layout import layout_flank_lines

pytestmark = pytest.mark.usefixtures("no_cache")

FILE = """
[pinion]
teeth = 19
module = 3.0
face_width = 18.0
bore_diameter = 24.0
[wheel]
teeth = 48
module = 3.0
face_width = 18.0
bore_diameter = 70.0
[load]
torque = 150.0
[resolution]
positions = 8
slices = 4
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
bearing_span = 80.0
stations = 21
"""
PROFILE = """
[layout.profile]
pinion_amounts = [10.0, 20.0]
"""
LIFE = """
torques = [60.0, 150.0]
hours = [1000.0, 50.0]
speeds = [900.0, 600.0]
[layout.pitting]
endurance = 1500.0
exponent = 13.2
cycles = 5e7
[layout.bending]
endurance = 900.0
exponent = 8.7
cycles = 3e6
"""
HOUSING = """compliance um/N, A.x, B.x, C.x, D.x
A.x, 1e-3, 0, 0, 0
B.x, 0, 1e-3, 0, 0
C.x, 0, 0, 2e-3, 0
D.x, 0, 0, 0, 8e-3
"""


@pytest.fixture
def file(file, tmp_path):
    def written(text, housing=HOUSING):
        (tmp_path / "housing.csv").write_text(housing)
        return file(text)

    return written


def test_the_command_writes_what_it_says(file, tmp_path):
    """Flank lines for a duty cycle, with and without housing."""
    folder = tmp_path / "out"
    path = file(FILE.replace("bore_diameter = 70.0", "bore_diameter = 44.0") + LIFE)  # less than the shaft, a doubt
    done = call("layout", str(path), "--output", str(folder), "--report")
    assert done.code == 0, done.err
    doubts = [line for line in done.out.splitlines() if line.startswith("please check")]
    assert len(doubts) == 1 and doubts[0].startswith(
        'please check: gear "wheel", shaft diameter over bore 1.023 is more'
    )
    assert "please check" in (folder / "report.html").read_text()
    names = {entry.name for entry in folder.iterdir()}
    assert names == {"summary.json", "report.html", "tolerance_cases.png", "face_load_factors.png"} <= RESULT_FILES
    check_report(folder, path, "layout", path, "--output", folder, "--report")
    found = json.loads((folder / "summary.json").read_text())
    housed, rigid = found["layouts"]["housing"], found["layouts"]["rigid seats"]
    assert housed["face_load_factor"]["unmodified"] > 1.3 and housed["face_load_factor"]["step_1"] < 1.1
    assert housed["step_1"]["slope_um"] != pytest.approx(rigid["step_1"]["slope_um"], abs=0.01)
    assert housed["further_crowning_um"] == pytest.approx(rigid["further_crowning_um"])
    for case in ("statistical", "maximum"):
        *_, last = housed["step_1_cases"][case]["edge_contact"]
        assert last and not any(housed["step_2_cases"][case]["edge_contact"])
    assert f"{housed['step_1']['slope_um']:.2f}" in done.out and f"{rigid['step_1']['slope_um']:.2f}" in done.out
    seats = {name: np.abs(each["seat_um"]).max() for name, each in found["bearings"]["housing"].items()}
    assert max(seats, key=seats.get) in ("A", "D")
    assert not any(np.any(each["seat_um"]) for each in found["bearings"]["rigid seats"].values())
    before, level, _ = housed["relative_life"]
    assert housed["torque_Nm"] == 150.0 and before < 0.9 and level == 1.0
    assert "life relative to the even load" in done.out and "life after step 1 [h]" in done.out
    assert found["profiles"] == {}
    for one in (housed, rigid):
        assert [(each["name"], each["where"]) for each in one["doubts"]] == [
            ("shaft diameter over bore", 'gear "wheel"')
        ]


@pytest.mark.slow
def test_profiles_follow_the_flank_lines(file, tmp_path):
    folder = tmp_path / "out"
    done = call("layout", str(file(FILE + PROFILE)), "--output", str(folder), "--quick")
    assert done.code == 0, done.err
    names = {entry.name for entry in folder.iterdir()}
    figures = {"tolerance_cases.png", "face_load_factors.png", "radar.png"}
    assert names == {"summary.json", "flanks.csv", "profiles.csv", *figures} and names <= RESULT_FILES
    found = json.loads((folder / "summary.json").read_text())
    assert found["quick"] and found["layouts"]["housing"]["face_load_factor"]["step_1"] < 1.01
    profile, other = (found["profiles"][name] for name in ("housing", "rigid seats"))
    assert profile["best"]["ppte_um"] == pytest.approx(other["best"]["ppte_um"], rel=0.05)  # both are level
    assert profile["variants"] == 5 and profile["torque_Nm"] == pytest.approx(135.0)
    assert profile["best"]["ppte_um"] < profile["unmodified"]["ppte_um"]
    kinds = [one["type"] for one in found["designs"]["layout"]["wheel_modification"]]
    assert kinds == ["lead_slope", "lead_crowning", "tip_relief"]


def test_the_file_is_the_script(file):
    """What the command finds is what the library finds for the same gearbox; a mesh angle turns the plane of action."""
    design = load_design(file(FILE))
    request = layout_request(design)
    assert layout_request(design, quick=True).options["stations"] == 21
    assert list(request.supports) == ["housing", "rigid seats"]
    assert request.supports["housing"].gearbox.housing.nodes == ("A.x", "B.x", "C.x", "D.x")
    assert request.supports["rigid seats"].gearbox.housing is None
    turned = FILE.replace("[layout]", '[[meshes]]\npinion = "pinion"\nwheel = "wheel"\nangle = 70.0\n[layout]')
    other = layout_request(load_design(file(turned)))
    slopes = [
        float(layout_flank_lines(one.supports["housing"], one.tolerances, **one.options).line.slope)
        for one in (request, other)
    ]
    # of the soft corner in x alone, whatever lies in the line of action: cos of its angle with the plane
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
    request = layout_request(load_design(file(text)))
    (found,) = request.supports.values()
    np.testing.assert_allclose(found.gearbox.pinion_torques(), [150.0, 150.0 * 48 / 19])
    assert float(found.gearbox.meshes[1].misalignment.direct) == 5.0


def replaced(old, new):
    assert old in FILE
    return FILE.replace(old, new, 1)


WRONG = [
    (
        replaced("[layout]\nquality_class = 6\nbearing_span = 80.0\nstations = 21\n", ""),
        "shafts: has no effect without [layout]",
    ),
    (FILE[: FILE.index("[housing]")] + "[layout]\nquality_class = 6\n", "layout: has no effect without [[shafts]]"),
    (replaced("quality_class = 6\n", ""), "layout.quality_class: missing, this key is required"),
    (replaced("quality_class = 6", "quality_class = 14"), "layout.quality_class: 14 must be at least 1 and at most 11"),
    (replaced("bearing_span", "bearing_gap"), 'layout.bearing_gap: unknown key, did you mean "bearing_span"?'),
    (
        replaced("position = 140.0, radial", "position = 240.0, radial"),
        'shafts[0]: Shaft "in": bearing "B" at 240 mm must lie within',
    ),
    (replaced("radial = 250.0 },\n]", "radial = 0.0 },\n]"), 'shafts[0]: Shaft "in": bearings "A", "B" do not hold it'),
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
        "load.torque: 150 N m must be 100 N m, which the couplings bring",
    ),
    (
        replaced("[{ position = 190.0 }]", "[{ position = 190.0, torque = 3.0 }]"),
        "couplings have no torque of their own",
    ),
    (replaced('name = "D"', 'name = "A"'), 'shafts: bearing "A" is given twice'),
    (FILE + "torques = [10.0]\n", "layout.hours: missing, layout.torques needs it"),
    (FILE + "hours = [10.0]\n", "layout.hours: has no effect without layout.torques"),
    (FILE + LIFE.replace("[900.0, 600.0]", "[900.0]"), "layout.speeds: 1 numbers must be as many as the 2 torques"),
    (FILE + LIFE.replace("exponent = 8.7", "exponent = 0.5"), "layout.bending.exponent: 0.5 must be at least 1"),
    (
        FILE + "[layout.profile]\npinion_amounts = [-1.0]\n",
        "layout.profile.pinion_amounts[0]: -1 um must be at least 0 um",
    ),
    (FILE + "[layout.profile]\npinion_amounts = [1.0, 1.0]\n", "layout.profile.pinion_amounts: must all be different"),
    (FILE + PROFILE + 'type = "profile_crowning"\nlength = 3.0\n', "layout.profile.length: has no effect with type"),
    (
        replaced("slices = 4", "slices = 1") + PROFILE,
        "resolution.slices: must be at least 2, 1 cannot show the flank lines",
    ),
    (FILE + "[[wheel.modification]]\ntype = 'lead_slope'\namount = 3.0\n", "wheel.modification: layout finds the"),
    (
        replaced("[layout]", '[[meshes]]\npinion = "wheel"\nwheel = "pinion"\n[layout]'),
        'meshes: none is that of "pinion"',
    ),
    (replaced("[layout]", '[[meshes]]\npinion = "x"\nwheel = "wheel"\n[layout]'), "meshes: none is that of"),
    (FILE.replace("housing.csv", "none.csv"), "none.csv: no such file"),
]
WRONG_HOUSINGS = [
    (HOUSING.replace("D.x", "G.x"), 'housing.file: seat of the housing "G" is not known'),
    (HOUSING.replace("D.x", "D.w"), "node 'D.w' must be SEAT.DIRECTION"),
    (HOUSING.replace("A.x, 1e-3, 0,", "A.x, 1e-3, 5e-4,"), "must be symmetric"),
    (HOUSING.replace("8e-3", "-8e-3"), "compliance of D.x is -0.008, must be at least 0"),
    (HOUSING.replace("8e-3", "x"), "(D.x, D.x) = 'x' must be a number"),
    (HOUSING.replace("um/N", "in/lb"), '"compliance in/lb" is no kind and unit of a housing'),
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


def test_a_layout_needs_its_table(file, tmp_path):
    text = FILE[: FILE.index("[housing]")]
    done = call("layout", str(file(text)), "--output", str(tmp_path / "out"))
    assert done.code == 2 and "layout: missing, nothing says which tolerances" in done.err
