"""Steady vibration of a dimensionless model by fixed steps, with derivatives."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact.status import Status, status_of
from ..dynamics.orbit import Orbit, settled_orbit
from ..numerics import Given, Numbers, check, kernel, real, safe_divide, whole
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
    """Steady vibration of a model from an initial state, differentiable with respect to the model and the frequency.

    The results are dimensionless: displacements in half clearances, forces over b k_mean, and the mesh frequency is
    Omega / (2 pi). The status is `Status.NO_STEADY_MOTION` if the state still changes over the recorded cycles, the
    orbit is unstable, or the vibration has left the range of a polynomial.

    Derivatives are those of the periodic orbit (implicit function theorem over the recorded cycles). If the motion has
    not settled they are those of the recorded cycles from a fixed initial state.

    Args:
        model: dimensionless model.
        frequency: Omega, mesh frequency over omega_0.
        start: state (x, x') at mesh position 0, shape (2,); None for the loaded mean at rest.
        settling: number of mesh cycles before the recorded cycles; transients decay by exp(-2 pi zeta / Omega) in each.
        periods: number of recorded mesh cycles, a multiple of the period: 2 for sub-harmonics of order 1/2.
        steps: Runge-Kutta steps of order four per mesh cycle.
    """
    check("frequency", frequency, "", low=0.0, open_low=True)
    for name, value in (("settling", settling), ("periods", periods), ("steps", steps)):
        whole(name, value)
    frequency = real(frequency).astype(model.load.dtype)
    begin = at_rest(model) if start is None else real(start)
    return _settle(model, frequency, begin, settling, periods, steps)


def at_rest(model: DimensionlessModel) -> Float[Array, " two"]:
    """State (x_m, 0) of the loaded mean without vibration, shape (2,)."""
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
