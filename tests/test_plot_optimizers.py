"""Pictures of optimizations show what the results hold, name their units and draw nothing that is not finite."""

from dataclasses import fields, replace
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from catalogue import LINE, gear_pair, prepare

import jaxgear as jg
from benchmarks.optimization.figure import optimizer_comparison
from jaxgear import plot
from jaxgear.optimize import Front, Iterate, Optimum
from jaxgear.plot.figure import point_style
from jaxgear.plot.front import best_label
from jaxgear.sweeps.columns import described
from jaxgear.vocabulary import quantity_of

pytestmark = pytest.mark.usefixtures("clean_figures")

PHASE = np.arange(16) / 16
TORQUES = np.linspace(20.0, 400.0, 20)
AMOUNTS = (0.0, 5.0, 8.0, 9.0)
METHODS = ("slp", "adam", "lbfgs", "genetic", "cma_es", "differential evolution", "factorial", "iteration")


def optimum(method="slp", history=(np.inf, 3.0, 1.0), spent=(0, 10, 100), **others):
    """An optimum without a contact solution behind it."""
    given = {
        "method": method,
        "objective_name": "ppte",
        "parameters": {},
        "pinion": jg.NoModification(),
        "wheel": jg.NoModification(),
        "mesh": None,
        "cycle": None,
        "ppte": 1.0,
        "objective": history[-1],
        "objective_unit": "um",
        "positions": 64,
        "grid_change": 0.0,
        "optimality": 0.0,
        "active_bounds": {},
        "constraints": {},
        "violation": 0.0,
        "evaluations": spent[-1] + 3,
        "history": np.array(history),
        "history_evaluations": np.array(spent),
        "seconds": 1.0,
    }
    return Optimum(**{**given, **others})


def problem(*objectives, measure=None, penalty=None):
    """What a problem says of its objectives, of a single case without a measure."""
    cases = SimpleNamespace(count=1 if measure is None else 2)
    of = tuple(quantity_of(one) for one in objectives)
    return SimpleNamespace(objectives=of, measure=measure, cases=cases, roughness=penalty)


def wave(amplitude):
    return 20.0 + amplitude * np.sin(2 * np.pi * PHASE)


def state(amount):
    ppte = 3.0 - 0.3 * amount
    relief = jg.TipRelief(amount, 4.0) if amount else jg.NoModification()
    drawn = {"pinion": relief, "wheel": jg.NoModification(), "transmission_error": wave(ppte / 2), "ppte": ppte}
    return Iterate(**{**{field.name: 0.0 for field in fields(Iterate)}, **drawn})


@pytest.fixture(scope="module")
def mesh():
    return prepare(gear_pair(), resolution=LINE)


@pytest.fixture(scope="module")
def iterated():
    return optimum("iteration", iterations=tuple(state(amount) for amount in AMOUNTS))


@pytest.fixture
def optima():
    return {
        method: optimum(method, (np.inf, 3.5, 1.0 + 0.1 * index), (0, 20 + index, 500 * (index + 1)))
        for index, method in enumerate(METHODS)
    }


@pytest.fixture
def front():
    ppte = np.linspace(0.6, 3.0, 12)
    values = np.stack([ppte, 900 - 80 * ppte], axis=1)
    parameters = {"amount": np.linspace(9, 1, 12)}
    names = "ppte", "max_flank_pressure"
    compromise = optimum(problem=problem(*names))
    return Front(names, ("um", "MPa"), values, parameters, np.zeros(12), compromise, 5)


@pytest.fixture
def rows():
    return [
        {
            "method": method,
            "pair": pair,
            "evaluations": 30 * (index + 1) ** 3,
            "ppte_um": 0.5 + 0.1 * index + shift,
            "worst_over_torque_um": 2.0,
            "quantile95_um": 3.0,
        }
        for pair, shift in (("19/48", 0.0), ("30/30", 0.4), ("50/50", 0.8))
        for index, method in enumerate(METHODS)
    ]


def surface():
    return TORQUES[:, None] * wave(0.5) / 200


@pytest.fixture
def draw(mesh, iterated, optima, front, rows):
    """Every picture by name, as a function of the Axes to draw into."""
    one = [row for row in rows if row["pair"] == "19/48"]
    return {
        "convergence": lambda ax=None: plot.convergence(optima, ax),
        "relief": lambda ax=None: plot.iterations_relief(mesh, iterated, ax=ax),
        "transmission error": lambda ax=None: plot.iterations_transmission_error(iterated, PHASE, ax),
        "surface": lambda ax=None: plot.response_surface(PHASE, TORQUES, surface(), wave(1.0) - 20, ax),
        "front": lambda ax=None: plot.optimum_front(front, 3, ax),
        "comparison": lambda ax=None: optimizer_comparison(one, ax=ax),
    }


