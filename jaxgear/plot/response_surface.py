"""Transmission error over mesh phase and torque."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from .figure import FONT, laid_out_size, legend_above, report_axes
from .history import PHASE_LABEL, two_pitches

_LEVELS = 11
_EDGE = 0.04  # part of the Axes along its edges that is too close for a label


def response_surface(
    phase,
    torques,
    te,
    unloaded,
    ax: Axes | None = None,
    *,
    design_torque: float | None = None,
    design: str | None = None,
) -> Axes:
    """Transmission error [um] as a surface over mesh phase and torque, with the unloaded one at its foot.

    Args:
        phase: mesh positions of one base pitch, shape (positions,).
        torques: on the pinion [N m], such as up to twice the design torque; shape (torques,).
        te: transmission error [um], shape (torques, positions).
        unloaded: transmission error at vanishing load [um], shape (positions,).
        ax: Axes to draw into; None for a new figure.
        design_torque: [N m], drawn as a line; None for none.
        design: name of the design, for a title; None for none.
    """
    torques, te = np.asarray(torques, float), np.asarray(te, float)
    loaded = np.argsort(torques)
    loaded = loaded[torques[loaded] > 0]
    rows = np.concatenate([[0.0], torques[loaded]])
    x, surface = two_pitches(phase, np.concatenate([np.asarray(unloaded, float)[None], te[loaded]]))
    levels = MaxNLocator(_LEVELS).tick_values(surface.min(), surface.max())
    with report_axes(ax) as ax:
        ax.grid(False)
        # cividis: even in lightness, so that it reads the same in grey and for every kind of colour vision
        image = ax.contourf(x, rows, surface, levels, cmap="cividis")
        bar = ax.figure.colorbar(image, ax=ax, pad=0.02)
        bar.set_label("transmission error [µm]")
        bar.ax.tick_params(labelsize=ax.xaxis.label.get_fontsize())
        ax.set(xlim=(0, 2), ylim=(0, rows[-1]), xlabel=PHASE_LABEL, ylabel="pinion torque [N m]")
        if design_torque is not None:
            text = f"design torque {float(design_torque):g} N m"
            ax.axhline(float(design_torque), color="black", linewidth=1.2, linestyle=(0, (4, 2)), label=text)
            legend_above(ax)
        if design is not None:
            pad = 24.0 if design_torque is not None else 6.0  # [pt], above the legend
            ax.set_title(design, loc="left", pad=pad, fontsize=ax.xaxis.label.get_fontsize())
        _labelled_lines(ax, x, rows, surface, levels)
    return ax


def _labelled_lines(ax: Axes, x, rows, surface, levels) -> None:
    middle = 0.5 * (levels[0] + levels[-1])
    colours = ["white" if level < middle else "black" for level in levels]
    lines = ax.contour(x, rows, surface, levels, colors=colours, linewidths=0.6)
    laid_out_size(ax)  # labels find their places in the size in which the Axes are drawn
    places = [place for path in lines.get_paths() for place in _label_place(path.vertices, rows[-1])]
    if places:
        ax.clabel(lines, fmt=lambda level: f"{level:g}", fontsize=FONT - 1, manual=places)


def _label_place(points, highest: float) -> list:
    """The point of a contour nearest to the middle of the two pitches; none for contours along the edges."""
    x, y = points.T / np.array([[2.0], [highest]])
    inside = points[(np.minimum(x, 1 - x) > _EDGE) & (np.minimum(y, 1 - y) > _EDGE)]
    return [tuple(inside[np.argmin(np.abs(inside[:, 0] - 1))])] if len(inside) else []
