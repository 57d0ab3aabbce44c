"""Pareto front of two or three results."""

from collections.abc import Collection, Mapping

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from ..numerics.pareto import pareto_front
from .figure import GREY, legend_above, line_style, report_axes
from .variants import Labels, Table, columns_of, costs, label, share_text

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
