"""Measured or computed flanks from CSV.

Columns end in their unit. `design_um` and `measured_um` have the sign of the machines, positive for excess material;
`modification_um`, as in `flanks.csv`, is the material removed.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..contact import Side
from ..geometry import GearPair
from ..microgeometry import AbstractModification, TabulatedFlank, TabulatedProfile
from ..numerics import check, real
from . import schema, template
from .errors import DesignFileError, naming
from .flank_range import FlankRange, starts
from .toml import decode
from .traces import MEASURED

_REMOVED, _DESIGN = "modification_um", "design_um"
_AMOUNTS = {MEASURED: -1.0, _REMOVED: 1.0, _DESIGN: -1.0}  # what makes material removed of the first of them
_ALONG, _ACROSS, _GEAR = "roll_length_mm", "face_coordinate_mm", "gear"

Rows = list[dict[str, str]]
Method = Literal["linear", "cubic2", "monotonic"]


def read_flank(
    path: str | Path,
    *,
    gear: str | None = None,
    design: str | None = None,
    side: Side | None = None,
    base_radius: float | None = None,
    method: Method = "linear",
) -> TabulatedProfile | TabulatedFlank:
    """A flank from a CSV file: a measured one, a chart of `write_traces`, or a flank of `flanks.csv`.

    The material is that of measured_um, where there is no such column of modification_um, then of design_um. Places
    are roll_length_mm, or roll_angle_deg or diameter_mm with a side or a base radius, and face_coordinate_mm. One
    profile gives a `TabulatedProfile`; profiles at the same places on several lines of the face give a
    `TabulatedFlank`; so do a profile and a helix (column trace), where every profile is the given one moved by the
    helix.

    Args:
        path: CSV file in UTF-8 with a line of headings.
        gear: of a file with flanks of both gears, "pinion" or "wheel".
        design: of a file with several designs.
        side: the gear's side of the contact, of `mesh.sides`: a table that is not on its flank is refused. It may reach
            5 % of active profile and face over their ends, and leave out 20 % at each. None takes any table.
        base_radius: of the gear [mm], for files without roll lengths where no side is given.
        method: of interpolation along the profile.

    Raises:
        ValueError: for a base radius that is not positive, or beside a side.
        DesignFileError: when the file cannot be read, is no flank or not one of the side; the message is one line.
    """
    check("read_flank", "base_radius", base_radius, "mm", low=0.0, open_low=True)
    if side is not None and base_radius is not None:
        raise ValueError(f"read_flank: base_radius = {base_radius:g} mm has no effect beside side")
    with naming(path):
        rows = _chosen(_read(Path(path)), {"gear": gear, "design": design})
        flank, reach = _table(rows, base_radius if side is None else float(side.base_radius), method)
        if side is not None:
            reach.check_on(side.gear, side.start_roll_length, side.face_width)
        return flank


def flank_part(key: str, table: Mapping[str, Any], folder: Path) -> template.Part:
    """The modification of a gear that a table of a design file takes from a CSV file in the folder."""
    given = {name: value for name, value in table.items() if name != "type"}
    section = decode(key, given, schema.FlankFileSection)
    path = folder / section.file
    try:
        rows = _read(path)
        gear = section.gear
        if gear is None and _GEAR in rows[0]:
            gear = key.partition(".")[0]
        method: Any = section.method
        flank, reach = _table(_chosen(rows, {_GEAR: gear, "design": section.design}), None, method)
    except DesignFileError as error:
        raise DesignFileError(f"{key}.file", f"{path.name}: {error.problem}") from None
    return template.Part(_FromFile(path.name, reach), {"flank": flank}, key)


def check_files(parts: Mapping[str, Sequence[template.Part]], pair: GearPair) -> None:
    """Refuses tables from files that are not on the flank of the gear, of the given name, that they stand at.

    Raises:
        DesignFileError: in one line that names the key and the file.
    """
    for name, several in parts.items():
        for part in several:
            if isinstance(part.make, _FromFile):
                start = starts(pair)[name]
                try:
                    part.make.reach.check_on(getattr(pair, name), start, pair.face_width)
                except DesignFileError as error:
                    raise DesignFileError(f"{part.key}.file", f"{part.make.name}: {error.problem}") from None


@dataclass(frozen=True)
class _FromFile:
    """Makes the modification of a part whose flank comes from a file: the flank as it is.

    Attributes:
        name: of the file.
        reach: of its table.
    """

    name: str
    reach: FlankRange

    def __call__(self, flank: AbstractModification) -> AbstractModification:
        return flank


def _table(
    rows: Rows, base_radius: float | None, method: Method
) -> tuple[TabulatedProfile | TabulatedFlank, FlankRange]:
    """The flank of the rows, and where they are."""
    amount = next((name for name in _AMOUNTS if name in rows[0]), None)
    if amount is None:
        raise DesignFileError("", f"has no column {', '.join(_AMOUNTS)}, must have one")
    helix = [row for row in rows if row.get("trace") == "helix"]
    profile = [row for row in rows if row.get("trace") != "helix"]
    if not profile:
        raise DesignFileError("", "holds a helix alone, must hold a profile")
    roll, face, removed = _grid(profile, amount, base_radius)
    if len(face) > 1 and helix:
        raise DesignFileError("", f"has a helix beside profiles at {len(face)} face coordinates, must be one profile")
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
    reach = FlankRange((float(roll[0]), float(roll[-1])), (float(face[0]), float(face[-1])))
    if len(face) == 1:
        return TabulatedProfile(real(roll), real(removed[:, 0]), method=method), reach
    return TabulatedFlank(real(roll), real(face), real(removed), method=method), reach


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
