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
from ..report import Chapter, Table, figure, text, write_variants, write_workbook
from ..sweeps import SweepTable
from . import side_by_side
from .comparison import Modifications
from .evaluation import evaluation_of, torques_of
from .results import save_figures
from .study import AbstractStudyResult
from .summary_data import sizes

TABLE, BEST = "table", "best.csv"  # apart: readers of the table take its folder for theirs alone
WORKBOOK, PAGE = "variants.xlsx", "variants.html"
CHOSEN = 3  # variants that a report evaluates
_SHOWN = 8  # of the best designs, on a terminal
_TABLE = 6  # side by side on one page of a report
_DRAWN = 200_000  # variants; of more, every so many-th is drawn, so that memory does not grow with the table
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
        """The best variants as columns."""
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
        """How many variants have failed, and why."""
        if failures := self.table.failures():
            why = self.table.why(self.size.chosen_pairs)
            yield f"{failures:,} variants failed (columns converged and status); {why}"

    def details(self) -> Iterable[str]:
        """Place of the table, and variants per second."""
        if (folder := self.output) is not None:
            yield f"best {len(self.best)} in {folder / BEST}, table in {folder / TABLE}{os.sep}"
        yield f"{len(self.table):,} variants" + (f", {self.rate:,.0f}/s" if self.rate else "")

    def summary(self) -> dict[str, Any]:
        """The operating point, the variables, and how many variants there are."""
        design = self.design
        named = {name: f"{name} [{unit}]" if unit else name for name, unit in design.units.items()}
        return {
            "torque_Nm": design.signed_torque,
            "torque_range_Nm": design.torque_range,
            "speed_rpm": design.speed,
            "friction": design.friction,
            "resolution": sizes(self.size),
            "variables": {named[name]: limits for name, limits in design.bounds.items()},
            "variants": len(self.table),
            "failed_variants": self.table.failures(),
        }

    def write(self, folder: Path) -> None:
        """The best variants as `best.csv`."""
        with writing(folder / BEST):
            self.best.to_csv(folder / BEST)

    def figures(self) -> dict[str, Any]:
        """All figures that the results allow, of a table with a variant that did not fail."""
        return figures_of(self.table) if len(self.best) else {}

    def reported(self, folder: Path, facts: Sequence[tuple[str, str]], *, figures: bool) -> "SweepReport":
        """The best variants evaluated at the torques of the design file; writes the workbook and the interactive page.

        Variants of more than the flanks, of other gears or loads, have no common mesh and stay as the table has them.
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
        pages: files of the figures of each variant beside the unmodified pair, by the name of the variant.
    """

    mesh: Mesh | None = None
    evaluations: side_by_side.Evaluations = field(default_factory=dict)
    torques: np.ndarray = field(default_factory=lambda: np.empty(0))
    pages: Mapping[str, Sequence[Path]] = field(default_factory=dict)

    def tables(self) -> Iterator[Table]:
        """Unmodified pair and best variants side by side, best variant first."""
        if self.evaluations:
            names = _UNMODIFIED, *reversed(list(self.evaluations))
            yield side_by_side.table(self.design, {name: self.evaluations[name] for name in names})

    def verdict(self) -> Iterator[str]:
        """How variants are ranked and where they are, and why none is evaluated."""
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
        """Nothing."""
        return ()

    def chapters(self) -> list[Chapter]:
        """The best variants side by side, and a page of each of the first of them."""
        count = min(CHOSEN, len(self.best))
        return [_side_by_side(self.best), *map(self._page, range(count))] if len(self.best) else []

    def figures(self) -> dict[str, Any]:
        """Figures of the evaluated variants, and of the sweep; a variant has one style in all."""
        from .. import plot

        if self.mesh is None:
            return super().figures()
        with plot.same_styles(_styles(self.best)):
            evaluated = side_by_side.figures(self.design, self.mesh, self.evaluations, self.torques)
        return evaluated | super().figures()

    def alone(self, folder: Path) -> dict[str, list[Path]]:
        """Writes the figures of each variant beside the unmodified pair alone."""
        from .. import plot

        assert self.mesh is not None
        first, *others = self.evaluations
        pages = {}
        with plot.same_styles(_styles(self.best)):
            for name in others:
                both = {first: self.evaluations[first], name: self.evaluations[name]}
                axes = {
                    "transmission_error": plot.transmission_error({one: of.cycle for one, of in both.items()}),
                    "k_chart": plot.k_chart(self.mesh, side_by_side.flanks(both)),
                }
                named = {f"{kind}_{name.replace(' ', '_')}": ax for kind, ax in axes.items()}
                pages[name] = save_figures(folder, named, bold=name)
        return pages

    def _page(self, place: int) -> Chapter:
        """One variant, and what it is among the others."""
        name, best = _names(self.best)[place], self.best
        rows = []
        for column in map(best.find, (*best.parameters, *best.results)):
            low, high = map(text, _range(self.table, column.name))
            rows.append((column.heading, text(best.column(column.name)[place]), low, high, column.better))
        header = ("", name, "least of all", "largest of all", "better is")
        pictures = [figure(path) for path in self.pages.get(name, ())]
        return Chapter(name.capitalize(), tables=[Table(header, tuple(rows))], figures=pictures, new_page=True)


