"""Worn flanks, and quantities of the mesh over the wear history."""

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes

from ..contact import MeshCycle
from ..geometry import roll_angle
from ..metrics import Quantity
from ..vocabulary import quantity_of
from ..wear import WearHistory, over_life, wear_depth
from .figure import legend_above, line_style, marker_style, report_axes, styled
from .variants import meaning_label

_GEARS = "pinion", "wheel"
_SHOWN = 4  # time steps


def worn_flank(life: WearHistory, gear: Literal["pinion", "wheel"], ax: Axes | None = None, *, title: str = "") -> Axes:
    """Wear depth [um] of one gear over its roll angle [deg] at several time steps, in the line that is worn deepest.

    Material removed goes down, as in the K-chart.

    Args:
        life: wear history of the pair.
        gear: "pinion" or "wheel".
        ax: Axes to draw into; None for a new figure.
        title: title of the Axes.

    Raises:
        ValueError: for another gear.
    """
    if gear not in _GEARS:
        raise ValueError(f'gear = {gear!r} must be "pinion" or "wheel"')
    number = _GEARS.index(gear)
    depths = np.asarray((life.pinion_depth, life.wheel_depth)[number])
    line = int(depths[-1].max(axis=-1).argmax())
    angle = np.asarray(roll_angle(life.gears[number], life.roll_length[number]))
    shown = np.unique(np.linspace(1, len(depths) - 1, _SHOWN).round().astype(int))
    with report_axes(ax) as ax:
        for index, each in enumerate(shown):
            label = f"{float(life.revolutions[each]):.3g} revolutions"
            ax.plot(angle, depths[each, line], label=label, **line_style(index))
        if not ax.yaxis_inverted():  # panels share it
            ax.invert_yaxis()
        ax.set(xlabel=f"roll angle of the {gear} [deg]", ylabel="wear depth [µm]", title=title)
        legend_above(ax) if not title else ax.legend(frameon=False, loc="best")
    return ax


def wear_history(
    of: Mapping[str, WearHistory],
    quantity: str | Quantity | Callable[[MeshCycle], Any] = "ppte",
    ax: Axes | None = None,
) -> Axes:
    """A quantity of several designs over the revolutions of the pinion.

    Args:
        of: wear histories by the name of the design; up to eight differ in style.
        quantity: "wear_depth" for the deepest wear of both gears, a name of the vocabulary, a `Quantity`, or a
            function of a cycle.
        ax: Axes to draw into; None for a new figure.
    """
    known = quantity_of(quantity)
    with report_axes(ax) as ax:
        for index, name, life in styled(of):
            values = wear_depth(life) if quantity == "wear_depth" else over_life(life, known)
            done = np.asarray(life.revolutions)
            every = max(1, len(done) // 10)
            ax.plot(done, np.asarray(values), label=name, markevery=every, **marker_style(index))
        ax.set(xlabel="revolutions of the pinion", ylabel=meaning_label(known))
        ax.set_xlim(left=0)
        legend_above(ax)
    return ax
