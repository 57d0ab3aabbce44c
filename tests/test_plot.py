"""Pictures show what the cycle holds, name their units, and leave matplotlib as they found it."""

import subprocess
import sys
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from catalogue import FACE, gear_pair, prepare
from gearboxes import gearbox

import jaxgear as jg
from jaxgear import plot
from jaxgear.plot.figure import line_style
from jaxgear.plot.mesh_cycle import two_pitches
from jaxgear.shafts import elastic_line

pytestmark = pytest.mark.usefixtures("clean_figures")

TORQUE, AMOUNT, LENGTH = 50.0, 8.0, 5.0
TORQUES = np.array([10.0, 30.0, 50.0, 80.0])


@pytest.fixture(scope="module")
def mesh():
    return prepare(gear_pair(), resolution=FACE)


@pytest.fixture(scope="module")
def designs():
    """On the pinion and on the wheel; the relieved pinion is also crowned, so that its slices differ."""
    relief = jg.TipRelief(AMOUNT, LENGTH)
    return {"unmodified": (None, None), "long relief": (relief + jg.LeadCrowning(4.0), relief)}


@pytest.fixture(scope="module")
def solved(mesh, designs):
    """Mesh cycles at all torques, by design."""
    return {
        name: jg.sweeps.over_torques(mesh, TORQUES, pinion=pinion, wheel=wheel)
        for name, (pinion, wheel) in designs.items()
    }


@pytest.fixture(scope="module")
def cycles(solved):
    row = list(TORQUES).index(TORQUE)
    return {name: many[row] for name, many in solved.items()}


@pytest.fixture(scope="module")
def curves(solved):
    """Transmission error over the torque, shape (torques, positions), by design."""
    return {name: np.stack([cycle.transmission_error for cycle in many]) for name, many in solved.items()}


@pytest.fixture
def draw(mesh, designs, cycles, curves):
    """Every picture by name, as a function of the Axes to draw into."""
    ppte = {name: np.ptp(curve, axis=-1) for name, curve in curves.items()}
    factors = {"unmodified": np.ones(4), "long relief": np.array([1.4, 1.3, 1.2, 1.1])}
    return {
        "transmission_error": lambda ax=None: plot.transmission_error(cycles, ax),
        "load_sharing": lambda ax=None: plot.load_sharing(cycles, ax),
        "pressure": lambda ax=None: plot.pressure(cycles, ax),
        "pressure_map": lambda ax=None: plot.pressure_map(cycles["long relief"], ax),
        "plane_of_action": lambda ax=None: plot.plane_of_action(cycles["long relief"], ax),
        "contact_pattern": lambda ax=None: plot.contact_pattern(cycles["long relief"], ax),
        "line_load": lambda ax=None: plot.line_load(cycles["long relief"], ax),
        "face_gap": lambda ax=None: plot.face_gap(cycles["long relief"], mesh, ax),
        "face_load_over_torque": lambda ax=None: plot.face_load_over_torque(TORQUES, factors, ax, design_torque=TORQUE),
        "ppte_over_torque": lambda ax=None: plot.ppte_over_torque(TORQUES, ppte, ax, design_torque=TORQUE),
        "ppte_over_overlap": lambda ax=None: plot.ppte_over_overlap(TORQUES / 50, ppte, ax, design=0.6),
        "harris_map": lambda ax=None: plot.harris_map(mesh.phase, TORQUES, curves["long relief"], ax),
        "k_chart": lambda ax=None: plot.k_chart(mesh, designs, ax),
        "lead_chart": lambda ax=None: plot.lead_chart(mesh, designs, ax),
    }


UNITS = {
    "transmission_error": ("[base pitches]", "[µm]"),
    "load_sharing": ("[mm]", "[-]"),
    "pressure": ("[mm]", "[MPa]"),
    "pressure_map": ("[mm]", "[mm]"),
    "plane_of_action": ("[mm]", "[mm]"),
    "contact_pattern": ("[deg]", "[mm]"),
    "line_load": ("[mm]", "[N/mm]"),
    "face_gap": ("[mm]", "[µm]"),
    "face_load_over_torque": ("[N m]", "[-]"),
    "ppte_over_torque": ("[N m]", "[µm]"),
    "ppte_over_overlap": ("[-]", "[µm]"),
    "harris_map": ("[base pitches]", "[µm]"),
    "k_chart": ("[deg]", "[µm]"),
    "lead_chart": ("[mm]", "[µm]"),
}


