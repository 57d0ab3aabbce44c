"""The command `jaxgear sweep`: from a design file to a table of variants."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax

from ..io import sweep_request, writing
from ..report import Table
from ..studies.evaluation import coarse
from ..sweeps import SweepTable, sweep
from . import interrupt, sweep_report
from . import terminal as report
from .document import document
from .progress import Meter
from .run import default_folder, opened
from .sweep_report import evaluate_best, said_of_best, write_figures

_QUICK_SAMPLES = 4096
_TABLE, _BEST_FILE = "table", "best.csv"  # apart: readers of the table take its folder for theirs alone
_LABEL_WIDTH, _CELL_WIDTH = 32, 10  # of the table of the best designs


def run_sweep(
    file: Path,
    output: Path | None,
    *,
    samples: int | None,
    best: int,
    quick: bool,
    figures: bool,
    cache: bool,
    command: Sequence[str] | None = None,
) -> bool:
    """The command with its options; False when a variant failed."""
    asked = document(command, file, "xlsxwriter", "plotly")
    design = opened(file, cache=cache)
    request = sweep_request(design, samples=samples, most=_QUICK_SAMPLES if quick else None)
    asked_size = design.resolution(request.highest_torque)
    size = coarse(asked_size) if quick else asked_size
    target = output or default_folder(file, "sweep", quick=quick)
    _check(target)
    options: dict[str, Any] = {} if request.part_rows is None else {"part_rows": request.part_rows}
    with Meter(target) as meter:
        table = sweep(
            design.sweep_mesh(size),
            request.load,
            design.design,
            request.plan,
            results=request.results,
            output=target / _TABLE,
            manufactured=request.manufactured,
            title=design.title,
            units=design.units,
            callback=meter,
            **options,
        )
    if jax.process_index() > 0:  # the first process speaks for all
        return table.failures() == 0
    chosen = table.best(best)
    with writing(target / _BEST_FILE):
        chosen.to_csv(target / _BEST_FILE)
    interrupt.note(f"the table and {_BEST_FILE} are complete in {target}{os.sep}, not all figures are drawn")
    grid, findings = said_of_best(design, chosen, size) if len(chosen) else ([], [])
    files = write_figures(target, table) if figures and len(chosen) else []
    if asked is not None:
        closer = evaluate_best(target, design, chosen, size, quick=quick, figures=figures)
        sweep_report.write(target, asked, design, table, chosen, closer, files, size=size, quick=quick, grid=grid)
    interrupt.note(f"all results are in {target}{os.sep}")
    fine = _show(table, chosen, target, meter, quick=quick, lines=[*grid, *findings], pairs=size.chosen_pairs)
    if design.left_out:
        report.warn(design.left_out)
    return fine


def _check(target: Path) -> None:
    """Refuses a folder of something else: a file of its own could have the name of a result."""
    with writing(target):
        others = [] if (target / _TABLE).exists() or not target.is_dir() else sorted(os.listdir(target))
    if others:
        raise ValueError(f"{target}: holds other files than a sweep ({others[0]}), choose another folder")


def _show(
    table: SweepTable, chosen: SweepTable, target: Path, meter: Meter, *, quick: bool, lines: Sequence[str], pairs: int
) -> bool:
    out = report.console()
    out.print(_side_by_side(chosen, (out.width - _LABEL_WIDTH) // _CELL_WIDTH))
    report.say(*lines)
    if quick:
        report.say("quick run, coarse positions and few samples: a preview, do not use for design")
    report.say(f"best {len(chosen)} in {target / _BEST_FILE}, table in {target / _TABLE}{os.sep}")
    rate = f", {meter.rate:,.0f}/s" if meter.rate else ""
    report.say(f"{len(table):,} variants{rate}, {meter.elapsed:.1f} s")
    failures = table.failures()
    if failures:
        report.warn(f"{failures:,} variants failed (columns converged and status); {table.why(pairs)}")
    return failures == 0


def _side_by_side(table: SweepTable, count: int) -> Table:
    """The first rows as columns."""
    shown = table.take(range(min(max(count, 1), len(table))))
    header = "variant", *map(str, shown.column("variant"))
    result = Table(header, title=f"{table.title}, best first by {table.results[0]}")
    for column, values in shown.values(*shown.parameters, *shown.results).items():
        result.add_row(column.named, *(format(value, column.quantity.form) for value in values))
    return result
