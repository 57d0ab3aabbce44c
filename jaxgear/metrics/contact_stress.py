"""Nominal contact stress after ISO 6336-2, which the pitting strength of a material is compared with.

The pressure of the contact analysis is another number: the standard's contact ratio factor stands for the sharing of
the load, and strengths are measured by the same formula.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance.plane import combined_modulus
from ..contact import MeshCycle
from ..numerics import Checked, over_batch, result, safe_sqrt
from .face_load import face_load_factor

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
    kinematics = cycle.kinematics
    pair, contact = kinematics.pair, kinematics.path_of_contact
    modulus = combined_modulus(pair.pinion.material, pair.wheel.material, "strain")
    pitch = contact.reduced_radius(0.0)
    sharing = jnp.maximum(4 - contact.contact_ratio, 0.0) / 3
    over_face = face_load_factor(cycle) if kinematics.resolution.slices > 1 else 1.0
    line_load = cycle.force / pair.face_width * over_face
    at_pitch = safe_sqrt(sharing * line_load * modulus / (jnp.pi * pitch))
    worse = (pitch / contact.reduced_radius(single) for single in (contact.inner_single, contact.outer_single))
    return ContactStress(*(at_pitch * jnp.sqrt(jnp.maximum(ratio, 1.0)) for ratio in worse))
