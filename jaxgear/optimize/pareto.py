"""Pareto fronts of several objectives by one batched gradient run."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import qmc

from ..numerics import whole
from ..numerics.pareto import pareto_front
from .first_order import adam_steps
from .goal import FEASIBLE, QUANTITIES
from .problem import GRADIENT_COST, Problem
from .result import Front
from .search import AbstractMethod, Record
from .smooth import STAGE_WIDTHS, stages, yardstick
from .starts import real_points, start_points

_LOOK = 8  # most steps between two looks, at which the front is brought up to date
_END = 1e-3  # least weight of two objectives: the ends of the front are nearly the optima of one objective alone
_SUM = 0.05  # part of the plain sum in the scalarization, which keeps weakly dominated designs away
_PENALTY = 10.0  # of a squared relative violation against a scaled objective of 1
_SPAN = 1e-3  # least span of an objective over the designs, relative to its ideal


class Pareto(AbstractMethod):
    """Pareto front by the augmented Chebyshev scalarization (Steuer and Choo 1983), one weight per start.

    Every start minimizes the largest weighted distance from the ideal point, which reaches concave parts of the front
    too. Weights are spread evenly; ideal and nadir follow the designs that have been met. All starts advance together
    with Adam under `jax.vmap`.

    Attributes:
        points: designs that are sought on the front.
        steps: gradient steps of every one.
    """

    points: int = eqx.field(static=True, default=32)
    steps: int = eqx.field(static=True, default=240)

    def __check_init__(self):
        whole("Pareto", "points", self.points, 2)
        whole("Pareto", "steps", self.steps, len(STAGE_WIDTHS))

    @property
    def name(self) -> str:
        return "pareto"

    def search(self, problem: Problem, record: Record) -> Front:
        """Runs the stages, then sorts out the front of all designs met."""
        points = real_points(problem, start_points(problem, self.points))
        weights = real_points(problem, _weights(self.points, len(problem.objectives)))
        met = _Met(points, len(problem.objectives))

        def advance(width, rate, count):
            made = [real_points(problem, value) for value in (*met.frame(), width, rate)]
            found = _advance(problem, points, weights, jnp.asarray(count), *made)
            record.spend(self.points * count, analyses=GRADIENT_COST)
            met.add(*found[1:])
            return found[0]

        advance(1.0, 0.0, 1)
        scale = yardstick(met.soft_scale(problem))
        for stage in stages(self.steps, _LOOK):
            points = advance(stage.width * scale, stage.rate, stage.steps)
            record.report(stage.done, self.steps, met.compromise()[1])
        place, distance = met.compromise()
        if np.isfinite(distance):
            record.offer(place, distance, 0.0)
        return met.front(problem)


class _Met:
    """Designs met so far."""

    def __init__(self, points, objectives: int):
        self._points = np.empty((0, points.shape[1]))
        self._values = np.empty((0, objectives))
        self._worst = np.ones(objectives)

    def add(self, points, values, violations) -> None:
        """Keeps those that are not dominated and violate nothing."""
        points, values = np.asarray(points), np.asarray(values)
        finite = np.isfinite(values).all(axis=1)
        good = finite & (np.asarray(violations) <= FEASIBLE)
        if finite.any():
            self._worst = values[finite].max(axis=0)
        points, values = np.concatenate([self._points, points[good]]), np.concatenate([self._values, values[good]])
        if len(values):
            best = pareto_front(values)
            points, values = points[best], values[best]
        self._points, self._values = points, values

    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """Ideal point, and the span from it to the worst values that the starts have at the moment."""
        if not len(self._values):
            return np.zeros_like(self._worst), np.ones_like(self._worst)
        low = self._values.min(axis=0)
        return low, _span(low, self._worst)

    def soft_scale(self, problem: Problem):
        """Values of the objective that is softened, else of the first."""
        index = problem.objectives.index("ppte") if "ppte" in problem.objectives else 0
        return self._values[:, index]

    def compromise(self) -> tuple[np.ndarray, float]:
        """The design whose worst distance from the ideal, in spans of the front, is the least; and that distance."""
        if not len(self._values):
            return np.full(self._points.shape[1], 0.5), np.inf
        low = self._values.min(axis=0)
        distance = ((self._values - low) / _span(low, self._values.max(axis=0))).max(axis=1)
        best = int(distance.argmin())
        return self._points[best], float(distance[best])

    def front(self, problem: Problem) -> Front:
        """Ascending in the first objective."""
        _, order = np.unique(self._values, axis=0, return_index=True)  # equal designs once, in ascending order
        low, high = np.asarray(problem.low), np.asarray(problem.high)
        parameters = low + self._points[order] * (high - low)
        return Front(
            objectives=tuple(of if isinstance(of, str) else of.__name__ for of in problem.objectives),
            units=tuple(QUANTITIES[of].unit if isinstance(of, str) else "" for of in problem.objectives),
            values=self._values[order],
            parameters={name: parameters[:, index] for index, name in enumerate(problem.names)},
        )


def _span(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.maximum(high - low, _SPAN * np.maximum(np.abs(low), 1.0))


def _weights(count: int, objectives: int) -> np.ndarray:
    """Weights that sum to 1: evenly along the line of two objectives, of a low-discrepancy sequence for more."""
    if objectives == 2:
        first = np.linspace(_END, 1 - _END, count)
        return np.stack([first, 1 - first], axis=1)
    # spacings of sorted uniform numbers are uniform on the simplex
    cuts = np.sort(qmc.Halton(objectives - 1, scramble=False).random(count + 1)[1:], axis=1)
    return np.diff(np.concatenate([np.zeros((count, 1)), cuts, np.ones((count, 1))], axis=1), axis=1)


@eqx.filter_jit
def _advance(problem: Problem, points, weights, count, low, span, width, rate):
    """A stage of all starts; returns the points, and all designs that were judged with values and violations."""

    def loss(x, weight):
        soft, true, excess, fine = problem.soft_and_true(x, width)
        scaled = weight * (soft - low) / span
        penalty = _PENALTY * jnp.sum(jnp.maximum(excess, 0.0) ** 2)
        good = fine & jnp.isfinite(jnp.sum(soft))
        violation = jnp.maximum(jnp.max(excess, initial=0.0), 0.0)
        return jnp.max(scaled) + _SUM * jnp.sum(scaled) + penalty, (jnp.where(good, true, jnp.inf), violation)

    def keep(kept, number, points, seen):
        return jax.tree.map(lambda all, new: all.at[number].set(new), kept, (points, *seen))

    gradient = jax.vmap(jax.grad(loss, has_aux=True))
    met = jnp.full((_LOOK, *points.shape[:1]), jnp.inf, points.dtype)
    values = jnp.full((_LOOK, *weights.shape), jnp.inf, points.dtype)
    kept = jnp.zeros((_LOOK, *points.shape), points.dtype), values, met
    points, kept = adam_steps(lambda points: gradient(points, weights), points, count, rate, keep, kept)
    return points, *jax.tree.map(lambda all: all.reshape(-1, *all.shape[2:]), kept)
