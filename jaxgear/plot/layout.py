"""Layouts: shafts under load, cases of deviations, and radar charts of variants in parallel."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.markers import CARETUP
from matplotlib.patches import Rectangle

from ..layout import CASES, ToleranceCases
from ..shafts import Gearbox, Shaft, elastic_line
from ..shafts.gearbox import axes_of
from ..sweeps.columns import printed_unit
from .figure import (
    FONT,
    GREY,
    PALE,
    WIDTH,
    Panels,
    captioned,
    legend_above,
    line_style,
    marker_style,
    report_axes,
    report_figure,
    style_number,
)
from .front import wrapped
from .variants import Of, Table, columns_of, costs

_PANEL = (58.0, 60.0)  # width and height of one chart [mm]
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
    """One radar chart per variant, each spoke from the worst value of the variants shown, inside, to the best one.

    Where they differ by less than a fifth, the inner ring is a fifth from the best.

    So the larger the area, the better the variant. Its values stand at the spokes, the best ones of all charts in bold;
    the first variant is drawn into every chart for comparison.

    Args:
        table: values of every variant by what they are, a `Quantity` or a column of a sweep: the results on the spokes,
            at least three.
        variants: row numbers of the variants; None for all rows, of which a page holds about nine.
        names: of the variants; None for their row numbers.
        ax: one polar Axes per variant; None for a new figure.
        note: what all values have in common, such as "mean over torques"; it stands under the charts.

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


def _draw(panels: np.ndarray, radii: np.ndarray, texts: Sequence[Sequence[str]], names: Sequence[str]) -> None:
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


def _name(case: str) -> str:
    for written, shown in (("f_Hb", "$f_{H\\beta}$"), ("f_ma", "$f_{ma}$"), ("-", "\N{MINUS SIGN}")):
        case = case.replace(written, shown)
    return case


def tolerance_line_load(cases: ToleranceCases, ax: Axes | None = None, *, title: str = "") -> Axes:
    """Line load [N/mm] over the face coordinate [mm] without deviations and in the four combinations of them.

    Cases whose largest load is at an end of the face are marked there with a cross.

    Args:
        cases: of one flank line and one torque.
        ax: Axes; None for a new figure.
        title: over the panel.
    """
    with report_axes(ax) as panel:
        edges = np.asarray(cases.edge_contact)
        for number, (name, face, load) in enumerate(
            zip(CASES, np.asarray(cases.load.face_coordinate), np.asarray(cases.load.line_load))
        ):
            factor = float(cases.face_load_factor[number])
            panel.plot(face, load, **line_style(number), label=f"{_name(name)}, {factor:.2f}")
            if edges[number]:
                end = 0 if load[0] > load[-1] else -1
                style = {"marker": "X", "color": line_style(number)["color"], "markersize": 6.5, "linestyle": ""}
                panel.plot(face[end], load[end], clip_on=False, **style)
        panel.set_xlabel("face coordinate [mm]")
        panel.set_ylabel("line load [N/mm]")
        panel.set_ylim(bottom=0.0)
        heading = f"{title}, " if title else ""
        style = {"frameon": False, "borderaxespad": 0.0, "alignment": "left", "columnspacing": 1.2, "handlelength": 2.4}
        above = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.03), "ncols": 2}
        panel.legend(title=heading + r"$K_{H\beta}$ of the cases", **style, **above)
    return panel


@captioned("Face load factor under the combinations of deviations within the tolerances.")
def face_load_factors(cases: Mapping[str, ToleranceCases], ax: Axes | None = None) -> Axes:
    """K_Hbeta of the five cases of deviations, one line of marks per flank line; hollow marks where an edge is touched.

    Args:
        cases: by the name of the flank line, "step 1" for instance.
        ax: Axes; None for a new figure.
    """
    with report_axes(ax) as panel:
        places = np.arange(len(CASES))
        for number, (name, one) in enumerate(cases.items()):
            style = {**marker_style(number), "markersize": 5.5}
            factors, edges = np.asarray(one.face_load_factor), np.asarray(one.edge_contact)
            panel.plot(places, factors, **style, label=name)
            hollow = {**style, "linestyle": "", "markerfacecolor": "white"}
            panel.plot(places[edges], factors[edges], **hollow)
        panel.axhline(1.0, color=GREY, linewidth=0.8)
        panel.set_xticks(places, [_name(name).replace(" $", "\n$", 1) for name in CASES])
        panel.set_xlabel("deviations (hollow: largest load at an edge)")
        panel.set_ylabel(r"face load factor $K_{H\beta}$ [-]")
        legend_above(panel)
    return panel


