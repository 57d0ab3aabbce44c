"""What a report consists of, as plain text: nothing here knows of HTML or of a workbook."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import rich.table


@dataclass(frozen=True)
class Source:
    """A design file as it was read.

    Attributes:
        name: of the file, without its folders.
        text: what it holds.
        sha256: hash of its bytes, in hexadecimal digits.
    """

    name: str
    text: str
    sha256: str

    @classmethod
    def of(cls, path: Path, content: bytes) -> "Source":
        """The file of a path, from its bytes."""
        return cls(path.name, content.decode("utf-8-sig", "replace"), hashlib.sha256(content).hexdigest())


@dataclass(frozen=True)
class Table:
    """A table of texts.

    Attributes:
        header: one text per column.
        rows: likewise, the first of a row names it.
        title: over the table.
        note: under the table.
        ends: numbers of the rows that end a group.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str = ""
    note: str = ""
    ends: tuple[int, ...] = ()


@dataclass(frozen=True)
class Figure:
    """A picture.

    Attributes:
        name: of its file without the ending.
        caption: what it shows.
        data: the PNG file as a data URI.
        width: on paper at its own size [mm].
    """

    name: str
    caption: str
    data: str
    width: float


@dataclass(frozen=True)
class Section:
    """A part of the report under its own title.

    Attributes:
        title: of the part.
        lines: paragraphs.
        warnings: paragraphs that must not be missed.
        points: of a list.
        tables, figures: in this order after the text.
        literal: a text in which every blank counts.
        new_page: whether it starts on a new page when printed.
    """

    title: str
    lines: Sequence[str] = ()
    warnings: Sequence[str] = ()
    points: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Figure] = ()
    literal: str = ""
    new_page: bool = False


@dataclass(frozen=True)
class Report:
    """All of it.

    Attributes:
        title: of the design.
        subtitle: what was done.
        facts: name and text of what identifies the report, above its first section.
        sections: the parts.
    """

    title: str
    subtitle: str
    facts: Sequence[tuple[str, str]]
    sections: Sequence[Section]


def read_table(printed: rich.table.Table) -> Table:
    """The table that a command prints."""
    columns = [[str(cell) for cell in column.cells] for column in printed.columns]
    ends = tuple(number for number, row in enumerate(printed.rows) if row.end_section)
    return Table(
        header=tuple(str(column.header) for column in printed.columns),
        rows=tuple(zip(*columns)),
        title=str(printed.title or ""),
        note=str(printed.caption or ""),
        ends=ends,
    )
