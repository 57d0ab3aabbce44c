"""Start points of a search."""

import jax
import jax.numpy as jnp
import numpy as np
import scipy

from .problem import Problem


def start_points(problem: Problem, count: int) -> np.ndarray:
    """The middle of the box, then a Halton sequence: deterministic, so that a design file always gives one answer."""
    points = scipy.stats.qmc.Halton(len(problem.names), scramble=False).random(count)
    points[0] = 0.5
    return points.astype(np.dtype(problem.low.dtype))


def points_nearby(point: np.ndarray, count: int, *, reach: float, seed: int) -> np.ndarray:
    """A Halton sequence in the cube of so much reach about a point of the unit box, moved inside where it sticks out.

    Every seed gives other points, always the same.
    """
    corner = np.clip(point - reach, 0.0, 1.0 - 2 * reach)
    return corner + 2 * reach * scipy.stats.qmc.Halton(len(point), scramble=True, seed=seed).random(count)


def real_points(problem: Problem, points) -> jax.Array:
    """Points of the unit box in the type of the problem."""
    return jnp.asarray(points, problem.low.dtype)