LABELS = {
    "convergence": ("contact analyses spent [-]", "peak-to-peak transmission error [µm]"),
    "relief": ("path of contact from the pitch point [mm]", "material removed from the pinion [µm]"),
    "transmission error": ("mesh phase [base pitches]", "transmission error [µm]"),
    "surface": ("mesh phase [base pitches]", "pinion torque [N m]"),
    "front": ("peak-to-peak transmission error [µm]", "largest Hertzian flank pressure [MPa]"),
    "comparison": ("contact analyses spent [-]", "peak-to-peak transmission error [µm]"),
}


def plain(text):
    return " ".join(text.split())


@pytest.mark.parametrize("name", LABELS)
def test_axes_name_their_units(draw, name):
    ax = np.atleast_1d(draw[name]())[0]
    assert (plain(ax.get_xlabel()), plain(ax.get_ylabel())) == LABELS[name]


@pytest.mark.parametrize("name", LABELS)
def test_a_given_ax_is_used_and_its_figure_gains_no_other(draw, name):
    figure, ax = plt.subplots()
    assert np.atleast_1d(draw[name](ax))[0] is ax
    assert plt.get_fignums() == [figure.number]


@pytest.mark.parametrize("name", ["convergence", "relief", "transmission error", "front", "comparison"])
def test_legends_cover_no_data(draw, name):
    ax = np.atleast_1d(draw[name]())[0]
    figure = ax.figure
    figure.draw_without_rendering()
    legend = (ax.get_legend() or figure.legends[0]).get_window_extent()
    above = [ax.get_window_extent().y1, *(text.get_window_extent().y1 - 1 for text in ax.texts)]
    assert legend.y0 >= max(above)
    assert legend.x0 >= 0 and legend.y1 <= figure.bbox.y1 + 1 and legend.x1 <= figure.bbox.x1 + 1


@pytest.mark.parametrize(
    ("names", "measure", "penalty", "expected"),
    [
        (["ppte"], None, None, "peak-to-peak transmission error [µm]"),
        (["ppte"], jg.CVaR(0.95), None, "95 % CVaR of peak-to-peak transmission error [µm]"),
        (["ppte"], None, 1.0, "peak-to-peak transmission error with curvature penalty [µm]"),
        (["max_flank_pressure"], jg.Worst(), None, "worst largest Hertzian flank pressure [MPa]"),
        (["mesh_loss_factor"], None, None, "loss power per input power and coefficient of friction [-]"),
        (["removed_volume"], None, None, "material ground off all flanks [mm³]"),
        (["ppte", "removed_volume"], None, None, "distance from the ideal [-]"),
        ([described("my_cost")], None, None, "my cost [-]"),
        ([described("my_cost", "um")], None, None, "my cost [µm]"),
    ],
)
def test_objectives_in_words(names, measure, penalty, expected):
    assert best_label(optimum(problem=problem(*names, measure=measure, penalty=penalty))) == expected


def test_sixteen_points_differ():
    styles = [point_style(index) for index in range(16)]
    assert len({(style["color"], style["marker"], style["markerfacecolor"]) for style in styles}) == 16


def test_convergence_steps_through_the_history_to_the_end(optima):
    ax = plot.convergence(optima)
    assert [line.get_label() for line in ax.lines] == list(METHODS)
    for line, found in zip(ax.lines, optima.values()):
        spent, best = line.get_data()
        # the first entry, inf before any analysis, is not drawn; the last analyses are those of the gradient at the end
        np.testing.assert_array_equal(spent, [*found.history_evaluations[1:], found.evaluations])
        np.testing.assert_array_equal(best, [*found.history[1:], found.objective])
        assert line.get_drawstyle() == "steps-post" and line.get_markevery() == [-1]
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")


def test_what_is_judged_on_a_finer_mesh_is_no_rise_of_the_search():
    found = optimum(
        history=(3.0, 1.0, 1.4, 1.2, 1.3),
        spent=(1, 8, 9, 20, 30),
        positions=256,
        history_positions=[64, 64, 128, 128, 256],
    )
    search, judged = plot.convergence({"slp": found}).lines
    assert search.get_label() == "slp" and judged.get_label() == "slp, judged at 256 positions"
    np.testing.assert_array_equal(search.get_ydata(), [3.0, 1.0])
    np.testing.assert_array_equal(judged.get_data(), [[30, 33], [1.3, 1.3]])
    assert search.get_color() == judged.get_color() and judged.get_markerfacecolor() == "white"


