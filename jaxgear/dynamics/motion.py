"""A motion of an oscillator over time: what phase portraits and time histories show."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Checked, kernel, result, whole
from .integrate import cycles
from .oscillator import Oscillator
from .poincare import STEPS, checked, steps_at

Samples = Float[Array, " samples"]


class Motion(Checked):
    """Result of `motion`, at the begin of every step of the integrator.

    Attributes:
        phase: mesh position [base pitches], shape (samples,).
        dte: dynamic transmission error (DTE) [um], shape (samples,).
        dte_rate: [um/s], shape (samples,).
        force: elastic force of the mesh [N], shape (samples,): zero where nothing touches, negative on the coast
            flanks.
        support_force: by which springs and dampers to ground and between coordinates hold every coordinate [N], shape
            (samples, coordinates); `on_bearings` says which are the bearings of pinion and wheel.
    """

    phase: Samples = result()
    dte: Samples = result("um")
    dte_rate: Samples = result("um/s")
    force: Samples = result("N")
    support_force: Float[Array, "samples coordinates"] = result("N")


def motion(oscillator: Oscillator, mesh_frequency: Any, start: Any, *, periods: int = 1, steps: Any = STEPS) -> Motion:
    """The motion from a state over some mesh cycles.

    Args:
        oscillator: that moves.
        mesh_frequency: [Hz], a single number.
        start: displacements [um] and velocities [um/s] at mesh position 0, each of shape (coordinates,).
        periods: number of mesh cycles.
        steps: number of equal steps of a mesh cycle, or its nodes from 0 to 1 [base pitches].

    Raises:
        TypeError: for something else than an `Oscillator`.
        ValueError: for a mesh frequency that is not positive, a start of another shape or steps out of order.
    """
    frequency, start, nodes = checked("motion", oscillator, mesh_frequency, start, steps)
    return _moved(oscillator, frequency, start, nodes, whole("motion", "periods", periods))


@kernel
def _moved(oscillator: Oscillator, frequency, start, nodes, periods: int) -> Motion:
    steps = steps_at(oscillator, nodes)
    _, states = cycles(oscillator, start, steps, frequency, periods)

    def of_step(step, phase, x, v):
        q, rate = oscillator.dte(phase, x), oscillator.dte_rate(phase, v, frequency)
        return phase, q, rate, oscillator.mesh_force.force(step.first, q), oscillator.support_force(x, v)

    def of_cycle(number, x, v):
        return jax.vmap(of_step)(steps, steps.phase + number, x, v)

    found = jax.vmap(of_cycle)(jnp.arange(periods, dtype=frequency.dtype), *states)
    return Motion(*(part.reshape(-1, *part.shape[2:]) for part in found))
