"""Flanks as CSV: charts for a measuring machine out, measured or computed flanks in.

Columns end in their unit. `design_um` and `measured_um` have the sign of the machines, positive for excess material;
`modification_um`, as in `flanks.csv`, is the material removed.
"""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..manufacture import Trace
from ..microgeometry import AbstractModification, TabulatedFlank, TabulatedProfile
from ..numerics import check, real
from . import schema, template
from .errors import DesignFileError, naming
from .folder import writing
from .toml import decode

_PLACE = {
    "face_coordinate_mm": "face_coordinate",
    "roll_angle_deg": "roll_angle",
    "roll_length_mm": "roll_length",
    "diameter_mm": "diameter",
    "design_um": "design",
    "upper_um": "upper",
    "lower_um": "lower",
}
_MEASURED, _REMOVED, _DESIGN = "measured_um", "modification_um", "design_um"
_AMOUNTS = {_MEASURED: -1.0, _REMOVED: 1.0, _DESIGN: -1.0}  # what makes material removed of the first of them
_ALONG, _ACROSS = "roll_length_mm", "face_coordinate_mm"
_SAME_PLACE = 1e-3  # mm, of a measured and a designed point
_DIGITS = 9  # behind the decimal point: what is read and written again does not drift

Rows = list[dict[str, str]]


def write_traces(path: str | Path, traces: Sequence[Trace], measured: Sequence[Trace] | None = None) -> Path:
    """Writes traces of a flank as CSV, one row per point, as measuring machines and their operators read them.

    Columns: trace, face_coordinate_mm, roll_angle_deg, roll_length_mm, diameter_mm, design_um, upper_um, lower_um and,
    with `measured`, measured_um. Limits are empty outside the evaluation range.

    Args:
        path: file to write.
        traces: of one flank, of `profile_trace` and `helix_trace`.
        measured: of the same places, trace by trace; None for the design alone.

    Returns:
        the path.

    Raises:
        ValueError: when the file cannot be written, or measured traces have other places.
    """
    columns = {name: [np.asarray(getattr(trace, field)) for trace in traces] for name, field in _PLACE.items()}
    if measured is not None:
        shapes = [[np.shape(trace.design) for trace in many] for many in (traces, measured)]
        if shapes[0] != shapes[1]:
            raise ValueError(f"write_traces: measured has traces of {shapes[1]} points, must be {shapes[0]}")
        for number, (one, other) in enumerate(zip(traces, measured)):
            for field in ("roll_length", "face_coordinate"):
                if not np.allclose(getattr(one, field), getattr(other, field), rtol=0, atol=_SAME_PLACE):
                    raise ValueError(f"write_traces: {field} of measured trace {number} is not that of the design")
        columns[_MEASURED] = [np.asarray(trace.design) for trace in measured]
    with writing(path), Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["trace", *columns])
        for number, trace in enumerate(traces):
            for row in zip(*(values[number] for values in columns.values())):
                writer.writerow([trace.kind, *map(_text, row)])
    return Path(path)


def read_flank(
    path: str | Path,
    *,
    gear: str | None = None,
    design: str | None = None,
    base_radius: float | None = None,
    method: Literal["linear", "cubic2", "monotonic"] = "linear",
) -> TabulatedProfile | TabulatedFlank:
    """A flank from a CSV file: a measured one, a chart of `write_traces`, or a flank of `flanks.csv`.

    The material is that of measured_um, where there is no such column of modification_um, then of design_um. Places
    are roll_length_mm, or roll_angle_deg or diameter_mm with a base radius, and face_coordinate_mm. One profile gives a
    `TabulatedProfile`; profiles at the same places on several lines of the face give a `TabulatedFlank`; so do a
    profile and a helix (column trace), where every profile is the given one moved by the helix.

    Args:
        path: CSV file in UTF-8 with a line of headings.
        gear: of a file with flanks of both gears, "pinion" or "wheel".
        design: of a file with several designs.
        base_radius: of the gear [mm], for files without roll lengths.
        method: of interpolation along the profile.

    Raises:
        ValueError: for a base radius that is not positive.
        DesignFileError: when the file cannot be read or is no flank; the message is one line.
    """
    check("read_flank", "base_radius", base_radius, "mm", low=0.0, open_low=True)
    with naming(path):
        rows = _chosen(_read(Path(path)), {"gear": gear, "design": design})
        amount = next((name for name in _AMOUNTS if name in rows[0]), None)
        if amount is None:
            raise DesignFileError("", f"has no column {', '.join(_AMOUNTS)}, must have one")
        helix = [row for row in rows if row.get("trace") == "helix"]
        profile = [row for row in rows if row.get("trace") != "helix"]
        if not profile:
            raise DesignFileError("", "holds a helix alone, must hold a profile")
        roll, face, removed = _grid(profile, amount, base_radius)
        if len(face) > 1 and helix:
            raise DesignFileError(
                "", f"has a helix beside profiles at {len(face)} face coordinates, must be one profile"
            )
        if helix:
            along, across, line = _grid(helix, amount, base_radius)
            if len(along) > 1:
                raise DesignFileError("", f"has a helix at {len(along)} roll lengths, must be one")
            if len(across) < 2:
                raise DesignFileError("", "has a helix of 1 point, must have at least 2")
            if not across[0] <= face[0] <= across[-1]:
                at = f"{_ACROSS} = {face[0]:g} mm"
                raise DesignFileError("", f"has a profile at {at}, must be within the helix")
            face, removed = across, removed + line - np.interp(face, across, line[0])
        if len(roll) < 2:
            raise DesignFileError("", "has 1 place along the profile, must have at least 2")
        if len(face) == 1:
            return TabulatedProfile(real(roll), real(removed[:, 0]), method=method)
        return TabulatedFlank(real(roll), real(face), real(removed), method=method)