LEGENDS = (
    "transmission_error",
    "load_sharing",
    "pressure",
    "ppte_over_torque",
    "ppte_over_overlap",
    "face_load_over_torque",
    "line_load",
    "face_gap",
)


@pytest.mark.parametrize("name", UNITS)
def test_axes_name_their_units_and_legend_and_marks_cover_no_data(draw, name):
    first = np.atleast_1d(draw[name]())[0]
    assert first.get_xlabel().endswith(UNITS[name][0])
    assert first.get_ylabel().endswith(UNITS[name][1])
    if name not in LEGENDS:
        return
    first.figure.draw_without_rendering()
    frame, legend = first.get_window_extent(), first.get_legend().get_window_extent()
    marks = [text.get_window_extent() for text in first.texts]
    assert legend.y0 >= frame.y1
    assert all(mark.y0 >= frame.y1 and mark.y1 <= legend.y0 + 1 for mark in marks)
    assert legend.y1 <= first.figure.bbox.y1 + 1 and legend.x1 <= first.figure.bbox.x1 + 1


@pytest.mark.parametrize("name", UNITS)
def test_a_given_ax_is_used_and_its_figure_gains_no_other(draw, name):
    figure, ax = plt.subplots(1, 2)
    given = ax if name in ("k_chart", "lead_chart", "contact_pattern") else ax[0]
    returned = draw[name](given)
    assert np.all(np.atleast_1d(returned) == np.atleast_1d(given))
    assert plt.get_fignums() == [figure.number]


def test_the_tolerance_lies_about_the_named_design(mesh, designs):
    """Upper limit and lower limit enclose the curve of that design, and only its own middle."""
    classes = tuple(jg.tolerance.ToleranceClass.of(gear, 5) for gear in (mesh.pair.pinion, mesh.pair.wheel))
    for name, chart in [(name, chart) for name in designs for chart in (plot.k_chart, plot.lead_chart)]:
        panel = chart(mesh, designs, tolerance=classes, about=name)[0]
        line = next(line for line in panel.lines if line.get_label() == name)
        (path,) = panel.collections[0].get_paths()
        place = path.vertices[:, 0]
        middle = np.interp(place, *(np.asarray(values)[np.argsort(line.get_xdata())] for values in line.get_data()))
        assert (path.vertices[:, 1] - middle).min() < -1 and (path.vertices[:, 1] - middle).max() > 1
        low, high = (reach(path.vertices[:, 1] - middle) for reach in (np.min, np.max))
        assert high == pytest.approx(-low, abs=0.35)
    plt.close("all")


def test_eight_designs_differ_in_colour_and_without():
    styles = [line_style(index) for index in range(8)]
    assert len({style["color"] for style in styles}) == len({style["linestyle"] for style in styles}) == 8


def test_transmission_error_repeats_one_base_pitch(cycles):
    ax = plot.transmission_error(cycles)
    for line, cycle in zip(ax.lines, cycles.values()):
        x, y = line.get_data()
        curve = np.asarray(cycle.transmission_error)
        np.testing.assert_allclose(np.diff(x), 1 / curve.size, rtol=1e-9)
        np.testing.assert_array_equal(y, np.concatenate([curve, curve, curve[:1]]))
        assert (x[0], x[-1]) == (0.0, 2.0)
        assert f"{np.ptp(curve):.2f} µm" in line.get_label()


def test_shares_of_following_pairs_sum_to_one(cycles, mesh):
    """One pair's history, cut into base pitches and laid over itself, is the whole load."""
    ax = plot.load_sharing(cycles)
    positions = mesh.resolution.positions
    for line in ax.lines[: len(cycles)]:
        path, share = line.get_data()
        np.testing.assert_allclose(np.diff(path), float(mesh.path_of_contact.base_pitch) / positions, rtol=1e-9)
        np.testing.assert_allclose(share.reshape(-1, positions).sum(axis=0), 1.0, rtol=1e-9)
        # the pair carries everything at the pitch point, which lies in single contact, and nothing far outside
        assert share[np.argmin(np.abs(path))] == pytest.approx(1.0)
        assert share[0] == share[-1] == 0.0


