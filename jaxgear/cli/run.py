"""Run a study as a command: stages of its progress, checkpoints, results, report."""

import dataclasses
import importlib
import os
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import jax
from rich import progress as bars
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .. import studies
from ..io import DesignFile, load_design, result_folder
from ..io.folder import earlier
from ..numerics import compile_quickly
from ..studies import AbstractStudy, Checkpoints, Progress
from ..studies.study import AbstractStudyResult
from ..studies.summary import save_figures, write_study_summary
from . import interrupt, streams, terminal
from .document import document
from .jax_setup import enable_cache


class Stages(bars.Progress, studies.Stages):
    """Progress of a command through its stages."""

    def __init__(self) -> None:
        columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}")
        console = terminal.console(stderr=True)
        options: dict[str, Any] = {"console": console, "transient": True, "disable": not console.is_terminal}
        bars.Progress.__init__(self, *columns, TimeElapsedColumn(), TimeRemainingColumn(), **options)
        studies.Stages.__init__(self, self.shown)
        self._began = time.perf_counter()
        self._task = self.add_task("reading the design file", total=None, note="")

    @property
    def elapsed(self) -> float:
        """Time since the start [s]."""
        return time.perf_counter() - self._began

    def shown(self, progress: Progress) -> None:
        """Shows how far a study is; its callback."""
        interrupt.check()
        done, begins = progress.done or 0, progress.done is None
        self.update(self._task, description=progress.stage, total=progress.total, completed=done, note=progress.note)
        if begins and not self.console.is_terminal:
            self.console.print(f"jaxgear: {progress.stage}", soft_wrap=True)

    def replaces(self, target: Path) -> None:
        """Print which earlier results the command will replace, while it can still be stopped."""
        held = earlier(target)
        if held:
            line = f"jaxgear: replaces the results in {target}{os.sep} ({held}); --output keeps them"
            self.console.print(line, soft_wrap=True)


_FIGURES = ("matplotlib.pyplot",)


def run_study(
    of: type[AbstractStudy[Any]],
    options: Mapping[str, Any],
    file: Path,
    output: Path | None,
    *,
    figures: bool,
    cache: bool,
    command: Sequence[str] | None = None,
) -> bool:
    """The command of a study with its options; False when there are failures.

    Args:
        of: class of the study.
        options: arguments of `of.of` besides the design file.
        file: the design file.
        output: result folder; None for that of the study.
        figures: True if figures are drawn.
        cache: True if compiled programs are kept on disk.
        command: the command line, where a report is written.
    """
    asked = document(command, file, *of.report_needs)
    if options.get("quick") or not of.grows:
        compile_quickly()
    with Stages() as stages:
        design = opened(file, cache=cache)
        study = of.of(design, **options)
        target = output or default_folder(file, study.folder, quick=study.quick)
        omitted = study.omits()
        if study.grows:
            study = dataclasses.replace(study, output=target)  # type: ignore[call-arg]
        checkpoints = Checkpoints() if study.grows else _checkpoints(target)
        with ExitStack() as putting_in_place, _folder(study, target, stages) as folder:
            _import_ahead(*study.needs, *_FIGURES * figures)
            result = study.run(checkpoints=checkpoints, callback=partial(_show_progress, study, target, stages))
            if jax.process_index() > 0:  # the first process speaks for all
                return not list(result.failures())
            stages.begin("writing the results")
            result.write(folder)
            if study.grows:
                write_study_summary(folder, study, result)
                interrupt.note(f"all tables are complete in {target}{os.sep}, not all figures are drawn")
            failures = list(result.failures())
            _show(result, stages)
            figures = figures and type(result).figures is not AbstractStudyResult.figures
            if figures:
                _without_windows()
            if asked is not None:
                stages.begin("preparing the report")
                result = result.reported(folder, asked.facts(design), figures=figures)
            captions = {}
            if figures:
                stages.begin("drawing the figures")
                captions = save_figures(folder, result.figures())
            if asked is not None:
                asked.write(folder, study, result, captions)
            write_study_summary(folder, study, result)
            putting_in_place.enter_context(interrupt.delayed(f"the results are in {target}{os.sep}"))
            putting_in_place.callback(checkpoints.remove)
    if study.quick and study.coarse:
        terminal.say(f"quick run, {study.coarse}: a preview, do not use for design")
    terminal.say(f"results in {target}{os.sep}, {stages.elapsed:.1f} s")
    for line in (study.left_out, omitted, *failures):
        if line:
            terminal.warn(line)
    return not failures


@contextmanager
def _folder(study: AbstractStudy[Any], target: Path, stages: Stages) -> Iterator[Path]:
    """Folder of the results: a new one that replaces the target at the end, or the target itself if results grow."""
    if study.grows:
        yield target
        return
    with result_folder(target) as folder:
        stages.replaces(target)
        yield folder


def _show_progress(study: AbstractStudy[Any], target: Path, stages: Stages, progress: Progress) -> None:
    """Shows how far a study is; the message of an interruption says where a growing result is."""
    if study.grows and progress.total:
        there = f"{progress.done or 0:,} of {progress.total:,} {study.grows} are in {target}{os.sep}"
        interrupt.note(f"{there}, resume with the same command")
    stages.shown(progress)


def _show(result: AbstractStudyResult, stages: Stages) -> None:
    """Prints all but failures, without the bar; headlines say the findings themselves."""
    stages.stop()
    headlines = list(result.headlines())
    try:
        for block in headlines:
            terminal.say_rows(block)
        for table in result.tables():
            terminal.console().print(table)
        findings = () if headlines else result.findings() or ()
        terminal.say(*result.verdict(), *findings, *result.details())
    except (BrokenPipeError, SystemExit) as end:  # which rich makes of it
        if isinstance(end, SystemExit) and not isinstance(end.__context__, BrokenPipeError):
            raise
        streams.forget_output()  # who reads the first lines alone wants the files as well
    stages.start()


def opened(file: Path, *, cache: bool) -> DesignFile:
    """A design file, in double precision; `cache` keeps compiled programs on disk."""
    jax.config.update("jax_enable_x64", True)
    if cache:
        enable_cache()
    return load_design(file)


def default_folder(file: Path, *command: str, quick: bool = False) -> Path:
    """Folder for the results of one command and kind of run."""
    folder = Path("results", file.stem, *command)
    return folder.with_name(f"{folder.name}-quick") if quick else folder


def _checkpoints(target: Path) -> Checkpoints:
    """Checkpoints in a hidden folder beside the result folder; the message of an interruption gives their number."""
    folder = target.parent / f".{target.name}.runs"

    def note(count: str) -> None:
        interrupt.note(f"{count} runs are stored in {folder}{os.sep}, resume with the same command")

    made = Checkpoints(folder, lambda done, total: note(f"{done}" if total is None else f"{done} of {total}"))
    there = made.count()
    if there:
        note(f"{there}")
    return made


def _import_ahead(*modules: str) -> None:
    """Import modules in another thread while this one waits for the compiler."""
    threading.Thread(target=lambda: [importlib.import_module(module) for module in modules]).start()


def _without_windows() -> None:
    """Restrict matplotlib to files: the command line never shows a window."""
    import matplotlib
    import matplotlib.pyplot  # waits for the thread that imports it ahead

    matplotlib.use("Agg")
