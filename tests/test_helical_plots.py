"""Pictures of helical pairs: inclined contact lines, pairs that come to the path slice by slice."""

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from helical_pairs import solved

from jaxgear import plot

pytestmark = pytest.mark.usefixtures("clean_figures")
WIDTH, BASE_ANGLE = 20.0, 14.0761  # mm, deg
AHEAD = WIDTH * np.tan(np.deg2rad(BASE_ANGLE))  # of one end of the face on the path of contact


@pytest.mark.slow
def test_contact_lines_run_across_the_plane_of_action():
    mesh, cycle = solved()
    ax = plot.pressure_map(cycle)
    corners = ax.collections[0].get_coordinates()  # edges of slices and positions
    np.testing.assert_allclose(corners[-1, :, 0] - corners[0, :, 0], AHEAD, rtol=1e-5)
    np.testing.assert_allclose(corners[:, 0, 1], np.linspace(-10.0, 10.0, 6), atol=1e-12)
    lines = [line for line in ax.lines if len(line.get_xdata()) == 6]
    assert lines
    for line in lines:
        x, y = map(np.asarray, line.get_data())
        known = np.isfinite(x)
        rise = np.diff(x[known]) / np.diff(y[known])
        np.testing.assert_allclose(rise, AHEAD / WIDTH, rtol=1e-5)
    path = mesh.path_of_contact
    seen = np.concatenate([np.asarray(line.get_xdata()) for line in lines])
    assert np.nanmin(seen) >= float(path.start) and np.nanmax(seen) <= float(path.end)


def test_both_flanks_show_the_same_lines():
    """Roll lengths of pinion and wheel add up to the same length wherever they touch."""
    mesh, cycle = solved()
    pinion, wheel = plot.contact_pattern(cycle)
    shown = [[np.asarray(line.get_xdata()) for line in panel.lines] for panel in (pinion, wheel)]
    bases = [float(side.base_radius) for side in mesh.sides]
    whole = sum(float(side.pitch_roll_length) for side in mesh.sides)
    assert shown[0]
    for first, second in zip(*shown, strict=True):
        total = np.deg2rad(first) * bases[0] + np.deg2rad(second) * bases[1]
        np.testing.assert_allclose(total[np.isfinite(total)], whole, rtol=1e-12)


@pytest.mark.slow
def test_a_pair_carries_load_for_longer_than_its_slices():
    mesh, cycle = solved()
    ax = plot.load_sharing({"helical": cycle})
    x, share = map(np.asarray, ax.lines[0].get_data())
    length = float(mesh.path_of_contact.end - mesh.path_of_contact.start)
    loaded = np.ptp(x[share > 1e-3])
    assert length + 0.6 * AHEAD < loaded < length + 1.6 * AHEAD
    assert "mid-face" in ax.get_xlabel() and "mid-face" not in plot.load_sharing({"spur": solved(None)[1]}).get_xlabel()


def test_line_loads_of_the_pairs_add_up():
    *pairs, whole = [line.get_ydata() for line in plot.line_load(solved()[1]).lines if len(line.get_xdata()) == 5]
    assert len(pairs) >= 2
    np.testing.assert_allclose(np.sum(pairs, axis=0), whole, rtol=1e-12)


@pytest.mark.slow
def test_other_pictures_are_those_of_spur_gears_in_the_limit():
    (mesh, nearly), (_, spur) = solved(1e-6), solved(None)
    for draw in (plot.pressure, plot.load_sharing):
        one, other = (draw({"unmodified": cycle}).lines[0].get_data() for cycle in (nearly, spur))
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=2e-3)
    gap = plot.face_gap(nearly, mesh).lines[0].get_ydata()
    np.testing.assert_allclose(gap, 0.0, atol=1e-3)
