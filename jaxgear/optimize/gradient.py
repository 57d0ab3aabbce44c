"""Gradient search for the modification with the least variation of the transmission error.

PPTE is a difference of two extremes: it has kinks wherever the extreme jumps to another position. The search therefore
follows a soft PPTE whose width shrinks in stages, from many start points at once, and reports the true PPTE.
"""

from collections.abc import Callable, Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float
from scipy.stats import qmc

from ..contact import Mesh, MeshCycle, solve
from ..metrics import peak_to_peak, smooth_peak_to_peak
from ..microgeometry import AbstractModification
from ..numerics import check, real

Parameters = Mapping[str, Float[Array, ""]]
Design = Callable[[Parameters], tuple[AbstractModification | None, AbstractModification | None]]
Callback = Callable[[int, int, float], None]

# Widths of the soft extremes in the stages of the search, relative to the best PPTE among the start points: from wide,
# where most positions pull, to narrow, where the soft PPTE is within about a percent of the true one.
_STAGE_WIDTHS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
_FIRST_RATE, _LAST_RATE = 0.05, 0.002  # step sizes of Adam in the unit box, first and last stage
_CHUNK = 20  # steps between two looks at the search: progress and interruption
_AT_BOUND = 1e-6  # a parameter this close to a bound, relative to its range, is at the bound


class Optimum(eqx.Module):
    """Result of `minimize`.

    Attributes:
        parameters: value of every free parameter.
        pinion, wheel: the modifications they make.
        cycle: mesh cycle of the optimum.
        ppte: its peak-to-peak transmission error [um].
        gradient_norm: of the soft PPTE at the optimum, per full range of the parameters [um]; components that push a
            parameter against its bound are left out.
        active_bounds: which parameters ended at their "lower" or "upper" bound.
        evaluations: contact analyses with gradient that the search spent.
        history: best true PPTE after every look at the search [um].
    """

    parameters: dict[str, float]
    pinion: AbstractModification | None
    wheel: AbstractModification | None
    cycle: MeshCycle
    ppte: float
    gradient_norm: float
    active_bounds: dict[str, str]
    evaluations: int
    history: np.ndarray


def minimize(
    design: Design,
    bounds: Mapping[str, tuple[float, float]],
    *,
    mesh: Mesh,
    torque,
    starts: int = 16,
    steps: int = 300,
    callback: Callback | None = None,
) -> Optimum:
    """Finds the parameters of a modification with the least PPTE at one torque.

    Adam (optax) in the unit box, projected onto the bounds, from `starts` points of a low-discrepancy sequence that
    advance together under `jax.vmap`.

    Args:
        design: makes (pinion, wheel) modifications from the named parameters; traced, so it must be pure.
        bounds: (low, high) of every parameter, in the unit that `design` expects.
        mesh: prepared mesh.
        torque: on the pinion [N m].
        starts: number of start points; the first is the middle of the box.
        steps: gradient steps of every start, over all stages.
        callback: called as callback(step, steps, best PPTE) between chunks of steps.

    Returns:
        the best design met at any step of any start.

    Raises:
        ValueError: for empty or reversed bounds, or too few starts or steps.
        RuntimeError: when no design gave a finite, converged result.
    """
    names, low, high = _box(bounds)
    _check_counts(starts, steps)
    torque = real(torque)

    def build(x):
        return design(dict(zip(names, low + x * (high - low))))

    def cycle_of(x, mesh, torque):
        pinion, wheel = build(x)
        return solve(mesh, torque, pinion=pinion, wheel=wheel)

    search = _Search(cycle_of, mesh, torque, _start_points(len(names), starts, low.dtype))
    history = []
    for done in search.run(steps):
        history.append(search.best_value)
        if callback is not None:
            callback(done, steps, search.best_value)
    if not np.isfinite(search.best_value):
        raise RuntimeError("minimize: no design within the bounds gave a converged contact solution")
    x = jnp.asarray(search.best_point)
    pinion, wheel = build(x)
    return Optimum(
        parameters={name: float(value) for name, value in zip(names, low + x * (high - low))},
        pinion=pinion,
        wheel=wheel,
        cycle=solve(mesh, torque, pinion=pinion, wheel=wheel),
        ppte=search.best_value,
        gradient_norm=search.projected_gradient_norm(),
        active_bounds=_active_bounds(names, np.asarray(x)),
        evaluations=search.evaluations,
        history=np.asarray(history),
    )


