"""Gears, their materials and their pair, as a design file gives them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..geometry import Gear, GearPair, Material, RingGear, ToothProfile, ToothThickness, drawn_gear, pair_with_backlash
from ..microgeometry import AbstractModification
from ..numerics import Number, UnitKey, changed, fields_of
from ..numerics import real as real_number
from .errors import DesignFileError, suggestion
from .flanks import FlankFileSection, flank_template
from .imperial import NORMAL_PITCH, PITCH
from .table_keys import FileTable, as_field, decode, entry, nested, section_of, template_of
from .template import Free, Template
from .value_types import QUALITY_CLASS, ValueType, either, list_of, not_of_kind, real, table, text

_STEEL = "STEEL"
_DEFINED = ", or a table [materials.{}] with elastic_modulus, poisson_ratio and density; every steel deflects alike"
# with any of these a gear says how thick its teeth are
_THICKNESS = ("span", "over_balls", "tooth_thickness_allowance", "tooth_thickness_tolerance")
_HAND = "helix_angle"
# by its bounds, the value of a number with which the overlap ratio is the largest
_LONGEST: Mapping[str, Callable[[tuple[float, float]], float]] = {
    _HAND: lambda ends: max(map(abs, ends)),
    "face_width": max,
    "module": min,
}
_WITHOUT_FLANKS = "modification", "coast_modification", "quality_class"

_ThicknessKeys = section_of(ToothThickness, most=(("teeth_spanned", 1000),))
_ProfileKeys = section_of(ToothProfile)
_GearKeys = section_of(Gear, ("material", "tooth_thickness_allowance"))
_RingKeys = section_of(RingGear, ("material",))

_BACKLASH = Number("um", low=0.0)
MATERIAL = either(text(), nested(Material), "the name of a material, or a table")
Materials = Mapping[str, Template]


def _modification(key: str, value: Any) -> Template | FlankFileSection:
    given = table().read(key, value)
    if given.get("type") == "file":
        return decode(key, {name: item for name, item in given.items() if name != "type"}, FlankFileSection)
    return nested(AbstractModification).read(key, given)


_MODIFICATIONS = list_of(ValueType("a table", _modification), empty=True)


class _FlankKeys(FileTable):
    material: str | Template | None = entry(MATERIAL)
    quality_class: int | None = entry(QUALITY_CLASS)
    modification: list[Template | FlankFileSection] = entry(_MODIFICATIONS, [])
    coast_modification: list[Template | FlankFileSection] | None = entry(_MODIFICATIONS)


class GearSection(_FlankKeys, _ProfileKeys, _ThicknessKeys, _GearKeys):  # type: ignore[misc, valid-type]
    """A gear and the modifications of its flanks.

    The tooth thickness is given in one of three ways: as the allowance E_sns, with the tolerance T_sn down to E_sni
    where there is one; as the span W_k over so many teeth; as the dimension over balls. A list of two is lower and
    upper limit, between which the tooth is in the middle. Diameters of root and root form and the height of a chamfer
    may stand in place of the coefficients of the rack and of the tip form diameter.

    Attributes:
        helix_angle: beta on the reference cylinder, positive for a right hand; a spur gear without it. Module, pressure
            angle and coefficients are then those of the normal section. Pinion and wheel have opposite hands, a planet
            and its ring gear the same: that of one of them is enough, and a variable stands in one of them; where both
            are given they must agree.
        tooth_thickness_allowance: E_sns on the reference cylinder, negative for backlash, or [E_sni, E_sns].
        span: base tangent length W_k over `teeth_spanned` teeth, or its limits.
        teeth_spanned: k.
        over_balls: dimension M_dK over two balls or pins of `ball_diameter`, or its limits.
        ball_diameter: D_M.
        material: name in [materials], "STEEL", or elastic constants.
        quality_class: flank tolerance class of ISO 1328-1, of [tolerance], [layout] and the charts.
        modification: modifications of both flanks of every tooth, or of the drive flanks alone where the coast flanks
            have their own; several add up.
        coast_modification: modifications of the coast flanks, which carry a negative `load.torque`; an empty list for
            involutes, those of the drive flanks without it. No other command sees them.
    """

    source = Gear


class RingSection(_FlankKeys, _RingKeys):  # type: ignore[misc, valid-type]
    """A ring gear in place of the wheel, and the modifications of its flanks.

    Attributes:
        material, quality_class, modification, coast_modification: as of a gear.
    """

    source = RingGear


class PlanetSection(GearSection):
    """The planets of a stage, and the modifications of their flanks.

    Attributes:
        modification: modifications of both flanks of every tooth, or of those that carry with the sun alone where the
            others have their own.
        ring_modification: modifications of the flanks that carry with the ring; an empty list for involutes, those of
            `modification` without it.
    """

    ring_modification: list[Template | FlankFileSection] | None = entry(_MODIFICATIONS)


AnyGear = GearSection | RingSection


class PairSection(section_of(GearPair, ("pinion", "wheel"))):  # type: ignore[misc]
    """Pinion (driving) and wheel (driven) on their centre distance.

    Attributes:
        backlash: backlash on the line of action, of helical gears normal to the flanks, by the tooth thickness of the
            gears without a thickness of their own, or by the centre distance where both have one.
    """

    backlash: float | Free | None = entry(real(_BACKLASH, open=True))


def materials_of(given: Mapping[str, Template] | None) -> Materials:
    """The materials of a file by their names, with the library's."""
    if given and _STEEL in given:
        raise DesignFileError(f"materials.{_STEEL}", "is a material of the library, choose another name")
    return {_STEEL: Template(Material, {}, "material"), **(given or {})}


