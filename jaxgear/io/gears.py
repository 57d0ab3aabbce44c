"""Gears, their materials and their pair, as a design file gives them."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..geometry import Gear, GearPair, Material, pair_with_backlash
from ..manufacture import ToothThickness, drawn_gear
from ..microgeometry import AbstractModification
from ..numerics import Number, fields_of
from . import schema, template
from .errors import DesignFileError, check_known
from .flanks import flank_part
from .table_keys import decode
from .value_types import not_of_kind

_STEEL = "STEEL"
_BACKLASH = Number("um", low=0.0)
# with any of these a gear says how thick its teeth are
_THICKNESS = ("span", "over_balls", "tooth_thickness_allowance", "tooth_thickness_tolerance")
_WITHOUT_FLANKS = "modification", "quality_class"

Materials = Mapping[str, template.Part]


def materials_of(top: schema.FileSection) -> Materials:
    """The materials of a file by their names, with the library's."""
    found = {_STEEL: template.Part(Material, {}, "material")}
    for name, table in (top.materials or {}).items():
        key = f"materials.{name}"
        if name in found:
            raise DesignFileError(key, "is a material of the library, choose another name")
        found[name] = template.parse(key, table, Material)
    return found


def gear_of(
    key: str, table: schema.Tables, materials: Materials, folder: Path
) -> tuple[schema.GearSection, template.Part, list[template.Part]]:
    """What a file says of a gear, the gear and its modifications; paths begin in the folder."""
    section = decode(key, table, schema.GearSection)
    flank = []
    for index, each in enumerate(section.modification):
        at = f"{key}.modification[{index}]"
        read = each.get("type") == "file"
        flank.append(flank_part(at, each, folder) if read else template.parse(at, each, AbstractModification))
    return section, _gear(key, section, materials), flank


def drawing_of(section: schema.GearSection) -> dict[str, Any]:
    """What a file gives of a gear that its numbers do not tell: the name of the material, the measured tooth thickness.

    By name and unit; lower and upper limit as a list of both.
    """
    given, units = section.given(), fields_of(ToothThickness)
    found: dict[str, Any] = {} if isinstance(section.material, dict) else {"material": section.material or _STEEL}
    for name in units:
        if name in given and not isinstance(given[name], str):
            found[f"{name}_{units[name].unit}" if units[name].unit else name] = given[name]
    return found


def fixed_gear(key: str, table: schema.Tables, materials: Materials) -> Gear:
    """A gear of numbers, whose flanks do not count."""
    section = decode(key, table, schema.GearSection)
    for name in _WITHOUT_FLANKS:
        if name in section.given():
            raise DesignFileError(f"{key}.{name}", "has no effect, only pinion and wheel have flanks")
    return _fixed(_gear(key, section, materials))


def _gear(key: str, section: schema.GearSection, materials: Materials) -> template.Part:
    gear = template.part_of(key, section, Gear, without=("material",))
    fields = {**gear.fields, **template.part_of(key, section, ToothThickness).fields}
    if section.material is not None:
        fields["material"] = _material(f"{key}.material", section.material, materials)
    # without any measure of a drawing the gear is the library's: messages then name its own fields
    return replace(gear, make=drawn_gear if set(fields) & set(fields_of(ToothThickness)) else Gear, fields=fields)


def _material(key: str, given: str | schema.Tables, materials: Materials) -> template.Part:
    if not isinstance(given, str):
        return template.parse(key, given, Material)
    check_known(key, given, materials)
    return materials[given]


def fixed_material(key: str, given: str | schema.Tables | None, materials: Materials) -> Material:
    """A material of numbers, by its name or table; steel for None."""
    return _fixed(_material(key, _STEEL if given is None else given, materials))


def _fixed(part: template.Part) -> Any:
    for free in part.free():
        raise DesignFileError(free.key, not_of_kind("a number", free.name))
    return part.build({})


def pair_of(top: schema.FileSection, pinion: template.Part, wheel: template.Part) -> template.Part:
    """The pair of two gears, with what its table says."""
    section = decode("pair", top.pair or {}, schema.PairSection)
    mounting = template.part_of("pair", section, GearPair)
    fields: dict[str, Any] = {"pinion": pinion, "wheel": wheel, **mounting.fields}
    if section.backlash is None:
        return replace(mounting, fields=fields)
    open_gears = [name for name in ("pinion", "wheel") if not set(fields[name].fields) & set(_THICKNESS)]
    if not open_gears and section.center_distance is not None:
        problem = "has no effect, centre distance and tooth thickness of both gears are given"
        raise DesignFileError("pair.backlash", problem)
    by = {0: "center_distance", 1: open_gears[-1] if open_gears else "", 2: "both"}[len(open_gears)]
    fields |= {"backlash": template.opened(section.backlash, "pair.backlash", _BACKLASH), "by": by}
    return replace(mounting, make=pair_with_backlash, fields=fields)


def quality_of(pinion: schema.GearSection, wheel: schema.GearSection) -> list[int] | None:
    """Flank tolerance classes of both gears; None where they have none."""
    given = {"pinion": pinion.quality_class, "wheel": wheel.quality_class}
    missing = [name for name, number in given.items() if number is None]
    if len(missing) == 1:
        raise DesignFileError(f"{missing[0]}.quality_class", "missing, the other gear has one")
    return None if missing else [number for number in given.values() if number is not None]


def with_quality(key: str, section: Any, own: list[int] | None) -> Any:
    """A table that needs classes: with its own, or with those of the gears."""
    if section.quality_class is None:
        if own is None:
            raise DesignFileError(f"{key}.quality_class", "missing, this key is required where the gears have none")
        return section.changed(quality_class=own)
    if own is not None:
        raise DesignFileError(
            f"{key}.quality_class", "has no effect, the gears have classes of their own: take one of them out"
        )
    return section


def both_classes(given: int | list[int] | None) -> tuple[int, int]:
    """Classes of pinion and wheel of a table that has them, from itself or `with_quality`."""
    assert given is not None
    first, second = given if isinstance(given, list) else (given, given)
    return first, second
