"""Pressure along the path of contact."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..contact import MeshCycle
from .figure import ABOVE_MARKS, GREY, legend_above, line_style, mark_path, report_axes
from .history import PATH_LABEL, pair_history, path_limits

_DECADE = (1, 2, 5)  # ticks
_LINEAR = 1.5  # share of the linear part of the scale [decades of the logarithmic one]


def pressure(cycles: Mapping[str, MeshCycle], ax: Axes | None = None) -> Axes:
    """Hertzian pressure [MPa] of one pair over its path of contact, the largest of all slices.

    Lines on the path of contact are that of the flanks. Dots before A and after E are that of the tip corners, another
    kind of contact, whose pressure depends on the tip edge radius; the legend has its largest value, to 10 MPa. It may
    be many times that of the flanks: the scale is linear as far as these go, and logarithmic above.

    Args:
        cycles: solved cycles by the name of their design; the points A to E are those of the first.
        ax: Axes to draw into; None for a new figure.
    """
    corners: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    highest = 0.0
    with report_axes(ax) as ax:
        for index, (name, cycle) in enumerate(cycles.items()):
            path, flank = pair_history(cycle, np.asarray(cycle.contact_pressure).max(axis=1))
            _, corner = pair_history(cycle, np.asarray(cycle.corner_pressure).max(axis=1))
            contact = cycle.kinematics.path_of_contact
            outside = (path < float(contact.start)) | (path > float(contact.end))
            highest = max(highest, float(flank.max()))
            label = name
            if corner.max() > 0:
                corners[index] = path[corner > 0], corner[corner > 0]
                label = f"{name} (corners {round(corner.max(), -1):.0f} MPa)"
            ax.plot(path, np.where(outside, np.nan, flank), label=label, **line_style(index))
        for index, (path, corner) in corners.items():
            ax.plot(path, corner, color=line_style(index)["color"], linestyle="none", marker="o", markersize=3)
        if corners:
            end = _two_scales(ax, highest, max(corner.max() for _, corner in corners.values()))
            label = f"tip corner contact; scale logarithmic above {end:g} MPa"
            ax.plot([], [], color=GREY, linestyle="none", marker="o", markersize=3, label=label)
        if cycles:
            mark_path(ax, next(iter(cycles.values())).kinematics.path_of_contact)
            ax.set_xlim(path_limits(cycles.values()))
        ax.set_ylim(bottom=0)
        ax.set(xlabel=PATH_LABEL, ylabel="pressure [MPa]")
        legend_above(ax, distance=ABOVE_MARKS)
    return ax


def _two_scales(ax: Axes, flank: float, corner: float) -> float:
    """Makes the scale linear up to the first tick above the flank pressure, and logarithmic from there; that tick."""
    linear = MaxNLocator(nbins=5).tick_values(0.0, max(flank, 1.0))
    end = float(linear[-1])
    ax.set_yscale("symlog", linthresh=end, linscale=_LINEAR)
    decade = 10.0 ** np.floor(np.log10(end))
    steps = np.outer(decade * 10.0 ** np.arange(4), _DECADE).ravel()
    above = steps[(steps > end) & (steps < 2.5 * corner)]  # the first one beyond it, too
    ax.set_yticks([*linear, *above], minor=False)
    ax.set_yticks([], minor=True)
    ax.yaxis.set_major_formatter("{x:g}")
    return end
