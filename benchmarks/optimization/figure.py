"""The picture of the comparison of optimizers."""

from collections.abc import Mapping, Sequence

import numpy as np

from jaxgear.plot.figure import (
    ABOVE_MARKS,
    FONT,
    Panels,
    grow,
    legend_above,
    legend_over_panels,
    point_style,
    report_axes,
)
from jaxgear.plot.front import ANALYSES_LABEL, logarithmic

_QUANTITIES = {
    "ppte_um": "peak-to-peak\ntransmission error [µm]",
    "worst_over_torque_um": "worst peak-to-peak\ntransmission error over torque [µm]",
    "quantile95_um": "peak-to-peak transmission\nerror, 95 % of the gears [µm]",
}
_WIDTHS = {1: 120.0, 2: 150.0}  # of all panels together [mm]
_WIDEST = 180.0
_WIDE = 20.0  # largest over smallest value from which the ordinate is logarithmic


def optimizer_comparison(
    rows: Sequence[Mapping[str, str | float]], quantity: str = "ppte_um", ax: Panels | None = None
) -> np.ndarray:
    """What every method reached over the contact analyses it spent, one panel per gear pair.

    Args:
        rows: results, each with "method", "pair", "evaluations" and the quantity; several rows of a method and a pair
            are several runs.
        quantity: "ppte_um", "worst_over_torque_um" or "quantile95_um".
        ax: one Axes per pair; None for a new figure.

    Returns:
        the Axes, one per pair.

    Raises:
        ValueError: for no rows, an unknown quantity or another number of Axes than of pairs.
    """
    if not rows:
        raise ValueError("optimizer_comparison: rows is empty, must have at least one result")
    if quantity not in _QUANTITIES:
        raise ValueError(f'optimizer_comparison: "{quantity}" is not known, must be one of {", ".join(_QUANTITIES)}')
    pairs, methods = (list(dict.fromkeys(row[key] for row in rows)) for key in ("pair", "method"))
    own = ax is None
    with report_axes(ax, columns=len(pairs), width=_WIDTHS.get(len(pairs), _WIDEST)) as axes:
        panels = np.atleast_1d(axes)
        if panels.size != len(pairs):
            raise ValueError(
                f"optimizer_comparison: ax has {panels.size} Axes, must have one for each of {len(pairs)} pairs"
            )
        for panel, pair in zip(panels, pairs):
            for index, method in enumerate(methods):
                runs = [row for row in rows if (row["pair"], row["method"]) == (pair, method)]
                panel.plot(*_points(runs, quantity), label=method, zorder=3, **point_style(index))
            panel.set_title(pair, fontsize=FONT)
            panel.set_xlabel(ANALYSES_LABEL)
        panels[0].set_ylabel(_QUANTITIES[quantity])
        _scales(panels, *_points(rows, quantity))
        if own:
            grow(panels[0], legend_over_panels(panels[0].figure, panels[0]))
        else:
            legend_above(panels[0], distance=ABOVE_MARKS)
    return panels


def _points(rows: Sequence[Mapping[str, str | float]], quantity: str) -> tuple[np.ndarray, np.ndarray]:
    """Contact analyses, at least one, and what was reached with them; failed runs are left out."""
    spent = np.array([max(row["evaluations"], 1) for row in rows], float)
    reached = np.array([row[quantity] for row in rows], float)
    valid = np.isfinite(reached)
    return spent[valid], reached[valid]


def _scales(panels: np.ndarray, spent: np.ndarray, reached: np.ndarray) -> None:
    """The same scales in all panels."""
    if not spent.size:
        return
    wide = reached.min() > 0 and reached.max() > _WIDE * reached.min()
    limits = (reached.min() / 1.5, 1.5 * reached.max()) if wide else (0.0, 1.08 * max(reached.max(), 1e-9))
    for panel in panels:
        logarithmic(panel, "x", spent)
        panel.set_xlim(spent.min() / 1.6, 1.6 * spent.max())
        if wide:
            logarithmic(panel, "y", reached)
        panel.set_ylim(limits)
