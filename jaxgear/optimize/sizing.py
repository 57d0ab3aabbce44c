"""Rules that size a tip relief without solving the mesh.

References:
    ISO 6336-1:2006/2019, Method B (single stiffness c', clause 9) and the optimum relief in its dynamic factor K_v;
    ISO 21771 for relief lengths.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import GearPair, path_of_contact
from ..microgeometry import AbstractCurve, TipRelief
from ..numerics import check, real

Scalar = Float[Array, ""]

# ISO 6336-1 clause 9: minimum flexibility q' of a pair [mm um/N] in 1/z1, 1/z2, x1 and x2
_Q = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
_MODEL_FACTOR = 0.8  # C_M, measured to theoretical single stiffness
_LIGHT_LOAD = 100.0  # line load [N/mm] below which c' falls with its fourth root


class IsoStiffness(eqx.Module):
    """Tooth stiffness of ISO 6336-1 Method B, solid disc bodies, in N/(mm um).

    Attributes:
        theoretical: c'_th.
        single: c', largest stiffness of one pair.
        mesh: c_gamma_alpha, mean of the total mesh stiffness.
    """

    theoretical: Scalar
    single: Scalar
    mesh: Scalar


def iso_stiffness(pair: GearPair, line_load=_LIGHT_LOAD) -> IsoStiffness:
    """Stiffness of ISO 6336-1 Method B.

    Args:
        pair: gear pair; the standard covers x1 >= x2 and -0.5 <= x1 + x2 <= 2.
        line_load: F_t K_A / b [N/mm]; below 100 N/mm the stiffness is reduced.
    """
    check("iso_stiffness", "line_load", line_load, "N/mm", low=0.0)
    pinion, wheel = pair.pinion, pair.wheel
    z1, z2, x1, x2 = pinion.teeth, wheel.teeth, pinion.profile_shift, wheel.profile_shift
    c1, c2, c3, c4, c5, c6, c7, c8, c9 = _Q
    q = c1 + c2 / z1 + c3 / z2 + c4 * x1 + c5 * x1 / z1 + c6 * x2 + c7 * x2 / z2 + c8 * x1**2 + c9 * x2**2
    dedendum = 0.5 * (pinion.dedendum + wheel.dedendum)
    rack = (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20.0 - pinion.pressure_angle))
    first, second = pinion.material.elastic_modulus, wheel.material.elastic_modulus
    steel = 2 * first * second / (first + second) / 206_000.0
    light = jnp.minimum(real(line_load) / _LIGHT_LOAD, 1.0) ** 0.25
    single = _MODEL_FACTOR * rack * steel * light / q
    return IsoStiffness(1 / q, single, single * (0.75 * path_of_contact(pair).contact_ratio + 0.25))


def long_relief_length(pair: GearPair) -> Scalar:
    """Roll length of the double-contact zone, p_b (eps - 1) [mm]: from the outer point of single contact to the tip."""
    path = path_of_contact(pair)
    return path.base_pitch * (path.contact_ratio - 1)


def short_relief_length(pair: GearPair) -> Scalar:
    """Half of `long_relief_length` [mm]: one pitch of unmodified contact remains."""
    return 0.5 * long_relief_length(pair)


def relief_amount(pair: GearPair, torque, application_factor=1.0) -> Scalar:
    """Tip relief C_a = F_t K_A / (b c') [um], the amount that zeroes the profile term B_k of ISO 6336-1's K_v.

    Args:
        pair: gear pair.
        torque: on the pinion [N m].
        application_factor: K_A.
    """
    check("relief_amount", "torque", torque, "N m", low=0.0)
    check("relief_amount", "application_factor", application_factor, "", low=0.0)
    tangential = 1e3 * real(torque) * real(application_factor) / pair.pinion.pitch_radius
    line_load = tangential / pair.face_width
    return line_load / jnp.maximum(iso_stiffness(pair, line_load).single, jnp.finfo(line_load.dtype).tiny)


def iso_relief(pair: GearPair, torque, *, curve: AbstractCurve | None = None, application_factor=1.0) -> TipRelief:
    """Rule-based long tip relief: `relief_amount` over `long_relief_length`, for the tip of either gear."""
    shape = {} if curve is None else {"curve": curve}
    return TipRelief(relief_amount(pair, torque, application_factor), long_relief_length(pair), **shape)
