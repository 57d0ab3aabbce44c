"""Start points of a search, and true scores of many designs for methods that follow no gradient."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..conditions.join import padded, side_by_side
from ..numerics import kernel
from .goal import counted
from .problem import Problem, Score


def halton(dimensions: int, count: int, seed: int | None = None) -> np.ndarray:
    """Points of a Halton sequence in the unit box, shape (count, dimensions); with a seed scrambled (Owen 2017).

    Those of `scipy.stats.qmc.Halton`, which takes longer to import than a search may take.
    """
    rng = None if seed is None else np.random.default_rng(seed)
    return np.stack([_van_der_corput(count, base, rng) for base in _primes(dimensions)], axis=1)


def _van_der_corput(count: int, base: int, rng: np.random.Generator | None) -> np.ndarray:
    """Numbers whose digits after the point are those of 0, 1, 2, ... from the last one on, or permutations of them."""
    digits = int(np.ceil(54 / np.log2(base))) - 1  # that a double can show
    permuted = np.repeat(np.arange(base)[None], digits, axis=0)
    if rng is not None:
        for each in permuted:
            rng.shuffle(each)
    left, found, place = np.arange(count), np.zeros(count), 1.0
    for each in permuted:
        place /= base
        found += each[left % base] * place
        left //= base
    return found


def _primes(count: int) -> list[int]:
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % prime for prime in found):
            found.append(number)
        number += 1
    return found


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
