"""Writes a gear pair with its modifications, its load and what a loaded tooth contact has found as a REXS file."""

from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ...contact import MeshCycle
from ...contact.status import reason
from ...geometry import GearPair
from ...microgeometry import AbstractModification
from ...numerics import check
from ...numerics.durable import write_durably
from ..folder import writing
from .container import SUFFIXES, packed
from .gears import write_gear
from .json_form import to_json
from .results import write_results
from .rexs_model import Model, xml
from .values import frames
from .write_flank import Writer

_VERSION = "2.0.0"
_JSON = (".rexsj", ".json")
_CASE = 1


def write_rexs(
    path: str | Path,
    pair: GearPair,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    torque: float | None = None,
    speed: float | None = None,
    cycle: MeshCycle | None = None,
    friction: float | None = None,
    quality_classes: tuple[int, int] | None = None,
    materials: tuple[str | None, str | None] | None = None,
    title: str = "",
    error: float = 0.01,
) -> None:
    """Writes a REXS 2.0 file. It appears as a whole or not at all, in place of an earlier one.

    What the pair leaves open, tip diameters and centre distance, is written as the numbers that it means; a bore that
    is left open is left out. Both flanks of a tooth are modified alike. What REXS has no place for, the radius of the
    tip edges, goes into attributes of the name `custom_jaxgear_...`, which REXS leaves to programs.

    Args:
        path: of the file, in JSON where it ends in .rexsj or .json, else in XML; in a zip archive where it ends in
            .rexsz or .zip.
        pair: gear pair; the pinion is gear 1 of the stage.
        pinion, wheel: modifications of the flanks.
        torque: on the pinion [N m].
        speed: of the pinion [rpm].
        cycle: solved mesh cycle of the pair, whose line load and Hertzian stress are written, with a speed also sliding
            velocity and flash temperature; its modifications, torque and speed are those of the file.
        friction: mean coefficient of friction for the flash temperature; None for that of the cycle, or the library's.
        quality_classes: flank tolerance classes of pinion and wheel (ISO 1328-1:2013).
        materials: names of the materials of pinion and wheel.
        title: free text.
        error: by how much the points that stand for a curve unknown to REXS may be off it [um].

    Raises:
        ValueError: for traced numbers or several pairs, a cycle of another pair, with batch axes or that did not
            converge, arguments that a cycle gives already, a modification with a step, or where the file cannot be
            written.
    """
    check("error", error, "um", low=0.0, open_low=True)
    if cycle is not None:
        pinion, wheel, torque, speed, friction = _of_cycle(pair, cycle, pinion, wheel, torque, speed, friction)
    if any(isinstance(leaf, jax.core.Tracer) or np.ndim(leaf) for leaf in jax.tree.leaves(pair)):
        raise ValueError("write_rexs: pair must be one pair of concrete numbers")
    if float(pair.axial_offset) != 0:
        problem = "must be 0 mm: a stage of REXS has no place for it"
        raise ValueError(f"write_rexs: axial_offset = {float(pair.axial_offset):g} mm {problem}")
    for name, gear in zip(("pinion", "wheel"), pair.gears):
        if gear.protuberance is not None:
            raise ValueError(f"write_rexs: {name} protuberance: must be left out, it is not written yet")
        if gear.cutter_teeth is not None:
            problem = f"{float(gear.cutter_teeth):g} must be left out: tools are written as racks alone"
            raise ValueError(f"write_rexs: {name} cutter_teeth = {problem}")
    model = Model(_VERSION)
    title = "".join(letter for letter in title if letter.isprintable())
    unit = model.add("gear_unit", model_name=(title or None, "none"))
    stage = model.add(
        "cylindrical_stage",
        center_distance=(pair.working_center_distance, "mm"),
        common_face_width=(pair.face_width, "mm"),
    )
    model.relate("assembly", assembly=unit, part=stage)
    gears, flanks = zip(
        *(
            write_gear(model, getattr(pair, name), name, quality, material)
            for name, quality, material in zip(
                ("pinion", "wheel"), quality_classes or (None, None), materials or (None, None)
            )
        )
    )
    model.relate("stage", stage=stage, gear_1=gears[0], gear_2=gears[1])
    # of helical gears the ends of the face differ: positive face coordinates are those of right flanks
    touching: dict[str, Any] = {} if pair.is_spur else {"loaded_tooth_flank": ("right", "none")}
    data = [
        model.add("cylindrical_stage_gear_data", is_driving_gear=(first, "none"), **touching) for first in (True, False)
    ]
    for gear, part in zip(gears, data):
        model.relate("stage_gear_data", stage=stage, gear=gear, stage_gear_data=part)
    for name, both, frame, modification in zip(("pinion", "wheel"), flanks, frames(pair), (pinion, wheel)):
        if modification is not None:
            Writer(model, both, frame, f"write_rexs: {name}", error).write(modification)
    if torque is not None:
        check("torque", torque, "N m", low=0.0)
        model.under_load(_CASE, data[0], torque=(np.asarray(torque), "N m"))
    if speed is not None:
        check("speed", speed, "rpm", low=0.0)
        model.under_load(_CASE, gears[0], rotational_speed=(np.asarray(speed), "1 / min"))
    if cycle is not None:
        write_results(model, data[0], cycle, case=_CASE, speed=speed, friction=friction)
    text = to_json(model) if Path(path).suffix in _JSON else xml(model)
    if Path(path).suffix in SUFFIXES:
        text = packed(text, f"{Path(path).stem}.rexs")
    with writing(path):
        write_durably(Path(path), lambda file: file.write(text))


def _of_cycle(pair, cycle: MeshCycle, pinion, wheel, torque, speed, friction):
    """Modifications, torque, speed and friction of a mesh cycle that can be written; raises for any other."""
    for name, given in (("pinion", pinion), ("wheel", wheel), ("torque", torque)):
        if given is not None:
            raise ValueError(f"write_rexs: {name} has no effect with cycle, leave it out")
    if cycle.batch_ndim:
        raise ValueError(f"write_rexs: cycle holds cycles of shape {cycle.transmission_error.shape[:-1]}, must be one")
    if not np.all(np.asarray(cycle.converged)):
        count = int(np.sum(~np.asarray(cycle.converged)))
        raise ValueError(
            f"write_rexs: cycle did not converge at {count} of {len(cycle.phase)} positions: {reason(cycle.status)}"
        )
    if not eqx.tree_equal(cycle.kinematics.pair, pair):
        raise ValueError("write_rexs: cycle is of another pair")
    if cycle.pinion is None or cycle.wheel is None:
        raise ValueError("write_rexs: cycle does not hold its modifications, it comes from solve_removed")
    operating_point = cycle.operating_point
    speed = operating_point.speed if speed is None else speed
    return (
        cycle.pinion,
        cycle.wheel,
        operating_point.torque,
        None if speed is None else float(speed),
        operating_point.friction if friction is None else friction,
    )
