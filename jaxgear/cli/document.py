"""The report of a command, put together from what it prints, writes and draws."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from ..io import DesignFile
from ..io.errors import naming
from ..io.toml import content
from ..report import Chapter, Report, Source, Table, figure, heading, needed, numbers, text, write_report
from ..studies.gear_data import drawing_table, rating_page

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
# what summary.json says of the inputs, before its results
_INPUTS = (
    "torque_Nm",
    "torques_Nm",
    "torque_range_Nm",
    "speed_rpm",
    "friction",
    "lubricant",
    "strength",
    "mesh_frequencies_Hz",
    "speeds",
    "settings",
    "equivalent_mass_kg",
    "tolerances",
    "variables",
    "model",
    "resolution",
    "quick",
    "left_out",
)
_OF_OPTIMUM = {
    "feasible": "all constraints met",
    "objective_change_at_twice_the_positions": "change of the objective at twice the positions, in its unit",
    "first_order_optimality": "first-order optimality, in the unit of the objective",
    "evaluations": "contact analyses",
}
_ELSEWHERE = ("title", "design_file", "project", "versions", "geometry", "drawing", "iso_6336")


@dataclass(frozen=True)
class CommandResult:
    """Output of a command for the terminal and the report.

    Attributes:
        lines: results in words.
        warnings: results that did not converge, or limits that are not met.
        findings: values out of the usual range; None if they were not checked.
        tables: tables of results.
        figures: files of the pictures.
        pages: further chapters of the report.
        assumptions: assumptions of this command, beside those of every contact analysis.
        left_out: parts of the design file that the command ignores and why; "" for none.
        first: tables before all others.
        details: lines on how the results were found, printed last.
    """

    lines: Sequence[str]
    warnings: Sequence[str] = ()
    findings: Sequence[str] | None = None
    tables: Sequence[Table] = ()
    figures: Sequence[Path] = ()
    pages: Sequence[Chapter] = ()
    assumptions: Sequence[str] = ()
    left_out: str = ""
    first: Sequence[Table] = ()
    details: Sequence[str] = ()


@dataclass(frozen=True)
class Document:
    """A report that was asked for.

    Attributes:
        command: the command line, from its name to the last option.
        source: the design file as it was when the command began.
        began: when.
    """

    command: tuple[str, ...]
    source: Source
    began: datetime

    @property
    def facts(self) -> list[tuple[str, str]]:
        """Name and text of design file, digest, date and command line, for the head of the report."""
        return [
            ("design file", self.source.name),
            ("SHA-256", self.source.sha256),
            ("date", self.began.isoformat(" ", "seconds")),
            ("command", shlex.join(("jaxgear", *self.command))),
        ]

    def write(self, folder: Path, design: DesignFile, data: Mapping[str, Any], found: CommandResult) -> None:
        """Writes the report.

        Args:
            folder: of the results.
            design: the design file.
            data: what `summary.json` holds.
            found: what the command says.
        """
        versions = ("made by", ", ".join(f"{name} {version}" for name, version in data["versions"].items()))
        sections = [
            Chapter("Results", found.lines, found.warnings, tables=[*found.first, *found.tables]),
            *found.pages,
            *_figures(found.figures),
            _validity(found, data),
            _inputs(design, data, found),
            *([rating_page(data["iso_6336"])] if "iso_6336" in data else []),
            Chapter("Geometry", [_GEOMETRY_NOTE], tables=_gears(data), new_page=True),
            *_all_numbers(data),
            Chapter(
                "Design file",
                [f"{self.source.name} as it was read; the command on the first page repeats the calculation."],
                literal=self.source.text,
                new_page=True,
            ),
        ]
        facts = [*project_facts(design), *self.facts, versions]
        subtitle = f"jaxgear {self.command[0]}" if self.command else "jaxgear"
        write_report(folder / REPORT, Report(design.title, subtitle, facts, sections))


def asked_for(command: Sequence[str] | None, *libraries: str) -> datetime | None:
    """Looks whether a report can be written, before long work begins; None where none was asked for.

    Raises:
        ValueError: when one of the libraries is not installed.
    """
    if command is None:
        return None
    needed("jinja2", *libraries)
    return datetime.now().astimezone()


def document(command: Sequence[str] | None, file: Path, *libraries: str) -> Document | None:
    """A report of a command line on a design file; None where none was asked for.

    Raises:
        ValueError: when one of the libraries that it needs is not installed, or the file cannot be read.
    """
    began = asked_for(command, *libraries)
    if command is None or began is None:
        return None
    with naming(file):
        return Document(tuple(command), Source.of(file, content(file)), began)


def project_facts(design: DesignFile) -> list[tuple[str, str]]:
    """Whose gears these are."""
    given = design.tables["project"].fields if "project" in design.tables else {}
    return [(_PROJECT.get(name, name), said) for name, said in given.items()]


def _gears(data: Mapping[str, Any]) -> list[Table]:
    """Geometry, and what stands on a drawing."""
    tables = geometry_tables(data["geometry"])
    return [*tables, drawing_table(data["drawing"])] if "drawing" in data else tables


def geometry_tables(geometry: Mapping[str, Mapping[str, Any]]) -> list[Table]:
    """Both gears side by side, and the pair."""
    pinion, wheel, pair = (geometry[name] for name in ("pinion", "wheel", "pair"))
    gears = tuple((heading(name), text(pinion[name]), text(wheel[name])) for name in pinion)
    both = tuple((heading(name), text(value)) for name, value in pair.items())
    return [Table(("", "pinion", "wheel"), gears, "gears"), Table(("", "pair"), both, "pair")]


def _figures(files: Iterable[Path]) -> list[Chapter]:
    pictures = [figure(path) for path in files]
    if not pictures:
        return []
    return [Chapter("Figures", figures=pictures)]


def _validity(found: CommandResult, data: Mapping[str, Any]) -> Chapter:
    """Chapter on convergence, usual ranges and checks of the results."""
    lines = []
    if not found.warnings:
        lines.append("Every solution converged, and no limit is exceeded.")
    if data.get("quick"):
        lines.append("Quick run, coarse positions and a short search: a preview, do not use for design.")
    if found.findings is not None and not found.findings:
        lines.append("Inputs and results lie within the usual ranges.")
    lines += found.details
    checks = []
    for name, design in data.get("designs", {}).items():
        checks += [
            (f"{name}: {heading(key)}", text(design[key]))
            for key in ("converged", "failed_torques_Nm")
            if key in design
        ]
        checks += [(f"{name}: by finite elements, {key}", value) for key, value in numbers(design.get("verified", {}))]
    optimum = data.get("optimum", {})
    checks += [(said, text(optimum[key])) for key, said in _OF_OPTIMUM.items() if key in optimum]
    tables = [Table(("", "value"), tuple(checks), "checks")] if checks else []
    return Chapter("Convergence and validity", lines, found.warnings, found.findings or (), tables)


def _inputs(design: DesignFile, data: Mapping[str, Any], found: CommandResult) -> Chapter:
    """Chapter of assumptions and input values."""
    given = {name: data[name] for name in _INPUTS if data.get(name) is not None}
    if "resolution" in given:  # without what is left to its default
        given["resolution"] = {name: size for name, size in given["resolution"].items() if size is not None}
    held = f"{found.left_out[:1].upper()}{found.left_out[1:]}." if found.left_out else _SUPPORTED
    points = [*_ASSUMED, *found.assumptions, _RIGID if design.support is None else held]
    if design.resolution().slices == 1:
        points.append(_EVEN)
    return Chapter("Inputs and assumptions", (), (), points, [Table(("", "value"), tuple(numbers(given)), "inputs")])


def _listed(title: str, data: Mapping[str, Any]) -> list[Table]:
    """Nested data as a table; those of several alike side by side."""
    if len(data) > 1 and all(isinstance(value, Mapping) for value in data.values()):
        columns = [dict(numbers(value)) for value in data.values()]
        names = dict.fromkeys(name for column in columns for name in column)
        rows = tuple((name, *(column.get(name, _NOTHING) for column in columns)) for name in names)
        return [Table(("", *data), rows, title)] if len(data) <= _SIDE_BY_SIDE else _split(title, data)
    rows = tuple(numbers(data))
    return [Table(("", "value"), rows, title)] if rows else []


def _split(title: str, data: Mapping[str, Any]) -> list[Table]:
    """Several tables of as many columns as a page holds."""
    names = list(data)
    parts = (names[first : first + _SIDE_BY_SIDE] for first in range(0, len(names), _SIDE_BY_SIDE))
    return [table for part in parts for table in _listed(title, {name: data[name] for name in part})]


def _all_numbers(data: Mapping[str, Any]) -> list[Chapter]:
    """Chapter of the numbers in `summary.json` that no other chapter shows; empty list without any."""
    rest = {name: value for name, value in data.items() if name not in (*_INPUTS, *_ELSEWHERE)}
    tables = []
    for name, value in rest.items():
        if isinstance(value, Mapping):
            tables += _listed(heading(name), value)
    loose = {name: value for name, value in rest.items() if not isinstance(value, Mapping)}
    if loose:
        tables.insert(0, Table(("", "value"), tuple(numbers(loose)), ""))
    if not tables:
        return []
    section = Chapter("All numbers", ["As in summary.json, which has every digit."], tables=tables, new_page=True)
    return [section]
