"""True scores of many designs, for methods that follow no gradient."""

import jax
import jax.numpy as jnp

from ..conditions.batches import padded, side_by_side
from ..numerics import kernel
from .goal import counted
from .problem import Problem, Score
from .starts import real_points

_INFEASIBLE = 1e6  # rank of a design that passes a limit, above any objective


def scores(problem: Problem, points) -> Score:
    """Scores of points of the unit box, leading axis (points,), in batches that fit the cache."""
    count = len(points)
    batch = min(side_by_side(problem.mesh, problem.cases.count), count)
    return jax.tree.map(lambda part: part[:count], _scores(problem, real_points(problem, padded(points, batch)), batch))


@kernel
def _scores(problem: Problem, points, batch: int) -> Score:
    return jax.lax.map(problem.score, points, batch_size=batch)


def fitness(score: Score):
    """One number to rank by: the objective, and far above any of them the violation."""
    value, excess = score.value[..., 0], counted(score.violation)
    rank = jnp.where(excess > 0, _INFEASIBLE * (1 + excess), value)
    return jnp.where(jnp.isfinite(value), rank, jnp.inf)
