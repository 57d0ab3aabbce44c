"""Pictures of manufacture: what is drawn is what the functions give, with units on every axis."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
import pytest  # noqa: E402
from catalogue import kahraman_gear, prepare  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import manufacture, plot, tolerance  # noqa: E402
from jaxgear.manufacture import figures  # noqa: E402
from jaxgear.tolerance import ToleranceClass  # noqa: E402

pytestmark = pytest.mark.usefixtures("clean_figures")

RELIEF = jg.TipRelief(6.0, 3.0, jg.Power(3.0))


@pytest.fixture(scope="module")
def mesh():
    return prepare(jg.GearPair(kahraman_gear(), kahraman_gear()))


@pytest.fixture(scope="module")
def side(mesh):
    return mesh.sides[0]


@pytest.fixture(scope="module")
def quality(side):
    return ToleranceClass.of(side.gear, 5.0)


def test_wheel_fits_the_tooth_space(side):
    """The active profile bounds the gear on both sides; nothing of the gear is drawn within the space."""
    ax = figures.tooth_space(side, jg.NoModification())
    left, right = ax.lines[:2]
    profile = manufacture.wheel_profile(side, jg.NoModification())
    np.testing.assert_allclose(right.get_xydata(), np.stack([profile.x, profile.y], axis=1))
    np.testing.assert_allclose(left.get_xdata(), -right.get_xdata())
    gear = ax.patches[1].get_path()
    for x, y in right.get_xydata()[5:-5:20]:
        assert gear.contains_point((x + 0.02, y)) and not gear.contains_point((x - 0.02, y))
    assert ax.get_xlabel().endswith("[mm]") and ax.get_ylabel().endswith("[mm]") and ax.get_aspect() == 1.0


def test_deviation_of_the_wheel_with_its_limit(side):
    splines = {f"degree {degree}": manufacture.wheel_spline(side, RELIEF, degree=degree) for degree in (2, 3)}
    ax = figures.wheel_deviation(splines, limit=0.5)
    for line, (name, spline) in zip(ax.lines, splines.items()):
        np.testing.assert_array_equal(line.get_ydata(), spline.deviation)
        assert line.get_label().startswith(name)
    assert [line.get_ydata()[0] for line in ax.lines[2:]] == [-0.5, 0.5]
    assert ax.get_xlabel().endswith("[mm]") and ax.get_ylabel().endswith("[µm]")
    assert len(figures.wheel_deviation(splines, limit=None).lines) == 2


def test_volumes_as_bars(side):
    found = manufacture.reference_volumes(side, 6.0)._asdict()
    ax = figures.volumes(found)
    assert [bar.get_width() for bar in ax.patches] == pytest.approx([float(value) for value in found.values()])
    assert [text.get_text() for text in ax.texts] == ["15.3", "10.4", "8.5", "5.7"]
    assert [label.get_text() for label in ax.get_yticklabels()] == list(found)


def test_topography_of_both_flanks(mesh):
    pinion, wheel = plot.topography(mesh, (RELIEF + jg.LeadCrowning(4.0), None))
    assert pinion.get_xlabel() == "roll angle of the pinion [deg]" and wheel.get_xlabel().startswith(
        "roll angle of the w"
    )
    bar = pinion.figure.axes[-1]
    assert bar.get_ylabel() == "material removed [µm]" and bar.get_ylim() == pytest.approx((0.0, 10.0), abs=1e-9)
    assert pinion.get_ylabel() == "face coordinate [mm]"
    nominal = plot.topography(mesh, (None, None), plt.subplots(1, 2)[1])
    assert nominal[0].figure.axes[-1].get_ylim() == (0.0, 1.0)


@pytest.mark.parametrize("chart", ["k_chart", "lead_chart"])
def test_band_of_the_class_about_the_first_design(mesh, quality, chart):
    """As wide as the total tolerance, within the evaluation range and in sight; none for a gear without a class."""
    design = RELIEF + jg.LeadCrowning(3.0)
    panels = getattr(plot, chart)(mesh, {"design": (design, design), "none": (None, None)}, tolerance=(quality, None))
    (band,) = panels[0].collections
    assert not panels[1].collections
    vertices = band.get_paths()[0].vertices
    width, ends = (8.5, (None, None)) if chart == "k_chart" else (9.0, (-9.0, 9.0))
    place = vertices[:, 0]
    for at in (place.min(), place.max()):
        assert np.ptp(vertices[place == at, 1]) == pytest.approx(width)
    if ends[0] is not None:
        assert (place.min(), place.max()) == pytest.approx(ends, abs=0.11)
    low, high = panels[0].get_ylim()
    assert low > vertices[:, 1].max() and high < vertices[:, 1].min()
    labels = [text.get_text() for text in panels[0].figure.legends[0].get_texts()]
    assert labels == ["design", "none", "ISO 1328 tolerance about design"]
    assert np.asarray(tolerance.profile_trace(mesh.sides[0], design, quality).design).max() == 0.0


@pytest.fixture(scope="module")
def cycles(mesh):
    reliefs = {"none": jg.TipRelief(0.0, 1.0), "some": jg.TipRelief(6.0, 1.0)}
    return {name: jg.solve(mesh, 200.0, pinion=relief, wheel=relief) for name, relief in reliefs.items()}


def test_orders_as_bars(cycles):
    ax = plot.transmission_error_orders(cycles, count=4)
    heights = np.reshape([bar.get_height() for bar in ax.patches], (2, 4))
    for row, cycle in zip(heights, cycles.values()):
        np.testing.assert_allclose(row, jg.harmonics(cycle.transmission_error, 4).amplitude)
    middle = np.reshape([bar.get_x() + bar.get_width() / 2 for bar in ax.patches], (2, 4)).mean(axis=0)
    np.testing.assert_allclose(middle, [1, 2, 3, 4])
    with pytest.raises(ValueError, match="harmonics: count = 16 must be"):
        plot.transmission_error_orders(cycles, count=16)


def test_mesh_stiffness_over_the_phase(cycles):
    cycle = cycles["some"]
    tangent, secant = plot.mesh_stiffness(cycle).lines
    np.testing.assert_array_equal(tangent.get_ydata()[:32], cycle.tangent_stiffness)
    np.testing.assert_array_equal(secant.get_ydata()[:32], jg.secant_stiffness(cycle))
    assert tangent.axes.get_ylim()[0] == 0 and tangent.axes.get_ylabel() == "mesh stiffness [N/µm]"
