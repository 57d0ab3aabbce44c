"""Quasi-Newton search from many points at once."""

from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..numerics import count, kernel
from .problem import Problem
from .smooth import STAGE_WIDTHS, AbstractStaged, followed, lagrangian, merged
from .starts import real_points, start_points

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

    def begin(self, problem: Problem):
        points = np.clip(start_points(problem, self.starts), _INSIDE, 1 - _INSIDE)
        return real_points(problem, np.arcsin(2 * points - 1))

    @staticmethod
    @kernel
    def advance(problem: Problem, angles, multipliers, analyses, width, rate, scale):
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
