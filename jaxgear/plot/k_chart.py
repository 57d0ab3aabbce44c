"""K-chart: the profile modification over the roll angle."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..contact import Mesh
from ..geometry import Gear, roll_angle
from ..microgeometry import AbstractModification, Flank, NoModification
from .figure import HEIGHT, legend_above, legend_over_panels, line_style, report_axes

_POINTS = 201  # over the active profile
WIDTH = 150.0  # of the two panels together [mm]
_ABOVE_DIAMETERS = 34.0  # [pt]; clears numbers and label of the upper axis

Design = tuple[AbstractModification | None, AbstractModification | None]


def k_chart(mesh: Mesh, designs: Mapping[str, Design], ax=None) -> np.ndarray:
    """Material removed from pinion and wheel [um] over the roll angle [deg], in the middle of the face.

    From the start of the active profile to the tip; the nominal involute is the zero line, material removed goes down
    as on the print of a gear measuring machine. The diameter [mm] stands on the upper axis.

    Args:
        mesh: prepared mesh.
        designs: (pinion, wheel) modifications by the name of the design; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.

    Returns:
        the two Axes.
    """
    own = ax is None
    with report_axes(ax, columns=2, width=WIDTH, height=HEIGHT) as panels:
        contact, pair = mesh.path_of_contact, mesh.pair
        sides = (
            ("pinion", pair.pinion, contact.pinion_roll_length(contact.start)),
            ("wheel", pair.wheel, contact.wheel_roll_length(contact.end)),
        )
        for side, (panel, (title, gear, start)) in enumerate(zip(panels, sides)):
            flank = _profile(gear, start, pair.face_width)
            angle = np.asarray(roll_angle(gear, flank.roll_length))
            for index, (name, design) in enumerate(designs.items()):
                removed = (design[side] or NoModification())(flank)
                panel.plot(angle, np.broadcast_to(removed, angle.shape), label=name, **line_style(index))
            panel.set(xlim=(angle[0], angle[-1]), xlabel=f"roll angle of the {title} [deg]")
            _diameter_axis(panel, gear)
        panels[0].set_ylabel("material removed [µm]")
        downwards(panels)
        if own:
            legend_over_panels(panels[0].figure, panels[0])
        else:
            legend_above(panels[0], distance=_ABOVE_DIAMETERS)
    return np.asarray(panels)


def _profile(gear: Gear, start, face_width) -> Flank:
    """Equally spaced points of the active profile, in the middle of the face."""
    return Flank(
        roll_length=jnp.linspace(start, gear.tip_roll_length, _POINTS),
        tip_roll_length=gear.tip_roll_length,
        start_roll_length=start,
        base_radius=gear.base_radius,
        face_coordinate=jnp.zeros_like(gear.base_radius),
        face_width=face_width,
    )


def _diameter_axis(panel: Axes, gear: Gear) -> None:
    base = 2 * float(gear.base_radius)

    def to_diameter(angle):
        return base * np.hypot(1, np.deg2rad(angle))

    def to_angle(diameter):
        return np.rad2deg(np.sqrt(np.maximum((np.asarray(diameter) / base) ** 2 - 1, 0)))

    upper: Any = panel.secondary_xaxis("top", functions=(to_diameter, to_angle))
    upper.set_xlabel("diameter [mm]", fontsize=panel.xaxis.label.get_fontsize())
    upper.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    upper.tick_params(labelsize=panel.xaxis.label.get_fontsize(), width=0.6, length=3)


def downwards(panels) -> None:
    """One common ordinate that points down and has the nominal involute in sight."""
    lines = [line.get_ydata() for panel in panels for line in panel.lines]
    values = np.concatenate([[0.0], *lines])
    low, high = values.min(), max(values.max(), values.min() + 1.0)
    air = 0.06 * (high - low)
    for panel in panels:
        panel.set_ylim(high + air, low - air)
