"""Nominal contact stress after ISO 6336-2, which the pitting strength of a material is compared with.

The pressure of the contact analysis is another number: the standard's contact ratio factor stands for the sharing of
the load, and strengths are measured by the same formula.
"""

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
    contact = path_of_contact(pair)
    modulus = combined_modulus(pair.pinion.material, pair.wheel.material, "strain")
    pitch = contact.reduced_radius(jnp.zeros(()))
    sharing = jnp.maximum(4 - contact.contact_ratio, 0.0) / 3
    at_pitch = sharing * modulus / (jnp.pi * pitch)
    worse = (pitch / contact.reduced_radius(single) for single in (contact.inner_single, contact.outer_single))
    pinion, wheel = (at_pitch * jnp.maximum(ratio, 1.0) for ratio in worse)
    return pinion, wheel
