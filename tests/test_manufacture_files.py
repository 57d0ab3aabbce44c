"""Files of manufacture: dressing points and drawing of the wheel, charts of the measuring machine, measured flanks."""

import csv
import sys
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import TWO_PAIRS, kahraman_gear

import jaxgear as jg
from jaxgear import io, manufacture, tolerance
from jaxgear.contact.kinematics import kinematics

_kinematics = eqx.filter_jit(kinematics)


@pytest.fixture(scope="module")
def moving():
    """The 50/50 pair of contact ratio 1.37."""
    pair = jg.GearPair(kahraman_gear(), kahraman_gear())
    return _kinematics(pair, jnp.asarray(0.0), TWO_PAIRS, "strain")


@pytest.fixture(scope="module")
def side(moving):
    """Its pinion."""
    return moving.sides[0]


@pytest.fixture(scope="module")
def relief():
    return jg.TipRelief(6.0, 3.0, jg.Linear())


@pytest.fixture(scope="module")
def profile(side, relief):
    return manufacture.wheel_profile(side, relief, points=21)


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_points_of_the_wheel(side, profile, tmp_path):
    """Both flanks to a nanometre; the radius of the wheel falls by y."""
    path = manufacture.write_wheel_points(tmp_path / "wheel.csv", profile, wheel=manufacture.GrindingWheel(150.0, 40.0))
    rows = rows_of(path)
    assert [row["flank"] for row in rows] == ["left"] * 21 + ["right"] * 21
    table = np.array([[float(value) for name, value in row.items() if name != "flank"] for row in rows])
    x, y, size, roll, removed, radius = table.T
    np.testing.assert_array_equal(x[:21], -x[21:])
    np.testing.assert_allclose(x[21:], profile.x, atol=5.1e-7)
    np.testing.assert_allclose(np.hypot(x, y + float(side.gear.root_circle_radius)), size / 2, atol=1e-6)
    np.testing.assert_allclose(radius + y, 150.0, atol=1e-9)
    assert removed[20] == 6.0 and roll[20] == pytest.approx(float(side.tip_roll_length) + 0.006, abs=1e-6)
    assert size[20] == pytest.approx(154.5709, abs=1e-6), "up to the tip circle"


def test_flanks_that_differ(side, profile, tmp_path):
    other = manufacture.wheel_profile(side, jg.NoModification(), points=21)
    rows = rows_of(manufacture.write_wheel_points(tmp_path / "wheel.csv", profile, other))
    assert "wheel_radius_mm" not in rows[0]
    assert float(rows[20]["x_mm"]) < -float(rows[41]["x_mm"]), "the relieved side is wider"


def test_a_folder_that_is_not_there_is_named(profile, tmp_path):
    with pytest.raises(ValueError, match="missing/wheel.csv: cannot be written: No such file"):
        manufacture.write_wheel_points(tmp_path / "missing" / "wheel.csv", profile)


def test_drawing_of_the_wheel_holds_the_points(profile, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    path = manufacture.write_wheel_drawing(tmp_path / "wheel.dxf", profile)
    drawing = ezdxf.readfile(path)
    assert drawing.units == 4, "millimetres"
    left, right = drawing.modelspace().query("LWPOLYLINE")
    np.testing.assert_allclose(right.get_points("xy"), np.stack([profile.x, profile.y], axis=1), rtol=1e-12)
    np.testing.assert_allclose(left.get_points("xy"), np.stack([-profile.x, profile.y], axis=1), rtol=1e-12)
    assert not drawing.audit().has_errors


def test_a_drawing_without_its_package_says_what_to_install(profile, tmp_path, monkeypatch):
    for module in ("ezdxf", "ezdxf.filemanagement"):  # which a test before may have imported
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ModuleNotFoundError, match=r"write_wheel_drawing: .* ezdxf: pip install jaxgear\[cad\]"):
        manufacture.write_wheel_drawing(tmp_path / "wheel.dxf", profile)
    assert not list(tmp_path.iterdir())


