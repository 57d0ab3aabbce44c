"""States of the transmission-error iteration."""

from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from ..contact import Mesh
from ..metrics import profile_relief
from ..optimize import Iterate, Optimum
from .figure import ABOVE_MARKS, legend_above, mark_path, report_axes
from .history import PATH_LABEL, PHASE_LABEL, two_pitches

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


def iterations_transmission_error(optimum: Optimum, phase, ax: Axes | None = None) -> Axes:
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


def _style(index: int, count: int) -> dict:
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
