"""Fixed steps that meet the same mesh positions in every cycle, and statistics of a recorded motion."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..numerics import maximum
from .oscillator import Oscillator, State

Scalar = Float[Array, ""]

# Ends of a step at a jump of the force lie on the step's side, by this part of the step.
_ASIDE = 1e-6


# displacements and velocities at the begin of every step
Recorded = tuple[Float[Array, "*steps coordinates"], Float[Array, "*steps coordinates"]]


class Steps(NamedTuple):
    """One mesh cycle in steps; every field has the leading axis (steps,).

    Attributes:
        first, middle, last: data of the mesh force at the start, in the middle and at the end of every step.
        phase: mesh position at the start of every step [base pitches].
        length: length of every step [base pitches].
    """

    first: Any
    middle: Any
    last: Any
    phase: Float[Array, " steps"]
    length: Float[Array, " steps"]


def steps_of(oscillator: Oscillator, grid: Float[Array, " nodes"]) -> Steps:
    """The steps between the nodes of a grid from 0 to 1 [base pitches]."""
    start, length = grid[:-1], jnp.diff(grid)
    at = jax.vmap(oscillator.mesh_force.at)
    if oscillator.mesh_force.jumps:
        first, last = at(start + _ASIDE * length), at(start + (1 - _ASIDE) * length)
    else:
        first = at(start)
        last = jax.tree.map(lambda part: jnp.roll(part, -1, axis=0), first)
    return Steps(first, at(start + 0.5 * length), last, start, length)


def one_step(oscillator: Oscillator, y: State, step: Steps, mesh_frequency: Scalar) -> State:
    """The classical Runge-Kutta method of order four over one step."""
    h = step.length / mesh_frequency

    def rate(place, share, y):
        return oscillator.rate(place, step.phase + share * step.length, y, mesh_frequency)

    def moved(y, rate, by):
        return jax.tree.map(lambda part, slope: part + by * slope, y, rate)

    first = rate(step.first, 0.0, y)
    second = rate(step.middle, 0.5, moved(y, first, 0.5 * h))
    third = rate(step.middle, 0.5, moved(y, second, 0.5 * h))
    fourth = rate(step.last, 1.0, moved(y, third, h))
    return jax.tree.map(lambda part, a, b, c, d: part + h / 6 * (a + 2 * (b + c) + d), y, first, second, third, fourth)


def one_cycle(oscillator: Oscillator, y: State, steps: Steps, mesh_frequency: Scalar) -> tuple[State, Recorded]:
    """State after a cycle, and the states at the begin of every step, leading axis (steps,)."""
    return jax.lax.scan(lambda y, step: (one_step(oscillator, y, step, mesh_frequency), y), y, steps)


def cycles(
    oscillator: Oscillator, y: State, steps: Steps, mesh_frequency: Scalar, count: int
) -> tuple[State, Recorded]:
    """State after `count` cycles, and the states at the start of every step, leading axes (count, steps)."""
    return jax.lax.scan(lambda y, _: one_cycle(oscillator, y, steps, mesh_frequency), y, length=count)


class Cycle(NamedTuple):
    """Fine mesh positions of a cycle, from which steps over two, four, eight ... intervals are taken.

    Attributes:
        after: data of the mesh force at the positions, at a jump just after them, leading axis (positions,).
        before: data just before the positions, starting with the second position; None for a force without jumps.
        nodes: the positions and the end of the cycle [base pitches], shape (positions + 1,).
    """

    after: Any
    before: Any
    nodes: Float[Array, " nodes"]


def cycle_of(oscillator: Oscillator, steps: int) -> Cycle:
    """Mesh positions for a number of steps per cycle, and for its halves down to two steps.

    Nodes of the mesh force are ends of steps, never in the middle of a step.
    """
    ends = oscillator.mesh_force.nodes(steps).astype(oscillator.mass.dtype)
    nodes = jnp.zeros(2 * steps + 1, ends.dtype).at[::2].set(ends).at[1::2].set((ends[:-1] + ends[1:]) / 2)
    fine = steps_of(oscillator, nodes)
    return Cycle(fine.first, fine.last if oscillator.mesh_force.jumps else None, nodes)


def nodes_of(index: Int[Array, ""], stride: Int[Array, ""]) -> Int[Array, "3"]:
    """Indices of the positions at start, middle and end of a step over an even number of intervals."""
    return index * stride + jnp.stack([jnp.zeros_like(stride), stride // 2, stride])


def step_of(cycle: Cycle, index: Int[Array, ""], stride: Int[Array, ""]) -> Steps:
    """One step over an even number of intervals; index and stride may be traced."""
    begin, middle, end = nodes_of(index, stride)

    def at(places, place):
        return jax.tree.map(lambda part: jax.lax.dynamic_index_in_dim(part, place, keepdims=False), places)

    phase = at(cycle.nodes, begin)
    if cycle.before is None:
        last = at(cycle.after, end % (len(cycle.nodes) - 1))
    else:
        last = at(cycle.before, end - 1)
    return Steps(at(cycle.after, begin), at(cycle.after, middle), last, phase, at(cycle.nodes, end) - phase)


Samples = Float[Array, " samples"]
Thirds = Float[Array, "3 samples"]  # at the begin, in the middle and at the end of every step

SIMPSON = (1 / 6, 4 / 6, 1 / 6)  # weights of the three places of a step


class History(NamedTuple):
    """DTE and mesh force over recorded cycles, at three places of every step, shape (3, samples).

    Attributes:
        phase: mesh position at the start of every step [base pitches], 0 at the start of the first cycle, shape
            (samples,).
        length: length of every step [base pitches], shape (samples,).
        dte: dynamic transmission error (DTE) [um]; in the middle of a step from the cubic through values and velocities
            at its ends.
        velocity: velocity of the DTE at the start of every step [um/s], shape (samples,).
        force: elastic force of the mesh [N]; at a jump the value on the side of the step.
    """

    phase: Samples
    length: Samples
    dte: Thirds
    velocity: Samples
    force: Thirds


def history(oscillator: Oscillator, states: Recorded, end: State, steps: Steps, mesh_frequency: Scalar) -> History:
    """DTE and mesh force of recorded cycles.

    Args:
        oscillator: the oscillator.
        states: states at the start of every step, leading axes (cycles, steps), from `integrate.cycles`.
        end: state after the last step.
        steps: steps of a cycle.
        mesh_frequency: mesh frequency [Hz].
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
    """Root mean square about the mean; the derivative of a constant is zero."""
    square = mean(of, (values - mean(of, values)) ** 2)
    still = square <= 0
    return jnp.where(still, 0.0, jnp.sqrt(jnp.where(still, 1.0, square)))


def largest(values: Thirds) -> Scalar:
    """Largest value over time, by the parabola through the three values of every step.

    It is a smooth function of the orbit, also from one step to the next, and differs from the largest sample by the
    order of the square of the step.
    """
    begin, middle, end = values
    bend = 2 * begin - 4 * middle + 2 * end
    slope = -3 * begin + 4 * middle - end
    bent = bend < 0
    vertex = jnp.clip(jnp.where(bent, -0.5 * slope / jnp.where(bent, bend, 1.0), 0.0), 0.0, 1.0)
    at_vertex = begin + slope * vertex + bend * vertex**2
    return maximum(jnp.stack([jnp.where(bent, at_vertex, begin), begin, end]))


def smallest(values: Thirds) -> Scalar:
    """Smallest value over time, by the parabola through the three values of every step."""
    return -largest(-values)


def share(of: History, holds: Array) -> Scalar:
    """Share of time in which a condition of shape (3, samples) is true; without derivative."""
    return mean(of, holds.astype(of.dte.dtype))