MEASURED = """trace,face_coordinate_mm,roll_length_mm,measured_um
profile,-8.0,20.0,0.25
profile,-8.0,26.5,-0.125
profile,-8.0,31.7,-6.333333333
profile,0.0,20.0,0.75
profile,0.0,26.5,0.3
profile,0.0,31.7,-5.123456789
profile,9.5,20.0,-1.5
profile,9.5,26.5,-2.0
profile,9.5,31.7,-7.0
"""


def written(tmp_path, text, name="measured.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_measured_flank_comes_back_as_it_was(side, tmp_path):
    """Measured CSV, table, chart, CSV, table: to 1e-9 um, over the whole flank and for a profile alone."""
    profile_alone = "\n".join(line for line in MEASURED.splitlines() if "-8.0" not in line and "9.5" not in line)
    for text in (MEASURED, profile_alone):
        first = io.read_flank(written(tmp_path, text))
        traces = tolerance.table_traces(side, first)
        path = io.write_traces(tmp_path / "chart.csv", traces, traces)
        given = [float(line.split(",")[-1]) for line in text.splitlines()[1:]]
        assert [float(row["measured_um"]) for row in rows_of(path)] == pytest.approx(given, abs=1e-9, rel=0)
        second = io.read_flank(path)
        assert type(second) is type(first)
        np.testing.assert_allclose(second.amount, first.amount, atol=1e-9, rtol=0)
        again = io.write_traces(tmp_path / "again.csv", tolerance.table_traces(side, second), traces)
        assert again.read_text() == path.read_text()


MACHINES = {  # the same profile as measuring machines and spreadsheets write it: separator, headings, decimal mark
    "columns of jaxgear": ("roll_length_mm,measured_um", ",", 1.0, 1.0, "."),
    "semicolons and decimal commas": ("# gear 4711;;\nRoll length [mm];Deviation [um];tooth", ";", 1.0, 1.0, ","),
    "a line of units": ("Roll angle\tDeviation\n[deg]\t[mm]", "\t", 180 / np.pi / 70.0, 1e-3, "."),
    "radians and micrometres": ("roll angle (rad);Abweichung (\u00b5m)", ";", 1 / 70.0, 1.0, "."),
    "inches": ("length_of_roll_in,profile_deviation_in", ",", 1 / 25.4, 1e-3 / 25.4, "."),
    "diameters": ("Durchmesser [mm];Deviation [nm]", ";", None, 1e3, ","),
}


@pytest.mark.parametrize("machine", MACHINES)
def test_columns_of_measuring_machines(tmp_path, machine):
    """Units are those that the file names, on a base circle of 70 mm radius."""
    head, separator, along, amount, mark = MACHINES[machine]
    roll, deviation = np.array([20.0, 26.5, 31.7]), np.array([0.0, -1.5, -7.25])
    place = 2 * np.hypot(70.0, roll) if along is None else along * roll
    tooth = separator + "1" if "tooth" in head else ""
    rows = [
        f"{at!r}{separator}{by!r}".replace(".", mark) + tooth
        for at, by in zip(place.tolist(), (amount * deviation).tolist())
    ]
    path = written(tmp_path, "\n".join([head, *rows, ""]))
    flank = io.read_flank(path, base_radius=70.0)
    np.testing.assert_allclose(flank.position, roll, rtol=1e-12)
    np.testing.assert_allclose(flank.amount, -deviation, rtol=1e-12)


def test_excess_material_is_what_is_not_removed(tmp_path):
    flank = io.read_flank(written(tmp_path, MEASURED))
    np.testing.assert_array_equal(flank.face_coordinate, [-8.0, 0.0, 9.5])
    np.testing.assert_array_equal(flank.roll_length, [20.0, 26.5, 31.7])
    assert float(flank.amount[2, 2]) == 7.0 and flank.varies_along_face


def test_flanks_csv_is_read_again(moving, side, tmp_path):
    """The flanks of a run: either gear of any design, profiles and flanks that vary over the face."""
    designs = {
        "plain": (jg.TipRelief(6.0, 3.0), jg.NoModification()),
        "crowned": (jg.TipRelief(6.0, 3.0) + jg.LeadCrowning(4.0), jg.TipRelief(2.0, 1.0)),
    }
    io.write_flanks(tmp_path / "flanks.csv", moving, designs)
    for name, flanks in designs.items():
        for gear, design in zip(("pinion", "wheel"), flanks):
            read = io.read_flank(tmp_path / "flanks.csv", gear=gear, design=name)
            for trace in tolerance.table_traces(side, read):
                wanted = tolerance.profile_trace(
                    side, design, face_coordinate=trace.face_coordinate[0], roll_length=trace.roll_length
                )
                np.testing.assert_allclose(trace.design, wanted.design, atol=6e-6)
    with pytest.raises(io.DesignFileError, match="flanks.csv: holds several: gear must be one of pinion, wheel"):
        io.read_flank(tmp_path / "flanks.csv", design="plain")
    with pytest.raises(io.DesignFileError, match='design = "plane" is not in the file, must be one of plain, crowned'):
        io.read_flank(tmp_path / "flanks.csv", gear="wheel", design="plane")


def test_a_profile_and_a_helix_make_a_flank(side, tmp_path):
    """Where both are the design's, their sum is the design, whose profile and lead do not depend on each other."""
    design = jg.TipRelief(6.0, 3.0, jg.Linear()) + jg.LeadCrowning(5.0)
    traces = [tolerance.profile_trace(side, design, points=31), tolerance.helix_trace(side, design, points=21)]
    flank = io.read_flank(io.write_traces(tmp_path / "chart.csv", traces))
    for face in (-10.0, -4.0, 0.0, 10.0):
        options = {"face_coordinate": face, "roll_length": traces[0].roll_length}
        found, wanted = (tolerance.profile_trace(side, each, **options) for each in (flank, design))
        np.testing.assert_allclose(found.design, wanted.design, atol=1e-8)


def test_measured_traces_of_other_places_are_refused(side, relief, tmp_path):
    design = tolerance.profile_trace(side, relief, points=11)
    few = tolerance.profile_trace(side, relief, points=9)
    moved = tolerance.profile_trace(side, relief, face_coordinate=2.0, points=11)
    with pytest.raises(ValueError, match=r"measured has traces of \[\(9,\)\] points, must be \[\(11,\)\]"):
        io.write_traces(tmp_path / "chart.csv", [design], [few])
    with pytest.raises(ValueError, match="write_traces: face_coordinate of measured trace 0 is not that of the design"):
        io.write_traces(tmp_path / "chart.csv", [design], [moved])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("column", ["roll_angle_deg", "diameter_mm"])
def test_other_coordinates_need_the_base_radius(side, relief, tmp_path, column):
    trace = tolerance.profile_trace(side, relief, points=11)
    rows = rows_of(io.write_traces(tmp_path / "chart.csv", [trace]))
    lines = [f"{column},design_um", *(f"{row[column]},{row['design_um']}" for row in rows)]
    path = written(tmp_path, "\n".join(lines))
    flank = io.read_flank(path, base_radius=float(side.base_radius))
    np.testing.assert_allclose(flank.position, trace.roll_length, rtol=1e-9)
    np.testing.assert_allclose(flank.amount, -np.asarray(trace.design), atol=1e-9)
    with pytest.raises(io.DesignFileError, match="has no column roll_length_mm, must have one where no base radius"):
        io.read_flank(path)
    if column == "diameter_mm":
        with pytest.raises(io.DesignFileError, match=r"diameter_mm = .* mm must be at least 180 mm \(base circle\)"):
            io.read_flank(path, base_radius=90.0)


HEAD = "roll_length_mm,face_coordinate_mm,measured_um\n"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "holds no points"),
        (HEAD, "holds no points"),
        (
            "roll_length_mm,amount\n1,2\n",
            "has no column measured_um, modification_um, wear_depth_um, design_um, must have one",
        ),
        (
            HEAD + "20,0,0.002\n21,0,0.02\n",
            "has measured_um within 0.018 um, less than flanks can be measured to",
        ),
        (HEAD + "20,0,1\n21,0,x\n", 'measured_um of point 2 is "x", must be a number'),
        (HEAD + "20,0,1\n21,0\n", 'measured_um of point 2 is "", must be a number'),
        (HEAD + "20,0,1\n21,0,nan\n", 'measured_um of point 2 is "nan", must be a number'),
        (HEAD + "20,0,1\n20,0,2\n", "has 2 points at 1 roll lengths and 1 face coordinates, must be a grid"),
        (HEAD + "20,0,1\n21,0,2\n20,5,2\n", "has 3 points at 2 roll lengths and 2 face coordinates, must be a grid"),
        (HEAD + "20,0,1\n", "has 1 place along the profile, must have at least 2"),
        ("trace," + HEAD + "helix,20,0,1\nhelix,20,1,1\n", "holds a helix alone, must hold a profile"),
        ("roll_length_mm,measured_um\n10,5,0,3\n", "point 1 has 4 fields, the headings 2: numbers must have no commas"),
        ("roll_length_mm;measured_um\n10,5;0.3\n", 'has "10,5" and "0.3", must have one decimal mark'),
        ("roll_length_mm,deviation\n10,3\n", 'deviation: names no unit, write "deviation [um]"'),
        ("roll_length_mm,deviation [deg]\n10,3\n", 'unit "deg" must be one of nm, um, mm, m, in'),
        ("roll_length_mm,deviation [um],measured_um\n10,3,4\n", "has several columns of measured_um: deviation [um], "),
        (HEAD.replace("measured_um", "measured_um,measured_um") + "20,0,1,2\n", "has several columns measured_um"),
        (HEAD + "-1,0,1\n20,0,2\n", "roll_length_mm = -1 mm must be at least 0 mm (base circle)"),
        ("face_coordinate_mm,measured_um\n0,1\n", "has no column roll_length_mm, must have one where no base radius"),
    ],
)
def test_what_is_no_flank_is_refused_in_one_line(tmp_path, text, problem):
    path = written(tmp_path, text)
    with pytest.raises(io.DesignFileError) as caught:
        io.read_flank(path)
    assert str(caught.value).startswith(f"{path}: ") and problem in str(caught.value)
    assert "\n" not in str(caught.value)


