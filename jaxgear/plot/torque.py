"""Transmission error and load over the face over a range of torques."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from .figure import ABOVE_MARKS, GREY, laid_out_size, legend_above, marker_style, report_axes, text_above
from .history import PHASE_LABEL, two_pitches

_DARK, _LIGHT = 0.0, 0.72  # part of the colour map that shows on white


def ppte_over_torque(
    torques, curves: Mapping[str, np.ndarray], ax: Axes | None = None, design_torque: float | None = None
) -> Axes:
    """PPTE [um] of several designs over the torque, with the torque they were designed for.

    Args:
        torques: on the pinion [N m], shape (torques,).
        curves: PPTE [um] by the name of the design, each of shape (torques,).
        ax: Axes to draw into; None for a new figure.
        design_torque: [N m]; None for no mark.
    """
    with report_axes(ax) as ax:
        _over_torque(ax, torques, curves, design_torque)
        ax.set(ylim=(0, None), ylabel="peak-to-peak\ntransmission error [µm]")
    return ax


def face_load_over_torque(
    torques, curves: Mapping[str, np.ndarray], ax: Axes | None = None, design_torque: float | None = None
) -> Axes:
    """Face load factor K_Hbeta of several designs over the torque; 1 is a load that is even over the face.

    Args:
        torques: on the pinion [N m], shape (torques,).
        curves: `metrics.face_load_factor` by the name of the design, each of shape (torques,).
        ax: Axes to draw into; None for a new figure.
        design_torque: [N m]; None for no mark.
    """
    with report_axes(ax) as ax:
        _over_torque(ax, torques, curves, design_torque)
        highest = max((float(np.nanmax(np.asarray(curve))) for curve in curves.values()), default=1.0)
        # an even load lies on the foot of the Axes, and is seen to be even
        ax.set(ylim=(1, 1 + 1.06 * max(highest - 1, 0.1)), ylabel="face load factor K$_{H\\beta}$ [-]")
    return ax


def _over_torque(ax: Axes, torques, curves: Mapping[str, np.ndarray], design_torque: float | None) -> None:
    for index, (name, curve) in enumerate(curves.items()):
        ax.plot(np.asarray(torques), np.asarray(curve), label=name, clip_on=False, **marker_style(index))
    if design_torque is not None:
        ax.axvline(float(design_torque), color=GREY, linewidth=0.8, zorder=0.5)
        text_above(ax, float(design_torque), f"design torque {float(design_torque):g} N m")
    ax.set_xlim(left=0)
    ax.set_xlabel("pinion torque [N m]")
    legend_above(ax, distance=4.0 if design_torque is None else ABOVE_MARKS)


def harris_map(phase, torques, te, ax: Axes | None = None, *, design: str | None = None) -> Axes:
    """Transmission error over two base pitches at several torques (Harris 1958), each curve with its torque at the end.

    Args:
        phase: mesh positions of one base pitch, shape (positions,).
        torques: on the pinion [N m], shape (torques,).
        te: transmission error [um], shape (torques, positions).
        ax: Axes to draw into; None for a new figure.
        design: name of the design, for a title; None for none.
    """
    order = np.argsort(torques)
    torques = np.asarray(torques)[order]
    x, curves = two_pitches(phase, np.asarray(te)[order])
    colours = ScalarMappable(Normalize(0, 1), "viridis").to_rgba(np.linspace(_DARK, _LIGHT, len(torques)))
    with report_axes(ax) as ax:
        for curve, colour in zip(curves, colours):
            ax.plot(x, curve, color=colour, linewidth=1.3)
        ax.set(xlim=(0, 2), xlabel=PHASE_LABEL, ylabel="transmission error [µm]")
        if design is not None:
            ax.set_title(design, loc="left", fontsize=ax.xaxis.label.get_fontsize())
        heights = _spread(curves[:, -1], _line_height(ax))
        for torque, height, colour in zip(torques, heights, colours):
            text = f"{torque:.4g} N m"
            ax.annotate(text, (2, height), xytext=(4, 0), textcoords="offset points", va="center", color=colour)
    return ax


def _line_height(ax: Axes) -> float:
    """Height of a line of text in data units of the ordinate."""
    low, high = ax.get_ylim()
    return 1.15 * ax.yaxis.label.get_fontsize() / laid_out_size(ax)[1] * (high - low)


def _spread(heights, gap: float) -> np.ndarray:
    """Heights moved apart as little as possible so that neighbours keep a gap; their order stays."""
    heights = np.asarray(heights, float)
    order = np.argsort(heights, kind="stable")
    # least squares under y[i+1] - y[i] >= gap is isotonic regression of the heights minus their stacked offsets
    offsets = gap * np.arange(heights.size)
    blocks: list[list[float]] = []
    for value in heights[order] - offsets:
        blocks.append([value])
        while len(blocks) > 1 and np.mean(blocks[-2]) > np.mean(blocks[-1]):
            blocks[-2:] = [blocks[-2] + blocks[-1]]
    spread = np.empty_like(heights)
    spread[order] = np.array([np.mean(block) for block in blocks for _ in block]) + offsets
    return spread
