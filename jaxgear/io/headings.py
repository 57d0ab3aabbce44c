"""Headings of measured columns: a quantity and its unit, as machines and spreadsheets write them.

`Roll length [mm]`, `roll length (mm)` and `roll_length_mm` say the same. A column of a known quantity is converted to
the unit of the library; without a unit it is refused, because a number in another one would pass unnoticed.
"""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from .errors import DesignFileError

_LENGTHS = {"nm": 1e-6, "um": 1e-3, "mm": 1.0, "m": 1e3, "in": 25.4}  # mm
ANGLES = {"deg": 1.0, "arcmin": 1 / 60, "arcsec": 1 / 3600, "rad": 180 / math.pi}  # deg
ANGLES |= {"mrad": 1e-3 * ANGLES["rad"], "urad": 1e-6 * ANGLES["rad"]}
_TORQUES = {"Nmm": 1e-3, "Nm": 1.0, "kNm": 1e3}
_DIMENSIONS = (_LENGTHS, ANGLES, _TORQUES)
_SPELLINGS = {  # of a unit, in lower case without blanks
    "µm": "um", "μm": "um", "micron": "um", "microns": "um", "inch": "in", "°": "deg", "degree": "deg",
    "degrees": "deg", '"': "arcsec", "″": "arcsec", "arcseconds": "arcsec", "arc-sec": "arcsec", "'": "arcmin",
    "arcminutes": "arcmin", "radian": "rad", "radians": "rad", "µrad": "urad", "μrad": "urad", "n·m": "Nm", "n*m": "Nm",
}  # fmt: skip
_UNIT = re.compile(r"(?P<name>.*?)\s*[\[(]\s*(?P<unit>[^\])]*)[\])]\s*")


@dataclass(frozen=True)
class Column:
    """Column that a file may have: name, unit and headings.

    Attributes:
        name: heading of the library, with its unit at the end.
        spellings: other names of the quantity, in lower case with underscores.
    """

    name: str
    spellings: tuple[str, ...] = ()

    @property
    def quantity(self) -> str:
        """The heading without its unit."""
        return self.name.rpartition("_")[0]

    @property
    def unit(self) -> str:
        """Unit of the library."""
        return self.name.rpartition("_")[2]


def _known_unit(text: str) -> str:
    """The unit of a text, "" for none."""
    plain = re.sub(r"\s", "", text)
    found = _SPELLINGS.get(plain.lower(), plain)
    return found if any(found in units for units in _DIMENSIONS) else ""


def with_units(names: list[str], cells: Iterable[str]) -> list[str] | None:
    """Headings with the units of the second line; None if that line has no units."""
    texts = [cell.strip().strip("[]()") for cell in cells]
    if len(texts) != len(names) or not any(texts) or not all(_known_unit(text) for text in texts if text):
        return None
    return [f"{name} [{text}]" if text else name for name, text in zip(names, texts)]


def converted(rows: list[dict[str, str]], columns: Iterable[Column]) -> list[dict[str, str]]:
    """Rows converted to the headings and units of the library.

    Raises:
        DesignFileError: for a quantity that is there twice, or without a unit, or in one of another kind.
    """
    renamed = _renamed(rows[0], columns)
    if all(name == heading and factor == 1 for heading, (name, factor) in renamed.items()):
        return rows
    return [{renamed[name][0]: _scaled(cell, renamed[name][1]) for name, cell in row.items() if name} for row in rows]


def _renamed(headings: Iterable[str], columns: Iterable[Column]) -> dict[str, tuple[str, float]]:
    """Heading of the library and factor to its unit, by headings of the file."""
    known = {spelling: column for column in columns for spelling in (column.quantity, *column.spellings)}
    found: dict[str, tuple[str, float]] = {}
    for heading in filter(None, headings):
        quantity, unit = parts(heading)
        column = known.get(quantity)
        if column is None or (not unit and quantity == column.quantity == heading):
            found[heading] = heading, 1.0  # of another kind, or a label of the library's own tables
        elif not unit:
            raise DesignFileError(heading, f'names no unit, write "{heading} [{column.unit}]"')
        else:
            found[heading] = column.name, _factor(heading, unit, column.unit)
    names = [name for name, _ in found.values()]
    for name in names:
        if names.count(name) > 1:
            both = ", ".join(heading for heading, (own, _) in found.items() if own == name)
            raise DesignFileError("", f"has several columns of {name}: {both}, must have one")
    return found


def parts(heading: str) -> tuple[str, str]:
    """Quantity of a heading, in lower case with underscores, and its unit, "" without one."""
    match = _UNIT.fullmatch(heading)
    name, unit = (match["name"], match["unit"]) if match else (heading, "")
    if not match and _known_unit(heading.rpartition("_")[2]):
        name, _, unit = heading.rpartition("_")
    return re.sub(r"\W+", "_", name.strip().lower()).strip("_"), _known_unit(unit) or unit.strip()


def _factor(heading: str, unit: str, wanted: str) -> float:
    of: Mapping[str, float] = next(units for units in _DIMENSIONS if wanted in units)
    if unit not in of:
        raise DesignFileError(heading, f'unit "{unit}" must be one of {", ".join(of)}')
    return 1.0 if unit == wanted else float(f"{of[unit] / of[wanted]:.15g}")


def _scaled(cell: str, factor: float) -> str:
    """Number times a factor as text; other text unchanged, to be refused where it is used."""
    if factor == 1:
        return cell
    try:
        return repr(float(cell) * factor)
    except (TypeError, ValueError):
        return cell
