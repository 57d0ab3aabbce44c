"""First-order search from many points at once."""

import equinox as eqx
import jax
import jax.numpy as jnp
import optax

from ..numerics.fields import Checked, count
from .problem import GRADIENT_COST, Problem
from .search import AbstractMethod, Record
from .smooth import STAGE_WIDTHS, Multipliers, lagrangian, merged, stages, yardstick
from .starts import real_points, start_points

_LOOK = 20  # most steps between two looks at the search: progress and interruption


class Adam(Checked, AbstractMethod):
    """Adam (optax) on a soft objective whose width shrinks in stages, projected onto the box.

    All starts advance together under `jax.vmap`. Other constraints enter by an augmented Lagrangian, whose multipliers
    follow once per stage.

    Attributes:
        starts: number of start points; the first is the middle of the box.
        steps: gradient steps of every start, over all stages.
    """

    starts: int = count(default=16)
    steps: int = count(low=len(STAGE_WIDTHS), default=300)

    @property
    def name(self) -> str:
        return "adam"

    def search(self, problem: Problem, record: Record) -> None:
        """Runs the stages."""
        points = real_points(problem, start_points(problem, self.starts))
        multipliers = Multipliers.zeros(problem, self.starts)

        def advance(width, rate, scale, count):
            made = [jnp.asarray(value, points.dtype) for value in (width, rate, scale)]
            moved, followed, best, values, violations = _advance(
                problem, points, multipliers, jnp.asarray(count), *made
            )
            record.spend(self.starts * count, analyses=GRADIENT_COST)
            record.offer(best, values, violations)
            return moved, followed, values

        scale = yardstick(advance(1.0, 0.0, 1.0, 1)[2])  # a step of length zero judges the start points
        for stage in stages(self.steps, _LOOK):
            points, multipliers, _ = advance(stage.width * scale, stage.rate, scale, stage.steps)
            record.look(stage.done, self.steps)


@eqx.filter_jit
def _advance(problem: Problem, points, multipliers: Multipliers, count, width, rate, scale):
    """A stage; returns the points, the multipliers and the best true design of every start on the way."""
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
    start = points, adam.init(points), (points, nothing, nothing), jnp.zeros_like(multipliers.value)
    points, _, best, excess = jax.lax.fori_loop(0, count, step, start)
    return points, multipliers.follow(excess, scale), *best
