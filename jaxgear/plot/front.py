"""Figures of searches: Pareto fronts, many variants over parallel axes, convergence."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike

from ..contact import Mesh
from ..metrics import profile_relief
from ..numerics.pareto import pareto_front
from ..optimize import Front, Iterate, Optimum, Problem
from ..optimize.result import PENALIZED
from ..optimize.verdict import over_cases
from ..sweeps.columns import axis_label, printed_unit
from ..vocabulary import quantities
from .figure import (
    ABOVE_MARKS,
    APART,
    FONT,
    GREY,
    HEIGHT,
    captioned,
    colour_bar,
    grow,
    legend_above,
    line_style,
    mark_path,
    marker_style,
    point_style,
    report_axes,
    style_number,
    styled,
    wrapped,
)
from .mesh_cycle import PATH_LABEL, PHASE_LABEL, two_pitches
from .variants import Of, Table, columns_of, costs, meaning_label, share_text, subsample

ANALYSES_LABEL = "contact analyses spent [-]"
_NARROW = 5.0  # largest over smallest value below which a logarithmic axis has too few round numbers of its own


def _objective_labels(problem: Problem | None) -> list[str]:
    """Labels of the objectives of a problem: "95 % CVaR of peak-to-peak transmission error [µm]".

    Args:
        problem: solved problem; None for the peak-to-peak transmission error of one curve.
    """
    if problem is None:
        return [meaning_label(quantities["ppte"])]
    penalty = "" if problem.roughness is None else PENALIZED
    return [meaning_label(of, over_cases(problem), penalty) for of in problem.objectives]


def best_label(optimum: Optimum) -> str:
    """Label of the objective of a search; for several objectives of the distance from the ideal."""
    labels = _objective_labels(optimum.problem)
    return labels[0] if len(labels) == 1 else "distance from the ideal [-]"


def logarithmic(ax: Axes, which: Literal["x", "y"], values: ArrayLike) -> None:
    """A logarithmic axis, "x" or "y", with round numbers written out."""
    low, high = np.min(values), np.max(values)
    axis = {"x": ax.xaxis, "y": ax.yaxis}[which]
    ax.set(**{f"{which}scale": "log"})
    if high < _NARROW * low:
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    else:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _number(value)))
    axis.set_minor_formatter(NullFormatter())


def _number(value: float) -> str:
    return f"{value:,.0f}".replace(",", "\N{THIN SPACE}") if value >= 1000 else f"{value:g}"


_POINTS = 5000  # more variants than this are counted in hexagons: dots would run into one
_HEXAGONS = 60  # across


@captioned("Results of the variants against each other, with the Pareto front.")
def pareto(table: Table[Of], ax: Axes | None = None, *, marked: Mapping[str, int] | None = None) -> Axes:
    """Pareto front of variants in two results, or in three with the third as colour, and all other variants.

    The other variants are dots, or for large numbers hexagons that count them on a logarithmic grey scale.
    Variants that are not finite in a result are counted as failed and not drawn.

    Args:
        table: values of every variant by what they are, a `Quantity` or a column of a sweep: the results on both axes,
            and a third one for the colour. A front of two is joined by steps.
        ax: Axes to draw into; None for a new figure.
        marked: row numbers of variants to point out, by their name.

    Raises:
        ValueError: for other than two or three results, or no variant with finite values.
    """
    values = columns_of(table, least=2)
    x, y, *third = table
    if len(third) > 1:
        raise ValueError(f"table has {len(table)} columns, must have two or three")
    front = pareto_front(costs(values, table))
    if not front.any():
        raise ValueError("no variant has finite values in all columns")
    others = np.isfinite(values).all(axis=1) & ~front
    total = int(np.sum(others) + np.sum(front))
    with report_axes(ax) as ax:
        _cloud(ax, values[others], share_text(total, total, len(values) - total))
        best = values[front][np.argsort(values[front, 0], kind="stable")]
        if third:
            text = f"Pareto front of all three results, {len(best)} variants"
            _front_dots(ax, best, text, axis_label(third[0]), turned=third[0].better == "larger")
        else:
            # along x, the next variant is better in y: where x is to be small the old y holds until there
            _front_steps(ax, best, f"Pareto front, {len(best)} variants", where="post" if x.sign > 0 else "pre")
        for index, (name, row) in enumerate((marked or {}).items()):
            _front_star(ax, values[row], name, index)
        ax.set(xlabel=axis_label(x), ylabel=axis_label(y))
        legend_above(ax)
    return ax


def _cloud(ax: Axes, others: np.ndarray, text: str) -> None:
    if len(others) <= _POINTS:
        ax.plot(*others[:, :2].T, "o", markersize=2.2, color="#A6A6A6", markeredgewidth=0, label=text)
        return
    faint = ListedColormap(colormaps["Greys"](np.linspace(0.15, 0.6, 256)))
    ax.hexbin(*others[:, :2].T, gridsize=_HEXAGONS, bins="log", cmap=faint, linewidths=0.1, zorder=1)
    ax.plot([], [], "h", markersize=6, color="#A6A6A6", label=f"{text}, darker where there are more")


def _front_steps(ax: Axes, best: np.ndarray, text: str, *, where: Literal["pre", "post"] = "post") -> None:
    """Draw the border of the dominated region as steps between the designs of the front.

    Args:
        ax: Axes to draw into.
        best: front in ascending order of the first column, shape (designs, columns).
        text: label of the front.
        where: "post" if smaller values of the first column are better, "pre" if larger values are better.
    """
    style = line_style(1)
    ax.step(*best[:, :2].T, where=where, color=style["color"], linewidth=1.0)
    ax.plot(*best[:, :2].T, "o", markersize=4, color=style["color"], label=text, zorder=4)


def _front_dots(ax: Axes, best: np.ndarray, text: str, bar_text: str, *, turned: bool = False) -> None:
    """Draw a front of three columns with the third as colour; `turned` is True if its larger values are better."""
    image = ax.scatter(
        *best[:, :2].T,
        c=best[:, 2],
        cmap="cividis_r" if turned else "cividis",
        s=22,
        edgecolors=GREY,
        linewidths=0.4,
        zorder=4,
        label=text,
    )
    colour_bar(image, ax, bar_text, pad=0.03)


def _front_star(ax: Axes, values: np.ndarray, text: str, index: int = 0) -> None:
    """Draw a star at a marked design."""
    style = {"color": line_style(index + 2)["color"], "markeredgecolor": "white"}
    ax.plot(*values[:2], marker="*", markersize=11, linestyle="", label=text, zorder=5, **style)


_STYLES_OF_FRONT = 3  # that front and star take


@captioned("Pareto front: designs of which none is better in every objective.")
def optimum_front(
    front: Front,
    chosen: int | None = None,
    ax: Axes | None = None,
    *,
    others: Mapping[str, ArrayLike] | None = None,
) -> Axes:
    """Pareto front of an optimization in its first two objectives, with a third objective as colour.

    Args:
        front: result of an optimization of several objectives.
        chosen: number of the design that was chosen, a row of `front.values`; None for no mark.
        ax: Axes to draw into; None for a new figure.
        others: values of the objectives of designs that the front is compared with, by their names.

    Raises:
        ValueError: for a number that the front does not have.
    """
    count = len(front.values)
    if chosen is not None and not 0 <= chosen < count:
        raise ValueError(f"chosen is {chosen}, must be a design of the front, 0 to {count - 1}")
    labels = _objective_labels(front.compromise.problem)
    with report_axes(ax) as ax:
        if len(labels) == 2:
            _front_steps(ax, front.values, f"Pareto front, {count} designs")
        else:
            _front_dots(ax, front.values, f"Pareto front, {count} designs", wrapped(labels[2]))
        if chosen is not None:
            units = map(printed_unit, front.units)
            values = [f"{value:.3g} {unit}".strip() for value, unit in zip(front.values[chosen], units)]
            _front_star(ax, front.values[chosen], f"chosen: {', '.join(values)}")
        for index, (name, other) in enumerate((others or {}).items()):
            ax.plot(*np.asarray(other)[:2], zorder=5, label=name, **point_style(index + _STYLES_OF_FRONT))
        ax.set(xlabel=labels[0], ylabel=wrapped(labels[1]))
        legend_above(ax)
    return ax


_LABEL_ROOM = 88  # characters that fit side by side under the axes
_WIDTH = 160.0  # [mm]
_DARK, _LIGHT = 0.0, 0.72  # part of the colour map that shows on white
_MOST_BEST = 5  # variants that stand out


@captioned("Variables and results of the variants, one line per variant.")
def parallel_coordinates(
    table: Table[Of],
    colour_by: Of,
    ax: Axes | None = None,
    *,
    best: int = 3,
    shown: int = 500,
    numbers: Sequence[int] | np.ndarray | None = None,
) -> Axes:
    """Every variant as one line over parallel axes, coloured by one result, with the best ones on top.

    Each axis runs from the smallest to the largest value of all variants. Variants with a value that is not finite are
    counted as failed and not drawn.

    Args:
        table: values of every variant by what they are, a `Quantity` or a column of a sweep: parameters and results
            from left to right, at least two.
        colour_by: column of the colour, which also decides what is best.
        ax: Axes to draw into; None for a new figure.
        best: number of the best variants that are highlighted, with their number in the legend; up to 5.
        shown: largest number of other variants, drawn at random; the figure states their share.
        numbers: numbers of the variants; None for their row numbers.

    Raises:
        ValueError: for less than two columns, a colour that is none of them, or no variant with finite values.
    """
    values = columns_of(table, least=2)
    if colour_by not in table:
        raise ValueError(f"colour_by {colour_by.words} is not a column of the table")
    rows = np.flatnonzero(np.isfinite(values).all(axis=1))
    if rows.size == 0:
        raise ValueError("no variant has finite values in all columns")
    colour = values[:, list(table).index(colour_by)]
    rank = rows[np.argsort(colour_by.sign * colour[rows], kind="stable")]
    cloud = subsample(rank, shown)[::-1]  # the better ones over the worse ones
    low, high = values[rows].min(axis=0), values[rows].max(axis=0)
    heights = (values - low) / np.where(high > low, high - low, 1.0)
    colours = _colours(colour[rows], turned=colour_by.better == "larger")
    with report_axes(ax, width=_WIDTH, height=HEIGHT) as ax:
        across = np.arange(len(table))
        lines = [np.column_stack([across, heights[row]]) for row in cloud]
        opacity = float(np.clip(60 / max(len(cloud), 1), 0.25, 0.8))
        ax.add_collection(LineCollection(lines, colors=colours.to_rgba(colour[cloud]), linewidths=0.6, alpha=opacity))
        for place, row in zip(APART[: min(max(best, 0), _MOST_BEST)], rank):
            name = f"variant {row if numbers is None else numbers[row]}"
            text = f"{name}: {colour_by.words} {colour[row]:.3g} {printed_unit(colour_by.unit)}".rstrip()
            ax.plot(across, heights[row], label=text, **{**line_style(style_number(name, place)), "linewidth": 1.8})
        seen = share_text(len(cloud), rows.size, len(values) - rows.size)
        ax.plot([], [], color=colours.to_rgba(np.median(colour[rows])), linewidth=0.8, label=seen)
        _axes(ax, low, high, list(table))
        colour_bar(colours, ax, axis_label(colour_by), pad=0.03, aspect=30)
        legend_above(ax)
    return ax


def _colours(values: np.ndarray, *, turned: bool) -> ScalarMappable:
    """Blues, dark for the better values and pale for the others: one hue is safe for every kind of colour vision."""
    span = np.linspace(_DARK, _LIGHT, 256)
    colours = ListedColormap(colormaps["Blues_r"](span[::-1] if turned else span))
    return ScalarMappable(Normalize(values.min(), values.max()), colours)


def _axes(ax: Axes, low: np.ndarray, high: np.ndarray, columns: Sequence[Of]) -> None:
    """One vertical axis with its own numbers per column."""
    ax.set(xlim=(-0.15, len(columns) - 0.6), ylim=(-0.03, 1.03), yticks=[])
    ax.grid(False)
    ax.spines[["left", "bottom"]].set_visible(False)
    names = (wrapped(of.words, _LABEL_ROOM // len(columns)) for of in columns)
    units = (f"[{printed_unit(of.unit) or '-'}]" for of in columns)
    ax.set_xticks(range(len(columns)), list(map("\n".join, zip(names, units))))
    ax.tick_params(axis="x", length=0)
    for place, (bottom, top) in enumerate(zip(low, high)):
        ax.axvline(place, color="black", linewidth=0.7, zorder=3)
        if not top > bottom:
            _tick(ax, place, 0.0, f"{bottom:.4g}")
            continue
        ticks = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(bottom, top)
        for tick in ticks[(ticks >= bottom) & (ticks <= top)]:
            _tick(ax, place, (tick - bottom) / (top - bottom), f"{tick:.4g}")


def _tick(ax: Axes, place: int, height: float, text: str) -> None:
    ax.plot([place, place + 0.02], [height, height], color="black", linewidth=0.7, zorder=3)
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6}
    ax.annotate(
        text,
        (place, height),
        xytext=(4, 0),
        textcoords="offset points",
        va="center",
        fontsize=FONT - 2,
        bbox=box,
        zorder=5,
    )


@captioned(
    "Course of the search: best objective over the contact analyses spent. Dotted: as judged on the finer grid on "
    "which the search ends."
)
def convergence(optima: Mapping[str, Optimum], ax: Axes | None = None) -> Axes:
    """Best objective over the contact analyses spent, with a mark at the end of every search.

    If a search ends on a finer mesh, its objectives on that mesh are a separate dotted curve with an open mark. Both
    axes are logarithmic, the ordinate only if all objectives are positive. An objective known before the first analysis
    is drawn at one analysis. The curve begins with the first valid design.

    Args:
        optima: results by the name of their method, of the same objective; up to eight differ in style.
        ax: Axes to draw into; None for a new figure.
    """
    own, drawn = ax is None, []
    with report_axes(ax) as ax:
        for index, name, optimum in styled(optima):
            spent, best, positions = _curve(optimum)
            style = {**line_style(index), "marker": marker_style(index)["marker"], "markersize": 5.0}
            style |= {"drawstyle": "steps-post", "markevery": [-1]}
            searched, judged = positions == positions[:1], positions == positions[-1:]
            ax.plot(spent[searched], best[searched], label=name, **style)
            if not searched.all():
                style |= {"linestyle": ":", "markerfacecolor": "white"}
                label = f"{name}, judged at {positions[-1]} positions"
                ax.plot(spent[judged], best[judged], label=label, **style)
            drawn.append((spent, best))
        spent, best = (np.concatenate([np.empty(0), *(curve[part] for curve in drawn)]) for part in (0, 1))
        if spent.size:
            logarithmic(ax, "x", spent)
            if best.min() > 0:
                logarithmic(ax, "y", best)
        names = {best_label(optimum) for optimum in optima.values()}
        ax.set(xlabel=ANALYSES_LABEL, ylabel=wrapped(names.pop()) if len(names) == 1 else "best objective")
        lines = legend_above(ax)
        if own:
            grow(ax, max(lines - 2, 0))
    return ax


def _curve(optimum: Optimum) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact analyses, finite best objectives and positions of their mesh, up to the end of the search."""
    spent = np.append(np.asarray(optimum.history_evaluations, float), optimum.evaluations)
    best = np.append(np.asarray(optimum.history, float), optimum.objective)
    each = np.full(len(best), optimum.positions)
    if optimum.history_positions is not None:
        each[:-1] = optimum.history_positions
    valid = np.isfinite(best)
    return np.maximum(spent[valid], 1.0), best[valid], each[valid]


