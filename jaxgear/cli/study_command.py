"""A command that makes a study of a design file: asked for, worked out, put in place, printed."""

import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from ..io import DesignFile, result_folder, write_summary
from ..numerics import compile_quickly
from ..report import Table
from . import interrupt, report
from .commands import import_ahead
from .document import CommandResult, document
from .progress import Stages
from .run import default_folder, opened
from .study import note_runs

S = TypeVar("S")
# Works the study out: result folder, stages -> study, and what is to be done when its results are in place.
Make = Callable[[Path, Stages], tuple[S, Callable[[], None]]]


@dataclass(frozen=True)
class StudyCommand(Generic[S]):
    """What a command has of its own.

    Attributes:
        name: of the command.
        coarse: what a quick run has too few of.
        plan: checks what a design file asks for, quick or not, before anything is worked out or written.
        summary: contents of `summary.json`, without whether the run was quick.
        write: writes the other files into a folder.
        draw: writes the figures into a folder.
        tables: printed first.
        verdict: the results in words.
        failures: a line for everything that is not to be trusted; the command fails where there is one.
        assumptions: of the study, for a report.
        findings: a line for everything that is not usual; None where it is not checked.
        takes_shafts: whether the study is on the shafts of the file at every load.
        omits: what else of the file is not part of the study and why, "" for nothing; None where it is not checked.
    """

    name: str
    coarse: str
    plan: Callable[[DesignFile, bool], Make[S]]
    summary: Callable[[S], dict[str, Any]]
    write: Callable[[Path, S], None]
    draw: Callable[[Path, S], list[Path]]
    tables: Callable[[S], Iterable[Table]]
    verdict: Callable[[S], Iterable[str]]
    failures: Callable[[S], Iterable[str]]
    assumptions: tuple[str, ...] = ()
    findings: Callable[[S], Iterable[str]] | None = None
    takes_shafts: bool = False
    omits: Callable[[DesignFile], str] | None = None

    def __call__(
        self,
        file: Path,
        output: Path | None,
        *,
        quick: bool,
        figures: bool,
        cache: bool,
        command: Sequence[str] | None = None,
    ) -> bool:
        """The command with its options; False when there are failures."""
        asked = document(command, file)
        compile_quickly()
        with Stages() as stages:
            design = opened(file, cache=cache)
            make = self.plan(design, quick)
            held = "" if self.takes_shafts else design.left_out
            omitted = "" if self.omits is None else self.omits(design)
            left_out = [line for line in (held, omitted) if line]
            target = output or default_folder(file, self.name, quick=quick)
            note_runs(target)
            with ExitStack() as putting_in_place, result_folder(target) as folder:
                stages.replaces(target)
                if figures:
                    import_ahead("matplotlib.pyplot")
                study, finish = make(target, stages)
                stages.begin("writing the results")
                data = {
                    **self.summary(study),
                    "quick": quick,
                    **({"left_out": "; ".join(left_out)} if left_out else {}),
                }
                write_summary(folder / "summary.json", data)
                self.write(folder, study)
                files = self.draw(folder, study) if figures else []
                tables, lines = list(self.tables(study)), list(self.verdict(study))
                failures = list(self.failures(study))
                findings = None if self.findings is None else list(self.findings(study))
                if asked is not None:
                    found = CommandResult(
                        lines,
                        failures,
                        findings,
                        tables=tables,
                        figures=files,
                        assumptions=(*self.assumptions, *([f"{omitted}."] if omitted else [])),
                        left_out=held,
                    )
                    asked.write(folder, design, data, found)
                putting_in_place.enter_context(interrupt.held(f"the results are in {target}{os.sep}"))
                putting_in_place.callback(finish)
        for table in tables:
            report.console().print(table)
        report.say(*lines, *(findings or ()))
        if quick:
            report.say(f"quick run, {self.coarse}: a preview, do not use for design")
        report.say(f"results in {target}{os.sep}, {stages.elapsed:.1f} s")
        for line in (*left_out, *failures):
            report.warn(line)
        return not failures