def test_path_marks_stand_at_a_to_e(cycles, mesh):
    ax = plot.load_sharing(cycles)
    contact = mesh.path_of_contact
    expected = {
        "A": contact.start,
        "B": contact.inner_single,
        "C": 0.0,
        "D": contact.outer_single,
        "E": contact.end,
    }
    marked = {text.get_text(): text.xy[0] for text in ax.texts}
    assert marked == {letter: pytest.approx(float(position)) for letter, position in expected.items()}
    low, high = ax.get_xlim()
    assert low < min(marked.values()) and high > max(marked.values())


def test_flank_pressure_stays_on_the_path_and_corner_contact_apart(cycles, mesh):
    ax = plot.pressure(cycles)
    contact = mesh.path_of_contact
    for line, cycle in zip(ax.lines, cycles.values()):
        path, drawn = line.get_data()
        on_path = (path >= float(contact.start)) & (path <= float(contact.end))
        assert np.isfinite(drawn[on_path]).all() and np.isnan(drawn[~on_path]).all()
        assert np.nanmax(drawn) == pytest.approx(float(np.asarray(cycle.contact_pressure).max()))
    # an unmodified pair meets with its tip corners under load, a well relieved one does not
    bare, relieved = (line.get_label() for line in ax.lines[:2])
    highest = float(np.asarray(cycles["unmodified"].corner_pressure).max())
    assert highest > 1000
    assert bare == f"unmodified (corners {round(highest, -1):.0f} MPa)"
    assert relieved == "long relief"
    # drawn where it is, on a scale that leaves the flanks readable
    (dots,) = (line for line in ax.lines[len(cycles) :] if line.get_marker() == "o" and line.get_xdata().size)
    path, corner = dots.get_data()
    assert corner.max() == pytest.approx(highest) and ((path < contact.start) | (path > contact.end)).all()
    assert ax.get_ylim()[1] >= highest
    heights = ax.transAxes.inverted().transform(ax.transData.transform([(0.0, drawn.max()) for drawn in _flanks(ax)]))
    assert (heights[:, 1] > 0.4).all() and max(ax.get_yticks()) < 3 * highest


def _flanks(ax):
    """Flank pressures that are drawn."""
    return [line.get_ydata()[np.isfinite(line.get_ydata())] for line in ax.lines[:2]]


def test_pressure_map_has_one_row_per_slice(cycles, mesh):
    cycle = cycles["long relief"]
    ax = plot.pressure_map(cycle)
    drawn = ax.collections[0].get_array()
    positions = mesh.resolution.pairs * mesh.resolution.positions
    assert drawn.shape == (mesh.resolution.slices, positions)
    np.testing.assert_allclose(drawn.max(axis=1), np.asarray(cycle.contact_pressure).max(axis=(0, 2)), rtol=1e-12)
    assert drawn[1].max() > drawn[0].max()  # crowning loads the middle of the face
    assert ax.get_ylim() == pytest.approx((-9.0, 9.0))


def test_plane_of_action_carries_the_whole_force(cycles, mesh):
    """Over every line of contact, corners included: slice widths times line loads sum to the force over the levers."""
    ax = plot.plane_of_action(cycles["unmodified"])
    drawn = np.nan_to_num(np.ma.filled(ax.collections[0].get_array(), 0.0))
    stages = drawn.reshape(mesh.resolution.slices, mesh.resolution.pairs, -1)
    lever = np.asarray(mesh.lever)[::-1, 0]  # the last pair comes first
    carried = np.einsum("spn,pn,s->n", stages, lever, np.asarray(mesh.slice_width))
    np.testing.assert_allclose(carried, float(cycles["unmodified"].force), rtol=1e-9)
    corner = ax.collections[0].get_coordinates()[0, :-1, 0] < float(mesh.path_of_contact.start)
    assert drawn[:, corner].any() and ax.get_xlim()[0] < float(mesh.path_of_contact.start)


