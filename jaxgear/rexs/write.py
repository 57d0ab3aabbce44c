"""Write a gear pair with its modifications, its load and the results of its contact analysis as a REXS file."""

from collections.abc import Sequence
from pathlib import Path, PurePath
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..contact import MeshCycle
from ..contact.status import reason
from ..geometry import GearPair, tooth_thickness
from ..io.folder import writing
from ..io.write_design import check_rim
from ..metrics import flash_temperature
from ..microgeometry import AbstractModification
from ..numerics import check
from ..numerics.durable import write_durably
from .flanks import write_modification
from .forms import content_of
from .frame import frames
from .gears import write_gear
from .model import Component, Model
from .open_numbers import PAIR

_VERSION = "2.0.0"
CASE = 1


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
    """Write a REXS 2.0 file atomically, in place of an earlier one.

    Tip diameters and centre distance that the pair leaves open are written with their values; an open bore is left
    out. Both flanks of a tooth are modified alike. The radius of the tip edges, which REXS does not know, is written as
    `custom_jaxgear_tip_edge_radius`: REXS leaves the names "custom_..." to programs.

    Args:
        path: file; the end .rexsj or .json makes it JSON, .rexsz or .zip an archive of an XML file, any other end XML.
        pair: gear pair; the pinion is gear 1 of the stage.
        pinion, wheel: modifications of the flanks.
        torque: torque on the pinion [N m].
        speed: speed of the pinion [rpm].
        cycle: solved mesh cycle of the pair, whose line load and Hertzian stress are written, with a speed also sliding
            velocity and flash temperature; its modifications, torque and speed are those of the file.
        friction: mean coefficient of friction for the flash temperature; None for that of the cycle, or the library's.
        quality_classes: flank tolerance classes of pinion and wheel (ISO 1328-1:2013).
        materials: names of the materials of pinion and wheel.
        title: free text.
        error: permissible deviation of the points that represent a curve unknown to REXS [um].

    Raises:
        ValueError: for traced numbers or several pairs, a cycle of another pair, with batch axes or that did not
            converge, arguments that a cycle gives already, a modification with a step, or where the file cannot be
            written.
    """
    check("error", error, "um", low=0.0, open_low=True)
    if cycle is not None:
        pinion, wheel, torque, speed, friction = _of_cycle(pair, cycle, pinion, wheel, torque, speed, friction)
    check_pair(pair, "write_rexs")
    model, unit = new_model(title)
    stage = write_stage(model, unit, pair)
    names = zip(pair.gears, PAIR, quality_classes or (None, None), materials or (None, None))
    gears, flanks = zip(*(write_gear(model, *each) for each in names))
    # of helical gears the ends of the face differ: positive face coordinates are those of right flanks
    data = write_mesh(model, stage, gears, side=None if pair.is_spur else "right")
    for name, both, frame, modification in zip(PAIR, flanks, frames(pair), (pinion, wheel)):
        if modification is not None:
            write_modification(model, both, frame, modification, owner=f"write_rexs: {name}", error=error)
    if torque is not None:
        check("torque", torque, "N m", low=0.0)
        model.under_load(CASE, data[0], torque=(np.asarray(torque), "N m"))
    if speed is not None:
        check("speed", speed, "rpm", low=0.0)
        model.under_load(CASE, gears[0], rotational_speed=(np.asarray(speed), "1 / min"))
    if cycle is not None:
        _write_results(model, data[0], cycle, case=CASE, speed=speed, friction=friction)
    write_model(model, path)


def check_pair(pair: GearPair, owner: str) -> None:
    """Raise for a pair that REXS has no place for; `owner` is the function in the message.

    Raises:
        ValueError: for traced numbers or several pairs, an axial offset, a support of a rim, and tools that are not
            written.
    """
    if any(isinstance(leaf, jax.core.Tracer) or np.ndim(leaf) for leaf in jax.tree.leaves(pair)):
        raise ValueError(f"{owner}: pair must be one pair of concrete numbers")
    if float(pair.axial_offset) != 0:
        problem = "must be 0 mm: a stage of REXS has no place for it"
        raise ValueError(f"{owner}: axial_offset = {float(pair.axial_offset):g} mm {problem}")
    check_rim(pair, owner)
    for name, gear in zip(PAIR, pair.gears):
        if gear.fillet_arc is not None:
            raise ValueError(f"{owner}: {name} fillet_radius: must be left out, fillets are written by their tools")
        if gear.protuberance is not None:
            raise ValueError(f"{owner}: {name} protuberance: must be left out, it is not written yet")
        if gear.cutter_teeth is not None and not gear.is_internal:
            problem = f"{float(gear.cutter_teeth):g} must be left out: tools are written as racks alone"
            raise ValueError(f"{owner}: {name} cutter_teeth = {problem}")


def new_model(title: str) -> tuple[Model, Component]:
    """A model with a gear unit of a title."""
    model = Model(_VERSION)
    title = "".join(letter for letter in title if letter.isprintable())
    return model, model.add("gear_unit", model_name=(title or None, "none"))


