"""What every report must be, whichever command wrote it."""

import base64
import hashlib
import json
import math
import re
import shlex
import warnings
from html.parser import HTMLParser
from pathlib import Path

import pytest

import jaxgear as jg

VOID = {"meta", "img", "br", "hr"}
FORBIDDEN = {"script", "link", "iframe", "object", "embed", "base", "form"}
REFERENCES = {"src", "href", "srcset", "data", "action", "poster", "xlink:href"}


class Page(HTMLParser):
    """Reads a page and refuses tags that do not match.

    Attributes:
        tags: all that were opened.
        references: all values of attributes that name something else.
        rows: texts of the cells of every table row.
        literal: text of the last `pre`.
    """

    def __init__(self, text: str):
        super().__init__(convert_charrefs=True)
        self.tags, self.references, self.rows, self.literal, self.styles = [], [], [], "", ""
        self._open, self._cell = [], ""
        self.feed(text)
        self.close()
        assert self._open == [], "tags are left open"

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.references += [value for name, value in attributes if name in REFERENCES]
        assert not [name for name, _ in attributes if name.startswith("on")]
        if tag not in VOID:
            self._open.append(tag)
        if tag == "tr":
            self.rows.append([])
        self._cell = ""

    def handle_endtag(self, tag):
        assert self._open.pop() == tag
        if tag in ("td", "th"):
            self.rows[-1].append(self._cell)

    def handle_data(self, data):
        self._cell += data
        if "pre" in self._open:
            self.literal += data
        if "style" in self._open:
            self.styles += data


def check_report(folder: Path, file: Path, *arguments) -> Page:
    """The report of a result folder refers to nothing, is well-formed, and shows what the folder holds."""
    held = (folder / "report.html").read_bytes()
    assert_well_formed(held)
    page = Page(held.decode("utf-8"))
    assert not FORBIDDEN & set(page.tags)
    assert all(value.startswith(("data:image/png;base64,", "#section-")) for value in page.references)
    assert "url(" not in page.styles and "@import" not in page.styles and "@page" in page.styles
    pictures = [value.partition(",")[2] for value in page.references if value.startswith("data:")]
    files = {path.read_bytes() for path in folder.glob("*.png")}
    assert len(pictures) == len(files) and {base64.b64decode(one, validate=True) for one in pictures} == files
    facts = dict(row for row in page.rows if len(row) == 2)
    assert facts["SHA-256"] == hashlib.sha256(file.read_bytes()).hexdigest()
    assert facts["design file"] == file.name and page.literal.strip() == file.read_text("utf-8").strip()
    assert shlex.split(facts["command"]) == ["jaxgear", *(str(argument) for argument in arguments)]
    assert f"python {__import__('platform').python_version()}" in facts["made by"]
    if (folder / "summary.json").exists():
        check_numbers(page, json.loads((folder / "summary.json").read_text("utf-8")))
    return page


def assert_well_formed(held: bytes) -> None:
    """By the rules of HTML 5."""
    html5lib = pytest.importorskip("html5lib")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        html5lib.HTMLParser(strict=True).parse(held.decode("utf-8"))


def check_numbers(page: Page, summary: dict) -> None:
    """Geometry and results are those of `summary.json`, each in its row and its column, to six digits."""
    geometry = summary["geometry"]
    for name, value in geometry["pinion"].items():
        assert_row(page, in_words(name), [value, geometry["wheel"][name]])
    for name, value in geometry["pair"].items():
        assert_row(page, in_words(name), [value])
    if "designs" not in summary:  # of a study without any
        return
    designs = list(summary["designs"].values())
    told = 0
    for name, value in designs[0].items():
        if isinstance(value, float):
            assert_row(page, in_words(name), [math.nan if design[name] is None else design[name] for design in designs])
            told += 1
    assert told or "runs" in designs[0] or "layouts" in summary


def in_words(name: str) -> str:
    """A name of `summary.json` as the report has it."""
    if name in jg.quantities:
        return jg.quantities[name].heading
    found = re.fullmatch(r"(.+?)_(mm3|mm|um|deg|MPa|K|s|N|Nm|N_per_mm)", name)
    if found is None:
        return name.replace("_", " ")
    unit = {"Nm": "N m", "N_per_mm": "N/mm"}.get(found[2], found[2])
    return f"{found[1].replace('_', ' ')} [{unit}]"


def assert_row(page: Page, name: str, values: list[float]) -> None:
    """One of the rows of this name holds the numbers."""
    rows = [row[1:] for row in page.rows if row and row[0] == name and len(row) == len(values) + 1]
    assert rows, f"no row {name} of {len(values)} numbers"
    assert any(
        [float(cell) for cell in row] == pytest.approx(values, rel=1e-5, abs=1e-12, nan_ok=True)
        for row in map(_known, rows)
    )


def _known(row: list[str]) -> list[str]:
    return [cell if re.fullmatch(r"-?[\d.]+(e[+-]?\d+)?", cell) else "nan" for cell in row]
