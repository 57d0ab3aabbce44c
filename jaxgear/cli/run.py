"""One run of a command: its stages, what it has found so far, and its result folder."""

import dataclasses
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

import jax
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ..contact import Mesh
from ..io import DesignFile, OptimizeRequest, load_design, result_folder, write_flanks, write_front, write_summary
from ..microgeometry import AbstractModification
from ..optimize import Front, Optimum, Problem, Projection, judged, project
from . import interrupt, optimum_report, report
from .cache import enable_cache
from .study import Evaluation, Evaluator

Modifications = tuple[AbstractModification, AbstractModification]


class Run:
    """Collects the designs of one run and writes them into `folder`."""

    def __init__(self, design: DesignFile, target: Path, folder: Path, stages: "Stages"):
        self.design = design
        self._target, self._folder, self._stages = target, folder, stages
        self._evaluations: dict[str, Evaluation] = {}
        self._optimum: Optimum | None = None
        self._front: Front | None = None
        self._projection: Projection | None = None
        self._resolution, self._quick = design.resolution(), False

    def coarsen(self, *, positions: int) -> None:
        """Makes the run a quick one, with at most so many mesh positions."""
        self._quick = True
        self._resolution = dataclasses.replace(self._resolution, positions=min(positions, self._resolution.positions))

    def prepare(self, *, torques: int) -> None:
        """Prepares the mesh.

        Args:
            torques: number of torques over the range of the file.
        """
        self._stages.begin("preparing the mesh")
        self._mesh: Mesh = jax.block_until_ready(self.design.mesh(self._resolution))
        self._torques = np.linspace(*self.design.torque_range, torques)
        self._judge_on(self._mesh, None)

    def evaluate(self, name: str, pinion: AbstractModification, wheel: AbstractModification) -> None:
        """Evaluates a design and keeps it."""
        self._stages.begin(f"solving the {name} design")
        found = self._evaluator(pinion, wheel)
        if self._problem is not None:
            found = dataclasses.replace(found, objectives=judged(self._problem, pinion, wheel))
        self._evaluations[name] = found

    def search(self, request: OptimizeRequest, beside: Mapping[str, Modifications]) -> None:
        """Finds the optimum, and for flanks without parameters the named curve in their place.

        All designs are evaluated on the mesh on which the search has ended, and by its measure.

        Args:
            request: what is sought.
            beside: designs to compare with, by name.
        """
        self._stages.begin(f"searching the optimum ({request.method})")
        began = time.perf_counter()
        found = request(self._mesh, self._stages.step)
        self._front = found if isinstance(found, Front) else None
        optimum = found.compromise if isinstance(found, Front) else found
        spent = time.perf_counter() - began
        self._judge_on(optimum.mesh, optimum.problem)
        for name, modifications in beside.items():
            self.evaluate(name, *modifications)
        self.evaluate("optimum", optimum.pinion, optimum.wheel)
        evaluated = dataclasses.replace(self._evaluations["optimum"], seconds=spent)
        self._evaluations["optimum"] = evaluated
        # of several torques it shows another one than the table does
        ppte = float(evaluated.metrics["ppte_um"])
        self._optimum = optimum = dataclasses.replace(optimum, cycle=evaluated.cycle, ppte=ppte)
        if request.curve is not None:
            self._stages.begin(f"projecting the flanks on a {request.curve} curve")
            self._projection = projection = project(optimum, request.curve)
            self.evaluate(f"as {request.curve}", projection.pinion, projection.wheel)

    def write(self, *, figures: bool) -> None:
        """Writes the result files."""
        self._stages.begin("writing the results")
        data = report.summary(self.design, self._mesh, self._evaluations, self._torques)
        if self._optimum is not None:
            data["optimum"] = optimum_report.summary(self.design, self._optimum, self._projection)
        write_summary(self._folder / "summary.json", {**data, "quick": self._quick})
        write_flanks(self._folder / "flanks.csv", self._mesh, report.flanks(self._evaluations))
        if self._front is not None:
            write_front(self._folder / "front.csv", self._front)
        if figures:
            report.write_figures(self._folder, self.design, self._mesh, self._evaluations, self._torques)
            if self._optimum is not None:
                surface = self._evaluator.response_surface(self._optimum.pinion, self._optimum.wheel)
                optimum_report.write_figures(self._folder, self._mesh, self._optimum, self._front, surface)

    def show(self) -> bool:
        """Prints the comparison, after the results are in place; False when a solution or a constraint failed."""
        out = report.console()
        out.print(report.table(self.design, self._evaluations))
        if self._optimum is not None:
            lines = optimum_report.verdict(
                self.design,
                self._optimum,
                self._projection,
                self._evaluations,
                searched_at=self._resolution.positions,
            )
            for line in lines:
                out.print(line, soft_wrap=True)
            for line in optimum_report.front_lines(self._front) if self._front is not None else ():
                out.print(line, soft_wrap=True)
        if self._quick:
            out.print("quick run: coarse positions and a short search, not a result to build on", soft_wrap=True)
        out.print(report.bores(self.design), soft_wrap=True)
        for line in report.doubt_lines(report.doubts(self.design, self._evaluations)):
            out.print(line, soft_wrap=True)
        out.print(f"results in {self._target}{os.sep}, {self._stages.elapsed:.1f} s", soft_wrap=True)
        failures = list(report.failures(self._evaluations))
        for line in failures:
            report.console(stderr=True).print(f"jaxgear: warning: {line}", style="bold red", soft_wrap=True)
        if self._optimum is not None and not self._optimum.feasible:
            failures.append("constraints are not met")
            report.console(stderr=True).print(f"jaxgear: warning: {failures[-1]}", style="bold red", soft_wrap=True)
        return not failures

    def _judge_on(self, mesh: Mesh, problem: Problem | None) -> None:
        """Evaluates from now on on this mesh, and by the measure of a problem."""
        self._mesh, self._problem = mesh, problem
        self._evaluator = Evaluator(mesh, self.design.torque, self._torques, self.design.speed, self.design.friction)