def test_contact_pattern_is_the_pressure_map_over_the_flanks_of_both_gears(cycles, mesh):
    cycle = cycles["long relief"]
    panels = plot.contact_pattern(cycle)
    mapped = plot.pressure_map(cycle).collections[0]
    for panel, gear, side in zip(panels, (mesh.pair.pinion, mesh.pair.wheel), mesh.sides):
        drawn = panel.collections[0]
        np.testing.assert_array_equal(drawn.get_array(), mapped.get_array())
        assert drawn.get_clim() == panels[0].collections[0].get_clim()
        ends = side.start_roll_length, gear.tip_roll_length
        np.testing.assert_allclose(panel.get_xlim(), [float(jg.geometry.roll_angle(gear, end)) for end in ends])
    # where the path is at the pitch point, so are both roll angles
    path, (first, second) = (
        mapped.get_coordinates()[0, :, 0],
        (of.collections[0].get_coordinates()[0, :, 0] for of in panels),
    )
    for gear, side, angles in zip((mesh.pair.pinion, mesh.pair.wheel), mesh.sides, (first, second)):
        pitch = float(jg.geometry.roll_angle(gear, side.pitch_roll_length))
        assert np.interp(0.0, path, angles) == pytest.approx(pitch)
    assert first[0] < first[-1] and second[0] > second[-1]


def test_line_load_and_gap_over_the_face(cycles, mesh):
    """Crowning: the middle of the face carries most, the ends are apart by its amount before the load comes."""
    cycle = cycles["long relief"]
    load = np.asarray(cycle.line_load)
    ax = plot.line_load(cycle)
    drawn = [line for line in ax.lines if len(line.get_xdata()) == mesh.resolution.slices]
    position = load.max(axis=(0, 1)).argmax()
    assert len(drawn) == (load[:, :, position].max(axis=1) > 0).sum()
    assert max(line.get_ydata().max() for line in drawn) == load.max()
    np.testing.assert_array_equal(drawn[0].get_xdata(), mesh.face_coordinate)
    most = load[:, :, position].max(axis=1).argmax()
    factor = load[most, :, position].max() / load[most, :, position].mean()
    assert any(f"K = {factor:.2f}" in line.get_label() for line in drawn)
    gap = plot.face_gap(cycle, mesh)
    unloaded, under_load = (line.get_ydata() for line in gap.lines[:2])
    ends = (2 * np.asarray(mesh.face_coordinate) / float(mesh.pair.face_width)) ** 2
    np.testing.assert_allclose(unloaded, 4.0 * (ends - ends.min()), atol=1e-9)
    assert (under_load <= unloaded).all() and (under_load[load[most, :, position] > 0] == 0).all()
    other = plot.line_load(cycle, position=0)
    assert max(np.max(line.get_ydata()) for line in other.lines) == load[:, :, 0].max()


def test_face_load_starts_at_an_even_load():
    ax = plot.face_load_over_torque(TORQUES, {"even": np.ones(4), "skewed": np.array([2.0, 1.6, 1.4, 1.2])})
    assert ax.get_ylim()[0] == 1.0 and ax.get_ylim()[1] > 2.0
    assert not ax.texts


@pytest.mark.slow
def test_shafts_lie_where_their_gears_mesh_and_name_their_deflection():
    box = gearbox()
    panels = plot.shaft_deflection(box)
    assert [panel.get_ylabel() for panel in panels] == [f"{name}: radius [mm]" for name in ("in", "out")]
    assert panels[-1].get_xlabel() == "axial coordinate [mm]"
    places = {text.get_text(): text.get_position()[0] for panel in panels for text in panel.texts}
    assert places["pinion"] == places["wheel"] == 45.0
    for shaft, panel in zip(box.shafts, panels):
        along, drawn = next(line.get_data() for line in panel.lines if line.get_label().startswith("deflection"))
        label = next(line.get_label() for line in panel.lines if line.get_label().startswith("deflection"))
        factor, largest = (float(label.split(mark)[1].split()[0].rstrip(",")) for mark in ("x ", "largest "))
        moved = np.asarray(elastic_line(box, shaft.name, along).displacement)[:, :2]
        assert largest == pytest.approx(np.hypot(*moved.T).max(), rel=5e-3)
        assert drawn.max() == pytest.approx(1e-3 * factor * np.hypot(*moved.T).max())
        thickest = max(float(section.diameter) for section in shaft.sections) / 2
        assert 0.2 * thickest < drawn.max() < thickest
    figure, given = plt.subplots(2, 1)
    assert list(plot.shaft_deflection(box, given)) == list(given)


