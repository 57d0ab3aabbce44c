"""Gradient searches of other libraries: soft extremes whose width shrinks in stages, with a penalty on limits."""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import scipy  # its packages load when they are used

from ..numerics import kernel
from ..numerics.fields import Checked, count
from .method import AbstractSearch
from .problem import GRADIENT_COST, Problem, Score, real_points
from .search import Record, start_points

# Widths of the soft extremes in the stages of a search, relative to the best objective among the start points: from
# wide, where most positions pull, to narrow, where the soft objective is within about a percent of the true one.
STAGE_WIDTHS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
# Penalty on relative violations, in terms of the same objective: it is exact where no limit costs more than that, and
# smooth over this part of the width of the extremes.
_PENALTY, _ROUNDED = 30.0, 0.05
_LEAST_SCALE = 1e-3  # [um] of the objective, where the start is best already
_LONGEST = 20  # steps of Adam between two reports
_FIRST_RATE, _LAST_RATE = 0.05, 0.002  # its step sizes in the unit box


def _softened(problem: Problem, x, width, scale):
    """Soft objective with penalty at one point, and the true objective and violation."""
    values, true, excess, fine = problem.soft_and_true(x, width * scale)
    good = fine & jnp.isfinite(jnp.sum(values))
    passed, rounded = jnp.maximum(excess, 0.0), _ROUNDED * width
    penalty = _PENALTY * scale * jnp.sum(jnp.sqrt(passed**2 + rounded**2) - rounded)
    return values[0] + penalty, (jnp.where(good, true[0], jnp.inf), jnp.max(passed, initial=0.0))


_gradient = jax.value_and_grad(_softened, argnums=1, has_aux=True)


def _scale(start: Score) -> float:
    """Reference of the widths: the best objective among the start points."""
    known = np.abs(start.value[np.isfinite(start.value)])
    return max(float(known.min()), _LEAST_SCALE) if len(known) else 1.0


class Adam(Checked, AbstractSearch):
    """Adam (optax) from many start points at once, on a soft objective whose width shrinks in stages.

    Points outside the box are moved to its surface.

    Attributes:
        starts: number of start points; the first is the middle of the box.
        steps: gradient steps of every start, over all stages.
    """

    name: ClassVar[str] = "adam"
    starts: int = count(default=16)
    steps: int = count(low=len(STAGE_WIDTHS), default=300)

    def search(self, problem: Problem, record: Record) -> None:
        """Run all stages and store the best design in the record."""
        points = real_points(problem, start_points(problem, self.starts))
        scale = real_points(problem, _scale(record.judge(points)))
        stages = max(self.steps // _LONGEST, len(STAGE_WIDTHS))
        steps = self.steps // stages
        for stage, rate in enumerate(np.geomspace(_FIRST_RATE, _LAST_RATE, stages)):
            width = STAGE_WIDTHS[stage * len(STAGE_WIDTHS) // stages]
            numbers = (real_points(problem, each) for each in (width, rate))
            points, seen = _adam(problem, points, scale, *numbers, steps=steps)
            record.spend(steps * self.starts, analyses=GRADIENT_COST)
            record.offer(*jax.tree.map(lambda part: np.reshape(part, (steps * self.starts, *part.shape[2:])), seen))
            record.look((stage + 1) * steps, stages * steps)


@kernel
def _adam(problem: Problem, points, scale, width, rate, *, steps: int):
    """Points after `steps` steps, and all evaluated points with objective and violation."""
    import optax

    adam = optax.scale_by_adam()

    def step(carry, _):
        points, moments = carry
        (_, judged), slopes = jax.vmap(lambda x: _gradient(problem, x, width, scale))(points)
        # optax mixes its integer step count with floats, which strict promotion would forbid
        with jax.numpy_dtype_promotion("standard"):
            update, moments = adam.update(jnp.where(jnp.isfinite(slopes), slopes, 0.0), moments)
        return (jnp.clip(points - rate * update, 0.0, 1.0), moments), (points, *judged)

    (points, _), met = jax.lax.scan(step, (points, adam.init(points)), length=steps)
    return points, met


class LBFGS(Checked, AbstractSearch):
    """Limited-memory BFGS within the box (scipy), from one start point after the other, on a soft objective.

    Attributes:
        starts: number of start points; the first is the middle of the box.
        steps: analyses with gradient of every start, over all stages.
    """

    name: ClassVar[str] = "lbfgs"
    starts: int = count(default=16)
    steps: int = count(low=len(STAGE_WIDTHS), default=150)

    def search(self, problem: Problem, record: Record) -> None:
        """Run all stages and store the best design in the record."""
        points = start_points(problem, self.starts)
        scale, steps = _scale(record.judge(points)), self.steps // len(STAGE_WIDTHS)
        for stage, width in enumerate(STAGE_WIDTHS):

            def loss(x, width=width):
                numbers = (real_points(problem, each) for each in (x, width, scale))
                (value, judged), slopes = jax.device_get(_slopes(problem, *numbers))
                record.spend(1, analyses=GRADIENT_COST)
                record.offer(x, *judged)
                return value.item(), slopes.astype(float)

            options = {"jac": True, "bounds": [(0.0, 1.0)] * len(problem.names)}
            options |= {"options": {"maxfun": steps}, "method": "L-BFGS-B"}
            points = np.stack([scipy.optimize.minimize(loss, point, **options).x for point in points])
            record.look((stage + 1) * steps, steps * len(STAGE_WIDTHS))


@kernel
def _slopes(problem: Problem, x, width, scale):
    return _gradient(problem, x, width, scale)
