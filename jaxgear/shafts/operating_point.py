"""Bearings with radial clearance, linearized at the loads of a gearbox.

A bearing with clearance c resists with k max(0, |u| - c) in the direction of the displacement u; the stiffness across
that direction is force over displacement, k (1 - c / |u|). A bearing without contact has no radial stiffness; axial and
tilting stiffness do not depend on the clearance. Newton's method finds the state under all loads, with mesh forces even
over their faces. A change of the distribution of a mesh force over its face is treated by the tangent at this state;
the sum and direction of the force are those of the state. Without clearances the system is linear and exact.

Results are NaN if a shaft floats in its clearances without contact, and if Newton's method does not converge.
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
# Tolerance of the residual, relative to the largest load, over the square root of the machine precision.
_SOLVED = 1e-2


def system_under_load(gearbox: Gearbox, patterns: list[Patterns]) -> System:
    """Equations of a gearbox as `system`, with bearings with clearance replaced by their tangent at the loads."""
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
    """Resisting forces of bearings with clearance [um], for displacements of shafts against seats [N, N mm]."""
    each = moved.reshape(-1, _WAYS)
    square = each[:, 0] ** 2 + each[:, 1] ** 2
    touching = square > clearance**2
    distance = jnp.sqrt(jnp.where(touching, square, 1.0))
    share = jnp.where(touching, clearance / distance, jnp.where(clearance > 0, 1.0, 0.0))
    free = jnp.concatenate([share[:, None] * each[:, :2], jnp.zeros_like(each[:, 2:])], axis=1)
    return stiffness @ (moved - free.ravel())


def _state(of: System, clearance: Float[Array, " bearings"]) -> Float[Array, " b"]:
    """Displacements of the shafts against the seats under the single load of a system [um, mrad]."""
    count = len(of.bearings)
    # only start and scales, on which the root does not depend; the direction has no derivative at zero load
    linear = jax.lax.stop_gradient(solve(of, jnp.ones((1, 1))))
    resisted = -linear.force[:, 0].reshape(-1, _WAYS)
    size = jnp.sqrt(jnp.sum(resisted[:, :2] ** 2, axis=1, keepdims=True))
    along = jnp.where(size > 0, resisted[:, :2] / jnp.where(size > 0, size, 1.0), 0.0)
    played = jnp.concatenate([clearance[:, None] * along, jnp.zeros_like(resisted[:, 2:])], axis=1).ravel()
    inner, across = of.flexibility[:count, :count] + of.housing, of.flexibility[:count, count]
    here, there = of.moving[:count], of.moving[count]
    # start: the linear solution, moved on by the clearance in the direction of the bearing force
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
        balance = (here.T @ force + there) / (load * arm) + of.unsupported * x[count:]
        return jnp.concatenate([(force + resisted) / (load * stiff), balance])

    start = jnp.concatenate([linear.force[:, 0] / load, first / length])
    root = implicit_root(conditions, start)
    missed = jnp.max(jnp.abs(conditions(root))) > _SOLVED * jnp.sqrt(jnp.finfo(start.dtype).eps)
    return jnp.where(missed, jnp.nan, displaced(root))