def test_ppte_over_torque_marks_the_design_torque(curves):
    ppte = {name: np.ptp(curve, axis=-1) for name, curve in curves.items()}
    ax = plot.ppte_over_torque(TORQUES, ppte, design_torque=TORQUE)
    for line, curve in zip(ax.lines, ppte.values()):
        np.testing.assert_array_equal(line.get_xdata(), TORQUES)
        np.testing.assert_array_equal(line.get_ydata(), curve)
    assert [text.get_text() for text in ax.texts] == ["design torque 50 N m"]
    assert ax.texts[0].xy[0] == TORQUE
    low, high = ax.get_xlim()  # that of the data with some air, not from zero
    assert 0.1 > (min(TORQUES) - low) / np.ptp(TORQUES) > 0 and 0.1 > (high - max(TORQUES)) / np.ptp(TORQUES) > 0


def test_overlap_marks_whole_ratios():
    ax = plot.ppte_over_overlap([0.4, 1.2, 2.3], {"unmodified": [3.0, 1.0, 0.5]}, design=1.2)
    assert [line.get_xdata()[0] for line in ax.lines[1:]] == [1.2, 1.0, 2.0]


def test_the_design_that_a_figure_is_about_is_the_boldest(curves):
    """Its line and its mark in the legend; a design whose name begins alike is another one."""
    ax = plot.ppte_over_torque([50.0, 100.0], {"best": [1.0, 2.0], "best 2": [2.0, 3.0], "worst": [3.0, 4.0]})
    plot.emphasize(ax.figure, "best")
    for lines in (ax.lines, ax.get_legend().legend_handles):
        assert lines[0].get_linestyle() == "-" and lines[0].get_linewidth() > 1.5 * lines[1].get_linewidth()
        assert lines[1].get_linewidth() == lines[2].get_linewidth() == line_style(1)["linewidth"]


def test_harris_map_labels_every_curve_even_if_they_meet():
    phase, torques = np.arange(8) / 8, [60.0, 5.0, 6.0, 7.0]
    te = np.array([9.0, 1.00, 1.01, 1.02])[:, None] + 0.1 * np.sin(2 * np.pi * phase)
    ax = plot.harris_map(phase, torques, te)
    ax.figure.draw_without_rendering()
    assert [text.get_text() for text in ax.texts] == ["5 N m", "6 N m", "7 N m", "60 N m"]
    boxes = [text.get_window_extent() for text in ax.texts]
    assert all(lower.y0 < upper.y0 and not lower.overlaps(upper) for lower, upper in zip(boxes, boxes[1:]))
    assert all(box.x0 >= ax.get_window_extent().x1 for box in boxes)
    np.testing.assert_array_equal(ax.lines[-1].get_ydata()[:8], te[0])


def test_k_chart_shows_the_relief_from_its_start_to_the_tip(mesh, designs):
    panels = plot.k_chart(mesh, designs)
    contact, pair = mesh.path_of_contact, mesh.pair
    starts = contact.pinion_roll_length(contact.start), contact.wheel_roll_length(contact.end)
    for panel, gear, start in zip(panels, (pair.pinion, pair.wheel), starts):
        nominal, relieved = panel.lines
        angle, removed = relieved.get_data()
        assert angle[0] == pytest.approx(float(jg.geometry.roll_angle(gear, start)))
        assert angle[-1] == pytest.approx(float(jg.geometry.roll_angle(gear, gear.tip_roll_length)))
        np.testing.assert_array_equal(nominal.get_ydata(), 0.0)
        # mid-face, where the crowning of the pinion removes nothing
        assert removed[-1] == pytest.approx(AMOUNT) and removed[0] == 0.0
        begin = float(jg.geometry.roll_angle(gear, gear.tip_roll_length - LENGTH))
        assert (removed[angle < begin] == 0).all() and (np.diff(removed[angle > begin]) > 0).all()
        # removed material goes down, and the upper axis ends at the tip diameter
        low, high = panel.get_ylim()
        assert low > AMOUNT and high < 0
        panel.figure.draw_without_rendering()
        diameters = panel.child_axes[0].get_xlim()
        assert diameters[1] == pytest.approx(2 * float(gear.tip_radius))
        assert diameters[0] == pytest.approx(float(jg.geometry.diameter(gear, start)))


