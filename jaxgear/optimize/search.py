"""Record of a search, start points, and true scores of many designs."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..conditions.join import padded, side_by_side
from ..contact.status import explanation, tally
from ..numerics import Callback, Given, halton, kernel
from .goal import counted
from .linear_model import Linearizer, LinearModel
from .problem import Problem, Score, real_points


class Record:
    """Record of a search: best design so far, contact analyses spent, and progress callback.

    A design that meets the constraints is better than one that does not; otherwise the smaller violation is better.
    """

    def __init__(self, problem: Problem, callback: Callback | None) -> None:
        self.problem = problem
        self.evaluations = 0
        self.point = np.full(len(problem.names), 0.5)
        self.value, self.violation = float("inf"), float("inf")
        self.model: LinearModel | None = None  # linearization at the best design; None if the method makes none
        self.linearizer: Linearizer | None = None  # linearizer of `model`
        self.history: list[tuple[int, float, int]] = []  # analyses, value, and positions of the mesh that it is of
        self._callback = callback

    def on(self, problem: Problem) -> "Record":
        """New record of the problem on another mesh, with the spent analyses and the history of this record."""
        other = Record(problem, None)
        other.evaluations, other.history = self.evaluations, self.history
        other.linearizer = None if self.linearizer is None else self.linearizer.on(problem)
        return other

    def check(self) -> None:
        """Raise a `RuntimeError` with the most frequent reason if no design was found."""
        if np.isfinite(self.value):
            return
        status = statuses(self.problem, start_points(self.problem, _ASKED))
        failures, pairs = tally(status), self.problem.mesh.resolution.pairs
        why = explanation(failures, len(status), "designs tried", pairs) if failures else ""
        problem = "no design that the search evaluated within the bounds has a converged contact solution"
        raise RuntimeError("; ".join(filter(None, (problem, why))))

    def spend(self, designs: int, *, analyses: int = 1) -> None:
        """Count contact analyses of a number of designs in every case, `analyses` each."""
        self.evaluations += designs * analyses * self.problem.cases.count

    def offer(
        self, points: np.ndarray | Array, values: Given, violations: Given, model: LinearModel | None = None
    ) -> None:
        """Compare designs, by true objective and violation, with the best design; values that are not finite lose."""
        many, value, violation = np.atleast_2d(points), np.ravel(values), np.ravel(violations)
        good = np.isfinite(value) & np.isfinite(violation)
        if not good.any():
            return
        many, value, violation = many[good], value[good], violation[good]
        best = np.lexsort((value, np.asarray(counted(violation))))[0]
        if (counted(violation[best]), value[best]) < (counted(self.violation), self.value):
            self.point, self.value, self.violation = many[best].copy(), float(value[best]), float(violation[best])
            self.model = model

    def judge(self, points: np.ndarray | Array, chunk: int = 1) -> Score:
        """Evaluate points of the unit box, count the analyses and offer the designs.

        Args:
            points: points of the unit box, shape (points, parameters).
            chunk: the number of points is padded to a multiple of this number, to avoid compilations.
        """
        found = scores(self.problem, padded(points, chunk))
        score = jax.tree.map(lambda part: np.asarray(part)[: len(points)], found)
        self.spend(len(points))
        self.offer(points, score.value[:, 0], score.violation)
        return score

    def take(self, point: np.ndarray | Array, model: LinearModel) -> None:
        """Offer a design with its linear model."""
        self.offer(point, model.value, model.violation, model)

    def look(self, step: int, steps: int) -> None:
        """Report the progress after `step` of `steps`."""
        self.report(step, steps, self.value)

    def report(self, step: int, steps: int, value: float) -> None:
        """Report the progress of a method with its own best objective."""
        self.history.append((self.evaluations, value, self.problem.mesh.resolution.positions))
        if self._callback is not None:
            self._callback(step, steps, value)


def start_points(problem: Problem, count: int) -> np.ndarray:
    """Start points in the unit box: the middle, then a Halton sequence; deterministic, shape (count, parameters)."""
    points = halton(len(problem.names), count)
    points[0] = 0.5
    return points.astype(np.dtype(problem.low.dtype))


def points_nearby(point: np.ndarray, count: int, *, reach: float, seed: int) -> np.ndarray:
    """Halton points in a cube of half width `reach` around a point, moved into the unit box, shape (count, parameters).

    Every seed gives different, reproducible points.
    """
    corner = np.clip(point - reach, 0.0, 1.0 - 2 * reach)
    return corner + 2 * reach * halton(len(point), count, seed)


_ASKED = 16  # number of designs from which the reason of a failed search is determined
_INFEASIBLE = 1e6  # rank of a design that violates a limit, above any objective


def scores(problem: Problem, points: np.ndarray | Array) -> Score:
    """Scores of points of the unit box, leading axis (points,), in batches that fit the cache."""
    count = len(points)
    batch = min(side_by_side(problem.mesh, problem.cases.count), count)
    return jax.tree.map(lambda part: part[:count], _scores(problem, real_points(problem, padded(points, batch)), batch))


@kernel
def _scores(problem: Problem, points, batch: int) -> Score:
    return jax.lax.map(problem.score, points, batch_size=batch)


def statuses(problem: Problem, points: np.ndarray | Array) -> np.ndarray:
    """Worst `Status` of points of the unit box over all cases, shape (points,)."""
    count = len(points)
    batch = min(side_by_side(problem.mesh, problem.cases.count), count)
    return np.asarray(_statuses(problem, real_points(problem, padded(points, batch)), batch))[:count]


@kernel
def _statuses(problem: Problem, points, batch: int):
    return jax.lax.map(problem.status, points, batch_size=batch)


def fitness(score: Score) -> Float[Array, " designs"] | Float[Array, ""]:
    """Rank of designs: the objective; for designs that violate limits a number far above, rising with the violation."""
    value, excess = score.value[..., 0], counted(score.violation)
    rank = jnp.where(excess > 0, _INFEASIBLE * (1 + excess), value)
    return jnp.where(jnp.isfinite(value), rank, jnp.inf)
