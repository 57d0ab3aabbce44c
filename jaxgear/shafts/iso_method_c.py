"""K_Hbeta by ISO 6336-1 Method C: an estimate in closed form, for comparison with analyses of load over the face.

References:
    ISO 6336-1:2006, clause 7 (Method C); coefficients of f_sh as DIN 3990-11 and ISO 6336-1 give them, quoted
    from secondary sources.
"""

from collections.abc import Collection
from typing import Literal, get_args

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Given, check, real

Scalar = Float[Array, ""]
Arrangement = Literal["a", "b", "c", "d", "e"]
FlankLine = Literal[
    "none", "crowned_for_tolerance", "crowned", "helix_corrected", "helix_corrected_crowned", "end_relief"
]
Hardening = Literal["surface_hardened", "through_hardened", "cast_iron"]

# K' of the arrangements a to e of pinion and bearings: stiffened by the pinion (d1 / d_sh >= 1.15), and not
_ARRANGEMENTS = {"a": (0.48, 0.80), "b": (-0.48, -0.80), "c": (1.33, 1.33), "d": (-0.36, -0.60), "e": (-0.60, -1.0)}
_STIFFENED = 1.15  # d1 / d_sh
# factors B1 and B2, by which flank line modifications reduce f_sh and f_ma
_EFFECTS = {
    "none": (1.0, 1.0),
    "crowned_for_tolerance": (1.0, 0.5),
    "crowned": (0.5, 0.5),
    "helix_corrected": (0.1, 1.0),
    "helix_corrected_crowned": (0.1, 0.5),
    "end_relief": (0.7, 0.7),
}
_DEFLECTION = 0.023  # of an unmodified pair [um mm/N]
_LEAST_PER_LOAD = 0.005  # F_betax,min per line load [um mm/N]
_RUN_IN = 0.15  # y_beta over F_betax of surface-hardened flanks, up to
_RUN_IN_MOST = 6.0  # [um]
_RUN_IN_CAST = 0.55
_RUN_IN_SOFT = 320.0  # over sigma_Hlim [MPa]


def iso_shaft_deflection(
    line_load: Given,
    face_width: Given,
    pitch_diameter: Given,
    shaft_diameter: Given,
    *,
    arrangement: Arrangement,
    span: Given,
    offset: Given,
    power_share: Given = 100.0,
) -> Scalar:
    """f_sh, misalignment by bending and torsion of the pinion and its shaft [um over the face width].

    f_sh = (F_m / b) 0.023 (|B* + K' (l s / d1^2) (d1 / d_sh)^4 - 0.3| + 0.3) (b / d1)^2

    Args:
        line_load: line load F_m / b = F_t K_A K_v / b [N/mm].
        face_width: face width b [mm].
        pitch_diameter: reference diameter d1 of the pinion [mm].
        shaft_diameter: shaft diameter d_sh [mm].
        arrangement: arrangement of pinion, bearings and coupling, a to e of the figure in the standard (K' 0.48/0.80,
            -0.48/-0.80, 1.33, -0.36/-0.60, -0.60/-1.0).
        span: bearing span l [mm].
        offset: distance s of the pinion from the middle of the bearing span, also for an overhung pinion [mm].
        power_share: share k of the power through this mesh [%]; B* = 1 + 2 (100 - k) / k for spur gears.
    """
    values = {"line_load": (line_load, "N/mm"), "offset": (offset, "mm")}
    for name, (value, unit) in values.items():
        check(name, value, unit, low=0.0)
    sizes = {"face_width": face_width, "pitch_diameter": pitch_diameter, "shaft_diameter": shaft_diameter, "span": span}
    for name, value in sizes.items():
        check(name, value, "mm", low=0.0, open_low=True)
    check("power_share", power_share, "%", low=0.0, high=100.0, open_low=True)
    _check_choice("arrangement", arrangement, _ARRANGEMENTS)
    ratio = real(pitch_diameter) / real(shaft_diameter)
    stiffened, plain = _ARRANGEMENTS[arrangement]
    lever = jnp.where(ratio >= _STIFFENED, stiffened, plain)
    through = 1 + 2 * (100 - real(power_share)) / real(power_share)
    bending = lever * real(span) * offset / real(pitch_diameter) ** 2 * ratio**4
    shape = jnp.abs(through + bending - 0.3) + 0.3
    return real(line_load) * _DEFLECTION * shape * (real(face_width) / pitch_diameter) ** 2


