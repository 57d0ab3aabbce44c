"""Convergence of optimizations and of the transmission-error iteration."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
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
    FONT,
    Panels,
    grow,
    legend_above,
    legend_over_panels,
    line_style,
    mark_path,
    marker_style,
    point_style,
    report_axes,
    styled,
)
from .front import ANALYSES_LABEL, best_label, logarithmic, wrapped
from .mesh_cycle import PATH_LABEL, PHASE_LABEL, two_pitches


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
        raise ValueError(f'iterations_relief: gear "{gear}" is not known, must be one of pinion, wheel')
    states = _states("iterations_relief", optimum)
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


def iterations_transmission_error(optimum: Optimum, phase: ArrayLike, ax: Axes | None = None) -> Axes:
    """Transmission error [um] of every state of an iteration over two base pitches, with its PPTE in the legend.

    Args:
        optimum: result of an iteration.
        phase: mesh positions of one base pitch, shape (positions,).
        ax: Axes to draw into; None for a new figure.

    Raises:
        ValueError: for an optimum without iterations.
    """
    states = _states("iterations_transmission_error", optimum)
    with report_axes(ax) as ax:
        for index, state in enumerate(states):
            label = _label(index, len(states), f"PPTE {float(state.ppte):.2f} µm")
            ax.plot(*two_pitches(phase, state.transmission_error), label=label, **_style(index, len(states)))
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error [µm]")
        legend_above(ax)
    return ax


def _states(owner: str, optimum: Optimum) -> tuple[Iterate, ...]:
    if not optimum.iterations:
        raise ValueError(f"{owner}: optimum has no iterations, must be the result of a transmission-error iteration")
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


_QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        "ppte_um": "peak-to-peak\ntransmission error [µm]",
        "worst_over_torque_um": "worst peak-to-peak\ntransmission error over torque [µm]",
        "quantile95_um": "peak-to-peak transmission\nerror, 95 % of the gears [µm]",
    }
)
_WIDTHS = {1: 120.0, 2: 150.0}  # of all panels together [mm]
_WIDEST = 180.0
_WIDE = 20.0  # largest over smallest value from which the ordinate is logarithmic


def optimizer_comparison(
    rows: Sequence[Mapping[str, str | float]], quantity: str = "ppte_um", ax: Panels | None = None
) -> np.ndarray:
    """What every method reached over the contact analyses it spent, one panel per gear pair.

    Args:
        rows: results, each with "method", "pair", "evaluations" and the quantity; several rows of a method and a pair
            are several runs.
        quantity: "ppte_um", "worst_over_torque_um" or "quantile95_um".
        ax: one Axes per pair; None for a new figure.

    Returns:
        the Axes, one per pair.

    Raises:
        ValueError: for no rows, an unknown quantity or another number of Axes than of pairs.
    """
    if not rows:
        raise ValueError("optimizer_comparison: rows is empty, must have at least one result")
    if quantity not in _QUANTITIES:
        raise ValueError(f'optimizer_comparison: "{quantity}" is not known, must be one of {", ".join(_QUANTITIES)}')
    pairs, methods = (list(dict.fromkeys(row[key] for row in rows)) for key in ("pair", "method"))
    own = ax is None
    with report_axes(ax, columns=len(pairs), width=_WIDTHS.get(len(pairs), _WIDEST)) as axes:
        panels = np.atleast_1d(axes)
        if panels.size != len(pairs):
            raise ValueError(
                f"optimizer_comparison: ax has {panels.size} Axes, must have one for each of {len(pairs)} pairs"
            )
        for panel, pair in zip(panels, pairs):
            for index, method in enumerate(methods):
                runs = [row for row in rows if (row["pair"], row["method"]) == (pair, method)]
                panel.plot(*_points(runs, quantity), label=method, zorder=3, **point_style(index))
            panel.set_title(pair, fontsize=FONT)
            panel.set_xlabel(ANALYSES_LABEL)
        panels[0].set_ylabel(_QUANTITIES[quantity])
        _scales(panels, *_points(rows, quantity))
        if own:
            grow(panels[0], legend_over_panels(panels[0].figure, panels[0]))
        else:
            legend_above(panels[0], distance=ABOVE_MARKS)
    return panels


def _points(rows: Sequence[Mapping[str, Any]], quantity: str) -> tuple[np.ndarray, np.ndarray]:
    """Contact analyses, at least one, and what was reached with them; failed runs are left out."""
    spent = np.array([max(row["evaluations"], 1) for row in rows], float)
    reached = np.array([row[quantity] for row in rows], float)
    valid = np.isfinite(reached)
    return spent[valid], reached[valid]


def _scales(panels: np.ndarray, spent: np.ndarray, reached: np.ndarray) -> None:
    """The same scales in all panels."""
    if not spent.size:
        return
    wide = reached.min() > 0 and reached.max() > _WIDE * reached.min()
    limits = (reached.min() / 1.5, 1.5 * reached.max()) if wide else (0.0, 1.08 * max(reached.max(), 1e-9))
    for panel in panels:
        logarithmic(panel, "x", spent)
        panel.set_xlim(spent.min() / 1.6, 1.6 * spent.max())
        if wide:
            logarithmic(panel, "y", reached)
        panel.set_ylim(limits)