def flank_of(section: AnyGear, folder: Path, gear: Template, *, coast: bool) -> list[Template]:
    """The modifications of the drive or coast flanks of a gear; paths begin in the folder."""
    own = section.coast_modification if coast else None
    given = section.modification if own is None else own
    has_files = any(isinstance(each, FlankFileSection) for each in given)
    base_radius = float(gear.build({}).base_radius) if has_files and not gear.free() else None
    internal = isinstance(section, RingSection)
    return [
        flank_template(each, folder, base_radius, internal) if isinstance(each, FlankFileSection) else each
        for each in given
    ]


def drawing_of(section: AnyGear) -> dict[str, Any]:
    """Name of the material and measured tooth thickness of a gear as given in the file, by name and unit.

    Limits are a list of the lower and the upper one.
    """
    given, units = section.fields, fields_of(ToothThickness)
    found: dict[str, Any] = {} if isinstance(section.material, Template) else {"material": section.material or _STEEL}
    names = (name for name in units if name in given and not isinstance(given[name], Free))
    return found | {UnitKey(name, units[name].unit): given[name] for name in names}


def check_pitches(*sections: AnyGear) -> None:
    """Raise for a diametral pitch if either gear is helical: it could be transverse or normal."""
    for section in sections:
        if section.written.get("module") == PITCH and any(each.helix_angle for each in sections):
            problem = f"may be that of the transverse section: give {NORMAL_PITCH}, which is it / cos(helix_angle)"
            raise DesignFileError(f"{section.key}.{PITCH}", problem)


def fixed_gear(section: GearSection, materials: Materials) -> Gear:
    """A gear of numbers, whose flanks do not count."""
    check_pitches(section)
    for name in _WITHOUT_FLANKS:
        if name in section.fields:
            raise DesignFileError(f"{section.key}.{name}", "has no effect, only pinion and wheel have flanks")
    return _fixed(gear_template(section, materials))


def gear_template(section: AnyGear, materials: Materials) -> Template:
    """A gear without its modifications."""
    gear = template_of(section, section.source, without=("material",))
    if section.material is not None:
        gear = gear.having(material=_material(f"{section.key}.material", section.material, materials))
    if isinstance(section, RingSection):
        return gear
    drawn = {**template_of(section, ToothThickness).fields, **template_of(section, ToothProfile).fields}
    # without any measure of a drawing the gear is the library's: messages then name its own fields
    return replace(gear.having(**drawn), make=drawn_gear if drawn else Gear)


def _material(key: str, given: str | Template, materials: Materials) -> Template:
    if isinstance(given, Template):
        return given
    if given not in materials:
        known = suggestion(given, materials)
        problem = f'"{given}" is not known, {known}' + _DEFINED.format(given) * (not known.startswith("did"))
        raise DesignFileError(key, problem)
    return materials[given]


def fixed_material(section: FileTable, given: str | Template | None, materials: Materials) -> Material:
    """Material without variables, by its name or its table; steel for None."""
    return _fixed(_material(f"{section.key}.material", _STEEL if given is None else given, materials))


def _fixed(part: Template) -> Any:
    for free in part.free():
        raise DesignFileError(free.key, not_of_kind("a number", free.name))
    return part.build({})


