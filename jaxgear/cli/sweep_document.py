"""The report of a sweep: its best variants, a page for each of the first of them, and a workbook."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..contact import Resolution
from ..io import DesignFile
from ..metrics import Quantity
from ..report import Section, Table, figure, text, write_variants, write_workbook
from ..sweeps import SweepTable
from .document import Document, Found, project_facts
from .geometry import gears
from .sweep_chosen import CHOSEN, Chosen
from .sweep_figures import head_columns, labels_of
from .written import sizes, versions

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
    grid: str,
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
        f"with units and filters; {PAGE} is for looking around among them.",
        grid,
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
    found = Found(lines, warnings, chosen.findings, chosen.tables, pictures, shown, left_out=design.left_out)
    asked.write(folder, design, data, found)


def _with_unit(design: DesignFile, name: str) -> str:
    return f"{name} [{design.units[name]}]" if design.units[name] else name


def _side_by_side(best: SweepTable) -> Section:
    shown = best.take(range(min(_TABLE, len(best))))
    columns = [_values(shown, name) for name in shown.names if name != "variant"]
    names = (shown.headings[name] for name in shown.names if name != "variant")
    header = ("", *(f"variant {number}" for number in _values(shown, "variant")))
    rows = tuple((name, *column) for name, column in zip(names, columns))
    return Section("Best variants", tables=[Table(header, rows, "best first")], new_page=True)


def _page(table: SweepTable, best: SweepTable, place: int, chosen: Chosen) -> Section:
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
    return Section(f"Variant {number}", tables=[Table(header, tuple(rows))], figures=pictures, new_page=True)


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
