"""Pictures of many variants and of manufactured gears show the table's numbers, name units and hide no failure."""

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

import jax.numpy as jnp
import matplotlib.pyplot as plt

import jaxgear as jg
from jaxgear import plot
from jaxgear.numerics.pareto import pareto_front
from jaxgear.sweeps.columns import Column, axis_label, described
from jaxgear.vocabulary import quantities

pytestmark = pytest.mark.usefixtures("clean_figures")

ROWS = 60
RELIEF = described("relief", "um")
PPTE, LOSS, PRESSURE, RATIO = RESULTS = tuple(
    quantities[name] for name in ("ppte", "mesh_loss_factor", "max_flank_pressure", "effective_contact_ratio")
)
NAMES = ("unmodified", "rule", "optimum")


@pytest.fixture
def table():
    """Sixty variants over one relief, the last one failed."""
    relief = np.linspace(0.0, 12.0, ROWS)
    table = {
        RELIEF: relief,
        PPTE: 0.5 + 0.08 * (relief - 6.0) ** 2,
        LOSS: 0.16 - 0.003 * relief,
        PRESSURE: 730 + 0.9 * relief**2,
        RATIO: 1.75 - 0.03 * relief,
    }
    table[PPTE][-1] = np.nan
    return table


def some(table, *columns):
    return {of: table[of] for of in columns}


@pytest.fixture(scope="module")
def scatter():
    random = np.random.default_rng(0)
    phase = np.arange(16) / 16
    nominal = 8 + 0.5 * np.sin(2 * np.pi * phase)
    curves = nominal + random.normal(size=(400, 1)) + 0.2 * random.normal(size=(400, 16))
    ppte = np.ptp(curves, axis=1)
    levels = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
    values = {
        "ppte": ppte,
        "converged": np.ones(400, bool),
        "nominal_ppte": np.ptp(nominal),
        "mean": ppte.mean(),
        "std": ppte.std(),
        "ppte_quantile95": np.quantile(ppte, 0.95),
        "phase": phase,
        "nominal_transmission_error": nominal,
        "quantiles": levels,
        "transmission_error_quantiles": np.quantile(curves, levels, axis=0),
    }
    return jg.sweeps.Scatter(**{name: jnp.asarray(value) for name, value in values.items()}, numbers={})


def failing(scatter, count):
    """The same scatter with so many failed samples that the outer quantiles have no bound."""
    ppte = np.array(scatter.ppte)
    ppte[:count] = np.nan
    quantiles = np.array(scatter.transmission_error_quantiles)
    quantiles[0], quantiles[-1] = -np.inf, np.inf
    changes = {
        "ppte": jnp.asarray(ppte),
        "converged": jnp.asarray(np.isfinite(ppte)),
        "mean": jnp.asarray(np.nan),
        "ppte_quantile95": jnp.asarray(np.inf),
        "transmission_error_quantiles": jnp.asarray(quantiles),
    }
    kept = {name: getattr(scatter, name) for name in scatter.__dataclass_fields__}
    return jg.sweeps.Scatter(**{**kept, **changes})


@pytest.fixture
def draw(table, scatter):
    """Every picture of one Axes by name, as a function of the Axes to draw into."""
    return {
        "pareto": lambda ax=None: plot.pareto(some(table, PPTE, PRESSURE), ax),
        "pareto of three": lambda ax=None: plot.pareto(some(table, PPTE, LOSS, PRESSURE), ax),
        "parallel": lambda ax=None: plot.parallel_coordinates(table, PPTE, ax),
        "fan": lambda ax=None: plot.fan(scatter, ax),
        "histogram": lambda ax=None: plot.ppte_histogram(scatter, ax),
    }


UNITS = {
    "pareto": ("PPTE [µm]", "max flank pressure [MPa]"),
    "pareto of three": ("PPTE [µm]", "mesh loss factor H_V [-]"),
    "fan": ("mesh phase [base pitches]", "transmission error [µm]"),
    "histogram": ("peak-to-peak transmission error [µm]", "share of the gears [%]"),
}


@pytest.mark.parametrize("name", UNITS)
def test_axes_name_their_units(draw, name):
    ax = draw[name]()
    assert (ax.get_xlabel(), ax.get_ylabel()) == UNITS[name]


