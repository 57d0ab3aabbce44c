"""Measured, computed or worn flanks from CSV or Parquet, and worn flanks into such files.

Beyond its ends a table goes on with its last values, so that one of another gear would pass for a flank unnoticed.

Columns end in their unit; other units and the headings of measuring machines are converted to these. `design_um` and
`measured_um` have the sign of the machines, positive for excess material; `modification_um`, as in `flanks.csv`, and
`wear_depth_um` are the material removed.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Array, Float

from ..contact import Side
from ..geometry import Gear, GearPair, path_of_contact, roll_angle
from ..microgeometry import AbstractModification, TabulatedFlank, TabulatedProfile
from ..microgeometry.base import AMOUNTS
from ..numerics import Given, Number, check, real
from ..wear import WearHistory
from . import template
from .errors import DesignFileError, naming, referring
from .folder import writing
from .headings import Column, converted
from .results import MEASURED
from .rows import PARQUET, Rows, read_rows
from .table_keys import FileTable, entry
from .value_types import choice, text
from .value_types import real as real_kind

# Shares of the active profile or of the face. A trace may run over the edges by so much, which also covers the
# tolerance of the tip diameter; and it may leave out four times what ISO 1328-1 leaves out of the evaluation.
_BEYOND, _LEFT_OUT = 0.05, 0.2


@dataclass(frozen=True)
class FlankRange:
    """Range of the points of a flank table.

    Attributes:
        roll_length: first and last roll length [mm].
        face_coordinate: first and last face coordinate from the middle of the gear's face [mm]; equal for a profile.
        step: largest distance of neighbouring face coordinates [mm]: lines may lie in the middles of slices.
    """

    roll_length: tuple[float, float]
    face_coordinate: tuple[float, float]
    step: float = 0.0

    def check_on(self, gear: Gear, start_roll_length: Given, common_width: Given, common_middle: Given) -> None:
        """Raise unless the range lies on the flank of a gear.

        Args:
            gear: gear of concrete numbers.
            start_roll_length: roll length at the start of the active profile [mm].
            common_width: over which its face and the mate's overlap [mm].
            common_middle: middle of the common face from the middle of the gear's face [mm].

        Raises:
            DesignFileError: in one line.
        """
        start, tip = float(start_roll_length), float(gear.tip_roll_length)
        active = tip - start
        if self.roll_length[1] > tip + _BEYOND * active:
            raise _refusal("reaches roll length", self.roll_length[1], "at most", tip, "the tip of the gear")
        if self.roll_length[0] > start + _LEFT_OUT * active:
            least = start + _LEFT_OUT * active
            raise _refusal("starts at roll length", self.roll_length[0], "at most", least, _profile(start, tip))
        if self.roll_length[1] < tip - _LEFT_OUT * active:
            least = tip - _LEFT_OUT * active
            raise _refusal("ends at roll length", self.roll_length[1], "at least", least, _profile(start, tip))
        self._check_face(float(gear.face_width), float(common_width), float(common_middle))

    def _check_face(self, width: float, common: float, middle: float) -> None:
        low, high = self.face_coordinate
        furthest, half = high if high >= -low else low, 0.5 * width
        if abs(furthest) > half + _BEYOND * width:
            face = f"the face is {width:g} mm wide"
            raise _refusal("reaches face coordinate", furthest, "within", half, face, sign="+-")
        if low == high:
            return
        ends = middle - 0.5 * common, middle + 0.5 * common
        face = f"the mate meets the face from {ends[0]:g} to {ends[1]:g} mm"
        least, most = ends[0] + _LEFT_OUT * common, ends[1] - _LEFT_OUT * common
        outside = _BEYOND * common
        if low - 0.5 * self.step >= ends[0] - outside and high + 0.5 * self.step <= ends[1] + outside:
            low, high = low - 0.5 * self.step, high + 0.5 * self.step  # ends of slices
        if low > least:
            raise _refusal("begins at face coordinate", low, "at most", least, face)
        if high < most:
            raise _refusal("ends at face coordinate", high, "at least", most, face)


def starts(pair: GearPair) -> dict[str, Float[Array, ""]]:
    """Roll lengths at the starts of the active profiles [mm], by gear."""
    contact = path_of_contact(pair)
    return {
        "pinion": contact.pinion_roll_length(contact.start),
        "wheel": contact.wheel_roll_length(contact.end),
    }


def _profile(start: float, tip: float) -> str:
    return f"the active profile runs from {start:.6g} to {tip:.6g} mm"


def _refusal(what: str, value: float, relation: str, limit: float, why: str, sign: str = "") -> DesignFileError:
    return DesignFileError("", f"{what} {value:g} mm, must be {relation} {sign}{limit:.6g} mm ({why})")


_REMOVED, _WORN, _DESIGN = "modification_um", "wear_depth_um", "design_um"
# what makes material removed of the first of them
_AMOUNTS = {MEASURED: -1.0, _REMOVED: 1.0, _WORN: 1.0, _DESIGN: -1.0}
_ALONG, _ACROSS, _GEAR, _COUNT = "roll_length_mm", "face_coordinate_mm", "gear", "revolutions"
_ANGLE, _DIAMETER = "roll_angle_deg", "diameter_mm"
# what machines call them; positive deviations are excess material on all of them
_COLUMNS = (
    Column(MEASURED, ("deviation", "profile_deviation", "measured_deviation", "abweichung")),
    Column(_REMOVED),
    Column(_WORN),
    Column(_DESIGN),
    Column(_ALONG, ("length_of_roll", "roll_path", "rolling_length", "wälzweg", "waelzweg", "wälzlänge")),
    Column(_ANGLE, ("angle_of_roll", "rolling_angle", "wälzwinkel", "waelzwinkel")),
    Column(_DIAMETER, ("durchmesser",)),
    Column(_ACROSS),
)
_SAME_COUNT = 1e-5  # relative: revolutions are given as they are printed, with six digits

Method = Literal["linear", "natural_cubic", "monotonic"]


def read_flank(
    path: str | Path,
    *,
    gear: str | None = None,
    design: str | None = None,
    side: Side | None = None,
    revolutions: float | None = None,
    base_radius: float | None = None,
    method: Method = "linear",
) -> TabulatedProfile | TabulatedFlank:
    """A flank from a file: a measured one, a chart of `write_traces`, or one of `flanks.csv` or `worn_flanks.parquet`.

    The material is that of measured_um, where there is no such column of modification_um, then of wear_depth_um, then
    of design_um. Places are roll_length_mm, or roll_angle_deg or diameter_mm with a side or a base radius, and
    face_coordinate_mm. One profile gives a `TabulatedProfile`; profiles at the same places on several lines of the face
    give a `TabulatedFlank`; so do a profile and a helix (column trace), where every profile is the given one moved by
    the helix. Headings of measuring machines do too, `Deviation [mm]` and `Roll angle (deg)` for instance, in any unit
    that they name: a deviation is positive for excess material.

    Args:
        path: text in UTF-8 with a line of headings, columns apart by commas, or by semicolons or tabs and then with
            decimal points or commas; or a Parquet file, whose name ends in .parquet.
        gear: gear, for a file with flanks of both gears, "pinion" or "wheel".
        design: name of the design, for a file with several designs.
        side: the gear's side of the contact, of `mesh.sides`: a table that is not on its flank is refused. It may reach
            5 % of active profile and face over their ends, and leave out 20 % at each. None takes any table.
        revolutions: revolutions of the pinion, for a file with worn flanks after several numbers of revolutions.
        base_radius: base radius of the gear [mm], negative for a ring gear, for files without roll lengths where no
            side is given.
        method: method of interpolation along the profile.

    Raises:
        ValueError: for a base radius of zero, or beside a side.
        DesignFileError: when the file cannot be read, is no flank or not one of the side; the message is one line.
    """
    check("base_radius", None if base_radius is None else abs(base_radius), "mm", low=0.0, open_low=True)
    if side is not None and base_radius is not None:
        raise ValueError(f"read_flank: base_radius = {base_radius:g} mm has no effect beside side")
    with naming(path):
        rows = _at_revolutions(_chosen(read_rows(Path(path)), {"gear": gear, "design": design}), revolutions)
        flank, reach = flank_of_rows(rows, base_radius if side is None else float(side.base_radius), method)
        if side is not None:
            reach.check_on(side.gear, side.start_roll_length, side.common_width, side.face_middle)
        return flank


class FlankFileSection(FileTable):
    """A flank from a file, measured, computed or worn: points on a grid of roll_length_mm and, where it varies over the
    face, face_coordinate_mm, with measured_um (excess material), modification_um or wear_depth_um (material removed).

    Attributes:
        file: CSV or Parquet file, beside the design file.
        gear: gear, for a file with flanks of both gears; the one that the table stands at where the key is left out.
        design: name of the design, for a file with several designs.
        revolutions: revolutions of the pinion, for a file with worn flanks after several numbers of revolutions.
        method: method of interpolation along the profile.
    """

    file: str = entry(text(), ...)
    gear: str | None = entry(choice("pinion", "wheel"))
    design: str | None = entry(text())
    revolutions: float | None = entry(real_kind(Number("", low=0.0)))
    method: str = entry(choice("linear", "natural_cubic", "monotonic"), "linear")


def flank_template(
    section: FlankFileSection, folder: Path, base_radius: float | None, internal: bool = False
) -> template.Template:
    """Template of the modification that a table of a design file takes from a flank file.

    Args:
        section: the table.
        folder: folder of the design file.
        base_radius: base radius of the gear [mm]; None where variables decide it, the file then needs roll lengths.
        internal: True for a ring gear.
    """
    path = folder / section.file
    with referring(f"{section.key}.file", path.name):
        rows = read_rows(path)
        gear = section.gear
        if gear is None and _GEAR in rows[0]:
            gear = section.key.partition(".")[0]
        method: Any = section.method
        rows = _at_revolutions(_chosen(rows, {_GEAR: gear, "design": section.design}), section.revolutions)
        flank, reach = flank_of_rows(rows, base_radius, method, internal)
    return template.Template(_FromFile(path.name, reach), {"flank": flank}, section.key)


def check_files(parts: Mapping[str, Sequence[template.Template]], pair: GearPair) -> None:
    """Raise if a flank from a file does not lie on the flank of its gear.

    Raises:
        DesignFileError: in one line that names the key and the file.
    """
    for name, several in parts.items():
        for part in several:
            if isinstance(part.make, _FromFile):
                with referring(f"{part.key}.file", part.make.name):
                    check_flank(part.make.reach, pair, name)


def check_flank(reach: FlankRange, pair: GearPair, name: str) -> None:
    """Raise if a table of points does not lie on the flank of the named gear, see `FlankRange.check_on`."""
    middle = pair.face_middles[name == "wheel"]
    reach.check_on(getattr(pair, name), starts(pair)[name], pair.face_width, middle)


@dataclass(frozen=True)
class _FromFile:
    """Maker of a template whose flank comes from a file: returns the flank unchanged.

    Attributes:
        name: name of the file.
        reach: range of the table.
    """

    name: str
    reach: FlankRange

    def __call__(self, flank: AbstractModification) -> AbstractModification:
        return flank


def flank_of_rows(
    rows: Rows, base_radius: float | None, method: Method = "linear", internal: bool = False
) -> tuple[TabulatedProfile | TabulatedFlank, FlankRange]:
    """Flank of the rows, and the range that they cover; roll lengths are negative of a ring gear, `internal`.

    Raises:
        DesignFileError: where they are no flank.
    """
    rows = converted(rows, _COLUMNS)
    amount = next((name for name in _AMOUNTS if name in rows[0]), None)
    if amount is None:
        raise DesignFileError("", f"has no column {', '.join(_AMOUNTS)}, must have one")
    helix = [row for row in rows if row.get("trace") == "helix"]
    profile = [row for row in rows if row.get("trace") != "helix"]
    if not profile:
        raise DesignFileError("", "holds a helix alone, must hold a profile")
    sign = -1.0 if internal or (base_radius is not None and base_radius < 0) else 1.0
    size = None if base_radius is None else abs(base_radius)
    roll, face, removed = _grid(profile, amount, size, sign)
    if amount == MEASURED and 0 < (spread := float(np.ptp(removed))) < AMOUNTS.low:
        raise DesignFileError("", f"has {MEASURED} within {spread:.3g} um, {AMOUNTS.remark}")
    if len(face) > 1 and helix:
        raise DesignFileError("", f"has a helix beside profiles at {len(face)} face coordinates, must be one profile")
    if helix:
        along, across, line = _grid(helix, amount, size, sign)
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
    step = float(np.max(np.diff(face), initial=0.0))
    reach = FlankRange((float(roll[0]), float(roll[-1])), (float(face[0]), float(face[-1])), step)
    if len(face) == 1:
        return TabulatedProfile(real(roll), real(removed[:, 0]), method=method), reach
    return TabulatedFlank(real(roll), real(face), real(removed), method=method), reach


def _chosen(rows: Rows, wanted: Mapping[str, str | None]) -> Rows:
    """The rows of one gear and design."""
    for name, value in wanted.items():
        known = list(dict.fromkeys(row[name] for row in rows if name in row))
        if value is None and len(known) > 1:
            raise DesignFileError("", f"holds several: {name} must be one of {', '.join(map(str, known))}")
        if value is not None and value not in known:
            held = f"must be one of {', '.join(map(str, known))}" if known else f"there is no column {name}"
            raise DesignFileError("", f'{name} = "{value}" is not in the file, {held}')
        rows = [row for row in rows if value is None or row[name] == value]
    return rows


def _at_revolutions(rows: Rows, revolutions: float | None) -> Rows:
    """The rows of worn flanks after a number of revolutions."""
    if _COUNT not in rows[0]:
        if revolutions is None:
            return rows
        raise DesignFileError("", f"{_COUNT} = {revolutions:g} is not in the file, there is no column {_COUNT}")
    counts = numbers_of(rows, _COUNT)
    known = np.unique(counts)
    if revolutions is None and len(known) == 1:
        return rows
    held = f"{_COUNT} must be one of {', '.join(f'{number:g}' for number in known)}"
    if revolutions is None:
        raise DesignFileError("", f"holds several: {held}")
    wanted = np.isclose(counts, revolutions, rtol=_SAME_COUNT, atol=0.0)
    if not wanted.any():
        raise DesignFileError("", f"{_COUNT} = {revolutions:g} is not in the file, {held}")
    return [row for row, is_wanted in zip(rows, wanted) if is_wanted]


def _grid(rows: Rows, amount: str, base_radius: float | None, sign: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll lengths, face coordinates and material removed, shape (rolls, faces), of points on a grid."""
    along, removed = sign * _along(rows, base_radius, sign), _AMOUNTS[amount] * numbers_of(rows, amount)
    across = numbers_of(rows, _ACROSS) if _ACROSS in rows[0] else np.zeros(len(rows))
    roll, row = np.unique(along, return_inverse=True)
    face, column = np.unique(across, return_inverse=True)
    table = np.full((len(roll), len(face)), np.nan)
    table[row, column] = removed
    if len(rows) != table.size or np.isnan(table).any():
        raise DesignFileError(
            "", f"has {len(rows)} points at {len(roll)} roll lengths and {len(face)} face coordinates, must be a grid"
        )
    return roll, face, table + 0.0


