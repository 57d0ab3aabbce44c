"""One design over torques."""

from collections.abc import Iterable

from ..conditions import solve_case
from ..contact import Mesh, MeshCycle
from ..microgeometry import AbstractModification


def over_torques(
    mesh: Mesh,
    torques: Iterable[float],
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> tuple[MeshCycle, ...]:
    """One design under every one of several torques, by one compiled program whatever the kind of its modifications.

    For figures and reports of a few designs; `jax.vmap` of `solve` is faster for many, and differentiable.

    Args:
        mesh: prepared mesh.
        torques: on the pinion [N m], in any order.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.

    Returns:
        the mesh cycle under every torque.

    Raises:
        TypeError: for something else than a prepared mesh or a modification.
        ValueError: for a negative or non-finite torque, or a modification that varies along the face on a mesh of one
            slice.
    """
    return tuple(solve_case(mesh, float(torque), pinion, wheel) for torque in torques)
