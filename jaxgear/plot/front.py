"""Pareto fronts, and many variants over parallel axes."""

import re
import textwrap
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from ..numerics.pareto import pareto_front
from ..optimize import Front
from ..optimize.result import PENALIZED
from ..vocabulary import quantities
from .figure import FONT, GREY, HEIGHT, legend_above, line_style, point_style, report_axes
from .variants import Labels, Table, columns_of, costs, label, parts, share_text, subsample

ANALYSES_LABEL = "contact analyses spent [-]"
_IDEAL = "distance from the ideal"
_MEASURED = re.compile(rf"(?P<measure>(?!{_IDEAL}).+ )?(?P<of>\w+)")
_NARROW = 5.0  # largest over smallest value below which a logarithmic axis has too few round numbers of its own
_LINE = 34  # letters along an axis of report height


def objective_label(name: str, unit: str | None = None) -> str:
    """Label of an objective: "95 % CVaR of peak-to-peak transmission error [µm]" for "95 % CVaR of ppte".

    Args:
        name: of a quantity, after a measure or alone; other names stay as they are.
        unit: of other names, "" if it is unknown.
    """
    if name.startswith(_IDEAL):
        return f"{_IDEAL} [-]"
    bare = name.removesuffix(PENALIZED)
    match = _MEASURED.fullmatch(bare)
    if match and match["of"] in quantities:
        quantity, rest = quantities[match["of"]], name[len(bare) :]
        return f"{match['measure'] or ''}{quantity.meaning}{rest} [{unit_text(quantity.unit) or '-'}]"
    words = name.replace("_", " ")
    return f"{words} [{unit_text(unit)}]" if unit else words


def unit_text(unit: str) -> str:
    """A unit in print."""
    return unit.replace("um", "µm").replace("mm3", "mm³")


def wrapped(text: str) -> str:
    """A long label on several lines of at most about the height of a figure, its unit with the last word."""
    bound = text.replace(" [", "\N{NO-BREAK SPACE}[")
    return textwrap.fill(bound, _LINE, break_long_words=False, break_on_hyphens=False)


def logarithmic(ax: Axes, which: str, values) -> None:
    """A logarithmic axis, "x" or "y", with round numbers written out."""
    values = np.asarray(values, float)
    low, high = values.min(), values.max()
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


def pareto(
    table: Table,
    x: str,
    y: str,
    colour: str | None = None,
    ax: Axes | None = None,
    *,
    labels: Labels | None = None,
    maximize: Collection[str] = (),
    marked: Mapping[str, int] | None = None,
) -> Axes:
    """Variants that no other one beats in two results, or in three with the third as colour, over all the others.

    All others are a faint cloud: dots, or hexagons that count them on a logarithmic grey scale when there are many.
    Variants that are not finite in a result are counted as failed and not drawn.

    Args:
        table: values by the name of their column.
        x, y: results on the axes.
        colour: third result; None for a front of two, which is then joined by steps.
        ax: Axes to draw into; None for a new figure.
        labels: labels with units by column; others are derived from the column's name.
        maximize: columns in which large values are the better ones.
        marked: row numbers of variants to point out, by their name.

    Raises:
        ValueError: for unknown columns or no variant with finite values.
    """
    names = [x, y] if colour is None else [x, y, colour]
    values = columns_of("pareto", table, names)
    front = pareto_front(costs(values, names, maximize))
    if not front.any():
        raise ValueError("pareto: no variant has finite values in all columns")
    others = np.isfinite(values).all(axis=1) & ~front
    total = int(np.sum(others) + np.sum(front))
    with report_axes(ax) as ax:
        _cloud(ax, values[others], share_text(total, total, len(values) - total))
        best = values[front][np.argsort(values[front, 0], kind="stable")]
        if colour is None:
            # along x, the next variant is better in y: where x is to be small the old y holds until there
            where = "pre" if x in maximize else "post"
            front_steps(ax, best, f"Pareto front, {len(best)} variants", where=where)
        else:
            text = f"Pareto front of all three results, {len(best)} variants"
            front_dots(ax, best, text, label(colour, labels), turned=colour in maximize)
        for index, (name, row) in enumerate((marked or {}).items()):
            front_star(ax, values[row], name, index)
        ax.set(xlabel=label(x, labels), ylabel=label(y, labels))
        legend_above(ax)
    return ax


