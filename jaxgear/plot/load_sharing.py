"""Share of one pair in the load."""

from collections.abc import Mapping

from matplotlib.axes import Axes

from ..contact import MeshCycle
from ..metrics import load_sharing as share
from .figure import ABOVE_MARKS, legend_above, line_style, mark_path, report_axes
from .history import PATH_LABEL, pair_history, path_limits


def load_sharing(cycles: Mapping[str, MeshCycle], ax: Axes | None = None) -> Axes:
    """Share of one pair in the total force over its whole path, corner contact before A and after E included.

    Args:
        cycles: solved cycles by the name of their design; the points A to E are those of the first.
        ax: Axes to draw into; None for a new figure.
    """
    with report_axes(ax) as ax:
        for index, (name, cycle) in enumerate(cycles.items()):
            ax.plot(*pair_history(cycle, share(cycle)), label=name, **line_style(index))
        if cycles:
            mark_path(ax, next(iter(cycles.values())).kinematics.path_of_contact)
            ax.set_xlim(path_limits(cycles.values()))
        ax.set(ylim=(0, 1.05), xlabel=PATH_LABEL, ylabel="share of the pair in the load [-]")
        legend_above(ax, distance=ABOVE_MARKS)
    return ax
