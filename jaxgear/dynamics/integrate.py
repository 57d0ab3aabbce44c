"""Fixed steps that meet the same mesh positions in every cycle."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

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
