"""Variants of a sweep as an Excel workbook."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ..numerics.durable import write_durably
from ..sweeps import SweepTable
from .needed import needed

# a sheet of this many rows and some tens of columns opens in seconds; Excel itself ends at 1 048 576
MOST_ROWS = 20_000
_WIDEST, _MARGIN = 30, 4  # of a column [characters]


def write_workbook(path: Path, facts: Sequence[tuple[str, str]], best: SweepTable, table: SweepTable) -> None:
    """Writes three sheets: what the workbook is about, the best variants, and the table.

    Units stand in the header, which is frozen and filters the columns. Of more than `MOST_ROWS` variants the best by
    the first result are written. Results of failed variants are empty cells.

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
    try:
        write_durably(path, lambda file: file.write(held.getvalue()))
    except OSError as error:
        raise ValueError(f"{path}: cannot be written: {error.strerror or error}") from None


def _sheet(sheet, table: SweepTable, bold) -> None:
    headings = table.headings
    for place, name in enumerate(table.names):
        sheet.write_string(0, place, headings[name], bold)
        sheet.set_column(place, place, min(_WIDEST, len(headings[name]) + _MARGIN))
        for row, value in enumerate(table.column(name).tolist(), 1):
            _cell(sheet, row, place, value)
    sheet.freeze_panes(1, 1)
    sheet.autofilter(0, 0, max(len(table), 1), len(table.names) - 1)


def _cell(sheet, row: int, place: int, value: Any) -> None:
    if isinstance(value, bool):
        sheet.write_boolean(row, place, value)
    elif value is not None and np.isfinite(value):
        sheet.write_number(row, place, value)
