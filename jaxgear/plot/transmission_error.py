"""Loaded transmission error over the mesh cycle."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ..contact import MeshCycle
from .figure import legend_above, line_style, report_axes
from .history import PHASE_LABEL, two_pitches


def transmission_error(cycles: Mapping[str, MeshCycle], ax: Axes | None = None) -> Axes:
    """Loaded transmission error [um] of several designs over two base pitches, with their PPTE in the legend.

    Args:
        cycles: solved cycles by the name of their design.
        ax: Axes to draw into; None for a new figure.
    """
    with report_axes(ax) as ax:
        for index, (name, cycle) in enumerate(cycles.items()):
            ppte = np.ptp(np.asarray(cycle.transmission_error))
            curve = two_pitches(cycle.phase, cycle.transmission_error)
            ax.plot(*curve, label=f"{name} (PPTE {ppte:.2f} µm)", **line_style(index))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error [µm]")
        legend_above(ax)
    return ax
