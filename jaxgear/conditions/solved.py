"""The cycle of one case, and when its numbers count."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

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
        torque: on the pinion [N m], scalar; or an `OperatingPoint`.
        pinion, wheel: modifications; None for nominal involutes.
        deviation: material that manufacturing deviations remove besides [um], shape (pairs, slices, positions), or a
            scalar; None for nominal gears.
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


def deviation_of(cycle: MeshCycle, mesh: Mesh) -> Float[Array, "pairs slices positions"]:
    """Material that deviations have removed from the gears of a cycle, besides its modifications [um].

    Of a cycle whose modifications are not known it is all that was removed.
    """
    flanks = {"pinion": cycle.pinion, "wheel": cycle.wheel}
    deviation = cycle.gap - mesh.corner_gap[:, None] - removed_material(mesh, cycle.torque, **flanks).amount
    if cycle.pinion is None or cycle.wheel is None:
        return deviation
    return jax.lax.stop_gradient(deviation)  # of the design it does not depend but by rounding
