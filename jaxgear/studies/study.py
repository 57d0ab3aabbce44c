"""Base classes of studies, checked when made, and of their results: summary, tables, text and figures."""

import abc
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar

from ..io import DesignFile
from ..report import Chapter, Figure, Table
from . import manufactured
from .checkpoints import Checkpoints
from .progress import Callback, Stages

R = TypeVar("R", bound="AbstractStudyResult", covariant=True)


class AbstractStudyResult(abc.ABC):
    """Result of a study.

    All methods but `summary` have a default: a result of numbers alone needs nothing else.

    Attributes:
        assumptions: assumptions of the study, beside those of every contact analysis, for a report.
    """

    assumptions: ClassVar[tuple[str, ...]] = ()

    def inputs(self) -> dict[str, Any]:
        """Input values as plain data: loads, settings, model; the first part of `summary.json`."""
        return {}

    @abc.abstractmethod
    def summary(self) -> dict[str, Any]:
        """The results as plain data; a `UnitKey` is a name with a unit."""

    def headlines(self) -> Iterable[Table]:
        """Tables of two columns to be read before all others; they say what `findings` says."""
        return ()

    def tables(self) -> Iterable[Table]:
        """Tables to be read first."""
        return ()

    def verdict(self) -> Iterable[str]:
        """The result in words, a line each."""
        return ()

    def details(self) -> Iterable[str]:
        """How it was found, in words, said last."""
        return ()

    def findings(self) -> Iterable[str] | None:
        """A line for everything out of the usual range; None where that is not checked."""
        return None

    def failures(self) -> Iterable[str]:
        """A line for every result that did not converge or limit that is not met; a command fails with any."""
        return ()

    def checks(self) -> Iterable[tuple[str, str]]:
        """Name and text of numbers that show convergence and validity, for a report."""
        return ()

    def chapters(self) -> Iterable[Chapter]:
        """Further chapters of a report."""
        return ()

    def figures(self) -> Iterable[Figure]:
        """The figures, drawn anew."""
        return ()

    def reported(self, folder: Path, facts: Sequence[tuple[str, str]], *, figures: bool) -> "AbstractStudyResult":
        """The result with everything that a report shows besides; by default the result itself.

        Args:
            folder: folder of the results, for further files.
            facts: names and texts for the head of a file.
            figures: True if figures are drawn.
        """
        return self

    def write(self, folder: Path) -> None:  # noqa: B027 - the default writes nothing
        """Writes further files, such as tables of every number, into a folder."""


@dataclass(frozen=True)
class AbstractStudy(abc.ABC, Generic[R]):
    """A study of a design file.

    A library calls `Study.of(design).run()`; the command line makes a command of every study that it knows, with
    progress, report, interruption and resumption. The docstring of a study, up to its first section, is the help of
    that command. A study of another package is a command where the package names it as an entry point of the group
    `jaxgear.studies`. Numbers are those of double precision where `jax_enable_x64` is set, as commands set it.

    Attributes:
        name: of the study and of its command.
        coarse: what a quick study has too few of; "" where its result says it.
        needs: modules that it imports late; a command imports them ahead, beside its first compilation.
        report_needs: modules that its report needs besides.
        grows: elements of a result that grows in its folder, a field `output` of the study, while the study runs for
            long, such as "variants"; "" if all results are put in place at the end.
        takes_shafts: whether the shafts of the file support the gears at every load.
        takes_coast: whether it knows the coast flanks, which carry a negative torque.
        design: the design file.
        quick: whether the study is a preview on few positions.
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
        """The study that a design file asks for, checked before anything is worked out.

        Args:
            design: the design file.
            quick: a preview on few positions.

        Raises:
            DesignFileError: for anything that is wrong with it, in one line that names the file and the key.
        """
        return cls(design, quick)

    def run(self, *, checkpoints: Checkpoints | None = None, callback: Callback | None = None) -> R:
        """Works the study out.

        Args:
            checkpoints: what an interrupted run has found, and where this one keeps what it finds; None keeps nothing.
            callback: told how far the study is; an exception that it raises ends the study.

        Raises:
            DesignFileError: for what only shows in the calculation.
            ValueError: when a checkpoint cannot be written.
        """
        if not self.takes_coast:
            self.design.check_drive(f"jaxgear {self.name}")
        return self.work_out(Checkpoints() if checkpoints is None else checkpoints, Stages(callback))

    @abc.abstractmethod
    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> R:
        """Calculates the result; `run` calls it.

        Args:
            checkpoints: checkpoints of long calculations.
            stages: progress, told of every stage.
        """

    @property
    def folder(self) -> str:
        """Folder of its results below that of the design file."""
        return self.name

    def omits(self) -> str:
        """Message naming the tables of the file, but for its shafts, that the study ignores and why; "" for none."""
        return manufactured.left_out(self.design)

    @property
    def left_out(self) -> str:
        """Message naming the shafts, bearings and housing that the study ignores and why; "" for none."""
        return "" if self.takes_shafts else self.design.left_out