# active profile of the pinion from 19.585 to 31.718 mm, face of 20 mm
@pytest.mark.parametrize(
    ("rolls", "faces", "problem"),
    [
        ((19.6, 31.8), (-10.0, 10.0), None),
        ((21.0, 30.0), (-8.0, 8.0), None),
        ((20.0, 33.0), (0.0,), "reaches roll length 33 mm, must be at most 31.7181 mm (the tip of the gear)"),
        ((25.0, 31.7), (0.0,), "starts at roll length 25 mm, must be at most 22.0115 mm (the active profile runs from"),
        ((12.0, 25.0), (0.0,), "ends at roll length 25 mm, must be at least 29.2915 mm (the active profile runs from"),
        ((20.0, 31.7), (15.0,), "reaches face coordinate 15 mm, must be within +-10 mm (the face is 20 mm wide)"),
        ((20.0, 31.7), (-15.0, 15.0), "reaches face coordinate 15 mm, must be within +-10 mm"),
        ((20.0, 31.7), (-5.0, 5.0), None),  # middles of two slices
        (
            (20.0, 31.7),
            (-3.0, 10.0),
            "begins at face coordinate -3 mm, must be at most -6 mm (the mate meets the face from",
        ),
        (
            (20.0, 31.7),
            (-10.0, 4.0),
            "ends at face coordinate 4 mm, must be at least 6 mm (the mate meets the face from",
        ),
    ],
)
def test_a_flank_of_another_gear_or_place_is_refused(side, tmp_path, rolls, faces, problem):
    """By the reader that is told the side, and by a design file with the gear that the file stands at."""
    lines = [f"{roll},{face},0.5" for face in faces for roll in rolls]
    path = written(tmp_path, HEAD + "\n".join(lines))
    design = written(tmp_path, DESIGN.format(file=path.name, more=""), "design.toml")
    assert io.read_flank(path) is not None, "no gear, no question"
    if problem is None:
        assert type(io.read_flank(path, side=side)) is type(io.load_design(design).design({})[0])
        return
    for call, start in (
        (lambda: io.read_flank(path, side=side), f"{path}: "),
        (lambda: io.load_design(design), f"{design}: pinion.modification[0].file: measured.csv: "),
    ):
        with pytest.raises(io.DesignFileError) as caught:
            call()
        assert str(caught.value).startswith(start + problem) and "\n" not in str(caught.value)


