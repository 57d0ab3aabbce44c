"""The geometry of a pair as an engineer lists it."""

from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Gear, GearPair, PathOfContact, diameter, margins, outline, path_of_contact
from ..io import DesignFile
from ..numerics import program
from . import drawing

# the names of ISO 21771 with the unit, in the order of their numbers below
_GEAR = (
    "teeth",
    "module_mm",
    "pressure_angle_deg",
    "profile_shift_coefficient",
    "face_width_mm",
    "reference_diameter_mm",
    "pitch_circle_diameter_mm",
    "base_diameter_mm",
    "tip_diameter_mm",
    "tip_form_diameter_mm",
    "root_diameter_mm",
    "root_form_diameter_mm",
    "active_root_diameter_mm",
    "bore_diameter_mm",
    "tip_land_mm",
    "tip_clearance_mm",
    "tooth_thickness_allowance_um",
    "tooth_thickness_tolerance_um",
)
_PAIR = (
    "center_distance_mm",
    "working_pressure_angle_deg",
    "gear_ratio",
    "axial_offset_mm",
    "common_face_width_mm",
    "base_pitch_mm",
    "transverse_contact_ratio",
    "length_of_path_of_contact_mm",
    "path_of_contact_A_mm",
    "path_of_contact_B_mm",
    "path_of_contact_D_mm",
    "path_of_contact_E_mm",
    "backlash_on_line_of_action_um",
    "least_backlash_on_line_of_action_um",
    "largest_backlash_on_line_of_action_um",
)

Scalar = Float[Array, ""]


def gears(file: DesignFile) -> dict[str, dict[str, dict[str, Any]]]:
    """What every `summary.json` says of the gears: their geometry with that of the pair, and their drawing data.

    Points of the path of contact are positions from the pitch point C, positive towards the tip of the pinion. The
    usable involute runs from the root form diameter to the tip form diameter, and the mate's tip touches it from the
    active root diameter on.
    """
    # gears without backlash have it up to rounding, which is no -0
    chosen = drawing.chosen(file)
    shape, drawn = _numbers(file.pair(), chosen)
    pinion, wheel, together = jax.tree.map(lambda number: np.where(np.abs(number) < 1e-9, 0.0, number), shape)
    geometry = {
        "pinion": dict(zip(_GEAR, pinion, strict=True)),
        "wheel": dict(zip(_GEAR, wheel, strict=True)),
        "pair": dict(zip(_PAIR, together, strict=True)),
    }
    of = zip(("pinion", "wheel"), drawn, chosen)
    return {"geometry": geometry, "drawing": {name: drawing.drawing(found, given[-1]) for name, found, given in of}}


def mounting(file: DesignFile) -> str:
    """Both bores, where the bodies are held, and whether anybody has asked for them; how the gears are mounted."""
    shape = gears(file)["geometry"]
    texts = []
    for name, gear in (("pinion", file.pair().pinion), ("wheel", file.pair().wheel)):
        guess = "" if gear.bore_diameter is not None else " (half the root diameter, as none is given)"
        texts.append(f"{name} {float(shape[name]['bore_diameter_mm']):.4g} mm{guess}")
    pair = shape["pair"]
    mounted = f"centre distance {float(pair['center_distance_mm']):.6g} mm"
    backlash = round(float(pair["backlash_on_line_of_action_um"]), 3) + 0.0  # rounding leaves no -0
    return f"bores: {', '.join(texts)}; {mounted}, backlash on the line of action {backlash:g} um"


@program
def _numbers(pair: GearPair, chosen):
    contact, room = path_of_contact(pair), margins(pair)
    pitch = contact.pinion_pitch_roll_length, contact.wheel_pitch_roll_length
    lowest = contact.pinion_roll_length(contact.start), contact.wheel_roll_length(contact.end)
    shape = (
        _gear(pair.pinion, pitch[0], lowest[0], room.pinion_tip_clearance),
        _gear(pair.wheel, pitch[1], lowest[1], room.wheel_tip_clearance),
        _together(pair, contact, room.backlash),
    )
    return shape, [drawing.numbers(gear, *given) for gear, given in zip(pair.gears, chosen)]


def _gear(gear: Gear, pitch: Scalar, lowest: Scalar, tip_clearance: Scalar) -> tuple[Scalar, ...]:
    """`_GEAR`, of the roll lengths at the pitch point and at the end of the active profile [mm]."""
    return (
        gear.teeth,
        gear.module,
        gear.pressure_angle,
        gear.profile_shift,
        gear.face_width,
        2 * gear.pitch_radius,
        diameter(gear, pitch),
        2 * gear.base_radius,
        2 * gear.tip_radius,
        2 * gear.tip_form_radius,
        2 * gear.root_circle_radius,
        diameter(gear, outline(gear).form_roll_length),
        diameter(gear, lowest),
        2 * gear.bore_radius,
        gear.tip_land,
        tip_clearance,
        gear.tooth_thickness_allowance,
        gear.tooth_thickness_tolerance,
    )


def _together(pair: GearPair, contact: PathOfContact, backlash: Scalar) -> tuple[Scalar, ...]:
    """`_PAIR`."""
    return (
        pair.working_center_distance,
        jax.numpy.rad2deg(pair.working_pressure_angle),
        pair.gear_ratio,
        pair.axial_offset,
        pair.face_width,
        contact.base_pitch,
        contact.contact_ratio,
        contact.end - contact.start,
        contact.start,
        contact.inner_single,
        contact.outer_single,
        contact.end,
        backlash,
        *pair.backlash_limits,
    )
