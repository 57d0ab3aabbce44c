"""Branches of the orbits that are known exactly: from one of them to the next by continuation."""

from collections.abc import Iterator, Sequence

import jax
import jax.numpy as jnp

from jaxgear.dynamics import Orbit, find_orbit, follow_orbits

from .known import MORE_ZETA, ZETA, dead_zone, frequency, rectangular

_RANGE = 0.3, 2.4  # of the speeds
_STEP = 0.05  # along a branch
_AT = 1.9  # speed of the orbits that are followed over the damping


def rectangular_branches(steps: int) -> Iterator[Orbit]:
    """Through both folds of the primary and the super-harmonic resonance, through the flip into orbits of two cycles,
    and from those to more damping.
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
    doubled = list(_doubled(oscillator, kept, _AT, (_AT, 1.7), steps))
    yield from doubled
    damped = rectangular(MORE_ZETA)
    for omega, near, others in ((1.0, (1.65, 1.45), (0.9, 0.8)), (_AT, (1.03, 0.29), (2.0,))):
        begin = find_orbit(damped, frequency(omega), ([near[0]], [near[1]]), steps=steps)
        yield begin
        yield from _chain(damped, begin, others, steps)
    begin = more_damped(doubled[0], steps)
    yield begin
    yield from _chain(damped, begin, (1.7,), steps)


def more_damped(begin: Orbit, steps: int) -> Orbit:
    """The orbit at the same speed to which more damping leads, followed over the damping."""
    within = ZETA, MORE_ZETA
    branch = follow_orbits(_over_damping, begin, within=within, parameter=ZETA, step=_STEP, steps=steps)
    return jax.tree.map(lambda part: part[-1], branch.orbits)


def _over_damping(zeta):
    return rectangular(zeta), jnp.asarray(frequency(_AT))


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
