"""Grinding: the wheel in its tooth space, how far a dressed wheel is from the design, and what is ground off."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from ..contact import Side
from ..geometry import outline
from ..microgeometry import AbstractModification
from ..plot.figure import GREY, PALE, legend_above, line_style, report_axes
from .spline import WheelSpline
from .wheel import wheel_profile

_FILLET_POINTS = 60
_ABOVE_TIP = 0.15  # of the tooth depth; how far the wheel is drawn beyond the tip circle
_WHEEL = "#0072B2"
_SQUARE = 90.0  # width and height of the tooth space [mm]
_BAR = 0.6
_CATEGORY_HEIGHT, _FRAME_HEIGHT = 9.0, 18.0  # of a figure of bars [mm]


def tooth_space(side: Side, modification: AbstractModification, ax: Axes | None = None) -> Axes:
    """A form-grinding wheel in the tooth space of a gear, in the frame of the wheel [mm], both to scale.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        modification: modification of both flanks; micrometres of it do not show, see `wheel_deviation`.
        ax: Axes to draw into; None for a new figure.
    """
    profile = wheel_profile(side, modification)
    x, y = np.asarray(profile.x), np.asarray(profile.y)
    tooth_x, tooth_y = _space(side, np.pi / float(side.gear.teeth))
    depth = float(side.gear.tip_radius - side.gear.root_circle_radius)
    end = y[-1] + _ABOVE_TIP * depth
    with report_axes(ax, width=_SQUARE, height=_SQUARE) as ax:
        for sign in (-1, 1):
            ax.fill(sign * tooth_x, tooth_y, color=PALE, linewidth=0, label="gear" if sign > 0 else None)
        # below its active profile the wheel is rounded down to the root circle
        round_off = np.linspace(0, np.pi, _FILLET_POINTS)
        wheel_x = np.concatenate([-x, [-x[-1], x[-1]], x[::-1], x[0] * np.cos(round_off)])
        wheel_y = np.concatenate([y, [end, end], y[::-1], y[0] * (1 - np.sin(round_off))])
        ax.fill(wheel_x, wheel_y, facecolor=_WHEEL, alpha=0.25, linewidth=0)
        for sign in (-1, 1):
            ax.plot(sign * x, y, color=_WHEEL, linewidth=1.6, label="active profile of the wheel" if sign > 0 else None)
        ax.plot([0, 0], [0, end], color=GREY, linewidth=0.6, linestyle=(0, (12, 3, 2, 3)))
        ax.set(xlabel="x across the wheel [mm]", ylabel="y from its outer diameter [mm]")
        ax.set_aspect("equal", adjustable="datalim")
        legend_above(ax)
    return ax


def wheel_deviation(splines: Mapping[str, WheelSpline], ax: Axes | None = None, *, limit: float | None = 1.0) -> Axes:
    """Deviation of dressed wheels from the design [um] over the roll length [mm], positive where too much is removed.

    Args:
        splines: splines by name, of one gear.
        ax: Axes to draw into; None for a new figure.
        limit: that is not to be passed on either side [um]; None for none.
    """
    with report_axes(ax) as ax:
        for index, (name, spline) in enumerate(splines.items()):
            label = f"{name} ({float(spline.largest):.2g} µm)"
            ax.plot(np.asarray(spline.roll_length), np.asarray(spline.deviation), label=label, **line_style(index))
        if limit is not None:
            for value in (-limit, limit):
                ax.axhline(value, color=GREY, linewidth=0.8, linestyle=(0, (2, 2)))
        ends = [np.asarray(spline.roll_length)[[0, -1]] for spline in splines.values()]
        ax.set(xlim=(min(low for low, _ in ends), max(high for _, high in ends)))
        ax.set(xlabel="roll length [mm]", ylabel="removed beyond the design [µm]")
        legend_above(ax)
    return ax


def volumes(removed: Mapping[str, float], ax: Axes | None = None) -> Axes:
    """Volumes ground off one gear [mm3] as bars with their numbers, in the order given from the top.

    Args:
        removed: volumes by name.
        ax: Axes to draw into; None for a new figure.
    """
    names, values = list(removed), np.asarray([float(value) for value in removed.values()])
    with report_axes(ax, height=_FRAME_HEIGHT + _CATEGORY_HEIGHT * len(names)) as ax:
        ax.grid(False)
        bars = ax.barh(np.arange(len(names)), values, _BAR, color=_WHEEL)
        ax.bar_label(bars, [f"{value:.1f}" for value in values], padding=3)
        ax.set_yticks(np.arange(len(names)), names)
        ax.invert_yaxis()
        ax.set(xlabel="volume ground off one gear [mm³]", xlim=(0, 1.12 * max(values.max(), 1e-9)))
    return ax


def _space(side: Side, half_pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """The material at positive x in the frame of the wheel [mm]: half a tooth and the rim below half the space."""
    drawn = outline(side.gear)
    rolls = jnp.linspace(side.gear.tip_roll_length, drawn.form_roll_length, _FILLET_POINTS)
    angles = jnp.linspace(drawn.junction, jnp.pi / 2, _FILLET_POINTS)
    parts = drawn.curves.over(rolls.shape).involute(rolls), drawn.curves.over(angles.shape).trochoid(angles)
    x, y = (np.concatenate(both) for both in zip(*parts))
    radius, turned = np.hypot(x, y), half_pitch - np.arctan2(x, y)
    root, tip = float(side.gear.root_circle_radius), float(side.gear.tip_radius)
    rim = root - 0.3 * (tip - root)
    radius = np.concatenate([[rim, tip], radius, [root, rim]])
    turned = np.concatenate([[half_pitch, half_pitch], turned, [0.0, 0.0]])
    return radius * np.sin(turned), radius * np.cos(turned) - root