def test_convergence_from_zero_analyses_and_without_any_valid_design():
    start = optimum(history=(4.0, 2.0), spent=(0, 8))
    never = optimum(history=(np.inf, np.inf), spent=(0, 8))
    ax = plot.convergence({"start": start, "never": never})
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), [1.0, 8.0, 11.0])
    assert ax.lines[1].get_xdata().size == 0
    alone = plot.convergence({"never": never})
    alone.figure.draw_without_rendering()
    assert plot.convergence({}).get_ylabel() == "best objective"


def test_convergence_of_negative_and_of_different_objectives():
    negative = optimum(history=(2.0, -1.0), spent=(1, 8), problem=problem(described("cost")))
    ax = plot.convergence({"negative": negative, "other": optimum()})
    assert (ax.get_yscale(), ax.get_ylabel()) == ("linear", "best objective")


@pytest.mark.parametrize("values", [(0.62, 0.7), (0.3, 9.0), (0.002, 300.0)])
def test_logarithmic_axes_have_round_numbers(values):
    ax = plot.convergence({"a": optimum(history=values[::-1], spent=(3, 20_000))})
    ax.figure.draw_without_rendering()
    low, high = ax.get_ylim()
    texts = [text.get_text() for text in ax.get_yticklabels() if low <= text.get_position()[1] <= high]
    assert len(texts) >= 3 and all("$" not in text for text in texts)
    assert [text.get_text() for text in ax.get_yticklabels(minor=True) if text.get_text()] == []


def test_relief_of_every_state_over_the_path(mesh, iterated):
    contact = mesh.path_of_contact
    on_pinion = plot.iterations_relief(mesh, iterated)
    for line, amount in zip(on_pinion.lines, AMOUNTS):
        path, removed = line.get_data()
        assert path[[0, -1]] == pytest.approx([float(contact.start), float(contact.end)])
        assert removed[-1] == pytest.approx(amount)
        relieved = path > float(contact.end) - 4.0
        assert (removed[~relieved] == 0).all()
    legend = [text.get_text() for text in on_pinion.get_legend().get_texts()]
    assert legend == ["0 start", "1", "2", "3 end"]
    on_wheel = plot.iterations_relief(mesh, iterated, "wheel")
    assert on_wheel.get_ylabel() == "material removed from the wheel [µm]"
    path, removed = on_wheel.lines[0].get_data()
    assert path[-1] == pytest.approx(float(contact.start)) and (removed == 0).all()


def test_transmission_error_of_every_state(iterated):
    ax = plot.iterations_transmission_error(iterated, PHASE)
    for line, found in zip(ax.lines, iterated.iterations):
        curve = found.transmission_error
        np.testing.assert_array_equal(line.get_ydata(), [*curve, *curve, curve[0]])
        assert f"PPTE {found.ppte:.2f} µm" in line.get_label()


def test_many_states_share_a_short_legend():
    many = optimum(iterations=tuple(state(amount) for amount in np.linspace(0, 9, 40)))
    ax = plot.iterations_transmission_error(many, PHASE)
    texts = [text.get_text().split(":")[0] for text in ax.get_legend().get_texts()]
    assert len(ax.lines) == 40 and len(texts) == 8
    assert (texts[0], texts[-1]) == ("0 start", "39 end")


def test_pictures_of_iterations_need_iterations(mesh, iterated):
    with pytest.raises(ValueError, match="^optimum has no iterations"):
        plot.iterations_relief(mesh, optimum())
    with pytest.raises(ValueError, match="^optimum has no iterations"):
        plot.iterations_transmission_error(optimum(), PHASE)
    with pytest.raises(ValueError, match='^gear "rack" is not known'):
        plot.iterations_relief(mesh, iterated, "rack")


def test_surface_holds_the_unloaded_curve_at_its_foot(monkeypatch):
    drawn = {}
    contourf = plt.Axes.contourf

    def recorded(self, x, y, z, *args, **kwargs):
        drawn.update(x=x, y=y, z=z)
        return contourf(self, x, y, z, *args, **kwargs)

    monkeypatch.setattr(plt.Axes, "contourf", recorded)
    order = np.random.default_rng(0).permutation(TORQUES.size)
    unloaded = wave(1.0) - 20
    ax = plot.response_surface(PHASE, TORQUES[order], surface()[order], unloaded, design_torque=200.0)
    np.testing.assert_array_equal(drawn["y"], [0.0, *TORQUES])
    np.testing.assert_array_equal(drawn["z"][0, :16], unloaded)
    np.testing.assert_array_equal(drawn["z"][1:, 16:32], surface())
    assert ax.get_ylim() == (0.0, 400.0) and ax.get_xlim() == (0.0, 2.0)
    assert ax.lines[0].get_ydata()[0] == 200.0
    assert ax.figure.axes[1].get_ylabel() == "transmission error [µm]"
    assert len(ax.texts) >= 5 and all(float(text.get_text()) == round(float(text.get_text()), 1) for text in ax.texts)
    # a row of no torque that was computed gives way to the unloaded curve
    plot.response_surface(PHASE, [0.0, *TORQUES], np.concatenate([surface()[:1], surface()]), unloaded)
    assert drawn["z"].shape[0] == TORQUES.size + 1


