"""Woehler figure of a rating: the S-N lines of both gears with the damage that every load does."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Array
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter, ScalarFormatter

from ..metrics import SNLine
from ..plot.figure import GREY, Panels, captioned, line_style, report_axes
from .chain import PairRating

Load = tuple[float, float, float]

_PANEL, _HEIGHT = 92.0, 72.0  # [mm]
_SHOWN = 0.01  # share of the damage sum from which on a load has its damage as a number
_ROOM = 10.0  # of cycles on both sides of the lines
_MOST = 12  # loads with a number
_COLUMN, _SPACING = 0.015, 0.065  # place of the numbers and least distance of two, in parts of the axes
_TICKS = 1.0, 1.5, 2.0, 3.0, 5.0, 7.0  # of a decade


@captioned(
    "Woehler lines of flanks and roots, and the loads at their cycles and stresses, with load factors. A load does the "
    "damage whose number stands at the left, from 1 % of the sum on; hollow marks do none."
)
def woehler(found: PairRating, axes: Panels | None = None) -> Panels:
    """S-N lines over load cycles, flank over root and pinion beside wheel, with the loads of the spectrum or the load.

    Args:
        found: rating with a service life.
        axes: four Axes; None for a new figure.
    """
    spectrum, shown = found.spectrum, []
    modes = ("flank", "H", found.pitting, found.flank_lines), ("tooth root", "F", found.bending, found.root_lines)
    with report_axes(axes, columns=2, rows=2, width=2 * _PANEL, height=2 * _HEIGHT) as panels:
        for row, (words, index, verdict, lines) in enumerate(modes):
            loads: tuple[Array, ...] = verdict.stress[:, None], verdict.damage[:, None], found.cycles[:, None]
            if spectrum is not None:
                stresses = spectrum.contact_stress, spectrum.root_stress
                loads = stresses[row], (spectrum.pitting_damage, spectrum.root_damage)[row], spectrum.cycles
            for gear, name in enumerate(("pinion", "wheel")):
                panel = panels[2 * row + gear]
                _line(panel, lines[gear])
                shown.append((panel, _loads(panel, lines[gear], *(np.asarray(of[gear]) for of in loads))))
                total, safety = float(verdict.damage[gear]), float(verdict.safety[gear])
                title = f"{name} {words}: $U_{index}$ = {total:.3g}, $S_{index}$ = {safety:.2f}"
                panel.set_title(title, fontsize="medium", loc="left")
            panels[2 * row].set_ylabel(rf"stress $\sigma_{index}$ [MPa]")
        for panel in panels[2:]:
            panel.set_xlabel("load cycles [-]")
        for panel, numbered in shown:  # once all panels have their ranges, which those of a row share
            _numbers(panel, numbered)
    return panels


def _line(panel: Axes, line: SNLine) -> None:
    cycles, stress = np.asarray(line.cycles), np.asarray(line.stress)
    at = [cycles[0] / _ROOM, *cycles, cycles[-1] * _ROOM]
    panel.loglog(at, [stress[0], *stress, stress[-1]], **line_style(0))
    panel.plot(cycles, stress, ".", color=line_style(0)["color"], markersize=4)
    panel.yaxis.set_minor_formatter(NullFormatter())


def _loads(panel: Axes, line: SNLine, stress: np.ndarray, damage: np.ndarray, cycles: np.ndarray) -> list[Load]:
    """Marks of the loads, with their ways to the line; cycles, stress and damage of those to be numbered."""
    run = (cycles > 0) & (stress > 0)
    does = run & (damage > 0)
    ends = np.exp(np.asarray(line.log_cycles(stress)))
    panel.hlines(stress[does], cycles[does], ends[does], color=GREY, linewidth=0.8)
    mark = {"color": line_style(1)["color"], "linestyle": "", "marker": "o", "markersize": 5.0}
    panel.plot(cycles[does], stress[does], **mark)
    panel.plot(cycles[run & ~does], stress[run & ~does], **{**mark, "markerfacecolor": "white"})
    low, high = min(line.stress[-1], *stress[run]), max(line.stress[0], *stress[run])
    ticks = [digit * 10.0**power for power in range(6) for digit in _TICKS]
    panel.set_yticks([tick for tick in ticks if 0.8 * low <= tick <= 1.25 * high])
    panel.yaxis.set_major_formatter(ScalarFormatter())
    shown = np.flatnonzero(does & (damage >= _SHOWN * np.sum(damage)))
    shown = shown[np.argsort(-damage[shown])][:_MOST]
    return [(cycles[at], stress[at], damage[at]) for at in sorted(shown, key=lambda at: -stress[at])]


def _numbers(panel: Axes, loads: Sequence[Load]) -> None:
    """Damages in a column at the left, each beside its load as far as the one above leaves room."""
    above = 1.0
    for cycles, stress, damage in loads:
        _, wanted = panel.transAxes.inverted().transform(panel.transData.transform((cycles, stress)))
        above = min(wanted, above - _SPACING)
        place = {"xytext": (_COLUMN, above), "textcoords": "axes fraction", "va": "center"}
        leader = {"arrowstyle": "-", "color": GREY, "linewidth": 0.6, "linestyle": ":", "shrinkB": 3.0}
        panel.annotate(f"{damage:.2g}", (cycles, stress), fontsize="small", arrowprops=leader, **place)
