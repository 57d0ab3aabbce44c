"""Load and gap over the face at one mesh position."""

import numpy as np
from matplotlib.axes import Axes

from ..contact import MeshCycle
from .figure import GREY, legend_above, marker_style, report_axes

_FACE_LABEL = "face coordinate [mm]"


def line_load(cycle: MeshCycle, ax: Axes | None = None, *, position: int | None = None) -> Axes:
    """Line load [N/mm] of every loaded pair over the face at one mesh position, the mean over the face beside it.

    Args:
        cycle: solved cycle of several slices.
        ax: Axes to draw into; None for a new figure.
        position: number of the mesh position; None for that with the largest line load.
    """
    where = _heaviest(cycle)[1] if position is None else position
    load = np.asarray(cycle.line_load)[:, :, where]
    face, width = (np.asarray(of) for of in (cycle.kinematics.face_coordinate, cycle.kinematics.slice_width))
    with report_axes(ax) as ax:
        for index, pair in enumerate(np.flatnonzero(load.max(axis=1) > 0)):
            style = marker_style(index)
            mean = np.average(load[pair], weights=width)
            name = f"pair {_place(cycle, int(pair), where)}, K = {load[pair].max() / mean:.2f}"
            ax.plot(face, load[pair], label=name, **style)
            ax.axhline(mean, color=style["color"], linewidth=0.6, zorder=0.6)
        ax.set(ylim=(0, None), ylabel="line load [N/mm]")
        _finish(ax, cycle, where)
    return ax


def face_gap(cycle: MeshCycle, ax: Axes | None = None, *, position: int | None = None) -> Axes:
    """Gap [um] between the flanks of the most loaded pair over the face at one mesh position, unloaded and under load.

    Unloaded it is that of modifications, misalignment and other meshes on the shafts, from where the flanks touch
    first; on bent shafts the same with what the load of this mesh makes of shafts, bearings and housing, where they
    give way; under load what is left where the flanks do not touch.

    Args:
        cycle: solved cycle of several slices with its mesh, `cycle.on(mesh)`.
        ax: Axes to draw into; None for a new figure.
        position: number of the mesh position; None for that with the largest line load.

    Raises:
        ValueError: for a cycle without its mesh.
    """
    mesh = cycle.mesh_for("face_gap")
    pair, where = _heaviest(cycle)
    if position is not None:
        where = position
        pair = int(np.asarray(cycle.line_load)[:, :, where].max(axis=1).argmax())
    unloaded, opening = (np.asarray(of)[pair, :, where] for of in (mesh.held(cycle.gap), cycle.opening))
    face = np.asarray(cycle.kinematics.face_coordinate)
    curves = {"unloaded": unloaded}
    if mesh.support is not None:
        force = np.asarray(cycle.line_load * mesh.lever[:, None] * mesh.slice_width[:, None])[:, :, where].sum(axis=0)
        bent = np.asarray(mesh.support.influence(mesh.face_coordinate)) @ force
        if bent.any():
            curves["on bent shafts"] = unloaded + float(mesh.lever[pair, where]) * bent
    curves = {name: curve - curve.min() for name, curve in curves.items()}
    curves["under load"] = np.maximum(opening, 0.0)
    with report_axes(ax) as ax:
        for index, (name, curve) in enumerate(curves.items()):
            ax.plot(face, curve, label=name, **marker_style(index))
        ax.set(ylim=(0, None), ylabel="gap [µm]")
        _finish(ax, cycle, where)
    return ax


def _heaviest(cycle: MeshCycle) -> tuple[int, int]:
    """Pair and position with the largest line load."""
    most = np.asarray(cycle.line_load).max(axis=1)
    pair, where = np.unravel_index(int(most.argmax()), most.shape)
    return int(pair), int(where)


def _place(cycle: MeshCycle, pair: int, position: int) -> str:
    return f"{float(np.asarray(cycle.kinematics.path)[pair, position]):+.2f} mm from the pitch point"


def _finish(ax: Axes, cycle: MeshCycle, position: int) -> None:
    half = 0.5 * float(cycle.kinematics.pair.face_width)
    ax.set(xlim=(-half, half), xlabel=_FACE_LABEL)
    ax.axvline(0.0, color=GREY, linewidth=0.4, zorder=0.5)
    legend_above(ax)
