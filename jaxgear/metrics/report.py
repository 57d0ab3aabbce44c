"""A mesh cycle in a few numbers."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import over_batch
from .quantity import quantities

_SUMMARY = (
    "ppte",
    "relative_ppte",
    "mean_te",
    "unloaded_ppte",
    "max_flank_pressure",
    "max_corner_pressure",
    "max_line_load",
    "contact_ratio",
    "effective_contact_ratio",
    "corner_contact_length",
    "corner_force",
    "pinion_root_stress",
    "wheel_root_stress",
    "pinion_local_root_stress",
    "wheel_local_root_stress",
    "pinion_contact_stress",
    "wheel_contact_stress",
    "mesh_loss_factor",
    "force_excitation",
)

_OVER_FACE = ("face_load_factor", "root_face_load_factor", "edge_load_factor")  # of several slices


@over_batch
def summary(cycle: MeshCycle) -> dict[str, Float[Array, ""]]:
    """The numbers that engineers ask for first, by name and unit; traceable, so it can be vmapped."""
    names = _SUMMARY if cycle.kinematics.resolution.slices == 1 else (*_SUMMARY, *_OVER_FACE)
    return {
        "torque_Nm": cycle.torque,
        **{quantities[name].key: quantities[name](cycle) for name in names},
        "converged": jnp.all(cycle.converged),
    }
