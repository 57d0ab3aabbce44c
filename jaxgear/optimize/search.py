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
    """Best design so far, contact analyses spent, and the callback that is told.

    A design that keeps the constraints beats one that does not; among those that do not, the least violation wins.
    """

    def __init__(self, problem: Problem, callback: Callback | None) -> None:
        self.problem = problem
        self.evaluations = 0
        self.point = np.full(len(problem.names), 0.5)
        self.value, self.violation = float("inf"), float("inf")
        self.model: LinearModel | None = None  # linearization at the best design, where the method made one
        self.linearizer: Linearizer | None = None  # which made it
        self.history: list[tuple[int, float, int]] = []  # analyses, value, and positions of the mesh that it is of
        self._callback = callback

    def on(self, problem: Problem) -> "Record":
        """A record of the same problem on another mesh, with what was spent and the history of this one."""
        other = Record(problem, None)
        other.evaluations, other.history = self.evaluations, self.history
        other.linearizer = None if self.linearizer is None else self.linearizer.on(problem)
        return other

    def check(self) -> None:
        """Raises a `RuntimeError` with the commonest reason when nothing was found."""
        if np.isfinite(self.value):
            return
        status = statuses(self.problem, start_points(self.problem, _ASKED))
        failures, pairs = tally(status), self.problem.mesh.resolution.pairs
        why = explanation(failures, len(status), "designs tried", pairs) if failures else ""
        problem = "no design that the search evaluated within the bounds has a converged contact solution"
        raise RuntimeError("; ".join(filter(None, (problem, why))))

    def spend(self, designs: int, *, analyses: int = 1) -> None:
        """Counts contact analyses: of so many designs in every case, each worth so many."""
        self.evaluations += designs * analyses * self.problem.cases.count

    def offer(
        self, points: np.ndarray | Array, values: Given, violations: Given, model: LinearModel | None = None
    ) -> None:
        """Designs with their true objective and violation; anything that is not finite is no candidate."""
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
        """True scores of points of the unit box, which are counted and offered.

        Args:
            points: shape (points, parameters).
            chunk: of so many or a multiple of it the program is compiled, where calls differ in their number.
        """
        found = scores(self.problem, padded(points, chunk))
        score = jax.tree.map(lambda part: np.asarray(part)[: len(points)], found)
        self.spend(len(points))
        self.offer(points, score.value[:, 0], score.violation)
        return score

    def take(self, point: np.ndarray | Array, model: LinearModel) -> None:
        """A design with its linearization."""
        self.offer(point, model.value, model.violation, model)

    def look(self, step: int, steps: int) -> None:
        """Marks the progress: after `step` of `steps`."""
        self.report(step, steps, self.value)

    def report(self, step: int, steps: int, value: float) -> None:
        """Marks the progress of a method that keeps its own best design."""
        self.history.append((self.evaluations, value, self.problem.mesh.resolution.positions))
        if self._callback is not None:
            self._callback(step, steps, value)


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


_ASKED = 16  # designs by which the reason of a failed search is told
_INFEASIBLE = 1e6  # rank of a design that passes a limit, above any objective


def scores(problem: Problem, points: np.ndarray | Array) -> Score:
    """Scores of points of the unit box, leading axis (points,), in batches that fit the cache."""
    count = len(points)
    batch = min(side_by_side(problem.mesh, problem.cases.count), count)
    return jax.tree.map(lambda part: part[:count], _scores(problem, real_points(problem, padded(points, batch)), batch))


@kernel
def _scores(problem: Problem, points, batch: int) -> Score:
    return jax.lax.map(problem.score, points, batch_size=batch)


def statuses(problem: Problem, points: np.ndarray | Array) -> np.ndarray:
    """Numbers of `Status` of points of the unit box over all cases, shape (points,)."""
    count = len(points)
    batch = min(side_by_side(problem.mesh, problem.cases.count), count)
    return np.asarray(_statuses(problem, real_points(problem, padded(points, batch)), batch))[:count]


@kernel
def _statuses(problem: Problem, points, batch: int):
    return jax.lax.map(problem.status, points, batch_size=batch)


def fitness(score: Score) -> Float[Array, " designs"] | Float[Array, ""]:
    """One number to rank by: the objective, and far above any of them the violation."""
    value, excess = score.value[..., 0], counted(score.violation)
    rank = jnp.where(excess > 0, _INFEASIBLE * (1 + excess), value)
    return jnp.where(jnp.isfinite(value), rank, jnp.inf)
