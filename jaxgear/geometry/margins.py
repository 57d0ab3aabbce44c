"""How far two gears are from what cannot run, as numbers that an optimizer can hold, and in words.

One rule for each margin decides both: `Margins.held`. Concrete pairs are refused by it, traced ones flagged.
"""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..numerics import Checked, Given, result, safe_sqrt
from .gear import CHAMFER_ACCURACY, Gear, degrees_meant, shape_faults
from .interference import fillet_clearance
from .involute import diameter, involute
from .outline import Outline, outline
from .path import PathOfContact, backlash_free_involute, pressure_angle_of

Scalar = Float[Array, ""]

# a micrometre of the radius below the form circle, or into the root circle, is within the accuracy of any outline
_OUTLINE_ACCURACY = 1e-3
# single precision resolves a centre distance to about 1e-7 of its value
_DISTANCE_ACCURACY = 1e-6
_LEAST_DECIMALS = 2  # that drawings give


class Accuracy(eqx.Module):
    """Accuracy of some margins, by which they may lie below zero: that of an outline, or of single precision.

    Attributes:
        pinion_form, wheel_form: roll length of the outline's accuracy at the form circle [mm].
        backlash: accuracy of the backlash [um].
    """

    pinion_form: Scalar
    wheel_form: Scalar
    backlash: Scalar


class Margins(Checked):
    """Numbers that are positive where a pair can run; made by `margins`.

    Each is finite and has a finite derivative for impossible gears too, so that a search finds back.

    Attributes:
        pinion_tip_land, wheel_tip_land: thickness of the tooth at the tip, as an arc [mm].
        pinion_tip_height, wheel_tip_height: height of the tip above base and root circle [mm].
        pinion_rim_thickness, wheel_rim_thickness: from the bore to the root circle [mm].
        pinion_form_clearance, wheel_form_clearance: roll length at which the mate's tip meets the flank beyond that of
            the form circle, where the usable involute starts [mm]. Below zero the path of contact begins at the form
            circle, and the pair runs where the fillet is clear.
        pinion_fillet_clearance, wheel_fillet_clearance: least arc between the fillet of the gear and the tip of the
            mate [mm].
        pinion_tip_clearance, wheel_tip_clearance: from the gear's tip to the mate's root circle on the line of
            centres [mm].
        contact_ratio_margin: transverse contact ratio minus 1. Helical gears run below 0 too, where the overlap ratio
            makes up for it.
        backlash: play between the unloaded flanks on the line of action [um], by centre distance and tooth thickness
            allowances; without a given centre distance that of the allowances alone.
        base_circle_clearance: centre distance minus both base radii [mm].
        face_overlap: width on which the faces overlap along the axis [mm].
        base_pitch_difference: between pinion and wheel, relative, and what base helix angles miss of being opposite
            ones [rad]. No margin: it must vanish.
        tip_overrun: by how much a tip form circle lies outside its tip circle, the larger of both gears [mm]. No
            margin: it must not be positive, and is zero without chamfers.
        overlap_ratio: of the faces.
        accuracy: by how much clearances of the form circles and backlash may lie below zero.
        pinion_cutter_room, wheel_cutter_room: `cutter_room` of the gears [mm], at least zero up to rounding; None of a
            gear that a rack generates.
    """

    pinion_tip_land: Scalar = result("mm")
    wheel_tip_land: Scalar = result("mm")
    pinion_tip_height: Scalar = result("mm")
    wheel_tip_height: Scalar = result("mm")
    pinion_rim_thickness: Scalar = result("mm")
    wheel_rim_thickness: Scalar = result("mm")
    pinion_form_clearance: Scalar = result("mm")
    wheel_form_clearance: Scalar = result("mm")
    pinion_fillet_clearance: Scalar = result("mm")
    wheel_fillet_clearance: Scalar = result("mm")
    pinion_tip_clearance: Scalar = result("mm")
    wheel_tip_clearance: Scalar = result("mm")
    contact_ratio_margin: Scalar = result("")
    backlash: Scalar = result("um")
    base_circle_clearance: Scalar = result("mm")
    face_overlap: Scalar = result("mm")
    base_pitch_difference: Scalar = eqx.field(repr=False)
    tip_overrun: Scalar = eqx.field(repr=False)
    overlap_ratio: Scalar = eqx.field(repr=False)
    accuracy: Accuracy = eqx.field(repr=False)
    pinion_cutter_room: Scalar | None = eqx.field(default=None, repr=False)
    wheel_cutter_room: Scalar | None = eqx.field(default=None, repr=False)

    @property
    def held(self) -> dict[str, Bool[Array, "..."]]:
        """For each margin by name whether it holds, most basic first."""
        shape = {
            f"{side}_{name}": getattr(self, f"{side}_{name}") > 0
            for side in ("pinion", "wheel")
            for name in ("tip_height", "tip_land", "rim_thickness")
        }
        for side, room in (("pinion", self.pinion_cutter_room), ("wheel", self.wheel_cutter_room)):
            if room is not None:
                shape[f"{side}_cutter_room"] = room >= -_OUTLINE_ACCURACY
        return shape | {
            "tip_overrun": self.tip_overrun <= CHAMFER_ACCURACY,
            "base_pitch_difference": self.base_pitch_difference <= _DISTANCE_ACCURACY,
            "base_circle_clearance": self.base_circle_clearance > 0,
            "backlash": self.backlash >= -self.accuracy.backlash,
            "face_overlap": self.face_overlap > 0,
            "contact_ratio_margin": (self.contact_ratio_margin > -1)
            & (self.contact_ratio_margin + jnp.maximum(self.overlap_ratio, 0.0) >= 0),
            "pinion_form_clearance": (self.pinion_form_clearance >= -self.accuracy.pinion_form)
            | (self.pinion_fillet_clearance >= -_OUTLINE_ACCURACY),
            "wheel_form_clearance": (self.wheel_form_clearance >= -self.accuracy.wheel_form)
            | (self.wheel_fillet_clearance >= -_OUTLINE_ACCURACY),
            "pinion_tip_clearance": self.pinion_tip_clearance >= -_OUTLINE_ACCURACY,
            "wheel_tip_clearance": self.wheel_tip_clearance >= -_OUTLINE_ACCURACY,
        }

    @property
    def valid(self) -> Bool[Array, "..."]:
        """Whether the pair can run: every margin holds."""
        return jnp.all(jnp.stack(list(self.held.values())), axis=0)


