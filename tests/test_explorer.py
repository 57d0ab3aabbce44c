"""Numbers that move: what a slider shows is what `solve` gives, and its bars are derivatives."""

from pathlib import Path

import numpy as np
import pytest
from commands import FIXED, FREE

import jaxgear as jg
from jaxgear.explorer import Explorer, Opened
from jaxgear.io import DesignFileError, load_design

FLANKS = (
    "pinion_tip_relief_amount",
    "pinion_tip_relief_length",
    "wheel_tip_relief_amount",
    "pinion_profile_slope_amount",
)
MOVED = dict(zip(FLANKS, (5.0, 4.0, 8.0, 1.5)), torque=45.0)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    def write(text, name="pair.toml"):
        path = tmp_path_factory.mktemp("design") / name
        path.write_text(text)
        return path

    return write


@pytest.fixture(scope="module")
def explorer(written):
    made = Explorer(written(FIXED.replace("torque = 50.0", "torque = 50.0  # a remark")))
    made.prepare()
    return made


def number(explorer, answer, name):
    return answer["numbers"][[quantity.name for quantity in explorer.wanted].index(name)]


def test_a_movement_is_a_contact_analysis(explorer):
    values = explorer.opened.check(MOVED)
    answer = explorer.move(values)
    path = explorer.folder / "moved.toml"
    path.write_text(explorer.opened.text(values))
    design = load_design(path)
    assert "# a remark" in path.read_text() and design.torque == 45.0
    mesh, flanks = design.mesh(), design.design({})
    cycle = jg.solve(mesh, 45.0, pinion=flanks[0], wheel=flanks[1])
    assert number(explorer, answer, "ppte") == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)), abs=1e-9)
    assert number(explorer, answer, "max_flank_pressure") == pytest.approx(float(np.max(cycle.contact_pressure)))
    curve = answer["charts"]["transmission_error"]
    np.testing.assert_allclose(curve["y"][:16], cycle.transmission_error, atol=1e-6)
    over = jg.solve(mesh, explorer.start()["torques"][0], pinion=flanks[0], wheel=flanks[1])
    assert answer["over_torque"][0] == pytest.approx(float(jg.peak_to_peak(over.transmission_error)), abs=1e-6)
    relief = answer["handles"]["pinion"]
    assert (relief["tip"] - relief["start"]) / relief["per_length"] == pytest.approx(-MOVED[FLANKS[1]])


def test_bars_are_derivatives(explorer):
    values = explorer.opened.check(MOVED)
    gradient = np.asarray(explorer.move(values)["gradient"], float)
    for index, name in enumerate(explorer.opened.sliders):
        step = 1e-4 * max(abs(values[name]), 1.0)
        ends = [explorer.move(values | {name: values[name] + way})["numbers"] for way in (-step, step)]
        slope = np.subtract(*ends[::-1]) / (2 * step)
        np.testing.assert_allclose(gradient[:, index], slope, rtol=2e-5, atol=1e-6, err_msg=name)


def test_at_rest_the_grid_is_finer_and_other_flanks_are_beside(explorer):
    explorer.prepare_rest()
    answer = explorer.rest(explorer.opened.check(MOVED))
    design = explorer.opened.design
    fine = design.mesh(explorer._fine_sizes)
    pinion, wheel = design.design({name: MOVED.get(name, explorer.opened.values[name]) for name in design.design.names})
    cycle = jg.solve(fine, 45.0, pinion=pinion, wheel=wheel)
    assert len(cycle.phase) == 512
    assert number(explorer, answer, "ppte") == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)), abs=1e-9)
    bare = answer["beside"]["unmodified"]["transmission_error"]["y"]
    unmodified = jg.peak_to_peak(jg.solve(fine, 45.0).transmission_error)
    assert max(bare) - min(bare) == pytest.approx(float(unmodified), abs=2e-6)
    assert explorer.rest(explorer.opened.values, lambda: True) is None


def test_a_search_from_here_lowers_what_it_is_asked_for(explorer):
    values, steps = explorer.opened.check(MOVED), []
    best = explorer.optimize(values, "ppte", lambda *progress: steps.append(progress))
    assert number(explorer, explorer.move(best), "ppte") < 0.5 * number(explorer, explorer.move(values), "ppte")
    assert best["torque"] == 45.0 and best["speed"] == values["speed"] and steps
    with pytest.raises(ValueError, match="noise: unknown objective, must be one of ppte, "):
        explorer.optimize(values, "noise", print)
    with pytest.raises(ValueError, match="manufactured gears need the table"):
        explorer.robust(values)


def test_variables_of_a_file_are_its_sliders(written):
    text = FREE.replace("\n[variables]", "\n# why\n[variables]")
    opened = Opened(written(text))
    assert list(opened.sliders) == ["height", "torque", "speed"] and opened.values["height"] == 10.0
    path = written(opened.text({"height": 7.25, "torque": 40.0, "speed": 3000.0}))
    design = load_design(path)
    assert design.values == {"height": 7.25} and design.bounds == {"height": (0.0, 20.0)} and design.torque == 40.0
    assert "# why" in path.read_text()


