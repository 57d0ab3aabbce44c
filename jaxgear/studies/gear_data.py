"""The geometry of a pair as an engineer lists it, and as a drawing says it."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Gear, GearPair, Outline, PairGeometry, PathOfContact, diameter, explicit, pair_geometry
from ..geometry.gear import has_full_radius, tool_name
from ..io import DesignFile
from ..io.tolerance_table import quality_classes
from ..manufacture import measures
from ..numerics import Given, changed, program
from ..report import Chapter, Table, heading, text
from ..tolerance import ToleranceClass, iso_rounded

_CHOSEN = "teeth_spanned", "ball_diameter_mm"  # by a file, or by `measures`
# numbers and the symbols of the standards, in the order of the tables
_MEASURES = {
    "teeth_spanned": "k",
    "span_upper_limit_mm": "W_k",
    "span_lower_limit_mm": "W_k",
    "ball_diameter_mm": "D_M",
    "over_balls_upper_limit_mm": "M_dK",
    "over_balls_lower_limit_mm": "M_dK",
}
_CLASS = "flank_tolerance_class"
_DEVIATIONS = {
    "single_pitch": "f_p",
    "total_pitch": "F_p",
    "profile_slope": "f_Halpha",
    "profile_form": "f_falpha",
    "profile_total": "F_alpha",
    "helix_slope": "f_Hbeta",
    "helix_form": "f_fbeta",
    "helix_total": "F_beta",
}
_FACTORS = {
    "tangential_force_N": "F_t",
    "face_load_factor": "K_Hbeta",
    "zone_factor": "Z_H",
    "elasticity_factor_sqrt_MPa": "Z_E",
    "contact_ratio_factor": "Z_epsilon",
    "helix_angle_factor": "Z_beta",
    "nominal_contact_stress_MPa": "sigma_H0",
    "pinion_single_pair_contact_factor": "Z_B",
    "wheel_single_pair_contact_factor": "Z_D",
    "pinion_contact_stress_MPa": "sigma_H",
    "wheel_contact_stress_MPa": "sigma_H",
    "root_face_load_factor": "K_Fbeta",
    "root_helix_angle_factor": "Y_beta",
    "pinion_form_factor": "Y_F",
    "wheel_form_factor": "Y_F",
    "pinion_stress_correction_factor": "Y_S",
    "wheel_stress_correction_factor": "Y_S",
    "pinion_nominal_root_stress_MPa": "sigma_F0",
    "wheel_nominal_root_stress_MPa": "sigma_F0",
    "pinion_root_stress_MPa": "sigma_F",
    "wheel_root_stress_MPa": "sigma_F",
}
_RATING_NOTE = (
    "Application factor, dynamic factor and transverse load factor are 1 here: load_factor of [strength] takes them "
    "into safeties and damages, that of [lubricant] into friction, flash temperature and film. Y_B and Y_DT are 1, for "
    "solid bodies and contact ratios up to 2. K_Hbeta is that of the contact analysis, 1 on one slice."
)
_TOLERANCE_NOTE = (
    "Slopes and pitch are limits of either sign, form and total deviations are widths of a band, about the flank as "
    "modified (ISO 1328-1:2013)."
)

Factors = Mapping[str, float]
Scalar = Float[Array, ""]


def chosen(file: DesignFile) -> tuple[Any, ...]:
    """Teeth spanned and ball diameter of either gear where the file names them, and its flank tolerance class."""
    classes = quality_classes(file) or (None, None)
    given = (file.drawn[name] for name in ("pinion", "wheel"))
    measured = ([np.asarray(one[key], float) if key in one else None for key in _CHOSEN] for one in given)
    return tuple((*beside, quality) for beside, quality in zip(measured, classes))


def numbers(
    gear: Gear, teeth: Given | None, ball: Given | None, quality: ToleranceClass | None
) -> tuple[tuple[Scalar, ...], ...]:
    """`_MEASURES`, and `_DEVIATIONS` where the gear has a class; to be traced."""
    upper = gear.tooth_thickness_allowance

    def measured(allowance):
        zero = jnp.zeros_like(allowance)
        thick = changed(gear, tooth_thickness_allowance=allowance, tooth_thickness_tolerance=zero)  # unchecked
        return measures(thick, teeth, ball)

    of = jax.vmap(measured)(jnp.stack([upper, upper - gear.tooth_thickness_tolerance]))
    stated = () if quality is None else tuple(iso_rounded(getattr(quality, name)) for name in _DEVIATIONS)
    return (of.teeth[0], *of.span, of.ball[0], *of.over_balls), stated


def drawing(found: tuple[tuple[Any, ...], ...], quality: ToleranceClass | None) -> dict[str, Any]:
    """`numbers` of a gear by name and unit; what would miss the involute is left out."""
    measured, deviations = ([np.asarray(number).item() for number in several] for several in found)
    data: dict[str, Any] = {name: value for name, value in zip(_MEASURES, measured) if np.isfinite(value)}
    data["teeth_spanned"] = int(data["teeth_spanned"])
    if quality is not None:
        data[_CLASS] = int(quality.quality_class)
    return data | {f"{name}_deviation_um": value for name, value in zip(_DEVIATIONS, deviations)}


def drawing_table(found: Mapping[str, Mapping[str, Any]]) -> Table:
    """`drawing` as a table of the report."""
    symbols = _MEASURES | {_CLASS: ""} | {f"{name}_deviation_um": symbol for name, symbol in _DEVIATIONS.items()}
    names = [name for name in symbols if any(name in gear for gear in found.values())]
    rows = tuple((_label(name, symbols), *(text(gear.get(name)) for gear in found.values())) for name in names)
    return Table(("", *found), rows, "drawing data", _TOLERANCE_NOTE if _CLASS in names else "")


def rating_page(designs: Mapping[str, Factors]) -> Chapter:
    """The factors of ISO 6336 of several designs, side by side."""
    rows = tuple((_label(name, _FACTORS), *(text(each[name]) for each in designs.values())) for name in _FACTORS)
    return Chapter("Rating by ISO 6336", tables=[Table(("", *designs), rows, note=_RATING_NOTE)])


def _label(name: str, symbols: Mapping[str, str]) -> str:
    """A number in words, with its symbol and unit."""
    words, bracket, unit = heading(name).partition(" [")
    symbol = "" if words.endswith(symbols[name]) else f", {symbols[name]}"
    return f"{words}{symbol}{bracket}{unit}"


# the names of ISO 21771 with the unit, in the order of their numbers below
_GEAR = (
    "teeth",
    "module_mm",
    "pressure_angle_deg",
    "profile_shift_coefficient",
    "generating_profile_shift_coefficient",
    "face_width_mm",
    "reference_diameter_mm",
    "pitch_circle_diameter_mm",
    "base_diameter_mm",
    "tip_diameter_mm",
    "tip_form_diameter_mm",
    "root_diameter_mm",
    "root_form_diameter_mm",
    "active_root_diameter_mm",
    "active_tip_diameter_mm",
    "bore_diameter_mm",
    "tip_land_mm",
    "tip_edge_radius_mm",
    "tip_clearance_mm",
    "tooth_thickness_allowance_um",
    "tooth_thickness_tolerance_um",
)
_HELICAL_GEAR = (
    "helix_angle_deg",
    "base_helix_angle_deg",
    "transverse_module_mm",
    "transverse_pressure_angle_deg",
    "virtual_number_of_teeth",
)
_BACKLASH = "backlash_on_line_of_action_um"
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
    _BACKLASH,
    "least_backlash_on_line_of_action_um",
    "largest_backlash_on_line_of_action_um",
)
_HELICAL_PAIR = ("overlap_ratio", "total_contact_ratio", "normal_backlash_um")


def gears(file: DesignFile) -> dict[str, dict[str, dict[str, Any]]]:
    """Geometry of both gears and the pair, and drawing data of the gears, as in every `summary.json`.

    Points of the path of contact are positions from the pitch point C, positive towards the tip of the pinion. The
    usable involute runs from the root form diameter to the tip form diameter, and the mate touches it from the active
    root diameter d_Nf to the active tip diameter d_Na, the tip form diameter but where the mate is undercut. Of helical
    gears module and pressure angle are normal ones, and the base pitch and the backlash on the line of action
    transverse ones.
    """
    # gears without backlash have it up to rounding, which is no -0
    choices = chosen(file)
    pair = file.pair()
    shape, drawn = _numbers(pair, pair_geometry(explicit(pair)), choices)
    helical = not pair.is_spur
    pinion, wheel, together = jax.tree.map(lambda number: np.where(np.abs(number) < 1e-9, 0.0, number), shape)
    geometry = {
        "pinion": dict(zip((*_GEAR, *_HELICAL_GEAR * helical), pinion, strict=True)),
        "wheel": dict(zip((*_GEAR, *_HELICAL_GEAR * helical), wheel, strict=True)),
        "pair": dict(zip((*_PAIR, *_HELICAL_PAIR * helical), together, strict=True)),
    }
    of = zip(("pinion", "wheel"), drawn, choices)
    return {"geometry": geometry, "drawing": {name: drawing(found, given[-1]) for name, found, given in of}}


def mounting(file: DesignFile) -> str:
    """Line on the bores, the centre distance, the backlash and full root radii of the gears."""
    shape = gears(file)["geometry"]
    texts = []
    for name, gear in (("pinion", file.pair().pinion), ("wheel", file.pair().wheel)):
        guess = "" if gear.bore_diameter is not None else " (half the root diameter, as none is given)"
        texts.append(f"{name} {float(shape[name]['bore_diameter_mm']):.4g} mm{guess}")
    full = [
        f"{name} {float(gear.root_radius):.4g} x module (full radius of the {tool_name(gear)})"
        for name, gear in (("pinion", file.pair().pinion), ("wheel", file.pair().wheel))
        if has_full_radius(gear)
    ]
    rack = f"; root radius: {', '.join(full)}" if full else ""
    pair = shape["pair"]
    mounted = f"centre distance {float(pair['center_distance_mm']):.6g} mm"
    helical = "normal_backlash_um" in pair  # as pair.backlash has it
    name, where = ("normal_backlash_um", "normal to the flanks") if helical else (_BACKLASH, "on the line of action")
    backlash = round(float(pair[name]), 3) + 0.0  # rounding leaves no -0
    return f"bores: {', '.join(texts)}; {mounted}, backlash {where} {backlash:g} um{rack}"


@program
def _numbers(pair: GearPair, geometry: PairGeometry, choices):
    contact, room = geometry.path_of_contact, geometry.margins
    pitch = contact.pinion_pitch_roll_length, contact.wheel_pitch_roll_length
    active = (
        (contact.pinion_roll_length(contact.start), contact.pinion_roll_length(contact.end)),
        (contact.wheel_roll_length(contact.end), contact.wheel_roll_length(contact.start)),
    )
    shape = (
        _gear(pair.pinion, geometry.outlines[0], pitch[0], active[0], room.pinion_tip_clearance),
        _gear(pair.wheel, geometry.outlines[1], pitch[1], active[1], room.wheel_tip_clearance),
        _together(pair, contact, room.backlash),
    )
    return shape, [numbers(gear, *given) for gear, given in zip(pair.gears, choices)]


def _gear(
    gear: Gear, outline: Outline, pitch: Scalar, active: tuple[Scalar, Scalar], tip_clearance: Scalar
) -> tuple[Scalar, ...]:
    """`_GEAR` and `_HELICAL_GEAR`, of the roll lengths at the pitch point and the ends of the active profile [mm]."""
    helical = (
        ()
        if gear.helix_angle is None
        else (
            gear.helix_angle,
            jnp.rad2deg(gear.base_helix_angle),
            gear.transverse_module,
            jnp.rad2deg(gear.transverse_pressure_angle),
            gear.virtual_teeth,
        )
    )
    return (
        gear.teeth,
        gear.module,
        gear.pressure_angle,
        gear.profile_shift,
        gear.generating_profile_shift,
        gear.face_width,
        2 * gear.pitch_radius,
        diameter(gear, pitch),
        2 * gear.base_radius,
        2 * gear.tip_radius,
        2 * gear.tip_form_radius,
        2 * gear.root_circle_radius,
        diameter(gear, outline.form_roll_length),
        *(diameter(gear, end) for end in active),
        2 * gear.bore_radius,
        gear.tip_land,
        gear.edge_radius,
        tip_clearance,
        gear.tooth_thickness_allowance,
        gear.tooth_thickness_tolerance,
        *helical,
    )


def _together(pair: GearPair, contact: PathOfContact, backlash: Scalar) -> tuple[Scalar, ...]:
    """`_PAIR` and `_HELICAL_PAIR`."""
    helical = (
        ()
        if pair.pinion.helix_angle is None
        else (
            pair.overlap_ratio,
            contact.contact_ratio + pair.overlap_ratio,
            backlash * jnp.cos(pair.pinion.base_helix_angle),
        )
    )
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
        *helical,
    )
