"""What a sweep shows of its table: its best variants, pictures and report."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax
import numpy as np
import rich.table

from ..contact import Mesh, Resolution
from ..io import DesignFile
from ..metrics import Quantity, findings_of, quantity_of
from ..microgeometry import NoModification
from ..report import Chapter, Table, figure, text, write_variants, write_workbook
from ..studies import side_by_side as report
from ..studies.comparison import Modifications
from ..studies.evaluation import evaluate, grid_change, grid_lines, torques_of
from ..studies.gear_data import gears
from ..studies.results import save_figures
from ..studies.summary_data import sizes, versions
from ..sweeps import SweepTable, over_torques
from .document import CommandResult, Document, project_facts
from .progress import Stages

_DRAWN = 200_000  # variants; of more, every so many-th is drawn, so that memory does not grow with the table
_CHARTS = 6  # radar charts


def write_figures(folder: Path, table: SweepTable, results: Sequence[str | Quantity]) -> list[Path]:
    """Writes all figures that the results allow, of a table with a variant that did not fail; gives the files."""
    import matplotlib

    matplotlib.use("Agg")  # the command line never shows a window
    from .. import plot

    heads = head_columns(table, results)
    maximize = [column.name for column in table.columns if column.better == "larger"]
    labels = parameter_labels(table)
    options: dict[str, Any] = {"labels": labels, "maximize": maximize}
    size = len(table)
    step = -(-size // _DRAWN)
    axes: dict[str, Any] = {}
    if len(heads) > 1:
        rows = np.arange(0, size, step)
        if step > 1:  # the front is that of all variants, whichever of the others are drawn
            rows = np.union1d(rows, table.pareto(heads[:3]).column("variant"))
        axes["pareto"] = plot.pareto(_columns(table.take(rows), heads[:3]), *heads[:3], **options)
    best = table.best(_CHARTS)
    numbers = np.union1d(np.arange(0, size, step), best.column("variant"))  # the best of all, too
    lines = _columns(table.take(numbers), [*table.parameters, *heads])
    axes["parallel_coordinates"] = plot.parallel_coordinates(lines, list(lines), heads[0], numbers=numbers, **options)
    if len(heads) > 2:
        names = [f"variant {number}" for number in best.column("variant")]
        # what is said of all results alike stands once, under the charts
        short = {head: plot.label(name) for head, name in zip(heads, (quantity_of(result).key for result in results))}
        common = plot.label(heads[0]).rpartition(" [")[0].removeprefix(short[heads[0]].rpartition(" [")[0]).strip()
        axes["radar"] = plot.radar(
            _columns(best, heads), heads, names=names, note=common, labels=short, maximize=maximize
        )
    if step > 1:
        note = f"1 in {step} of {size:,} variants".replace(",", "\u2009")
        for name in axes.keys() - {"radar"}:
            axis = np.ravel(axes[name])[0]
            axis.set_title(note, loc="left", pad=32, fontsize=axis.xaxis.label.get_fontsize())
    return save_figures(folder, axes)


def head_columns(table: SweepTable, results: Sequence[str | Quantity]) -> list[str]:
    """One column of every result: the first, which of a load spectrum or a tolerance is its mean."""
    return [next(name for name in table.results if name.startswith(quantity_of(result).key)) for result in results]


def parameter_labels(table: SweepTable) -> dict[str, str]:
    """Labels of the parameters with their units."""
    units = {**table.units, **{name: "µm" for name, unit in table.units.items() if unit == "um"}}
    return {name: f"{name.replace('_', ' ')} [{units[name] or '-'}]" for name in table.parameters}


def labels_of(table: SweepTable) -> dict[str, str]:
    """Labels of parameters and results with their units."""
    from .. import plot

    return {**{name: plot.label(name) for name in table.results}, **parameter_labels(table)}


def _columns(table: SweepTable, names: Sequence[str]) -> dict[str, np.ndarray]:
    return {name: table.column(name) for name in names}


CHOSEN = 3  # variants


@dataclass(frozen=True)
class Chosen:
    """What was found of the best variants.

    Attributes:
        tables: side by side with the unmodified pair, best first.
        figures: files of their pictures.
        pages: those of each variant alone, by its name.
        findings: what is not usual of them; None where they are not evaluated.
        failures: what is not to be trusted.
        lines: why they are not evaluated.
    """

    tables: Sequence[rich.table.Table] = ()
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
        modifications: dict[str, Modifications] = {"unmodified": (involute, involute)}
        first = best.take(range(min(CHOSEN, len(best))))
        for number, parameters in reversed([*zip(first.column("variant"), first.designs())]):
            modifications[f"variant {number}"] = design.design(parameters)
        found = {name: evaluate(design, mesh, torques, *flanks) for name, flanks in modifications.items()}
        drawn = save_figures(folder, report.figures(design, mesh, found, torques)) if figures else []
        pages = _alone(folder, mesh, found) if figures else {}
    findings = report.finding_lines(report.findings(design, mesh, found))
    best_first = {name: found[name] for name in ("unmodified", *reversed(list(found)))}
    return Chosen([report.table(design, best_first)], drawn, pages, list(findings), list(report.failures(found)))


def said_of_best(design: DesignFile, best: SweepTable, size: Resolution) -> tuple[list[str], list[str]]:
    """By how much the numbers of the best variant change on a finer mesh, and what is not usual of it."""
    parameters = best.take([0]).designs()[0]
    made = design.sweep_mesh(size)
    mesh = made if isinstance(made, Mesh) else made(parameters)
    torque = float(design.operating_point(parameters).torque)
    pinion, wheel = design.design(parameters)
    (cycle,) = over_torques(mesh, np.asarray([torque]), pinion=pinion, wheel=wheel)
    name = f"variant {best.column('variant')[0]} at {torque:g} N m"
    findings = findings_of(cycle, pinion=pinion, wheel=wheel, compliance=mesh.compliance)
    grid = grid_lines(f"{size.positions} positions", {name: grid_change(mesh, cycle, pinion, wheel)})
    return [*grid], [f"{report.WARNING}{name}: {finding}" for finding in findings]


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
    results: Sequence[str | Quantity],
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
        results: that the sweep was asked for.
        size: array sizes of a mesh.
        quick: whether the run was a quick one.
        grid: what a finer mesh would change.
    """
    release = versions()
    facts = [*project_facts(design), *asked.facts, *release.items()]
    write_workbook(folder / WORKBOOK, facts, best, table)
    failed = table.failures()
    if failed < len(table):
        main = head_columns(table, results)
        write_variants(folder / PAGE, design.title, facts, table, labels=labels_of(table), main=main)
    lines = [
        f"{len(table)} variants, ranked by {table.results[0]}; the best {len(best)} and the table are in {WORKBOOK}, "
        f"with units and filters; {PAGE} is an interactive page of them.",
        *grid,
        *chosen.lines,
    ]
    warnings = [*chosen.failures, *([f"{failed} variants failed and have no results"] if failed else [])]
    pages = [_side_by_side(best), *(_page(table, best, place, chosen) for place in range(min(CHOSEN, len(best))))]
    data: dict[str, Any] = {
        "torque_Nm": design.torque,
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
    columns = [_values(shown, name) for name in shown.names if name != "variant"]
    names = (shown.headings[name] for name in shown.names if name != "variant")
    header = ("", *(f"variant {number}" for number in _values(shown, "variant")))
    rows = tuple((name, *column) for name, column in zip(names, columns))
    return Chapter("Best variants", tables=[Table(header, rows, "best first")], new_page=True)


def _page(table: SweepTable, best: SweepTable, place: int, chosen: Chosen) -> Chapter:
    """One variant, and what it is among the others."""
    number = _values(best, "variant")[place]
    rows = []
    for name in (*best.parameters, *best.results):
        ranked = table.find(name)
        low, high = (text(one) for one in _range(table, name))
        better = {"larger": "larger", "smaller": "smaller"}.get(str(ranked.better), "") if name in best.results else ""
        rows.append((best.headings[name], text(best.column(name)[place]), low, high, better))
    header = ("", f"variant {number}", "least of all", "largest of all", "better is")
    pictures = [figure(path) for path in chosen.pages.get(f"variant {number}", ())]
    return Chapter(f"Variant {number}", tables=[Table(header, tuple(rows))], figures=pictures, new_page=True)


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
