"""The tables [lubricant] and [strength], which may stand in files of their own."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from ..metrics import Lubricant, Strength
from ..numerics import Number
from .errors import DesignFileError, join, referring
from .schema import LoadSection, Tables
from .table_keys import FileTable, decode, key, section_of
from .template import part_of
from .toml import read
from .value_types import outside, text

S = TypeVar("S", bound=FileTable)

_FILE = "file"
_SPEED = Number("rpm", low=0.0, open_low=True)


class FileKey(FileTable):
    """Where the rest of a table stands.

    Attributes:
        file: TOML file beside the design file, with any of the other keys; no key stands in both.
    """

    file: str | None = key(text())


class LubricantSection(FileKey, section_of(Lubricant, open=False)):  # type: ignore[misc]
    """The oil, for friction, temperatures, film and scuffing; needs a load.speed greater than 0."""


class StrengthSection(FileKey, section_of(Strength, open=False)):  # type: ignore[misc]
    """Permissible stresses, for the safety factors."""


def lubricant_of(
    table: Tables | None, load: LoadSection, bounds: Mapping[str, tuple[float, float]], folder: Path
) -> Lubricant | None:
    """The lubricant of a design file; None without the table.

    Args:
        table: as it was read.
        load: under which the oil is used.
        bounds: (low, high) of every free parameter.
        folder: of the design file.

    Raises:
        DesignFileError: for anything that is wrong with it, or without a speed, or at standstill.
    """
    if table is None:
        return None
    section = _whole("lubricant", table, LubricantSection, folder)
    if load.speed is None:
        raise DesignFileError("lubricant", "has no effect without load.speed")
    key, slowest = "load.speed", load.speed
    if isinstance(slowest, str):
        key, slowest = f"variables.{slowest}.low", bounds[slowest][0]
    if too_slow := outside(_SPEED, slowest):
        raise DesignFileError(key, f"{too_slow} with [lubricant]: no film without motion")
    if load.friction is not None:
        for name in ("friction", "friction_factor"):
            if getattr(section, name) is not None:
                raise DesignFileError(f"lubricant.{name}", "has no effect beside load.friction")
    return part_of("lubricant", section, Lubricant).build({})


def strength_of(table: Tables | None, folder: Path) -> Strength | None:
    """The strengths of a design file; None without the table.

    Raises:
        DesignFileError: for anything that is wrong with it.
    """
    if table is None:
        return None
    section = _whole("strength", table, StrengthSection, folder)
    if not section.given().keys() - {_FILE}:
        raise DesignFileError("strength", "is empty; it gives the permissible stresses")
    return part_of("strength", section, Strength).build({})


def _whole(key: str, table: Tables, section: type[S], folder: Path) -> S:
    """A table with what stands in its file."""
    name = decode(key, {_FILE: table[_FILE]} if _FILE in table else {}, FileKey).file
    if name is None:
        return decode(key, table, section)
    path = folder / name
    with referring(f"{key}.{_FILE}", name):
        held: dict[str, Any] = read(path)
    for twice in held.keys() & table.keys():
        raise DesignFileError(join(key, twice), f"stands in {name} too")
    try:
        return decode(key, {**held, **table}, section)
    except DesignFileError as error:
        own = error.key.removeprefix(f"{key}.")
        if own.partition("[")[0] in held:
            raise DesignFileError(f"{key}.{_FILE}", f"{name}: {own}: {error.problem}") from None
        raise
