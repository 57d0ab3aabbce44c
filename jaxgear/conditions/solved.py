"""When a number of a mesh cycle counts."""

import jax.numpy as jnp
from jaxtyping import Array, Bool

from ..contact import MeshCycle


def solved(cycle: MeshCycle) -> Bool[Array, "*cycles"]:
    """Whether a cycle was found at all its positions and is finite; with the leading axes of the cycle.

    The transmission error is asked too: reductions of the backend can drop NaN.
    """
    return jnp.all(cycle.converged, axis=-1) & jnp.isfinite(jnp.sum(cycle.transmission_error, axis=-1))
