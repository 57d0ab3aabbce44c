"""Pictures of a sweep: what its results cost each other, and where the good designs are."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..metrics import Quantity, quantity_of
from ..sweeps import SweepTable
from . import report

_DRAWN = 200_000  # variants; of more, every so many-th is drawn, so that memory does not grow with the table
_CHARTS = 6  # radar charts


def write_figures(folder: Path, table: SweepTable, results: Sequence[str | Quantity]) -> list[Path]:
    """Writes all figures that the results allow, of a table with a variant that did not fail; gives the files."""
    import matplotlib

    matplotlib.use("Agg")  # the command line never shows a window
    from .. import plot

    heads = head_columns(table, results)
    maximize = [column.name for column in table.columns if column.better == "larger"]
    labels = parameter_labels(table)
    options: dict[str, Any] = {"labels": labels, "maximize": maximize}
    size = len(table)
    step = -(-size // _DRAWN)
    axes: dict[str, Any] = {}
    if len(heads) > 1:
        rows = np.arange(0, size, step)
        if step > 1:  # the front is that of all variants, whichever of the others are drawn
            rows = np.union1d(rows, table.pareto(heads[:3]).column("variant"))
        axes["pareto"] = plot.pareto(_columns(table.take(rows), heads[:3]), *heads[:3], **options)
    best = table.best(_CHARTS)
    numbers = np.union1d(np.arange(0, size, step), best.column("variant"))  # the best of all, too
    lines = _columns(table.take(numbers), [*table.parameters, *heads])
    axes["parallel_coordinates"] = plot.parallel_coordinates(lines, list(lines), heads[0], numbers=numbers, **options)
    if len(heads) > 2:
        names = [f"variant {number}" for number in best.column("variant")]
        # what is said of all results alike stands once, under the charts
        short = {head: plot.label(name) for head, name in zip(heads, (quantity_of(result).key for result in results))}
        common = plot.label(heads[0]).rpartition(" [")[0].removeprefix(short[heads[0]].rpartition(" [")[0]).strip()
        axes["radar"] = plot.radar(
            _columns(best, heads), heads, names=names, note=common, labels=short, maximize=maximize
        )
    if step > 1:
        note = f"1 in {step} of {size:,} variants".replace(",", "\u2009")
        for name in axes.keys() - {"radar"}:
            axis = np.ravel(axes[name])[0]
            axis.set_title(note, loc="left", pad=32, fontsize=axis.xaxis.label.get_fontsize())
    return report.save_figures(folder, axes)


def head_columns(table: SweepTable, results: Sequence[str | Quantity]) -> list[str]:
    """One column of every result: the first, which of a load spectrum or a tolerance is its mean."""
    return [next(name for name in table.results if name.startswith(quantity_of(result).key)) for result in results]


def parameter_labels(table: SweepTable) -> dict[str, str]:
    """Labels of the parameters with their units."""
    units = {**table.units, **{name: "µm" for name, unit in table.units.items() if unit == "um"}}
    return {name: f"{name.replace('_', ' ')} [{units[name] or '-'}]" for name in table.parameters}


def labels_of(table: SweepTable) -> dict[str, str]:
    """Labels of parameters and results with their units."""
    from .. import plot

    return {**{name: plot.label(name) for name in table.results}, **parameter_labels(table)}


def _columns(table: SweepTable, names: Sequence[str]) -> dict[str, np.ndarray]:
    return {name: table.column(name) for name in names}
