"""One run of a command: its stages, what it has found so far, and its result folder."""

import dataclasses
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

import jax
import numpy as np
from rich.table import Table

from ..compliance import Compliance, TabulatedCompliance
from ..contact import Mesh, Resolution
from ..io import (
    DesignFile,
    DesignFileError,
    OptimizeRequest,
    load_design,
    result_folder,
    write_flanks,
    write_front,
    write_summary,
)
from ..io.errors import naming
from ..io.tolerance import tolerance_of
from ..microgeometry import AbstractModification
from ..optimize import (
    Front,
    Optimum,
    Problem,
    Projection,
    begin_verification,
    judged,
    project,
    structure_for,
    verification,
)
from ..report import Table as Block
from . import interrupt, manufactured, optimum_report, report, summary_file
from .cache import enable_cache
from .document import CommandResult, Document
from .geometry import mounting
from .optimum_report import COMPROMISE, front_table
from .progress import Stages
from .study import Evaluation, evaluate

_TORQUES, _QUICK_TORQUES = 25, 7  # over the range of the file
_QUICK_POSITIONS = 16
_USUAL = "none, inputs and results lie within the usual ranges"

Modifications = tuple[AbstractModification, AbstractModification]


class CommandRun:
    """Collects the designs of one run and writes them into `folder`."""

    def __init__(self, design: DesignFile, target: Path, folder: Path, stages: Stages):
        self.design = design
        self._target, self._folder, self._stages = target, folder, stages
        self._quick = False
        self._evaluations: dict[str, Evaluation] = {}
        self._problem: Problem | None = None  # by whose measure designs are evaluated
        self._optimum: Optimum | None = None
        self._front: Front | None = None
        self._projection: Projection | None = None
        self._second: TabulatedCompliance | None = None  # by which designs are verified
        self._unverified = ""  # why not

    def prepare(self, *, quick: bool = False, finer: int | None = None, verify: bool | None = False) -> None:
        """Prepares the mesh.

        Args:
            quick: a coarse one.
            finer: positions on which a search will end.
            verify: whether the designs are evaluated with the finite-element structure too; None where that goes.
        """
        self._stages.begin("preparing the mesh")
        with naming(self.design.path):
            self._tolerance = tolerance_of(self.design)
        self._quick = quick
        size = self.design.resolution()
        if finer is not None:
            self.design.begin_contact(size, dataclasses.replace(size, positions=max(finer, size.positions)))
        self._mesh: Mesh = jax.block_until_ready(self.design.mesh(coarse(size) if quick else size))
        self._searched_at = self._mesh.resolution.positions
        self._torques = torques_of(self.design, quick=quick)
        if verify or (verify is None and isinstance(self._mesh.compliance, Compliance)):
            self._make_tables(finer, required=verify is not None)

    def _make_tables(self, finer: int | None, *, required: bool) -> None:
        """Before the search: what cannot be verified is known at once, and an interruption costs no optimum."""
        self._stages.begin("finite-element tables of pinion and wheel, made once and kept")
        try:
            self._second = structure_for(self._mesh)
        except ValueError as error:
            if required:
                raise DesignFileError("optimize.verify", str(error), self.design.path) from None
            self._unverified = str(error)
            return
        begin_verification(self._mesh, self._second, finer)

    def evaluate(self, name: str, pinion: AbstractModification, wheel: AbstractModification) -> None:
        """Evaluates a design and keeps it."""
        self._stages.begin(f"solving the {name} design")
        found = evaluate(self.design, self._mesh, self._torques, pinion, wheel)
        if self._problem is not None:
            found = dataclasses.replace(found, objectives=judged(self._problem, pinion, wheel))
        self._evaluations[name] = found

    def search(self, request: OptimizeRequest, beside: Mapping[str, Modifications]) -> None:
        """Finds the optimum, and for flanks without parameters the named curve in their place.

        All designs, those `beside` it too, are evaluated on the mesh on which the search has ended and by its measure.
        """
        self._stages.begin(f"searching the optimum ({request.method})")
        began = time.perf_counter()
        found = request(self._mesh, self._stages.step)
        self._front = found if isinstance(found, Front) else None
        optimum = found.compromise if isinstance(found, Front) else found
        spent = time.perf_counter() - began
        self._mesh, self._problem = optimum.mesh, optimum.problem
        for name, modifications in beside.items():
            self.evaluate(name, *modifications)
        name = "optimum" if self._front is None else COMPROMISE
        self.evaluate(name, optimum.pinion, optimum.wheel)
        evaluated = dataclasses.replace(self._evaluations[name], seconds=spent)
        self._evaluations[name] = evaluated
        # of several torques it shows another one than the table does
        ppte = float(evaluated.metrics["ppte_um"])
        self._optimum = optimum = dataclasses.replace(optimum, cycle=evaluated.cycle, ppte=ppte)
        if request.curve is not None:
            self._stages.begin(f"projecting the flanks on a {request.curve} curve")
            self._projection = projection = project(optimum, request.curve)
            self.evaluate(f"as {request.curve}", projection.pinion, projection.wheel)
        if self._second is not None:
            self._verify(self._second)

    def _verify(self, second: TabulatedCompliance) -> None:
        """Evaluates all designs again with the finite-element structure."""
        self._stages.begin("verifying with the finite-element structure")
        by_finite_elements = verification(self._mesh, second, self._problem)
        for name, claimed in self._evaluations.items():
            found = by_finite_elements(claimed.cycle, claimed.objectives, claimed.pinion, claimed.wheel)
            self._evaluations[name] = dataclasses.replace(claimed, verified=found)

    def write(self, *, figures: bool, document: Document | None = None) -> None:
        """Writes the result files, with a report where there is a document."""
        if self._tolerance is not None:
            self._stages.begin("manufacturing the designs within their tolerances")
            of = self.design, self._mesh, self._evaluations
            self._evaluations = manufactured.scattered(*of, self._tolerance, quick=self._quick)
        self._stages.begin("writing the results")
        self._findings = report.findings(self.design, self._mesh, self._evaluations)
        data = summary_file.summary(self.design, self._mesh, self._evaluations, self._torques, self._findings)
        if self._optimum is not None:
            data["optimum"] = optimum_report.summary(self.design, self._optimum, self._projection)
        data["quick"] = self._quick
        if self.design.left_out:
            data["left_out"] = self.design.left_out
        write_summary(self._folder / "summary.json", data)
        write_flanks(self._folder / "flanks.csv", self._mesh, report.flanks(self._evaluations))
        if self._front is not None:
            write_front(self._folder / "front.csv", self._front)
        files = self._draw() if figures else []
        if document is not None:
            first = list(self._first())
            said = list(self._lines()), self._failures(), list(self._finding_lines()), list(self._tables())
            pages = manufactured.pages(self.design, self._evaluations)
            details = list(self._details())
            found = CommandResult(*said, files, pages, left_out=self.design.left_out, first=first, details=details)
            document.write(self._folder, self.design, data, found)

    def _draw(self) -> list[Path]:
        files = report.write_figures(self._folder, self.design, self._mesh, self._evaluations, self._torques)
        files += manufactured.write_figures(self._folder, self._evaluations)
        if self._optimum is not None:
            of = self._mesh, self.design.torque, self._optimum, self._front, self._evaluations
            files += optimum_report.write_figures(self._folder, *of)
        return files

    def show(self) -> bool:
        """Prints the comparison, after the results are in place; False when a solution or a constraint failed."""
        first = list(self._first())
        for block in first:
            report.say_rows(block)
        for table in self._tables():
            report.console().print(table)
        findings = [] if first else self._finding_lines()
        report.say(*self._lines(), *findings, *self._details())
        report.say(f"results in {self._target}{os.sep}, {self._stages.elapsed:.1f} s")
        failures = self._failures()
        for line in [self.design.left_out] * bool(self.design.left_out) + failures:
            report.warn(line)
        return not failures

    def _tables(self) -> Iterator[Table]:
        yield report.table(self.design, self._evaluations)
        if self._front is not None:
            yield front_table(self._front, self._evaluations, self.design.units)

    def _first(self) -> Iterator[Block]:
        """What an optimization says before its tables."""
        if self._optimum is not None:
            found = self._optimum, self._front, self._projection, self._evaluations
            yield from optimum_report.first_screen(
                self.design, *found, searched_at=self._searched_at, trust=self._trust()
            )

    def _trust(self) -> Iterator[tuple[str, str]]:
        for line in (*report.failures(self._evaluations), *manufactured.failures(self._evaluations)):
            yield "failed", line
        yield from (("note", line) for line in self._notes())
        findings = [line.removeprefix(report.WARNING) for line in self._finding_lines()]
        yield from (("warning", line) for line in findings)
        if not findings:
            yield "warnings", _USUAL

    def _lines(self) -> Iterator[str]:
        """The results in words, where there is no optimum that says them first."""
        if self._optimum is None:
            yield from (*report.grid(self._evaluations), *self._notes())
        yield mounting(self.design)

    def _notes(self) -> Iterator[str]:
        yield from manufactured.lines(self.design, self._evaluations)
        if self._quick:
            yield "quick run, coarse positions and a short search: a preview, do not use for design"
        if self._unverified:
            yield f"not verified by finite elements: {self._unverified}"

    def _details(self) -> Iterator[str]:
        """How a search has gone."""
        if self._optimum is not None:
            yield from optimum_report.search_lines(self._optimum, self._front, self._projection)

    def _finding_lines(self) -> Iterator[str]:
        return report.finding_lines(self._findings)

    def _failures(self) -> list[str]:
        """What is not to be trusted, or not reached."""
        failures = [*report.failures(self._evaluations), *manufactured.failures(self._evaluations)]
        if self._optimum is not None and not self._optimum.feasible:
            failures.append("constraints are not met")
        return failures


