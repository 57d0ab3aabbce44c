"""Quasi-Newton search from many points at once."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax

from .problem import GRADIENT_COST, Problem
from .search import AbstractMethod, Record, whole
from .smooth import STAGE_WIDTHS, Multipliers, lagrangian, merged, stage_width, yardstick
from .starts import real_points, start_points

_LINE_SEARCH_STEPS = 10  # at most, per step
_INSIDE = 0.01  # start points keep this distance from the bounds, where the map of the box is flat


class LBFGS(AbstractMethod):
    """Limited-memory BFGS with a zoom line search (optax) on a soft objective whose width shrinks in stages.

    The box is the image of the whole space under x = (1 + sin(t)) / 2; other constraints enter by an augmented
    Lagrangian, whose multipliers follow once per stage. All starts advance together under `jax.vmap`.

    Attributes:
        starts: number of start points; the first is the middle of the box.
        steps: steps of every start, over all stages.
    """

    starts: int = eqx.field(static=True, default=16)
    steps: int = eqx.field(static=True, default=60)

    def __check_init__(self):
        whole("LBFGS", "starts", self.starts, 1)
        whole("LBFGS", "steps", self.steps, len(STAGE_WIDTHS))

    @property
    def name(self) -> str:
        return "lbfgs"

    def search(self, problem: Problem, record: Record) -> None:
        """Runs the stages."""
        points = np.clip(start_points(problem, self.starts), _INSIDE, 1 - _INSIDE)
        angles = real_points(problem, np.arcsin(2 * points - 1))
        multipliers = Multipliers.zeros(problem, self.starts)

        def advance(width, scale, count):
            made = [jnp.asarray(value, angles.dtype) for value in (width, scale)]
            found = _advance(problem, angles, multipliers, jnp.asarray(count), *made)
            moved, followed, best, values, violations, spent = found
            record.spend(int(np.sum(spent)))
            record.offer(best, values, violations)
            return moved, followed, values

        scale = yardstick(advance(1.0, 1.0, 0)[2])
        done = np.linspace(0, self.steps, len(STAGE_WIDTHS) + 1).astype(int)
        for stage, (before, after) in enumerate(zip(done[:-1], done[1:])):
            width = stage_width(stage, len(STAGE_WIDTHS), scale)
            angles, multipliers, _ = advance(width, scale, int(after - before))
            record.look(int(after), self.steps)


@eqx.filter_jit
def _advance(problem: Problem, angles, multipliers: Multipliers, count, width, scale):
    """A stage: angles, multipliers, best true design of every start, and the analyses that every start spent."""

    def value(angle, rest):
        return lagrangian(problem, _box(angle), Multipliers(rest), width, scale)

    def run(angle, rest):
        def loss(angle):
            return value(angle, rest)[0]

        search = optax.scale_by_zoom_linesearch(max_linesearch_steps=_LINE_SEARCH_STEPS)
        method = optax.lbfgs(linesearch=search)

        def step(_, carry):
            angle, state, best, spent = carry
            # optax mixes its integer step count with floats, which strict promotion would forbid
            with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
                before, slope = optax.value_and_grad_from_state(loss)(angle, state=state)
                slope = jnp.where(jnp.isfinite(slope), slope, 0.0)
                update, state = method.update(slope, state, angle, value=before, grad=slope, value_fn=loss)
            angle = angle + update
            trials = state[-1].info.num_linesearch_steps
            return angle, state, judged(angle, best), spent + GRADIENT_COST * trials + 1

        def judged(angle, best):
            _, (true, violation, _) = value(angle, rest)
            lanes = merged(
                jax.tree.map(lambda part: part[None], best), (_box(angle)[None], true[None], violation[None])
            )
            return jax.tree.map(lambda part: part[0], lanes)

        nothing = jnp.asarray(jnp.inf, angle.dtype)
        best = judged(angle, (_box(angle), nothing, nothing))
        start = (angle, method.init(angle), best, jnp.asarray(1 + GRADIENT_COST))
        angle, _, best, spent = jax.lax.fori_loop(0, count, step, start)
        return angle, best, spent, value(angle, rest)[1][2]

    angles, (best, values, violations), spent, excess = jax.vmap(run)(angles, multipliers.value)
    return angles, multipliers.follow(excess, scale), best, values, violations, spent


def _box(angle):
    return 0.5 * (1 + jnp.sin(angle))
