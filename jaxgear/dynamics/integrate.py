"""Fixed steps that meet the same mesh positions in every cycle, and what one recorded orbit says."""

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
        first, middle, last: places of the mesh force at the begin, in the middle and at the end of every step.
        phase: where every step begins [base pitches].
        length: of every step [base pitches].
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
    """State after some cycles, and the states at the begin of every step, leading axes (count, steps)."""
    return jax.lax.scan(lambda y, _: one_cycle(oscillator, y, steps, mesh_frequency), y, length=count)


class Cycle(NamedTuple):
    """Mesh positions of a cycle so close that steps of two, four, eight ... of their distances are taken from them.

    Attributes:
        after: places of the mesh force at the positions, where it jumps just after them, leading axis (positions,).
        before: just before the positions, the first of them the second position; None where nothing jumps.
        nodes: the positions and the end of the cycle [base pitches], shape (positions + 1,).
    """

    after: Any
    before: Any
    nodes: Float[Array, " nodes"]


def cycle_of(oscillator: Oscillator, steps: int) -> Cycle:
    """Mesh positions for so many steps per cycle, and for every half of that down to two steps.

    The positions that the force asks for are ends of the steps, never the middle of one.
    """
    ends = oscillator.mesh_force.nodes(steps).astype(oscillator.mass.dtype)
    nodes = jnp.zeros(2 * steps + 1, ends.dtype).at[::2].set(ends).at[1::2].set((ends[:-1] + ends[1:]) / 2)
    fine = steps_of(oscillator, nodes)
    return Cycle(fine.first, fine.last if oscillator.mesh_force.jumps else None, nodes)


def nodes_of(index: Int[Array, ""], stride: Int[Array, ""]) -> Int[Array, "3"]:
    """Positions of a cycle at the begin, in the middle and at the end of a step over an even number of them."""
    return index * stride + jnp.stack([jnp.zeros_like(stride), stride // 2, stride])


def step_of(cycle: Cycle, index: Int[Array, ""], stride: Int[Array, ""]) -> Steps:
    """One step over an even number of positions; neither it nor its number need be known to the compiler."""
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
