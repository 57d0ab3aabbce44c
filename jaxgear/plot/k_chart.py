"""K-chart: the profile modification over the roll angle."""

from collections.abc import Mapping
from typing import Any

import jax
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..contact import Mesh, Side
from ..manufacture import profile_trace
from ..metrics import flank_surface
from ..microgeometry import AbstractModification, NoModification
from ..tolerance import ToleranceClass
from .flank_panels import Design, Tolerances, flank_panels

_ABOVE_DIAMETERS = 34.0  # [pt]; clears numbers and label of the upper axis


def k_chart(
    mesh: Mesh,
    designs: Mapping[str, Design],
    ax=None,
    *,
    tolerance: Tolerances | None = None,
    about: str | None = None,
) -> np.ndarray:
    """Material removed from pinion and wheel [um] over the roll angle [deg], in the middle of the face.

    From the start of the active profile to the tip; the nominal involute is the zero line, material removed goes down
    as on the print of a gear measuring machine. The diameter [mm] stands on the upper axis.

    Args:
        mesh: prepared mesh.
        designs: (pinion, wheel) modifications by the name of the design; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.
        tolerance: classes of pinion and wheel; shades the total profile tolerance about a design, over the evaluation
            range.
        about: the name of this design; None for the first.

    Returns:
        the two Axes.
    """
    return flank_panels(
        mesh,
        designs,
        ax,
        _profile,
        _over_roll_angle,
        above=_ABOVE_DIAMETERS,
        tolerance=tolerance,
        about=about,
        band=_band,
    )


def _band(side: Side, design: AbstractModification, quality: ToleranceClass):
    trace = profile_trace(side, design, quality)
    inside = np.isfinite(trace.upper)
    return tuple(np.asarray(values)[inside] for values in (trace.roll_angle, -trace.upper, -trace.lower))


def _profile(side: Side, modification: AbstractModification) -> tuple[np.ndarray, np.ndarray]:
    """The active profile in the middle of the face."""
    surface = flank_surface(side, modification)
    return np.asarray(surface.roll_angle), np.asarray(surface.removed)[len(surface.removed) // 2]


def _over_roll_angle(panel: Axes, side: Side, title: str) -> None:
    panel.set_xlabel(f"roll angle of the {title} [deg]")
    surface = jax.tree.map(np.asarray, flank_surface(side, NoModification()))
    base = float(surface.diameter[-1] / np.hypot(1, np.deg2rad(surface.roll_angle[-1])))

    def to_diameter(angle):
        return base * np.hypot(1, np.deg2rad(angle))

    def to_angle(diameter):
        return np.rad2deg(np.sqrt(np.maximum((np.asarray(diameter) / base) ** 2 - 1, 0)))

    upper: Any = panel.secondary_xaxis("top", functions=(to_diameter, to_angle))
    upper.set_xlabel("diameter [mm]", fontsize=panel.xaxis.label.get_fontsize())
    upper.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    upper.tick_params(labelsize=panel.xaxis.label.get_fontsize(), width=0.6, length=3)
