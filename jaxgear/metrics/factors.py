"""The factors of ISO 6336 whose products are the nominal stresses of a mesh, one by one."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..geometry import path_of_contact
from ..numerics import over_batch, safe_sqrt
from .contact_stress import contact_factor_squares
from .face_load import face_load_factor, over_several_slices, root_face_load_factor
from .root_stress import root_factors


@over_batch
def rating_factors(cycle: MeshCycle) -> dict[str, Float[Array, ""]]:
    """Loads, factors and stresses of both gears, by name and unit; of contact ratios from 1 to 2.

        sigma_H0 = Z_H Z_E Z_eps sqrt(F_t / (d_1 b) (u + 1) / u)     sigma_H = Z_B sigma_H0 sqrt(K_Hbeta), wheel: Z_D
        sigma_F0 = F_t / (b m) Y_F Y_S                               sigma_F = sigma_F0 K_Fbeta

    The stresses are those of `nominal_contact_stress` and `nominal_root_stress`.

    References:
        ISO 6336-2 clauses 6 and 7, ISO 6336-3 clauses 5 to 7 (Method B).
    """
    pair, path = cycle.kinematics.pair, path_of_contact(cycle.kinematics.pair)
    module, cosine = pair.pinion.module, jnp.cos(jnp.deg2rad(pair.pinion.pressure_angle))
    squares = contact_factor_squares(pair)
    one = jnp.ones_like(module)
    face, root_face = (one * over_several_slices(of, cycle) for of in (face_load_factor, root_face_load_factor))
    zone, elasticity, sharing, *single = map(safe_sqrt, squares)
    tangential = cycle.force * cosine
    per_area = tangential / (2 * pair.pinion.pitch_radius * pair.face_width)
    pitting = zone * elasticity * sharing * safe_sqrt(per_area * (1 + 1 / pair.gear_ratio))
    found = {
        "tangential_force_N": tangential,
        "face_load_factor": face,
        "root_face_load_factor": root_face,
        "zone_factor": zone,
        "elasticity_factor_sqrt_MPa": elasticity,
        "contact_ratio_factor": sharing,
        "nominal_contact_stress_MPa": pitting,
    }
    for name, factor in zip(("pinion", "wheel"), single):
        found[f"{name}_single_pair_contact_factor"] = factor
        found[f"{name}_contact_stress_MPa"] = pitting * factor * safe_sqrt(face)
    rolls = path.pinion_roll_length(path.outer_single), path.wheel_roll_length(path.inner_single)
    for name, gear, roll in zip(("pinion", "wheel"), pair.gears, rolls):
        factors = root_factors(gear, roll)
        bending = tangential / (pair.face_width * module) * factors.form * factors.correction
        found[f"{name}_form_factor"] = factors.form
        found[f"{name}_stress_correction_factor"] = factors.correction
        found[f"{name}_nominal_root_stress_MPa"] = bending
        found[f"{name}_root_stress_MPa"] = bending * root_face
    return found
