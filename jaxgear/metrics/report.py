"""A mesh cycle in a few numbers."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from .load import contact_shock, effective_contact_ratio
from .loss import loss_factor
from .root_stress import root_stress
from .transmission_error import peak_to_peak


def summary(cycle: MeshCycle) -> dict[str, Float[Array, ""]]:
    """The numbers that engineers ask for first, by name and unit; traceable, so it can be vmapped."""
    shock, stress = contact_shock(cycle), root_stress(cycle)
    return {
        "torque_Nm": cycle.torque,
        "ppte_um": peak_to_peak(cycle.transmission_error),
        "mean_te_um": jnp.mean(cycle.transmission_error),
        "unloaded_ppte_um": peak_to_peak(cycle.unloaded_transmission_error),
        "max_flank_pressure_MPa": jnp.max(cycle.contact_pressure),
        "max_corner_pressure_MPa": jnp.max(cycle.corner_pressure),
        "max_line_load_N_per_mm": jnp.max(cycle.line_load),
        "contact_ratio": cycle.mesh.path_of_contact.contact_ratio,
        "effective_contact_ratio": effective_contact_ratio(cycle),
        "corner_contact_length_mm": shock.approach + shock.recess,
        "corner_force_N": shock.force,
        "pinion_root_stress_MPa": jnp.max(stress.pinion),
        "wheel_root_stress_MPa": jnp.max(stress.wheel),
        "mesh_loss_factor": loss_factor(cycle),
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
