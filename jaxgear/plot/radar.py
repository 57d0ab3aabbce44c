"""Radar charts of a few variants in parallel."""

import textwrap
from collections.abc import Collection, Sequence

import numpy as np

from .figure import FONT, GREY, PALE, line_style, report_figure
from .variants import Labels, Table, columns_of, costs, label, parts

_PANEL = (58.0, 60.0)  # width and height of one chart [mm]
_ACROSS = 3  # charts in a row
_INNER = 0.25  # radius of the worst value, of 1 for the best
_LEAST_SPAN = 0.2  # of the best value, from the rim to the inner ring
_LABEL_RADIUS = 1.13
_LINE = 16  # characters of a label
_LINES, _TITLE_PAD = 2, 9.0  # lines on the upper spoke, and the distance of the title that clears them [pt]


def radar(
    table: Table,
    columns: Sequence[str],
    variants: Sequence[int] | None = None,
    names: Sequence[str] | None = None,
    ax: np.ndarray | None = None,
    *,
    note: str = "",
    labels: Labels | None = None,
    maximize: Collection[str] = (),
) -> np.ndarray:
    """One radar chart per variant, each spoke from the worst value of the variants shown, inside, to the best one.

    Where they differ by less than a fifth, the inner ring is a fifth from the best.

    So the larger the area, the better the variant. Its values stand at the spokes, the best ones of all charts in bold;
    the first variant is drawn into every chart for comparison.

    Args:
        table: values by the name of their column.
        columns: results on the spokes, at least three.
        variants: row numbers of the variants; None for all rows, of which a page holds about nine.
        names: of the variants; None for their row numbers.
        ax: one polar Axes per variant; None for a new figure.
        note: what all values have in common, such as "mean over torques"; it stands under the charts.
        labels: labels with units by column; others are derived from the column's name.
        maximize: columns in which large values are the better ones.

    Returns:
        the Axes, one per variant.

    Raises:
        ValueError: for unknown columns, less than three of them, or a value that is not finite.
    """
    values = columns_of("radar", table, columns, least=3)
    rows = np.arange(len(values)) if variants is None else np.asarray(variants, int)
    names = [f"variant {row}" for row in rows] if names is None else names
    values = values[rows]
    _check(values, rows, names, columns)
    radii = _radii(costs(values, columns, maximize))
    texts = _texts(values, [parts(label(name, labels)) for name in columns])
    if ax is not None:
        panels = np.atleast_1d(ax)
        _draw(panels, radii, texts, names)
        return panels
    across = min(len(rows), _ACROSS)
    down = -(-len(rows) // across)
    with report_figure(across * _PANEL[0], down * _PANEL[1]) as figure:
        grid = figure.subplots(down, across, squeeze=False, subplot_kw={"projection": "polar"}).ravel()
        for unused in grid[len(rows) :]:
            unused.remove()
        _draw(grid[: len(rows)], radii, texts, names)
        note = f"{note}\n" if note else ""
        note += f"rim: best of these variants, inner ring: worst, or 20 % from the best; dashed: {names[0]}"
        figure.supxlabel(note, fontsize=FONT - 1, color=GREY)
    return grid[: len(rows)]


def _check(values, rows, names, columns) -> None:
    if len(names) != len(rows) or len(rows) == 0:
        raise ValueError(f"radar: names has {len(names)} entries, must have one for each of {len(rows)} variants")
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, column = bad[0]
        raise ValueError(f"radar: {columns[column]} of {names[row]} is {values[row, column]}, must be finite")


def _radii(cost: np.ndarray) -> np.ndarray:
    """Distance from the centre: 1 for the best of every column, also where all are equal."""
    best, worst = cost.min(axis=0), cost.max(axis=0)
    # small differences are not stretched over the whole chart
    span = np.maximum(worst - best, _LEAST_SPAN * np.abs(best))
    badness = (cost - best) / np.where(span > 0, span, 1.0)
    return 1 - (1 - _INNER) * badness


def _texts(values: np.ndarray, named) -> list[list[str]]:
    """What stands at the spokes of every variant: name, value and unit."""
    largest = np.abs(values).max(axis=0)
    decimals = np.clip(2 - np.floor(np.log10(np.where(largest > 0, largest, 1.0))), 0, 4).astype(int)
    return [
        [
            f"{_wrapped(what)}\n{value:.{digits}f} {unit}".rstrip()
            for value, digits, (what, unit) in zip(row, decimals, named)
        ]
        for row in values
    ]


def _wrapped(what: str) -> str:
    """Long names on several lines."""
    return "\n".join(textwrap.wrap(what, _LINE, break_long_words=False))


def _draw(panels, radii: np.ndarray, texts, names) -> None:
    angles = 2 * np.pi * np.arange(radii.shape[1]) / radii.shape[1]
    above = max(text[0].count("\n") + 1 for text in texts)  # lines on the upper spoke
    pad = _TITLE_PAD + max(above - _LINES, 0) * 1.15 * (FONT - 2)
    for index, (panel, radius) in enumerate(zip(panels, radii)):
        _frame(panel, angles)
        style = line_style(index)
        if index:
            panel.plot(*_closed(angles, radii[0]), color=GREY, linewidth=1.0, linestyle=(0, (3, 2)), zorder=3)
        panel.plot(*_closed(angles, radius), color=style["color"], linewidth=1.6, zorder=4)
        panel.fill(angles, radius, color=style["color"], alpha=0.15, linewidth=0, zorder=2)
        for angle, far, text in zip(angles, radius, texts[index]):
            _spoke_text(panel, angle, text, bold=far == 1.0)
        panel.set_title(names[index], fontsize=FONT, fontweight="bold", color=style["color"], pad=pad)


def _frame(panel, angles) -> None:
    """Spokes, rim and inner ring as straight lines between the spokes."""
    panel.set_theta_zero_location("N")
    panel.set_theta_direction(-1)
    panel.set(rmin=0, rmax=1)
    panel.grid(False)
    panel.set_axis_off()
    for ring in (_INNER, 1.0):
        panel.plot(*_closed(angles, np.full(angles.size, ring)), color="#B0B0B0", linewidth=0.7, zorder=1)
    panel.vlines(angles, 0, 1, color=PALE, linewidth=0.7, zorder=1)


def _closed(angles, radius):
    return np.append(angles, angles[0]), np.append(radius, radius[0])


def _spoke_text(panel, angle: float, text: str, *, bold: bool) -> None:
    side, up = np.sin(angle), np.cos(angle)
    panel.text(
        angle,
        _LABEL_RADIUS if abs(side) > 0.1 else _LABEL_RADIUS - 0.06,
        text,
        ha="center" if abs(side) < 0.1 else ("left" if side > 0 else "right"),
        va="center" if abs(up) < 0.9 else ("bottom" if up > 0 else "top"),
        fontsize=FONT - 2,
        fontweight="bold" if bold else "normal",
        linespacing=1.15,
    )
