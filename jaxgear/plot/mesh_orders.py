"""Transmission error by orders of the mesh frequency."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..contact import MeshCycle
from ..metrics import harmonics
from .figure import legend_above, line_style, report_axes

_ORDERS = 8  # at most
_GROUP = 0.8  # of the distance of two orders, which the bars of all designs take
_HATCHES = ("", "///", "...", "xxx", "---", "\\\\\\", "+++", "ooo")


def mesh_orders(cycles: Mapping[str, MeshCycle], ax: Axes | None = None) -> Axes:
    """Amplitudes [um] of the loaded transmission error of several designs at the orders of the mesh frequency.

    Up to the eighth, or as many as the positions of a cycle resolve. A sine wave of the amplitude one has a
    peak-to-peak value of two.

    Args:
        cycles: solved cycles by the name of their design.
        ax: Axes to draw into; None for a new figure.
    """
    with report_axes(ax) as ax:
        for index, (name, cycle) in enumerate(cycles.items()):
            curve = cycle.transmission_error
            count = max(1, min(_ORDERS, (curve.shape[-1] - 1) // 2))
            orders = np.arange(1, count + 1)
            width = _GROUP / len(cycles)
            place = orders + (index - (len(cycles) - 1) / 2) * width
            style = {
                "color": line_style(index)["color"],
                "hatch": _HATCHES[index % len(_HATCHES)],
                "edgecolor": "white",
            }
            ax.bar(place, np.asarray(harmonics(curve, count).amplitude), width, label=name, linewidth=0.3, **style)
        ax.grid(False, axis="x")
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.set(xlabel="order of the mesh frequency [-]", ylabel="amplitude of the\ntransmission error [µm]")
        legend_above(ax)
    return ax