def test_flanks_are_told_where_the_mate_meets_the_face(tmp_path):
    """Gears of other widths: a table over the common face is a flank, one over the middle of the wider gear is none."""
    pair = jg.GearPair(kahraman_gear(), replace(kahraman_gear(), face_width=40.0), axial_offset=9.0)
    wheel = _kinematics(pair, jnp.asarray(0.0), TWO_PAIRS, "strain").sides[1]
    start, tip = float(wheel.start_roll_length), float(wheel.gear.tip_roll_length)
    for faces, fine in (((-19.0, 1.0), True), ((-5.0, 15.0), False)):
        path = written(tmp_path, HEAD + "\n".join(f"{roll},{face},0.5" for face in faces for roll in (start, tip)))
        if fine:
            io.read_flank(path, side=wheel)
            continue
        with pytest.raises(io.DesignFileError, match="begins at face coordinate -5 mm, must be at most -15 mm"):
            io.read_flank(path, side=wheel)


def test_a_design_file_takes_the_flank_of_the_gear_that_it_stands_at(tmp_path):
    """Of a file with both; that of the other gear only when it is named."""
    row = "{gear},0,20,{0}\n{gear},0,31.7,{1}\n"
    both = "gear,face_coordinate_mm,roll_length_mm,modification_um\n"
    both += row.format(1, 2, gear="pinion") + row.format(3, 4, gear="wheel")
    written(tmp_path, both)

    def amounts(more):
        path = written(tmp_path, DESIGN.format(file="measured.csv", more=more), "design.toml")
        return io.load_design(path).design({})[0].amount.tolist()

    assert amounts("") == amounts('gear = "pinion"') == [1.0, 2.0] and amounts('gear = "wheel"') == [3.0, 4.0]
    written(tmp_path, "\n".join(line for line in both.splitlines() if "pinion" not in line))
    with pytest.raises(
        io.DesignFileError, match='file: measured.csv: gear = "pinion" is not in the file, must be one of wh'
    ):
        amounts("")
    assert amounts('gear = "wheel"') == [3.0, 4.0]


