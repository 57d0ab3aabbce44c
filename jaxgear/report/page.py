"""The report: what it consists of, as plain text, and as an HTML page."""

import base64
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self
from unicodedata import category

import numpy as np
import rich.table
from rich.box import SIMPLE_HEAD
from rich.console import Console, ConsoleOptions

from ..io import writing
from ..numerics import UnitKey
from ..numerics.durable import write_durably
from ..vocabulary import quantities

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing


def needed(*modules: str) -> None:
    """Asks for libraries before long work begins.

    Args:
        modules: "jinja2" for a report, "xlsxwriter" for a workbook, "plotly" for a page of variants.

    Raises:
        ValueError: for the first that is not installed.
    """
    for module in modules:
        if find_spec(module) is None:
            raise ValueError(f"--report needs the library {module}: pip install 'jaxgear[report]'")


_LABEL_WIDTH, _CELL_WIDTH = 32, 10  # of a table whose columns must fit [characters]


@dataclass
class Table:
    """Table of texts for terminal and report.

    Attributes:
        header: one text per column.
        rows: likewise, the first of a row names it.
        title: over the table.
        note: under the table.
        ends: numbers of the rows that end a group.
        narrow: True if a terminal shows as many columns as fit.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...] = ()
    title: str = ""
    note: str = ""
    ends: tuple[int, ...] = ()
    narrow: bool = False

    def add_row(self, *cells: str) -> None:
        """Add a row at the end."""
        self.rows += (cells,)

    def add_section(self) -> None:
        """End a group of rows."""
        self.ends += (len(self.rows) - 1,)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[rich.table.Table]:
        count = max((options.max_width - _LABEL_WIDTH) // _CELL_WIDTH, 1) if self.narrow else len(self.header)
        shown = rich.table.Table(box=SIMPLE_HEAD, title_justify="left", caption_justify="left")
        shown.title, shown.caption = self.title or None, self.note or None
        for place, heading in enumerate(self.header[: 1 + count]):
            shown.add_column(heading, justify="right" if place else "left", no_wrap=place > 0)
        for number, row in enumerate(self.rows):
            shown.add_row(*row[: 1 + count], end_section=number in self.ends)
        yield shown


@dataclass(frozen=True)
class Figure:
    """A figure of a result, drawn and not yet written.

    Attributes:
        name: name of its file without the ending.
        caption: caption in the report.
        axes: Axes that it consists of, one or an array.
    """

    name: str
    caption: str
    axes: Any

    @classmethod
    def of(cls, draw: Callable[..., Any], *args: object, **options: object) -> Self:
        """The figure that a plot function with a caption draws, named after the function."""
        return cls(draw.__name__, draw.caption, draw(*args, **options))  # type: ignore[attr-defined]

    @property
    def figure(self) -> "Drawing":
        """The figure of matplotlib."""
        drawn: Drawing = np.ravel(self.axes)[0].figure
        return drawn


@dataclass(frozen=True)
class Picture:
    """The file of a figure.

    Attributes:
        name: name of the file without the ending.
        caption: caption.
        data: the PNG file as a data URI.
        width: width on paper at its own size [mm].
    """

    name: str
    caption: str
    data: str
    width: float


@dataclass(frozen=True)
class Chapter:
    """A part of the report under its own title.

    Attributes:
        title: title of the part.
        lines: paragraphs.
        warnings: paragraphs that must not be missed.
        points: points of a list.
        tables, figures: in this order after the text.
        literal: a text in which every blank counts.
        new_page: True if the chapter starts on a new page when printed.
    """

    title: str
    lines: Sequence[str] = ()
    warnings: Sequence[str] = ()
    points: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Picture] = ()
    literal: str = ""
    new_page: bool = False


@dataclass(frozen=True)
class Part:
    """Tables, chapters and data that a table of a design file adds to the result of an analysis.

    Attributes:
        tables: to be read first, after those of the designs.
        chapters: chapters of the report.
        data: data for `summary.json`, under the name of the table.
        lines: rows of a CSV file of that name, the first its header; none without any.
        figures: functions that draw one each.
    """

    tables: tuple[Table, ...] = ()
    chapters: tuple[Chapter, ...] = ()
    data: Mapping[str, Any] = field(default_factory=dict)
    lines: tuple[tuple[str, ...], ...] = ()
    figures: tuple[Callable[[], Figure], ...] = ()


_TEMPLATES = Path(__file__).parent / "templates"
# Between the margins of A4 are 180 mm: letters of a picture of this width [mm] shrink from 9 to 7.7 points, and
# wider ones lie on their side.
_UPRIGHT = 210.0


def write_report(
    path: Path, title: str, subtitle: str, facts: Sequence[tuple[str, str]], sections: Sequence[Chapter]
) -> None:
    """Write a report as one HTML file without external references.

    All text is escaped: names and contents of files may hold anything.

    Args:
        path: file to write.
        title: title of the design.
        subtitle: name of the command.
        facts: names and texts above the first section.
        sections: chapters in their order.

    Raises:
        ValueError: without the library jinja2, or when the file cannot be written.
    """
    needed("jinja2")
    parts = {"title": title, "subtitle": subtitle, "facts": facts, "sections": sections}
    write_text(path, printable(rendered("report.html", **parts, upright=_UPRIGHT)))


def write_text(path: Path, text: str) -> None:
    """Writes a text whole or not at all.

    Raises:
        ValueError: when the file cannot be written.
    """
    with writing(path):
        write_durably(path, lambda file: file.write(text.encode("utf-8", "replace")))


def rendered(template: str, **parts: object) -> str:
    """Page rendered from a template and the parts that it uses."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page: str = environment.get_template(template).render(**parts)
    return page