_PROFILE_POINTS = 201  # over the active profile
_LABELLED = 8  # states in the legend
_FIRST, _LAST = 0.78, 0.0  # part of the colour map: what comes later is darker


@captioned("Relief after every iteration of the search.")
def iterations_relief(
    mesh: Mesh, optimum: Optimum, gear: Literal["pinion", "wheel"] = "pinion", ax: Axes | None = None
) -> Axes:
    """Material removed [um] by every state of an iteration over the path of contact, in the middle of the face.

    Args:
        mesh: prepared mesh.
        optimum: result of an iteration.
        gear: "pinion" or "wheel".
        ax: Axes to draw into; None for a new figure.

    Raises:
        ValueError: for an optimum without iterations or another gear.
    """
    if gear not in ("pinion", "wheel"):
        raise ValueError(f'gear "{gear}" is not known, must be one of pinion, wheel')
    states = _states(optimum)
    path = _path(mesh, gear)
    with report_axes(ax) as ax:
        for index, state in enumerate(states):
            pinion, wheel = profile_relief(mesh, state.pinion, state.wheel, points=_PROFILE_POINTS)
            removed = np.asarray(pinion if gear == "pinion" else wheel)
            ax.plot(path, removed, label=_label(index, len(states)), **_style(index, len(states)))
        mark_path(ax, mesh.path_of_contact)
        air = 0.05 * float(mesh.path_of_contact.base_pitch)
        ax.set_xlim(path.min() - air, path.max() + air)
        ax.set(xlabel=PATH_LABEL, ylabel=f"material removed from the {gear} [µm]")
        legend_above(ax, distance=ABOVE_MARKS)
    return ax


