"""Where the flanks meet: base and tip circles, line of action, and the path that contact takes under load."""

import numpy as np
from matplotlib.axes import Axes

from ..contact import MeshCycle
from .figure import GREY, legend_above, line_style, report_axes

_LOADED = 1e-3  # of the total force; a pair with less carries none
_ARC = 400  # points of a circle
_HIGH, _FLAT = 90.0, 0.6  # height of the figure [mm]; height of what is shown over its width
_AIR = 0.35  # about the path of contact, in lengths of it


def meshing_diagram(cycle: MeshCycle, ax: Axes | None = None) -> Axes:
    """Base, tip and pitch point in the transverse plane [mm], and every place where a loaded pair touches.

    On the line of action flanks touch; beyond the points A and E, where a pair touches under load before and after its
    theoretical path, the tip corner of one gear does, on its tip circle. The origin is the pitch point, the pinion
    below; its contact moves to the right.

    Args:
        cycle: solved cycle.
        ax: Axes to draw into; None for a new figure.
    """
    contact, pair = cycle.kinematics.path_of_contact, cycle.kinematics.pair
    base = np.asarray([float(contact.pinion_base_radius), float(contact.wheel_base_radius)])
    tangent = float(contact.pinion_pitch_roll_length) / base[0]
    angle = np.arctan(tangent)
    along = np.array([np.cos(angle), np.sin(angle)])
    # foot of the perpendicular from each centre on the line of action, then the centre
    centres = [np.array([0.0, -base[0] / np.cos(angle)]), np.array([0.0, base[1] / np.cos(angle)])]
    start, end = float(contact.start), float(contact.end)
    path, force = np.asarray(cycle.kinematics.path), np.asarray(cycle.pair_force)
    touched = np.sort(path[force > _LOADED * float(cycle.force)])
    places = np.array([_place(s, along, centres, base, start, end) for s in touched])
    with report_axes(ax, height=_HIGH) as ax:
        turn = np.linspace(0, 2 * np.pi, _ARC * 20)
        for index, (centre, gear, name) in enumerate(zip(centres, (pair.pinion, pair.wheel), ("pinion", "wheel"))):
            for radius, style, kind in ((float(gear.tip_radius), "-", "tip"), (base[index], ":", "base")):
                circle = centre[:, None] + radius * np.stack([np.cos(turn), np.sin(turn)])
                colour = line_style(index + 1)["color"]
                ax.plot(*circle, color=colour, linestyle=style, linewidth=1.0, label=f"{kind} circle, {name}")
        feet = np.stack(
            [-float(contact.pinion_pitch_roll_length) * along, float(contact.wheel_pitch_roll_length) * along]
        )
        ax.plot(*feet.T, color=GREY, linewidth=0.8, label="line of action")
        ax.plot(*places.T, color="black", marker=".", linestyle="", markersize=3.5, label="contact under load")
        for name, position in (("A", start), ("C", 0.0), ("E", end)):
            ax.annotate(name, position * along, xytext=(0, 6), textcoords="offset points", ha="center", color=GREY)
        half = (0.5 + _AIR) * (end - start)
        middle = 0.5 * (start + end) * along
        ax.set_aspect("equal")
        ax.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - _FLAT * half, middle[1] + _FLAT * half))
        ax.set(xlabel="across the line of centres [mm]", ylabel="along the line of centres [mm]")
        legend_above(ax)
    return ax


def _place(position: float, along, centres, base, start: float, end: float) -> np.ndarray:
    """Point of contact [mm] of a pair at a path position: on the line of action, or with a tip corner beyond it."""
    if start <= position <= end:
        return position * along
    # the corner that left the line at its end turns on with its gear
    gear, last = (0, end) if position > end else (1, start)
    turn = (position - last) / base[gear] * (1 if gear else -1)
    arm = last * along - centres[gear]
    rotated = np.array([np.cos(turn) * arm[0] - np.sin(turn) * arm[1], np.sin(turn) * arm[0] + np.cos(turn) * arm[1]])
    return centres[gear] + rotated
