"""Records: numbers of the rows of a result, each described once for the terminal, the report and the files."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import jax
import numpy as np

from ..numerics import UnitKey
from .page import Table

Row = TypeVar("Row", contravariant=True)


@dataclass(frozen=True)
class Record(Generic[Row]):
    """Number of every row of a result, such as a design, a run or a gear.

    Attributes:
        name: name without the unit, as files carry it.
        unit: "" for a pure number or a text.
        of: computes it from a row; None where the row has no such number.
        heading: heading in tables; "" for the heading of the key, None for a number that tables do not show.
        form: format of a table as in `format`, or a function that gives the text.
    """

    name: str
    unit: str
    of: Callable[[Row], Any]
    heading: str | None = None
    form: str | Callable[[Any], str] = ".3f"

    @property
    def key(self) -> UnitKey:
        """Name with the unit."""
        return UnitKey(self.name, self.unit)

    def text(self, value: object) -> str:
        """Text of the number in tables."""
        return self.form(value) if callable(self.form) else format(value, self.form)


def numbers_of(records: Sequence[Record[Row]], row: Row) -> dict[str, Any]:
    """Numbers of a row by key; records that are None for the row are left out."""
    found = {record.key: _plain(record.of(row)) for record in records}
    return {key: value for key, value in found.items() if value is not None}


def _plain(value: Any) -> Any:
    """A single number as one of Python."""
    return value.item() if isinstance(value, np.ndarray | np.generic | jax.Array) and not np.ndim(value) else value


def table_of(
    records: Sequence[Record[Row]],
    rows: Mapping[str, Row] | Sequence[tuple[str, Row]],
    title: str,
    corner: str = "",
    *,
    across: bool = False,
    note: str = "",
) -> Table:
    """Table of the records that have a heading and a value in every row.

    Args:
        records: numbers of a row.
        rows: rows with their names, of which several may be the same.
        title: over the table.
        corner: heading of the names.
        across: True for rows side by side, a number per line.
        note: under the table.
    """
    named = list(rows.items() if isinstance(rows, Mapping) else rows)
    names = [name for name, _ in named]
    columns = [
        (record, [_plain(record.of(row)) for _, row in named]) for record in records if record.heading is not None
    ]
    columns = [(record, values) for record, values in columns if not any(value is None for value in values)]
    lines = [(record.heading or record.key.heading, *map(record.text, values)) for record, values in columns]
    if across:
        return Table((corner, *names), tuple(lines), title, note)
    header, *cells = zip((corner, *names), *lines)
    return Table(header, tuple(cells), title, note)