def opened(file: Path, *, cache: bool) -> DesignFile:
    """A design file, in double precision; `cache` keeps compiled programs on disk."""
    jax.config.update("jax_enable_x64", True)
    if cache:
        enable_cache()
    return load_design(file)


def coarse(size: Resolution) -> Resolution:
    """The array sizes of a quick run."""
    return dataclasses.replace(size, positions=min(size.positions, _QUICK_POSITIONS))


def torques_of(design: DesignFile, *, quick: bool) -> np.ndarray:
    """Torques over the range of a design file [N m], at which its designs are evaluated."""
    return np.linspace(*design.torque_range, _QUICK_TORQUES if quick else _TORQUES)


def default_folder(file: Path, *command: str, quick: bool = False) -> Path:
    """Folder of the results of a command, in which those of no other command or kind of run are."""
    folder = Path("results", file.stem, *command)
    return folder.with_name(f"{folder.name}-quick") if quick else folder


@contextmanager
def run(design: DesignFile, target: Path, stages: Stages) -> Iterator[CommandRun]:
    """Opens the result folder; the results appear when the block ends without an exception."""
    with ExitStack() as putting_in_place:
        with result_folder(target) as folder:
            stages.replaces(target)
            yield CommandRun(design, target, folder, stages)
            putting_in_place.enter_context(interrupt.held(f"the results are in {target}{os.sep}"))
