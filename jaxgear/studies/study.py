"""Base classes of studies, checked when made, and of their results: summary, tables, text and figures."""

import abc
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar

from ..io import DesignFile
from ..report import Chapter, Figure, Table
from . import manufactured
from .checkpoints import Checkpoints


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


R = TypeVar("R", bound="AbstractStudyResult", covariant=True)


class AbstractStudyResult(abc.ABC):
    """Result of a study.

    All methods except `summary` have a default.

    Attributes:
        assumptions: assumptions of the study for a report, in addition to those of every contact analysis.
    """

    assumptions: ClassVar[tuple[str, ...]] = ()

    def inputs(self) -> dict[str, Any]:
        """Input values as plain data: loads, settings, model; the first part of `summary.json`."""
        return {}

    @abc.abstractmethod
    def summary(self) -> dict[str, Any]:
        """Results as plain data; use `UnitKey` for a name with a unit."""

    def headlines(self) -> Iterable[Table]:
        """Tables of two columns, shown before all others; they include the lines of `findings`."""
        return ()

    def tables(self) -> Iterable[Table]:
        """Tables of the results."""
        return ()

    def verdict(self) -> Iterable[str]:
        """Lines that describe the result."""
        return ()

    def details(self) -> Iterable[str]:
        """Lines on the calculation of the result, shown last."""
        return ()

    def findings(self) -> Iterable[str] | None:
        """Line for every value outside the usual range; None if usual ranges are not checked."""
        return None

    def failures(self) -> Iterable[str]:
        """Line for every result that has not converged and every limit that is not met; any line fails the command."""
        return ()

    def checks(self) -> Iterable[tuple[str, str]]:
        """Names and texts of the checks of convergence and validity, for a report."""
        return ()

    def chapters(self) -> Iterable[Chapter]:
        """Further chapters of a report."""
        return ()

    def figures(self) -> Iterable[Figure]:
        """Figures of the result, drawn at every call."""
        return ()

    def reported(self, folder: Path, facts: Sequence[tuple[str, str]], *, figures: bool) -> "AbstractStudyResult":
        """Result with the additional content of a report; by default the result itself.

        Args:
            folder: folder of the results, for further files.
            facts: names and texts for the head of a file.
            figures: True if figures are drawn.
        """
        return self

    def write(self, folder: Path) -> None:  # noqa: B027 - the default writes nothing
        """Write further files, such as tables of all values, into a folder."""


@dataclass(frozen=True)
class AbstractStudy(abc.ABC, Generic[R]):
    """A study of a design file.

    Call `Study.of(design).run()` in Python. The command line makes a command of every study, with progress, report,
    interruption and resumption; the docstring of the study, up to its first section, is the help of the command. A
    study of another package becomes a command by an entry point of the group `jaxgear.studies`. Commands compute in
    double precision; in Python the precision follows `jax_enable_x64`.

    Attributes:
        name: name of the study and of its command.
        coarse: array sizes that are coarse in a quick study, in words; "" if the result reports them.
        needs: modules that the study imports late; a command imports them in advance, during its first compilation.
        report_needs: further modules that its report imports.
        grows: name of the elements, such as "variants", of a result that grows in the folder `output` of the study
            while it runs; "" if all results are written at the end.
        takes_shafts: True if the shafts of the file support the gears at every load.
        takes_coast: True if the study analyses coast flanks, which carry a negative torque.
        design: design file.
        quick: True for a preview on few positions.
    """

    name: ClassVar[str]
    coarse: ClassVar[str] = "coarse positions"
    needs: ClassVar[tuple[str, ...]] = ()
    report_needs: ClassVar[tuple[str, ...]] = ()
    grows: ClassVar[str] = ""
    takes_shafts: ClassVar[bool] = False
    takes_coast: ClassVar[bool] = False

    design: DesignFile
    quick: bool

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Make the study of a design file, checked before any calculation.

        Args:
            design: design file.
            quick: True for a preview on few positions.

        Raises:
            DesignFileError: for errors in the file, in one line that names the file and the key.
        """
        return cls(design, quick)

    def run(self, *, checkpoints: Checkpoints | None = None, callback: Callback | None = None) -> R:
        """Run the study.

        Args:
            checkpoints: intermediate results of an interrupted run, and storage for those of this run; None to store
                nothing.
            callback: called with the progress of the study; an exception that it raises ends the study.

        Raises:
            DesignFileError: for errors in the file that only the calculation reveals.
            ValueError: if a checkpoint cannot be written.
        """
        if not self.takes_coast:
            self.design.check_drive(f"jaxgear {self.name}")
        return self.work_out(Checkpoints() if checkpoints is None else checkpoints, Stages(callback))

    @abc.abstractmethod
    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> R:
        """Calculates the result; `run` calls it.

        Args:
            checkpoints: checkpoints of long calculations.
            stages: progress of the study.
        """

    @property
    def folder(self) -> str:
        """Folder of the results of the study, relative to the results folder of the design file."""
        return self.name

    def omits(self) -> str:
        """Message naming the tables of the file, shafts excepted, that the study ignores, and why; "" for none."""
        lines = manufactured.left_out(self.design), *self.design.part_of.values()
        return "; ".join(line for line in lines if line)

    @property
    def left_out(self) -> str:
        """Message naming the shafts, bearings and housing that the study ignores and why; "" for none."""
        return "" if self.takes_shafts else self.design.left_out
