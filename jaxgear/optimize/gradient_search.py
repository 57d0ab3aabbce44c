"""Searches that follow gradients, from many points at once: soft extremes, augmented Lagrangian, stages."""

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..numerics import Checked, count, kernel
from .goal import counted
from .problem import GRADIENT_COST, Problem, real_points
from .search import AbstractMethod, Record, start_points

# Widths of the soft extremes in the stages of a search, relative to the best objective among the start points: from
# wide, where most positions pull, to narrow, where the soft objective is within about a percent of the true one.
STAGE_WIDTHS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
Designs = tuple[Array, Array, Array]  # of every start: point, value and violation
_FIRST_RATE, _LAST_RATE = 0.05, 0.002  # step sizes in the unit box, first and last stage
_LEAST_SCALE = 1e-3  # [um] of the objective, where the start is best already
_STIFFNESS = 10.0  # of the penalty: objective per squared relative violation, relative to the scale


def followed(multipliers: Array, excess: Array, scale: Array) -> Array:
    """First-order update of the multipliers of the augmented Lagrangian (Hestenes 1969, Powell 1969)."""
    return jnp.maximum(multipliers + _STIFFNESS * scale * excess, 0.0)


def lagrangian(
    problem: Problem, x: Array, multipliers: Array, width: Array, scale: Array
) -> tuple[Array, tuple[Array, Array, Array]]:
    """Augmented Lagrangian of the soft problem at one point, with its true value, violation and excess.

    The multipliers are those of every limit, shape (limits,).
    """
    values, true, excess, fine = problem.soft_and_true(x, width)
    good = fine & jnp.isfinite(jnp.sum(values))
    violation = jnp.maximum(jnp.max(excess, initial=0.0), 0.0)
    pushed = followed(multipliers, excess, scale)
    penalty = jnp.sum(pushed**2 - multipliers**2) / (2 * _STIFFNESS * scale)
    return values[0] + penalty, (jnp.where(good, true[0], jnp.inf), violation, excess)


def merged(best: Designs, new: Designs) -> Designs:
    """The better of two designs of every start: (points, values, violations) each."""
    (points, values, violations), (other, value, violation) = best, new
    excess, others = counted(violations), counted(violation)
    better = ((others < excess) | ((others == excess) & (value < values))) & jnp.isfinite(value)
    return (
        jnp.where(better[:, None], other, points),
        jnp.where(better, value, values),
        jnp.where(better, violation, violations),
    )


class Stage(NamedTuple):
    """Some steps of a search between two looks at it.

    Attributes:
        steps: how many.
        done: how many are done after them.
        width: of the soft extremes, relative to the scale of the objective.
        rate: step size in the unit box.
    """

    steps: int
    done: int
    width: float
    rate: float


