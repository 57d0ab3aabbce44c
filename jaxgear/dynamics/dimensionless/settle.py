"""The settled vibration of an oscillator with one coordinate, by fixed steps, and its derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ...numerics import Checked, check, kernel, real, result, safe_divide, whole
from ..integrate import Steps, cycles, one_cycle, steps_of
from ..oscillator import Oscillator, State
from .model import DimensionlessModel, loaded_approach

Scalar = Float[Array, ""]

# Change of the state over the recorded cycles, relative to its size, below which a vibration counts as settled
_SETTLED = 1e-5


class Settled(Checked):
    """A settled vibration; every number dimensionless.

    Attributes:
        phase: mesh positions of the samples [base pitches], shape (samples,).
        approach: x there, shape (samples,).
        force: of the mesh over b k_mean, shape (samples,).
        weight: share of the recorded time that a sample stands for, shape (samples,).
        amplitude: half of the range of x, S1's alpha_max.
        residual: change of the state over the recorded cycles, relative to the size of the vibration.
        settled: False where that is too large, or the vibration left the range of a polynomial.
        start: state at mesh position 0, of the oscillator's coordinate.
    """

    phase: Float[Array, " samples"] = result("base pitches")
    approach: Float[Array, " samples"] = result()
    force: Float[Array, " samples"] = result()
    weight: Float[Array, " samples"] = result()
    amplitude: Scalar = result()
    residual: Scalar = result()
    settled: Bool[Array, ""] = result()
    start: Float[Array, " two"] = result()

    @property
    def mean(self) -> Scalar:
        """Of x."""
        return jnp.sum(self.weight * self.approach)

    def harmonic(self, order) -> Complex[Array, ""]:
        """Complex amplitude c of x ~ Re(c e^(2 pi i order phase))."""
        part = self.weight * self.approach
        angle = 2 * jnp.pi * real(order) * self.phase
        return 2 * jax.lax.complex(jnp.sum(part * jnp.cos(angle)), -jnp.sum(part * jnp.sin(angle)))


def settled_vibration(
    model: DimensionlessModel, frequency, *, start=None, settling: int = 100, periods: int = 2, steps: int = 96
) -> Settled:
    """The vibration that a model settles to from a state; differentiable in the model and the frequency.

    Derivatives are those of the periodic orbit (implicit function theorem over the recorded cycles), not of the way to
    it; where it has not settled they are those of the recorded cycles from a fixed state.

    Args:
        model: dimensionless model.
        frequency: Omega, mesh frequency over omega_0.
        start: (x, x') at mesh position 0 in place of the loaded mean at rest, shape (2,).
        settling: mesh cycles before the recorded ones; transients fade by exp(-2 pi zeta / Omega) in each.
        periods: mesh cycles that are recorded, a multiple of the vibration's period: 2 for sub-harmonics of order 1/2.
        steps: per mesh cycle, Runge-Kutta of order four.
    """
    check("settled_vibration", "frequency", frequency, "", low=0.0, open_low=True)
    for name, value in (("settling", settling), ("periods", periods), ("steps", steps)):
        whole("settled_vibration", name, value)
    frequency = real(frequency).astype(model.load.dtype)
    begin = at_rest(model) if start is None else real(start)
    return _settle(model, frequency, begin, settling, periods, steps)


def at_rest(model: DimensionlessModel) -> Float[Array, " two"]:
    """The loaded mean without vibration: (x_m, 0)."""
    mean = loaded_approach(model.clearance, model.load)
    shift = jnp.zeros_like(mean) if model.relief is None else jnp.mean(jax.vmap(model.relief)(_phases(64)))
    return jnp.stack([mean + shift, jnp.zeros_like(mean)])


@kernel
def _settle(model: DimensionlessModel, frequency: Scalar, begin, settling: int, periods: int, steps: int) -> Settled:
    oscillator, mesh_frequency = model.oscillator(), frequency / (2 * jnp.pi)
    prepared = steps_of(oscillator, model.mesh_force.nodes(steps).astype(begin.dtype))
    fixed = jax.lax.stop_gradient((oscillator, mesh_frequency, prepared, begin))
    y = _run(*fixed[:3], fixed[3], settling)
    y = jax.lax.stop_gradient(y)

    def over(y):
        return _run(oscillator, mesh_frequency, prepared, y, periods)

    jacobian = jax.lax.stop_gradient(jax.jacfwd(lambda y: _run(*fixed[:3], y, periods))(y))
    missed = over(y) - y
    inverse, determinant = _inverse(jacobian - jnp.eye(2, dtype=y.dtype))
    step = inverse @ missed
    # a Newton step lands on the orbit, and its derivative is the orbit's; far from it the step means nothing
    near = jnp.all(jnp.abs(jax.lax.stop_gradient(missed)) < 1e-2) & (jnp.abs(determinant) > 1e-9)
    start = jnp.where(near, y - jnp.where(near, step, 0.0), y)
    return _recorded(oscillator, mesh_frequency, prepared, start, periods)


def _recorded(oscillator: Oscillator, mesh_frequency: Scalar, prepared: Steps, start, periods: int) -> Settled:
    y, (x, v) = cycles(oscillator, _state(start), prepared, mesh_frequency, periods)
    turns = jnp.arange(periods, dtype=start.dtype)
    phase = (prepared.phase[None] + turns[:, None]).ravel()
    length = prepared.length
    weight = jnp.tile(0.5 * (length + jnp.roll(length, 1)) / periods, periods)
    approach = jax.vmap(oscillator.approach)(phase, x.reshape(-1, 1))
    force = jax.vmap(oscillator.mesh_force)(phase, approach)
    amplitude = 0.5 * (jnp.max(approach) - jnp.min(approach))
    miss = jnp.max(jnp.abs(_flat(y) - start))
    residual = safe_divide(miss, jnp.max(jnp.abs(approach)))
    settled = jnp.isfinite(approach).all() & (residual < _SETTLED)
    return Settled(phase, approach, force, weight, amplitude, residual, settled, start)


def _run(oscillator: Oscillator, mesh_frequency: Scalar, prepared: Steps, start, count: int):
    """State after some cycles, shape (2,)."""
    y, _ = jax.lax.scan(
        lambda y, _: (one_cycle(oscillator, y, prepared, mesh_frequency)[0], None), _state(start), length=count
    )
    return _flat(y)


def _state(flat: Float[Array, " two"]) -> State:
    return flat[:1], flat[1:]


def _flat(y: State) -> Float[Array, " two"]:
    return jnp.concatenate(y)


def _inverse(matrix):
    (a, b), (c, d) = matrix
    determinant = a * d - b * c
    safe = jnp.where(determinant == 0, 1.0, determinant)
    return jnp.stack([jnp.stack([d, -b]), jnp.stack([-c, a])]) / safe, determinant


def _phases(count: int) -> Float[Array, " positions"]:
    return real(np.arange(count) / count)