@captioned("Transmission error after every iteration of the search.")
def iterations_transmission_error(optimum: Optimum, phase: ArrayLike, ax: Axes | None = None) -> Axes:
    """Transmission error [um] of every state of an iteration over two base pitches, with its PPTE in the legend.

    Args:
        optimum: result of an iteration.
        phase: mesh positions of one base pitch, shape (positions,).
        ax: Axes to draw into; None for a new figure.

    Raises:
        ValueError: for an optimum without iterations.
    """
    states = _states(optimum)
    with report_axes(ax) as ax:
        for index, state in enumerate(states):
            label = _label(index, len(states), f"PPTE {float(state.ppte):.2f} µm")
            ax.plot(*two_pitches(phase, state.transmission_error), label=label, **_style(index, len(states)))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error [µm]")
        legend_above(ax)
    return ax


def _states(optimum: Optimum) -> tuple[Iterate, ...]:
    if not optimum.iterations:
        raise ValueError("optimum has no iterations, must be the result of a transmission-error iteration")
    return optimum.iterations


def _path(mesh: Mesh, gear: str) -> np.ndarray:
    """Path positions [mm] of evenly spaced points from the start of the active profile to the tip."""
    contact = mesh.path_of_contact
    start, tip = (contact.start, contact.end) if gear == "pinion" else (contact.end, contact.start)
    return np.linspace(float(start), float(tip), _PROFILE_POINTS)


def _style(index: int, count: int) -> dict[str, Any]:
    """Later states darker, the first one dashed and the last one wide."""
    part = index / max(count - 1, 1)
    colour = ScalarMappable(Normalize(0, 1), "viridis").to_rgba(_FIRST + (_LAST - _FIRST) * part)
    last = index == count - 1
    return {
        "color": colour,
        "linestyle": (0, (4, 1.5)) if index == 0 and not last else "-",
        "linewidth": 2.0 if last else 1.2,
        "zorder": 2 + part,
    }


def _label(index: int, count: int, text: str = "") -> str:
    """Number of the state; if there are many, only some states are numbered."""
    shown = np.unique(np.linspace(0, count - 1, min(count, _LABELLED)).round().astype(int))
    if index not in shown:
        return f"_{index}"  # matplotlib leaves labels with an underscore out of the legend
    role = "start" if index == 0 else "end" if index == count - 1 else ""
    return ": ".join(part for part in (" ".join((str(index), role)).strip(), text) if part)
