"""Sweep study: table of any number of variants of a design file."""

import dataclasses
import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self

import jax
import numpy as np

from ..contact import Mesh, Resolution
from ..io import DesignFile, writing
from ..io.errors import naming
from ..io.sweep_table import SweepSection
from ..metrics import findings_of
from ..microgeometry import NoModification
from ..numerics import UnitKey
from ..report import Chapter, Figure, Table, picture, text, write_variants, write_workbook
from ..sweeps import SweepTable, over_torques, sweep
from . import side_by_side
from .checkpoints import Checkpoints
from .comparison import Modifications
from .evaluation import coarse, evaluation_of, grid_change, grid_lines, grid_of, torques_of
from .side_by_side import WARNING
from .study import AbstractStudy, AbstractStudyResult, Stages
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


_QUICK_SAMPLES = 4096
_LINES, _QUIET = 10, 30.0  # lines of progress of a sweep, and seconds after which there is one anyway


@dataclass(frozen=True)
class SweepStudy(AbstractStudy[SweepResult]):
    """Evaluate the variants of the design file, any number of them, into a table of Parquet files.

    The folder "table" of the results contains only the table: pandas, polars and Arrow read the folder as a whole. An
    interrupted sweep resumes when the command is repeated.

    Attributes:
        settings: table [sweep] of the design file.
        best: number of the best designs that are listed.
        output: result folder, in which the table grows; None keeps the table in memory.
    """

    name: ClassVar = "sweep"
    coarse: ClassVar = "coarse positions and few samples"
    takes_coast: ClassVar = True
    grows: ClassVar = "variants"
    report_needs: ClassVar = ("xlsxwriter", "plotly")

    settings: SweepSection
    best: int = 10
    output: Path | None = None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False, samples: int | None = None, best: int = 10) -> Self:
        """Sweep of a design file, see `AbstractStudy.of`.

        Args:
            design: the design file.
            quick: True for coarse positions and few samples.
            samples: number of variants; None for the number of the file.
            best: number of best designs to list.
        """
        with naming(design.path):
            section = design.needed("sweep", "it says which variants to evaluate")
            settings = section.with_samples(samples, _QUICK_SAMPLES if quick else None)
            settings.arguments(design)
        return cls(design, quick, settings, best)

    def omits(self) -> str:
        """Empty message: variants scatter within [tolerance]."""
        return ""

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> SweepResult:
        """Evaluate all variants and find the best; the table itself stores the variants of an interrupted sweep."""
        design, options = self.design, self.settings.arguments(self.design)
        size = design.resolution(options.pop("highest_torque"))
        size = coarse(size) if self.quick else size
        if self.output is not None:
            _check(self.output)
        stages.count(0, None, "preparing")
        meter, output = _Meter(stages), None if self.output is None else self.output / TABLE
        load, plan = options.pop("load"), options.pop("plan")
        table = sweep(design.sweep_mesh(size), load, design.design, plan, output=output, callback=meter, **options)
        if jax.process_index() > 0:  # only the first process reports
            return SweepResult(design, self.quick, self.output, size, table, table.take([]), (), (), meter.rate)
        chosen = table.best(self.best)
        grid, findings = best_variant_lines(design, chosen, size) if len(chosen) else ([], [])
        return SweepResult(design, self.quick, self.output, size, table, chosen, grid, findings, meter.rate)


def _check(target: Path) -> None:
    """Raise a `ValueError` for a folder with other contents, which results could overwrite."""
    with writing(target):
        others = [] if (target / TABLE).exists() or not target.is_dir() else sorted(os.listdir(target))
    if others:
        raise ValueError(f"{target}: holds other files than a sweep ({others[0]}), choose another folder")


class _Meter:
    """Callback of a sweep: reports every tenth of the variants, and at least after `_QUIET` seconds."""

    def __init__(self, stages: Stages) -> None:
        self._stages, self._done, self._first = stages, -1, 0
        self._since = self._said = time.perf_counter()
        self._lines = 0

    def __call__(self, done: int, total: int, best: float | None) -> None:
        now = time.perf_counter()
        if self._done < 0:
            self._first, self._since = done, now
            if done:
                self._stages.begin(f"resuming, {done:,} of {total:,} variants are complete")
        self._done = done
        rate = f", {self.rate:,.0f}/s" if self.rate else ""
        note = f"{done:,} of {total:,} variants{rate}"
        if done * _LINES // total > self._lines or now - self._said > _QUIET:
            self._lines, self._said = done * _LINES // total, now
            self._stages.begin(note)
        self._stages.count(done, total, note)

    @property
    def rate(self) -> float:
        """Variants per second of this process, compilation included."""
        spent = time.perf_counter() - self._since
        return max(self._done - self._first, 0) / spent if spent > 0 else 0.0


def best_variant_lines(design: DesignFile, best: SweepTable, size: Resolution) -> tuple[list[str], list[str]]:
    """Lines on the best variant: changes of its values on a finer grid, and its findings.

    Args:
        design: design file.
        best: table whose first row is the best variant.
        size: array sizes of the mesh.
    """
    parameters = best.take([0]).designs()[0]
    made = design.sweep_mesh(size)
    mesh = made if isinstance(made, Mesh) else made(parameters)
    torque = float(design.operating_point(parameters).torque)
    pinion, wheel = design.design(parameters)
    (cycle,) = over_torques(mesh, np.asarray([torque]), pinion=pinion, wheel=wheel)
    name = f"variant {best.column('variant')[0]} at {torque:g} N m"
    findings = findings_of(cycle, pinion=pinion, wheel=wheel, compliance=mesh.compliance)
    grid = grid_of(mesh.resolution, helical=mesh.kinematics.helical)
    lines = grid_lines(grid, {name: grid_change(mesh, cycle, pinion, wheel)})
    return [*lines], [f"{WARNING}{name}: {finding}" for finding in findings]
