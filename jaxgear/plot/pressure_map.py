"""Flank pressure over path of contact and face width."""

import numpy as np
from matplotlib.axes import Axes

from ..contact import MeshCycle
from .figure import mark_path, report_axes
from .history import PATH_LABEL, pair_history


def pressure_map(cycle: MeshCycle, ax: Axes | None = None) -> Axes:
    """Hertzian pressure [MPa] of one pair over its path of contact and the face width; white where the flanks part.

    Args:
        cycle: solved cycle, of several slices to show more than one row.
        ax: Axes to draw into; None for a new figure.
    """
    kinematics = cycle.kinematics
    path, flank = pair_history(cycle, cycle.contact_pressure)
    half = 0.5 * float(kinematics.pair.face_width)
    face_edges = np.linspace(-half, half, kinematics.resolution.slices + 1)
    step = path[1] - path[0]
    path_edges = np.append(path, path[-1] + step) - 0.5 * step
    with report_axes(ax) as ax:
        ax.grid(False)
        # cividis: even in lightness, so that it reads the same in grey and for every kind of colour vision
        image = ax.pcolormesh(path_edges, face_edges, np.where(flank > 0, flank, np.nan), cmap="cividis_r", vmin=0)
        bar = ax.figure.colorbar(image, ax=ax, pad=0.02)
        bar.set_label("flank pressure [MPa]")
        bar.ax.tick_params(labelsize=ax.xaxis.label.get_fontsize())
        mark_path(ax, kinematics.path_of_contact, zorder=3)
        air = 0.05 * float(kinematics.path_of_contact.base_pitch)
        ax.set_xlim(float(kinematics.path_of_contact.start) - air, float(kinematics.path_of_contact.end) + air)
        ax.set(ylim=(-half, half), xlabel=PATH_LABEL, ylabel="face coordinate [mm]")
    return ax
