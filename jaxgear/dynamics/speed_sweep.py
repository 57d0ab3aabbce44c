"""Steady vibration over mesh frequency; each speed starts from the state of the previous one, as on a test rig."""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ..contact.status import Status, status_of
from ..numerics import Numbers, check, concrete, kernel, real, whole
from .integrate import cycle_of
from .oscillator import Oscillator, State, at_rest, natural_frequencies, static_force
from .response import SpeedResponse, waves_of
from .settling import Speed, kick_of, kicked, steady_state

Scalar = Float[Array, ""]
Speeds = Float[Array, " speeds"]
Direction = Literal["up", "down"]

ORDERS = tuple(half / 2 for half in range(1, 13))

# Steps over a period of the DTE's natural frequency and of the highest one, which no more than has to be stable,
# and over a cycle: dynamic factor and rms are then within 0.1 % of those of many more.
_STEPS_PER_PERIOD, _STEPS_PER_HIGHEST_PERIOD, _FEWEST_STEPS = 40, 8, 64
# With fewer steps over a period of the highest frequency the method of order four diverges: 2 pi over its limit, 2.83
STABLE_STEPS = 2.23
# By how much the dynamic factor of another motion must be larger before it takes the place of the one carried on: two
# records of one orbit differ by less.
_STRONGER = 1e-3
MOST_KICK = 50.0  # dynamic factor: many times those that are met


class _Sizes(NamedTuple):
    """Static sizes and options of a sweep."""

    most_steps: int
    fresh: bool
    most_periods: int
    points: int
    orders: tuple[float, ...]


def speed_sweep(
    oscillator: Oscillator,
    mesh_frequencies: Numbers,
    *,
    direction: Direction = "up",
    start: State | None = None,
    kick: float | None = None,
    carry: bool = True,
    steps: int | Sequence[int] | None = None,
    tolerance: float | None = None,
    most_cycles: int = 500,
    most_periods: int = 4,
    points: int = 32,
    orders: Sequence[float] = ORDERS,
    kicks: Sequence[float] | jax.Array = (),
) -> SpeedResponse:
    """Steady state at every mesh frequency, in ascending or descending order of the speeds.

    At each speed mesh cycles are integrated until the state at mesh position 0 equals the state one, two, three ...
    cycles before; then the orbit is recorded. Near a stable orbit its state is extrapolated, so that low damping needs
    few cycles. Use `jax.vmap` for many designs and loads; `speed_sweeps` distributes them to devices.

    Args:
        oscillator: a single oscillator.
        mesh_frequencies: mesh frequencies in increasing order for either direction [Hz], shape (speeds,).
        direction: "up" starts at the first mesh frequency, "down" at the last.
        start: coordinates [um] and velocities [um/s] at mesh position 0 at the start of the sweep, each of shape
            (coordinates,); None for the static equilibrium.
        kick: approximate dynamic factor, greater than 1, of the first contact after a start with separated flanks; None
            for no kick.
        carry: True to start each speed with the state of the previous one; False to start each like the first.
        steps: even number of steps of the integrator per mesh cycle, one number or one for each speed, each a divisor
            of the largest; None for the number that the natural frequencies need. A traced oscillator needs `steps`,
            for instance by `steps_for` of a concrete one.
        tolerance: tolerance of the repetition of the state, relative to its size; None for the square root of the
            machine precision.
        most_cycles: largest number of mesh cycles to settle; beyond it the speed has not converged.
        most_periods: largest number of mesh cycles of an orbit.
        points: number of mesh cycles recorded if no orbit was found, and number of Poincare points.
        orders: orders of the harmonics, multiples of the mesh frequency.
        kicks: dynamic factors, at least 1, of additional starts with separated flanks at every speed. The orbit with
            the largest dynamic factor is recorded and continued. Kicks find orbits that are not connected with others,
            such as orbits of two mesh cycles below twice the natural frequency; see `settings.KICKS`. Each kick takes
            as long as a sweep.

    Returns:
        the response; speeds in the order of `mesh_frequencies`.

    Raises:
        ValueError: in one line for frequencies that are not increasing positive numbers, a batch of oscillators, or an
            option outside its range.
    """
    frequencies = checked_frequencies(mesh_frequencies)
    check_single(oscillator)
    sizes, limits = prepared(
        oscillator, frequencies, direction=direction, kick=kick, carry=carry, steps=steps,
        tolerance=tolerance, most_cycles=most_cycles, most_periods=most_periods, points=points, orders=orders,
        kicks=kicks,
    )  # fmt: skip
    found = swept(oscillator, frequencies, start_of(oscillator, start), limits, sizes)
    return dataclasses.replace(found, direction=direction)


