"""K-chart: the profile modification over the roll angle."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..contact import Mesh, Side
from ..geometry import roll_angle
from ..microgeometry import AbstractModification
from ..numerics import program
from .flank_panels import Design, flank_panels

_POINTS = 201  # over the active profile
_ABOVE_DIAMETERS = 34.0  # [pt]; clears numbers and label of the upper axis


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
    return flank_panels(mesh, designs, ax, _profile, _over_roll_angle, above=_ABOVE_DIAMETERS)


def _profile(side: Side, modification: AbstractModification) -> tuple[np.ndarray, np.ndarray]:
    """The active profile in the middle of the face."""
    angle, removed = _over_profile(side, modification)
    return np.asarray(angle), np.asarray(removed)


@program
def _over_profile(side: Side, modification: AbstractModification):
    rho = jnp.linspace(side.start_roll_length, side.tip_roll_length, _POINTS)
    removed = modification(side.flank(rho, jnp.zeros_like(side.face_width)))
    return roll_angle(side.gear, rho), jnp.broadcast_to(removed, rho.shape)


def _over_roll_angle(panel: Axes, side: Side, title: str) -> None:
    panel.set_xlabel(f"roll angle of the {title} [deg]")
    base = 2 * float(side.base_radius)

    def to_diameter(angle):
        return base * np.hypot(1, np.deg2rad(angle))

    def to_angle(diameter):
        return np.rad2deg(np.sqrt(np.maximum((np.asarray(diameter) / base) ** 2 - 1, 0)))

    upper: Any = panel.secondary_xaxis("top", functions=(to_diameter, to_angle))
    upper.set_xlabel("diameter [mm]", fontsize=panel.xaxis.label.get_fontsize())
    upper.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    upper.tick_params(labelsize=panel.xaxis.label.get_fontsize(), width=0.6, length=3)
