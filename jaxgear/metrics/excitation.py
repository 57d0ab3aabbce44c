"""Excitation of vibration: variation of the transmission error, mesh stiffness, and the force of both."""

from functools import partial
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import Checked, Given, over_batch, program, real, result, safe_divide, spread
from ..numerics.reductions import Range

Curves = TypeVar("Curves", Array, np.ndarray)

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

    The gradient depends on the positions of the largest and of the smallest value only; if several positions share an
    extreme value, on the first of them. For gradient methods use `smooth_peak_to_peak` or harmonics instead. NaN at any
    position gives NaN, also on backends whose reductions drop it.

    The function does not check convergence: the transmission error of a mesh cycle that has not converged is finite.
    Under `jax.jit` and `jax.vmap` use `optimize.evaluate("ppte", ...)`, which returns NaN in this case, or check
    `cycle.converged`.

    Args:
        curve: values, shape (..., positions).

    Returns:
        largest minus smallest value in the unit of the curve, shape (...).
    """
    return spread(curve, axis=-1)


def smooth_peak_to_peak(curve: Curve, smoothing: Given) -> Float[Array, "..."]:
    """Soft maximum minus soft minimum, smoothing log-mean-exp over the positions.

    Args:
        curve: values at equally spaced positions.
        smoothing: width of the soft extremes in units of the curve; towards zero the result rises to `peak_to_peak`.
    """
    return Range().soft(curve, smoothing)


def harmonics(curve: Curve, count: int = 5, *, first_phase: Given = 0.0) -> Harmonics:
    """Amplitudes and phases of the first `count` mesh harmonics; amplitude_n = 2 |mean(curve e^(-2 pi i n psi))|.

    Args:
        curve: values at equally spaced positions over one base pitch.
        count: number of harmonics.
        first_phase: mesh position psi of the first of them [base pitches], `cycle.phase[0]`; -1/2 with an odd number of
            pairs. Amplitudes do not depend on it.

    Raises:
        ValueError: for more harmonics than the positions resolve.
    """
    positions = curve.shape[-1]
    if not 1 <= count < positions / 2:
        raise ValueError(f"harmonics: count = {count} must be at least 1 and less than half of {positions} positions")
    return Harmonics(*_amplitudes_and_phases(curve, count, real(first_phase).astype(curve.dtype)))


@partial(jax.jit, static_argnums=1, inline=True)
def _amplitudes_and_phases(curve, count, first):
    positions = curve.shape[-1]
    order = jnp.arange(1, count + 1, dtype=curve.dtype)
    phase = first + jnp.arange(positions, dtype=curve.dtype) / positions
    angle = 2 * jnp.pi * phase[:, None] * order[None]
    along = 2 / positions * (curve @ jnp.cos(angle))
    imaginary = -2 / positions * (curve @ jnp.sin(angle))
    squared = along**2 + imaginary**2
    present = squared > 0
    amplitude = jnp.where(present, jnp.sqrt(jnp.where(present, squared, 1.0)), 0.0)
    phase = jnp.where(present, jnp.arctan2(jnp.where(present, imaginary, 0.0), jnp.where(present, along, 1.0)), 0.0)
    return amplitude, jnp.rad2deg(phase)


@over_batch
def relative_transmission_error(cycle: MeshCycle) -> Curve:
    """Loaded transmission error divided by its mean; its peak-to-peak value is PPTE relative to the mean.

    Use it to compare gears of different size and load. Without load the result is 0.
    """
    return safe_divide(cycle.transmission_error, jnp.mean(cycle.transmission_error))


@over_batch
def force_excitation(cycle: MeshCycle) -> Curve:
    """Excitation force of the mesh k(psi) (TE(psi) - mean TE) [N], with the tangent mesh stiffness k.

    To first order it is the deviation of the mesh force from the static force if gears of large inertia turn uniformly
    at the mean transmission error. With a constant stiffness it is the excitation of linear models: stiffness times the
    variation of the loaded transmission error.

    References:
        H. N. Ozguven, D. R. Houser, J. Sound Vib. 125 (1988) 71-83, on the loaded static transmission error as the
        excitation; for the local slope Cooley, Liu, Dai, Parker, Mech. Mach. Theory 105 (2016) 540-553.
    """
    return excited_by(cycle.transmission_error, cycle.tangent_stiffness)


def excited_by(error: Curves, stiffness: Curves) -> Curves:
    """Force excitation [N] of a transmission error [um] and mesh stiffness [N/um] at the same positions."""
    return stiffness * (error - error.mean())


@over_batch
def secant_stiffness(cycle: MeshCycle) -> Float[Array, " positions"]:
    """Secant mesh stiffness k = F / (loaded - unloaded transmission error) [N/um], shape (positions,); 0 at zero
    torque.

    Use it for static deflections; for small vibrations about the loaded state use `cycle.tangent_stiffness`, the local
    slope (Cooley, Liu, Dai, Parker, Mech. Mach. Theory 105 (2016) 540-553). The secant stiffness decreases during the
    transition between pairs even if the tangent stiffness does not.
    """
    return safe_divide(cycle.force, cycle.transmission_error - cycle.unloaded_transmission_error)