def method_c(
    line_load: Given,
    stiffness: Given,
    shaft_deflection: Given,
    misalignment: Given,
    *,
    flank_line: FlankLine = "none",
    helix_tolerance: Given = 0.0,
    hardening: Hardening = "surface_hardened",
    endurance_limit: Given | None = None,
) -> Scalar:
    """K_Hbeta by Method C.

    F_betax = 1.33 B1 f_sh + B2 f_ma, at least max(0.005 F_m / b, 0.5 f_Hbeta); running-in reduces it by y_beta.

    Args:
        line_load: line load F_m / b = F_t K_A K_v / b [N/mm].
        stiffness: mesh stiffness c_gamma_beta [N/(mm um)].
        shaft_deflection: f_sh [um], for instance from `iso_shaft_deflection`.
        misalignment: f_ma [um].
        flank_line: kind of flank line modification, which sets B1 and B2.
        helix_tolerance: helix slope tolerance f_Hbeta [um].
        hardening: hardening of the flanks, which sets the running-in allowance.
        endurance_limit: endurance limit sigma_Hlim [MPa], needed for through-hardened flanks.

    Raises:
        ValueError: for an unknown choice, through-hardened flanks without their endurance limit, or a number out of its
            range.
    """
    check("line_load", line_load, "N/mm", low=0.0, open_low=True)
    check("stiffness", stiffness, "N/(mm um)", low=0.0, open_low=True)
    for name, value in (
        ("shaft_deflection", shaft_deflection),
        ("misalignment", misalignment),
        ("helix_tolerance", helix_tolerance),
    ):
        check(name, value, "um", low=0.0)
    _check_choice("flank_line", flank_line, _EFFECTS)
    first, second = _EFFECTS[flank_line]
    least = jnp.maximum(_LEAST_PER_LOAD * real(line_load), 0.5 * real(helix_tolerance))
    initial = jnp.maximum(1.33 * first * real(shaft_deflection) + second * real(misalignment), least)
    effective = initial - _running_in(initial, hardening, endurance_limit)
    # half the deviation is taken up by the mesh stiffness, unless that leaves part of the face without load
    share = effective * real(stiffness) / real(line_load)
    return jnp.where(share <= 2, 1 + share / 2, jnp.sqrt(2 * jnp.maximum(share, 2.0)))


def _running_in(initial: Scalar, hardening: Hardening, endurance_limit: Given | None) -> Scalar:
    """Running-in allowance y_beta [um]."""
    _check_choice("hardening", hardening, get_args(Hardening))
    if endurance_limit is not None and hardening != "through_hardened":
        raise ValueError(f'endurance_limit has no effect on hardening = "{hardening}"')
    if hardening == "surface_hardened":
        return jnp.minimum(_RUN_IN * initial, _RUN_IN_MOST)
    if hardening == "cast_iron":
        return _RUN_IN_CAST * initial
    if endurance_limit is None:
        raise ValueError("through-hardened flanks need endurance_limit, sigma_Hlim in MPa")
    check("endurance_limit", endurance_limit, "MPa", low=_RUN_IN_SOFT)
    return _RUN_IN_SOFT / real(endurance_limit) * initial


def _check_choice(name: str, value: str, choices: Collection[str]) -> None:
    if value not in choices:
        raise ValueError(f"{name} = {value!r} must be one of {', '.join(choices)}")
