"""The smooth problem that gradient methods follow: soft extremes, augmented Lagrangian, stages."""

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np

from ..numerics import Checked, count
from .goal import counted
from .problem import GRADIENT_COST, Problem
from .search import AbstractMethod, Record

# Widths of the soft extremes in the stages of a search, relative to the best objective among the start points: from
# wide, where most positions pull, to narrow, where the soft objective is within about a percent of the true one.
STAGE_WIDTHS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
_FIRST_RATE, _LAST_RATE = 0.05, 0.002  # step sizes in the unit box, first and last stage
_LEAST_SCALE = 1e-3  # [um] of the objective, where the start is best already
_STIFFNESS = 10.0  # of the penalty: objective per squared relative violation, relative to the scale


def followed(multipliers, excess, scale):
    """First-order update of the multipliers of the augmented Lagrangian (Hestenes 1969, Powell 1969)."""
    return jnp.maximum(multipliers + _STIFFNESS * scale * excess, 0.0)


def lagrangian(problem: Problem, x, multipliers, width, scale):
    """Augmented Lagrangian of the soft problem at one point, with its true value, violation and excess.

    The multipliers are those of every limit, shape (limits,).
    """
    values, true, excess, fine = problem.soft_and_true(x, width)
    good = fine & jnp.isfinite(jnp.sum(values))
    violation = jnp.maximum(jnp.max(excess, initial=0.0), 0.0)
    pushed = followed(multipliers, excess, scale)
    penalty = jnp.sum(pushed**2 - multipliers**2) / (2 * _STIFFNESS * scale)
    return values[0] + penalty, (jnp.where(good, true[0], jnp.inf), violation, excess)


def merged(best, new):
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


def yardstick(values) -> float:
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
    def begin(self, problem: Problem):
        """Start points, as the method holds them."""

    @staticmethod
    @abstractmethod
    def advance(problem: Problem, points, multipliers, analyses, width, rate, scale):
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
