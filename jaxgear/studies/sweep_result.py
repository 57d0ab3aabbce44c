"""Result of a sweep: best variants, figures, workbook and pages."""

import dataclasses
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ..contact import Mesh, Resolution
from ..io import DesignFile, writing
from ..microgeometry import NoModification
from ..numerics import UnitKey
from ..report import Chapter, Figure, Table, picture, text, write_variants, write_workbook
from ..sweeps import SweepTable
from . import side_by_side
from .comparison import Modifications
from .evaluation import evaluation_of, torques_of
from .study import AbstractStudyResult
from .summary import save_figures, sizes

TABLE, BEST = "table", "best.csv"  # separate, as readers of the table expect a folder without other files
WORKBOOK, PAGE = "variants.xlsx", "variants.html"
CHOSEN = 3  # variants that a report evaluates
_SHOWN = 8  # of the best designs, on a terminal
_TABLE = 6  # side by side on one page of a report
_DRAWN = 200_000  # most variants drawn; of larger tables every n-th variant is drawn, which bounds the memory
_CHARTS = 6  # radar charts
_UNMODIFIED = "unmodified"


@dataclass(frozen=True)
class SweepResult(AbstractStudyResult):
    """Result of a sweep.

    Attributes:
        design: the design file.
        quick: True for a quick sweep.
        output: result folder; None for a table in memory.
        size: array sizes of a mesh.
        table: all variants.
        best: the best of them, best first.
        grid: lines on the change of the numbers of the best variant on a finer grid.
        unusual: lines of its findings.
        rate: variants per second of this process.
    """

    design: DesignFile
    quick: bool
    output: Path | None
    size: Resolution
    table: SweepTable
    best: SweepTable
    grid: Sequence[str]
    unusual: Sequence[str]
    rate: float

    def tables(self) -> Iterator[Table]:
        """Table of the best variants, one column each."""
        shown = self.best.take(range(min(_SHOWN, len(self.best))))
        header = "variant", *map(str, shown.column("variant"))
        result = Table(header, title=f"{self.table.title}, best first by {self.table.results[0]}", narrow=True)
        for column, values in shown.values(*shown.parameters, *shown.results).items():
            result.add_row(column.named, *(format(value, column.quantity.form) for value in values))
        yield result

    def verdict(self) -> Iterable[str]:
        """Change of the numbers of the best variant on a finer grid."""
        return self.grid

    def findings(self) -> Sequence[str] | None:
        """Values of the best variant out of the usual range."""
        return self.unusual

    def failures(self) -> Iterator[str]:
        """Line with the number of failed variants and the reasons."""
        if failures := self.table.failures():
            why = self.table.why(self.size.chosen_pairs)
            yield f"{failures:,} variants failed (columns converged and status); {why}"

    def details(self) -> Iterable[str]:
        """Place of the table, and variants per second."""
        if (folder := self.output) is not None:
            yield f"best {len(self.best)} in {folder / BEST}, table in {folder / TABLE}{os.sep}"
        yield f"{len(self.table):,} variants" + (f", {self.rate:,.0f}/s" if self.rate else "")

    def inputs(self) -> dict[str, Any]:
        """Operating point, array sizes and variables, as plain data."""
        design = self.design
        return {
            UnitKey("torque", "N m"): design.signed_torque,
            UnitKey("torque_range", "N m"): design.torque_range,
            UnitKey("speed", "rpm"): design.speed,
            "friction": design.friction,
            "resolution": sizes(self.size),
            "variables": {UnitKey(name, design.units[name]): limits for name, limits in design.bounds.items()},
        }

    def summary(self) -> dict[str, Any]:
        """Numbers of variants and of failed variants."""
        return {"variants": len(self.table), "failed_variants": self.table.failures()}

    def write(self, folder: Path) -> None:
        """Write the best variants to `best.csv`."""
        with writing(folder / BEST):
            self.best.to_csv(folder / BEST)

    def figures(self) -> Iterator[Figure]:
        """All figures that the quantities of the table allow; none if all variants have failed."""
        if len(self.best):
            yield from figures_of(self.table)

    def reported(self, folder: Path, facts: Sequence[tuple[str, str]], *, figures: bool) -> "SweepReport":
        """Evaluate the best variants at the torques of the design file; writes the workbook and the interactive page.

        Variants of gears or loads have no common mesh; the report shows their values in the table instead.
        """
        write_workbook(folder / WORKBOOK, facts, self.best, self.table)
        if self.table.failures() < len(self.table):
            write_variants(folder / PAGE, self.design.title, facts, self.table)
        given = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        if self.design.open_case or not len(self.best):
            return SweepReport(**given)
        design, mesh = self.design, jax.block_until_ready(self.design.mesh(self.size))
        torques, involute = torques_of(design, quick=self.quick), NoModification()
        designs: dict[str, Modifications] = {_UNMODIFIED: (involute, involute)}
        first = self.best.take(range(min(CHOSEN, len(self.best))))
        for number, parameters in reversed([*zip(first.column("variant"), first.designs())]):
            designs[f"variant {number}"] = design.design(parameters)
        found = {name: evaluation_of(design, mesh, torques, *flanks) for name, flanks in designs.items()}
        report = SweepReport(**given, mesh=mesh, evaluations=found, torques=torques)
        return dataclasses.replace(report, pages=report.alone(folder)) if figures else report


