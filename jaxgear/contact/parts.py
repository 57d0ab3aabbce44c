"""Meshes of fewer positions that together have those of a fine one: what runs on any of them is compiled once."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .mesh import Mesh, prepare_from


def half_way(mesh: Mesh) -> Mesh:
    """The same mesh half a position later: both together have twice the positions."""
    first = np.asarray(mesh.kinematics.first_phase) + 0.5 / mesh.resolution.positions
    moved = prepare_from(first, mesh.pair, mesh.compliance, mesh.resolution)
    return replace(moved, automatic=mesh.automatic)


def parts(mesh: Mesh, positions: int) -> list[Mesh]:
    """Meshes of so many positions each, evenly over the base pitch, that together have those of a concrete mesh.

    The mesh itself where it has no multiple of so many.
    """
    count, left = divmod(mesh.resolution.positions, positions)
    if left or count == 1:
        return [mesh]
    return [_part(mesh, first, count, positions) for first in range(count)]


def _part(mesh: Mesh, first: int, count: int, positions: int) -> Mesh:
    """Every so many positions from the first one on."""
    moving = mesh.kinematics
    resolution = replace(moving.resolution, positions=positions)
    phase = jnp.asarray(np.asarray(moving.first_phase) + first / moving.resolution.positions, moving.first_phase.dtype)
    taken = jax.tree.map(lambda leaf: np.asarray(leaf)[..., first::count], _by_position(mesh))
    # farther out by as much, over larger steps
    taken[0] = taken[0] / count
    mesh = eqx.tree_at(_by_position, mesh, taken)
    return replace(mesh, kinematics=replace(moving, first_phase=phase, resolution=resolution))


def _by_position(mesh: Mesh) -> list:
    """Everything whose last axis is that of the positions."""
    return [
        mesh.outer_steps,
        mesh.outer_gap,
        mesh.outer_lever,
        mesh.corner_gap,
        mesh.lever,
        mesh.structure,
        mesh.law,
        mesh.width_factor,
        *(side.contact_roll_length for side in mesh.sides),
    ]
