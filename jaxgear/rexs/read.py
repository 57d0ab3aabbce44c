"""Reads a gear pair with its modifications and its load from a REXS file."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from ..geometry import GearPair, diameter, path_of_contact
from ..io.errors import DesignFileError, naming, refused
from ..io.toml import content
from ..microgeometry import AbstractModification, NoModification
from ..numerics import real
from .flanks import read_modification
from .forms import parse
from .frame import Frame, frames
from .gears import QUALITY, is_internal, read_gear, read_quality
from .model import Component, Model
from .open_numbers import FLANK, GEAR, OFFSET, PAIR, STAGE, Completed
from .points import joined

_LOG = logging.getLogger("jaxgear")
_OLDEST, _NEWEST = (1,), (2,)
_MODIFIED = (1, 4)  # since when modifications of flanks are those of today
_ALIKE = 1e-9  # um
_ACTIVE_TIP = "active_tip_diameter"
_TIPS = "tip_diameter", "tip_form_diameter"
_ROUNDED = 5e-3  # mm, by which diameters that another program works out may differ
_LISTED = "; jaxgear convert FILE lists its stages"
_ALONG, _ACROSS = "position_of_profile_modification", "diameter_of_helix_modification"
_GEOMETRY = (
    "normal_pressure_angle",
    "addendum_modification_coefficient",
    "addendum_modification",
    "addendum_coefficient_basic_profile",
)


@dataclass(frozen=True)
class RexsPair:
    """Cylindrical stage of a REXS file.

    Attributes:
        title: name of the model, "" where it has none.
        pair: the gears; gear 1 of the stage is the pinion, which drives; a ring gear is always the wheel.
        pinion, wheel: modifications of the flanks.
        torque: torque on the pinion [N m], None if the file gives none.
        speed: speed of the pinion [rpm], None if the file gives none.
        quality_classes: flank tolerance classes of pinion and wheel (ISO 1328-1:2013), None where a gear has none.
    """

    title: str
    pair: GearPair
    pinion: AbstractModification
    wheel: AbstractModification
    torque: float | None
    speed: float | None
    quality_classes: tuple[int, int] | None


def read_rexs(
    path: str | Path,
    *,
    stage: int | None = None,
    flank: Literal["left", "right"] | None = None,
    load_case: int | None = None,
    given: Mapping[str, float] | None = None,
) -> RexsPair:
    """Read a gear pair from a REXS file in XML or JSON, or in a zip archive of one (.rexsz).

    Modifications of version 1.4 or later are read; a file of an earlier version with modifications is refused.

    Both gears are centred on each other unless an axial offset is given. Numbers of a gear that the file leaves open
    are completed, in files of all versions alike, and logged: the dedendum by the root diameter or else by the basic
    rack of ISO 53, which also gives root radius and addendum; bore and material by the defaults of `Gear`. A
    modification given at other places than the ends of the library's flank is extended to these by its own law.

    Helix angles are positive for a right hand. Left and right flanks are seen from the datum face (ISO 21771): a pinion
    that drives with its right flanks turns clockwise from there. Face coordinates of the library are those of the file
    for a datum face at negative coordinates; their sign changes where the left flanks touch, and again where the datum
    face is at positive coordinates.

    Args:
        path: file; of an archive its one model is read, at most 256 MiB, and nothing is unpacked to the disk.
        stage: id of the cylindrical stage, needed if the file has several.
        flank: side of the flanks that touch, needed if the left and the right ones are modified differently.
        load_case: id of the load case, needed if the file has several.
        given: numbers in place of the file's, by their keys in a design file and in the units there:
            teeth, module, pressure_angle, profile_shift, helix_angle, face_width, addendum, dedendum, root_radius,
            tip_diameter, tip_form_diameter and bore_diameter of pinion and wheel, as "pinion.tip_diameter",
            "pair.center_distance" and "pair.axial_offset". With dedendum and root_radius the tools of the file are not
            read, with face_width chamfered tooth ends are not.

    Raises:
        DesignFileError: for invalid or unsupported content, in one line that names component and attribute:
            protuberance, chamfers, several tools, shapes of a relief without a formula, missing data, other
            units, XML that is not well-formed or declares a document type.
    """
    file = Path(path)
    with naming(file):
        model = parse(content(file))
        completed = Completed(given or {})
        found = _read(model, stage, flank, load_case, completed)
    log_completed(file, model, completed)
    return found


def log_completed(file: Path, model: Model, completed: Completed) -> None:
    """Log the numbers beside those of a file, and where it names no units."""
    said = (part for several in (model.components, *model.cases.values()) for part in several.values())
    if completed.numbers:
        shown = ", ".join(f"{key} = {value}" for key, value in completed.numbers.items())
        _LOG.warning("%s: numbers beside those of the file: %s; --set KEY=VALUE gives others", file, shown)
    silent = list(dict.fromkeys(place for part in said for place in part.without_unit))
    if silent:
        shown = f"{silent[0]}, the first of {len(silent)}" if len(silent) > 1 else silent[0]
        _LOG.warning("%s: names no units, those of the REXS standard are taken: %s", file, shown)


def _read(model: Model, stage: int | None, flank: str | None, load_case: int | None, completed: Completed) -> RexsPair:
    found = read_stage(model, stage, flank, completed)
    torque, speed = _load(model, found.stage, found.gears[0], load_case)
    return RexsPair(title_of(model), found.pair, *found.modifications, torque, speed, quality_of(found.gears))


def title_of(model: Model) -> str:
    """Name of the model, "" where it has none."""
    units = [part for part in model.components.values() if part.type == "gear_unit"]
    return units[0].text("model_name") if units else ""


class Stage(NamedTuple):
    """A stage that is a pair of the library.

    Attributes:
        stage, gears: components; the pinion first.
        pair: the gears.
        modifications: modifications of the flanks of pinion and wheel.
    """

    stage: Component
    gears: list[Component]
    pair: GearPair
    modifications: tuple[AbstractModification, AbstractModification]


def read_stage(model: Model, stage: int | None, flank: str | None, completed: Completed) -> Stage:
    """A stage without its load, see `read_rexs`.

    Raises:
        DesignFileError: where it is no pair of the library.
    """
    chosen = _stage(model, stage)
    gears = _driving_first(model, chosen)
    flank = loaded_side(model, chosen, gears) if flank is None else flank
    return read_pair(model, chosen, gears, flank, completed, PAIR)


def read_pair(
    model: Model,
    stage: Component,
    gears: list[Component],
    flank: str | None,
    completed: Completed,
    names: tuple[str, str],
    seen: str | None = None,
) -> Stage:
    """The pair of both gears of a cylindrical stage.

    Args:
        model: the file.
        stage: the stage.
        gears: its gears, pinion first.
        flank: side of the flanks that touch; None where the file names none.
        completed: numbers beside the file.
        names: names of the gears that keys of a design file begin with.
        seen: side that face coordinates go by, see `read_rexs`; None for that of the flanks.

    Raises:
        DesignFileError: where it is no pair of the library.
    """
    chosen = completed.of("pair", stage, STAGE)
    gears = _with_given(model, gears, completed, names)
    if all(map(is_internal, gears)):
        raise chosen.refuse("", "has two ring gears, must have one at most")
    _check_version(model)
    _check_axes(gears)
    flanks = [_flank(model, gear, flank) for gear in gears]
    pinion, wheel = (read_gear(model, *each, completed) for each in zip(gears, flanks, names))
    distance = abs(chosen.needed("center_distance", "mm"))
    offset = completed.given.get(OFFSET, 0.0)
    if OFFSET in completed.given:
        completed.say(OFFSET, offset, "given")
    pair: GearPair = refused(chosen.where(), GearPair, pinion, wheel, distance, axial_offset=offset)
    pair = _with_active_tips(model, chosen, gears, pair, completed, names)
    width, common = float(pair.face_width), chosen.number("common_face_width", "mm")
    if common is not None and abs(common - width) > 1e-6 * width:
        centred = "" if offset else f": the gears are centred on each other, or give --set {OFFSET}=MM"
        raise chosen.refuse("common_face_width", f"{common:g} mm must be the common one, {width:g} mm{centred}")
    seen = flank if seen is None else seen
    turned = [1, 1] if pair.is_spur else [_mirror(gear, seen) for gear in gears]
    sides = [
        (gear, face, replace(frame, mirror=mirror))
        for gear, face, frame, mirror in zip(gears, flanks, frames(pair), turned)
    ]
    on_pinion, on_wheel = (_modification(model, *side) for side in sides)
    if not pair.is_spur:
        _check_direction(gears, seen, turned, sides, (on_pinion, on_wheel))
    return Stage(chosen, gears, pair, (on_pinion, on_wheel))


def _with_active_tips(
    model: Model,
    stage: Component,
    gears: list[Component],
    pair: GearPair,
    completed: Completed,
    names: tuple[str, str],
) -> GearPair:
    """Pair whose flanks end at the active tip diameters of its stage, unless a tip form diameter is given."""
    said = [[(part, part.number(_ACTIVE_TIP, "mm")) for part in _data(model, stage, gear)] for gear in gears]
    if not any(value for parts in said for _, value in parts):
        return pair
    path = path_of_contact(pair)
    ends = path.pinion_roll_length(path.end), path.wheel_roll_length(path.start)
    for field, name, parts, end in zip(PAIR, names, said, ends):
        gear = getattr(pair, field)
        reached = float(diameter(gear, end))
        for part, value in parts:
            if (
                value is None
                or gear.signed(abs(value) - reached) >= -_ROUNDED
                or any(f"{name}.{tip}" in completed.given for tip in _TIPS)
            ):
                continue
            if gear.tip_form_diameter is not None:
                raise part.refuse(_ACTIVE_TIP, f"{value:g} mm must be {reached:.6g} mm, by the tip form diameter")
            ending = refused(part.where(_ACTIVE_TIP), replace, gear, tip_form_diameter=real(abs(value)))
            pair = refused(part.where(_ACTIVE_TIP), replace, pair, **{field: ending})
            completed.say(f"{name}.tip_form_diameter", value, _ACTIVE_TIP)
    return pair


def _with_given(model: Model, gears: list[Component], completed: Completed, names: tuple[str, str]) -> list[Component]:
    """Pinion and wheel with the given numbers; the flanks in the model get their given numbers too."""
    for owner, gear in zip(names, gears):
        for side in ("left", "right"):
            for flank in model.related("flank", "gear", gear.id, side):
                model.components[flank.id] = completed.of(owner, flank, FLANK)
        model.components[gear.id] = completed.of(owner, gear, GEAR)
    return [model.components[gear.id] for gear in gears]


def quality_of(gears: list[Component]) -> tuple[int, int] | None:
    """Flank tolerance classes of both gears; None where neither has one."""
    first, second = (read_quality(gear) for gear in gears)
    if first is None and second is None:
        return None
    if first is None or second is None:
        raise gears[0 if first is None else 1].refuse(QUALITY, "missing, the other gear has one")
    return first, second


def _stage(model: Model, wanted: int | None) -> Component:
    """The stage of an id, or the only one."""
    stages = {part.id: part for part in model.components.values() if part.type == "cylindrical_stage"}
    if not stages:
        raise DesignFileError("", f"has no cylindrical_stage{_LISTED}")
    return stages[chosen_id("cylindrical_stage", "stage", [*stages], wanted, _LISTED)]


def chosen_id(kind: str, option: str, known: list[int], wanted: int | None, hint: str = "") -> int:
    """The wanted id, or the first one if none is wanted; raises where the choice is open."""
    names = ", ".join(map(str, known)) or "none"
    if wanted is None and len(known) > 1:
        several = f"{len(known)} {kind.replace('_', ' ')}s"
        raise DesignFileError("", f"has {several}, choose one of {names} by its id ({option}){hint}")
    if wanted is not None and wanted not in known:
        raise DesignFileError("", f"has no {kind} {wanted}, must be one of {names}{hint}")
    return known[0] if wanted is None else wanted


def _driving_first(model: Model, stage: Component) -> list[Component]:
    """The gears of a stage: gear 1 and 2, or the other way round where the file says that gear 2 drives.

    A ring gear is always the wheel.
    """
    gears = [_one(model.related("stage", "stage", stage.id, role), stage, role) for role in ("gear_1", "gear_2")]
    drives = [any(part.flag("is_driving_gear", False) for part in _data(model, stage, gear)) for gear in gears]
    inside = [is_internal(gear) for gear in gears]
    if any(inside):
        return gears[::-1] if inside == [True, False] else gears
    return gears[::-1] if drives == [False, True] else gears


def _data(model: Model, stage: Component, gear: Component) -> list[Component]:
    """Components `stage_gear_data` of one gear of the stage."""
    found = model.related("stage_gear_data", "stage", stage.id, "stage_gear_data")
    return [part for part in found if gear in model.related("stage_gear_data", "stage_gear_data", part.id, "gear")]


def loaded_side(model: Model, stage: Component, gears: list[Component]) -> str | None:
    """Side of the flanks that touch; None if the file names none."""
    sides = {part.text("loaded_tooth_flank") for gear in gears for part in _data(model, stage, gear)} - {""}
    if len(sides) > 1:
        raise stage.refuse("loaded_tooth_flank", "differs between its gears, must be the same: left touches left")
    return sides.pop() if sides else None


def _check_axes(gears: list[Component]) -> None:
    """Raise for gears whose axes point in opposite directions."""
    axes = [gear.numbers("u_axis_vector", "mm") for gear in gears if "u_axis_vector" in gear.attributes]
    if len(axes) == 2 and (axes[0].shape != axes[1].shape or not axes[0] @ axes[1] > 0):
        raise gears[1].refuse("u_axis_vector", f"must point in the direction of that of gear {gears[0].id}")


def _check_version(model: Model) -> None:
    version = tuple(int(part) for part in model.version.split("."))
    if version[:2] < _OLDEST or version[:1] > _NEWEST:
        raise DesignFileError("", f"is of REXS {model.version}, must be of 1 to 2")


def _one(found: list[Component], owner: Component, role: str) -> Component:
    if len(found) != 1:
        raise owner.refuse(role, "missing" if not found else f"is {len(found)} components, must be one")
    return found[0]


def _flank(model: Model, gear: Component, wanted: str | None) -> Component:
    """The flank that touches: the wanted one, or any where both are the same."""
    sides = {side: model.related("flank", "gear", gear.id, side) for side in ("left", "right")}
    found = {side: _one(flanks, gear, f"{side} flank") for side, flanks in sides.items() if flanks}
    if not found or (wanted is not None and wanted not in found):
        raise gear.refuse("", f"has no {wanted or 'left or right'} flank in a relation of type flank")
    flanks = list(found.values())
    for name in _GEOMETRY:
        if len({str(flank.attributes.get(name)) for flank in flanks}) > 1:
            raise flanks[0].refuse(name, f"differs from that of flank {flanks[1].id}: teeth must be symmetric")
    if wanted is not None:
        return found[wanted]
    if len(flanks) > 1 and _modification_texts(model, flanks[0]) != _modification_texts(model, flanks[1]):
        problem = f"has other modifications than flank {flanks[1].id}, choose left or right (flank)"
        raise flanks[0].refuse("", problem)
    return flanks[0]


def _modification_texts(model: Model, flank: Component) -> list[str]:
    """Sorted texts of all modifications of a flank, to compare two flanks."""
    parts = model.related("reference", "origin", flank.id, "referenced")
    return sorted(f"{part.type} {sorted(part.attributes.items())}" for part in parts)


def _modification(model: Model, gear: Component, flank: Component, frame: Frame) -> AbstractModification:
    """The sum of the modifications of a flank."""
    parts = model.related("reference", "origin", flank.id, "referenced")
    if parts and tuple(int(part) for part in model.version.split("."))[:2] < _MODIFIED:
        raise parts[0].refuse("", f"is a modification of REXS {model.version}, must be of 1.4 or later")
    for name in (_ALONG, _ACROSS):
        places = {part.number(name, "mm"): part for part in parts if name in part.attributes}
        if len(places) > 1:
            raise list(places.values())[1].refuse(
                name, "differs from that of another part: one place must hold for all"
            )
    for part in parts:
        if len(parts) > 1 and not part.flag("is_additive_modification", True):
            raise part.refuse("is_additive_modification", "must be true beside other modifications")
    frame = replace(frame, datum=_datum(gear))
    total = _sum(parts, frame)
    if "datum_face_orientation" not in gear.attributes:
        if _differ(frame, total, _sum(parts, replace(frame, datum=1))):
            raise gear.refuse("datum_face_orientation", "missing, the ends of the face are modified differently")
    return total


def _differ(frame: Frame, one: AbstractModification, other: AbstractModification, sign: int = 1) -> bool:
    """True if two modifications differ, the second one at face coordinates times `sign`."""
    roll, face = np.meshgrid(np.linspace(frame.start, frame.tip, 33), np.linspace(-0.5, 0.5, 61) * frame.width)
    return bool(np.abs(frame.removed(one, roll, face) - frame.removed(other, roll, sign * face)).max() > _ALIKE)


def _datum(gear: Component) -> int:
    """Sign of the face coordinate of the datum face: -1 or 1."""
    return -1 if gear.choice("datum_face_orientation", "negative", ["negative", "positive"]) == "negative" else 1


def _mirror(gear: Component, flank: str | None) -> int:
    """The sign of face coordinates, see `read_rexs`."""
    return _datum(gear) if flank == "left" else -_datum(gear)


def _check_direction(
    gears: list[Component],
    flank: str | None,
    turned: list[int],
    sides: list[tuple[Component, Component, Frame]],
    modifications: tuple[AbstractModification, AbstractModification],
) -> None:
    """Raise for helical gears with uneven ends of the face whose loaded flank or orientation is ambiguous."""
    uneven = [
        gear
        for (gear, _, frame), modification in zip(sides, modifications)
        if _differ(frame, modification, modification, -1)
    ]
    if uneven and flank is None:
        problem = (
            "modifies the ends of its face differently, choose left or right (flank): a helical gear meets one first"
        )
        raise uneven[0].refuse("", problem)
    if uneven and turned[0] != turned[1]:
        problem = f"must be that of gear {gears[0].id}: the same flanks of helical gears are seen from there"
        raise gears[1].refuse("datum_face_orientation", problem)


def _sum(parts: list[Component], frame: Frame) -> AbstractModification:
    terms = joined(term for part in parts for term in read_modification(part, frame))
    return reduce(add, terms) if terms else NoModification()


def _load(model: Model, stage: Component, pinion: Component, wanted: int | None) -> tuple[float | None, float | None]:
    """Torque [N m] and speed [rpm] of the pinion."""
    case = case_of(model, wanted)
    data = [part.id for part in _data(model, stage, pinion)]
    shafts = [part.id for part in model.related("assembly", "part", pinion.id, "assembly") if part.type == "shaft"]
    torque = number_of_case(model, case, data, "torque", "N m")
    speed = number_of_case(model, case, [pinion.id, *shafts], "rotational_speed", "1 / min")
    return torque, speed


def case_of(model: Model, wanted: int | None) -> dict[int, Component]:
    """Components under the load case of an id, or the only one; empty for a file without load cases."""
    none = wanted is None and not model.cases
    return {} if none else model.cases[chosen_id("load_case", "load_case", [*model.cases], wanted)]


def number_of_case(model: Model, case: dict[int, Component], ids: list[int], name: str, unit: str) -> float | None:
    """Absolute value of a number of the first component that has it, in the load case or else outside it."""
    for number in ids:
        for part in (case.get(number), model.component(number)):
            value = None if part is None else part.number(name, unit)
            if value is not None:
                return abs(value)
    return None