def figures_of(table: SweepTable) -> dict[str, Any]:
    """Axes of all figures that the results allow, of a table with a variant that did not fail."""
    from .. import plot

    heads = table.heads
    size = len(table)
    step = -(-size // _DRAWN)
    best = table.best(_CHARTS)
    axes: dict[str, Any] = {}
    with plot.same_styles(_styles(best)):
        if len(heads) > 1:
            rows = np.arange(0, size, step)
            if step > 1:  # the front is that of all variants, whichever of the others are drawn
                rows = np.union1d(rows, table.pareto([head.name for head in heads[:3]]).column("variant"))
            axes["pareto"] = plot.pareto(table.take(rows).values(*heads[:3]))
        numbers = np.union1d(np.arange(0, size, step), best.column("variant"))  # the best of all, too
        lines = table.take(numbers).values(*table.parameters, *heads)
        axes["parallel_coordinates"] = plot.parallel_coordinates(lines, heads[0], numbers=numbers)
        if len(heads) > 2:
            # what is said of all results alike stands once, under the charts
            spokes = {head.quantity: values for head, values in best.values(*heads).items()}
            axes["radar"] = plot.radar(spokes, names=_names(best), note=heads[0].statistic)
    if step > 1:
        note = f"1 in {step} of {size:,} variants".replace(",", "\u2009")
        for name in axes.keys() - {"radar"}:
            axis = np.ravel(axes[name])[0]
            axis.set_title(note, loc="left", pad=32, fontsize=axis.xaxis.label.get_fontsize())
    return axes


def _names(best: SweepTable) -> list[str]:
    return [f"variant {number}" for number in best.column("variant")]


def _styles(best: SweepTable) -> dict[str, int]:
    """Numbers of the styles of the best variants, best first, in all figures."""
    from .. import plot

    return {_UNMODIFIED: 0, **dict(zip(_names(best), plot.figure.APART))}


def _side_by_side(best: SweepTable) -> Chapter:
    shown = best.take(range(min(_TABLE, len(best))))
    _, *columns = shown.columns
    rows = tuple((column.heading, *_values(shown, column.name)) for column in columns)
    return Chapter("Best variants", tables=[Table(("", *_names(shown)), rows, "best first")], new_page=True)


def _values(table: SweepTable, name: str) -> list[str]:
    return [text(value) for value in table.column(name).tolist()]


def _range(table: SweepTable, name: str) -> tuple[float, float]:
    """Least and largest value of a column, part by part."""
    least, largest = np.inf, -np.inf
    for batch in table.batches([name]):
        values = batch[name][np.isfinite(batch[name])]
        if len(values):
            least, largest = min(least, float(values.min())), max(largest, float(values.max()))
    return least, largest