def checked_frequencies(given: Numbers) -> Speeds:
    """Mesh frequencies as an array; raises a one-line `ValueError` unless they increase from above zero."""
    frequencies = real(given)
    if frequencies.ndim != 1 or not len(frequencies):
        raise ValueError(f"mesh_frequencies has shape {frequencies.shape}, must be a list of numbers")
    check("mesh_frequencies", frequencies, "Hz", low=0.0, open_low=True)
    known = concrete(frequencies)
    if known is not None and (np.diff(known) <= 0).any():
        raise ValueError("mesh_frequencies must increase; direction gives the order of the sweep")
    return frequencies


def steps_for(oscillator: Oscillator, mesh_frequencies: Numbers) -> tuple[int, ...]:
    """Steps per mesh cycle that `speed_sweep` uses at each speed by default.

    Args:
        oscillator: concrete oscillator, or a batch, of which the stiffest one decides.
        mesh_frequencies: mesh frequencies [Hz], shape (speeds,).

    Raises:
        ValueError: for a traced oscillator.
    """
    frequencies = concrete(checked_frequencies(mesh_frequencies))
    if frequencies is None or any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(oscillator)):
        raise ValueError("the oscillator is traced, steps cannot be chosen by its natural frequency; give steps")
    of_many = natural_frequencies
    for _ in range(oscillator.mass.ndim - 1):
        of_many = jax.vmap(of_many)
    natural = of_many(oscillator)
    mesh, highest = float(np.max(natural.mesh)), float(np.max(natural.highest))
    needed = max(_STEPS_PER_PERIOD * mesh, _STEPS_PER_HIGHEST_PERIOD * highest) / frequencies
    doublings = np.ceil(np.log2(np.maximum(needed / _FEWEST_STEPS, 1.0)))
    return tuple(int(_FEWEST_STEPS * 2**power) for power in doublings)


def check_single(oscillator: Oscillator) -> None:
    """Raise a one-line `ValueError` for a batch of oscillators."""
    if oscillator.mass.ndim != 1:
        many = f"oscillators of shape {oscillator.mass.shape[:-1]}"
        raise ValueError(f"oscillator holds {many}, must be one; many are for speed_sweeps or Dynamics.runs_of")


class _Limits(NamedTuple):
    """Options of a sweep that do not require a new compilation."""

    steps: Int[Array, " speeds"]
    down: Bool[Array, ""]
    tolerance: Scalar
    most_cycles: Int[Array, ""]
    kick: Scalar
    kicks: Float[Array, " kicks"]  # 1 for none


def prepared(
    oscillator: Oscillator | None,
    frequencies: Speeds,
    *,
    direction: Direction = "up",
    kick: float | None = None,
    carry: bool = True,
    steps: int | Sequence[int] | None = None,
    tolerance: float | None = None,
    most_cycles: int = 500,
    most_periods: int = 4,
    points: int = 32,
    orders: Sequence[float] = ORDERS,
    kicks: Sequence[float] | jax.Array = (),
) -> tuple[_Sizes, _Limits]:
    """Check the options of a sweep; returns static sizes and traced limits. No oscillator: `steps` are needed."""
    if direction not in ("up", "down"):
        raise ValueError(f'direction = {direction!r} must be "up" or "down"')
    if not isinstance(carry, bool):
        raise ValueError(f"carry = {carry!r} must be True or False")
    dtype = frequencies.dtype
    precision = float(jnp.finfo(dtype).eps)
    least_change = real(precision**0.5 if tolerance is None else tolerance)
    first, further = real(1.0 if kick is None else kick), real(kicks)
    check("tolerance", least_change, "", low=precision, high=0.1)
    check("kick", first, "", low=1.0, high=MOST_KICK)
    if further.ndim != 1:
        raise ValueError(f"kicks has shape {further.shape}, must be a list of numbers")
    check("kicks", further, "", low=1.0, high=MOST_KICK)
    orders = tuple(float(order) for order in np.atleast_1d(np.asarray(orders, float)))
    check("orders", np.asarray(orders), "", low=0.0, open_low=True)
    most_cycles = whole("most_cycles", most_cycles)
    most_periods, points = whole("most_periods", most_periods), whole("points", points)
    if points < most_periods:
        raise ValueError(f"points = {points} must be at least most_periods = {most_periods}")
    counts = _counts(oscillator, frequencies, steps)
    sizes = _Sizes(max(counts), not carry, most_periods, points, orders)
    return sizes, _Limits(
        jnp.asarray(counts),
        jnp.asarray(direction == "down"),
        least_change.astype(dtype),
        jnp.asarray(most_cycles),
        first.astype(dtype),
        further.astype(dtype),
    )