class _Search:
    """All starts advancing together; keeps the best true PPTE met at any step."""

    def __init__(self, cycle_of, mesh, torque, points):
        self._mesh, self._torque, self._points = mesh, torque, points
        self.best_value, self.best_point, self.evaluations = float("inf"), np.asarray(points[0]), 0

        def score(x, width, mesh, torque):
            cycle = cycle_of(x, mesh, torque)
            curve = cycle.transmission_error
            true = peak_to_peak(curve)
            return smooth_peak_to_peak(curve, width), jnp.where(jnp.all(cycle.converged), true, jnp.nan)

        def advance(points, width, rate, mesh, torque):
            gradient = jax.vmap(jax.grad(score, has_aux=True), (0, None, None, None))

            def step(carry, _):
                points, moments, best, best_points, _ = carry
                slopes, values = gradient(points, width, mesh, torque)
                slopes = jnp.where(jnp.isfinite(slopes), slopes, 0.0)
                better = values < best  # False for NaN, so a failed design is never the best
                best, best_points = jnp.where(better, values, best), jnp.where(better[:, None], points, best_points)
                # optax mixes its integer step count with floats, which strict promotion would forbid
                with jax.numpy_dtype_promotion("standard"):
                    update, moments = adam.update(slopes, moments)
                return (jnp.clip(points - rate * update, 0.0, 1.0), moments, best, best_points, slopes), None

            adam = optax.scale_by_adam()
            nothing = jnp.full(points.shape[0], jnp.inf, points.dtype)
            start = (points, adam.init(points), nothing, points, jnp.zeros_like(points))
            (points, _, best, best_points, slopes), _ = jax.lax.scan(step, start, length=_CHUNK)
            return points, best, best_points, slopes

        self._advance = eqx.filter_jit(advance)

    def run(self, steps: int):
        """Runs the stages, yielding the number of steps done after every chunk."""
        chunks = max(-(-steps // _CHUNK), len(_STAGE_WIDTHS))
        scale = self._scale()
        for chunk, rate in enumerate(np.geomspace(_FIRST_RATE, _LAST_RATE, chunks)):
            self._width = _STAGE_WIDTHS[chunk * len(_STAGE_WIDTHS) // chunks] * scale
            self._points, _ = self._look(self._points, rate)
            yield min((chunk + 1) * _CHUNK, steps)

    def projected_gradient_norm(self) -> float:
        """Gradient norm of the last stage's objective at the best point, without components that push at a bound."""
        x = self.best_point
        _, slopes = self._look(jnp.broadcast_to(jnp.asarray(x), self._points.shape), 0.0)
        slope = np.asarray(slopes[0])
        pushing = ((x <= _AT_BOUND) & (slope > 0)) | ((x >= 1 - _AT_BOUND) & (slope < 0))
        return float(np.linalg.norm(np.where(pushing, 0.0, slope)))

    def _look(self, points, rate):
        """A chunk of steps at one rate; at rate zero the points stay and are only evaluated."""
        dtype = points.dtype
        points, values, candidates, slopes = self._advance(
            points, jnp.asarray(self._width, dtype), jnp.asarray(rate, dtype), self._mesh, self._torque
        )
        self.evaluations += points.shape[0] * _CHUNK
        best = int(np.argmin(values))
        if values[best] < self.best_value:
            self.best_value, self.best_point = float(values[best]), np.asarray(candidates[best])
        return points, slopes

    def _scale(self) -> float:
        """Best PPTE among the start points [um], the yardstick of the stage widths."""
        self._width = 1.0
        self._look(self._points, 0.0)
        return max(self.best_value, 1e-3) if np.isfinite(self.best_value) else 1.0


def _box(bounds):
    if not bounds:
        raise ValueError("minimize: bounds must name at least one free parameter")
    for name, (low, high) in bounds.items():
        check("minimize", f"lower bound of {name}", low, "")
        check("minimize", f"upper bound of {name}", high, "", low=low, open_low=True)
    pairs = jnp.stack([jnp.stack([real(low), real(high)]) for low, high in bounds.values()])
    return tuple(bounds), pairs[:, 0], pairs[:, 1]


def _check_counts(starts: int, steps: int) -> None:
    for name, value, least in (("starts", starts, 1), ("steps", steps, len(_STAGE_WIDTHS))):
        if not isinstance(value, int) or value < least:
            raise ValueError(f"minimize: {name} = {value!r} must be a whole number of at least {least}")


def _start_points(dimension: int, starts: int, dtype):
    """The middle of the box, then a Halton sequence: deterministic, so that a design file always gives one answer."""
    sequence = qmc.Halton(dimension, scramble=False).random(starts)
    sequence[0] = 0.5
    return jnp.asarray(sequence, dtype)


def _active_bounds(names, x) -> dict[str, str]:
    active = {}
    for name, value in zip(names, x):
        if value <= _AT_BOUND:
            active[name] = "lower"
        elif value >= 1 - _AT_BOUND:
            active[name] = "upper"
    return active