_POINTS = 101  # of an elastic line
_HEIGHT = 55.0  # of a panel [mm]
_TALLEST = 0.6  # largest deflection drawn, over the largest radius of the sections
_ROOM = 1.35  # of a panel, over the largest radius drawn
_GEAR = "#EEF3F7"


@captioned("Elastic lines of the shafts at the design torque, exaggerated, with bearings and gears.")
def shaft_deflection(gearbox: Gearbox, ax: Panels | None = None) -> np.ndarray:
    """Shafts of a gearbox side-on with their elastic lines, one panel each, in the direction of the largest deflection.

    The line is exaggerated by the factor in its legend, which names largest deflection and direction too; the shafts
    lie at the axial places at which their gears mesh. Every mesh loads its gears evenly over the face.

    Args:
        gearbox: with the torques of its couplings.
        ax: one Axes per shaft; None for a new figure.

    Returns:
        the Axes, one per shaft.
    """
    count = len(gearbox.shafts)
    with report_axes(ax, rows=count, width=WIDTH, height=_HEIGHT * count) as panels:
        panels = np.atleast_1d(panels)
        for panel, shaft, start in zip(panels, gearbox.shafts, axes_of(gearbox)[:, 2], strict=True):
            panel.grid(False)
            _draw_parts(panel, shaft, start)
            _draw_line(panel, gearbox, shaft, start)
            panel.set_ylabel(f"{shaft.name}: radius [mm]")
            legend_above(panel)
        panels[-1].set_xlabel("axial coordinate [mm]")
    return panels


def _draw_parts(ax: Axes, shaft: Shaft, start: float) -> None:
    """Sections, bores, gears and bearings."""
    left, tallest = start, _thickest(shaft)
    for section in shaft.sections:
        length, radius, bore = (float(value) for value in (section.length, section.diameter / 2, section.bore / 2))
        ax.add_patch(Rectangle((left, -radius), length, 2 * radius, facecolor=PALE, edgecolor=GREY, linewidth=0.6))
        if bore > 0:
            ax.hlines([-bore, bore], left, left + length, color=GREY, linewidth=0.6, linestyle=(0, (3, 2)))
        left += length
    for gear in shaft.gears:
        radius, width = float(gear.gear.tip_radius), float(gear.gear.face_width)
        middle = start + float(gear.position)
        ax.add_patch(
            Rectangle((middle - width / 2, -radius), width, 2 * radius, facecolor=_GEAR, edgecolor=GREY, linewidth=0.6)
        )
        ax.text(middle, radius, gear.name, ha="center", va="bottom", fontsize=FONT - 1)
        tallest = max(tallest, radius)
    for bearing in shaft.bearings:
        place, radius = float(bearing.position), _radius_at(shaft, float(bearing.position))
        ax.plot([start + place], [-radius], marker=CARETUP, color=GREY, markersize=8, linestyle="")
        below = {"xytext": (0, -9), "textcoords": "offset points", "ha": "center", "va": "top", "fontsize": FONT - 1}
        ax.annotate(bearing.name, (start + place, -radius), **below)
    air = 0.03 * (left - start)
    ax.set(xlim=(start - air, left + air), ylim=(-_ROOM * tallest, _ROOM * tallest))


def _draw_line(ax: Axes, gearbox: Gearbox, shaft: Shaft, start: float) -> None:
    """The elastic line in the direction of its largest deflection."""
    along = np.linspace(0.0, float(shaft.length), _POINTS)
    moved = np.asarray(elastic_line(gearbox, shaft.name, along).displacement)[:, :2]
    size = np.hypot(*moved.T)
    most = int(size.argmax())
    direction = moved[most] / size[most] if size[most] > 0 else np.array([1.0, 0.0])
    factor = _round(_TALLEST * _thickest(shaft) / (1e-3 * size[most])) if size[most] > 0 else 1.0
    angle = np.rad2deg(np.arctan2(direction[1], direction[0]))
    label = f"deflection x {factor:g}, largest {size[most]:.3g} µm, {angle:.0f} deg from x towards y"
    ax.axhline(0.0, color=GREY, linewidth=0.5, linestyle=(0, (8, 2, 2, 2)))
    ax.plot(start + along, 1e-3 * factor * (moved @ direction), label=label, **line_style(1))


def _thickest(shaft: Shaft) -> float:
    """Largest radius of the sections [mm]."""
    return max(float(section.diameter) / 2 for section in shaft.sections)


def _radius_at(shaft: Shaft, position: float) -> float:
    """Radius of the section at a position [mm]."""
    ends = np.cumsum([float(section.length) for section in shaft.sections])
    return float(shaft.sections[int(np.searchsorted(ends[:-1], position))].diameter) / 2


def _round(value: float) -> float:
    """The next of 1, 2, 5 times a power of ten below."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-9)))
