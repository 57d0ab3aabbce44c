"""The settled vibration of an oscillator with one coordinate, by fixed steps, and its derivatives."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...contact.status import Status, status_of
from ...numerics import Given, Numbers, check, kernel, real, safe_divide, whole
from ..orbit import Orbit, settled_orbit
from .model import DimensionlessModel, loaded_te

Scalar = Float[Array, ""]

# Change of the state over the recorded cycles, relative to its size, below which a vibration counts as settled
_SETTLED = 1e-5


def settled_vibration(
    model: DimensionlessModel,
    frequency: Given,
    *,
    start: Numbers | None = None,
    settling: int = 100,
    periods: int = 2,
    steps: int = 96,
) -> Orbit:
    """The vibration that a model settles to from a state; differentiable in the model and the frequency.

    Its numbers are dimensionless: displacements in half clearances, forces over b k_mean, and the mesh frequency is
    Omega / (2 pi). The status is `Status.NO_STEADY_MOTION` where the state still changes over the recorded cycles, the
    orbit is unstable, or the vibration left the range of a polynomial.

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
    check("frequency", frequency, "", low=0.0, open_low=True)
    for name, value in (("settling", settling), ("periods", periods), ("steps", steps)):
        whole(name, value)
    frequency = real(frequency).astype(model.load.dtype)
    begin = at_rest(model) if start is None else real(start)
    return _settle(model, frequency, begin, settling, periods, steps)


def at_rest(model: DimensionlessModel) -> Float[Array, " two"]:
    """The loaded mean without vibration: (x_m, 0)."""
    mean = loaded_te(model.clearance, model.load)
    shift = jnp.zeros_like(mean) if model.relief is None else jnp.mean(jax.vmap(model.relief)(_phases(64)))
    return jnp.stack([mean + shift, jnp.zeros_like(mean)])


@kernel
def _settle(model: DimensionlessModel, frequency: Scalar, begin, settling: int, periods: int, steps: int) -> Orbit:
    start = begin[:1], begin[1:]
    orbit = settled_orbit(model.oscillator(), frequency / (2 * jnp.pi), start, steps, settling, periods)
    residual = safe_divide(orbit.residual, jnp.max(jnp.abs(orbit.dte)))
    settled = jnp.isfinite(orbit.dte).all() & orbit.stable & (residual < _SETTLED)
    return dataclasses.replace(orbit, status=status_of({Status.NO_STEADY_MOTION: ~settled}))


def _phases(count: int) -> Float[Array, " positions"]:
    return real(np.arange(count) / count)