def _along(rows: Rows, base_radius: float | None, sign: float) -> np.ndarray:
    """Sizes of the roll lengths [mm]; all numbers of a ring gear, of negative sign, may be positive."""
    if _ALONG in rows[0]:
        found = numbers_of(rows, _ALONG)
        found = sign * found if (found <= 0).all() else found
        if (found < 0).any():
            raise DesignFileError("", f"{_ALONG} = {found.min():g} mm must be at least 0 mm (base circle)")
        return found
    if base_radius is None:
        raise DesignFileError("", f"has no column {_ALONG}, must have one where no base radius is given")
    if _ANGLE in rows[0]:
        return np.deg2rad(numbers_of(rows, _ANGLE)) * base_radius
    if _DIAMETER not in rows[0]:
        raise DesignFileError("", f"has no column {_ALONG}, {_ANGLE}, {_DIAMETER}, must have one")
    radius = 0.5 * numbers_of(rows, _DIAMETER)
    if (radius < base_radius).any():
        least = f"must be at least {2 * base_radius:g} mm (base circle)"
        raise DesignFileError("", f"diameter_mm = {2 * radius.min():g} mm {least}")
    return np.sqrt(radius**2 - base_radius**2)


def numbers_of(rows: Rows, column: str) -> np.ndarray:
    """A column of numbers.

    Raises:
        DesignFileError: where one is not a finite number.
    """
    found = np.empty(len(rows))
    for index, row in enumerate(rows):
        try:
            found[index] = float(row[column])
        except (TypeError, ValueError):
            found[index] = np.nan
        if not np.isfinite(found[index]):
            raise DesignFileError("", f'{column} of point {index + 1} is "{row[column] or ""}", must be a number')
    return found


