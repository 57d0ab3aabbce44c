"""What is removed all over the flanks of both gears."""

import jax
import numpy as np

from ..contact import Mesh
from ..metrics import flank_surface
from ..microgeometry import NoModification
from .figure import HEIGHT, report_axes
from .flank_panels import WIDTH, Design

_LEVELS = 9


def topography(mesh: Mesh, design: Design, ax=None) -> np.ndarray:
    """Material removed [um] from pinion and wheel over roll angle [deg] and face coordinate [mm], as contours.

    Args:
        mesh: prepared mesh.
        design: (pinion, wheel) modifications; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.

    Returns:
        the two Axes.
    """
    flanks = zip(mesh.sides, design)
    surfaces = [jax.tree.map(np.asarray, flank_surface(side, flank or NoModification())) for side, flank in flanks]
    low = min(surface.removed.min() for surface in surfaces)
    high = max(surface.removed.max() for surface in surfaces)
    levels = np.linspace(low, high if high > low else low + 1.0, _LEVELS)
    with report_axes(ax, columns=2, width=WIDTH, height=HEIGHT) as panels:
        for panel, title, surface in zip(panels, ("pinion", "wheel"), surfaces):
            panel.grid(False)
            places = surface.roll_angle, surface.face_coordinate, surface.removed
            filled = panel.contourf(*places, levels=levels, cmap="cividis_r")
            panel.contour(*places, levels=levels[1:], colors="black", linewidths=0.3)
            panel.set_xlabel(f"roll angle of the {title} [deg]")
        panels[0].set_ylabel("face coordinate [mm]")
        bar = panels[0].figure.colorbar(filled, ax=list(panels), pad=0.02, format="%.3g")
        bar.set_label("material removed [µm]")
        bar.ax.tick_params(labelsize=panels[0].xaxis.label.get_fontsize())
    return np.asarray(panels)
