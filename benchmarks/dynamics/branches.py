"""Branches of the orbits that are known exactly: from one of them to the next by continuation."""

from collections.abc import Iterator, Sequence

import jax
import jax.numpy as jnp

from jaxgear.dynamics import Orbit, find_orbit, follow_orbits

from .known import MORE_ZETA, dead_zone, frequency, rectangular

_RANGE = 0.3, 2.4  # of the speeds
_STEP = 0.05  # along a branch


def rectangular_branches(steps: int) -> Iterator[Orbit]:
    """Through both folds of the primary and the super-harmonic resonance, and through the flip into orbits of two
    cycles, with both damping ratios.
    """
    oscillator = rectangular()
    begin = find_orbit(oscillator, frequency(1.2), ([1.3], [0.9]), steps=steps)
    yield begin
    yield from _chain(oscillator, begin, (1.0, 0.9, 0.8, 0.7), steps)
    high = list(_chain(oscillator, begin, (0.7, 0.5), steps))[-1]
    yield high
    yield from _chain(oscillator, high, (0.7, 0.8), steps)
    yield from _chain(oscillator, high, (0.35, 0.45), steps)
    yield from _chain(oscillator, begin, (1.7, 1.9, 2.0), steps)
    kept = list(_chain(oscillator, begin, (1.7,), steps))[-1]
    yield from _doubled(oscillator, kept, 1.9, (1.9, 1.7), steps)
    damped = rectangular(MORE_ZETA)
    begin = find_orbit(damped, frequency(1.0), ([1.65], [1.45]), steps=steps)
    yield begin
    yield from _chain(damped, begin, (0.9, 0.8), steps)
    begin = find_orbit(damped, frequency(1.9), ([1.03], [0.29]), steps=steps)
    yield begin
    yield from _chain(damped, begin, (2.0,), steps)
    yield from _doubled(damped, begin, 2.0, (1.9, 1.7), steps)


def dead_zone_branches(steps: int) -> Iterator[Orbit]:
    """From high speed down over the softening resonance, through both folds and up again."""
    oscillator, speed = dead_zone(jnp.asarray(frequency(1.5)))
    begin = find_orbit(oscillator, speed, ([1.01], [0.016]), steps=steps)
    yield begin
    yield from _chain(dead_zone, begin, (1.2, 1.0, 0.9, 0.85, 0.8, 0.75, 0.7, 0.8), steps)


def _chain(family, begin: Orbit, omegas: Sequence[float], steps: int) -> Iterator[Orbit]:
    """Orbits at some speeds, each on the branch from the one before."""
    here = begin
    for omega in omegas:
        speed = here.mesh_frequency
        down = frequency(omega) < speed
        ends = (omega, _RANGE[1]) if down else (_RANGE[0], omega)
        branch = follow_orbits(
            family,
            here,
            within=(frequency(ends[0]), frequency(ends[1])),
            direction="down" if down else "up",
            parameter=None if family is not dead_zone else speed,
            step=_STEP,
            steps=steps,
        )
        here = jax.tree.map(lambda part: part[-1], branch.orbits)
        yield here


def _doubled(oscillator, begin: Orbit, until: float, omegas: Sequence[float], steps: int) -> Iterator[Orbit]:
    """Orbits of two cycles at some speeds, on the branch from the flip between the first orbit and a speed above.

    They are unstable at first, go down to a fold and up again, as those on which a motion settles, to another flip.
    """
    lowest = frequency(_RANGE[0])
    above = follow_orbits(oscillator, begin, within=(lowest, frequency(until)), step=_STEP, steps=steps)
    flip = next(found for found in above.bifurcations if found.kind == "flip")
    branch = follow_orbits(oscillator, flip, within=(lowest, frequency(_RANGE[1])), step=2 * _STEP, steps=steps)
    yield from _chain(oscillator, jax.tree.map(lambda part: part[-1], branch.orbits), omegas, steps)