def flank_part(key: str, table: Mapping[str, Any], folder: Path) -> template.Part:
    """The modification of a gear that a table of a design file takes from a CSV file in the folder."""
    given = {name: value for name, value in table.items() if name != "type"}
    section = decode(key, given, schema.FlankFileSection).given()
    path = folder / section.pop("file")
    try:
        flank = read_flank(path, **section)
    except DesignFileError as error:
        raise DesignFileError(f"{key}.file", f"{path.name}: {error.problem}") from None
    return template.Part(_as_it_is, {"flank": flank}, key)


def _as_it_is(flank: AbstractModification) -> AbstractModification:
    return flank


def _read(path: Path) -> Rows:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            names = [name.strip() for name in reader.fieldnames or ()]
            reader.fieldnames = names
            rows = list(reader)
    except UnicodeDecodeError:
        raise DesignFileError("", "is not text in UTF-8") from None
    except OSError as error:
        raise DesignFileError("", error.strerror or str(error)) from None
    except ValueError as error:  # a name that no file can have
        raise DesignFileError("", error) from None
    except csv.Error as error:
        raise DesignFileError("", f"is no CSV file: {error}") from None
    if not rows:
        raise DesignFileError("", "holds no points")
    _check_table(names, rows)
    return rows


def _check_table(names: list[str], rows: Rows) -> None:
    """Refuses what the headings do not fit: decimal commas would be columns of their own."""
    if len(names) == 1 and ";" in names[0]:
        raise DesignFileError("", "separates its columns by semicolons, must have commas, and points in its numbers")
    twice = [name for name in dict.fromkeys(names) if name and names.count(name) > 1]
    if twice:
        raise DesignFileError("", f"has several columns {twice[0]}, must have one")
    for number, row in enumerate(rows, 1):
        further = row.get(None)  # type: ignore[call-overload]
        if further and any(map(str.strip, further)):
            fields = len(names) + len(further)
            problem = f"point {number} has {fields} fields, the headings {len(names)}: numbers must have no commas"
            raise DesignFileError("", problem)


def _chosen(rows: Rows, wanted: Mapping[str, str | None]) -> Rows:
    """The rows of one gear and design."""
    for name, value in wanted.items():
        known = list(dict.fromkeys(row[name] for row in rows if name in row))
        if value is None and len(known) > 1:
            raise DesignFileError("", f"holds several: {name} must be one of {', '.join(map(str, known))}")
        if value is not None and value not in known:
            held = f"must be one of {', '.join(map(str, known))}" if known else f"there is no column {name}"
            raise DesignFileError("", f'{name} = "{value}" is not there, {held}')
        rows = [row for row in rows if value is None or row[name] == value]
    return rows


def _grid(rows: Rows, amount: str, base_radius: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll lengths, face coordinates and material removed, shape (rolls, faces), of points on a grid."""
    along, removed = _along(rows, base_radius), _AMOUNTS[amount] * _numbers(rows, amount)
    across = _numbers(rows, _ACROSS) if _ACROSS in rows[0] else np.zeros(len(rows))
    roll, row = np.unique(along, return_inverse=True)
    face, column = np.unique(across, return_inverse=True)
    table = np.full((len(roll), len(face)), np.nan)
    table[row, column] = removed
    if len(rows) != table.size or np.isnan(table).any():
        raise DesignFileError(
            "", f"has {len(rows)} points at {len(roll)} roll lengths and {len(face)} face coordinates, must be a grid"
        )
    return roll, face, table + 0.0


def _along(rows: Rows, base_radius: float | None) -> np.ndarray:
    if _ALONG in rows[0]:
        found = _numbers(rows, _ALONG)
        if (found < 0).any():
            raise DesignFileError("", f"{_ALONG} = {found.min():g} mm must be at least 0 mm (base circle)")
        return found
    if base_radius is None:
        raise DesignFileError("", f"has no column {_ALONG}, must have one where no base radius is given")
    if "roll_angle_deg" in rows[0]:
        return np.deg2rad(_numbers(rows, "roll_angle_deg")) * base_radius
    if "diameter_mm" not in rows[0]:
        raise DesignFileError("", f"has no column {_ALONG}, roll_angle_deg, diameter_mm, must have one")
    radius = 0.5 * _numbers(rows, "diameter_mm")
    if (radius < base_radius).any():
        least = f"must be at least {2 * base_radius:g} mm (base circle)"
        raise DesignFileError("", f"diameter_mm = {2 * radius.min():g} mm {least}")
    return np.sqrt(radius**2 - base_radius**2)


def _numbers(rows: Rows, column: str) -> np.ndarray:
    found = np.empty(len(rows))
    for index, row in enumerate(rows):
        try:
            found[index] = float(row[column])
        except (TypeError, ValueError):
            found[index] = np.nan
        if not np.isfinite(found[index]):
            raise DesignFileError("", f'{column} of point {index + 1} is "{row[column] or ""}", must be a number')
    return found


def _text(value: float) -> str:
    """The shortest text of a number, nothing for NaN."""
    return "" if np.isnan(value) else repr(round(float(value), _DIGITS) + 0.0)
