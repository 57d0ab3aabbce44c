"""Report of a sweep: best variants, figures, workbook and pages."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ..contact import Mesh, Resolution
from ..io import DesignFile
from ..metrics import findings_of
from ..microgeometry import NoModification
from ..report import Chapter, Table, figure, text, write_variants, write_workbook
from ..studies import side_by_side as report
from ..studies.comparison import Modifications
from ..studies.evaluation import evaluation_of, grid_change, grid_lines, grid_of, torques_of
from ..studies.gear_data import gears
from ..studies.results import save_figures
from ..studies.summary_data import sizes, versions
from ..sweeps import SweepTable, over_torques
from .document import CommandResult, Document, project_facts
from .progress import Stages

_DRAWN = 200_000  # variants; of more, every so many-th is drawn, so that memory does not grow with the table
_CHARTS = 6  # radar charts
_UNMODIFIED = "unmodified"


def write_figures(folder: Path, table: SweepTable) -> list[Path]:
    """Writes all figures that the results allow, of a table with a variant that did not fail; gives the files."""
    import matplotlib

    matplotlib.use("Agg")  # the command line never shows a window
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
    return save_figures(folder, axes)


def _names(best: SweepTable) -> list[str]:
    return [f"variant {number}" for number in best.column("variant")]


def _styles(best: SweepTable) -> dict[str, int]:
    """Numbers of the styles of the best variants, best first, in all figures."""
    from .. import plot

    return {_UNMODIFIED: 0, **dict(zip(_names(best), plot.figure.APART))}


CHOSEN = 3  # variants


@dataclass(frozen=True)
class Chosen:
    """Evaluation of the best variants of a sweep.

    Attributes:
        tables: unmodified pair and variants side by side, best variant first.
        figures: files of the pictures of all variants together.
        pages: files of the pictures of each variant beside the unmodified pair, by the name of the variant.
        findings: values out of the usual range; None if the variants are not evaluated.
        failures: results that did not converge.
        lines: reason why the variants are not evaluated.
    """

    tables: Sequence[Table] = ()
    figures: Sequence[Path] = ()
    pages: Mapping[str, Sequence[Path]] = field(default_factory=dict)
    findings: Sequence[str] | None = None
    failures: Sequence[str] = ()
    lines: Sequence[str] = ()


def evaluate_best(
    folder: Path, design: DesignFile, best: SweepTable, size: Resolution, *, quick: bool, figures: bool
) -> Chosen:
    """Evaluates the best variants at the torques of the design file.

    Variants of more than the flanks, of other gears or loads, have no common mesh and stay as the table has them.

    Args:
        folder: for the pictures.
        design: the design file.
        best: the best variants, best first.
        size: array sizes of the mesh.
        quick: few torques.
        figures: whether pictures are drawn.
    """
    if design.open_case or not len(best):
        why = ["The variants differ in more than their flanks: their numbers are those of the table."]
        return Chosen(lines=why if len(best) else ())
    with Stages() as stages:
        stages.begin("evaluating the best variants")
        mesh, torques = jax.block_until_ready(design.mesh(size)), torques_of(design, quick=quick)
        involute = NoModification()
        modifications: dict[str, Modifications] = {_UNMODIFIED: (involute, involute)}
        first = best.take(range(min(CHOSEN, len(best))))
        for number, parameters in reversed([*zip(first.column("variant"), first.designs())]):
            modifications[f"variant {number}"] = design.design(parameters)
        found = {name: evaluation_of(design, mesh, torques, *flanks) for name, flanks in modifications.items()}
        drawn, pages = _draw(folder, design, mesh, found, torques, best) if figures else ([], {})
    findings = report.finding_lines(report.findings(design, mesh, found))
    best_first = {name: found[name] for name in (_UNMODIFIED, *reversed(list(found)))}
    return Chosen([report.table(design, best_first)], drawn, pages, list(findings), list(report.failures(found)))


def said_of_best(design: DesignFile, best: SweepTable, size: Resolution) -> tuple[list[str], list[str]]:
    """Lines on the change of the numbers of the best variant on a finer grid, and lines of its findings."""
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
    return [*lines], [f"{report.WARNING}{name}: {finding}" for finding in findings]


def _draw(
    folder: Path, design: DesignFile, mesh: Mesh, found: report.Evaluations, torques: np.ndarray, best: SweepTable
) -> tuple[list[Path], dict[str, list[Path]]]:
    """Pictures of all variants together, and those of each alone by its name; a variant has one style in all."""
    from .. import plot

    with plot.same_styles(_styles(best)):
        return save_figures(folder, report.figures(design, mesh, found, torques)), _alone(folder, mesh, found)


def _alone(folder: Path, mesh: Mesh, found: report.Evaluations) -> dict[str, list[Path]]:
    """Pictures of each variant beside the unmodified pair alone."""
    from .. import plot

    first, *others = found
    pages = {}
    for name in others:
        both = {first: found[first], name: found[name]}
        axes = {
            "transmission_error": plot.transmission_error({one: of.cycle for one, of in both.items()}),
            "k_chart": plot.k_chart(mesh, report.flanks(both)),
        }
        named = {f"{kind}_{name.replace(' ', '_')}": ax for kind, ax in axes.items()}
        pages[name] = save_figures(folder, named, bold=name)
    return pages


WORKBOOK, PAGE = "variants.xlsx", "variants.html"
_TABLE = 6  # side by side on one page


def write(
    folder: Path,
    asked: Document,
    design: DesignFile,
    table: SweepTable,
    best: SweepTable,
    chosen: Chosen,
    figures: Sequence[Path],
    *,
    size: Resolution,
    quick: bool,
    grid: list[str],
) -> None:
    """Writes the workbook, the page of variants and the report.

    Args:
        folder: of the results.
        asked: what the report is of.
        design: the design file.
        table: all variants.
        best: the best of them, best first.
        chosen: what was found of the first of them.
        figures: files of the pictures of the sweep.
        size: array sizes of a mesh.
        quick: whether the run was a quick one.
        grid: what a finer mesh would change.
    """
    release = versions()
    facts = [*project_facts(design), *asked.facts, *release.items()]
    write_workbook(folder / WORKBOOK, facts, best, table)
    failed = table.failures()
    if failed < len(table):
        write_variants(folder / PAGE, design.title, facts, table)
    lines = [
        f"{len(table)} variants, ranked by {table.results[0]}; the best {len(best)} and the table are in {WORKBOOK}, "
        f"with units and filters; {PAGE} is an interactive page of them.",
        *grid,
        *chosen.lines,
    ]
    warnings = [
        *chosen.failures,
        *([f"{failed} variants failed and have no results; {table.why(size.chosen_pairs)}"] if failed else []),
    ]
    pages = [_side_by_side(best), *(_page(table, best, place, chosen) for place in range(min(CHOSEN, len(best))))]
    data: dict[str, Any] = {
        "torque_Nm": design.signed_torque,
        "torque_range_Nm": design.torque_range,
        "speed_rpm": design.speed,
        "friction": design.friction,
        "resolution": sizes(size),
        "quick": quick,
        "variables": {_with_unit(design, name): limits for name, limits in design.bounds.items()},
        **gears(design),
        "versions": release,
        **({"left_out": design.left_out} if design.left_out else {}),
    }
    pictures = [*chosen.figures, *figures]
    shown = pages if len(best) else ()
    found = CommandResult(lines, warnings, chosen.findings, chosen.tables, pictures, shown, left_out=design.left_out)
    asked.write(folder, design, data, found)


def _with_unit(design: DesignFile, name: str) -> str:
    return f"{name} [{design.units[name]}]" if design.units[name] else name


def _side_by_side(best: SweepTable) -> Chapter:
    shown = best.take(range(min(_TABLE, len(best))))
    _, *columns = shown.columns
    rows = tuple((column.heading, *_values(shown, column.name)) for column in columns)
    return Chapter("Best variants", tables=[Table(("", *_names(shown)), rows, "best first")], new_page=True)


def _page(table: SweepTable, best: SweepTable, place: int, chosen: Chosen) -> Chapter:
    """One variant, and what it is among the others."""
    name = _names(best)[place]
    rows = []
    for column in map(best.find, (*best.parameters, *best.results)):
        low, high = map(text, _range(table, column.name))
        rows.append((column.heading, text(best.column(column.name)[place]), low, high, column.better))
    header = ("", name, "least of all", "largest of all", "better is")
    pictures = [figure(path) for path in chosen.pages.get(name, ())]
    return Chapter(name.capitalize(), tables=[Table(header, tuple(rows))], figures=pictures, new_page=True)


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
