"""Rules that size crowning and end relief against misalignment.

References:
    ISO 6336-1, Annex B (guide values for crowning and end relief), as quoted in secondary sources. The
    annex adds a manufacturing tolerance of 5 to 10 um to the amounts (5 um for stiff gears), which is left out here,
    and finds 60 to 70 % of the crowning enough for very precise high-speed gears.
"""

from typing import Literal

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import GearPair
from ..microgeometry import EndRelief, LeadCrowning
from ..numerics import Given, check, real

Scalar = Float[Array, ""]
Kind = Literal["through_hardened", "surface_hardened", "stiff"]

# ranges of the annex [um]
_CROWNING = (10.0, 40.0)
_STIFF_CROWNING = (10.0, 25.0)


def equivalent_misalignment(helix_tolerance: Given, shaft_deflection: Given) -> Scalar:
    """F_betax_cv = f_sh + 1.5 f_Hbeta [um over the face width], the misalignment that crowning and end relief are for.

    Args:
        helix_tolerance: f_Hbeta, helix slope tolerance [um].
        shaft_deflection: f_sh, misalignment by elastic deflections of shafts and gears [um over the face width].
    """
    check("helix_tolerance", helix_tolerance, "um", low=0.0)
    check("shaft_deflection", shaft_deflection, "um", low=0.0)
    return real(shaft_deflection) + 1.5 * real(helix_tolerance)


def crowning_for_misalignment(misalignment: Given, *, limited: bool = False) -> Scalar:
    """C_beta = 0.5 F_betax [um] (ISO 6336-1 Annex B; the genetic-algorithm study of the 19/48 pair calls it C_c).

    Args:
        misalignment: F_betax [um over the face width], for example `equivalent_misalignment`.
        limited: whether to keep to the range of the annex, 10 to 40 um.
    """
    check("misalignment", misalignment, "um", low=0.0)
    amount = 0.5 * real(misalignment)
    return jnp.clip(amount, *_CROWNING) if limited else amount


def crowning_for_tolerance(helix_tolerance: Given, *, limited: bool = False) -> Scalar:
    """C_beta = f_Hbeta [um], where shafts are stiff or a helix modification compensates their deflection.

    ISO 6336-1 Annex B; also equation 1 of the study of a three-step sizing of modifications, which applies it to both
    gears, on top of what the deflections need and without the range of the annex.

    Args:
        helix_tolerance: f_Hbeta, helix slope tolerance [um].
        limited: whether to keep to the range of the annex, 10 to 25 um.
    """
    check("helix_tolerance", helix_tolerance, "um", low=0.0)
    amount = real(helix_tolerance)
    return jnp.clip(amount, *_STIFF_CROWNING) if limited else amount


def iso_crowning(
    helix_tolerance: Given, shaft_deflection: Given | None = None, *, limited: bool = True
) -> LeadCrowning:
    """Crowning of ISO 6336-1 Annex B, ready to use.

    It counts over the gear's own face: on a gear that is wider than its mate the common face has (common / own)^2 of
    it. There give it to the narrower gear, or widen its amount.

    Args:
        helix_tolerance: f_Hbeta, helix slope tolerance [um].
        shaft_deflection: f_sh [um over the face width]; None where shafts are stiff or their deflection is compensated.
        limited: whether to keep to the ranges of the annex.
    """
    if shaft_deflection is None:
        return LeadCrowning(crowning_for_tolerance(helix_tolerance, limited=limited))
    misalignment = equivalent_misalignment(helix_tolerance, shaft_deflection)
    return LeadCrowning(crowning_for_misalignment(misalignment, limited=limited))


def end_relief_amount(
    helix_tolerance: Given, shaft_deflection: Given = 0.0, *, kind: Kind = "surface_hardened"
) -> Scalar:
    """C_beta I and II [um] of ISO 6336-1 Annex B, for each end of the face.

    f_sh + 1.5 f_Hbeta for through-hardened teeth, half of it for surface-hardened ones, f_Hbeta for "stiff" gears.

    Args:
        helix_tolerance: f_Hbeta, helix slope tolerance [um].
        shaft_deflection: f_sh [um over the face width]; without influence on "stiff".
        kind: "through_hardened", "surface_hardened", or "stiff": stiff shafts or a compensated deflection.

    Raises:
        ValueError: for another kind, or a value out of its range.
    """
    whole = equivalent_misalignment(helix_tolerance, shaft_deflection)
    if kind == "through_hardened":
        return whole
    if kind == "surface_hardened":
        return 0.5 * whole
    if kind == "stiff":
        return real(helix_tolerance)
    raise ValueError(f'kind = {kind!r} must be "through_hardened", "surface_hardened" or "stiff"')


def end_relief_length(pair: GearPair) -> Scalar:
    """Width of each end relief [mm], the smaller of 0.1 b and 1.0 m_n (ISO 6336-1 Annex B)."""
    return jnp.minimum(0.1 * pair.face_width, pair.pinion.module)


def iso_end_relief(
    pair: GearPair, helix_tolerance: Given, shaft_deflection: Given = 0.0, *, kind: Kind = "surface_hardened"
) -> EndRelief:
    """Linear end relief on both ends: `end_relief_amount` over `end_relief_length`.

    For a gear that ends with the common face. On one that is wider than its mate the relief lies at its own ends,
    outside of the contact as far as the gear overhangs (a finding of `findings_of`): give it to the narrower gear.
    """
    return EndRelief(end_relief_amount(helix_tolerance, shaft_deflection, kind=kind), end_relief_length(pair))
