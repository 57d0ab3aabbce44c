"""Bearings with radial clearance, at the loads of a gearbox.

A bearing with clearance c resists with k max(0, |u| - c) in the direction in which the shaft lies against it: the
stiffness across that direction is force over displacement, k (1 - c / |u|). One that does not touch holds nothing
radially; its axial and tilting stiffness act whatever the clearance. The state under all loads, the force of every mesh
even over its face, is found by Newton's method. What the load of a mesh changes about it is taken by the tangent there:
its sum and direction are those of the state, so that only its distribution over the face is seen linearly. Without
clearances all of it is linear and exact.

Where the loads leave a shaft afloat in its clearances nothing holds it, and results are NaN, as where Newton's method
finds no state.
"""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import implicit_root, solve_dense
from .gearbox import Gearbox
from .loads import Patterns, System, load_pattern, solve, system
from .stepped_beam import DIRECTIONS

_WAYS = len(DIRECTIONS)
# What may be left of the conditions, relative to the largest load, over the square root of rounding.
_SOLVED = 1e-2


def system_under_load(gearbox: Gearbox, patterns: list[Patterns]) -> System:
    """`system`, with the tangent of bearings with clearance at the loads of the gearbox."""
    found = system(gearbox, patterns)
    plays = [bearing.play for shaft in gearbox.shafts for bearing in shaft.bearings]
    if all(play is None for play in plays):
        return found
    clearance = jnp.stack([jnp.zeros(()) if play is None else play for play in plays])
    moved = _state(system(gearbox, load_pattern(gearbox)), clearance)
    law = partial(_force, found.bearings, clearance)
    tangent = jax.jacfwd(law)(moved)
    return found._replace(bearings=tangent, play=tangent @ moved - law(moved))


def _force(
    stiffness: Float[Array, "b b"], clearance: Float[Array, " bearings"], moved: Float[Array, " b"]
) -> Float[Array, " b"]:
    """Resistance of the bearings to displacements of their shafts against their seats [N, N mm]."""
    each = moved.reshape(-1, _WAYS)
    square = each[:, 0] ** 2 + each[:, 1] ** 2
    touching = square > clearance**2
    distance = jnp.sqrt(jnp.where(touching, square, 1.0))
    share = jnp.where(touching, clearance / distance, jnp.where(clearance > 0, 1.0, 0.0))
    free = jnp.concatenate([share[:, None] * each[:, :2], jnp.zeros_like(each[:, 2:])], axis=1)
    return stiffness @ (moved - free.ravel())


def _state(of: System, clearance: Float[Array, " bearings"]) -> Float[Array, " b"]:
    """Displacement of the shafts against the seats under the one load of a system."""
    count = len(of.bearings)
    # start and scales only, on which the root does not depend; of no load the direction has no derivative
    linear = jax.lax.stop_gradient(solve(of, jnp.ones((1, 1))))
    resisted = -linear.force[:, 0].reshape(-1, _WAYS)
    size = jnp.sqrt(jnp.sum(resisted[:, :2] ** 2, axis=1, keepdims=True))
    along = jnp.where(size > 0, resisted[:, :2] / jnp.where(size > 0, size, 1.0), 0.0)
    played = jnp.concatenate([clearance[:, None] * along, jnp.zeros_like(resisted[:, 2:])], axis=1).ravel()
    inner, across = of.flexibility[:count, :count] + of.housing, of.flexibility[:count, count]
    here, there = of.moving[:count], of.moving[count]
    # without clearance each shaft lies where the linear solution has it; with it, as far farther as the bearings let it
    bent = linear.bearing[:, 0] - linear.seat[:, 0]
    arm = jnp.maximum(jnp.max(jnp.abs(here), axis=0), 1.0)
    moves = here / arm[None]
    first = solve_dense(moves.T @ moves, moves.T @ (bent + played - across - inner @ linear.force[:, 0]))
    load = jnp.maximum(jnp.max(jnp.abs(linear.force)), jnp.finfo(first.dtype).tiny)
    length = jnp.maximum(jnp.max(jnp.abs(played)), jnp.max(jnp.abs(bent)))

    def displaced(x: Array) -> Array:
        force, moves = load * x[:count], length / arm * x[count:]
        return inner @ force + across + here @ moves

    def conditions(x: Array) -> Array:
        force = load * x[:count]
        resisted = _force(of.bearings, clearance, displaced(x))
        stiff = 1 + jnp.abs(of.bearings) @ jnp.max(jnp.abs(inner), axis=1)
        balance = (here.T @ force + there) / (load * arm) + of.loose * x[count:]
        return jnp.concatenate([(force + resisted) / (load * stiff), balance])

    start = jnp.concatenate([linear.force[:, 0] / load, first / length])
    root = implicit_root(conditions, start)
    missed = jnp.max(jnp.abs(conditions(root))) > _SOLVED * jnp.sqrt(jnp.finfo(start.dtype).eps)
    return jnp.where(missed, jnp.nan, displaced(root))