@pytest.mark.parametrize("name", [*UNITS, "parallel"])
def test_a_given_ax_is_used_and_legends_cover_no_data(draw, name):
    figure, ax = plt.subplots()
    assert draw[name](ax) is ax and plt.get_fignums() == [figure.number]
    own = draw[name]()
    own.figure.draw_without_rendering()
    legend = own.get_legend().get_window_extent()
    assert legend.y0 >= own.get_window_extent().y1
    assert legend.y1 <= own.figure.bbox.y1 + 1 and legend.x1 <= own.figure.bbox.x1 + 1


@pytest.mark.parametrize(
    ("of", "expected"),
    [
        (PPTE, "PPTE [µm]"),
        (quantities["max_line_load"], "max line load [N/mm]"),
        (quantities["min_tangent_stiffness"], "min tangent stiffness [N/µm]"),
        (quantities["bulk_temperature"], "bulk temperature [°C]"),
        (quantities["removed_volume"], "removed volume [mm³]"),
        (LOSS, "mesh loss factor H_V [-]"),
        (Column(PPTE, torque=50.0, statistic="q95"), "PPTE at 50 N m, q95 over gears [µm]"),
        (Column(PPTE, torque=50.0, speed=1000.0), "PPTE at 50 N m and 1000 rpm [µm]"),
        (Column(PPTE, torque=12.5), "PPTE at 12.5 N m [µm]"),
        (Column(PPTE), "PPTE [µm]"),
        (Column(quantities["corner_force"], statistic="worst"), "corner force worst [N]"),
        (Column(described("relief_length", "mm"), "parameter"), "relief length [mm]"),
        (described("number"), "number [-]"),
        (described("noise", "kN", label="own"), "own [kN]"),
    ],
)
def test_labels_are_those_of_the_quantity_and_its_cases(of, expected):
    assert axis_label(of) == expected


def test_radar_runs_from_the_worst_to_the_best_of_the_variants_shown(table):
    rows = [0, 20, 30]
    panels = plot.radar(some(table, *RESULTS), rows, NAMES)
    assert [panel.get_title() for panel in panels] == list(NAMES)
    shape = {name: np.asarray(panel.lines[-1].get_ydata()) for name, panel in zip(NAMES, panels)}
    radius = np.stack([shape[name][:-1] for name in NAMES])
    np.testing.assert_allclose(radius.max(axis=0), 1.0)
    values = np.stack([table[of][rows] for of in RESULTS], axis=1)
    span = np.ptp(values, axis=0) / np.where([of is RATIO for of in RESULTS], values.max(axis=0), values.min(axis=0))
    # a difference of a few percent is not stretched over the whole chart: the inner ring is a fifth from the best
    np.testing.assert_allclose(radius.min(axis=0), 1 - 0.75 * np.minimum(span / 0.2, 1.0))
    # the unmodified variant has the highest PPTE and loss, the lowest pressure and the largest contact ratio
    np.testing.assert_array_equal(radius[0] == 1.0, [False, False, True, True])
    # in between, in proportion: relief 4.07 um of 0 to 6.10 um decides the loss
    worst = radius[:, 1].min()
    assert radius[1, 1] == pytest.approx(worst + (1 - worst) * 20 / 30)


def test_radar_writes_values_and_units_and_marks_the_best(table):
    noise = {described("noise", "dB"): table[PPTE], **some(table, LOSS, PRESSURE, RATIO)}
    panels = plot.radar(noise, [0, 30], ["a", "b"])
    first, second = ([text for text in panel.texts] for panel in panels)
    assert [text.get_text().replace("\n", " ") for text in first] == [
        "noise 3.38 dB",
        "mesh loss factor H_V 0.160",
        "max flank pressure 730 MPa",
        "effective contact ratio 1.75",
    ]
    assert [text.get_fontweight() for text in first] == ["normal", "normal", "bold", "bold"]
    assert [text.get_fontweight() for text in second] == ["bold", "bold", "normal", "normal"]


def test_radar_labels_stay_apart_and_in_the_figure(table):
    further = {described(f"result_{i}", "N"): np.linspace(i, 9.0, ROWS) for i in range(2)}
    panels = plot.radar({**some(table, *RESULTS), **further}, range(4), list("abcd"))
    figure = panels[0].figure
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for panel in panels for text in (*panel.texts, panel.title)]
    for i, box in enumerate(boxes):
        assert 0 <= box.x0 and box.x1 <= figure.bbox.x1 and 0 <= box.y0 and box.y1 <= figure.bbox.y1
        assert not any(box.overlaps(other) for other in boxes[i + 1 :])


