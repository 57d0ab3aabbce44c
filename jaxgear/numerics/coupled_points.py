"""Unilateral contact of many points that are all coupled, under one common approach.

Forces f >= 0 and openings y >= 0 of n points with a dense, symmetric positive definite compliance M:

    y = M f + gap - d >= 0,    f y = 0,    sum f = load

This linear complementarity problem is the optimality condition of a strictly convex programme: the solution exists and
is unique. The points in contact are found by Newton's method on their set, which ends after few steps with the exact
set; should it run in a circle, one point at a time changes sides. Derivatives of any order are those of the linear
equations of the final set.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .dense import solve_dense

Vector = Float[Array, " points"]

_TOGETHER = 20  # steps in which all points change sides at once: five or so are enough as a rule
_STEPS = 200
# What may be left of any condition, relative to the largest term in it, in units of rounding.
_ROUNDING = 1e4


class Pressed(eqx.Module):
    """Points pressed together.

    Attributes:
        force: f, shape (points,).
        approach: d.
        opening: y, shape (points,).
        in_contact: shape (points,).
        converged: True if all conditions hold.
    """

    force: Vector
    approach: Float[Array, ""]
    opening: Vector
    in_contact: Bool[Array, " points"]
    converged: Bool[Array, ""]


def press(compliance: Float[Array, "points points"], gap: Vector, load: Float[Array, ""]) -> Pressed:
    """Solves the problem for a load that is not negative.

    Args:
        compliance: M.
        gap: gap of the points without load.
        load: sum of all forces.

    Returns:
        the solution, differentiable in all three; where a point just touches, from one side.
    """
    start = jnp.ones(gap.shape, bool)
    fixed = jax.lax.stop_gradient((compliance, gap, load))

    def unfinished(state):
        _, changed, step = state
        return jnp.any(changed) & (step < _STEPS)

    def advance(state):
        active, _, step = state
        wanted = _signs(*_at(active, *fixed)[::2])
        changed = wanted != active
        one = changed & (jnp.cumsum(changed) == 1)
        return jnp.where(step < _TOGETHER, wanted, active ^ one), changed, step + 1

    active, *_ = jax.lax.while_loop(unfinished, advance, (start, start, 0))
    force, approach, opening = _at(active, compliance, gap, load)
    eps = _ROUNDING * jnp.finfo(gap.dtype).eps
    scale = jnp.max(jnp.abs(compliance)) * load + jnp.max(jnp.abs(gap)) - jnp.min(gap)
    holds = jnp.all(force >= -eps * load) & jnp.all(opening >= -eps * scale)
    return Pressed(force, approach, opening, active, holds)


def _at(active: Bool[Array, " points"], compliance, gap, load):
    """Forces, approach and openings for a given set of points in contact."""
    n = len(gap)
    on = active.astype(gap.dtype)
    # what a point without force is scaled with leaves the equations of comparable size
    size = jnp.max(jnp.diagonal(compliance))
    inside = on[:, None] * on[None, :] * compliance + jnp.diag((1 - on) * size)
    matrix = jnp.zeros((n + 1, n + 1), gap.dtype).at[:n, :n].set(inside)
    matrix = matrix.at[:n, n].set(-on * size).at[n, :n].set(on * size)
    found = solve_dense(matrix, jnp.append(-on * gap, size * load))
    force, approach = on * found[:n], size * found[n]
    return force, approach, (1 - on) * (compliance @ force + gap - approach)


def _signs(force: Vector, opening: Vector) -> Bool[Array, " points"]:
    """Points that should be in contact: those under load or overlapping, at least the nearest one."""
    value = jnp.where(opening == 0, force, -opening)
    return value >= jnp.minimum(jnp.max(value), 0.0)
