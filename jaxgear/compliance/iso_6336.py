"""Tooth stiffness of ISO 6336-1, an estimate in closed form beside the models of this package.

References:
    ISO 6336-1:2006/2019, Method B (single stiffness c', clause 9).
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Gear, GearPair, path_of_contact
from ..numerics import Checked, Given, check, program, real, result

Scalar = Float[Array, ""]

# ISO 6336-1 clause 9: minimum flexibility q' of a pair [mm um/N] in 1/z_n1, 1/z_n2, x1 and x2
_Q = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
_MODEL_FACTOR = 0.8  # C_M, measured to theoretical single stiffness
_LIGHT_LOAD = 100.0  # line load [N/mm] below which c' falls with its fourth root
_WEB_SHARES, _THINNEST_RIM = (0.2, 1.2), 1.0  # limits of b_s / b and s_R / m_n in C_R


class IsoStiffness(Checked):
    """Tooth stiffness of ISO 6336-1 Method B.

    Attributes:
        theoretical: c'_th.
        single: c', largest stiffness of one pair.
        mesh: c_gamma_alpha, mean of the total mesh stiffness.
    """

    theoretical: Scalar = result("N/(mm um)")
    single: Scalar = result("N/(mm um)")
    mesh: Scalar = result("N/(mm um)")


def iso_stiffness(pair: GearPair, line_load: Given = _LIGHT_LOAD) -> IsoStiffness:
    """Stiffness of ISO 6336-1 Method B, of helical gears with their virtual numbers of teeth and times cos(beta).

    Index 1 of its formulas is the gear with fewer teeth, whichever drives; of equal teeth that with more profile shift.
    With a ring gear, 1 / z_n2 and the profile shift of the ring gear count as zero.
    The blank factor C_R = 1 + ln(b_s / b) / (5 exp(s_R / (5 m_n))) is that of gears with `rim_thickness` and
    `web_thickness`, within 0.2 <= b_s / b <= 1.2 and s_R >= m_n, else 1; of two gears it is the mean.

    Args:
        pair: gear pair; the standard covers x1 >= x2 and -0.5 <= x1 + x2 <= 2.
        line_load: F_t K_A / b [N/mm]; below 100 N/mm the stiffness is reduced.
    """
    check("line_load", line_load, "N/mm", low=0.0)
    return _iso_stiffness(pair, real(line_load))


@program
def _iso_stiffness(pair: GearPair, line_load: Scalar) -> IsoStiffness:
    theoretical, single = single_stiffness(pair, line_load)
    return IsoStiffness(theoretical, single, single * (0.75 * path_of_contact(pair).contact_ratio + 0.25))


def single_stiffness(pair: GearPair, line_load: Scalar) -> tuple[Scalar, Scalar]:
    """c'_th and c' of `iso_stiffness` [N/(mm um)]: without the contact ratio, which takes longer to compile."""
    pinion, wheel = pair.gears
    more = (pinion.teeth > wheel.teeth) | ((pinion.teeth == wheel.teeth) & (pinion.profile_shift < wheel.profile_shift))
    of_pinion, of_wheel = ((gear.virtual_teeth, gear.profile_shift) for gear in pair.gears)
    z1, x1 = (jnp.where(more, other, own) for own, other in zip(of_pinion, of_wheel))
    z2, x2 = (jnp.where(more, own, other) for own, other in zip(of_pinion, of_wheel))
    if wheel.is_internal:  # z_n2 is infinite, and its profile shift does not count
        z1, z2 = pinion.virtual_teeth, jnp.full_like(z1, jnp.inf)
        x1, x2 = pinion.profile_shift, jnp.zeros_like(x1)
    c1, c2, c3, c4, c5, c6, c7, c8, c9 = _Q
    q = c1 + c2 / z1 + c3 / z2 + c4 * x1 + c5 * x1 / z1 + c6 * x2 + c7 * x2 / z2 + c8 * x1**2 + c9 * x2**2
    dedendum = 0.5 * (_tooth_dedendum(pinion) + _tooth_dedendum(wheel))
    rack = (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20.0 - pinion.pressure_angle))
    first, second = pinion.material.elastic_modulus, wheel.material.elastic_modulus
    steel = 2 * first * second / (first + second) / 206_000.0
    light = jnp.minimum(line_load / _LIGHT_LOAD, 1.0) ** 0.25
    blank = 0.5 * (_blank_factor(pinion) + _blank_factor(wheel))
    single = _MODEL_FACTOR * blank * rack * steel * light / q * pinion.helix_cosine
    return 1 / q, single


def _tooth_dedendum(gear: Gear) -> Scalar:
    """Coefficient of the dedendum as cut, h_fP + x - x_E, of the basic rack factor C_B."""
    if gear.is_internal or gear.cutter_teeth is not None:  # that of the rack which cuts as deep
        return gear.profile_shift + (gear.pitch_radius - gear.root_circle_radius) / gear.module
    return gear.dedendum + gear.profile_shift - gear.generating_profile_shift


def _blank_factor(gear: Gear) -> Scalar:
    """C_R of one gear."""
    if gear.rim_thickness is None or gear.web_thickness is None:
        return jnp.ones_like(gear.module)
    web = jnp.clip(gear.web_thickness / gear.face_width, *_WEB_SHARES)
    rim = jnp.maximum(gear.rim_thickness / gear.module, _THINNEST_RIM)
    return 1 + jnp.log(web) / (5 * jnp.exp(rim / 5))
