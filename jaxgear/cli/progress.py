"""Progress on stderr: a bar on a terminal, lines elsewhere."""

import os
import time
from pathlib import Path

from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .. import studies
from ..io.folder import earlier
from . import interrupt, terminal

_LINES = 10  # of a sweep, where there is no terminal, and more
_QUIET = 30.0  # seconds after which there is a line anyway


class _Bar(Progress):
    def __init__(self, *columns: ProgressColumn, doing: str, note: str):
        console = terminal.console(stderr=True)
        super().__init__(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._began = time.perf_counter()
        self._task = self.add_task(doing, total=None, note=note)

    @property
    def elapsed(self) -> float:
        """Since the start [s]."""
        return time.perf_counter() - self._began

    def _say(self, line: str) -> None:
        if not self.console.is_terminal:
            self.console.print(f"jaxgear: {line}", soft_wrap=True)


class Stages(_Bar, studies.Stages):
    """Progress of a command through its stages."""

    def __init__(self) -> None:
        columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"), TimeElapsedColumn()
        _Bar.__init__(self, *columns, doing="reading the design file", note="")
        studies.Stages.__init__(self, self.shown)

    def shown(self, progress: studies.Progress) -> None:
        """Shows how far a study is; its callback."""
        interrupt.check()
        done, begins = progress.done or 0, progress.done is None
        self.update(self._task, description=progress.stage, total=progress.total, completed=done, note=progress.note)
        if begins:
            self._say(progress.stage)

    def replaces(self, target: Path) -> None:
        """Says which earlier results a command is about to replace, as long as it can still be stopped."""
        held = earlier(target)
        if held:
            line = f"jaxgear: replaces the results in {target}{os.sep} ({held}); --output keeps them"
            self.console.print(line, soft_wrap=True)


class Meter(_Bar):
    """Progress of a sweep, whose callback it is.

    Attributes:
        done: variants of this process, None before the first.
    """

    def __init__(self, target: Path) -> None:
        columns = TextColumn("{task.fields[note]}"), BarColumn(), TextColumn("{task.percentage:.0f} %")
        super().__init__(*columns, TimeRemainingColumn(), doing="", note="preparing")
        self.done: int | None = None
        self._target = target
        self._first, self._since, self._lines, self._said = 0, self._began, 0, self._began

    def __call__(self, done: int, total: int, best: float | None) -> None:
        if self.done is None:
            self._first, self._since = done, time.perf_counter()
            if done:
                self.console.print(f"jaxgear: resuming, {done:,} of {total:,} variants are complete", soft_wrap=True)
        self.done = done
        there = f"{done:,} of {total:,} variants"
        interrupt.note(f"{there} are in {self._target}{os.sep}, resume with the same command")
        note = there + (f", {self.rate:,.0f}/s" if self.rate else "")
        self.update(self._task, completed=done, total=total, note=note)
        if done * _LINES // total > self._lines or time.perf_counter() - self._said > _QUIET:
            self._lines, self._said = done * _LINES // total, time.perf_counter()
            self._say(note)

    @property
    def rate(self) -> float:
        """Variants per second of this process, with the compilation of its program."""
        spent = time.perf_counter() - self._since
        return ((self.done or 0) - self._first) / spent if spent > 0 else 0.0
