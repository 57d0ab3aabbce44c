"""Many variants and torques: tables read as pictures, response surfaces, scatter over manufactured gears."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

import numpy as np
import scipy  # its packages load when they are used
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from ..conditions import ranked
from ..metrics import Quantity
from ..numerics import Quantile, real
from ..sweeps import Scatter
from ..sweeps.columns import Column, printed_unit
from ..vocabulary import quantity_of
from .figure import (
    ABOVE,
    ABOVE_MARKS,
    FONT,
    GREY,
    PALE,
    Panels,
    captioned,
    colour_bar,
    laid_out_size,
    legend_above,
    line_style,
    marker_style,
    report_axes,
    report_figure,
    style_number,
    styled,
    text_above,
    wrapped,
)
from .mesh_cycle import PHASE_LABEL, two_pitches

Of = TypeVar("Of", bound=Quantity | Column)
Table = Mapping[Of, ArrayLike]  # of every variant, by what the number is; `SweepTable.values` gives one


def columns_of(table: Table[Of], *, least: int = 1) -> np.ndarray:
    """Columns of a table side by side as floats, shape (variants, columns).

    Raises:
        ValueError: for columns of different lengths or too few of them.
    """
    if len(table) < least:
        raise ValueError(f"table has {len(table)} columns, must have at least {least}")
    columns = [np.asarray(values, float) for values in table.values()]
    if len({column.shape for column in columns}) > 1 or columns[0].ndim != 1 or columns[0].size == 0:
        shapes = ", ".join(f"{of.words} {column.shape}" for of, column in zip(table, columns))
        raise ValueError(f"columns must be lists of the same length and not empty, not {shapes}")
    return np.stack(columns, axis=1)


def costs(values: np.ndarray, columns: Iterable[Of]) -> np.ndarray:
    """Values with the sign of every column changed so that smaller is better, shape (variants, columns)."""
    return values * np.array([float(of.sign) for of in columns])


def meaning_label(of: Quantity, before: str = "", after: str = "") -> str:
    """Axis label: meaning of a quantity between further words, with its printed unit."""
    return f"{before}{of.meaning or of.words}{after} [{printed_unit(of.unit) or '-'}]"


def subsample(rows: np.ndarray, count: int) -> np.ndarray:
    """Reproducible random sample of at most `count` rows without replacement, in ascending order."""
    if rows.size <= count:
        return rows
    return np.sort(np.random.default_rng(0).choice(rows, count, replace=False))


def share_text(shown: int, total: int, failed: int = 0) -> str:
    """Text with the numbers of shown, total and failed variants."""
    text = f"{total:,} variants" if shown >= total else f"{shown:,} of {total:,} variants"
    return text.replace(",", "\u2009") + (f", {failed} failed" if failed else "")


_LEVELS = 11
_EDGE = 0.04  # part of the Axes along its edges that is too close for a label


@captioned("Transmission error over phase and torque.")
def response_surface(
    phase: ArrayLike,
    torques: ArrayLike,
    te: ArrayLike,
    unloaded: ArrayLike,
    ax: Axes | None = None,
    *,
    design_torque: float | None = None,
    design: str | None = None,
) -> Axes:
    """Transmission error [um] as a surface over mesh phase and torque, with the unloaded one at its foot.

    Args:
        phase: mesh positions of one base pitch, shape (positions,).
        torques: torques on the pinion [N m], such as up to twice the design torque; shape (torques,).
        te: transmission error [um], shape (torques, positions).
        unloaded: transmission error at vanishing load [um], shape (positions,).
        ax: Axes to draw into; None for a new figure.
        design_torque: design torque [N m], drawn as a line; None for none.
        design: name of the design, for a title; None for none.
    """
    torques, te = np.asarray(torques, float), np.asarray(te, float)
    loaded = np.argsort(torques)
    loaded = loaded[torques[loaded] > 0]
    rows = np.concatenate([[0.0], torques[loaded]])
    x, surface = two_pitches(phase, np.concatenate([np.asarray(unloaded, float)[None], te[loaded]]))
    levels = MaxNLocator(_LEVELS).tick_values(surface.min(), surface.max())
    with report_axes(ax) as ax:
        ax.grid(False)
        # cividis: even in lightness, so that it reads the same in grey and for every kind of colour vision
        image = ax.contourf(x, rows, surface, levels, cmap="cividis")
        colour_bar(image, ax, "transmission error [µm]", pad=0.02)
        ax.set(xlim=(0, 2), ylim=(0, rows[-1]), xlabel=PHASE_LABEL, ylabel="pinion torque [N m]")
        if design_torque is not None:
            text = f"design torque {float(design_torque):g} N m"
            ax.axhline(float(design_torque), color="black", linewidth=1.2, linestyle=(0, (4, 2)), label=text)
            legend_above(ax)
        if design is not None:
            pad = 24.0 if design_torque is not None else 6.0  # [pt], above the legend
            ax.set_title(design, loc="left", pad=pad, fontsize=ax.xaxis.label.get_fontsize())
        _labelled_lines(ax, x, rows, surface, levels)
    return ax


def _labelled_lines(ax: Axes, x: np.ndarray, rows: np.ndarray, surface: np.ndarray, levels: np.ndarray) -> None:
    middle = 0.5 * (levels[0] + levels[-1])
    colours = ["white" if level < middle else "black" for level in levels]
    lines = ax.contour(x, rows, surface, levels, colors=colours, linewidths=0.6)
    laid_out_size(ax)  # labels find their places in the size in which the Axes are drawn
    places = [place for path in lines.get_paths() for place in _label_place(path.vertices, rows[-1])]
    if places:
        ax.clabel(lines, fmt=lambda level: f"{level:g}", fontsize=FONT - 1, manual=places)


def _label_place(points: np.ndarray, highest: float) -> list[tuple[float, ...]]:
    """The point of a contour nearest to the middle of the two pitches; none for contours along the edges."""
    x, y = points.T / np.array([[2.0], [highest]])
    inside = points[(np.minimum(x, 1 - x) > _EDGE) & (np.minimum(y, 1 - y) > _EDGE)]
    return [tuple(inside[np.argmin(np.abs(inside[:, 0] - 1))])] if len(inside) else []


_BANDS = ("#C6DBEF", "#6BAED6", "#3182BD")  # from the outside in; further bands repeat the last


def fan(scatter: Scatter, ax: Axes | None = None) -> Axes:
    """Bands between the lower and upper quantiles of the transmission error [um], with median and nominal design.

    Over two base pitches: all teeth deviate alike, so the quantiles repeat, although single curves do not.

    Args:
        scatter: result of `monte_carlo`; its quantiles are paired from the outside in.
        ax: Axes to draw into; None for a new figure.
    """
    levels = np.asarray(scatter.quantiles)
    x, curves = two_pitches(scatter.phase, scatter.transmission_error_quantiles)
    # failed samples make outer quantiles infinite: there is no such bound, and no band
    curves = np.where(np.isfinite(curves), curves, np.nan)
    with report_axes(ax) as ax:
        for index in range(len(levels) // 2):
            share = levels[-1 - index] - levels[index]
            colour = _BANDS[min(index, len(_BANDS) - 1)]
            ax.fill_between(
                x,
                curves[index],
                curves[-1 - index],
                color=colour,
                linewidth=0,
                label=f"{100 * share:.3g} % of the gears",
            )
        if len(levels) % 2:
            middle = len(levels) // 2
            name = "median" if np.isclose(levels[middle], 0.5) else f"{100 * levels[middle]:.3g} % quantile"
            ax.plot(x, curves[middle], color="#08306B", linewidth=1.4, label=name)
        ax.plot(*two_pitches(scatter.phase, scatter.nominal_transmission_error), label="nominal", **line_style(1))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error [µm]")
        legend_above(ax)
    return ax


@captioned("Share of the manufactured pairs whose PPTE stays below a value.")
def ppte_distribution(
    samples: Mapping[str, ArrayLike],
    ax: Axes | None = None,
    level: float = 0.95,
    *,
    of: str | Quantity = "ppte",
) -> Axes:
    """Share of the manufactured gears whose PPTE, or another quantity, stays below a value, of several designs.

    Args:
        samples: the quantity of every sample by the name of the design; those that failed, NaN, stay below no value.
        ax: Axes to draw into; None for a new figure.
        level: share that a line marks; the legend has each design's quantile, as `Quantile` takes it.
        of: the quantity, or its name.

    Raises:
        ValueError: for an unknown name.
    """
    quantity = quantity_of(of)
    unit = printed_unit(quantity.unit)
    with report_axes(ax) as ax:
        for index, name, given in styled(samples):
            values = np.asarray(given)
            ordered = np.sort(values[np.isfinite(values)])
            share = 100 * np.arange(1, ordered.size + 1) / values.size
            reached = float(ranked(Quantile(real(level)), values))
            below = f", {100 * level:g} % below {reached:.2f} {unit}".rstrip() if np.isfinite(reached) else ""
            ax.plot(ordered, share, label=f"{name}{below}", **line_style(index))
        ax.axhline(100 * level, color=GREY, linewidth=0.8, zorder=0.5)
        ax.set_xlim(left=0)
        ax.set_ylim(0, 100)
        ax.set(xlabel=meaning_label(quantity), ylabel="share of the gears below [%]")
        legend_above(ax)
    return ax


_PPTE_LABEL = "peak-to-peak\ntransmission error [µm]"
_DARK, _LIGHT = 0.0, 0.72  # part of the colour map that shows on white


@captioned("PPTE over the torque.")
def ppte_over_torque(
    torques: ArrayLike, curves: Mapping[str, ArrayLike], ax: Axes | None = None, design_torque: float | None = None
) -> Axes:
    """PPTE [um] of several designs over the torque, with the torque they were designed for.

    Args:
        torques: torques on the pinion [N m], shape (torques,).
        curves: PPTE [um] by the name of the design, each of shape (torques,).
        ax: Axes to draw into; None for a new figure.
        design_torque: design torque [N m]; None for no mark.
    """
    with report_axes(ax) as ax:
        _over_torque(ax, torques, curves, design_torque)
        ax.set(ylim=(0, None), ylabel=_PPTE_LABEL)
    return ax


def ppte_over_overlap(
    overlap_ratios: ArrayLike, curves: Mapping[str, ArrayLike], ax: Axes | None = None, design: float | None = None
) -> Axes:
    """PPTE [um] of several designs over the overlap ratio, as helix angle or face width change it.

    Lines stand at whole overlap ratios, at which teeth of constant stiffness have no ripple.

    Args:
        overlap_ratios: `GearPair.overlap_ratio`, shape (ratios,).
        curves: PPTE [um] by the name of the design, each of shape (ratios,).
        ax: Axes to draw into; None for a new figure.
        design: overlap ratio of the design; None for no mark.
    """
    marks = {} if design is None else {float(design): f"design {float(design):.3g}"}
    with report_axes(ax) as ax:
        _over(ax, overlap_ratios, curves, marks)
        for whole in np.arange(1.0, np.ceil(ax.get_xlim()[1])):
            ax.axvline(whole, color=GREY, linewidth=0.6, linestyle=(0, (4, 3)), zorder=0.5)
        ax.set(ylim=(0, None), xlabel="overlap ratio $\\epsilon_\\beta$ [-]", ylabel=_PPTE_LABEL)
    return ax


@captioned("Face load factor over the torque.")
def face_load_over_torque(
    torques: ArrayLike, curves: Mapping[str, ArrayLike], ax: Axes | None = None, design_torque: float | None = None
) -> Axes:
    """Face load factor K_Hbeta of several designs over the torque; 1 is a load that is even over the face.

    Args:
        torques: torques on the pinion [N m], shape (torques,).
        curves: `metrics.face_load_factor` by the name of the design, each of shape (torques,).
        ax: Axes to draw into; None for a new figure.
        design_torque: design torque [N m]; None for no mark.
    """
    with report_axes(ax) as ax:
        _over_torque(ax, torques, curves, design_torque)
        highest = max((float(np.nanmax(np.asarray(curve))) for curve in curves.values()), default=1.0)
        # an even load lies on the foot of the Axes, and is seen to be even
        ax.set(ylim=(1, 1 + 1.06 * max(highest - 1, 0.1)), ylabel="face load factor K$_{H\\beta}$ [-]")
    return ax


_MARGIN = 0.03  # of the range of the abscissa, on either side


def _over_torque(ax: Axes, torques: ArrayLike, curves: Mapping[str, ArrayLike], design_torque: float | None) -> None:
    mark = None if design_torque is None else float(design_torque)
    _over(ax, torques, curves, {} if mark is None else {mark: f"design torque {mark:g} N m"})
    ax.set_xlabel("pinion torque [N m]")


def _over(ax: Axes, abscissa: ArrayLike, curves: Mapping[str, ArrayLike], marks: Mapping[float, str]) -> None:
    """Curves of several designs, with marks on the abscissa."""
    along = np.asarray(abscissa, float)
    for index, name, curve in styled(curves):
        ax.plot(along, np.asarray(curve), label=name, clip_on=False, **marker_style(index))
    for mark, text in marks.items():
        ax.axvline(mark, color=GREY, linewidth=0.8, zorder=0.5)
        text_above(ax, mark, text)
    low, high = np.min([*along, *marks]), np.max([*along, *marks])
    air = _MARGIN * (high - low) or 1.0  # of a single place
    ax.set_xlim(low - air, high + air)
    legend_above(ax, distance=ABOVE_MARKS if marks else ABOVE)


@captioned("Harris map: transmission error over two base pitches at several torques.")
def harris_map(
    phase: ArrayLike, torques: ArrayLike, te: ArrayLike, ax: Axes | None = None, *, design: str | None = None
) -> Axes:
    """Transmission error over two base pitches at several torques (Harris 1958), each curve with its torque at the end.

    Args:
        phase: mesh positions of one base pitch, shape (positions,).
        torques: torques on the pinion [N m], shape (torques,).
        te: transmission error [um], shape (torques, positions).
        ax: Axes to draw into; None for a new figure.
        design: name of the design, for a title; None for none.
    """
    order = np.argsort(torques)
    torques = np.asarray(torques, float)[order]
    x, curves = two_pitches(phase, np.asarray(te)[order])
    colours = ScalarMappable(Normalize(0, 1), "viridis").to_rgba(np.linspace(_DARK, _LIGHT, len(torques)))
    with report_axes(ax) as ax:
        for curve, colour in zip(curves, colours):
            ax.plot(x, curve, color=colour, linewidth=1.3)
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error [µm]")
        if design is not None:
            ax.set_title(design, loc="left", fontsize=ax.xaxis.label.get_fontsize())
        heights = _spread(curves[:, -1], _line_height(ax))
        for torque, height, colour in zip(torques, heights, colours):
            text = f"{torque:.4g} N m"
            ax.annotate(text, (2, height), xytext=(4, 0), textcoords="offset points", va="center", color=colour)
    return ax


def _line_height(ax: Axes) -> float:
    """Height of a line of text in data units of the ordinate."""
    low, high = ax.get_ylim()
    return 1.15 * ax.yaxis.label.get_fontsize() / laid_out_size(ax)[1] * (high - low)


def _spread(heights: np.ndarray, gap: float) -> np.ndarray:
    """Heights moved apart as little as possible so that neighbours keep a gap; their order stays."""
    order = np.argsort(heights, kind="stable")
    # least squares under y[i+1] - y[i] >= gap is isotonic regression of the heights minus their stacked offsets
    offsets = gap * np.arange(heights.size)
    spread = np.empty_like(heights)
    spread[order] = scipy.optimize.isotonic_regression(heights[order] - offsets).x + offsets
    return spread


_RADAR_PANEL = (58.0, 60.0)  # width and height of one chart [mm]
_ACROSS = 3  # charts in a row
_INNER = 0.25  # radius of the worst value, of 1 for the best
_LEAST_SPAN = 0.2  # of the best value, from the rim to the inner ring
_LABEL_RADIUS = 1.13
_LINE = 16  # characters of a label
_LINES, _TITLE_PAD = 2, 9.0  # lines on the upper spoke, and the distance of the title that clears them [pt]


@captioned("Results of chosen variants side by side.")
def radar(
    table: Table[Of],
    variants: Sequence[int] | None = None,
    names: Sequence[str] | None = None,
    ax: Panels | None = None,
    *,
    note: str = "",
) -> np.ndarray:
    """One radar chart per variant; each spoke extends from the worst value of the variants (inside) to the best one.

    If the values differ by less than a fifth, the inner ring is a fifth from the best value. A larger area means a
    better variant. The values are printed at the spokes, the best of all charts in bold; the first variant is drawn
    into every chart for comparison.

    Args:
        table: values of every variant by what they are, a `Quantity` or a column of a sweep: the results on the spokes,
            at least three.
        variants: row numbers of the variants; None for all rows, of which a page holds about nine.
        names: names of the variants; None for their row numbers.
        ax: one polar Axes per variant; None for a new figure.
        note: text below the charts that applies to all values, such as "mean over torques".

    Returns:
        the Axes, one per variant.

    Raises:
        ValueError: for less than three results, or a value that is not finite.
    """
    values = columns_of(table, least=3)
    rows = np.arange(len(values)) if variants is None else np.asarray(variants, int)
    names = [f"variant {row}" for row in rows] if names is None else names
    values = values[rows]
    if len(names) != len(rows) or len(rows) == 0:
        raise ValueError(f"names has {len(names)} entries, must have one for each of {len(rows)} variants")
    for row, column in np.argwhere(~np.isfinite(values))[:1]:
        raise ValueError(f"{list(table)[column].words} of {names[row]} is {values[row, column]}, must be finite")
    radii = _radii(costs(values, table))
    texts = _texts(values, [(of.words, printed_unit(of.unit)) for of in table])
    if ax is not None:
        panels = np.atleast_1d(ax)
        _draw_radars(panels, radii, texts, names)
        return panels
    across = min(len(rows), _ACROSS)
    down = -(-len(rows) // across)
    with report_figure(across * _RADAR_PANEL[0], down * _RADAR_PANEL[1]) as figure:
        grid = figure.subplots(down, across, squeeze=False, subplot_kw={"projection": "polar"}).ravel()
        for unused in grid[len(rows) :]:
            unused.remove()
        _draw_radars(grid[: len(rows)], radii, texts, names)
        note = f"{note}\n" if note else ""
        note += f"rim: best of these variants, inner ring: worst, or 20 % from the best; dashed: {names[0]}"
        figure.supxlabel(note, fontsize=FONT - 1, color=GREY)
    return grid[: len(rows)]


def _radii(cost: np.ndarray) -> np.ndarray:
    """Distance from the centre: 1 for the best of every column, also where all are equal."""
    best, worst = cost.min(axis=0), cost.max(axis=0)
    # small differences are not stretched over the whole chart
    span = np.maximum(worst - best, _LEAST_SPAN * np.abs(best))
    badness = (cost - best) / np.where(span > 0, span, 1.0)
    return 1 - (1 - _INNER) * badness


def _texts(values: np.ndarray, named: Sequence[tuple[str, str]]) -> list[list[str]]:
    """Labels at the spokes of every variant: name, value and unit."""
    largest = np.abs(values).max(axis=0)
    decimals = np.clip(2 - np.floor(np.log10(np.where(largest > 0, largest, 1.0))), 0, 4).astype(int)
    return [
        [
            f"{wrapped(what, _LINE)}\n{value:.{digits}f} {unit}".rstrip()
            for value, digits, (what, unit) in zip(row, decimals, named)
        ]
        for row in values
    ]


def _draw_radars(panels: np.ndarray, radii: np.ndarray, texts: Sequence[Sequence[str]], names: Sequence[str]) -> None:
    angles = 2 * np.pi * np.arange(radii.shape[1]) / radii.shape[1]
    above = max(text[0].count("\n") + 1 for text in texts)  # lines on the upper spoke
    pad = _TITLE_PAD + max(above - _LINES, 0) * 1.15 * (FONT - 2)
    for index, (panel, radius, name) in enumerate(zip(panels, radii, names)):
        _frame(panel, angles)
        style = line_style(style_number(name, index))
        if index:
            panel.plot(*_closed(angles, radii[0]), color=GREY, linewidth=1.0, linestyle=(0, (3, 2)), zorder=3)
        panel.plot(*_closed(angles, radius), color=style["color"], linewidth=1.6, zorder=4)
        panel.fill(angles, radius, color=style["color"], alpha=0.15, linewidth=0, zorder=2)
        for angle, far, text in zip(angles, radius, texts[index]):
            _spoke_text(panel, angle, text, bold=far == 1.0)
        panel.set_title(name, fontsize=FONT, fontweight="bold", color=style["color"], pad=pad)


def _frame(panel: Axes, angles: np.ndarray) -> None:
    """Spokes, rim and inner ring as straight lines between the spokes."""
    panel.set_theta_zero_location("N")
    panel.set_theta_direction(-1)
    panel.set(rmin=0, rmax=1)
    panel.grid(False)
    panel.set_axis_off()
    for ring in (_INNER, 1.0):
        panel.plot(*_closed(angles, np.full(angles.size, ring)), color="#B0B0B0", linewidth=0.7, zorder=1)
    panel.vlines(angles, 0, 1, color=PALE, linewidth=0.7, zorder=1)


def _closed(angles: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.append(angles, angles[0]), np.append(radius, radius[0])


def _spoke_text(panel: Axes, angle: float, text: str, *, bold: bool) -> None:
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