def pair_of(section: PairSection, pinion: Template, wheel: Template) -> Template:
    """Template of the pair of two gears, with the keys of its table."""
    _check_alike(pinion, wheel)
    gears = _of_opposite_hands({"pinion": pinion, "wheel": wheel})
    pair = Template(GearPair, gears, section.key).having(**template_of(section, GearPair).fields)
    if section.backlash is None:
        return pair
    open_gears = [name for name in ("pinion", "wheel") if not set(pair.fields[name].fields) & set(_THICKNESS)]
    if not open_gears and section.center_distance is not None:
        problem = "has no effect, centre distance and tooth thickness of both gears are given"
        raise DesignFileError("pair.backlash", problem)
    for name in open_gears:
        if cut := {"root_diameter", "root_form_diameter"} & set(pair.fields[name].fields):
            problem = f"would thin the {name}, whose {min(cut)} is that of the thin tooth: give its tooth thickness"
            raise DesignFileError("pair.backlash", problem)
    by = {0: "center_distance", 1: open_gears[-1] if open_gears else "", 2: "both"}[len(open_gears)]
    return replace(pair.having(backlash=as_field(section.backlash, _BACKLASH), by=by), make=pair_with_backlash)


def _check_alike(pinion: Template, wheel: Template) -> None:
    """Raise for gears of different racks, which explains further errors of their numbers."""
    for name in ("module", "pressure_angle"):
        first, second = (gear.fields.get(name) for gear in (pinion, wheel))
        if first is None or second is None or isinstance(first, Free) or isinstance(second, Free):
            continue
        if float(first) != float(second):
            unit = fields_of(Gear)[name].unit
            problem = f"{float(second):g} {unit} must equal the pinion's, {float(first):g} {unit}"
            raise DesignFileError(f"{wheel.key}.{name}", problem)


def _of_opposite_hands(gears: dict[str, Template]) -> dict[str, Template]:
    """Both gears with opposite helix angles, ring gears with the same; the file may give one, spur gears none."""
    angles = {name: gear.fields[_HAND] for name, gear in gears.items() if _HAND in gear.fields}
    free = [name for name, angle in angles.items() if isinstance(angle, Free)]
    if len(angles) == len(gears) and free:
        other = "wheel" if free[0] == "pinion" else "pinion"
        problem = f"has no effect, {free[0]}.{_HAND} is a variable and that of the {other} follows from it"
        raise DesignFileError(f"{gears[other].key}.{_HAND}", problem)
    if len(angles) != 1:
        return gears
    (own, angle), *_ = angles.items()
    if gears["wheel"].make is not RingGear:
        angle = replace(angle, opposite=True) if isinstance(angle, Free) else -angle
    return {name: gear if name == own else gear.having(**{_HAND: angle}) for name, gear in gears.items()}


def longest_path(pair: GearPair, part: Template, bounds: Mapping[str, tuple[float, float]]) -> GearPair:
    """Pair with the values of its free numbers that give the largest overlap ratio.

    Args:
        pair: pair with all variables in the middle of their bounds.
        part: template of the pair, with its free numbers.
        bounds: (low, high) of every free parameter.
    """
    made = {}
    for name, gear in zip(("pinion", "wheel"), pair.gears):
        ends = {
            field: _LONGEST[field](bounds[value.name])
            for field, value in part.fields[name].fields.items()
            if field in _LONGEST and isinstance(value, Free)
        }
        made[name] = changed(gear, **{field: real_number(end) for field, end in ends.items()})
    return changed(pair, **made)


def quality_of(pinion: GearSection, wheel: AnyGear) -> list[int] | None:
    """Flank tolerance classes of both gears; None if the gears have none."""
    given = {"pinion": pinion.quality_class, "wheel": wheel.quality_class}
    missing = [name for name, number in given.items() if number is None]
    if len(missing) == 1:
        raise DesignFileError(f"{missing[0]}.quality_class", "missing, the other gear has one")
    return None if missing else [number for number in given.values() if number is not None]


def with_quality(section: Any, own: list[int] | None) -> Any:
    """Table with quality classes: its own, or those of the gears."""
    key = f"{section.key}.quality_class"
    if section.quality_class is None:
        if own is None:
            raise DesignFileError(key, "missing, this key is required where the gears have none")
        return section.changed(quality_class=own)
    if own is not None:
        raise DesignFileError(key, "has no effect, the gears have classes of their own: take one of them out")
    return section


def both_classes(given: int | list[int] | None) -> tuple[int, int]:
    """Classes of pinion and wheel from the key `quality_class` of a table."""
    assert given is not None
    first, second = given if isinstance(given, list) else (given, given)
    return first, second
