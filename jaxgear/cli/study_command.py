"""The command of a study: asked for, worked out, put in place, printed."""

import os
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from ..io import result_folder
from ..numerics import compile_quickly
from ..studies import AbstractStudy, Checkpoints, write_results
from . import interrupt, report
from .commands import import_ahead
from .document import CommandResult, document
from .progress import Stages
from .run import default_folder, opened


def run_study(
    study_class: type[AbstractStudy],
    file: Path,
    output: Path | None,
    *,
    quick: bool,
    figures: bool,
    cache: bool,
    command: Sequence[str] | None = None,
) -> bool:
    """The command of a study with its options; False when there are failures.

    A report is written where a `command` line is given.
    """
    asked = document(command, file)
    compile_quickly()
    with Stages() as stages:
        design = opened(file, cache=cache)
        study = study_class.of(design, quick=quick)
        target = output or default_folder(file, study.name, quick=quick)
        checkpoints = _checkpoints(target)
        omitted = study.omits()
        left_out = [line for line in (study.left_out, omitted) if line]
        with ExitStack() as putting_in_place, result_folder(target, study.files) as folder:
            stages.replaces(target)
            if figures:
                import_ahead("matplotlib.pyplot")
            result = study.run(checkpoints=checkpoints, callback=stages.shown)
            stages.begin("writing the results")
            if figures:
                report.without_windows()
            data, files = write_results(folder, study, result, figures=figures)
            tables, lines, failures = list(result.tables()), list(result.verdict()), list(result.failures())
            found = result.findings()
            findings = None if found is None else list(found)
            if asked is not None:
                said = CommandResult(
                    lines,
                    failures,
                    findings,
                    tables=tables,
                    figures=files,
                    assumptions=(*result.assumptions, *([f"{omitted}."] if omitted else [])),
                    left_out=study.left_out,
                )
                asked.write(folder, design, data, said)
            putting_in_place.enter_context(interrupt.held(f"the results are in {target}{os.sep}"))
            putting_in_place.callback(checkpoints.remove)
    for table in tables:
        report.console().print(table)
    report.say(*lines, *(findings or ()))
    if quick:
        report.say(f"quick run, {study.coarse}: a preview, do not use for design")
    report.say(f"results in {target}{os.sep}, {stages.elapsed:.1f} s")
    for line in (*left_out, *failures):
        report.warn(line)
    return not failures


def _checkpoints(target: Path) -> Checkpoints:
    """What is kept beside a result folder until it is there; what is said of it when the command is interrupted."""
    folder = target.with_name(f".{target.name}.runs")

    def note(count: str) -> None:
        interrupt.note(f"{count} runs are kept in {folder}{os.sep}, go on with the same command")

    made = Checkpoints(folder, lambda done, total: note(f"{done}" if total is None else f"{done} of {total}"))
    there = made.count()
    if there:
        note(f"{there}")
    return made