def margins_between(
    pinion: Outline, wheel: Outline, path: PathOfContact, center_distance: Scalar | None, face_overlap: Scalar
) -> Margins:
    """Margins of two generated gears on their path of contact; center distance and overlap as in `GearPair` [mm]."""
    first, second = pinion.gear, wheel.gear
    both = first.base_radius + second.base_radius
    tangent = path.pinion_pitch_roll_length / path.pinion_base_radius
    secant = jnp.sqrt(1 + tangent**2)
    distance = both * secant if center_distance is None else center_distance
    pitch = path.pinion_pitch_roll_length, path.wheel_pitch_roll_length
    return Margins(
        pinion_tip_land=first.tip_land,
        wheel_tip_land=second.tip_land,
        pinion_tip_height=first.tip_height,
        wheel_tip_height=second.tip_height,
        pinion_rim_thickness=first.body_thickness,
        wheel_rim_thickness=second.body_thickness,
        pinion_form_clearance=path.pinion_roll_length(path.start) - path.start_shortened - pinion.form_roll_length,
        wheel_form_clearance=path.wheel_roll_length(path.end) - path.end_shortened - wheel.form_roll_length,
        pinion_fillet_clearance=fillet_clearance(pinion, second, *pitch, distance),
        wheel_fillet_clearance=fillet_clearance(wheel, first, *pitch[::-1], distance),
        pinion_tip_clearance=distance - first.tip_radius - second.root_circle_radius,
        wheel_tip_clearance=distance - second.tip_radius - first.root_circle_radius,
        contact_ratio_margin=path.contact_ratio - 1,
        backlash=play_between(first, second, None if center_distance is None else tangent),
        base_circle_clearance=distance - both,
        face_overlap=face_overlap,
        base_pitch_difference=_apart(first, second),
        overlap_ratio=face_overlap * jnp.abs(jnp.tan(first.base_helix_angle)) / first.base_pitch,
        tip_overrun=-jnp.minimum(first.tip_chamfer, second.tip_chamfer),
        accuracy=Accuracy(
            pinion_form=_form_accuracy(pinion),
            wheel_form=_form_accuracy(wheel),
            # dj / da = 2 sin(alpha_w)
            backlash=2e3 * _DISTANCE_ACCURACY * both * tangent,
        ),
        pinion_cutter_room=first.cutter_room,
        wheel_cutter_room=second.cutter_room,
    )


