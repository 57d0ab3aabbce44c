"""What one recorded orbit says: extremes and means that do not depend on where the steps of an integrator end."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import maximum
from .integrate import Recorded, Steps
from .oscillator import Oscillator, State

Scalar = Float[Array, ""]
Samples = Float[Array, " samples"]
Thirds = Float[Array, "3 samples"]  # at the begin, in the middle and at the end of every step

SIMPSON = (1 / 6, 4 / 6, 1 / 6)  # weights of the three places of a step


class History(NamedTuple):
    """DTE and force over some recorded cycles, in three places of every step, one step after the other.

    Attributes:
        phase: where every step begins [base pitches], from 0 at the begin of the first cycle on.
        length: of every step [base pitches].
        dte: dynamic transmission error (DTE) [um]; in the middle of a step by the cubic that fits values and
            velocities at its ends.
        velocity: of the DTE at the begin of every step [um/s].
        force: elastic force of the mesh [N], on the step's side where it jumps.
    """

    phase: Samples
    length: Samples
    dte: Thirds
    velocity: Samples
    force: Thirds


def history(oscillator: Oscillator, states: Recorded, end: State, steps: Steps, mesh_frequency: Scalar) -> History:
    """The history of recorded cycles.

    Args:
        oscillator: that moved.
        states: at the begin of every step, leading axes (cycles, steps), as `integrate.cycles` gives them.
        end: state after the last step.
        steps: of a cycle.
        mesh_frequency: [Hz].
    """
    count, size = states[0].shape[:2]
    x, v = (part.reshape(count * size, -1) for part in states)
    x_end, v_end = (jnp.concatenate([part[1:], last[None]]) for part, last in zip((x, v), end))
    repeated = jax.tree.map(lambda part: jnp.tile(part, (count,) + (1,) * (part.ndim - 1)), steps)

    def of_step(x, v, x_end, v_end, step):
        last = step.phase + step.length
        begin, finish = oscillator.dte(step.phase, x), oscillator.dte(last, x_end)
        rate = oscillator.dte_rate(step.phase, v, mesh_frequency)
        change = rate - oscillator.dte_rate(last, v_end, mesh_frequency)
        middle = 0.5 * (begin + finish) + step.length / mesh_frequency * change / 8
        force = oscillator.mesh_force.force
        forces = force(step.first, begin), force(step.middle, middle), force(step.last, finish)
        return jnp.stack([begin, middle, finish]), rate, jnp.stack(forces)

    dte, velocity, force = jax.vmap(of_step, out_axes=(1, 0, 1))(x, v, x_end, v_end, repeated)
    cycle = jnp.repeat(jnp.arange(count, dtype=steps.phase.dtype), size)
    return History(repeated.phase + cycle, repeated.length, dte, velocity, force)


def mean(of: History, values: Thirds) -> Scalar:
    """Mean over time, by Simpson's rule in every step."""
    weights = jnp.asarray(SIMPSON, values.dtype)
    return jnp.sum((weights @ values) * of.length) / jnp.sum(of.length)


def rms(of: History, values: Thirds) -> Scalar:
    """Root mean square about the mean; without a derivative where nothing moves."""
    square = mean(of, (values - mean(of, values)) ** 2)
    still = square <= 0
    return jnp.where(still, 0.0, jnp.sqrt(jnp.where(still, 1.0, square)))


def largest(values: Thirds) -> Scalar:
    """Largest value over time, by the parabola through the three values of every step.

    It moves smoothly with the orbit, from one step to the next as well, and differs from the largest of the samples by
    the square of the step.
    """
    begin, middle, end = values
    bend = 2 * begin - 4 * middle + 2 * end
    slope = -3 * begin + 4 * middle - end
    bent = bend < 0
    vertex = jnp.clip(jnp.where(bent, -0.5 * slope / jnp.where(bent, bend, 1.0), 0.0), 0.0, 1.0)
    at_vertex = begin + slope * vertex + bend * vertex**2
    return maximum(jnp.stack([jnp.where(bent, at_vertex, begin), begin, end]))


def smallest(values: Thirds) -> Scalar:
    """Smallest value over time, as `largest`."""
    return -largest(-values)


def share(of: History, holds: Array) -> Scalar:
    """Share of the time in which something holds, shape (3, samples); it has no derivative."""
    return mean(of, holds.astype(of.dte.dtype))