def test_front_is_drawn_as_it_is_and_the_chosen_design_marked(front):
    ax = plot.optimum_front(front, chosen=3)
    steps, dots, star = ax.lines
    np.testing.assert_array_equal(np.stack(dots.get_data(), axis=1), front.values)
    assert steps.get_drawstyle() == "steps-post"
    assert [*star.get_xdata(), *star.get_ydata()] == pytest.approx(list(front.values[3]))
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["Pareto front, 12 designs", "chosen: 1.25 µm, 800 MPa"]
    assert len(plot.optimum_front(front).lines) == 2
    beside = {"unmodified": np.asarray([8.0, 900.0]), "rule-based": np.asarray([2.0, 850.0])}
    drawn = plot.optimum_front(front, chosen=3, others=beside).lines[3:]
    assert {line.get_label(): [*line.get_xdata(), *line.get_ydata()] for line in drawn} == {
        name: [*point] for name, point in beside.items()
    }
    assert len({line.get_marker() for line in (star, *drawn)}) == 3
    with pytest.raises(ValueError, match="^chosen is 12, must be a design of the front, 0 to 11"):
        plot.optimum_front(front, chosen=12)


def test_front_of_three_shows_the_third_as_colour(front):
    third = np.linspace(40.0, 2.0, 12)
    names, units = (*front.objectives, "removed_volume"), (*front.units, "mm3")
    compromise = optimum(problem=problem(*names))
    three = replace(front, objectives=names, units=units, values=np.c_[front.values, third], compromise=compromise)
    ax = plot.optimum_front(three)
    np.testing.assert_array_equal(ax.collections[0].get_array(), third)
    assert plain(ax.figure.axes[1].get_ylabel()) == "material ground off all flanks [mm³]"


def test_comparison_has_a_panel_per_pair_on_common_scales(rows):
    panels = optimizer_comparison(rows)
    assert [panel.get_title() for panel in panels] == ["19/48", "30/30", "50/50"]
    assert len({(panel.get_xlim(), panel.get_ylim(), panel.get_xscale()) for panel in panels}) == 1
    for panel in panels:
        expected = [row for row in rows if row["pair"] == panel.get_title()]
        assert [line.get_label() for line in panel.lines] == [row["method"] for row in expected]
        drawn = [(line.get_xdata()[0], line.get_ydata()[0]) for line in panel.lines]
        assert drawn == [(row["evaluations"], row["ppte_um"]) for row in expected]
    legend = panels[0].figure.legends[0]
    assert [text.get_text() for text in legend.get_texts()] == list(METHODS)


def test_comparison_of_several_runs_failures_and_methods_on_one_pair_only():
    def row(method, pair, evaluations, ppte):
        return {"method": method, "pair": pair, "evaluations": evaluations, "ppte_um": ppte}

    rows = [row("a", "P", 0, 1.0), row("a", "P", 9, 0.01), row("a", "Q", 9, np.nan), row("b", "Q", 9, 2.0)]
    first, second = optimizer_comparison(rows)
    np.testing.assert_array_equal(first.lines[0].get_xdata(), [1.0, 9.0])
    assert [line.get_xdata().size for line in (*first.lines, *second.lines)] == [2, 0, 0, 1]
    assert first.get_yscale() == second.get_yscale() == "log"
    optimizer_comparison([row("a", "P", 1, np.inf)])[0].figure.draw_without_rendering()


def test_comparison_shows_other_quantities_and_refuses_unknown_ones(rows):
    panels = optimizer_comparison(rows, "worst_over_torque_um")
    assert plain(panels[0].get_ylabel()) == "worst peak-to-peak transmission error over torque [µm]"
    assert panels[0].lines[0].get_ydata()[0] == 2.0
    with pytest.raises(ValueError, match='^optimizer_comparison: "cost" is not known'):
        optimizer_comparison(rows, "cost")
    with pytest.raises(ValueError, match="^optimizer_comparison: ax has 2 Axes, must have one for each of 3 pairs"):
        optimizer_comparison(rows, ax=plt.subplots(1, 2)[1])
    with pytest.raises(ValueError, match="^optimizer_comparison: rows is empty"):
        optimizer_comparison([])
