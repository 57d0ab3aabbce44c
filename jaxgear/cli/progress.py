"""Progress on stderr: a bar on a terminal, lines elsewhere."""

import os
import time
from pathlib import Path
from typing import Any

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .. import studies
from ..io.folder import earlier
from . import interrupt, terminal


class Stages(Progress, studies.Stages):
    """Progress of a command through its stages."""

    def __init__(self) -> None:
        columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}")
        console = terminal.console(stderr=True)
        options: dict[str, Any] = {"console": console, "transient": True, "disable": not console.is_terminal}
        Progress.__init__(self, *columns, TimeElapsedColumn(), TimeRemainingColumn(), **options)
        studies.Stages.__init__(self, self.shown)
        self._began = time.perf_counter()
        self._task = self.add_task("reading the design file", total=None, note="")

    @property
    def elapsed(self) -> float:
        """Time since the start [s]."""
        return time.perf_counter() - self._began

    def shown(self, progress: studies.Progress) -> None:
        """Shows how far a study is; its callback."""
        interrupt.check()
        done, begins = progress.done or 0, progress.done is None
        self.update(self._task, description=progress.stage, total=progress.total, completed=done, note=progress.note)
        if begins and not self.console.is_terminal:
            self.console.print(f"jaxgear: {progress.stage}", soft_wrap=True)

    def replaces(self, target: Path) -> None:
        """Says which earlier results a command is about to replace, as long as it can still be stopped."""
        held = earlier(target)
        if held:
            line = f"jaxgear: replaces the results in {target}{os.sep} ({held}); --output keeps them"
            self.console.print(line, soft_wrap=True)
