"""What a drawing of the gears says beside their geometry, and the rating of their teeth factor by factor."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Gear
from ..io import DesignFile
from ..io.cases import quality_classes
from ..manufacture import measures
from ..report import Section, Table, heading, text
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
    "nominal_contact_stress_MPa": "sigma_H0",
    "pinion_single_pair_contact_factor": "Z_B",
    "wheel_single_pair_contact_factor": "Z_D",
    "pinion_contact_stress_MPa": "sigma_H",
    "wheel_contact_stress_MPa": "sigma_H",
    "root_face_load_factor": "K_Fbeta",
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
    "Factors of application, dynamics and transverse load distribution belong into the torque and are 1 here; so are "
    "Y_beta, Y_B and Y_DT, for spur gears with solid bodies and contact ratios up to 2. K_Hbeta is that of the contact "
    "analysis, 1 on one slice."
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


def numbers(gear: Gear, teeth, ball, quality: ToleranceClass | None) -> tuple[tuple[Scalar, ...], ...]:
    """`_MEASURES`, and `_DEVIATIONS` where the gear has a class; to be traced."""
    upper = gear.tooth_thickness_allowance

    def measured(allowance):
        thick = replace(gear, tooth_thickness_allowance=allowance, tooth_thickness_tolerance=jnp.zeros_like(allowance))
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


def rating_page(designs: Mapping[str, Factors]) -> Section:
    """The factors of ISO 6336 of several designs, side by side."""
    rows = tuple((_label(name, _FACTORS), *(text(each[name]) for each in designs.values())) for name in _FACTORS)
    return Section("Rating by ISO 6336", tables=[Table(("", *designs), rows, note=_RATING_NOTE)])


def _label(name: str, symbols: Mapping[str, str]) -> str:
    """A number in words, with its symbol and unit."""
    words, bracket, unit = heading(name).partition(" [")
    return f"{words}, {symbols[name]}".rstrip(", ") + bracket + unit
