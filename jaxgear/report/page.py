"""The report as an HTML page."""

from pathlib import Path
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
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template("report.html").render(report=report, upright=_UPRIGHT)
    # the name of a file may hold bytes that are no text; neither these nor controls can stand in a page
    allowed = "".join(
        sign if sign.isprintable() or sign in "\n\t\r" or category(sign) == "Zs" else "\ufffd" for sign in page
    )
    held = allowed.encode("utf-8", "replace")
    try:
        write_durably(path, lambda file: file.write(held))
    except OSError as error:
        raise ValueError(f"{path}: cannot be written: {error.strerror or error}") from None