def test_what_a_file_leaves_out_is_written_where_it_removes_something(written):
    bare = FIXED[: FIXED.index("[[pinion.modification]]")]
    opened = Opened(written(bare))
    assert all(opened.values[name] == 0.0 for name in opened.sliders if name.endswith("_amount"))
    assert load_design(written(opened.text(opened.values))).text == load_design(written(bare)).text
    path = written(opened.text(opened.values | {"wheel_profile_slope_amount": 2.0}))
    pinion, wheel = load_design(path).design({})
    assert str(pinion) == str(jg.NoModification()) and str(wheel) == str(jg.ProfileSlope(2.0))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"hight": 1.0}, "hight: unknown slider, must be one of height, torque, speed"),
        ({"height": 21}, "height = 21 um must be at least 0 um and at most 20 um"),
        ({"height": float("nan")}, "height = nan um must be at least 0 um"),
        ({"height": "7"}, "height: must be a number"),
        ({"height": True}, "height: must be a number"),
    ],
)
def test_values_are_checked(written, values, message):
    with pytest.raises(ValueError) as refused:
        Opened(written(FREE)).check(values)
    assert str(refused.value).startswith(message)


def test_a_stage_is_refused():
    example = Path(__file__).parents[1] / "examples" / "planetary_26_19.toml"
    with pytest.raises(DesignFileError, match="stage: is more than a pair, and the page shows one"):
        Opened(example)


def test_a_file_that_cannot_be_used_is_one_line(written):
    with pytest.raises(DesignFileError, match="pair.toml: load.torque: "):
        Opened(written(FIXED.replace("torque = 50.0", 'torque = "much"')))


@pytest.mark.parametrize(
    "name", ["", "../a", "a/b", "a\\b", ".hidden", "-o", "a\n", "x" * 81, "pair", "pair.toml", "a\0b"]
)
def test_names_of_files_stay_in_the_folder(explorer, name):
    with pytest.raises(ValueError, match="name: "):
        explorer.write(name, explorer.opened.values)


def test_saved_files_are_those_of_the_page_and_replace_no_others(explorer):
    values = explorer.opened.check(MOVED)
    (explorer.folder / "mine.csv").write_text("mine")
    with pytest.raises(ValueError, match="mine.csv exists already"):
        explorer.write("mine", values)
    assert (
        explorer.write("saved one", values)
        == explorer.write("saved one", values)
        == ["saved one.toml", "saved one.csv"]
    )
    again = Opened(explorer.folder / "saved one.toml")
    assert {name: again.values[name] for name in MOVED} == MOVED


@pytest.mark.slow
def test_helical_flanks_and_axes_move(written):
    text = FIXED.replace("module = 3.0", "module = 3.0\nhelix_angle = 15.0", 1)
    text = text[: text.index("[resolution]")] + "[resolution]\npositions = 8\nslices = 6\nface_modes = 3\n"
    explorer = Explorer(written(text))
    explorer.prepare()
    values = explorer.opened.values | {"misalignment": 6.0, "pinion_lead_crowning_amount": 4.0}
    answer = explorer.move(values)
    path = explorer.folder / "axes.toml"
    path.write_text(explorer.opened.text(values))
    design = load_design(path)
    pinion, wheel = design.design({})
    cycle = jg.solve(design.mesh(explorer._sizes), 50.0, pinion=pinion, wheel=wheel)
    assert number(explorer, answer, "ppte") == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)), abs=1e-9)
    index = list(explorer.opened.sliders).index("misalignment")
    ends = [explorer.move(values | {"misalignment": 6.0 + way})["numbers"] for way in (-1e-3, 1e-3)]
    gradient = np.asarray(answer["gradient"], float)[:, index]
    np.testing.assert_allclose(gradient, np.subtract(*ends[::-1]) / 2e-3, rtol=1e-5, atol=1e-6)
    load = answer["charts"]["plane_of_action"]
    assert len(load["load"]) == 6 and len(load["face"]) == 7


@pytest.mark.slow
def test_gears_move_too(written):
    text = FREE.replace("teeth = 48", 'teeth = 48\nprofile_shift = "shift"')
    text = text.replace("[variables]", "[variables]\nshift = { low = -0.2, high = 0.3 }")
    text = text[: text.index("[optimize]")].replace("pairs = 2\n", "")
    explorer = Explorer(written(text))
    explorer.prepare()
    values = explorer.opened.values | {"shift": 0.1, "height": 8.0}
    answer = explorer.move(values)
    design = load_design(written(explorer.opened.text(values).replace('"shift"', "0.1").replace("shift = {", "# {")))
    pinion, wheel = design.design({"height": 8.0})
    cycle = jg.solve(design.mesh(explorer._sizes), 50.0, pinion=pinion, wheel=wheel)
    assert number(explorer, answer, "ppte") == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)), abs=1e-9)
    index = list(explorer.opened.sliders).index("shift")
    ends = [explorer.move(values | {"shift": 0.1 + way})["numbers"] for way in (-1e-5, 1e-5)]
    gradient = np.asarray(answer["gradient"], float)[:, index]
    np.testing.assert_allclose(gradient, np.subtract(*ends[::-1]) / 2e-5, rtol=1e-4, atol=1e-5)
    best = explorer.optimize(values, "ppte", lambda *_: None)
    assert best["shift"] == 0.1 and number(explorer, explorer.move(best), "ppte") < number(explorer, answer, "ppte")
