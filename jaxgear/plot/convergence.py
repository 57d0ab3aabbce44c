"""Convergence of optimizations."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ..optimize import Optimum
from .figure import grow, legend_above, line_style, marker_style, report_axes
from .objectives import ANALYSES_LABEL, logarithmic, objective_label, wrapped


def convergence(optima: Mapping[str, Optimum], ax: Axes | None = None) -> Axes:
    """Best objective met over the contact analyses spent, with a mark at the end of every search.

    A curve rises where its search goes on to a finer grid, on which the best design is judged anew. Both axes are
    logarithmic, the ordinate only where all objectives are positive. What was known before the first analysis stands at
    one analysis; as long as no design was valid there is no curve.

    Args:
        optima: results by the name of their method, of the same objective; up to eight differ in style.
        ax: Axes to draw into; None for a new figure.
    """
    own, drawn = ax is None, []
    with report_axes(ax) as ax:
        for index, (name, optimum) in enumerate(optima.items()):
            spent, best = _curve(optimum)
            style = {**line_style(index), "marker": marker_style(index)["marker"], "markersize": 5.0}
            ax.plot(spent, best, drawstyle="steps-post", markevery=[-1], label=name, **style)
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


def _curve(optimum: Optimum) -> tuple[np.ndarray, np.ndarray]:
    """Contact analyses and finite best objectives, up to the end of the search."""
    spent = np.append(np.asarray(optimum.history_evaluations, float), optimum.evaluations)
    best = np.append(np.asarray(optimum.history, float), optimum.objective)
    valid = np.isfinite(best)
    return np.maximum(spent[valid], 1.0), best[valid]