def _counts(oscillator, frequencies, steps) -> tuple[int, ...]:
    if steps is None:
        return steps_for(oscillator, frequencies)
    if isinstance(steps, int | np.integer):
        steps = (steps,) * len(frequencies)
    counts = tuple(whole("steps", count, low=8) for count in steps)
    if len(counts) != len(frequencies):
        raise ValueError(f"steps has {len(counts)} numbers, must have one for each of {len(frequencies)} speeds")
    for count in counts:
        if count % 2 or max(counts) % count:
            raise ValueError(f"steps = {count} must be even and divide the largest, {max(counts)}")
    return counts


def start_of(oscillator: Oscillator, start: State | None) -> State | None:
    """Checked start of a sweep; None for the static equilibrium."""
    if start is None:
        return None
    shape = oscillator.mass.shape
    if not isinstance(start, tuple) or len(start) != 2 or any(jnp.shape(part) != shape for part in start):
        raise ValueError(f"start must be coordinates and velocities, each of shape {shape}")
    x, v = (real(part) for part in start)
    check("start", x, "um")
    check("start", v, "um/s")
    return x, v


@kernel
def swept(
    oscillator: Oscillator, frequencies: Speeds, start: State | None, limits: _Limits, sizes: _Sizes
) -> SpeedResponse:
    """Response of a sweep; its `direction` is always "up" here, the caller replaces it."""
    rest, static = at_rest(oscillator, jnp.zeros((), frequencies.dtype)), static_force(oscillator)
    begin = (rest.coordinates, jnp.zeros_like(rest.coordinates)) if start is None else start
    kick = kick_of(oscillator, rest, limits.kick)
    # the continued motion, then the kicks; kicks of 1 come last and are skipped
    factors = jnp.concatenate([jnp.ones(1, frequencies.dtype), -jnp.sort(-limits.kicks)])
    starts = 1 + jnp.sum(limits.kicks > 1)
    cycle = cycle_of(oscillator, sizes.most_steps)
    waves = waves_of(jnp.asarray(sizes.orders, frequencies.dtype), cycle.nodes)

    def at_speed(y, speed):
        frequency, steps = speed
        first = kicked(oscillator, begin, kick, frequency) if sizes.fresh else y
        at = Speed(frequency, cycle, steps, sizes.most_steps)

        def from_start(start):
            return steady_state(oscillator, start, at, limits, sizes, static, waves)

        if not len(limits.kicks):
            found = from_start(first)
            return found.state, found

        def stronger(number, best):
            thrown = kicked(oscillator, begin, kick_of(oscillator, rest, factors[number]), frequency)
            other = from_start(jax.tree.map(partial(jnp.where, number == 0), first, thrown))
            most = (1 + _STRONGER) * best.numbers.dynamic_factor
            better = (number == 0) | (other.period > 0) & (other.numbers.dynamic_factor > most)
            return jax.tree.map(partial(jnp.where, better), other, best)

        # in one loop, so that the motion at one speed is compiled once
        nothing = jax.tree.map(lambda of: jnp.zeros(of.shape, of.dtype), jax.eval_shape(from_start, first))
        found = jax.lax.fori_loop(0, starts, stronger, nothing)
        return found.state, found

    def turned(parts):
        return jax.tree.map(lambda part: jnp.where(limits.down, part[::-1], part), parts)

    speeds = turned((frequencies, limits.steps))
    _, found = jax.lax.scan(at_speed, kicked(oscillator, begin, kick, speeds[0][0]), speeds)
    found = turned(found)
    return SpeedResponse(
        mesh_frequency=frequencies,
        **found.numbers._asdict(),
        period=found.period,
        poincare_dte=found.dte,
        poincare_velocity=found.velocity,
        # a map of contacts that were not found is no force
        status=status_of({Status.NO_STEADY_MOTION: found.period <= 0}, oscillator.status),
        state=found.state,
        orders=sizes.orders,
        direction="up",
    )
