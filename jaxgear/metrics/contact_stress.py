"""Nominal contact stress after ISO 6336-2, which the pitting strength of a material is compared with.

The pressure of the contact analysis is another number: the standard's contact ratio factor stands for the sharing of
the load, and strengths are measured by the same formula.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance.plane import combined_modulus
from ..contact import MeshCycle
from ..geometry import GearPair, path_of_contact
from ..numerics import Checked, over_batch, result, safe_sqrt
from .face_load import face_load_factor, over_several_slices

Scalar = Float[Array, ""]


class ContactStress(Checked):
    """Nominal contact stress of both gears."""

    pinion: Scalar = result("MPa")
    wheel: Scalar = result("MPa")


@over_batch
def nominal_contact_stress(cycle: MeshCycle) -> ContactStress:
    """sigma_H = Z sigma_H0 sqrt(K_Hbeta) of both gears [MPa], for contact ratios from 1 to 2.

        sigma_H0 = Z_H Z_E Z_eps sqrt(F_t / (d_1 b) (u + 1) / u),      Z_eps = sqrt((4 - eps) / 3)

    which is Z_eps times Hertz's pressure of one pair at the pitch point, in plane strain. Z is Z_B of the pinion and
    Z_D of the wheel: from the pitch point to the inner and outer point of single contact, where that is the worse
    place. K_Hbeta is `face_load_factor`, 1 on one slice. Factors of application and dynamics belong into the torque.

    References:
        ISO 6336-2, clauses 6 and 7 (nominal contact stress, zone factor, single pair contact factors).
    """
    pair = cycle.kinematics.pair
    line_load = cycle.force / pair.face_width * over_several_slices(face_load_factor, cycle)
    return ContactStress(*(safe_sqrt(line_load * square) for square in nominal_stress_squares(pair)))


def nominal_stress_squares(pair: GearPair) -> tuple[Scalar, Scalar]:
    """Squares of `nominal_contact_stress` per line load along the line of action, pinion and wheel [MPa^2 mm/N]."""
    factors = contact_factor_squares(pair)
    at_pitch = factors.contact_ratio * factors.elasticity / path_of_contact(pair).reduced_radius(jnp.zeros(()))
    return at_pitch * factors.pinion_single_pair, at_pitch * factors.wheel_single_pair


class ContactFactors(NamedTuple):
    """Squares of factors of ISO 6336-2 for spur gears.

    Attributes:
        zone: Z_H^2.
        elasticity: Z_E^2 [MPa].
        contact_ratio: Z_eps^2.
        pinion_single_pair, wheel_single_pair: Z_B^2 and Z_D^2, at least 1.
    """

    zone: Scalar
    elasticity: Scalar
    contact_ratio: Scalar
    pinion_single_pair: Scalar
    wheel_single_pair: Scalar


def contact_factor_squares(pair: GearPair) -> ContactFactors:
    """The factors of `nominal_contact_stress` that belong to a pair, whatever its load."""
    contact = path_of_contact(pair)
    pitch = contact.reduced_radius(jnp.zeros(()))
    inner, outer = (pitch / contact.reduced_radius(single) for single in (contact.inner_single, contact.outer_single))
    cosine = jnp.cos(jnp.deg2rad(pair.pinion.pressure_angle))
    return ContactFactors(
        zone=2 / (cosine**2 * jnp.tan(pair.working_pressure_angle)),
        elasticity=combined_modulus(pair.pinion.material, pair.wheel.material, "strain") / jnp.pi,
        contact_ratio=jnp.maximum(4 - contact.contact_ratio, 0.0) / 3,
        pinion_single_pair=jnp.maximum(inner, 1.0),
        wheel_single_pair=jnp.maximum(outer, 1.0),
    )
