"""Variation of a transmission error curve over one base pitch."""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Checked, program, result, spread
from ..numerics.reductions import Range

Curve = Float[Array, "... positions"]


class Harmonics(Checked):
    """Mesh-frequency harmonics 1 ... n of a curve: curve = mean + sum_n amplitude_n cos(2 pi n psi + phase_n).

    Attributes:
        amplitude: [unit of the curve], shape (..., n).
        phase: shape (..., n); zero with zero gradient where the amplitude vanishes.
    """

    amplitude: Float[Array, "... harmonics"] = result()
    phase: Float[Array, "... harmonics"] = result("deg")


@program
def peak_to_peak(curve: Curve) -> Float[Array, "..."]:
    """Largest minus smallest value over the positions (PPTE for a transmission error, in um).

    It touches two positions only, the first ones on ties: report it, and follow `smooth_peak_to_peak` or the harmonics
    when optimizing. NaN is passed on even where the reductions of the backend would drop it.
    """
    return spread(curve, axis=-1)


def smooth_peak_to_peak(curve: Curve, smoothing) -> Float[Array, "..."]:
    """Soft maximum minus soft minimum, smoothing log-mean-exp over the positions.

    Args:
        curve: values at equally spaced positions.
        smoothing: width of the soft extremes in units of the curve; towards zero the result rises to `peak_to_peak`.
    """
    return Range().soft(curve, smoothing)


def harmonics(curve: Curve, count: int = 5) -> Harmonics:
    """Amplitudes and phases of the first `count` mesh harmonics; amplitude_n = 2 |mean(curve e^(-2 pi i n psi))|."""
    positions = curve.shape[-1]
    if not 1 <= count < positions / 2:
        raise ValueError(f"harmonics: count = {count} must be at least 1 and less than half of {positions} positions")
    return Harmonics(*_amplitudes_and_phases(curve, count))


@partial(jax.jit, static_argnums=1, inline=True)
def _amplitudes_and_phases(curve, count):
    positions = curve.shape[-1]
    order = jnp.arange(1, count + 1, dtype=curve.dtype)
    angle = 2 * jnp.pi / positions * jnp.arange(positions, dtype=curve.dtype)[:, None] * order[None]
    real = 2 / positions * (curve @ jnp.cos(angle))
    imaginary = -2 / positions * (curve @ jnp.sin(angle))
    squared = real**2 + imaginary**2
    present = squared > 0
    amplitude = jnp.where(present, jnp.sqrt(jnp.where(present, squared, 1.0)), 0.0)
    phase = jnp.where(present, jnp.arctan2(jnp.where(present, imaginary, 0.0), jnp.where(present, real, 1.0)), 0.0)
    return amplitude, jnp.rad2deg(phase)