def _apart(first: Gear, second: Gear) -> Scalar:
    """`base_pitch_difference` of two gears."""
    pitches = jnp.abs(first.base_pitch - second.base_pitch) / first.base_pitch
    if first.helix_angle is None and second.helix_angle is None:
        return pitches
    return pitches + jnp.abs(first.base_helix_angle + second.base_helix_angle)


def play_between(pinion: Gear, wheel: Gear, tangent: Scalar | None) -> Scalar:
    """Play on the line of action [um] at the tangent of a working pressure angle, or where that is backlash-free.

    p_b - s_1 - s_2 with the thicknesses at the base circles: 2 (r_b1 + r_b2) (inv(alpha_w) - inv(alpha_w,free)).
    """
    if tangent is None:
        return -thickening(pinion, wheel)
    free = involute(tangent) - backlash_free_involute(pinion, wheel)
    return 2e3 * (pinion.base_radius + wheel.base_radius) * free - thickening(pinion, wheel)


def thickening(pinion: Gear, wheel: Gear) -> Scalar:
    """Play on the line of action that the tooth thickness allowances take [um]: the arcs on both base circles."""
    return 2e3 * (pinion.base_radius * pinion.thickness_angle + wheel.base_radius * wheel.thickness_angle)


def _form_accuracy(outline: Outline) -> Scalar:
    """Roll length that the accuracy of the outline's radius is worth at the form circle [mm]."""
    base, form = outline.gear.base_radius, outline.form_roll_length
    lower = jnp.sqrt(base**2 + form**2) - _OUTLINE_ACCURACY
    return form - safe_sqrt(lower**2 - base**2)


def faults_between(
    pinion: Gear,
    wheel: Gear,
    center_distance: Scalar | None,
    axial_offset: Scalar,
    margins: Margins,
    held: Mapping[str, Bool[Array, ""]],
) -> tuple[str, ...]:
    """The margins that do not hold, in words; all numbers concrete. `held` are those of the margins."""
    faults = [
        f"{side}: {fault}" for side, gear in (("pinion", pinion), ("wheel", wheel)) for fault in shape_faults(gear)
    ]
    faults += [
        f"GearPair: wheel {name} = {float(getattr(wheel, name)):g} {unit} must equal the pinion's, "
        f"{float(getattr(pinion, name)):g} {unit}"
        for name, unit in (("module", "mm"), ("pressure_angle", "deg"))
        if float(getattr(wheel, name)) != float(getattr(pinion, name))
    ]
    hands = [0.0 if gear.helix_angle is None else float(gear.helix_angle) for gear in (pinion, wheel)]
    if hands[0] != -hands[1]:
        faults.append(
            f"GearPair: wheel helix_angle = {hands[1]:g} deg must be {0.0 - hands[0]:g} deg: gears on parallel shafts "
            "have the same angle and opposite hands"
        )
    missed = {name for name, holds in held.items() if not holds}
    if "base_circle_clearance" in missed:
        closest = float(pinion.base_radius + wheel.base_radius)
        distance = closest + float(margins.base_circle_clearance)
        faults.append(f"GearPair: center_distance = {distance:g} mm must be greater than {closest:g} mm")
    elif "backlash" in missed:
        faults.append(_backlash_fault(pinion, wheel, center_distance))
    if "face_overlap" in missed:
        reach = 0.5 * float(pinion.face_width + wheel.face_width)
        faults.append(
            f"GearPair: axial_offset = {float(axial_offset):g} mm must be greater than {-reach:g} mm and less than "
            f"{reach:g} mm, half the sum of both face widths: the faces do not overlap"
        )
    if "contact_ratio_margin" in missed:
        transverse = float(margins.contact_ratio_margin) + 1
        total = transverse + max(float(margins.overlap_ratio), 0.0) if transverse > 0 else transverse
        faults.append(_contact_ratio_fault(pinion, wheel, center_distance, total))
    for name, mate, gear in (("pinion", "wheel", pinion), ("wheel", "pinion", wheel)):
        if f"{name}_form_clearance" in missed:
            faults.append(_form_fault(name, mate, gear, float(getattr(margins, f"{name}_form_clearance"))))
        if f"{mate}_tip_clearance" in missed:
            faults.append(
                f"GearPair: {mate} tip_diameter leaves a clearance of "
                f"{float(getattr(margins, f'{mate}_tip_clearance')):.4g} mm to the {name}'s root circle, must be at "
                "least 0 mm"
            )
    return tuple(faults)


