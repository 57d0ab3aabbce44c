"""The report as an HTML page."""

from pathlib import Path
from typing import Any
from unicodedata import category

from ..numerics.durable import write_durably
from .contents import Report
from .needed import needed

_TEMPLATES = Path(__file__).parent / "templates"
# Between the margins of A4 are 180 mm: letters of a picture of this width [mm] shrink from 9 to 7.7 points, and
# wider ones lie on their side.
_UPRIGHT = 210.0


def write_report(path: Path, report: Report) -> None:
    """Writes a report as one HTML file that refers to nothing outside of it.

    All text is escaped: names and contents of files may hold anything.

    Raises:
        ValueError: without the library jinja2, or when the file cannot be written.
    """
    needed("jinja2")
    page = template("report.html").render(report=report, upright=_UPRIGHT)
    held = printable(page).encode("utf-8", "replace")
    try:
        write_durably(path, lambda file: file.write(held))
    except OSError as error:
        raise ValueError(f"{path}: cannot be written: {error.strerror or error}") from None


def template(name: str) -> Any:
    """A template of the pages."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


def printable(text: str) -> str:
    """A text without what cannot stand in a page: the name of a file may hold bytes that are no text, or controls."""
    return "".join(
        sign if sign.isprintable() or sign in "\n\t\r" or category(sign) == "Zs" else "\ufffd" for sign in text
    )
