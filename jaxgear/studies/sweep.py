"""Sweep study: table of any number of variants of a design file."""

import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

import jax
import numpy as np

from ..contact import Mesh, Resolution
from ..io import DesignFile, writing
from ..io.errors import naming
from ..io.sweep_table import SweepSection
from ..metrics import findings_of
from ..sweeps import SweepTable, over_torques, sweep
from .checkpoints import Checkpoints
from .evaluation import coarse, grid_change, grid_lines, grid_of
from .progress import Stages
from .side_by_side import WARNING
from .study import AbstractStudy
from .sweep_result import TABLE, SweepResult

_QUICK_SAMPLES = 4096
_LINES, _QUIET = 10, 30.0  # lines of progress of a sweep, and seconds after which there is one anyway


@dataclass(frozen=True)
class SweepStudy(AbstractStudy[SweepResult]):
    """Evaluate the variants of the design file, any number of them, into a table of Parquet files.

    The folder "table" of the results contains only the table: pandas, polars and Arrow read the folder as a whole. An
    interrupted sweep resumes when the command is repeated.

    Attributes:
        settings: table [sweep] of the design file.
        best: number of the best designs that are listed.
        output: result folder, in which the table grows; None keeps the table in memory.
    """

    name: ClassVar = "sweep"
    coarse: ClassVar = "coarse positions and few samples"
    takes_coast: ClassVar = True
    grows: ClassVar = "variants"
    report_needs: ClassVar = ("xlsxwriter", "plotly")

    settings: SweepSection
    best: int = 10
    output: Path | None = None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False, samples: int | None = None, best: int = 10) -> Self:
        """Sweep of a design file, see `AbstractStudy.of`.

        Args:
            design: the design file.
            quick: True for coarse positions and few samples.
            samples: number of variants; None for the number of the file.
            best: number of best designs to list.
        """
        with naming(design.path):
            section = design.needed("sweep", "it says which variants to evaluate")
            settings = section.with_samples(samples, _QUICK_SAMPLES if quick else None)
            settings.arguments(design)
        return cls(design, quick, settings, best)

    def omits(self) -> str:
        """Empty message: variants scatter within [tolerance]."""
        return ""

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> SweepResult:
        """Evaluate all variants and find the best; the table itself stores the variants of an interrupted sweep."""
        design, options = self.design, self.settings.arguments(self.design)
        size = design.resolution(options.pop("highest_torque"))
        size = coarse(size) if self.quick else size
        if self.output is not None:
            _check(self.output)
        stages.count(0, None, "preparing")
        meter, output = _Meter(stages), None if self.output is None else self.output / TABLE
        load, plan = options.pop("load"), options.pop("plan")
        table = sweep(design.sweep_mesh(size), load, design.design, plan, output=output, callback=meter, **options)
        if jax.process_index() > 0:  # only the first process reports
            return SweepResult(design, self.quick, self.output, size, table, table.take([]), (), (), meter.rate)
        chosen = table.best(self.best)
        grid, findings = said_of_best(design, chosen, size) if len(chosen) else ([], [])
        return SweepResult(design, self.quick, self.output, size, table, chosen, grid, findings, meter.rate)


def _check(target: Path) -> None:
    """Raise a `ValueError` for a folder with other contents, which results could overwrite."""
    with writing(target):
        others = [] if (target / TABLE).exists() or not target.is_dir() else sorted(os.listdir(target))
    if others:
        raise ValueError(f"{target}: holds other files than a sweep ({others[0]}), choose another folder")


class _Meter:
    """Callback of a sweep: reports every tenth of the variants, and at least after `_QUIET` seconds."""

    def __init__(self, stages: Stages) -> None:
        self._stages, self._done, self._first = stages, -1, 0
        self._since = self._said = time.perf_counter()
        self._lines = 0

    def __call__(self, done: int, total: int, best: float | None) -> None:
        now = time.perf_counter()
        if self._done < 0:
            self._first, self._since = done, now
            if done:
                self._stages.begin(f"resuming, {done:,} of {total:,} variants are complete")
        self._done = done
        rate = f", {self.rate:,.0f}/s" if self.rate else ""
        note = f"{done:,} of {total:,} variants{rate}"
        if done * _LINES // total > self._lines or now - self._said > _QUIET:
            self._lines, self._said = done * _LINES // total, now
            self._stages.begin(note)
        self._stages.count(done, total, note)

    @property
    def rate(self) -> float:
        """Variants per second of this process, compilation included."""
        spent = time.perf_counter() - self._since
        return max(self._done - self._first, 0) / spent if spent > 0 else 0.0


def said_of_best(design: DesignFile, best: SweepTable, size: Resolution) -> tuple[list[str], list[str]]:
    """Lines on the best variant: changes of its values on a finer grid, and its findings.

    Args:
        design: design file.
        best: table whose first row is the best variant.
        size: array sizes of the mesh.
    """
    parameters = best.take([0]).designs()[0]
    made = design.sweep_mesh(size)
    mesh = made if isinstance(made, Mesh) else made(parameters)
    torque = float(design.operating_point(parameters).torque)
    pinion, wheel = design.design(parameters)
    (cycle,) = over_torques(mesh, np.asarray([torque]), pinion=pinion, wheel=wheel)
    name = f"variant {best.column('variant')[0]} at {torque:g} N m"
    findings = findings_of(cycle, pinion=pinion, wheel=wheel, compliance=mesh.compliance)
    grid = grid_of(mesh.resolution, helical=mesh.kinematics.helical)
    lines = grid_lines(grid, {name: grid_change(mesh, cycle, pinion, wheel)})
    return [*lines], [f"{WARNING}{name}: {finding}" for finding in findings]
