"""Orders of the transmission error."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..contact import MeshCycle
from ..metrics import harmonics
from ..numerics import program
from .figure import legend_above, line_style, report_axes

_GROUP = 0.8  # of the distance between two orders, which the bars of all designs share


def transmission_error_orders(cycles: Mapping[str, MeshCycle], ax: Axes | None = None, *, count: int = 8) -> Axes:
    """Amplitudes of the mesh harmonics of the transmission error [um] as bars, design beside design.

    Args:
        cycles: solved cycles by the name of their design.
        ax: Axes to draw into; None for a new figure.
        count: number of harmonics, less than half the positions.

    Raises:
        ValueError: for more harmonics than the positions resolve.
    """
    width = _GROUP / max(len(cycles), 1)
    orders = np.arange(1, count + 1)
    with report_axes(ax) as ax:
        for index, (name, cycle) in enumerate(cycles.items()):
            amplitude = np.asarray(_amplitudes(cycle.transmission_error, count))
            place = orders + (index - (len(cycles) - 1) / 2) * width
            ax.bar(
                place, amplitude, width, label=name, color=line_style(index)["color"], edgecolor="white", linewidth=0.3
            )
        ax.grid(False, axis="x")
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        ax.set(xlim=(0.4, count + 0.6), xlabel="mesh order [-]", ylabel="amplitude of the\ntransmission error [µm]")
        legend_above(ax)
    return ax


@program
def _amplitudes(error, count: int):
    return harmonics(error, count).amplitude
