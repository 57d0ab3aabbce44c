"""A mesh cycle in a few numbers."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from .registry import RESULTS, result_key

_SUMMARY = (
    "ppte",
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
    "mesh_loss_factor",
)


def summary(cycle: MeshCycle) -> dict[str, Float[Array, ""]]:
    """The numbers that engineers ask for first, by name and unit; traceable, so it can be vmapped."""
    return {
        "torque_Nm": cycle.torque,
        **{result_key(name): RESULTS[name].of(cycle) for name in _SUMMARY},
        "converged": jnp.all(cycle.converged),
    }


def describe(cycle: MeshCycle) -> str:
    """Short text of a concrete cycle."""
    values = summary(cycle)
    state = "converged" if bool(values["converged"]) else "NOT CONVERGED"
    return "\n".join(
        [
            f"MeshCycle at {float(values['torque_Nm']):g} N m, {cycle.phase.shape[0]} positions, {state}",
            f"  transmission error   mean {float(values['mean_te_um']):.3f} um, "
            f"peak to peak {float(values['ppte_um']):.3f} um",
            f"  flank pressure       max {float(values['max_flank_pressure_MPa']):.0f} MPa",
            f"  root stress          pinion {float(values['pinion_root_stress_MPa']):.0f} MPa, "
            f"wheel {float(values['wheel_root_stress_MPa']):.0f} MPa",
            f"  contact ratio        {float(values['contact_ratio']):.3f}, effective "
            f"{float(values['effective_contact_ratio']):.3f}",
        ]
    )