def printable(text: str) -> str:
    """Text without characters that HTML does not allow, such as controls and undecodable bytes of file names."""
    return "".join(
        sign if sign.isprintable() or sign in "\n\t\r" or category(sign) == "Zs" else "\ufffd" for sign in text
    )


_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_SIZE_AT = 16  # bytes before width and height (PNG specification, chunk IHDR)
_DENSITY = b"pHYs"  # pixels per unit in both directions, and the unit
_PER_METRE = 1
_MM = 1000.0  # per m


def picture(path: Path, caption: str) -> Picture:
    """Content of a PNG file with its density added, for embedding.

    Raises:
        ValueError: when it is no such file.
    """
    held = path.read_bytes()
    place = held.find(_DENSITY)
    if not held.startswith(_SIGNATURE) or place < 0:
        raise ValueError(f"{path}: is not a PNG file that tells its density")
    (pixels,) = struct.unpack_from(">I", held, _SIZE_AT)
    density, _, unit = struct.unpack_from(">IIB", held, place + len(_DENSITY))
    if unit != _PER_METRE or density == 0:
        raise ValueError(f"{path}: does not tell its pixels per metre")
    data = f"data:image/png;base64,{base64.b64encode(held).decode()}"
    return Picture(path.stem, caption, data, pixels / density * _MM)


_DIGITS = 6  # of a number
_MOST = 12  # numbers of a list that are written out
_BETWEEN = " / "  # names of a number inside of another


def heading(name: str) -> str:
    """A key of `summary.json` in words, with the unit of a `UnitKey` or of a quantity of that name in brackets."""
    if isinstance(name, UnitKey):
        return name.heading
    return quantities[name].heading if name in quantities else name.replace("_", " ")


def text(value: object) -> str:
    """Value in six digits for reports; "-" for None."""
    if isinstance(value, Mapping):
        return ", ".join(f"{heading(key)} {text(item)}" for key, item in value.items()) or "-"
    items = value if isinstance(value, list | tuple) else np.asarray(value)
    if not isinstance(items, np.ndarray) or items.ndim:
        shown = ", ".join(map(text, items[:_MOST]))
        return f"{shown}, ... ({len(items)} values)" if len(items) > _MOST else shown or "-"
    if isinstance(value, str) or value is None:
        return value or "-"
    number = np.asarray(value)[()]
    if isinstance(number, bool | np.bool_):
        return "yes" if number else "no"
    if isinstance(number, float | np.floating) and not np.isfinite(number):
        return "-"
    return f"{number:.{_DIGITS}g}" if isinstance(number, float | np.floating) else str(number)


def numbers(data: Mapping[str, Any], within: Sequence[str] = ()) -> Iterator[tuple[str, str]]:
    """Name and text of all values of nested data, in order."""
    for name, value in data.items():
        names = (*within, heading(name))
        if isinstance(value, Mapping) and value:
            yield from numbers(value, names)
        elif isinstance(value, list | tuple) and value and all(isinstance(item, Mapping) for item in value):
            for place, item in enumerate(value, 1):
                yield from numbers(item, (*names, str(place)))
        else:
            yield _BETWEEN.join(names), text(value)
