"""True scores of many designs, for methods that follow no gradient."""

import equinox as eqx
import jax
import jax.numpy as jnp

from .goal import FEASIBLE
from .problem import Problem, Score

_POINTS_SIDE_BY_SIDE = 2**12  # contact points that advance together, whose arrays fit the cache of a CPU
_INFEASIBLE = 1e6  # rank of a design that passes a limit, above any objective


def scores(problem: Problem, points) -> Score:
    """Scores of points of the unit box, leading axis (points,), in batches that fit the cache."""
    count, batch = len(points), min(batch_size(problem), len(points))
    # whole batches only: the rest would be a program of its own, compiled for the length of the contact solution
    padded = jnp.concatenate([points, jnp.repeat(points[-1:], -count % batch, axis=0)])
    return jax.tree.map(lambda part: part[:count], _scores(problem, padded, batch))


@eqx.filter_jit
def _scores(problem: Problem, points, batch: int) -> Score:
    return jax.lax.map(problem.score, points, batch_size=batch)


def batch_size(problem: Problem) -> int:
    """Designs side by side."""
    size = problem.mesh.resolution
    return max(_POINTS_SIDE_BY_SIDE // (size.positions * size.slices * problem.cases.count), 1)


def fitness(score: Score):
    """One number to rank by: the objective, and far above any of them the violation."""
    value = score.value[..., 0]
    rank = jnp.where(score.violation > FEASIBLE, _INFEASIBLE * (1 + score.violation), value)
    return jnp.where(jnp.isfinite(value), rank, jnp.inf)
