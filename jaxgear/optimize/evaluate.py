"""Start points of a search, and true scores of many designs for methods that follow no gradient."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..conditions.join import padded, side_by_side
from ..numerics import halton, kernel
from .goal import counted
from .problem import Problem, Score


def start_points(problem: Problem, count: int) -> np.ndarray:
    """The middle of the box, then a Halton sequence: deterministic, so that a design file always gives one answer."""
    points = halton(len(problem.names), count)
    points[0] = 0.5
    return points.astype(np.dtype(problem.low.dtype))


def points_nearby(point: np.ndarray, count: int, *, reach: float, seed: int) -> np.ndarray:
    """A Halton sequence in the cube of so much reach about a point of the unit box, moved inside where it sticks out.

    Every seed gives other points, always the same.
    """
    corner = np.clip(point - reach, 0.0, 1.0 - 2 * reach)
    return corner + 2 * reach * halton(len(point), count, seed)


def real_points(problem: Problem, points: np.ndarray | Array) -> jax.Array:
    """Points of the unit box in the type of the problem."""
    return jnp.asarray(points, problem.low.dtype)


_INFEASIBLE = 1e6  # rank of a design that passes a limit, above any objective


def scores(problem: Problem, points: np.ndarray | Array) -> Score:
    """Scores of points of the unit box, leading axis (points,), in batches that fit the cache."""
    count = len(points)
    batch = min(side_by_side(problem.mesh, problem.cases.count), count)
    return jax.tree.map(lambda part: part[:count], _scores(problem, real_points(problem, padded(points, batch)), batch))


@kernel
def _scores(problem: Problem, points, batch: int) -> Score:
    return jax.lax.map(problem.score, points, batch_size=batch)


def fitness(score: Score) -> Float[Array, " designs"] | Float[Array, ""]:
    """One number to rank by: the objective, and far above any of them the violation."""
    value, excess = score.value[..., 0], counted(score.violation)
    rank = jnp.where(excess > 0, _INFEASIBLE * (1 + excess), value)
    return jnp.where(jnp.isfinite(value), rank, jnp.inf)