class Stages:
    """Progress on stderr: a bar on a terminal, a line per stage elsewhere."""

    def __init__(self, console: Console):
        self._console, self._began = console, time.perf_counter()
        columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"), TimeElapsedColumn()
        self._progress = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._task = self._progress.add_task("reading the design file", total=None, note="")

    def __enter__(self) -> "Stages":
        self._progress.start()
        return self

    def __exit__(self, *exception) -> None:
        self._progress.stop()

    @property
    def elapsed(self) -> float:
        """Since the start of the run [s]."""
        return time.perf_counter() - self._began

    def begin(self, stage: str) -> None:
        """Names the next stage."""
        interrupt.check()
        self._progress.update(self._task, description=stage, total=None, completed=0, note="")
        if not self._console.is_terminal:
            self._console.print(f"jaxgear: {stage}")

    def step(self, step: int, total: int, best: float | None) -> None:
        """Callback of the search."""
        interrupt.check()
        self._progress.update(self._task, completed=step, total=total, note=f"best {best:.4g}")


@contextmanager
def opened(file: Path, *, cache: bool) -> Iterator[tuple[DesignFile, Stages]]:
    """A design file and the progress of the command.

    Args:
        file: design file.
        cache: keep compiled programs on disk.
    """
    jax.config.update("jax_enable_x64", True)
    if cache:
        enable_cache()
    with Stages(report.console(stderr=True)) as stages:
        yield load_design(file), stages


def default_folder(file: Path, *command: str, quick: bool = False) -> Path:
    """Folder of the results of a command, in which those of no other command or kind of run are."""
    folder = Path("results", file.stem, *command)
    return folder.with_name(f"{folder.name}-quick") if quick else folder


@contextmanager
def run(design: DesignFile, target: Path, stages: Stages) -> Iterator[Run]:
    """Opens the result folder; the results appear when the block ends without an exception.

    Args:
        design: design file.
        target: result folder.
        stages: progress of the command.
    """
    with ExitStack() as putting_in_place:
        with result_folder(target) as folder:
            yield Run(design, target, folder, stages)
            putting_in_place.enter_context(interrupt.held(f"the results are in {target}{os.sep}"))
