"""Transmission error over whole revolutions, and its orders."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ..revolution import Revolution, Teeth, named_orders
from ..revolution.orders import amplitudes
from .figure import WIDTH, captioned, legend_above, line_style, report_axes, styled, text_above

_KINDS = {"mesh": ("o", 0), "shaft order": ("s", 2), "side band": ("^", 1), "ghost order": ("D", 3)}  # mark, style
_FURTHER = "#B0B0B0"  # colour of lines without a name
_DECADES = 3.5  # below the largest amplitude
_BEYOND = 0.55  # mesh orders behind the last one that is named


@captioned("Transmission error over the first revolution of the gear with more teeth.")
def revolution(of: Mapping[str, Revolution], ax: Axes | None = None) -> Axes:
    """Transmission error [um] of several designs over the first revolution of the gear with more teeth.

    Args:
        of: revolutions by the name of the design; of fewer windows all of them.
        ax: Axes to draw into; None for a new figure.
    """
    with report_axes(ax, width=1.4 * WIDTH) as ax:
        for index, name, found in styled(of):
            gear = int(np.argmax(found.teeth))
            shown = min(found.windows, found.teeth[gear]) * found.cycles.phase.shape[-1]
            turned = np.asarray(found.phase[:shown]) / found.teeth[gear]
            ax.plot(
                turned,
                np.asarray(found.transmission_error[:shown]),
                label=name,
                **{**line_style(index), "linewidth": 0.9},
            )
            ax.set(xlabel=f"revolutions of the {('pinion', 'wheel')[gear]} [-]", ylabel="transmission error [µm]")
        ax.margins(x=0.0)
        legend_above(ax)
    return ax


def order_spectrum(
    found: Revolution, teeth: Teeth, ax: Axes | None = None, *, harmonics: int = 2, title: str = ""
) -> Axes:
    """Amplitudes of the transmission error [um] over the order of the pinion, each line labelled by its cause.

    Args:
        found: revolution of one design.
        teeth: that it was solved for.
        ax: Axes to draw into; None for a new figure.
        harmonics: harmonics of the mesh that are shown.
        title: title of the Axes.
    """
    amplitude = amplitudes(found.transmission_error)
    order = np.arange(len(amplitude)) * found.teeth[0] / found.windows
    last = min((harmonics + _BEYOND) * found.teeth[0], order[-1])
    named = [line for line in named_orders(found, teeth, harmonics) if line.pinion_order <= last]
    shown = (order > 0) & (order <= last)
    bottom = 10**-_DECADES * max(amplitude[shown].max(), np.finfo(float).tiny)
    with report_axes(ax, width=1.4 * WIDTH) as ax:
        ax.vlines(order[shown], bottom, np.maximum(amplitude[shown], bottom), color=_FURTHER, linewidth=0.4)
        for kind, (mark, style) in _KINDS.items():
            lines = [line for line in named if line.name.endswith(kind) and line.amplitude > bottom]
            if not lines:
                continue
            colour = line_style(style)["color"]
            at, high = [line.pinion_order for line in lines], [line.amplitude for line in lines]
            ax.vlines(at, bottom, high, color=colour, linewidth=1.0)
            ax.plot(at, high, linestyle="", marker=mark, markersize=4.0, color=colour, label=_plural(kind))
        for number in range(1, harmonics + 1):
            text_above(ax, number * found.teeth[0], f"{number if number > 1 else ''}z")
        ax.set_yscale("log")
        ax.set_ylim(bottom=bottom)
        ax.set(xlim=(0.0, last), xlabel="order of the pinion [-]", ylabel="amplitude of the\ntransmission error [µm]")
        if title:
            ax.set_title(title, loc="left", pad=14.0)
        legend_above(ax, distance=16.0) if not title else ax.legend(frameon=False, loc="upper right")
    return ax


def _plural(kind: str) -> str:
    return "mesh orders" if kind == "mesh" else f"{kind}s"