def _backlash_fault(pinion: Gear, wheel: Gear, center_distance: Given | None) -> str:
    assert center_distance is not None  # that of None leaves no backlash to miss
    free = float(free_distance(pinion, wheel)) * (1 - _DISTANCE_ACCURACY)
    unit = "mm (backlash-free)"
    return f"GearPair: center_distance = {float(center_distance):g} {unit} must be at least {free:g} {unit}"


def free_distance(pinion: Gear, wheel: Gear) -> Scalar:
    """Centre distance without backlash [mm], of the mean tooth thicknesses."""
    both = pinion.base_radius + wheel.base_radius
    return both / jnp.cos(
        pressure_angle_of(backlash_free_involute(pinion, wheel) + 0.5e-3 * thickening(pinion, wheel) / both)
    )


def rounded_by(pinion: Gear, wheel: Gear, center_distance: Given) -> float:
    """Part of a concrete centre distance that the rounding of the given digits is worth [mm].

    That of its own digits, and of those of both profile shifts and the helix angle: half a unit of the last one, of
    numbers that are given to fewer than two decimals of the second.
    """
    angle = 0.0 if pinion.helix_angle is None else abs(float(pinion.helix_angle))
    shifts = _half_unit(pinion.profile_shift) + _half_unit(wheel.profile_shift)
    tilted = float(center_distance) * np.tan(np.deg2rad(angle)) * np.deg2rad(_half_unit(angle)) if angle else 0.0
    return _half_unit(center_distance) + float(pinion.module) * shifts + float(tilted)


def _half_unit(value: Given) -> float:
    known: Any = np.asarray(value)[()]  # in its own precision, whose shortest digits are those that were given
    digits = np.format_float_positional(known, trim="-").partition(".")[2]
    return 0.5 * 10.0 ** -max(len(digits), _LEAST_DECIMALS)


def _contact_ratio_fault(pinion: Gear, wheel: Gear, center_distance: Given | None, contact_ratio: float) -> str:
    remedy = "raise a tip_diameter or addendum"
    if center_distance is None:
        return f"GearPair: {_ratio(pinion)} = {contact_ratio:.4g} must be at least 1: {remedy}"
    angle = degrees_meant(pinion)
    if angle is not None:
        closest = 0.5 * float(pinion.module) * float(pinion.teeth + wheel.teeth) / float(np.cos(np.deg2rad(angle)))
        if abs(closest - float(center_distance)) < 2 * float(pinion.module):
            return (
                f"GearPair: pinion helix_angle = {np.deg2rad(angle):g} deg does not go with center_distance = "
                f"{float(center_distance):g} mm: give degrees, {angle:.4g} deg?"
            )
    given, reach = f"GearPair: center_distance = {float(center_distance):g} mm", pinion.tip_radius + wheel.tip_radius
    if not float(center_distance) < float(reach):
        return f"{given} must be less than {float(reach):g} mm, the sum of both tip radii: the teeth do not meet"
    return f"{given} leaves a {_ratio(pinion)} of {contact_ratio:.4g}, must be at least 1: lower it, or {remedy}"


def _ratio(gear: Gear) -> str:
    return "contact ratio" if gear.helix_angle is None else "total contact ratio"


def _form_fault(name: str, mate: str, gear: Gear, clearance: float) -> str:
    form = outline(gear).form_roll_length
    reached = form + clearance
    wanted, start = f"{float(diameter(gear, form)):.6g} mm", f"GearPair: {mate} tip_diameter reaches the {name}'s flank"
    if reached >= 0:
        at = float(diameter(gear, reached))
        return f"{start} at diameter {at:.6g} mm, must be at least its form diameter {wanted}"
    # where the involute has ended diameters grow again: only the roll length tells how far off it is
    return (
        f"{start} at a roll length of {float(reached):.4g} mm (below the base circle), must be at least "
        f"{float(form):.4g} mm, that of its form diameter {wanted}"
    )
