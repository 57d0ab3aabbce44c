"""Flank pressure along the path of contact."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ..contact import MeshCycle
from .figure import ABOVE_MARKS, GREY, legend_above, line_style, mark_path, report_axes
from .history import PATH_LABEL, pair_history, path_limits


def pressure(cycles: Mapping[str, MeshCycle], ax: Axes | None = None) -> Axes:
    """Hertzian pressure [MPa] on the flank of one pair over its path of contact, the largest of all slices.

    Contact of the tip corners, before A and after E, is another kind of contact with its own pressure, which depends on
    the tip edge radius: a bar at the foot shows where it happens, the legend its largest value, to 10 MPa.

    Args:
        cycles: solved cycles by the name of their design; the points A to E are those of the first.
        ax: Axes to draw into; None for a new figure.
    """
    any_corner = False
    with report_axes(ax) as ax:
        for index, (name, cycle) in enumerate(cycles.items()):
            path, flank = pair_history(cycle, np.asarray(cycle.contact_pressure).max(axis=1))
            _, corner = pair_history(cycle, np.asarray(cycle.corner_pressure).max(axis=1))
            contact = cycle.kinematics.path_of_contact
            outside = (path < float(contact.start)) | (path > float(contact.end))
            highest = corner.max()
            any_corner |= highest > 0
            label = f"{name} (corners {round(highest, -1):.0f} MPa)" if highest > 0 else name
            ax.plot(path, np.where(outside, np.nan, flank), label=label, **line_style(index))
            _corner_bars(ax, path, corner > 0, index)
        if any_corner:
            ax.fill_between([], [], color=GREY, linewidth=0, label="tip corner contact")
        if cycles:
            mark_path(ax, next(iter(cycles.values())).kinematics.path_of_contact)
            ax.set_xlim(path_limits(cycles.values()))
        ax.set_ylim(bottom=0)
        ax.set(xlabel=PATH_LABEL, ylabel="flank pressure [MPa]")
        legend_above(ax, distance=ABOVE_MARKS)
    return ax


def _corner_bars(ax: Axes, path, loaded, index: int) -> None:
    """Bars over the stretches of loaded corner contact, stacked by design, just above the foot of the Axes."""
    step = path[1] - path[0]
    height = 0.025
    ax.fill_between(
        np.repeat(path, 2) + np.tile([-0.5, 0.5], path.size) * step,
        height * (index + 0.25),
        height * (index + 1),
        where=np.repeat(loaded, 2),
        transform=ax.get_xaxis_transform(),
        color=line_style(index)["color"],
        linewidth=0,
    )
