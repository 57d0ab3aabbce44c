"""Two panels of material removed, pinion beside wheel, as on the print of a gear measuring machine."""

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.axes import Axes

from ..contact import Mesh, Side
from ..microgeometry import AbstractModification, NoModification
from ..tolerance import ToleranceClass
from .figure import ABOVE, HEIGHT, PALE, legend_above, legend_over_panels, line_style, report_axes

WIDTH = 150.0  # of the two panels together [mm]
_BAND = "ISO 1328 tolerance about "  # the name of the design

Design = tuple[AbstractModification | None, AbstractModification | None]
Tolerances = tuple[ToleranceClass | None, ToleranceClass | None]


# abscissa and material removed [um] of a flank, of one shape
Trace = Callable[[Side, AbstractModification], tuple[np.ndarray, np.ndarray]]
# the band of the tolerance about a flank of a class: abscissa, lower and upper limit of the material removed [um]
Band = Callable[[Side, AbstractModification, ToleranceClass], tuple[np.ndarray, np.ndarray, np.ndarray]]
# labels the abscissa of the panel of one gear, "pinion" or "wheel"
Frame = Callable[[Axes, Side, str], None]


def flank_panels(
    mesh: Mesh,
    designs: Mapping[str, Design],
    ax,
    trace: Trace,
    frame: Frame,
    *,
    above: float = ABOVE,
    tolerance: Tolerances | None = None,
    about: str | None = None,
    band: Band | None = None,
) -> np.ndarray:
    """The two Axes: material removed goes down, and the nominal involute is the zero line.

    Args:
        mesh: prepared mesh.
        designs: (pinion, wheel) modifications by the name of the design; None for the nominal involute.
        ax: two Axes, for pinion and wheel; None for a new figure.
        trace: one line.
        frame: labels of one panel.
        above: distance of a legend from a panel of a given figure [pt].
        tolerance: classes of pinion and wheel, for a band about a design.
        about: the name of this design; None for the first.
        band: what makes it of one panel.
    """
    own = ax is None
    with report_axes(ax, columns=2, width=WIDTH, height=HEIGHT) as panels:
        for index, (panel, title, side) in enumerate(zip(panels, ("pinion", "wheel"), mesh.sides)):
            for style, (name, design) in enumerate(designs.items()):
                abscissa, removed = trace(side, design[index] or NoModification())
                panel.plot(abscissa, removed, label=name, **line_style(style))
                panel.set_xlim(abscissa[0], abscissa[-1])
            quality = tolerance[index] if tolerance else None
            if band is not None and quality is not None:
                name = next(iter(designs)) if about is None else about
                middle = designs[name][index] or NoModification()
                place, low, high = band(side, middle, quality)
                panel.fill_between(place, low, high, color=PALE, zorder=0.4, linewidth=0, label=f"{_BAND}{name}")
            frame(panel, side, title)
        panels[0].set_ylabel("material removed [µm]")
        _downwards(panels)
        if own:
            legend_over_panels(panels[0].figure, panels[0])
        else:
            legend_above(panels[0], distance=above)
    return np.asarray(panels)


def _downwards(panels) -> None:
    """One common ordinate that points down and has the nominal involute in sight."""
    lines = [line.get_ydata() for panel in panels for line in panel.lines]
    bands = [path.vertices[:, 1] for panel in panels for band in panel.collections for path in band.get_paths()]
    values = np.concatenate([[0.0], *lines, *bands])
    low, high = values.min(), max(values.max(), values.min() + 1.0)
    air = 0.06 * (high - low)
    for panel in panels:
        panel.set_ylim(high + air, low - air)