def test_radar_takes_given_axes(table):
    figure, axes = plt.subplots(1, 2, subplot_kw={"projection": "polar"})
    assert plot.radar(some(table, *RESULTS), [0, 30], ["a", "b"], axes) is axes
    assert plt.get_fignums() == [figure.number]


@pytest.mark.parametrize(
    ("columns", "rows", "names", "message"),
    [
        (RESULTS[:2], [0], None, "table has 2 columns, must have at least 3"),
        (RESULTS, [0, 59], None, "PPTE of variant 59 is nan, must be finite"),
        (RESULTS, [0, 1], ["a"], "names has 1 entries, must have one for each of 2 variants"),
    ],
)
def test_radar_refuses_what_it_cannot_show(table, columns, rows, names, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        plot.radar(some(table, *columns), rows, names)


def test_parallel_coordinates_show_the_best_over_a_stated_share(table):
    ax = plot.parallel_coordinates(table, PPTE, shown=25, best=2)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    # the smallest PPTE lies between variants 29 and 30, of relief 5.90 and 6.10 um
    assert {text.split(":")[0] for text in texts[:2]} == {"variant 29", "variant 30"}
    assert texts[2] == "25 of 59 variants, 1 failed"
    assert len(ax.collections[0].get_segments()) == 25
    assert [tick.get_text() for tick in ax.get_xticklabels()][:2] == ["relief\n[µm]", "PPTE\n[µm]"]
    for line in (line for line in ax.lines if line.get_label().startswith("variant")):
        row = int(line.get_label().split(":")[0].split()[1])
        assert line.get_ydata()[0] == pytest.approx(row / 58)  # of the 59 variants that did not fail


def test_parallel_coordinates_follow_the_better_way(table):
    ax = plot.parallel_coordinates(some(table, *RESULTS), RATIO)
    assert ax.get_legend().get_texts()[0].get_text() == "variant 0: effective contact ratio 1.75"


def test_pareto_draws_every_variant_once(table):
    ax = plot.pareto(some(table, PPTE, PRESSURE), marked={"rule": 3})
    cloud, steps, front, rule = ax.lines
    # pressure rises with the relief and PPTE falls up to 6 um: variants 0 to 29 are the front, 30 is beaten by 29
    assert len(front.get_xdata()) == 30 and len(cloud.get_xdata()) == ROWS - 1 - 30
    assert (np.diff(front.get_xdata()) > 0).all() and (np.diff(front.get_ydata()) < 0).all()
    assert rule.get_xdata()[0] == table[PPTE][3] and rule.get_label() == "rule"
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts[:2] == ["59 variants, 1 failed", "Pareto front, 30 variants"]
    assert steps.get_drawstyle() == "steps-post"


def test_pareto_counts_many_variants_in_hexagons():
    random = np.random.default_rng(0)
    table = {PPTE: random.random(20_000), quantities["corner_force"]: random.random(20_000)}
    ax = plot.pareto(table)
    front = pareto_front(np.stack(list(table.values()), axis=1)).sum()
    assert np.sum(ax.collections[0].get_array()) == pytest.approx(20_000 - front)
    assert len(ax.lines[0].get_xdata()) == 0  # no dot per variant


def test_pareto_and_parallel_coordinates_refuse_what_they_cannot_show(table):
    with pytest.raises(ValueError, match="^table has 4 columns, must have two or three"):
        plot.pareto(some(table, *RESULTS))
    with pytest.raises(ValueError, match="colour_by PPTE is not a column of the table"):
        plot.parallel_coordinates(some(table, RELIEF, LOSS), PPTE)
    with pytest.raises(ValueError, match=r"columns must be lists of the same length and not empty, not PPTE \(60,\), "):
        plot.pareto({PPTE: table[PPTE], LOSS: table[LOSS][:3]})


def test_a_variant_has_one_style_in_all_figures(table):
    """Also where the others of a figure are others."""
    numbers = {"unmodified": 0, "variant 29": 1, "variant 30": 3}
    with plot.same_styles(numbers):
        lines = plot.parallel_coordinates(table, PPTE, best=2).lines
        alone = plot.ppte_over_torque([1.0, 2.0], {"unmodified": [1.0, 2.0], "variant 30": [1.0, 2.0]}).lines
        radar = plot.radar(some(table, *RESULTS), [29, 30], ["variant 29", "variant 30"])
    best = {line.get_label().split(":")[0]: line for line in lines if line.get_label().startswith("variant")}
    for name, line in (("variant 30", alone[1]), ("unmodified", alone[0]), *best.items()):
        style = plot.figure.line_style(numbers[name])
        assert line.get_color() == style["color"]
        assert line._unscaled_dash_pattern == plt.Line2D([0], [0], **style)._unscaled_dash_pattern
    assert [panel.title.get_color() for panel in radar] == [plot.figure.line_style(n)["color"] for n in (1, 3)]
    assert plot.figure.style_number("variant 30", 5) == 5  # outside of the block it goes by its place


def test_the_distribution_tells_the_quantile_of_the_scatter(scatter):
    """The same number as the scatter, and none where it lies among failed gears, which stay below no value."""
    ax = plot.ppte_distribution({"good": np.asarray(scatter.ppte), "bad": np.asarray(failing(scatter, 40).ppte)})
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    quantile = float(scatter.joined("ppte", jg.Quantile(0.95)))
    assert texts == [f"good, 95 % below {quantile:.2f} µm", "bad"]
    good, bad = (line.get_ydata()[-1] for line in ax.lines[:2])
    assert good == 100.0 and bad < 95.0


def test_fan_bands_hold_the_quantiles(scatter):
    ax = plot.fan(scatter)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["90 % of the gears", "50 % of the gears", "median", "nominal"]
    quantiles = np.asarray(scatter.transmission_error_quantiles)
    for band, low, high in zip(ax.collections, quantiles[:2], quantiles[:2:-1]):
        heights = band.get_paths()[0].vertices[:, 1]
        assert heights.min() == pytest.approx(low.min()) and heights.max() == pytest.approx(high.max())
    np.testing.assert_array_equal(ax.lines[0].get_ydata()[:16], quantiles[2])
    np.testing.assert_array_equal(ax.lines[1].get_ydata()[16:32], scatter.nominal_transmission_error)


def test_histogram_marks_nominal_mean_and_quantile(scatter):
    ax = plot.ppte_histogram(scatter)
    marks = {line.get_label().rsplit(" ", 2)[0]: line.get_xdata()[0] for line in ax.lines}
    expected = (scatter.nominal_ppte, scatter.mean, scatter.ppte_quantile95)
    assert marks == dict(zip(("nominal", "mean", "95 % quantile"), map(float, expected)))
    assert sum(bar.get_height() for bar in ax.patches) == pytest.approx(100.0)


def test_failed_samples_show(scatter):
    ax = plot.ppte_histogram(failing(scatter, 40))
    assert ax.get_xlabel() == "peak-to-peak transmission error, 40 of 400 failed [µm]"
    assert [line.get_label() for line in ax.lines] == [f"nominal {float(scatter.nominal_ppte):.2f} µm"]
    assert sum(bar.get_height() for bar in ax.patches) == pytest.approx(90.0)
    plot.fan(failing(scatter, 40)).figure.draw_without_rendering()


def brute_force(values):
    return np.array([not ((values <= row).all(axis=1) & (values < row).any(axis=1)).any() for row in values])


@pytest.mark.parametrize("objectives", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("levels", [4, 10_000])
def test_pareto_front_is_what_nothing_beats(objectives, levels):
    random = np.random.default_rng(objectives)
    for rows in (1, 2, 31, 300):
        values = random.integers(0, levels, size=(rows, objectives)).astype(float)
        np.testing.assert_array_equal(pareto_front(values), brute_force(values))


def test_pareto_front_leaves_out_failures_and_keeps_equals():
    values = np.array([[1.0, 2.0], [np.nan, 0.0], [1.0, 2.0], [-np.inf, 5.0], [2.0, 1.0], [2.0, 2.0]])
    assert pareto_front(values).tolist() == [True, False, True, False, True, False]
    assert not pareto_front(np.full((3, 2), np.nan)).any()
    with pytest.raises(ValueError, match="at least 1 objective"):
        pareto_front(np.zeros((3, 0)))


@pytest.mark.parametrize("objectives", [2, 3])
def test_pareto_front_of_a_million_rows(objectives):
    """Comparing every row with every other one would take hours."""
    values = np.random.default_rng(0).random((1_000_000, objectives))
    front = pareto_front(values)
    assert 5 < front.sum() < 300
    # nobody beats the front, and the front beats everybody else: checked on a sample
    some = values[~front][:500]
    best = values[front]
    assert all(((best <= row).all(axis=1) & (best < row).any(axis=1)).any() for row in some)