def stages(steps: int, most: float) -> Iterator[Stage]:
    """Stages of a search of so many steps, each of about as many as `most`; widths and rates fall."""
    number = max(math.ceil(steps / most), len(STAGE_WIDTHS))
    ends = np.linspace(0, steps, number + 1).astype(int)
    rates = np.geomspace(_FIRST_RATE, _LAST_RATE, number)
    for index, rate in enumerate(rates):
        before, after = int(ends[index]), int(ends[index + 1])
        yield Stage(after - before, after, STAGE_WIDTHS[index * len(STAGE_WIDTHS) // number], float(rate))


def yardstick(values: np.ndarray | Array) -> float:
    """Scale of the stage widths [um], from the true objective of the start points."""
    known = np.abs(np.asarray(values)[np.isfinite(values)])
    return max(float(known.min()), _LEAST_SCALE) if len(known) else 1.0


class AbstractStaged(Checked, AbstractMethod):
    """A search from many points at once on a soft objective whose width shrinks in stages.

    All starts advance together under `jax.vmap`. Constraints enter by an augmented Lagrangian, whose multipliers follow
    once per stage.

    Attributes:
        starts: number of start points; the first is the middle of the box.
        steps: of every start, over all stages.
    """

    starts: int = count(default=16)
    steps: int = count(low=len(STAGE_WIDTHS), default=300)

    longest_stage: ClassVar[float] = math.inf  # in steps: between two looks at the search
    further_analyses: ClassVar[int] = 0  # of a stage, beside one for each of its steps

    @abstractmethod
    def begin(self, problem: Problem) -> Array:
        """Start points, as the method holds them."""

    @staticmethod
    @abstractmethod
    def advance(
        problem: Problem, points: Array, multipliers: Array, analyses: Array, width: Array, rate: Array, scale: Array
    ) -> tuple[Array, Array, Designs]:
        """A stage of so many analyses: the new points and multipliers, and the best true design of every start."""

    def search(self, problem: Problem, record: Record) -> None:
        """Runs the stages."""
        limits = sum(len(limit.sides) for limit in problem.constraints)
        state = self.begin(problem), jnp.zeros((self.starts, limits), problem.low.dtype)

        def advance(analyses, *numbers):
            converted = [jnp.asarray(value, problem.low.dtype) for value in numbers]
            *moved, best = self.advance(problem, *state, jnp.asarray(analyses), *converted)
            record.spend(self.starts * analyses, analyses=GRADIENT_COST)
            record.offer(*best)
            return moved, best

        _, (_, values, _) = advance(1, 1.0, 0.0, 1.0)  # a step of length zero judges the start points
        scale = yardstick(values)
        for stage in stages(self.steps, self.longest_stage):
            analyses = stage.steps + self.further_analyses
            state, _ = advance(analyses, stage.width * scale, stage.rate, scale)
            record.look(stage.done, self.steps)


class Adam(AbstractStaged):
    """Adam (optax) on a soft objective whose width shrinks in stages, projected onto the box.

    Attributes:
        steps: gradient steps of every start, over all stages.
    """

    name: ClassVar[str] = "adam"
    longest_stage: ClassVar[float] = 20

    def begin(self, problem: Problem) -> Array:
        return real_points(problem, start_points(problem, self.starts))

    @staticmethod
    @kernel
    def advance(
        problem: Problem, points: Array, multipliers: Array, analyses: Array, width: Array, rate: Array, scale: Array
    ) -> tuple[Array, Array, Designs]:
        import optax

        gradient = jax.vmap(jax.grad(lagrangian, argnums=1, has_aux=True), (None, 0, 0, None, None))
        adam = optax.scale_by_adam()

        def step(_, carry):
            points, moments, best, _ = carry
            slopes, (value, violation, excess) = gradient(problem, points, multipliers, width, scale)
            best = merged(best, (points, value, violation))
            slopes = jnp.where(jnp.isfinite(slopes), slopes, 0.0)
            # optax mixes its integer step count with floats, which strict promotion would forbid
            with jax.numpy_dtype_promotion("standard"):
                update, moments = adam.update(slopes, moments)
            return jnp.clip(points - rate * update, 0.0, 1.0), moments, best, excess

        nothing = jnp.full(points.shape[0], jnp.inf, points.dtype)
        start = points, adam.init(points), (points, nothing, nothing), jnp.zeros_like(multipliers)
        points, _, best, excess = jax.lax.fori_loop(0, analyses, step, start)
        return points, followed(multipliers, excess, scale), best


_INSIDE = 0.01  # start points keep this distance from the bounds, where the map of the box is flat
_DECREASE = 1e-4  # least decrease relative to that of the slope (Armijo; Nocedal and Wright 2006, eq. (3.4))
_SHORTER = 0.3  # step after one that does not decrease enough, relative to it
_LONGEST = 1.0  # step: a third of the way from one bound to the other


class LBFGS(AbstractStaged):
    """Limited-memory BFGS (optax) with a backtracking line search on a soft objective whose width shrinks in stages.

    The box is the image of the whole space under x = (1 + sin(t)) / 2. Each step judges one trial point of every start,
    which ends the line search or shortens its step.

    Attributes:
        steps: trial points of every start, over all stages.
    """

    name: ClassVar[str] = "lbfgs"
    steps: int = count(low=len(STAGE_WIDTHS), default=150)
    further_analyses: ClassVar[int] = 1  # the first trial is the point itself

    def begin(self, problem: Problem) -> Array:
        points = np.clip(start_points(problem, self.starts), _INSIDE, 1 - _INSIDE)
        return real_points(problem, np.arcsin(2 * points - 1))

    @staticmethod
    @kernel
    def advance(
        problem: Problem, angles: Array, multipliers: Array, analyses: Array, width: Array, rate: Array, scale: Array
    ) -> tuple[Array, Array, Designs]:
        import optax

        method = optax.scale_by_lbfgs()

        def loss(angle, multipliers):
            return lagrangian(problem, _box(angle), multipliers, width, scale)

        gradient = jax.vmap(jax.value_and_grad(loss, has_aux=True))

        def step(_, carry):
            trial, best, excess = carry
            angles = trial.next
            (values, (true, violation, new)), slopes = gradient(angles, multipliers)
            best = merged(best, (_box(angles), true, violation))
            finite = jnp.isfinite(slopes).all(axis=1, keepdims=True)
            values, slopes = jnp.where(finite[:, 0], values, jnp.inf), jnp.where(finite, slopes, 0.0)
            moved = jax.vmap(lambda trial, *seen: trial.take(method, *seen))(trial, angles, values, slopes)
            return moved, best, jnp.where((moved.value < trial.value)[:, None], new, excess)

        nothing = jnp.full(angles.shape[0], jnp.inf, angles.dtype)
        zero = jnp.zeros_like(angles)
        first = _Trial(angles, nothing, zero, zero, jnp.ones_like(nothing), jax.vmap(method.init)(angles))
        start = first, (_box(angles), nothing, nothing), jnp.zeros_like(multipliers)
        trial, best, excess = jax.lax.fori_loop(0, analyses, step, start)
        return trial.angle, followed(multipliers, excess, scale), best


class _Trial(eqx.Module):
    """One start: where it is, and the point that it tries next."""

    angle: jax.Array
    value: jax.Array
    slope: jax.Array
    direction: jax.Array
    stretch: jax.Array
    memory: Any  # of optax

    @property
    def next(self) -> jax.Array:
        """The trial point."""
        return self.angle + self.stretch[..., None] * self.direction

    def take(self, method, angle, value, slope) -> "_Trial":
        """Goes to the trial point if the loss there is low enough, and tries a shorter step if it is not."""
        wanted = _DECREASE * self.stretch * jnp.sum(self.slope * self.direction)
        low = value <= self.value + wanted
        # optax mixes its integer step count with floats, which strict promotion would forbid
        with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
            uphill, memory = method.update(slope, self.memory, angle)
        # without the curvature that a full line search guarantees, the memory may point uphill
        direction = jnp.where(jnp.sum(uphill * slope) > 0, -uphill, -slope)
        reach = jnp.max(jnp.abs(direction))
        direction = direction * jnp.where(reach > _LONGEST, _LONGEST / reach, 1.0)
        taken = _Trial(angle, value, slope, direction, jnp.ones_like(value), memory)
        shorter = eqx.tree_at(lambda trial: trial.stretch, self, _SHORTER * self.stretch)
        return jax.tree.map(lambda new, old: jnp.where(low, new.astype(old.dtype), old), taken, shorter)


def _box(angle):
    return 0.5 * (1 + jnp.sin(angle))
