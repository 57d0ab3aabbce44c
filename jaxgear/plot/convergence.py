"""Convergence of optimizations."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ..optimize import Optimum
from .figure import grow, legend_above, line_style, marker_style, report_axes
from .objectives import ANALYSES_LABEL, logarithmic, objective_label, wrapped


def convergence(optima: Mapping[str, Optimum], ax: Axes | None = None) -> Axes:
    """Best objective met over the contact analyses spent, with a mark at the end of every search.

    Where a search ends on a finer mesh, on which its designs are judged anew, what is reached there is a curve of its
    own, dotted and with an open mark. Both axes are logarithmic, the ordinate only where all objectives are positive.
    What was known before the first analysis is drawn at one analysis; as long as no design was valid there is no curve.

    Args:
        optima: results by the name of their method, of the same objective; up to eight differ in style.
        ax: Axes to draw into; None for a new figure.
    """
    own, drawn = ax is None, []
    with report_axes(ax) as ax:
        for index, (name, optimum) in enumerate(optima.items()):
            spent, best, positions = _curve(optimum)
            style = {**line_style(index), "marker": marker_style(index)["marker"], "markersize": 5.0}
            style |= {"drawstyle": "steps-post", "markevery": [-1]}
            searched, judged = positions == positions[:1], positions == positions[-1:]
            ax.plot(spent[searched], best[searched], label=name, **style)
            if not searched.all():
                style |= {"linestyle": ":", "markerfacecolor": "white"}
                label = f"{name}, judged at {positions[-1]} positions"
                ax.plot(spent[judged], best[judged], label=label, **style)
            drawn.append((spent, best))
        spent, best = (np.concatenate([np.empty(0), *(curve[part] for curve in drawn)]) for part in (0, 1))
        if spent.size:
            logarithmic(ax, "x", spent)
            if best.min() > 0:
                logarithmic(ax, "y", best)
        names = {objective_label(optimum.objective_name) for optimum in optima.values()}
        ax.set(xlabel=ANALYSES_LABEL, ylabel=wrapped(names.pop()) if len(names) == 1 else "best objective")
        lines = legend_above(ax)
        if own:
            grow(ax, max(lines - 2, 0))
    return ax


def _curve(optimum: Optimum) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact analyses, finite best objectives and positions of their mesh, up to the end of the search."""
    spent = np.append(np.asarray(optimum.history_evaluations, float), optimum.evaluations)
    best = np.append(np.asarray(optimum.history, float), optimum.objective)
    each = np.full(len(best), optimum.positions)
    if optimum.history_positions is not None:
        each[:-1] = optimum.history_positions
    valid = np.isfinite(best)
    return np.maximum(spent[valid], 1.0), best[valid], each[valid]
