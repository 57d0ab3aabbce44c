"""Geometry data of a pair, and data of its drawings, for tables and summaries."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Gear, GearPair, Outline, PathOfContact, RingGear, diameter, explicit, measures, pair_geometry
from ..geometry.gear import has_full_radius, tool_name
from ..geometry.pair import PairGeometry
from ..io import DesignFile
from ..io.tolerance_table import quality_classes
from ..numerics import Given, UnitKey, changed, program
from ..report import Chapter, Table, text
from ..tolerance import ToleranceClass, iso_rounded
from ..vocabulary import quantities


def _symbol(name: str, unit: str, symbol: str) -> UnitKey:
    """Key of a number that has a symbol in the standards."""
    known = [each.words for each in quantities.every(name) if each.takes is None]  # others are of a rating
    words = known[0] if known else name.replace("_", " ")
    return UnitKey(name, unit, words if words.endswith(symbol) else f"{words}, {symbol}")


_CHOSEN = "teeth_spanned", "ball_diameter_mm"  # by a file, or by `measures`
_MEASURES = (
    _symbol("teeth_spanned", "", "k"),
    _symbol("span_upper_limit", "mm", "W_k"),
    _symbol("span_lower_limit", "mm", "W_k"),
    _symbol("ball_diameter", "mm", "D_M"),
    _symbol("over_balls_upper_limit", "mm", "M_dK"),
    _symbol("over_balls_lower_limit", "mm", "M_dK"),
)
_CLASS = UnitKey("flank_tolerance_class")
_SYMBOLS = {
    "single_pitch": "f_p",
    "total_pitch": "F_p",
    "profile_slope": "f_Halpha",
    "profile_form": "f_falpha",
    "profile_total": "F_alpha",
    "helix_slope": "f_Hbeta",
    "helix_form": "f_fbeta",
    "helix_total": "F_beta",
}
_DEVIATIONS = {name: _symbol(f"{name}_deviation", "um", symbol) for name, symbol in _SYMBOLS.items()}
FACTORS = (
    _symbol("tangential_force", "N", "F_t"),
    _symbol("face_load_factor", "", "K_Hbeta"),
    _symbol("zone_factor", "", "Z_H"),
    _symbol("elasticity_factor", "MPa^0.5", "Z_E"),
    _symbol("contact_ratio_factor", "", "Z_epsilon"),
    _symbol("helix_angle_factor", "", "Z_beta"),
    _symbol("nominal_contact_stress", "MPa", "sigma_H0"),
    _symbol("pinion_single_pair_contact_factor", "", "Z_B"),
    _symbol("wheel_single_pair_contact_factor", "", "Z_D"),
    *(_symbol(f"{gear}_contact_stress", "MPa", "sigma_H") for gear in ("pinion", "wheel")),
    _symbol("root_face_load_factor", "", "K_Fbeta"),
    _symbol("root_helix_angle_factor", "", "Y_beta"),
    *(_symbol(f"{gear}_form_factor", "", "Y_F") for gear in ("pinion", "wheel")),
    *(_symbol(f"{gear}_stress_correction_factor", "", "Y_S") for gear in ("pinion", "wheel")),
    *(_symbol(f"{gear}_nominal_root_stress", "MPa", "sigma_F0") for gear in ("pinion", "wheel")),
    *(_symbol(f"{gear}_root_stress", "MPa", "sigma_F") for gear in ("pinion", "wheel")),
)
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
    """Teeth spanned, ball diameter [mm] (None if not in the file) and flank tolerance class of either gear."""
    classes = quality_classes(file) or (None, None)
    given = (file.drawn[name] for name in ("pinion", "wheel"))
    measured = ([np.asarray(one[key], float) if key in one else None for key in _CHOSEN] for one in given)
    return tuple((*beside, quality) for beside, quality in zip(measured, classes))


def numbers(
    gear: Gear, teeth: Given | None, ball: Given | None, quality: ToleranceClass | None
) -> tuple[tuple[Scalar, ...], ...]:
    """Values of `_MEASURES`, and of `_DEVIATIONS` for a gear with a tolerance class; traceable."""
    upper = gear.tooth_thickness_allowance

    def measured(allowance):
        zero = jnp.zeros_like(allowance)
        thick = changed(gear, tooth_thickness_allowance=allowance, tooth_thickness_tolerance=zero)  # unchecked
        return measures(thick, teeth, ball)

    of = jax.vmap(measured)(jnp.stack([upper, upper - gear.tooth_thickness_tolerance]))
    stated = () if quality is None else tuple(iso_rounded(getattr(quality, name)) for name in _DEVIATIONS)
    return (of.teeth[0], *of.span, of.ball[0], *of.over_balls), stated


def drawing(found: tuple[tuple[Any, ...], ...], quality: ToleranceClass | None) -> dict[str, Any]:
    """Drawing data of a gear from its `numbers`, by name and unit; without measures that do not touch the involute."""
    measured, deviations = ([np.asarray(number).item() for number in several] for several in found)
    data: dict[str, Any] = {key: value for key, value in zip(_MEASURES, measured) if np.isfinite(value)}
    data[_MEASURES[0]] = int(data[_MEASURES[0]])
    if quality is not None:
        data[_CLASS] = int(quality.quality_class)
    return data | dict(zip(_DEVIATIONS.values(), deviations))


def gear_tables(data: Mapping[str, Mapping[str, Any]]) -> list[Table]:
    """Tables of the data of `gears`: both gears side by side, the pair, and the drawing data."""
    geometry, drawn = data["geometry"], data["drawing"]
    both = {name: geometry[name] for name in ("pinion", "wheel")}
    known = [key for key in (*_MEASURES, _CLASS, *_DEVIATIONS.values()) if any(key in gear for gear in drawn.values())]
    note = _TOLERANCE_NOTE if _CLASS in known else ""
    return [
        _side_by_side(list(both["pinion"] | both["wheel"]), both, "gears"),
        _side_by_side(list(geometry["pair"]), {"pair": geometry["pair"]}, "pair"),
        _side_by_side(known, drawn, "drawing data", note),
    ]


def rating_page(designs: Mapping[str, Factors]) -> Chapter:
    """Chapter with the rating factors of ISO 6336 of several designs side by side."""
    return Chapter("Rating by ISO 6336", tables=[_side_by_side(FACTORS, designs, "", _RATING_NOTE)])


def _side_by_side(
    keys: Sequence[UnitKey], columns: Mapping[str, Mapping[str, Any]], title: str, note: str = ""
) -> Table:
    """Table of numbers, one line per key and one column per name."""
    rows = tuple((key.heading, *(text(of.get(key)) for of in columns.values())) for key in keys)
    return Table(("", *columns), rows, title, note)


class _Meshing(NamedTuple):
    """A gear, its outline, roll lengths at pitch point and ends of the active profile [mm], and tip clearance."""

    gear: Gear
    outline: Outline
    pitch: Scalar
    active: tuple[Scalar, ...]
    tip_clearance: Scalar


class _Mated(NamedTuple):
    """A pair, its path of contact and its backlash on the line of action [um]."""

    pair: GearPair
    path: PathOfContact
    backlash: Scalar


_BORE, _RIM = UnitKey("bore_diameter", "mm"), UnitKey("rim_diameter", "mm")
# the names of ISO 21771
_GEAR: dict[UnitKey, Callable[[_Meshing], Scalar | None]] = {
    UnitKey("teeth"): lambda of: of.gear.teeth,
    UnitKey("module", "mm"): lambda of: of.gear.module,
    UnitKey("pressure_angle", "deg"): lambda of: of.gear.pressure_angle,
    UnitKey("profile_shift_coefficient"): lambda of: of.gear.profile_shift,
    UnitKey("generating_profile_shift_coefficient"): lambda of: of.gear.generating_profile_shift,
    UnitKey("face_width", "mm"): lambda of: of.gear.face_width,
    UnitKey("reference_diameter", "mm"): lambda of: of.gear.signed(2 * of.gear.pitch_radius),
    UnitKey("pitch_circle_diameter", "mm"): lambda of: diameter(of.gear, of.pitch),
    UnitKey("base_diameter", "mm"): lambda of: of.gear.signed(2 * of.gear.base_radius),
    UnitKey("tip_diameter", "mm"): lambda of: of.gear.signed(2 * of.gear.tip_radius),
    UnitKey("tip_form_diameter", "mm"): lambda of: of.gear.signed(2 * of.gear.tip_form_radius),
    UnitKey("root_diameter", "mm"): lambda of: of.gear.signed(2 * of.gear.root_circle_radius),
    UnitKey("root_form_diameter", "mm"): lambda of: diameter(of.gear, of.outline.form_roll_length),
    UnitKey("active_root_diameter", "mm"): lambda of: diameter(of.gear, of.active[0]),
    UnitKey("active_tip_diameter", "mm"): lambda of: diameter(of.gear, of.active[1]),
    _BORE: lambda of: of.gear.signed(2 * of.gear.bore_radius),
    UnitKey("tip_land", "mm"): lambda of: of.gear.tip_land,
    UnitKey("tip_edge_radius", "mm"): lambda of: of.gear.edge_radius,
    UnitKey("tip_clearance", "mm"): lambda of: of.tip_clearance,
    UnitKey("tooth_thickness_allowance", "um"): lambda of: of.gear.tooth_thickness_allowance,
    UnitKey("tooth_thickness_tolerance", "um"): lambda of: of.gear.tooth_thickness_tolerance,
}
_HELICAL_GEAR: dict[UnitKey, Callable[[_Meshing], Scalar | None]] = {
    UnitKey("helix_angle", "deg"): lambda of: of.gear.helix_angle,
    UnitKey("base_helix_angle", "deg"): lambda of: jnp.rad2deg(of.gear.base_helix_angle),
    UnitKey("transverse_module", "mm"): lambda of: of.gear.transverse_module,
    UnitKey("transverse_pressure_angle", "deg"): lambda of: jnp.rad2deg(of.gear.transverse_pressure_angle),
    UnitKey("virtual_number_of_teeth"): lambda of: of.gear.virtual_teeth,
}
_BACKLASH, _NORMAL_BACKLASH = UnitKey("backlash_on_line_of_action", "um"), UnitKey("normal_backlash", "um")
_PAIR: dict[UnitKey, Callable[[_Mated], Scalar]] = {
    UnitKey("center_distance", "mm"): lambda of: of.pair.working_center_distance,
    UnitKey("working_pressure_angle", "deg"): lambda of: jnp.rad2deg(of.pair.working_pressure_angle),
    UnitKey("gear_ratio"): lambda of: of.pair.gear_ratio,
    UnitKey("axial_offset", "mm"): lambda of: of.pair.axial_offset,
    UnitKey("common_face_width", "mm"): lambda of: of.pair.face_width,
    UnitKey("base_pitch", "mm"): lambda of: of.path.base_pitch,
    UnitKey("transverse_contact_ratio"): lambda of: of.path.contact_ratio,
    UnitKey("length_of_path_of_contact", "mm"): lambda of: of.path.end - of.path.start,
    UnitKey("path_of_contact_A", "mm"): lambda of: of.path.start,
    UnitKey("path_of_contact_B", "mm"): lambda of: of.path.inner_single,
    UnitKey("path_of_contact_D", "mm"): lambda of: of.path.outer_single,
    UnitKey("path_of_contact_E", "mm"): lambda of: of.path.end,
    _BACKLASH: lambda of: of.backlash,
    UnitKey("least_backlash_on_line_of_action", "um"): lambda of: of.pair.backlash_limits[0],
    UnitKey("largest_backlash_on_line_of_action", "um"): lambda of: of.pair.backlash_limits[1],
}
_HELICAL_PAIR: dict[UnitKey, Callable[[_Mated], Scalar]] = {
    UnitKey("overlap_ratio"): lambda of: of.pair.overlap_ratio,
    UnitKey("total_contact_ratio"): lambda of: of.path.contact_ratio + of.pair.overlap_ratio,
    _NORMAL_BACKLASH: lambda of: of.backlash * jnp.cos(of.pair.pinion.base_helix_angle),
}


def gears(file: DesignFile) -> dict[str, dict[str, dict[str, Any]]]:
    """Geometry of both gears and the pair, and drawing data of the gears, as in every `summary.json`.

    Points of the path of contact are positions from the pitch point C, positive towards the tip of the pinion. The
    usable involute runs from the root form diameter to the tip form diameter. The active part runs from the active root
    diameter d_Nf to the active tip diameter d_Na, which is the tip form diameter unless the mate is undercut. For
    helical gears, module and pressure angle are those of the normal section; base pitch and backlash on the line of
    action are those of the transverse section.
    """
    # gears without backlash have it up to rounding, which is no -0
    choices = chosen(file)
    pair = file.pair()
    shape, drawn = _numbers(pair, pair_geometry(explicit(pair)), choices)
    of_gear, of_pair = _listed(pair)
    pinion, wheel, together = jax.tree.map(lambda number: np.where(np.abs(number) < 1e-9, 0.0, number), shape)
    geometry = {
        "pinion": dict(zip(of_gear, pinion, strict=True)),
        "wheel": {_RIM if key == _BORE and pair.wheel.is_internal else key: of for key, of in zip(of_gear, wheel)},
        "pair": dict(zip(of_pair, together, strict=True)),
    }
    of = zip(("pinion", "wheel"), drawn, choices)
    return {"geometry": geometry, "drawing": {name: drawing(found, given[-1]) for name, found, given in of}}


def mounting(file: DesignFile) -> str:
    """Line on bores, centre distance, backlash and full root radii of the gears."""
    shape = gears(file)["geometry"]
    texts = []
    for name, gear in (("pinion", file.pair().pinion), ("wheel", file.pair().wheel)):
        if isinstance(gear, RingGear):
            guess = "" if gear.rim_diameter is not None else " (a rim of 3.5 modules, as none is given)"
            texts.append(f"rim of the ring gear {float(shape[name][_RIM]):.5g} mm{guess}")
        else:
            guess = "" if gear.bore_diameter is not None else " (half the root diameter, as none is given)"
            texts.append(f"{name} {float(shape[name][_BORE]):.4g} mm{guess}")
    full = [
        f"{name} {float(gear.root_radius):.4g} x module (full radius of the {tool_name(gear)})"
        for name, gear in (("pinion", file.pair().pinion), ("wheel", file.pair().wheel))
        if has_full_radius(gear)
    ]
    rack = f"; root radius: {', '.join(full)}" if full else ""
    pair = shape["pair"]
    mounted = f"centre distance {float(pair['center_distance_mm']):.6g} mm"
    helical = _NORMAL_BACKLASH in pair  # as pair.backlash has it
    name, where = (_NORMAL_BACKLASH, "normal to the flanks") if helical else (_BACKLASH, "on the line of action")
    backlash = round(float(pair[name]), 3) + 0.0  # rounding leaves no -0
    return f"bores: {', '.join(texts)}; {mounted}, backlash {where} {backlash:g} um{rack}"


def _listed(pair: GearPair) -> tuple[dict[UnitKey, Callable[..., Any]], dict[UnitKey, Callable[..., Any]]]:
    """Keys and functions of the numbers of a gear and of the pair."""
    return (_GEAR, _PAIR) if pair.is_spur else (_GEAR | _HELICAL_GEAR, _PAIR | _HELICAL_PAIR)


@program
def _numbers(pair: GearPair, geometry: PairGeometry, choices):
    contact, room = geometry.path_of_contact, geometry.margins
    ends = contact.start, contact.end
    of_gear, of_pair = _listed(pair)
    placed = (
        _Meshing(
            pair.pinion,
            geometry.outlines[0],
            contact.pinion_pitch_roll_length,
            tuple(map(contact.pinion_roll_length, ends)),
            room.pinion_tip_clearance,
        ),
        _Meshing(
            pair.wheel,
            geometry.outlines[1],
            contact.wheel_pitch_roll_length,
            tuple(map(contact.wheel_roll_length, reversed(ends))),
            room.wheel_tip_clearance,
        ),
    )
    shape = [
        *(tuple(compute(gear) for compute in of_gear.values()) for gear in placed),
        tuple(compute(_Mated(pair, contact, room.backlash)) for compute in of_pair.values()),
    ]
    return shape, [numbers(gear, *given) for gear, given in zip(pair.gears, choices)]
