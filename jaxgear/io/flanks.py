"""Charts for a measuring machine out as CSV; measured, computed or worn flanks in, from CSV or Parquet.

Columns end in their unit. `design_um` and `measured_um` have the sign of the machines, positive for excess material;
`modification_um`, as in `flanks.csv`, and `wear_depth_um` are the material removed.
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
from .rows import Rows, read_rows
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
_MEASURED, _REMOVED, _WORN, _DESIGN = "measured_um", "modification_um", "wear_depth_um", "design_um"
# what makes material removed of the first of them
_AMOUNTS = {_MEASURED: -1.0, _REMOVED: 1.0, _WORN: 1.0, _DESIGN: -1.0}
_ALONG, _ACROSS, _LIFE = "roll_length_mm", "face_coordinate_mm", "revolutions"
_SAME_LIFE = 1e-6  # relative: lives are asked for as they are printed
_SAME_PLACE = 1e-3  # mm, of a measured and a designed point
_DIGITS = 9  # behind the decimal point: what is read and written again does not drift


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
    revolutions: float | None = None,
    base_radius: float | None = None,
    method: Literal["linear", "cubic2", "monotonic"] = "linear",
) -> TabulatedProfile | TabulatedFlank:
    """A flank from a file: a measured one, a chart of `write_traces`, or one of `flanks.csv` or `worn_flanks.parquet`.

    The material is that of measured_um, where there is no such column of modification_um, then of wear_depth_um, then
    of design_um. Places are roll_length_mm, or roll_angle_deg or diameter_mm with a base radius, and
    face_coordinate_mm. One profile gives a `TabulatedProfile`; profiles at the same places on several lines of the face
    give a `TabulatedFlank`; so do a profile and a helix (column trace), where every profile is the given one moved by
    the helix.

    Args:
        path: CSV file in UTF-8 with a line of headings, or a Parquet file, whose name ends in .parquet.
        gear: of a file with flanks of both gears, "pinion" or "wheel".
        design: of a file with several designs.
        revolutions: of the pinion, of a file with several lives of worn flanks.
        base_radius: of the gear [mm], for files without roll lengths.
        method: of interpolation along the profile.

    Raises:
        ValueError: for a base radius that is not positive.
        DesignFileError: when the file cannot be read or is no flank; the message is one line.
    """
    check("read_flank", "base_radius", base_radius, "mm", low=0.0, open_low=True)
    with naming(path):
        rows = _at_life(_chosen(read_rows(Path(path)), {"gear": gear, "design": design}), revolutions)
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
    """The modification of a gear that a table of a design file takes from a file in the folder."""
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


def _at_life(rows: Rows, revolutions: float | None) -> Rows:
    """The rows of one life of worn flanks."""
    if _LIFE not in rows[0]:
        if revolutions is None:
            return rows
        raise DesignFileError("", f"{_LIFE} = {revolutions:g} is not there, there is no column {_LIFE}")
    lives = _numbers(rows, _LIFE)
    known = np.unique(lives)
    if revolutions is None and len(known) == 1:
        return rows
    held = f"{_LIFE} must be one of {', '.join(f'{life:g}' for life in known)}"
    if revolutions is None:
        raise DesignFileError("", f"holds several: {held}")
    wanted = np.isclose(lives, revolutions, rtol=_SAME_LIFE, atol=0.0)
    if not wanted.any():
        raise DesignFileError("", f"{_LIFE} = {revolutions:g} is not there, {held}")
    return [row for row, is_wanted in zip(rows, wanted) if is_wanted]


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
