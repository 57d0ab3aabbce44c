"""Lead chart: the modification across the face width."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from ..contact import Mesh, Side
from ..manufacture import helix_trace
from ..metrics import removed_at
from ..microgeometry import AbstractModification
from ..tolerance import ToleranceClass
from .flank_panels import Design, Tolerances, flank_panels

_POINTS = 201  # across the face


def lead_chart(
    mesh: Mesh,
    designs: Mapping[str, Design],
    ax=None,
    *,
    tolerance: Tolerances | None = None,
    about: str | None = None,
) -> np.ndarray:
    """Material removed from pinion and wheel [um] across their own face widths [mm], at the pitch point.

    Material removed goes down, as in the K-chart, which shows the profile in the middle of the face.

    Args:
        mesh: prepared mesh.
        designs: (pinion, wheel) modifications by the name of the design; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.
        tolerance: classes of pinion and wheel; shades the total helix tolerance about a design, over the evaluation
            range.
        about: the name of this design; None for the first.

    Returns:
        the two Axes.
    """
    return flank_panels(mesh, designs, ax, _line, _over_face, tolerance=tolerance, about=about, band=_band)


def _band(side: Side, design: AbstractModification, quality: ToleranceClass):
    trace = helix_trace(side, design, quality)
    inside = np.isfinite(trace.upper)
    return tuple(np.asarray(values)[inside] for values in (trace.face_coordinate, -trace.upper, -trace.lower))


def _line(side: Side, modification: AbstractModification) -> tuple[np.ndarray, np.ndarray]:
    """The flank line through the pitch point."""
    face = jnp.linspace(-0.5, 0.5, _POINTS) * side.face_width
    removed = removed_at(side, modification, jnp.reshape(side.pitch_roll_length, (1,)), face)
    return np.asarray(face), np.asarray(removed)[:, 0]


def _over_face(panel: Axes, side: Side, title: str) -> None:
    panel.set_xlabel(f"face coordinate of the {title} [mm]")
