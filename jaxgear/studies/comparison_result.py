"""Result of a comparison of designs: tables, text, figures and files."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..contact import Mesh
from ..io import DesignFile, write_flanks, write_front
from ..metrics import Finding
from ..optimize import Front, Optimum, Projection
from ..report import Chapter, Table
from . import comparison_summary, manufactured, optimum_report, side_by_side
from .evaluation import Evaluation
from .gear_data import mounting
from .optimum_report import front_table
from .study import AbstractStudyResult

_USUAL = "none, inputs and results lie within the usual ranges"


@dataclass(frozen=True)
class ComparisonResult(AbstractStudyResult):
    """Designs side by side.

    Attributes:
        design: the design file.
        quick: whether positions are coarse and torques few.
        mesh: on which the designs are evaluated.
        torques: over the range of the file, at which they are evaluated [N m], shape (torques,).
        evaluations: designs by their names, the first of which is unmodified.
        unusual: what of every design is out of the usual range, by its name.
        optimum: what a search has found; None without one.
        front: of which the optimum is the compromise; None without one.
        projection: of the optimum on a curve; None without one.
        searched_at: positions at which the search began.
        unverified: why nothing is verified by finite elements; "" where it is, or is not asked for.
    """

    design: DesignFile
    quick: bool
    mesh: Mesh
    torques: np.ndarray
    evaluations: Mapping[str, Evaluation]
    unusual: Mapping[str, tuple[Finding, ...]]
    optimum: Optimum | None = None
    front: Front | None = None
    projection: Projection | None = None
    searched_at: int = 0
    unverified: str = ""

    def summary(self) -> dict[str, Any]:
        """Every number of the designs, and the optimum."""
        data = comparison_summary.summary(self.design, self.mesh, self.evaluations, self.torques, self.unusual)
        if self.optimum is not None:
            data["optimum"] = optimum_report.summary(self.design, self.optimum, self.projection)
        return data

    def write(self, folder: Path) -> None:
        """The flanks of all designs as `flanks.csv`, and a front as `front.csv`."""
        write_flanks(folder / "flanks.csv", self.mesh, side_by_side.flanks(self.evaluations))
        if self.front is not None:
            write_front(folder / "front.csv", self.front)

    def figures(self) -> dict[str, Any]:
        """Designs, their scatter over manufactured gears, and the search."""
        axes = side_by_side.figures(self.design, self.mesh, self.evaluations, self.torques)
        axes |= manufactured.figures(self.evaluations)
        if self.optimum is not None:
            of = self.mesh, self.design.torque, self.optimum, self.front, self.evaluations
            axes |= optimum_report.figures(*of)
        return axes

    def headlines(self) -> Iterator[Table]:
        """Summary tables of an optimization, shown before all others; none without an optimum."""
        if self.optimum is not None:
            found = self.optimum, self.front, self.projection, self.evaluations
            yield from optimum_report.first_screen(
                self.design,
                *found,
                searched_at=self.searched_at,
                unusual=self.unusual[side_by_side.main_name(self.evaluations)],
                trust=self._trust(),
            )

    def _trust(self) -> Iterator[tuple[str, str]]:
        for line in self._not_converged():
            yield "failed", line
        yield from (("note", line) for line in self._notes())
        findings = [line.removeprefix(side_by_side.WARNING) for line in self.findings()]
        yield from (("warning", line) for line in findings)
        if not findings:
            yield "warnings", _USUAL

    def tables(self) -> Iterator[Table]:
        """The designs side by side, and those of a front."""
        yield side_by_side.table(self.design, self.evaluations)
        if self.front is not None:
            yield front_table(self.front, self.evaluations, self.design.units)

    def verdict(self) -> Iterator[str]:
        """The results in words, where there is no optimum that says them first."""
        if self.optimum is None:
            yield from (*side_by_side.grid(self.evaluations), *self._notes())
        yield mounting(self.design)

    def _notes(self) -> Iterator[str]:
        yield from manufactured.lines(self.design, self.evaluations)
        if self.design.coast:
            yield "coast flanks: contact runs from pinion tip to pinion root, positions count against the rotation"
        if self.quick:
            yield "quick run, coarse positions and a short search: a preview, do not use for design"
        if self.unverified:
            yield f"not verified by finite elements: {self.unverified}"

    def details(self) -> Iterator[str]:
        """How a search has gone."""
        if self.optimum is not None:
            yield from optimum_report.search_lines(self.optimum, self.front, self.projection)

    def findings(self) -> Iterator[str]:
        """Values of the designs out of the usual range."""
        return side_by_side.finding_lines(self.unusual)

    def failures(self) -> Iterator[str]:
        """Results that did not converge, and limits that are not met."""
        yield from self._not_converged()
        if self.optimum is not None and not self.optimum.feasible:
            yield "constraints are not met"

    def _not_converged(self) -> Iterator[str]:
        yield from (*side_by_side.failures(self.evaluations), *manufactured.failures(self.evaluations))

    def chapters(self) -> list[Chapter]:
        """Robustness, where the file has tolerances."""
        return manufactured.pages(self.design, self.evaluations)