def _cloud(ax: Axes, others: np.ndarray, text: str) -> None:
    if len(others) <= _POINTS:
        ax.plot(*others[:, :2].T, "o", markersize=2.2, color="#A6A6A6", markeredgewidth=0, label=text)
        return
    faint = ListedColormap(colormaps["Greys"](np.linspace(0.15, 0.6, 256)))
    ax.hexbin(*others[:, :2].T, gridsize=_HEXAGONS, bins="log", cmap=faint, linewidths=0.1, zorder=1)
    ax.plot([], [], "h", markersize=6, color="#A6A6A6", label=f"{text}, darker where there are more")


def front_steps(ax: Axes, best: np.ndarray, text: str, *, where: str = "post") -> None:
    """The border of what is beaten: from every design of the front straight on to where the next one takes over.

    Args:
        ax: Axes to draw into.
        best: the front, ascending in the first column.
        text: its label.
        where: "post" where the first column is to be small, "pre" where it is to be large.
    """
    style = line_style(1)
    ax.step(*best[:, :2].T, where=where, color=style["color"], linewidth=1.0)
    ax.plot(*best[:, :2].T, "o", markersize=4, color=style["color"], label=text, zorder=4)


def front_dots(ax: Axes, best: np.ndarray, text: str, bar_text: str, *, turned: bool = False) -> None:
    """A front of three with the third column as colour; `turned` where large values are the better ones."""
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
    bar = ax.figure.colorbar(image, ax=ax, pad=0.03)
    bar.set_label(bar_text)
    bar.ax.tick_params(labelsize=ax.xaxis.label.get_fontsize())


def front_star(ax: Axes, values: np.ndarray, text: str, index: int = 0) -> None:
    """A star at a design that is pointed out."""
    style = {"color": line_style(index + 2)["color"], "markeredgecolor": "white"}
    ax.plot(*values[:2], marker="*", markersize=11, linestyle="", label=text, zorder=5, **style)


_STYLES_OF_FRONT = 3  # that front and star take


