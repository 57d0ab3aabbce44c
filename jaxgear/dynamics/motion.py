"""Motions over time: phase portraits and time histories at one speed, run-up and run-down."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..numerics import Checked, Given, Numbers, check, concrete, kernel, real, result, whole
from .integrate import cycle_of, cycles, history, largest, one_step, smallest, step_of
from .oscillator import Oscillator, State, at_rest, static_force
from .poincare import STEPS, Start, checked, steps_at
from .speed_sweep import check_single, start_of, steps_for

Samples = Float[Array, " samples"]


class Motion(Checked):
    """Motion of an oscillator at the start of every step of the integrator; result of `motion`.

    Attributes:
        phase: mesh position [base pitches], shape (samples,).
        dte: dynamic transmission error (DTE) [um], shape (samples,).
        dte_rate: rate of the DTE [um/s], shape (samples,).
        force: elastic force of the mesh [N], shape (samples,): zero without contact, negative on the coast flanks.
        support_force: force of springs and dampers, to ground and between coordinates, on every coordinate [N], shape
            (samples, coordinates); the coordinates of the bearings are described in `on_bearings`.
    """

    phase: Samples = result()
    dte: Samples = result("um")
    dte_rate: Samples = result("um/s")
    force: Samples = result("N")
    support_force: Float[Array, "samples coordinates"] = result("N")


def motion(
    oscillator: Oscillator, mesh_frequency: Given, start: Start, *, periods: int = 1, steps: Numbers = STEPS
) -> Motion:
    """Motion from a given state over a number of mesh cycles.

    Args:
        oscillator: the oscillator.
        mesh_frequency: mesh frequency [Hz], shape ().
        start: displacements [um] and velocities [um/s] at mesh position 0, each of shape (coordinates,).
        periods: number of mesh cycles.
        steps: number of equal steps of a mesh cycle, or its nodes from 0 to 1 [base pitches].

    Raises:
        TypeError: for something else than an `Oscillator`.
        ValueError: for a mesh frequency that is not positive, a start of another shape or steps out of order.
    """
    frequency, start, nodes = checked(oscillator, mesh_frequency, start, steps)
    return _moved(oscillator, frequency, start, nodes, whole("periods", periods))


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


Scalar = Float[Array, ""]


SAMPLES = 200  # stretches for which extremes are given


class RunUp(Checked):
    """Vibration during a change of speed; every sample is an interval of whole mesh cycles.

    Attributes:
        time: time at the end of every interval [s], shape (samples,).
        mesh_frequency: mesh frequency at the end of every interval [Hz], shape (samples,).
        dynamic_factor: largest elastic mesh force in the interval over the static force, shape (samples,).
        dte_min, dte_max: extremes of the DTE in the interval [um], shape (samples,).
        state: coordinates [um] and velocities [um/s] at the end of every interval, each of shape (samples,
            coordinates).
    """

    time: Samples = result("s")
    mesh_frequency: Samples = result("Hz")
    dynamic_factor: Samples = result()
    dte_min: Samples = result("um")
    dte_max: Samples = result("um")
    state: tuple[Float[Array, "samples coordinates"], Float[Array, "samples coordinates"]] = result()


def run_up(
    oscillator: Oscillator,
    *,
    first: float,
    last: float,
    duration: float,
    samples: int = SAMPLES,
    start: State | None = None,
    steps: int | None = None,
) -> RunUp:
    """Vibration during a run-up at constant acceleration; a run-down if `last` is below `first`.

    Steps are equal in mesh position, so that the mesh force is evaluated at the same positions in every cycle. With the
    frequency f(t) = first + (last - first) t / duration, f^2 is linear in the mesh position: over a step of length L
    it grows by 2 L (last - first) / duration. A step is integrated at the frequency that covers it in its time.

    Args:
        oscillator: one oscillator.
        first, last: mesh frequencies between which the speed changes [Hz].
        duration: duration of the change [s], rounded to a whole number of mesh cycles per sample.
        samples: number of intervals for which extremes are returned.
        start: coordinates [um] and velocities [um/s] at mesh position 0; None for the static equilibrium.
        steps: even number of steps of the integrator per mesh cycle; None for the number that the lower speed needs.

    Raises:
        ValueError: in one line for a number outside its range, a duration too short for the samples, or traced
            arguments.
    """
    low, high = _number("first", first, "Hz"), _number("last", last, "Hz")
    time = _number("duration", duration, "s")
    samples = whole("samples", samples)
    check_single(oscillator)
    cycles = int(np.floor((low + high) / 2 * time / samples))
    if cycles < 1:
        raise ValueError(
            f"duration = {time:g} s holds {(low + high) / 2 * time:.3g} mesh cycles, must be at least one for "
            f"each of {samples} samples"
        )
    size = steps_for(oscillator, [min(low, high)])[0] if steps is None else whole("steps", steps, low=8)
    if size % 2:
        raise ValueError(f"steps = {size} must be even")
    dtype = oscillator.mass.dtype
    ends = jnp.asarray([low, high], dtype)
    return _run(oscillator, start_of(oscillator, start), ends, jnp.asarray(cycles), samples, size)


def _number(name: str, value, unit: str) -> float:
    known = concrete(real(value))
    if known is None or known.ndim:
        raise ValueError(f"{name} must be one concrete number")
    check(name, known, unit, low=0.0, open_low=True)
    return float(known)


class _Moving(NamedTuple):
    y: State
    time: Scalar
    peak: Scalar
    lowest: Scalar
    highest: Scalar


@kernel
def _run(
    oscillator: Oscillator,
    start: State | None,
    ends: Float[Array, "2"],
    cycles: Int[Array, ""],
    samples: int,
    size: int,
) -> RunUp:
    cycle = cycle_of(oscillator, size)
    rest = at_rest(oscillator, jnp.zeros((), ends.dtype))
    y = (rest.coordinates, jnp.zeros_like(rest.coordinates)) if start is None else start
    total = (samples * cycles).astype(ends.dtype)

    def frequency_at(position):
        """Mesh frequency [Hz] after a number of cycles."""
        return jnp.sqrt(ends[0] ** 2 + (ends[1] ** 2 - ends[0] ** 2) * position / total)

    def stepped(index, moving: _Moving, done) -> _Moving:
        step = step_of(cycle, index % size, jnp.asarray(2))
        position = (done + index // size).astype(ends.dtype) + step.phase
        # the acceleration is constant in time: the mean of both ends covers the step in its time
        frequency = (frequency_at(position) + frequency_at(position + step.length)) / 2
        end = one_step(oscillator, moving.y, step, frequency)
        begin = jax.tree.map(lambda part: part[None, None], moving.y)
        of = history(oscillator, begin, end, jax.tree.map(lambda part: part[None], step), frequency)
        return _Moving(
            end,
            moving.time + step.length / frequency,
            jnp.maximum(moving.peak, largest(of.force)),
            jnp.minimum(moving.lowest, smallest(of.dte)),
            jnp.maximum(moving.highest, largest(of.dte)),
        )

    def stretch(carry, _):
        (y, time), number = carry
        far = jnp.full((), jnp.inf, ends.dtype)
        done = number * cycles
        begin = _Moving(y, time, -far, far, -far)
        moving = jax.lax.fori_loop(0, cycles * size, lambda i, moving: stepped(i, moving, done), begin)
        return ((moving.y, moving.time), number + 1), moving

    begin = ((y, jnp.zeros((), ends.dtype)), jnp.zeros_like(cycles))
    (_, _), found = jax.lax.scan(stretch, begin, length=samples)
    position = cycles * jnp.arange(1, samples + 1)
    return RunUp(
        time=found.time,
        mesh_frequency=frequency_at(position.astype(ends.dtype)),
        dynamic_factor=found.peak / static_force(oscillator),
        dte_min=found.lowest,
        dte_max=found.highest,
        state=found.y,
    )
