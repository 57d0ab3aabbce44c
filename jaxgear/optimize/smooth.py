"""The smooth problem that gradient methods follow: soft extremes, augmented Lagrangian, stages."""

from collections.abc import Iterator
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .goal import FEASIBLE
from .problem import Problem

Scalar = Float[Array, ""]

# Widths of the soft extremes in the stages of a search, relative to the best objective among the start points: from
# wide, where most positions pull, to narrow, where the soft objective is within about a percent of the true one.
STAGE_WIDTHS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
_FIRST_RATE, _LAST_RATE = 0.05, 0.002  # step sizes in the unit box, first and last stage
_LEAST_SCALE = 1e-3  # [um] of the objective, where the start is perfect already
_STIFFNESS = 10.0  # of the penalty: objective per squared relative violation, relative to the scale


class Multipliers(eqx.Module):
    """Multipliers of the constraints, of every start or of one.

    Attributes:
        value: shape (starts, constraints), or (constraints,).
    """

    value: Float[Array, "*starts constraints"]

    @classmethod
    def zeros(cls, problem: Problem, starts: int) -> "Multipliers":
        """No multiplier yet."""
        count = sum((limit.low is not None) + (limit.high is not None) for limit in problem.constraints)
        return cls(jnp.zeros((starts, count), problem.low.dtype))

    def follow(self, excess, scale) -> "Multipliers":
        """First-order update of the augmented Lagrangian (Hestenes 1969, Powell 1969)."""
        return Multipliers(jnp.maximum(self.value + _STIFFNESS * scale * excess, 0.0))


def lagrangian(problem: Problem, x, multipliers: Multipliers, width, scale):
    """Augmented Lagrangian of the soft problem at one point, with its true value, violation and excess."""
    values, true, excess, fine = problem.soft_and_true(x, width)
    good = fine & jnp.isfinite(jnp.sum(values))
    violation = jnp.maximum(jnp.max(excess, initial=0.0), 0.0)
    stiffness = _STIFFNESS * scale
    pushed = jnp.maximum(multipliers.value + stiffness * excess, 0.0)
    penalty = jnp.sum(pushed**2 - multipliers.value**2) / (2 * stiffness)
    return values[0] + penalty, (jnp.where(good, true[0], jnp.inf), violation, excess)


def merged(best, new):
    """The better of two designs of every start: (points, values, violations) each."""
    (points, values, violations), (other, value, violation) = best, new
    excess, others = (jnp.where(v <= FEASIBLE, 0.0, v) for v in (violations, violation))
    better = (others < excess) | ((others == excess) & (value < values))
    better = better & jnp.isfinite(value)
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


def stages(steps: int, most: int) -> Iterator[Stage]:
    """Stages of a search of so many steps, each of about as many as `most`; widths and rates fall."""
    count = max(-(-steps // most), len(STAGE_WIDTHS))
    ends = np.linspace(0, steps, count + 1).astype(int)
    rates = np.geomspace(_FIRST_RATE, _LAST_RATE, count)
    for index, rate in enumerate(rates):
        before, after = int(ends[index]), int(ends[index + 1])
        yield Stage(after - before, after, STAGE_WIDTHS[index * len(STAGE_WIDTHS) // count], float(rate))


def yardstick(values) -> float:
    """Scale of the stage widths [um], from the true objective of the start points."""
    known = np.abs(np.asarray(values)[np.isfinite(values)])
    return max(float(known.min()), _LEAST_SCALE) if len(known) else 1.0
