"""What of the transmission error excites vibration: its share of the deflection, and the force that goes with it."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import over_batch, safe_divide

Curve = Float[Array, " positions"]


@over_batch
def relative_transmission_error(cycle: MeshCycle) -> Curve:
    """Loaded transmission error over its mean; its peak to peak is PPTE as a share of the mean loaded error.

    It compares gears of different size and load. With no load the error has no mean, and the result is 0.
    """
    return safe_divide(cycle.transmission_error, jnp.mean(cycle.transmission_error))


@over_batch
def force_excitation(cycle: MeshCycle) -> Curve:
    """Force by which the mesh excites vibration [N]: k(psi) (TE(psi) - mean TE), with the local mesh stiffness k.

    Gears of great inertia turn uniformly, at the mean transmission error: the force between their flanks differs from
    the static one by this much, to first order. With a constant stiffness it is that times the variation of the loaded
    transmission error, the excitation of linear models.

    References:
        H. N. Ozguven, D. R. Houser, J. Sound Vib. 125 (1988) 71-83, on the loaded static transmission error as the
        excitation; for the local slope Cooley, Liu, Dai, Parker, Mech. Mach. Theory 105 (2016) 540-553.
    """
    return excited_by(cycle.transmission_error, cycle.tangent_stiffness)


def excited_by(error, stiffness):
    """The same of a transmission error [um] and mesh stiffness [N/um] at the same positions, in NumPy or JAX."""
    return stiffness * (error - error.mean())
