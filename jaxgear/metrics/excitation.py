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

    Its gradient is that of two positions, of the largest and of the smallest value; where several positions share an
    extreme value, that of the first of them. Report it, and optimize `smooth_peak_to_peak` or harmonics where gradients
    are followed. NaN at any position gives NaN, also on backends whose reductions drop it.

    It knows a curve and no status: the transmission error of a mesh cycle that has not converged is finite. Under
    `jax.jit` and `jax.vmap` take `optimize.evaluate("ppte", ...)`, which gives NaN there, or look at `cycle.converged`.

    Args:
        curve: values over the positions, which are the last axis.

    Returns:
        largest minus smallest value, in the unit of the curve, of the shape of the other axes.
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
    """Loaded transmission error over its mean; its peak to peak is PPTE as a share of the mean loaded error.

    It compares gears of different size and load. With no load the error has no mean, and the result is 0.
    """
    return safe_divide(cycle.transmission_error, jnp.mean(cycle.transmission_error))


@over_batch
def force_excitation(cycle: MeshCycle) -> Curve:
    """Force by which the mesh excites vibration [N]: k(psi) (TE(psi) - mean TE), with the local mesh stiffness k.

    Gears of great inertia turn uniformly, at the mean transmission error: the force between their flanks differs from
    the static one by this much, to first order. With a constant stiffness it is that times the variation of the loaded
    transmission error, the excitation of linear models.

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
    """Average slope k = F / (loaded - unloaded transmission error) [N/um]; 0 at zero torque.

    It serves static deflections; for small vibrations about the loaded state use `cycle.tangent_stiffness`, the local
    slope (Cooley, Liu, Dai, Parker, Mech. Mach. Theory 105 (2016) 540-553). The secant falls in the hand-over between
    pairs even where nothing softens.
    """
    return safe_divide(cycle.force, cycle.transmission_error - cycle.unloaded_transmission_error)
