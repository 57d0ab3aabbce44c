"""Reads a planetary stage from a REXS file: sun, planets, ring, what holds and drives, and its load.

A `planetary_stage` has a cylindrical stage for every mesh of a planet with sun and ring. Shafts tell the members apart:
the fixed one is coupled to the casing, the driving one has an external load. What REXS has no place for stands in
attributes of the stage of its own, "custom_jaxgear_" and the key of the table [stage].
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import equinox as eqx
import numpy as np

from ..geometry import GearPair
from ..io.errors import DesignFileError, naming
from ..io.tables import further_tables
from ..io.toml import content
from ..io.value_types import ValueType
from ..microgeometry import AbstractModification
from .forms import parse
from .gears import is_internal
from .model import CUSTOM, Component, Model
from .open_numbers import Completed
from .read import (
    Stage,
    case_of,
    chosen_id,
    loaded_side,
    log_completed,
    number_of_case,
    quality_of,
    read_pair,
    title_of,
)

PLANETARY = "planetary_stage"
MEMBERS = "sun", "ring", "carrier"
ANGLE = "rotating_angle_around_neg_u_axis"
GEARS = "sun", "planet", "ring"
# keys of the table [stage] that REXS says by components
BY_PARTS = "planets", "angles", "fixed", "driving"
_COUPLINGS = "coupling", "switchable_coupling"
_OTHER_SIDE = {"left": "right", "right": "left", None: None}
_EQUAL = 1e-6  # deg, by which angles of equal places are rounded


@dataclass(frozen=True)
class RexsPlanetaryStage:
    """Planetary stage of a REXS file.

    Attributes:
        title: name of the model, "" where it has none.
        pairs: pairs of sun and planet and of planet and ring.
        flanks: modifications of the flanks by the names sun, planet_to_sun, planet_to_ring and ring.
        stage: values of the table [stage] of a design file by their keys.
        torque: torque on the driving member [N m], None if the file gives none.
        speed: speed of the driving member [rpm], None if the file gives none.
        quality_classes: flank tolerance classes of sun, planet and ring (ISO 1328-1:2013), None where a gear has none.
    """

    title: str
    pairs: tuple[GearPair, GearPair]
    flanks: Mapping[str, AbstractModification]
    stage: Mapping[str, Any]
    torque: float | None
    speed: float | None
    quality_classes: tuple[int, int, int] | None


def read_rexs_stage(
    path: str | Path,
    *,
    stage: int | None = None,
    flank: Literal["left", "right"] | None = None,
    load_case: int | None = None,
    given: Mapping[str, float] | None = None,
) -> RexsPlanetaryStage:
    """Read a planetary stage from a REXS file, see `read_rexs`; all planets have to be alike.

    Args:
        path: file, see `read_rexs`.
        stage: id of the planetary stage, needed if the file has several.
        flank: side of the sun's flanks that touch; the ring's mesh touches with the other flanks of the planets.
        load_case: id of the load case, needed if the file has several.
        given: numbers in place of the file's, by their keys in a design file: those of `read_rexs`, of sun, planet and
            ring, and "stage.KEY" for the numbers of the table [stage].

    Raises:
        DesignFileError: as of `read_rexs`; for planets that differ, and numbers of the stage that are missing.
    """
    file = Path(path)
    with naming(file):
        model = parse(content(file))
        stages = [part.id for part in model.components.values() if part.type == PLANETARY]
        if not stages:
            raise DesignFileError("", f"has no {PLANETARY}")
        chosen = model.component(chosen_id(PLANETARY, "stage", stages, stage))
        completed = completed_of_stage(given or {})
        found = read_planetary(model, chosen, flank, load_case, completed)
    log_completed(file, model, completed)
    return found


def completed_of_stage(given: Mapping[str, float]) -> Completed:
    """Numbers beside those of a file, by the keys of a file of a stage."""
    return Completed(given, GEARS, tuple(f"stage.{name}" for name, kind in stage_keys().items() if not kind.container))


def stage_keys() -> dict[str, ValueType]:
    """Numbers of the table [stage] that REXS has no place for, by their keys."""
    table = further_tables().get("stage")
    if table is None:
        raise DesignFileError("", "has a planetary stage, for which no table [stage] is known")
    return {name: kind for name, kind in table.keys.items() if name not in BY_PARTS}


def read_planetary(
    model: Model, stage: Component, flank: str | None, load_case: int | None, completed: Completed
) -> RexsPlanetaryStage:
    """The stage of a component, see `read_rexs_stage`."""
    meshes = meshes_of(model, stage)
    side, other = _sides(model, meshes, flank)
    pairs = [_pairs(model, mesh, side, other, completed) for mesh in meshes]
    inner, outer = pairs[0]
    for mesh, (one, two) in zip(meshes, pairs):
        if not eqx.tree_equal(_numbers(one, two), _numbers(inner, outer)):
            raise mesh.planet.refuse("", f"differs from planet {meshes[0].planet.id}: all planets must be alike")
    to_sun, to_ring = inner.modifications, outer.modifications
    shafts = _shafts(model, stage, meshes[0])
    order, angles = _places(model, meshes, side)
    case = case_of(model, load_case)
    fixed, (driving, torque) = _fixed(model, shafts, completed), _driving(model, case, shafts, completed)
    if fixed == driving:
        raise stage.refuse("", f"the {fixed} is coupled to the casing, must not be the member with the external load")
    numbers: dict[str, Any] = {"planets": len(meshes), "fixed": fixed, "driving": driving}
    numbers |= {} if angles is None else {"angles": angles}
    numbers |= _stage_numbers(stage, order, completed)
    classes = [quality_of(each.gears) for each in (inner, outer)]
    return RexsPlanetaryStage(
        title=title_of(model),
        pairs=(inner.pair, outer.pair),
        flanks=dict(zip(("sun", "planet_to_sun", "planet_to_ring", "ring"), (*to_sun, *to_ring))),
        stage=numbers,
        torque=torque,
        speed=number_of_case(model, case, shafts[driving], "rotational_speed", "1 / min"),
        quality_classes=None if classes[0] is None or classes[1] is None else (*classes[0], classes[1][1]),
    )


class PlanetMeshes(NamedTuple):
    """Components of one planet: its meshes with sun and ring, which are cylindrical stages, and the gears."""

    at_sun: Component
    at_ring: Component
    sun: Component
    planet: Component
    ring: Component


def meshes_of(model: Model, stage: Component) -> list[PlanetMeshes]:
    """The meshes of every planet, in the order of the meshes with the sun.

    Raises:
        DesignFileError: for anything else than one sun and one ring that mesh with every planet.
    """
    inside: list[tuple[Component, list[Component]]] = []
    outside: list[tuple[Component, list[Component]]] = []
    for part in model.related("assembly", "assembly", stage.id, "part"):
        if part.type == "cylindrical_stage":
            gears = [gear for role in ("gear_1", "gear_2") for gear in model.related("stage", "stage", part.id, role)]
            (outside if any(map(is_internal, gears)) else inside).append((part, gears))
    with_ring = {gear.id: (part, gears) for part, gears in outside for gear in gears if not is_internal(gear)}
    found = []
    for part, gears in inside:
        planets = [gear for gear in gears if gear.id in with_ring]
        suns = [gear for gear in gears if gear.id not in with_ring]
        if len(planets) == len(suns) == 1:
            at_ring, others = with_ring[planets[0].id]
            ring = next(gear for gear in others if is_internal(gear))
            found.append(PlanetMeshes(part, at_ring, suns[0], planets[0], ring))
    ids = [{gear.id for gear in gears} for gears in ([m.sun for m in found], [m.ring for m in found])]
    if not found or [len(each) for each in ids] != [1, 1] or not len(found) == len(inside) == len(outside):
        problem = f"must be one sun and one ring that mesh with every planet, has {len(inside)} meshes without and "
        raise stage.refuse("", f"{problem}{len(outside)} with a ring gear, {len(found)} planets with both")
    return found


def _sides(model: Model, meshes: list[PlanetMeshes], flank: str | None) -> tuple[str | None, str | None]:
    """Sides of the flanks that touch in the meshes with the sun and with the ring; None where the file says nothing."""
    one = meshes[0]
    at_sun, at_ring = (
        loaded_side(model, mesh, gears)
        for mesh, gears in ((one.at_sun, [one.sun, one.planet]), (one.at_ring, [one.planet, one.ring]))
    )
    if flank is not None:
        return flank, _OTHER_SIDE[flank]
    if at_sun is not None and at_sun == at_ring:
        problem = f"{at_sun} must be the other side than that of {one.at_sun.where()}: a planet works with both flanks"
        raise one.at_ring.refuse("loaded_tooth_flank", problem)
    side = at_sun or _OTHER_SIDE[at_ring]
    return side, _OTHER_SIDE[side]


def _pairs(
    model: Model, mesh: PlanetMeshes, side: str | None, other: str | None, completed: Completed
) -> tuple[Stage, Stage]:
    """Both pairs of a planet, whose face coordinates go by the side of the flanks of the sun."""
    inner = read_pair(model, mesh.at_sun, [mesh.sun, mesh.planet], side, completed, ("sun", "planet"))
    gears = [inner.gears[1], mesh.ring]
    return inner, read_pair(model, mesh.at_ring, gears, other, completed, ("planet", "ring"), seen=side)


def _numbers(inner: Stage, outer: Stage) -> tuple[Any, ...]:
    return inner.pair, inner.modifications, outer.pair, outer.modifications


def _shafts(model: Model, stage: Component, mesh: PlanetMeshes) -> dict[str, list[int]]:
    """Ids of gear and shafts of every member."""
    found = {}
    for name, gear in (("sun", mesh.sun), ("ring", mesh.ring)):
        on = [part for part in model.related("assembly", "part", gear.id, "assembly") if part.type == "shaft"]
        found[name] = [gear.id, *(part.id for part in on)]
    carrier = model.related("planet_carrier_shaft", PLANETARY, stage.id, "shaft")
    return found | {"carrier": [part.id for part in carrier]}


def _places(model: Model, meshes: list[PlanetMeshes], side: str | None) -> tuple[list[int], list[float] | None]:
    """Order of the planets along the sense in which the torque on the sun acts, and their angles [deg], None if equal.

    Angles of the file turn about the negative u axis. Seen from a datum face at negative coordinates a sun that drives
    with its left flanks turns that way.
    """
    given = [mesh.at_sun.number(ANGLE, "deg") for mesh in meshes]
    known = [angle for angle in given if angle is not None]
    if len(known) < len(given):
        return [*range(len(given))], None
    datum = meshes[0].sun.choice("datum_face_orientation", "negative", ["negative", "positive"])
    sense = -1 if (side == "right") == (datum == "negative") else 1
    sense = 1 if side is None else sense
    relative = (sense * (np.asarray(known) - known[0]) + 0.5 * _EQUAL) % 360 - 0.5 * _EQUAL
    order = np.argsort(relative)
    equal = np.allclose(relative[order], 360 / len(known) * np.arange(len(known)), rtol=0, atol=_EQUAL)
    if equal and (side is None or abs(known[0]) < _EQUAL):
        return order.tolist(), None
    if side is None:
        problem = "are not those of equal places, choose left or right (flank): planets count the way the sun is driven"
        raise meshes[0].at_sun.refuse(ANGLE, problem)
    return order.tolist(), [float(sense * known[0] + angle) for angle in relative[order]]


def _fixed(model: Model, shafts: Mapping[str, list[int]], completed: Completed) -> str:
    """The member that a coupling holds in the casing."""
    held = set(_coupled(model))
    found = [name for name in MEMBERS if held.intersection(shafts[name])]
    if len(found) > 1:
        raise DesignFileError("", f"couples {' and '.join(found)} to the casing, must be one of them")
    if not found:
        completed.say("stage.fixed", "ring", "no member is coupled to the casing")
    return found[0] if found else "ring"


def _coupled(model: Model) -> Iterator[int]:
    """Ids of all parts that a coupling connects with the casing."""
    for relation in model.relations:
        parts = {role: model.component(number) for role, number in relation.refs}
        if relation.type == "side" and "assembly" in parts and parts["assembly"].type in _COUPLINGS:
            sides = [part for role, part in parts.items() if role != "assembly"]
            if any(part.type == "gear_casing" for part in sides):
                yield from (part.id for part in sides if part.type != "gear_casing")


def _driving(
    model: Model, case: dict[int, Component], shafts: Mapping[str, list[int]], completed: Completed
) -> tuple[str, float | None]:
    """The member with an external load, and its torque [N m]."""
    found = {}
    for name, ids in shafts.items():
        parts = [part for number in ids for part in model.related("assembly", "assembly", number, "part")]
        loads = [part.id for part in parts if part.type == "external_load"]
        torque = number_of_case(model, case, loads, "torque_around_u_axis", "N m")
        if torque:
            found[name] = torque, any(model.component(number).flag("defines_torque", False) for number in loads)
    chosen = [name for name, (_, defines) in found.items() if defines] or [*found]
    if len(chosen) != 1:
        why = "external loads on several members" if chosen else "no external load on a member"
        completed.say("stage.driving", "sun", why)
        return "sun", None
    return chosen[0], found[chosen[0]][0]


def _stage_numbers(stage: Component, order: list[int], completed: Completed) -> dict[str, Any]:
    """Numbers that REXS has no place for, of attributes of their own or given; lists in the order of the planets."""
    found: dict[str, Any] = {}
    missing = []
    for name, kind in stage_keys().items():
        attribute, number = f"{CUSTOM}{name}", kind.number
        unit = (number.unit if number else "") or "none"
        if (key := f"stage.{name}") in completed.given:
            found[name] = completed.given[key]
            completed.say(key, found[name], "given")
        elif attribute in stage.attributes:
            found[name] = stage.needed(attribute, unit) if kind.container is None else None
            if kind.container is not None:
                values = stage.numbers(attribute, unit)
                if len(values) != len(order):
                    raise stage.refuse(attribute, f"has {len(values)} numbers, must have one for each planet")
                found[name] = values[order].tolist()
        elif kind.default is ...:
            missing.append(key)
            continue
        else:
            continue
        if number is not None and number.whole and found[name] == round(found[name]):
            found[name] = int(found[name])
    if missing:
        options = " ".join(f"--set {key}=VALUE" for key in missing)
        raise stage.refuse("", f"{', '.join(missing)} missing, REXS has no place for them: give {options}")
    return found
