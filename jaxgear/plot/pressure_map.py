"""Flank pressure over the face width, and over the path of contact or the roll angles of both gears."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable

from ..contact import MeshCycle
from .figure import mark_path, report_axes
from .flank_panels import WIDTH
from .history import PATH_LABEL, pair_history

_FACE_LABEL = "face coordinate [mm]"


def pressure_map(cycle: MeshCycle, ax: Axes | None = None) -> Axes:
    """Hertzian pressure [MPa] of one pair over its path of contact and the face width; white where the flanks part.

    Args:
        cycle: solved cycle, of several slices to show more than one row.
        ax: Axes to draw into; None for a new figure.
    """
    path, face, flank = _pressed(cycle)
    contact = cycle.kinematics.path_of_contact
    with report_axes(ax) as ax:
        _bar(ax, _draw(ax, path, face, flank, None))
        mark_path(ax, contact, zorder=3)
        air = 0.05 * float(contact.base_pitch)
        ax.set_xlim(float(contact.start) - air, float(contact.end) + air)
        ax.set(ylim=(face[0], face[-1]), xlabel=PATH_LABEL, ylabel=_FACE_LABEL)
    return ax


def contact_pattern(cycle: MeshCycle, ax=None) -> np.ndarray:
    """Contact pattern: Hertzian pressure [MPa] over the roll angle and the face width of pinion and wheel.

    Each over the active profile, from its start on the left to the tip on the right; white where the flanks part.

    Args:
        cycle: solved cycle, of several slices to show more than one row.
        ax: two Axes, for pinion and wheel; None for a new figure.

    Returns:
        the two Axes.
    """
    path, face, flank = _pressed(cycle)
    most = float(np.nanmax(flank, initial=0.0))
    with report_axes(ax, columns=2, width=WIDTH) as panels:
        for panel, title, side, sign in zip(panels, ("pinion", "wheel"), cycle.sides, (1.0, -1.0)):
            pitch, base = float(side.pitch_roll_length), float(side.base_radius)
            image = _draw(panel, np.rad2deg((pitch + sign * path) / base), face, flank, most)
            ends = (float(length) for length in (side.start_roll_length, side.tip_roll_length))
            panel.set_xlim(*np.rad2deg(np.array([*ends]) / base))
            panel.set(ylim=(face[0], face[-1]), xlabel=f"roll angle of the {title} [deg]")
        panels[0].set_ylabel(_FACE_LABEL)
        _bar(panels[1], image)
    return np.asarray(panels)


def _pressed(cycle: MeshCycle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of path positions and slices [mm], and the pressure between them [MPa]; NaN where the flanks part."""
    path, flank = pair_history(cycle, cycle.contact_pressure)
    step = path[1] - path[0]
    face = cycle.kinematics.resolution.slice_edges * float(cycle.kinematics.pair.face_width)
    return np.append(path, path[-1] + step) - 0.5 * step, face, np.where(flank > 0, flank, np.nan)


def _draw(ax: Axes, along, face, flank, most: float | None) -> ScalarMappable:
    ax.grid(False)
    # cividis: even in lightness, so that it reads the same in grey and for every kind of colour vision
    return ax.pcolormesh(along, face, flank, cmap="cividis_r", vmin=0, vmax=most)


def _bar(ax: Axes, image: ScalarMappable) -> None:
    bar = ax.figure.colorbar(image, ax=ax, pad=0.02)
    bar.set_label("flank pressure [MPa]")
    bar.ax.tick_params(labelsize=ax.xaxis.label.get_fontsize())
