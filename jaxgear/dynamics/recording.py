"""The steady state that a start leads to at one speed, and its record."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from .oscillator import Oscillator, State
from .response import Numbers, no_sums, numbers_of, with_cycle, with_step
from .settling import Speed, settled

Scalar = Float[Array, ""]

# Least dynamic factor of a steady motion: over an orbit the mesh force has the mean of the static one, but for a small
# share where springs beside the mesh carry some of the load. A motion so slow beside the mesh that a cycle hardly moves
# it repeats within any tolerance, and is not steady.
_BALANCED = 0.99


class Found(NamedTuple):
    """Steady state at one speed; names and units of `SpeedResponse`."""

    numbers: Numbers
    period: Int[Array, ""]
    dte: Float[Array, " points"]
    velocity: Float[Array, " points"]
    state: State


def steady_state(
    oscillator: Oscillator, y: State, speed: Speed, limits: Any, sizes: Any, static: Scalar, waves
) -> Found:
    """Steady state at one speed that a start leads to, and its record.

    Args:
        oscillator: one.
        y: start.
        speed: and the steps of its cycles.
        limits, sizes: of the sweep, as `speed_sweep.prepared` gives them.
        static: mesh force at rest [N].
        waves: of the orders at the nodes of a cycle.
    """
    frequency = speed.frequency
    y, period = settled(oscillator, y, speed, limits.tolerance, limits.most_cycles, sizes.most_periods)
    orders = jnp.asarray(sizes.orders, frequency.dtype)
    zero = jnp.zeros((), frequency.dtype)
    origin = oscillator.dte(zero, y[0])
    cycles = jnp.where(period > 0, period, sizes.points)

    def on(carry):
        return carry[0] < cycles

    def recorded(carry):
        cycle, y, sums, dtes, velocities = carry
        q, v = oscillator.dte(zero, y[0]), oscillator.dte_rate(zero, y[1], frequency)
        # an orbit's points repeat, so that there are as many for every speed
        here = jnp.arange(sizes.points) % cycles == cycle
        dtes, velocities = jnp.where(here, q, dtes), jnp.where(here, v, velocities)

        def more(carry, step, nodes):
            y, sums = carry
            return with_step(sums, oscillator, y, step, frequency, waves=waves[nodes], origin=origin)

        nothing = no_sums(orders)
        begin = sums._replace(force=nothing.force, dte=nothing.dte)
        y, of_cycle = speed.over_cycle(more, (y, begin))
        sums = with_cycle(sums, of_cycle, cycle, orders)
        return cycle + 1, y, sums, dtes, velocities

    nothing = jnp.zeros(sizes.points, frequency.dtype)
    begin = jnp.zeros_like(cycles), y, no_sums(orders), nothing, nothing
    _, y, sums, dtes, velocities = jax.lax.while_loop(on, recorded, begin)
    count = cycles.astype(frequency.dtype)
    numbers = numbers_of(sums, frequency, cycles=count, orders=orders, origin=origin, static_force=static)
    period = jnp.where(numbers.dynamic_factor > _BALANCED, period, 0)
    return Found(numbers, period, dtes, velocities, y)