@dataclass(frozen=True)
class SweepReport(SweepResult):
    """Result of a sweep with its best variants evaluated, for a report.

    Attributes:
        mesh: mesh of the evaluations; None if the variants are not evaluated.
        evaluations: unmodified pair and best variants by name, best variant last.
        torques: torques of the evaluations on the pinion [N m].
        pages: captions of the figures of each variant beside the unmodified pair, by its name and by file.
    """

    mesh: Mesh | None = None
    evaluations: side_by_side.Evaluations = field(default_factory=dict)
    torques: np.ndarray = field(default_factory=lambda: np.empty(0))
    pages: Mapping[str, Mapping[Path, str]] = field(default_factory=dict)

    def tables(self) -> Iterator[Table]:
        """Unmodified pair and best variants side by side, best variant first."""
        if self.evaluations:
            names = _UNMODIFIED, *reversed(list(self.evaluations))
            yield side_by_side.table(self.design, {name: self.evaluations[name] for name in names})

    def verdict(self) -> Iterator[str]:
        """Lines on the ranking and the files of the variants, and on the reason if none is evaluated."""
        yield (
            f"{len(self.table)} variants, ranked by {self.table.results[0]}; the best {len(self.best)} and the table "
            f"are in {WORKBOOK}, with units and filters; {PAGE} is an interactive page of them."
        )
        yield from self.grid
        if self.mesh is None and len(self.best):
            yield "The variants differ in more than their flanks: their numbers are those of the table."

    def findings(self) -> list[str] | None:
        """Values of the evaluated variants out of the usual range; None if the variants are not evaluated."""
        if self.mesh is None:
            return None
        return list(side_by_side.finding_lines(side_by_side.findings(self.design, self.mesh, self.evaluations)))

    def failures(self) -> Iterator[str]:
        """Evaluations that did not converge, and variants that have failed."""
        yield from side_by_side.failures(self.evaluations)
        yield from super().failures()

    def details(self) -> Iterable[str]:
        """No lines: `verdict` contains them."""
        return ()

    def chapters(self) -> Iterator[Chapter]:
        """Chapters on the best variants side by side, and one page for each of the first ones."""
        if len(self.best):
            shown = self.best.take(range(min(_TABLE, len(self.best))))
            _, *columns = shown.columns
            rows = tuple((column.heading, *map(text, shown.column(column.name).tolist())) for column in columns)
            yield Chapter("Best variants", tables=[Table(("", *_names(shown)), rows, "best first")], new_page=True)
        yield from map(self._page, range(min(CHOSEN, len(self.best))))

    def figures(self) -> Iterator[Figure]:
        """Figures of the evaluated variants and of the sweep; a variant has the same style in all figures."""
        from .. import plot

        if self.mesh is not None:
            with plot.same_styles(_styles(self.best)):
                yield from side_by_side.figures(self.design, self.mesh, self.evaluations, self.torques)
        yield from super().figures()

    def alone(self, folder: Path) -> dict[str, dict[Path, str]]:
        """Write figures of each variant next to the unmodified pair only; returns captions by variant and file."""
        from .. import plot

        first, *others = self.evaluations
        with plot.same_styles(_styles(self.best)):
            return {name: save_figures(folder, self._alone(first, name), bold=name) for name in others}

    def _alone(self, *names: str) -> Iterator[Figure]:
        """Figures of two designs, named after the last."""
        from .. import plot

        both = {name: self.evaluations[name] for name in names}
        figures = (
            Figure.of(plot.transmission_error, {name: of.cycle for name, of in both.items()}),
            Figure.of(plot.k_chart, self.mesh, side_by_side.flanks(both)),
        )
        for figure in figures:
            yield dataclasses.replace(figure, name=f"{figure.name}_{names[-1].replace(' ', '_')}")

    def _page(self, place: int) -> Chapter:
        """Chapter on one variant and its rank among the others."""
        name, best = _names(self.best)[place], self.best
        rows = []
        for column in map(best.find, (*best.parameters, *best.results)):
            low, high = map(text, _range(self.table, column.name))
            rows.append((column.heading, text(best.column(column.name)[place]), low, high, column.better))
        header = ("", name, "least of all", "largest of all", "better is")
        pictures = [picture(*each) for each in self.pages.get(name, {}).items()]
        return Chapter(name.capitalize(), tables=[Table(header, tuple(rows))], figures=pictures, new_page=True)