def test_lead_chart_shows_the_crowning_of_the_pinion_at_the_pitch_point(mesh, designs):
    """There is no relief there; the crowning is a parabola, with its amount at both ends of the face."""
    pinion, wheel = plot.lead_chart(mesh, designs)
    face, removed = pinion.lines[1].get_data()
    assert face[0] == -face[-1] == pytest.approx(-0.5 * float(mesh.pair.face_width))
    np.testing.assert_allclose(removed, 4.0 * (face / face[-1]) ** 2, atol=1e-12)
    np.testing.assert_array_equal(pinion.lines[0].get_ydata(), 0.0)
    np.testing.assert_array_equal([line.get_ydata() for line in wheel.lines], 0.0)
    low, high = pinion.get_ylim()
    assert low > 4.0 and high < 0 and wheel.get_ylim() == (low, high)


def test_save_writes_a_report_sized_png_and_closes_the_figure(cycles, tmp_path):
    figure = plot.transmission_error(cycles).figure
    path = plot.save(figure, tmp_path / "new" / "te.png")
    height, width, _ = plt.imread(path).shape
    assert (width, height) == (pytest.approx(120 / 25.4 * 200, rel=0.05), pytest.approx(75 / 25.4 * 200, rel=0.05))
    assert not plt.fignum_exists(figure.number)


@pytest.mark.slow
def test_imports_leave_matplotlib_alone():
    """The library needs no matplotlib until something is drawn, and drawing changes no setting of its user."""
    program = """
import sys
import jaxgear
assert not any(name.split(".")[0] == "matplotlib" for name in sys.modules)
import matplotlib
before = dict.copy(matplotlib.rcParams)
import jaxgear.plot
changed = [key for key in before if dict.__getitem__(matplotlib.rcParams, key) is not before[key]]
assert not changed, changed
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=300)


@pytest.mark.parametrize("draw", [lambda runs: plot.speed_response({"unmodified": runs}), plot.bifurcation])
def test_kicked_runs_are_told_from_falling_ones(draw):
    at = np.linspace(500.0, 5000.0, 3)
    numbers = {"mesh_frequency": at, "dynamic_factor": at / 500.0, "poincare_dte": at[:, None]}
    response = SimpleNamespace(direction="down", **numbers)
    ax = draw({"rising": response, "falling": response, "falling, kicked": response})
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert {"speed rising", "speed falling", "speed falling, kicked"} <= set(labels)
    plt.close(ax.figure)


def test_order_tracks_in_decibels_over_mesh_frequency_and_pinion_speed():
    at, levels = np.linspace(500.0, 5000.0, 3), np.array([[150.0, -np.inf], [170.0, -np.inf], [90.0, -np.inf]])
    response = SimpleNamespace(mesh_frequency=at, force_levels=levels, orders=(1.0, 0.5))
    ax = plot.order_tracks(response)
    plot.speed_scale(ax, 50.0)
    (line,), (scale,) = ax.lines, ax.child_axes
    assert line.get_label() == "order 1" and np.array_equal(line.get_ydata(), levels[:, 0])
    assert ax.get_ylim() == (110.0, 173.0) and ax.get_ylabel().endswith("[dB re 1 µN]")
    ax.figure.draw_without_rendering()
    assert np.allclose(scale.get_xlim(), 1.2 * np.array(ax.get_xlim())) and scale.get_xlabel() == "pinion speed [rpm]"
    plt.close(ax.figure)


def test_shared_axes_of_speed_responses_show_all_curves():
    frequency = np.linspace(500.0, 5000.0, 10)
    figure, both = plt.subplots(1, 2, sharey=True)
    for ax, height in zip(both, (3.0, 30.0)):
        response = SimpleNamespace(direction="up", mesh_frequency=frequency, dte_rms=height * np.ones(10))
        plot.speed_response({"unmodified": [response]}, "dte_rms", ax)
    assert both[0].get_ylim() == both[1].get_ylim() and both[0].get_ylim()[0] == 0.0 and both[0].get_ylim()[1] > 30.0
    plt.close(figure)


@pytest.mark.parametrize("first", [0.0, -0.5, 0.75])
def test_two_pitches_begin_at_zero_wherever_the_cycle_does(first):
    phase = first + np.arange(8) / 8
    shown, curve = two_pitches(phase, np.cos(2 * np.pi * phase))
    assert (shown[0], shown[-1]) == (0.0, 2.0) and np.all(np.diff(shown) > 0)
    np.testing.assert_allclose(curve, np.cos(2 * np.pi * shown), atol=1e-12)