def test_a_side_brings_its_base_radius(side, tmp_path):
    trace = tolerance.profile_trace(side, jg.TipRelief(6.0, 3.0), points=5)
    lines = [f"{angle},{design}" for angle, design in zip(trace.roll_angle, trace.design)]
    path = written(tmp_path, "\n".join(["roll_angle_deg,design_um", *lines]))
    np.testing.assert_allclose(io.read_flank(path, side=side).position, trace.roll_length, rtol=1e-9)
    with pytest.raises(ValueError, match="base_radius = 70 mm has no effect beside side"):
        io.read_flank(path, side=side, base_radius=70.0)


def test_a_file_that_is_not_there_or_no_text(tmp_path):
    with pytest.raises(io.DesignFileError, match="none.csv: No such file"):
        io.read_flank(tmp_path / "none.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(io.DesignFileError, match="binary.csv: is not text in UTF-8"):
        io.read_flank(tmp_path / "binary.csv")


DESIGN = """
[pinion]
teeth = 50
module = 3.0
face_width = 20.0
tip_diameter = 154.5709
[[pinion.modification]]
type = "file"
file = "{file}"
{more}
[wheel]
teeth = 50
module = 3.0
face_width = 20.0
tip_diameter = 154.5709
[load]
torque = 200.0
"""


def test_a_design_file_takes_a_measured_flank(tmp_path):
    """Beside it; a flank that varies over the face brings slices along."""
    written(tmp_path, MEASURED)
    design = io.load_design(written(tmp_path, DESIGN.format(file="measured.csv", more=""), "design.toml"))
    pinion, wheel = design.design({})
    assert isinstance(pinion, jg.TabulatedFlank) and isinstance(wheel, jg.NoModification)
    np.testing.assert_array_equal(pinion.amount, io.read_flank(tmp_path / "measured.csv").amount)
    assert design.resolution().slices == 11
    more = 'method = "natural_cubic"'
    design = io.load_design(written(tmp_path, DESIGN.format(file="measured.csv", more=more), "design.toml"))
    assert design.design({})[0].method == "natural_cubic"


def test_a_design_file_takes_the_base_radius_of_its_gear(tmp_path):
    """For places by roll angles or diameters, unless variables decide it."""
    base = 75.0 * np.cos(np.deg2rad(20.0))
    rows = [f"{2 * np.hypot(base, roll)};{-amount}" for roll, amount in ((19.6, 0.0), (26.5, 1.5), (31.7, 7.0))]
    written(tmp_path, "\n".join(["diameter [mm];deviation [um]", *rows]))
    text = DESIGN.format(file="measured.csv", more="")
    flank = io.load_design(written(tmp_path, text, "design.toml")).design({})[0]
    np.testing.assert_allclose(flank.position, [19.6, 26.5, 31.7], rtol=1e-9)
    text = text.replace("module = 3.0", 'module = "m"', 1) + "[variables]\nm = { low = 2.9, high = 3.1 }\n"
    with pytest.raises(io.DesignFileError, match="has no column roll_length_mm, must have one where no base radius"):
        io.load_design(written(tmp_path, text, "design.toml"))


@pytest.mark.parametrize(
    ("file", "more", "problem"),
    [
        ("none.csv", "", "pinion.modification[0].file: none.csv: No such file or directory"),
        (
            "measured.csv",
            'gear = "wheel"',
            'file: measured.csv: gear = "wheel" is not in the file, there is no column gear',
        ),
        ("measured.csv", 'gear = "ring"', 'pinion.modification[0].gear: "ring" is not known, must be one of'),
        ("measured.csv", "amount = 3.0", "pinion.modification[0].amount: unknown key"),
        (
            "measured.csv",
            'method = "cubic"',
            'pinion.modification[0].method: "cubic" is not known, did you mean "natural_cubic"',
        ),
    ],
)
def test_a_design_file_names_what_is_wrong_with_the_flank(tmp_path, file, more, problem):
    written(tmp_path, MEASURED)
    path = written(tmp_path, DESIGN.format(file=file, more=more), "design.toml")
    with pytest.raises(io.DesignFileError) as caught:
        io.load_design(path)
    assert str(caught.value).startswith(f"{path}: ") and problem in str(caught.value)


def test_a_design_file_holds_a_search_to_what_the_wheel_grinds(tmp_path):
    """By the name of the quantity, in either spelling."""
    variables = "\n[variables]\nh = { low = 1.0, high = 9.0 }\n"
    relief = '[[pinion.modification]]\ntype = "tip_relief"\namount = "h"\nlength = 3.0\n[wheel]'
    written(tmp_path, MEASURED)

    def request(name):
        limits = f'[[optimize.constraint]]\nof = "{name}"\nhigh = 1.0\n'
        text = DESIGN.replace("[wheel]", relief).format(file="measured.csv", more="") + variables + limits
        return io.Search.of(io.load_design(written(tmp_path, text, "design.toml")))

    assert request("pinion_quadratic_deviation").method == request("wheel_cubic_deviation_um").method == "slp"
    with pytest.raises(io.DesignFileError, match='"pinion_quadratic" is not known, did you mean "pinion_quadratic_dev'):
        request("pinion_quadratic")
