"""Rules of standards and papers that size a modification from the load: they evaluate formulas and search nothing."""

from typing import Literal

import jax.numpy as jnp
from jaxtyping import Array, Float

from .compliance import IsoStiffness as IsoStiffness
from .compliance import iso_stiffness as iso_stiffness
from .compliance.iso_6336 import single_stiffness
from .contact import MeshCycle
from .geometry import GearPair, PathOfContact, path_of_contact
from .metrics import secant_stiffness
from .microgeometry import AbstractCurve, TipRelief
from .numerics import Given, check, minimum, real, safe_divide

Scalar = Float[Array, ""]


def long_relief_length(pair: GearPair, path: PathOfContact | None = None) -> Scalar:
    """Roll length of the double-contact zone, p_b (eps_alpha - 1) [mm]: from the outer point of single contact to the
    tip, in any transverse section of a helical pair.

    Args:
        pair: gear pair.
        path: its path of contact where it is known.
    """
    path = path_of_contact(pair) if path is None else path
    return path.base_pitch * (path.contact_ratio - 1)


def short_relief_length(pair: GearPair) -> Scalar:
    """Half of `long_relief_length` [mm]: one pitch of unmodified contact remains."""
    return 0.5 * long_relief_length(pair)


def relief_amount(pair: GearPair, torque: Given, application_factor: Given = 1.0) -> Scalar:
    """Tip relief C_a = F_t K_A / (b c') [um], the amount that zeroes the profile term B_k of ISO 6336-1's K_v.

    It is the deflection of one pair under the whole load. A study of industrial gearboxes starts from a simple rule of
    Niemann (Maschinenelemente II) without printing it; that formula was not at hand, so this one replaces it.

    Args:
        pair: gear pair.
        torque: torque on the pinion [N m].
        application_factor: K_A.
    """
    line_load = _line_load(pair, torque, application_factor)
    return _over(line_load, single_stiffness(pair, line_load)[1])


def effective_relief(
    pair: GearPair, torque: Given, application_factor: Given = 1.0, mesh_load_factor: Given = 1.0
) -> Scalar:
    """Effective tip relief C_eff = K_A K_mp F_t / (b cos(alpha_t) c_gamma) [um], the mean deflection of the mesh.

    Equation B.1 of ISO/TR 13989-1 (scuffing), also in ISO/TS 6336-20, as quoted in secondary sources. c_gamma is the
    mesh stiffness c_gamma_alpha; some prints multiply it by the contact ratio, which it already contains.

    Args:
        pair: gear pair.
        torque: torque on the pinion [N m].
        application_factor: K_A.
        mesh_load_factor: K_mp, uneven sharing between several meshes.
    """
    check("mesh_load_factor", mesh_load_factor, "", low=0.0)
    line_load = _line_load(pair, torque, application_factor)
    normal = line_load * real(mesh_load_factor) / jnp.cos(pair.pinion.transverse_pressure_angle)
    return _over(normal, iso_stiffness(pair, line_load).mesh)


def mesh_stiffness_relief(pair: GearPair, torque: Given, application_factor: Given = 1.0) -> Scalar:
    """Delta_max = (K_A F_t / b) / (epsilon_alpha c_gamma) [um], as printed in the genetic-algorithm study of the 19/48
    pair; for comparison with it only.

    The study calls it an ISO formula, but ISO 6336 does not contain it, and it counts the contact ratio twice: c_gamma
    contains it. It gives 3.1 um where the study itself states 7.81 um at 97.5 N/mm. That is, within 3 %, F_t / (b c')
    with the stiffness c' of one pair: use `relief_amount`.

    Args:
        pair: gear pair.
        torque: torque on the pinion [N m].
        application_factor: K_A.
    """
    line_load = _line_load(pair, torque, application_factor)
    return _over(line_load, path_of_contact(pair).contact_ratio * iso_stiffness(pair, line_load).mesh)


def run_in_relief(hertz_limit: Given) -> Scalar:
    """Tip relief that running in wears off, C_ay = (sigma_Hlim / 97 - 18.45)^2 / 18 + 1.5 [um] (ISO 6336-1).

    It replaces the relief in K_v where none was ground; of two materials take the mean. As quoted in secondary sources.
    The parabola is least, 1.5 um, at 1790 MPa: below, harder flanks run in less.

    Args:
        hertz_limit: allowable contact stress number sigma_Hlim of the softer flank's material [MPa].
    """
    check("hertz_limit", hertz_limit, "MPa", low=0.0, open_low=True)
    return (real(hertz_limit) / 97.0 - 18.45) ** 2 / 18.0 + 1.5


def dynamic_relief(cycle: MeshCycle, internal_force: Given = 0.0, external_force: Given = 0.0) -> Scalar:
    """Tip relief for loads that vibrate, C_max = W_dmax / K_vmin = (F_m + F_ah + F_aT) / K_vmin [um].

    The rule of the study of dynamic modification. F_m is the static force of the cycle and K_vmin its smallest secant
    stiffness, so that without further forces it is the largest deflection of the mesh; zero at zero torque, where there
    is no secant.

    Args:
        cycle: loaded mesh; its own modification counts, so take the unmodified one.
        internal_force: F_ah, amplitude from the transmission error on the line of action [N].
        external_force: F_aT, amplitude of the fluctuation of the load on the line of action [N].
    """
    check("internal_force", internal_force, "N", low=0.0)
    check("external_force", external_force, "N", low=0.0)
    stiffness = secant_stiffness(cycle)
    return safe_divide(cycle.force + real(internal_force) + real(external_force), minimum(stiffness))


def iso_relief(
    pair: GearPair,
    torque: Given,
    *,
    curve: AbstractCurve | None = None,
    application_factor: Given = 1.0,
    path: PathOfContact | None = None,
) -> TipRelief:
    """Rule-based long tip relief: `relief_amount` over `long_relief_length`, for the tip of either gear."""
    shape = {} if curve is None else {"curve": curve}
    return TipRelief(relief_amount(pair, torque, application_factor), long_relief_length(pair, path), **shape)


def _line_load(pair: GearPair, torque: Given, application_factor: Given) -> Scalar:
    """F_t K_A / b [N/mm], tangential at the reference circle."""
    check("torque", torque, "N m", low=0.0)
    check("application_factor", application_factor, "", low=0.0)
    tangential = 1e3 * real(torque) * real(application_factor) / pair.pinion.pitch_radius
    return tangential / pair.face_width


def _over(load: Scalar, stiffness: Scalar) -> Scalar:
    """Deflection [um]; the stiffness of the standard vanishes with the load, but more slowly."""
    return load / jnp.maximum(stiffness, jnp.finfo(load.dtype).tiny)


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
        limited: True for amounts limited to the range of the annex, 10 to 40 um.
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
        limited: True for amounts limited to the range of the annex, 10 to 25 um.
    """
    check("helix_tolerance", helix_tolerance, "um", low=0.0)
    amount = real(helix_tolerance)
    return jnp.clip(amount, *_STIFF_CROWNING) if limited else amount


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
