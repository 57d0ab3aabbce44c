"""Shafts under load: sections, bearings, gears and elastic lines."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.markers import CARETUP
from matplotlib.patches import Rectangle

from ..shafts import Gearbox, Shaft, elastic_line
from ..shafts.gearbox import axes_of
from .figure import FONT, GREY, PALE, WIDTH, Panels, captioned, legend_above, line_style, report_axes

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
        gearbox: gearbox with the torques of its couplings.
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
