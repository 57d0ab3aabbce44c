"""Write a planetary stage with the modifications of its flanks and its load as a REXS file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import GearPair
from ..microgeometry import AbstractModification
from ..numerics import check
from .flanks import write_modification
from .frame import frames
from .gears import write_gear
from .model import CUSTOM, Component, Model
from .planetary import BY_PARTS, GEARS, MEMBERS, PLANETARY, stage_keys
from .write import CASE, check_pair, new_model, write_mesh, write_model, write_stage

_SIDES = "right", "left"  # of the flanks that touch with the sun, which is driven about the u axis, and with the ring


def write_rexs_stage(
    path: str | Path,
    sun_planet: GearPair,
    planet_ring: GearPair,
    *,
    stage: Mapping[str, Any],
    flanks: Mapping[str, AbstractModification],
    torque: float | None = None,
    speed: float | None = None,
    quality_classes: tuple[int, int, int] | None = None,
    title: str = "",
    error: float = 0.01,
) -> None:
    """Write a planetary stage as a REXS 2.0 file atomically, in place of an earlier one.

    Every planet has a gear, a shaft and two meshes of its own, at its angle. The fixed member is coupled to the casing,
    the driving one has an external load. Both flanks of sun and ring are modified alike; right flanks of the planets
    touch the sun, left ones the ring. Numbers of the stage that REXS has no place for are written in attributes of the
    stage, "custom_jaxgear_" and their keys.

    Args:
        path: file, see `write_rexs`.
        sun_planet, planet_ring: the pairs.
        stage: values of the table [stage] of a design file by their keys.
        flanks: modifications of the flanks by the names sun, planet_to_sun, planet_to_ring and ring.
        torque: torque on the driving member [N m].
        speed: speed of the driving member [rpm].
        quality_classes: flank tolerance classes of sun, planet and ring (ISO 1328-1:2013).
        title: free text.
        error: permissible deviation of the points that represent a curve unknown to REXS [um].

    Raises:
        ValueError: as of `write_rexs`.
    """
    check("error", error, "um", low=0.0, open_low=True)
    for pair in (sun_planet, planet_ring):
        check_pair(pair, "write_rexs_stage")
    model, unit = new_model(title)
    numbers: dict[str, Any] = _own_numbers(stage)
    whole = model.add(PLANETARY, **numbers)
    model.relate("assembly", assembly=unit, part=whole)
    shafts = _members(model, unit, whole, str(stage.get("fixed") or "ring"))
    classes = dict(zip(GEARS, quality_classes or ()))
    of_sun, of_ring = frames(sun_planet), frames(planet_ring)

    def gear(which: str, name: str, shaft: Component, *modified: tuple[Any, str, tuple[int, ...]]) -> Component:
        part, both = write_gear(model, _gears[which], name, classes.get(which))
        model.relate("assembly", assembly=shaft, part=part)
        for frame, flank, at in modified:
            options: dict[str, Any] = {"owner": f"write_rexs_stage: {flank}", "error": error}
            write_modification(model, [both[place] for place in at], frame, flanks[flank], **options)
        return part

    _gears = dict(zip(GEARS, (*sun_planet.gears, planet_ring.wheel)))
    sun = gear("sun", "sun", shafts["sun"], (of_sun[0], "sun", (0, 1)))
    ring = gear("ring", "ring", shafts["ring"], (of_ring[1], "ring", (0, 1)))
    sides = (of_sun[1], "planet_to_sun", (1,)), (of_ring[0], "planet_to_ring", (0,))
    for number, angle in enumerate(_angles(stage)):
        shaft = model.add("shaft", f"planet {number + 1}")
        model.relate("assembly", assembly=unit, part=shaft)
        model.relate("planet_shaft", planetary_stage=whole, shaft=shaft)
        planet = gear("planet", f"planet {number + 1}", shaft, *sides)
        write_mesh(model, write_stage(model, whole, sun_planet, -angle), [sun, planet], side=_SIDES[0])
        write_mesh(model, write_stage(model, whole, planet_ring, 180 - angle), [planet, ring], side=_SIDES[1])
    _load(model, shafts[str(stage.get("driving") or "sun")], torque, speed)
    write_model(model, path)


def _angles(stage: Mapping[str, Any]) -> list[float]:
    """Places of all planets [deg]."""
    planets = int(stage["planets"])
    given = stage.get("angles")
    return [float(angle) for angle in (360 / planets * np.arange(planets) if given is None else given)]


def _own_numbers(stage: Mapping[str, Any]) -> dict[str, tuple[Any, str]]:
    kinds = {name: kind for name, kind in stage_keys().items() if stage.get(name) is not None}
    units = {name: kind.number.unit if kind.number else "" for name, kind in kinds.items()}
    return {
        f"{CUSTOM}{name}": (np.asarray(stage[name]) if kind.container else stage[name], units[name] or "none")
        for name, kind in kinds.items()
        if name not in BY_PARTS
    }


def _members(model: Model, unit: Component, whole: Component, fixed: str) -> dict[str, Component]:
    """Shafts of sun, ring and carrier; the fixed one is coupled to the casing."""
    shafts = {name: model.add("shaft", name) for name in MEMBERS}
    carrier = model.add("planet_carrier")
    model.relate("assembly", assembly=whole, part=carrier)
    casing = model.add("gear_casing")
    model.relate("assembly", assembly=unit, part=casing)
    for name, shaft in shafts.items():
        model.relate("assembly", assembly=unit, part=shaft)
        kind = "planet_carrier_shaft" if name == "carrier" else "central_shaft"
        model.relate(kind, planetary_stage=whole, shaft=shaft)
    model.relate("assembly", assembly=carrier, part=shafts["carrier"])
    coupling = model.add("coupling", f"{fixed} to casing")
    model.relate("side", assembly=coupling, inner_part=shafts[fixed], outer_part=casing)
    return shafts


def _load(model: Model, shaft: Component, torque: float | None, speed: float | None) -> None:
    """Torque and speed of the driving member."""
    if torque is not None:
        check("torque", torque, "N m", low=0.0)
        load = model.add("external_load", defines_torque=(True, "none"))
        model.relate("assembly", assembly=shaft, part=load)
        model.under_load(CASE, load, torque_around_u_axis=(np.asarray(torque), "N m"))
    if speed is not None:
        check("speed", speed, "rpm", low=0.0)
        model.under_load(CASE, shaft, rotational_speed=(np.asarray(speed), "1 / min"))
