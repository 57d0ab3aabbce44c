"""The command `jaxgear sweep`: from a design file to a table of variants."""

import dataclasses
import os
import time
from pathlib import Path
from typing import Any

import jax
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from ..io import load_design, sweep_request, writing
from ..sweeps import SweepTable, sweep
from . import interrupt, report
from .cache import enable_cache
from .run import default_folder
from .sweep_figures import write_figures

_QUICK_POSITIONS, _QUICK_SAMPLES = 16, 4096
_TABLE, _BEST_FILE = "table", "best.csv"  # apart: readers of the table take its folder for theirs alone
_LABEL_WIDTH, _CELL_WIDTH = 32, 10  # of the table of the best designs
_LINES = 10  # of progress, where there is no terminal


def run_sweep(
    file: Path, output: Path | None, *, samples: int | None, best: int, quick: bool, figures: bool, cache: bool
) -> bool:
    """Evaluates the variants of a design file and shows the best.

    Args:
        file: design file.
        output: folder of the results, None for the default.
        samples: number of variants, None for the file's.
        best: how many designs to list.
        quick: coarse positions and few samples.
        figures: draw the results.
        cache: keep compiled programs on disk.

    Returns:
        False when a variant failed.
    """
    jax.config.update("jax_enable_x64", True)
    if cache:
        enable_cache()
    design = load_design(file)
    request = sweep_request(design, samples=samples, most=_QUICK_SAMPLES if quick else None)
    size = design.resolution(request.highest_torque)
    if quick:
        size = dataclasses.replace(size, positions=min(size.positions, _QUICK_POSITIONS))
    target = output or default_folder(file, "sweep", quick=quick)
    _check(target)
    options: dict[str, Any] = {} if request.part_rows is None else {"part_rows": request.part_rows}
    with Meter(report.console(stderr=True), target) as meter:
        table = sweep(
            design.design,
            request.plan,
            mesh=design.sweep_mesh(size),
            torque=request.load,
            results=request.results,
            output=target / _TABLE,
            tolerance=request.tolerance,
            samples=request.samples,
            seed=request.seed,
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
    if figures and len(chosen):
        write_figures(target, table, request.results)
    interrupt.note(f"all results are in {target}{os.sep}")
    return _show(table, chosen, target, meter, quick=quick)


def _check(target: Path) -> None:
    """Refuses a folder of something else: a file of its own could have the name of a result."""
    try:
        others = [] if (target / _TABLE).exists() or not target.is_dir() else sorted(os.listdir(target))
    except OSError as error:
        raise ValueError(f"{target}: cannot be written: {error.strerror or error}") from None
    if others:
        raise ValueError(f"{target}: holds other files than a sweep ({others[0]}), choose another folder")


def _show(table: SweepTable, chosen: SweepTable, target: Path, meter: "Meter", *, quick: bool) -> bool:
    out = report.console()
    out.print(_side_by_side(chosen, (out.width - _LABEL_WIDTH) // _CELL_WIDTH))
    if quick:
        out.print("quick run: coarse positions and few samples, not a result to build on", soft_wrap=True)
    out.print(f"best {len(chosen)} in {target / _BEST_FILE}, table in {target / _TABLE}{os.sep}", soft_wrap=True)
    rate = f", {meter.rate:,.0f}/s" if meter.rate else ""
    out.print(f"{len(table):,} variants{rate}, {meter.elapsed:.1f} s", soft_wrap=True)
    failures = table.failures()
    if failures:
        line = f"jaxgear: warning: {failures:,} variants failed (column converged)"
        report.console(stderr=True).print(line, style="bold red", soft_wrap=True)
    return failures == 0


def _side_by_side(table: SweepTable, count: int) -> Table:
    """The first rows as columns."""
    result = Table(title=f"{table.title}, best first by {table.results[0]}", title_justify="left", box=SIMPLE_HEAD)
    result.add_column("variant")
    columns = {name: table.column(name)[: max(count, 1)] for name in table.names}
    for number in columns["variant"]:
        result.add_column(str(number), justify="right", no_wrap=True)
    units = table.units
    for name in (*table.parameters, *table.results):
        label = f"{name} [{units[name]}]" if units[name] and name in table.parameters else name
        result.add_row(label, *(f"{value:.4g}" for value in columns[name]))
    return result


class Meter:
    """Progress on stderr: a bar on a terminal, now and then a line elsewhere.

    Attributes:
        done, total: variants of this process, None before the first.
    """

    def __init__(self, console: Console, target: Path):
        self._target = target
        self.done: int | None = None
        self.total = 0
        self._console, self._began = console, time.perf_counter()
        self._first, self._since, self._lines = 0, self._began, 0
        columns = TextColumn("{task.fields[note]}"), BarColumn(), TextColumn("{task.percentage:.0f} %")
        self._progress = Progress(
            *columns, TimeRemainingColumn(), console=console, transient=True, disable=not console.is_terminal
        )
        self._task = self._progress.add_task("", total=None, note="preparing")

    def __enter__(self) -> "Meter":
        self._progress.start()
        return self

    def __exit__(self, *exception) -> None:
        self._progress.stop()

    def __call__(self, done: int, total: int, best: float | None) -> None:
        """Callback of the sweep."""
        if self.done is None:
            self._first, self._since = done, time.perf_counter()
            if done:
                self._console.print(f"jaxgear: resuming, {done:,} of {total:,} variants are there", soft_wrap=True)
        self.done, self.total = done, total
        there = f"{done:,} of {total:,} variants are in {self._target}{os.sep}"
        interrupt.note(f"{there}, resume with the same command")
        note = f"{done:,} of {total:,} variants" + (f", {self.rate:,.0f}/s" if self.rate else "")
        self._progress.update(self._task, completed=done, total=total, note=note)
        if not self._console.is_terminal and done * _LINES // total > self._lines:
            self._lines = done * _LINES // total
            self._console.print(f"jaxgear: {note}", soft_wrap=True)

    @property
    def elapsed(self) -> float:
        """Since the start of the command [s]."""
        return time.perf_counter() - self._began

    @property
    def rate(self) -> float:
        """Variants per second of this process, with the compilation of its program."""
        spent = time.perf_counter() - self._since
        return ((self.done or 0) - self._first) / spent if spent > 0 else 0.0
