"""Pareto front of an optimization."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ..optimize import Front
from .figure import legend_above, point_style, report_axes
from .objectives import objective_label, unit_text, wrapped
from .pareto import front_dots, front_star, front_steps

_STYLES_OF_FRONT = 3  # that front and star take


def optimum_front(
    front: Front,
    chosen: int | None = None,
    ax: Axes | None = None,
    *,
    others: Mapping[str, np.ndarray] | None = None,
) -> Axes:
    """Designs of which none is better in both objectives; of more objectives the first two, with the third as colour.

    Args:
        front: result of an optimization of several objectives.
        chosen: number of the design that was chosen, a row of `front.values`; None for no mark.
        ax: Axes to draw into; None for a new figure.
        others: values of the objectives of designs that the front is compared with, by their names.

    Raises:
        ValueError: for a number that the front does not have.
    """
    count = len(front.values)
    if chosen is not None and not 0 <= chosen < count:
        raise ValueError(f"optimum_front: chosen is {chosen}, must be a design of the front, 0 to {count - 1}")
    labels = [objective_label(name, unit) for name, unit in zip(front.objectives, front.units)]
    with report_axes(ax) as ax:
        if len(labels) == 2:
            front_steps(ax, front.values, f"Pareto front, {count} designs")
        else:
            front_dots(ax, front.values, f"Pareto front, {count} designs", wrapped(labels[2]))
        if chosen is not None:
            values = [
                f"{value:.3g} {unit_text(unit)}".strip() for value, unit in zip(front.values[chosen], front.units)
            ]
            front_star(ax, front.values[chosen], f"chosen: {', '.join(values)}")
        for index, (name, other) in enumerate((others or {}).items()):
            ax.plot(*other[:2], zorder=5, label=name, **point_style(index + _STYLES_OF_FRONT))
        ax.set(xlabel=labels[0], ylabel=wrapped(labels[1]))
        legend_above(ax)
    return ax
