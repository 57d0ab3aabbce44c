"""Meshes of fewer positions that together have those of a fine one: what runs on any of them is compiled once."""

from dataclasses import replace

import equinox as eqx
import jax
import numpy as np

from ..numerics import program
from .mesh import Mesh, prepare_from


def half_way(mesh: Mesh) -> Mesh:
    """The same mesh half a position later: both together have twice the positions."""
    return later(mesh, 0.5)


def later(mesh: Mesh, share: float) -> Mesh:
    """The same mesh a share of a position later."""
    first = np.asarray(mesh.kinematics.first_phase) + share / mesh.resolution.positions
    moved = prepare_from(first, mesh.pair, mesh.compliance, mesh.resolution, mesh.support, mesh.even)
    return replace(moved, automatic=mesh.automatic)


def parts(mesh: Mesh, positions: int) -> list[Mesh]:
    """Meshes of so many positions each, evenly over the base pitch, that together have those of a concrete mesh.

    The mesh itself where it has no multiple of so many.
    """
    count, left = divmod(mesh.resolution.positions, positions)
    if left or count == 1:
        return [mesh]
    return [_part(np.asarray(first), count, mesh) for first in range(count)]


@program
def _part(first, count: int, mesh: Mesh) -> Mesh:
    """Every so many positions from the first one on."""

    def take(leaf):
        rows = leaf.reshape(*leaf.shape[:-1], -1, count)
        return jax.lax.dynamic_index_in_dim(rows, first, axis=-1, keepdims=False)

    moving = mesh.kinematics
    positions = moving.resolution.positions
    taken = jax.tree.map(take, _by_position(mesh))
    taken[0] = taken[0] / count  # as far out, over larger steps
    phase = moving.first_phase + first.astype(moving.first_phase.dtype) / positions
    resolution = replace(moving.resolution, positions=positions // count)
    moved = replace(moving, first_phase=phase, resolution=resolution)
    return eqx.tree_at(lambda m: [*_by_position(m), m.kinematics], mesh, [*taken, moved])


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
