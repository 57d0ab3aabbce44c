"""How far a study is, told to a callback."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """How far a study is.

    Attributes:
        stage: what the study does now, in words.
        done: how much of the stage is done, in the same unit as `total`; None when the stage begins.
        total: how much there is to do; None where that is not known.
        note: what comes next, or the best value so far, in words.
    """

    stage: str
    done: int | None = None
    total: int | None = None
    note: str = ""


# An exception that it raises ends the study.
Callback = Callable[[Progress], None]


class Stages:
    """Tells a callback of the stages of a study.

    Args:
        callback: called at the start of every stage and within it; None for silence.
    """

    def __init__(self, callback: Callback | None = None) -> None:
        self._callback, self._stage = callback, ""

    def begin(self, stage: str) -> None:
        """Names the next stage."""
        self._stage = stage
        self._tell(Progress(stage))

    def step(self, step: int, total: int, best: float | None) -> None:
        """The callback of a search."""
        self.count(step, total, f"best {best:.4g}")

    def count(self, done: int, total: int | None, note: str = "") -> None:
        """How much of the stage is done, and what is next."""
        self._tell(Progress(self._stage, done, total, note))

    def _tell(self, progress: Progress) -> None:
        if self._callback is not None:
            self._callback(progress)
