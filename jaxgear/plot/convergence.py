"""Convergence of optimizations and of the transmission-error iteration."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from numpy.typing import ArrayLike

from ..contact import Mesh
from ..metrics import profile_relief
from ..optimize import Iterate, Optimum
from .figure import (
    ABOVE_MARKS,
    captioned,
    grow,
    legend_above,
    line_style,
    mark_path,
    marker_style,
    report_axes,
    styled,
    wrapped,
)
from .front import ANALYSES_LABEL, best_label, logarithmic
from .mesh_cycle import PATH_LABEL, PHASE_LABEL, two_pitches


@captioned(
    "Course of the search: best objective over the contact analyses spent. Dotted: as judged on the finer grid on "
    "which the search ends."
)
def convergence(optima: Mapping[str, Optimum], ax: Axes | None = None) -> Axes:
    """Best objective over the contact analyses spent, with a mark at the end of every search.

    If a search ends on a finer mesh, its objectives on that mesh are a separate dotted curve with an open mark. Both
    axes are logarithmic, the ordinate only if all objectives are positive. An objective known before the first analysis
    is drawn at one analysis. The curve begins with the first valid design.

    Args:
        optima: results by the name of their method, of the same objective; up to eight differ in style.
        ax: Axes to draw into; None for a new figure.
    """
    own, drawn = ax is None, []
    with report_axes(ax) as ax:
        for index, name, optimum in styled(optima):
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
        names = {best_label(optimum) for optimum in optima.values()}
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


_POINTS = 201  # over the active profile
_LABELLED = 8  # states in the legend
_FIRST, _LAST = 0.78, 0.0  # part of the colour map: what comes later is darker


@captioned("Relief after every iteration of the search.")
def iterations_relief(
    mesh: Mesh, optimum: Optimum, gear: Literal["pinion", "wheel"] = "pinion", ax: Axes | None = None
) -> Axes:
    """Material removed [um] by every state of an iteration over the path of contact, in the middle of the face.

    Args:
        mesh: prepared mesh.
        optimum: result of an iteration.
        gear: "pinion" or "wheel".
        ax: Axes to draw into; None for a new figure.

    Raises:
        ValueError: for an optimum without iterations or another gear.
    """
    if gear not in ("pinion", "wheel"):
        raise ValueError(f'gear "{gear}" is not known, must be one of pinion, wheel')
    states = _states(optimum)
    path = _path(mesh, gear)
    with report_axes(ax) as ax:
        for index, state in enumerate(states):
            pinion, wheel = profile_relief(mesh, state.pinion, state.wheel, points=_POINTS)
            removed = np.asarray(pinion if gear == "pinion" else wheel)
            ax.plot(path, removed, label=_label(index, len(states)), **_style(index, len(states)))
        mark_path(ax, mesh.path_of_contact)
        air = 0.05 * float(mesh.path_of_contact.base_pitch)
        ax.set_xlim(path.min() - air, path.max() + air)
        ax.set(xlabel=PATH_LABEL, ylabel=f"material removed from the {gear} [µm]")
        legend_above(ax, distance=ABOVE_MARKS)
    return ax


@captioned("Transmission error after every iteration of the search.")
def iterations_transmission_error(optimum: Optimum, phase: ArrayLike, ax: Axes | None = None) -> Axes:
    """Transmission error [um] of every state of an iteration over two base pitches, with its PPTE in the legend.

    Args:
        optimum: result of an iteration.
        phase: mesh positions of one base pitch, shape (positions,).
        ax: Axes to draw into; None for a new figure.

    Raises:
        ValueError: for an optimum without iterations.
    """
    states = _states(optimum)
    with report_axes(ax) as ax:
        for index, state in enumerate(states):
            label = _label(index, len(states), f"PPTE {float(state.ppte):.2f} µm")
            ax.plot(*two_pitches(phase, state.transmission_error), label=label, **_style(index, len(states)))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error [µm]")
        legend_above(ax)
    return ax


def _states(optimum: Optimum) -> tuple[Iterate, ...]:
    if not optimum.iterations:
        raise ValueError("optimum has no iterations, must be the result of a transmission-error iteration")
    return optimum.iterations


def _path(mesh: Mesh, gear: str) -> np.ndarray:
    """Path positions [mm] of evenly spaced points from the start of the active profile to the tip."""
    contact = mesh.path_of_contact
    start, tip = (contact.start, contact.end) if gear == "pinion" else (contact.end, contact.start)
    return np.linspace(float(start), float(tip), _POINTS)


def _style(index: int, count: int) -> dict[str, Any]:
    """Later states darker, the first one dashed and the last one wide."""
    part = index / max(count - 1, 1)
    colour = ScalarMappable(Normalize(0, 1), "viridis").to_rgba(_FIRST + (_LAST - _FIRST) * part)
    last = index == count - 1
    return {
        "color": colour,
        "linestyle": (0, (4, 1.5)) if index == 0 and not last else "-",
        "linewidth": 2.0 if last else 1.2,
        "zorder": 2 + part,
    }


def _label(index: int, count: int, text: str = "") -> str:
    """Number of the state, of many states only those of some."""
    shown = np.unique(np.linspace(0, count - 1, min(count, _LABELLED)).round().astype(int))
    if index not in shown:
        return f"_{index}"  # matplotlib leaves labels with an underscore out of the legend
    role = "start" if index == 0 else "end" if index == count - 1 else ""
    return ": ".join(part for part in (" ".join((str(index), role)).strip(), text) if part)
