"""Variants of a sweep as an interactive page and as an Excel workbook."""

import json
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ..io import writing
from ..numerics.durable import write_durably
from ..sweeps import SweepTable
from ..sweeps.columns import axis_label
from .page import Table, needed, printable, rendered, write_text

# a sheet of this many rows and some tens of columns opens in seconds; Excel itself ends at 1 048 576
MOST_ROWS = 20_000
_WIDEST, _MARGIN = 30, 4  # of a column [characters]


def write_workbook(path: Path, facts: Sequence[tuple[str, str]], best: SweepTable, table: SweepTable) -> None:
    """Write a workbook of three sheets: description, best variants, whole table.

    Units are in the header, which is frozen and filters the columns. Of more than `MOST_ROWS` variants the best by the
    first result are written. Results of failed variants are empty cells.

    Args:
        path: file to write.
        facts: name and text of what identifies the sweep.
        best: the best variants.
        table: all variants.

    Raises:
        ValueError: without the library xlsxwriter, or when the file cannot be written.
    """
    needed("xlsxwriter")
    import xlsxwriter

    every = len(table) <= MOST_ROWS
    shown = table if every else table.best(MOST_ROWS)
    held = BytesIO()
    with xlsxwriter.Workbook(held, {"in_memory": True}) as book:
        bold = book.add_format({"bold": True, "text_wrap": True, "valign": "top"})
        about = book.add_worksheet("about")
        rows = f"{len(table)}" if every else f"the best {len(shown)} of {len(table)} by {table.results[0]}"
        for row, (name, text) in enumerate([*facts, ("variants in the sheet", rows)]):
            about.write_string(row, 0, name, bold)
            about.write_string(row, 1, text)
        about.set_column(0, 0, _WIDEST)
        about.set_column(1, 1, 3 * _WIDEST)
        _sheet(book.add_worksheet("best"), best, bold)
        _sheet(book.add_worksheet("variants" if every else "best variants"), shown, bold)
    with writing(path):
        write_durably(path, lambda file: file.write(held.getvalue()))


def write_tables(path: Path, facts: Sequence[tuple[str, str]], tables: Sequence[Table]) -> None:
    """Writes tables as a workbook, each under its title in a sheet of its own, numbers as numbers.

    Args:
        path: file to write.
        facts: names and texts of the first sheet.
        tables: the tables.

    Raises:
        ValueError: without the library xlsxwriter, or when the file cannot be written.
    """
    needed("xlsxwriter")
    import xlsxwriter

    held = BytesIO()
    with xlsxwriter.Workbook(held, {"in_memory": True, "strings_to_numbers": True}) as book:
        bold = book.add_format({"bold": True, "text_wrap": True, "valign": "top"})
        about = Table(("", ""), tuple(facts), "about")
        for number, table in enumerate([about, *tables]):
            # a sheet has a name of its own, of at most 31 letters
            sheet = book.add_worksheet(f"{number} {table.title.partition(',')[0]}"[:31] if number else "about")
            sheet.write_row(0, 0, table.header, bold)
            for row, cells in enumerate(table.rows, 1):
                sheet.write_row(row, 0, cells)
            sheet.set_column(0, len(table.header) - 1, _WIDEST // 2)
            sheet.freeze_panes(1, 1)
    with writing(path):
        write_durably(path, lambda file: file.write(held.getvalue()))


def _sheet(sheet, table: SweepTable, bold) -> None:
    for place, column in enumerate(table.columns):
        sheet.write_string(0, place, column.named, bold)
        sheet.set_column(place, place, min(_WIDEST, len(column.named) + _MARGIN))
        for row, value in enumerate(table.column(column.name).tolist(), 1):
            _cell(sheet, row, place, value)
    sheet.freeze_panes(1, 1)
    sheet.autofilter(0, 0, max(len(table), 1), len(table.columns) - 1)


def _cell(sheet, row: int, place: int, value: Any) -> None:
    if isinstance(value, bool):
        sheet.write_boolean(row, place, value)
    elif isinstance(value, str):
        sheet.write_string(row, place, value)
    elif value is not None and np.isfinite(value):
        sheet.write_number(row, place, value)


_DIGITS = 6  # of a number: the axes resolve four
_CHOSEN = 3  # variants, to begin with


def write_variants(
    path: Path,
    title: str,
    facts: Sequence[tuple[str, str]],
    table: SweepTable,
) -> None:
    """Write a self-contained interactive page, including its drawing library.

    The first column of every result has an axis of its own, the others can be chosen for the Pareto front. Of more than
    `MOST_ROWS` variants the best by the first result, the Pareto front of the first two and an even share of the others
    are in it. Failed variants are not.

    Args:
        path: file to write.
        title: title of the sweep.
        facts: name and text of what identifies it.
        table: all variants.

    Raises:
        ValueError: without the libraries jinja2 and plotly, or when the file cannot be written.
    """
    needed("jinja2", "plotly")
    from plotly.offline import get_plotlyjs

    data, count = _data(_shown(table))
    failed = table.failures()
    words = (
        f"{count} of {len(table)} variants, {failed} failed" if failed or count < len(table) else f"{count} variants"
    )
    page = rendered(
        "variants.html",
        title=printable(title),
        facts=[(name, printable(text)) for name, text in facts],
        shown=f"{words}. ",
        # no text of a table can end the element that holds it
        data=json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
        library=get_plotlyjs(),
    )
    write_text(path, page)


def _shown(table: SweepTable) -> SweepTable:
    size = len(table)
    if size <= MOST_ROWS:
        return table
    # every so many-th, with the best of all for a third of the rows, and the front, whatever it takes
    share = np.arange(0, size, -(-3 * size // (2 * MOST_ROWS)))
    kept = [share, table.best(MOST_ROWS // 3).column("variant")]
    if len(table.heads) > 1:
        kept.append(table.pareto([head.name for head in table.heads[:2]]).column("variant"))
    return table.take(np.unique(np.concatenate(kept)))


def _data(table: SweepTable) -> tuple[dict[str, Any], int]:
    """Data of the page, of the variants whose numbers are all finite, and the count of these variants."""
    parameters, heads = [column for column in table.columns if column.kind == "parameter"], table.heads
    others = [column for column in table.columns if column.kind == "result" and column not in heads]
    found = table.values(*parameters, *heads, *others)
    fine = np.isfinite([*found.values()]).all(axis=0)
    numbers = table.column("variant")[fine]
    columns = [
        {
            "label": printable(axis_label(column)),
            "kind": column.kind,
            "main": column not in others,
            "better": column.better,
            "values": [float(f"{value:.{_DIGITS}g}") for value in values[fine].tolist()],
        }
        for column, values in found.items()
    ]
    chosen = np.argsort(heads[0].sign * found[heads[0]][fine], kind="stable")[:_CHOSEN].tolist()
    return {"columns": columns, "variants": numbers.tolist(), "chosen": chosen}, len(numbers)
