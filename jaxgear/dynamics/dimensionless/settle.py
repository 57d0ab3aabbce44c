"""The settled vibration of an oscillator with one coordinate, by fixed steps, and its derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ...contact.status import Status, Statuses, WithStatus, status_of
from ...numerics import Checked, Given, Numbers, check, kernel, program, real, result, safe_divide, whole
from ..orbit import settled_orbit
from .model import DimensionlessModel, loaded_te

Scalar = Float[Array, ""]

# Change of the state over the recorded cycles, relative to its size, below which a vibration counts as settled
_SETTLED = 1e-5


class Settled(WithStatus, Checked):
    """A settled vibration; every number dimensionless.

    Attributes:
        phase: mesh positions of the samples [base pitches], shape (samples,).
        dte: x there, shape (samples,).
        force: of the mesh over b k_mean, shape (samples,).
        weight: share of the recorded time that a sample stands for, shape (samples,).
        amplitude: half of the range of x, S1's alpha_max.
        residual: change of the state over the recorded cycles, relative to the size of the vibration.
        status: `Status.NO_STEADY_MOTION` where that is too large, the orbit is unstable, or the vibration left the
            range of a polynomial.
        start: state at mesh position 0, of the oscillator's coordinate.
    """

    phase: Float[Array, " samples"] = result("base pitches")
    dte: Float[Array, " samples"] = result()
    force: Float[Array, " samples"] = result()
    weight: Float[Array, " samples"] = result()
    amplitude: Scalar = result()
    residual: Scalar = result()
    status: Statuses = result()
    start: Float[Array, " two"] = result()

    @property
    def mean(self) -> Scalar:
        """Of x."""
        return jnp.sum(self.weight * self.dte)

    def harmonic(self, order: Given) -> Complex[Array, ""]:
        """Complex amplitude c of x ~ Re(c e^(2 pi i order phase))."""
        return _harmonic(self.phase, self.weight * self.dte, real(order))


def settled_vibration(
    model: DimensionlessModel,
    frequency: Given,
    *,
    start: Numbers | None = None,
    settling: int = 100,
    periods: int = 2,
    steps: int = 96,
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
    mean = loaded_te(model.clearance, model.load)
    shift = jnp.zeros_like(mean) if model.relief is None else jnp.mean(jax.vmap(model.relief)(_phases(64)))
    return jnp.stack([mean + shift, jnp.zeros_like(mean)])


@kernel
def _settle(model: DimensionlessModel, frequency: Scalar, begin, settling: int, periods: int, steps: int) -> Settled:
    start = begin[:1], begin[1:]
    orbit = settled_orbit(model.oscillator(), frequency / (2 * jnp.pi), start, steps, settling, periods)
    length = jnp.diff(orbit.phase, append=jnp.full(1, periods, orbit.phase.dtype))
    residual = safe_divide(orbit.residual, jnp.max(jnp.abs(orbit.dte)))
    settled = jnp.isfinite(orbit.dte).all() & orbit.stable & (residual < _SETTLED)
    return Settled(
        phase=orbit.phase,
        dte=orbit.dte,
        force=orbit.force,
        weight=0.5 * (length + jnp.roll(length, 1)) / periods,
        amplitude=0.5 * (orbit.dte_max - orbit.dte_min),
        residual=residual,
        status=status_of({Status.NO_STEADY_MOTION: ~settled}),
        start=jnp.concatenate(orbit.start),
    )


@program
def _harmonic(phase, part, order: Scalar) -> Complex[Array, ""]:
    angle = 2 * jnp.pi * order * phase
    return 2 * jax.lax.complex(jnp.sum(part * jnp.cos(angle)), -jnp.sum(part * jnp.sin(angle)))


def _phases(count: int) -> Float[Array, " positions"]:
    return real(np.arange(count) / count)
