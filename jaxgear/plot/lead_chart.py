"""Lead chart: the modification across the face width."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np

from ..contact import Mesh
from ..metrics import removed_at
from ..microgeometry import NoModification
from .figure import HEIGHT, legend_above, legend_over_panels, line_style, report_axes
from .k_chart import WIDTH, Design, downwards

_POINTS = 201  # across the common face


def lead_chart(mesh: Mesh, designs: Mapping[str, Design], ax=None) -> np.ndarray:
    """Material removed from pinion and wheel [um] across the common face width [mm], at the pitch point.

    Material removed goes down, as in the K-chart, which shows the profile in the middle of the face.

    Args:
        mesh: prepared mesh.
        designs: (pinion, wheel) modifications by the name of the design; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.

    Returns:
        the two Axes.
    """
    own = ax is None
    with report_axes(ax, columns=2, width=WIDTH, height=HEIGHT) as panels:
        for index, (panel, title, side) in enumerate(zip(panels, ("pinion", "wheel"), mesh.sides)):
            face = jnp.linspace(-0.5, 0.5, _POINTS) * side.face_width
            place = jnp.reshape(side.pitch_roll_length, (1,))
            for style, (name, design) in enumerate(designs.items()):
                removed = removed_at(side, design[index] or NoModification(), place, face)
                panel.plot(np.asarray(face), np.asarray(removed)[:, 0], label=name, **line_style(style))
            panel.set(xlim=(float(face[0]), float(face[-1])), xlabel=f"face coordinate of the {title} [mm]")
        panels[0].set_ylabel("material removed [µm]")
        downwards(panels)
        if own:
            legend_over_panels(panels[0].figure, panels[0])
        else:
            legend_above(panels[0])
    return np.asarray(panels)
