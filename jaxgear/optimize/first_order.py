"""First-order search from many points at once."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from ..numerics import kernel
from .problem import Problem
from .smooth import AbstractStaged, followed, lagrangian, merged
from .starts import real_points, start_points


class Adam(AbstractStaged):
    """Adam (optax) on a soft objective whose width shrinks in stages, projected onto the box.

    Attributes:
        steps: gradient steps of every start, over all stages.
    """

    name: ClassVar[str] = "adam"
    longest_stage: ClassVar[float] = 20

    def begin(self, problem: Problem):
        return real_points(problem, start_points(problem, self.starts))

    @staticmethod
    @kernel
    def advance(problem: Problem, points, multipliers, analyses, width, rate, scale):
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