def optimum_front(
    front: Front,
    chosen: int | None = None,
    ax: Axes | None = None,
    *,
    others: Mapping[str, np.ndarray] | None = None,
) -> Axes:
    """Designs of which none is better in both objectives; of more objectives the first two, with the third as colour.

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
        raise ValueError(f"optimum_front: chosen is {chosen}, must be a design of the front, 0 to {count - 1}")
    labels = [objective_label(name, unit) for name, unit in zip(front.objectives, front.units)]
    with report_axes(ax) as ax:
        if len(labels) == 2:
            front_steps(ax, front.values, f"Pareto front, {count} designs")
        else:
            front_dots(ax, front.values, f"Pareto front, {count} designs", wrapped(labels[2]))
        if chosen is not None:
            values = [
                f"{value:.3g} {unit_text(unit)}".strip() for value, unit in zip(front.values[chosen], front.units)
            ]
            front_star(ax, front.values[chosen], f"chosen: {', '.join(values)}")
        for index, (name, other) in enumerate((others or {}).items()):
            ax.plot(*other[:2], zorder=5, label=name, **point_style(index + _STYLES_OF_FRONT))
        ax.set(xlabel=labels[0], ylabel=wrapped(labels[1]))
        legend_above(ax)
    return ax


_LABEL_ROOM = 88  # characters that fit side by side under the axes
_WIDTH = 160.0  # [mm]
_DARK, _LIGHT = 0.0, 0.72  # part of the colour map that shows on white
_BEST_STYLES = (1, 3, 0, 5, 4)  # line styles that stand apart from the blues of the cloud


def parallel_coordinates(
    table: Table,
    columns: Sequence[str],
    colour_by: str,
    ax: Axes | None = None,
    *,
    best: int = 3,
    shown: int = 500,
    numbers: Sequence[int] | np.ndarray | None = None,
    labels: Labels | None = None,
    maximize: Collection[str] = (),
) -> Axes:
    """Every variant as one line over parallel axes, coloured by one result, with the best ones on top.

    Each axis runs from the smallest to the largest value of all variants. Variants with a value that is not finite are
    counted as failed and not drawn.

    Args:
        table: values by the name of their column.
        columns: parameters and results from left to right, at least two.
        colour_by: column of the colour, which also decides what is best.
        ax: Axes to draw into; None for a new figure.
        best: how many of the best variants stand out, with their number in the legend; up to 5.
        shown: how many of the others to draw at most, at random; the picture says how many of how many.
        numbers: of the variants; None for their row numbers.
        labels: labels with units by column; others are derived from the column's name.
        maximize: columns in which large values are the better ones; only that of `colour_by` counts.

    Raises:
        ValueError: for unknown columns, less than two of them, or no variant with finite values.
    """
    values = columns_of("parallel_coordinates", table, [*columns, colour_by], least=3)
    rows = np.flatnonzero(np.isfinite(values).all(axis=1))
    if rows.size == 0:
        raise ValueError("parallel_coordinates: no variant has finite values in all columns")
    values, colour = values[:, :-1], values[:, -1]
    rank = rows[np.argsort(costs(colour[rows, None], [colour_by], maximize)[:, 0], kind="stable")]
    cloud = subsample(rank, shown)[::-1]  # the better ones over the worse ones
    low, high = values[rows].min(axis=0), values[rows].max(axis=0)
    heights = (values - low) / np.where(high > low, high - low, 1.0)
    colours = _colours(colour[rows], turned=colour_by in maximize)
    with report_axes(ax, width=_WIDTH, height=HEIGHT) as ax:
        across = np.arange(len(columns))
        lines = [np.column_stack([across, heights[row]]) for row in cloud]
        opacity = float(np.clip(60 / max(len(cloud), 1), 0.25, 0.8))
        ax.add_collection(LineCollection(lines, colors=colours.to_rgba(colour[cloud]), linewidths=0.6, alpha=opacity))
        what, unit = parts(label(colour_by, labels))
        for style, row in zip(_BEST_STYLES[: max(best, 0)], rank):
            text = f"variant {row if numbers is None else numbers[row]}: {what} {colour[row]:.3g} {unit}".rstrip()
            ax.plot(across, heights[row], label=text, **{**line_style(style), "linewidth": 1.8})
        seen = share_text(len(cloud), rows.size, len(values) - rows.size)
        ax.plot([], [], color=colours.to_rgba(np.median(colour[rows])), linewidth=0.8, label=seen)
        _axes(ax, low, high, [label(name, labels) for name in columns])
        bar = ax.figure.colorbar(colours, ax=ax, pad=0.03, aspect=30)
        bar.set_label(label(colour_by, labels))
        bar.ax.tick_params(labelsize=ax.xaxis.label.get_fontsize())
        legend_above(ax)
    return ax


def _colours(values: np.ndarray, *, turned: bool) -> ScalarMappable:
    """Blues, dark for the better values and pale for the others: one hue is safe for every kind of colour vision."""
    span = np.linspace(_DARK, _LIGHT, 256)
    colours = ListedColormap(colormaps["Blues_r"](span[::-1] if turned else span))
    return ScalarMappable(Normalize(values.min(), values.max()), colours)


def _axes(ax: Axes, low: np.ndarray, high: np.ndarray, names: Sequence[str]) -> None:
    """One vertical axis with its own numbers per column."""
    ax.set(xlim=(-0.15, len(names) - 0.6), ylim=(-0.03, 1.03), yticks=[])
    ax.grid(False)
    ax.spines[["left", "bottom"]].set_visible(False)
    ax.set_xticks(range(len(names)), [_wrapped(name, _LABEL_ROOM // len(names)) for name in names])
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


def _wrapped(name: str, room: int) -> str:
    """Name over unit, the name in lines of at most `room` characters where its words allow it."""
    what, _, unit = name.rpartition(" [")
    lines = textwrap.wrap(what or name, max(room, 1), break_long_words=False)
    return "\n".join([*lines, f"[{unit}"] if what else lines)