def write_stage(model: Model, whole: Component, pair: GearPair, angle: float | None = None) -> Component:
    """Write the cylindrical stage of a pair as a part of a gear unit or a planetary stage.

    Args:
        model: the file.
        whole: gear unit or planetary stage.
        pair: the gears.
        angle: direction from gear 1 to gear 2, about the negative u axis [deg]; None for none.
    """
    stage = model.add(
        "cylindrical_stage",
        center_distance=(pair.working_center_distance, "mm"),
        common_face_width=(pair.face_width, "mm"),
        rotating_angle_around_neg_u_axis=(angle, "deg"),
    )
    model.relate("assembly", assembly=whole, part=stage)
    return stage


def write_mesh(model: Model, stage: Component, gears: Sequence[Component], *, side: str | None) -> list[Component]:
    """Write that two gears, pinion first, mesh in a cylindrical stage; returns their components of stage data.

    Args:
        model: the file.
        stage: the stage.
        gears: components of the gears.
        side: side of the flanks that touch, "left" or "right"; None for either.
    """
    model.relate("stage", stage=stage, gear_1=gears[0], gear_2=gears[1])
    options: dict[str, Any] = {"loaded_tooth_flank": (side, "none")}
    data = [
        model.add("cylindrical_stage_gear_data", is_driving_gear=(first, "none"), **options) for first in (True, False)
    ]
    for gear, part in zip(gears, data):
        model.relate("stage_gear_data", stage=stage, gear=gear, stage_gear_data=part)
    return data


def write_model(model: Model, path: str | Path) -> None:
    """Write the file of a model atomically, in place of an earlier one.

    Raises:
        ValueError: where it cannot be written.
    """
    content = content_of(model, PurePath(path))
    with writing(path):
        write_durably(Path(path), lambda file: file.write(content))


def _of_cycle(pair, cycle: MeshCycle, pinion, wheel, torque, speed, friction):
    """Modifications, torque, speed and friction of a mesh cycle; raises if they cannot be written."""
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


def _write_results(
    model: Model, stage_data: Component, cycle: MeshCycle, *, case: int, speed: float | None, friction: float | None
) -> None:
    """Write line load and Hertzian stress, with a speed also sliding velocity and flash temperature.

    They belong to points of the pinion flank: radius, angle from the centreline of the tooth in its transverse section
    and face coordinate from the middle of the face, profile after profile across the face. Points are where contact is
    on the path of contact; what tip corners carry beyond it has no place of its own on this flank and is left out.

    Args:
        model: where they go.
        stage_data: component that holds the pinion's data of the stage.
        cycle: solved mesh cycle.
        case: load case under which they stand.
        speed: speed of the pinion [rpm].
        friction: mean coefficient of friction, None for the library's default.
    """
    kinematics, (side, _) = cycle.kinematics, cycle.sides
    shape = cycle.line_load.shape

    def everywhere(field) -> np.ndarray:
        """Values of every contact; the slices of spur gears share them."""
        return np.broadcast_to(np.asarray(field), shape)

    places = np.nonzero(everywhere(kinematics.outside) == 0)
    order = np.lexsort((everywhere(side.contact_roll_length)[places], places[1]))
    places = tuple(axis[order] for axis in places)
    roll = everywhere(side.contact_roll_length)[places]
    face = np.asarray(kinematics.face_coordinate + side.face_middle)[places[1]]
    identifiers = np.arange(1, len(roll) + 1)
    radius = np.hypot(float(side.base_radius), roll)
    angle = np.rad2deg(np.asarray(tooth_thickness(side.gear, 2 * radius)) / (2 * radius))
    points = model.add(
        "point_list",
        "contact on the pinion flank",
        kind_of_point_list=("meshing_contact_points", "none"),
        point_ids=(identifiers, "none"),
        point_coordinates_radius=(radius, "mm"),
        point_coordinates_angle_about_u_axis=(angle, "deg"),
        point_coordinates_u_coord=(face, "mm"),
    )
    data = model.add("meshing_contact_stage_data_set", set_ids=(identifiers, "none"))
    model.relate("assembly", assembly=stage_data, part=points)
    model.relate("reference", origin=points, referenced=data)
    found = {
        "local_normal_line_load": (np.asarray(cycle.line_load)[places], "N / mm"),
        "local_hertzian_contact_stress": (np.asarray(cycle.contact_pressure)[places], "MPa"),
    }
    if speed is not None:
        path = everywhere(kinematics.path)[places]
        known = {} if friction is None else {"friction": friction}
        flash = flash_temperature(cycle, speed, **known)
        found["local_sliding_velocity"] = (np.asarray(kinematics.path_of_contact.sliding_speed(path, speed)), "m / s")
        found["local_flash_temperature_blok_1937"] = (np.asarray(flash)[places], "K")
    model.under_load(case, data, **found)