def figures_of(table: SweepTable) -> Iterator[Figure]:
    """All figures that the quantities of a table allow; at least one variant must have converged."""
    from .. import plot

    heads, size = table.heads, len(table)
    step, best = -(-size // _DRAWN), table.best(_CHARTS)
    note = f"1 in {step} of {size:,} variants".replace(",", "\u2009")

    def noted(figure: Figure) -> Figure:
        if step > 1:
            axis = np.ravel(figure.axes)[0]
            axis.set_title(note, loc="left", pad=32, fontsize=axis.xaxis.label.get_fontsize())
        return figure

    rows = np.arange(0, size, step)
    with plot.same_styles(_styles(best)):
        if len(heads) > 1:
            shown = rows
            if step > 1:  # the front is computed from all variants, drawn or not
                shown = np.union1d(rows, table.pareto([head.name for head in heads[:3]]).column("variant"))
            yield noted(Figure.of(plot.pareto, table.take(shown).values(*heads[:3])))
        numbers = np.union1d(rows, best.column("variant"))  # the best of all, too
        lines = table.take(numbers).values(*table.parameters, *heads)
        yield noted(Figure.of(plot.parallel_coordinates, lines, heads[0], numbers=numbers))
        if len(heads) > 2:  # the statistic that all results have in common stands once, under the charts
            spokes = {head.quantity: values for head, values in best.values(*heads).items()}
            yield Figure.of(plot.radar, spokes, names=_names(best), note=heads[0].statistic)


def _names(best: SweepTable) -> list[str]:
    return [f"variant {number}" for number in best.column("variant")]


def _styles(best: SweepTable) -> dict[str, int]:
    """Numbers of the styles of the best variants, best first, in all figures."""
    from .. import plot

    return {_UNMODIFIED: 0, **dict(zip(_names(best), plot.figure.APART))}


def _range(table: SweepTable, name: str) -> tuple[float, float]:
    """Least and largest value of a column, part by part."""
    least, largest = np.inf, -np.inf
    for batch in table.batches([name]):
        values = batch[name][np.isfinite(batch[name])]
        if len(values):
            least, largest = min(least, float(values.min())), max(largest, float(values.max()))
    return least, largest
