"""Progress of a study, reported to a callback."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """Progress of a study.

    Attributes:
        stage: name of the current stage.
        done: number of steps done in the stage; None at its start.
        total: number of steps of the stage; None if unknown.
        note: next step, or best value so far, in words.
    """

    stage: str
    done: int | None = None
    total: int | None = None
    note: str = ""


# An exception that it raises ends the study.
Callback = Callable[[Progress], None]


class Stages:
    """Report the stages of a study to a callback.

    Args:
        callback: called at the start of every stage and within it; None for no messages.
    """

    def __init__(self, callback: Callback | None = None) -> None:
        self._callback, self._stage = callback, ""

    def begin(self, stage: str) -> None:
        """Start the next stage."""
        self._stage = stage
        self._tell(Progress(stage))

    def step(self, step: int, total: int, best: float | None) -> None:
        """Report a step of a search, with the best value so far."""
        self.count(step, total, f"best {best:.4g}")

    def count(self, done: int, total: int | None, note: str = "") -> None:
        """Report the steps done, the total (None if unknown) and a note on the next step."""
        self._tell(Progress(self._stage, done, total, note))

    def _tell(self, progress: Progress) -> None:
        if self._callback is not None:
            self._callback(progress)
