"""The cycle of one case, and when its numbers count."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Bool

from ..contact import Mesh, MeshCycle, removed_material, solve_removed
from ..microgeometry import AbstractModification, NoModification


def solve_case(
    mesh: Mesh,
    torque,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    deviation: Any = None,
) -> MeshCycle:
    """The cycle of a design by the compiled program that serves every kind of modification.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], scalar; or an `Operation`.
        pinion, wheel: modifications; None for nominal involutes.
        deviation: material that manufacturing deviations remove besides [um], shape (pairs, slices, positions), or a
            scalar; None for perfect gears.
    """
    pinion, wheel = pinion or NoModification(), wheel or NoModification()
    removed = removed_material(mesh, torque, pinion=pinion, wheel=wheel)
    removed = removed if deviation is None else removed + deviation
    return solve_removed(mesh, torque, removed, pinion=pinion, wheel=wheel)


def solved(cycle: MeshCycle) -> Bool[Array, "*cycles"]:
    """Whether a cycle was found at all its positions and is finite; with the leading axes of the cycle.

    The transmission error is asked too: reductions of the backend can drop NaN.
    """
    return jnp.all(cycle.converged, axis=-1) & jnp.isfinite(jnp.sum(cycle.transmission_error, axis=-1))