_GEARS = "pinion", "wheel"

Worn = tuple[AbstractModification, AbstractModification]


def write_worn(path: str | Path, histories: Mapping[str, WearHistory]) -> None:
    """Writes the worn flanks of all designs at every time step, one row per point of a flank, to all digits.

    `read_worn` gives the same flanks of all, `read_flank` one of them.

    Args:
        path: file to write: Parquet where its name ends in .parquet, otherwise CSV.
        histories: wear histories by the name of the design.

    Raises:
        ValueError: for no wear history, and when the file cannot be written.
    """
    path = Path(path)
    if not histories:
        raise ValueError("write_worn: histories must not be empty")
    tables = [_columns(design, history) for design, history in histories.items()]
    columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    with writing(path):
        if path.suffix == PARQUET:
            _write_parquet(path, columns)
            return
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            # Python's numbers, whose text has all digits
            writer.writerows(zip(*(values.tolist() for values in columns.values())))


def _write_parquet(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    import pyarrow
    from pyarrow import parquet

    parquet.write_table(pyarrow.table({name: pyarrow.array(values.tolist()) for name, values in columns.items()}), path)


def _columns(design: str, history: WearHistory) -> dict[str, np.ndarray]:
    """Points of both flanks at every time step, as columns."""
    depth = np.asarray(history.depth, float)
    total, corner = depth.sum(axis=2), depth[:, :, 1]
    lengths = np.asarray(history.roll_length, float)
    angles = np.stack([np.asarray(roll_angle(gear, of), float) for gear, of in zip(history.gears, history.roll_length)])

    def all_over(values: Any, *axes: int) -> np.ndarray:
        return np.broadcast_to(np.expand_dims(np.asarray(values), axes), total.shape).ravel()

    return {
        "design": all_over(design, 0, 1, 2, 3),
        "revolutions": all_over(np.asarray(history.revolutions, float), 1, 2, 3),
        "gear": all_over(_GEARS, 0, 2, 3),
        "face_coordinate_mm": all_over(np.asarray(history.face_coordinate, float), 0, 3),
        "roll_angle_deg": all_over(angles, 0, 2),
        "roll_length_mm": all_over(lengths, 0, 2),
        "wear_depth_um": total.ravel(),
        "by_tip_corners_um": corner.ravel(),
    }


def read_worn(path: str | Path) -> dict[tuple[str, float], Worn]:
    """Read worn flanks (pinion, wheel) by design and revolutions of the pinion from a file of `write_worn`.

    Raises:
        ValueError: for a file that cannot be read, or without the columns and rows of worn flanks.
    """
    path = Path(path)
    try:
        rows: dict[tuple[str, float, str], list[tuple[float, float, float]]] = {}
        for row in read_rows(path):
            key = row["design"], float(row["revolutions"]), row["gear"]
            numbers = [float(row[name]) for name in ("face_coordinate_mm", "roll_length_mm", "wear_depth_um")]
            rows.setdefault(key, []).append((numbers[0], numbers[1], numbers[2]))
        keys = dict.fromkeys((design, done) for design, done, _ in rows)
        return {key: (_flank(rows[*key, _GEARS[0]]), _flank(rows[*key, _GEARS[1]])) for key in keys}
    except DesignFileError as error:
        raise ValueError(f"{path}: {error.problem}") from None
    except (KeyError, ValueError, TypeError) as error:
        raise ValueError(f"{path}: holds no worn flanks as jaxgear writes them: {error}") from None


def _flank(rows: list[tuple[float, float, float]]) -> AbstractModification:
    face, length, depth = np.array(rows).T
    lines = np.unique(face)
    if len(lines) == 1:
        return TabulatedProfile(real(length), real(depth))
    points = len(length) // len(lines)
    return TabulatedFlank(real(length[:points]), real(lines), real(depth.reshape(len(lines), points).T))
