"""Many variants over parallel axes."""

import textwrap
from collections.abc import Collection, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.ticker import MaxNLocator

from .figure import FONT, HEIGHT, legend_above, line_style, report_axes
from .variants import Labels, Table, columns_of, costs, label, parts, share_text, subsample

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
            _number(ax, place, 0.0, f"{bottom:.4g}")
            continue
        ticks = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(bottom, top)
        for tick in ticks[(ticks >= bottom) & (ticks <= top)]:
            _number(ax, place, (tick - bottom) / (top - bottom), f"{tick:.4g}")


def _number(ax: Axes, place: int, height: float, text: str) -> None:
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
