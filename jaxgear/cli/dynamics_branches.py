"""The branches of periodic orbits that the runs of a design lie on."""

from collections.abc import Iterator, Mapping
from typing import Any

import jax
import numpy as np

from ..dynamics import UP, Branch, Oscillator, SpeedResponse, find_orbit, follow_orbits

_POINTS = 400  # of a branch: through the folds of an unmodified pair it takes about 120
_SAME = 1e-3  # relative difference of dynamic factors of one orbit, by two integrations


def branches_of(oscillator: Oscillator, runs: Mapping[str, SpeedResponse], steps: tuple[int, ...]) -> list[Branch]:
    """The branch of the lowest speed, and those that falling runs begin on, each once.

    Args:
        oscillator: one oscillator.
        runs: by name.
        steps: of the integrator per mesh cycle, at every speed.
    """
    found: list[Branch] = []
    for name, response in runs.items():
        speeds = np.flatnonzero(np.asarray(response.period) > 0)
        if not len(speeds):
            continue
        place = int(speeds[0] if name == UP else speeds[-1])
        if not any(_on(branch, response, place) for branch in found):
            found += _followed(oscillator, response, place, "up" if name == UP else "down", max(steps))
    return found


def _followed(oscillator, response: SpeedResponse, place: int, direction: Any, steps: int) -> Iterator[Branch]:
    frequencies = np.asarray(response.mesh_frequency, float)
    periods, start = int(response.period[place]), jax.tree.map(lambda part: part[place], response.state)
    orbit = find_orbit(oscillator, frequencies[place], start, periods=periods, steps=steps)
    if not bool(orbit.converged):
        return
    within = frequencies[0], frequencies[-1]
    yield follow_orbits(oscillator, orbit, within=within, direction=direction, points=_POINTS, steps=steps)


def _on(branch: Branch, response: SpeedResponse, place: int) -> bool:
    """Whether a branch passes through the steady state of a run, by its neighbours there."""
    if branch.orbits.periods != int(response.period[place]):
        return False
    at, factors = np.asarray(branch.mesh_frequency, float), np.asarray(branch.orbits.dynamic_factor, float)
    frequency, factor = float(response.mesh_frequency[place]), float(response.dynamic_factor[place])
    inside = (at[1:] - frequency) * (at[:-1] - frequency) <= 0
    low, high = np.minimum(factors[1:], factors[:-1]), np.maximum(factors[1:], factors[:-1])
    return bool((inside & (factor > (1 - _SAME) * low) & (factor < (1 + _SAME) * high)).any())
