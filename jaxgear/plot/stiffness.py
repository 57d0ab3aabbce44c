"""Mesh stiffness over the mesh cycle."""

import numpy as np
from matplotlib.axes import Axes

from ..contact import MeshCycle
from ..metrics import secant_stiffness
from .figure import legend_above, line_style, report_axes
from .history import PHASE_LABEL, two_pitches


def mesh_stiffness(cycle: MeshCycle, ax: Axes | None = None) -> Axes:
    """Secant and tangent mesh stiffness [N/um] of one design over two base pitches.

    The secant is force over deflection, for static deflections; the tangent the local slope, for small vibrations.

    Args:
        cycle: solved cycle.
        ax: Axes to draw into; None for a new figure.
    """
    curves = {"tangent": cycle.tangent_stiffness, "secant": secant_stiffness(cycle)}
    with report_axes(ax) as ax:
        for index, (name, values) in enumerate(curves.items()):
            mean = float(np.mean(np.asarray(values)))
            ax.plot(*two_pitches(cycle.phase, values), label=f"{name} (mean {mean:.0f} N/µm)", **line_style(index))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="mesh stiffness [N/µm]")
        ax.set_ylim(bottom=0)
        legend_above(ax)
    return ax
