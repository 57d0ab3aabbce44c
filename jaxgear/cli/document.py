"""The report of a command, put together from what it prints, writes and draws."""

import hashlib
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from ..io import DesignFile
from ..io.errors import naming
from ..io.toml import content
from ..report import Chapter, Table, heading, needed, numbers, picture, write_report
from ..studies import AbstractStudy, AbstractStudyResult
from ..studies.gear_data import gear_tables, gears
from ..studies.summary import versions

REPORT = "report.html"
_NOTHING = "-"
_PROJECT = {"name": "project", "number": "project number"}  # keys of [project] that alone do not say whose they are
_SIDE_BY_SIDE = 5  # columns of a table
_GEOMETRY_NOTE = (
    "Positions on the path of contact count from the pitch point C, positive towards the tip of the pinion: A start of "
    "contact, B and D inner and outer point of single contact, E end of contact. The usable involute runs from the "
    "root form diameter to the tip form diameter, the mate's tip touches it down to the active root diameter."
)
_ASSUMED = (
    "External involute gears; the load acts where both faces overlap.",
    "The contact is frictionless, quasi-static and linear elastic; bores are fixed.",
    "Gear bodies are solid: thin rims, webs and spokes are not in the closed forms.",
    "The pressure of a tip corner is an estimate, which depends on the edge radius, and is given apart.",
)
_RIGID = "In the contact analysis shafts, bearings and housing are rigid."
_SUPPORTED = "Shafts, bearings and housing are those of the design file."
_EVEN = "One slice represents the whole face: the load is even over it."


@dataclass(frozen=True)
class Document:
    """Report of a command, requested by its options.

    Attributes:
        command: the command line, from its name to the last option.
        name: name of the design file, without its folders.
        content: content of the design file when the command began.
        began: time when the command began.
    """

    command: Sequence[str]
    name: str
    content: bytes
    began: datetime

    def facts(self, design: DesignFile) -> list[tuple[str, str]]:
        """Names and texts of project, design file, date, command line and versions, for the head of the report."""
        project = design.tables["project"].fields if "project" in design.tables else {}
        return [
            *((_PROJECT.get(name, name), text) for name, text in project.items()),
            ("design file", self.name),
            ("SHA-256", hashlib.sha256(self.content).hexdigest()),
            ("date", self.began.isoformat(" ", "seconds")),
            ("command", shlex.join(("jaxgear", *self.command))),
            ("made by", ", ".join(f"{name} {version}" for name, version in versions().items())),
        ]

    def write(
        self, folder: Path, study: AbstractStudy[Any], result: AbstractStudyResult, captions: Mapping[Path, str]
    ) -> None:
        """Writes the report.

        Args:
            folder: folder of the results.
            study: the study of the command.
            result: result of the study.
            captions: captions of the figures by file.
        """
        design, failures = study.design, list(result.failures())
        sections = [
            Chapter("Results", list(result.verdict()), failures, tables=[*result.headlines(), *result.tables()]),
            *result.chapters(),
            *([Chapter("Figures", figures=[picture(*each) for each in captions.items()])] if captions else []),
            _validity(study, result, failures),
            _inputs(study, result),
            Chapter("Geometry", [_GEOMETRY_NOTE], tables=gear_tables(gears(design)), new_page=True),
            *_all_numbers(result.summary()),
            Chapter(
                "Design file",
                [f"{self.name} as it was read; the command on the first page repeats the calculation."],
                literal=self.content.decode("utf-8-sig", "replace"),
                new_page=True,
            ),
        ]
        subtitle = f"jaxgear {self.command[0]}" if self.command else "jaxgear"
        write_report(folder / REPORT, design.title, subtitle, self.facts(design), sections)


def document(command: Sequence[str] | None, file: Path, *libraries: str) -> Document | None:
    """A report of a command line on a design file; None where none was asked for.

    Raises:
        ValueError: when one of the libraries that it needs is not installed, or the file cannot be read.
    """
    if command is None:
        return None
    needed("jinja2", *libraries)
    with naming(file):
        return Document(command, file.name, content(file), datetime.now().astimezone())


def _validity(study: AbstractStudy[Any], result: AbstractStudyResult, failures: Sequence[str]) -> Chapter:
    """Chapter on convergence, usual ranges and checks of the results."""
    found = result.findings()
    findings = None if found is None else list(found)
    lines = []
    if not failures:
        lines.append("Every solution converged, and no limit is exceeded.")
    if study.quick:
        lines.append("Quick run, coarse positions and a short search: a preview, do not use for design.")
    if findings == []:
        lines.append("Inputs and results lie within the usual ranges.")
    checks = tuple(result.checks())
    tables = [Table(("", "value"), checks, "checks")] if checks else []
    return Chapter("Convergence and validity", [*lines, *result.details()], failures, findings or (), tables)


def _inputs(study: AbstractStudy[Any], result: AbstractStudyResult) -> Chapter:
    """Chapter of assumptions and input values."""
    left_out, omitted, design = study.left_out, study.omits(), study.design
    ignored = "; ".join(filter(None, (left_out, omitted))) or None
    known = _without_none({**result.inputs(), "quick": study.quick, "left_out": ignored})
    held = f"{left_out[:1].upper()}{left_out[1:]}." if left_out else _SUPPORTED
    points = [*_ASSUMED, *result.assumptions, *([f"{omitted}."] if omitted else [])]
    points.append(_RIGID if design.support is None else held)
    if design.resolution().slices == 1:
        points.append(_EVEN)
    return Chapter("Inputs and assumptions", (), (), points, [Table(("", "value"), tuple(numbers(known)), "inputs")])


def _without_none(data: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: _without_none(value) if isinstance(value, Mapping) else value
        for name, value in data.items()
        if value is not None
    }


def _listed(title: str, data: Mapping[str, Any]) -> list[Table]:
    """Nested data as a table, with similar entries side by side."""
    if len(data) > 1 and all(isinstance(value, Mapping) for value in data.values()):
        columns = [dict(numbers(value)) for value in data.values()]
        names = dict.fromkeys(name for column in columns for name in column)
        rows = tuple((name, *(column.get(name, _NOTHING) for column in columns)) for name in names)
        return [Table(("", *data), rows, title)] if len(data) <= _SIDE_BY_SIDE else _split(title, data)
    rows = tuple(numbers(data))
    return [Table(("", "value"), rows, title)] if rows else []


def _split(title: str, data: Mapping[str, Any]) -> list[Table]:
    """Split a table into several that fit the width of a page."""
    names = list(data)
    parts = (names[first : first + _SIDE_BY_SIDE] for first in range(0, len(names), _SIDE_BY_SIDE))
    return [table for part in parts for table in _listed(title, {name: data[name] for name in part})]


def _all_numbers(data: Mapping[str, Any]) -> list[Chapter]:
    """Chapter of the results in `summary.json`; empty list without any."""
    loose = {name: value for name, value in data.items() if not isinstance(value, Mapping)}
    tables = [Table(("", "value"), tuple(numbers(loose)), "")] if loose else []
    for name, value in data.items():
        if isinstance(value, Mapping):
            tables += _listed(heading(name), value)
    note = "As in summary.json, which has every digit."
    return [Chapter("All numbers", [note], tables=tables, new_page=True)] if tables else []
