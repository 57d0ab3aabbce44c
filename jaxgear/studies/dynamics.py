"""Speed study: vibration of the designs of a design file over the speed."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar, Self

import jax
import numpy as np

from ..contact import Mesh
from ..dynamics import (
    UP,
    Branch,
    Dynamics,
    Oscillator,
    RunUp,
    SpeedResponse,
    find_orbit,
    follow_orbits,
    natural_frequencies,
    run_up,
    speed_sweep,
    steps_for,
)
from ..dynamics.oscillator import Natural
from ..dynamics.speed_sweep import STABLE_STEPS
from ..io import DesignFile, DesignFileError, Search
from ..io.errors import naming
from .checkpoints import Checkpoints, SpeedResponses
from .comparison import Modifications, compared, search_of
from .dynamics_result import DynamicsResult, next_to_design, peak
from .study import AbstractStudy, Stages

_QUICK_SPEEDS = 24
_POINTS = 400  # of a branch
_STEP, _QUICK_STEP = 0.02, 0.06  # first step along a branch, of `follow_orbits`: about 330 points and 190
_SAME = 1e-3  # relative difference of dynamic factors of one orbit, by two integrations
_BESIDE = 4  # number of speeds on each side of a peak that are repeated with a finer mesh force


def _branches_of(
    oscillator: Oscillator, runs: Mapping[str, SpeedResponse], steps: tuple[int, ...], step: float = _STEP
) -> list[Branch]:
    """Branches of periodic orbits through the lowest speed and through the first speeds of falling runs, without
    repeats.

    Args:
        oscillator: one oscillator.
        runs: speed responses by the name of the run.
        steps: steps of the integrator per mesh cycle at every speed.
        step: first one along a branch.
    """
    found: list[Branch] = []
    for name, response in runs.items():
        speeds = np.flatnonzero(np.asarray(response.period) > 0)
        if not len(speeds):
            continue
        place = int(speeds[0] if name == UP else speeds[-1])
        if not any(_on(branch, response, place) for branch in found):
            found += _followed(oscillator, response, place, "up" if name == UP else "down", max(steps), step)
    return found


def _followed(
    oscillator, response: SpeedResponse, place: int, direction: Any, steps: int, step: float
) -> Iterator[Branch]:
    frequencies = np.asarray(response.mesh_frequency, float)
    periods, start = int(response.period[place]), jax.tree.map(lambda part: np.asarray(part)[place], response.state)
    orbit = find_orbit(oscillator, frequencies[place], start, periods=periods, steps=steps)
    if not bool(orbit.converged):
        return
    within = frequencies[0], frequencies[-1]
    options: dict[str, Any] = {"within": within, "direction": direction, "points": _POINTS, "step": step}
    yield follow_orbits(oscillator, orbit, steps=steps, **options)


def _on(branch: Branch, response: SpeedResponse, place: int) -> bool:
    """True if a branch passes through the steady state of a run at a speed, interpolated between branch points."""
    if branch.orbits.periods != int(response.period[place]):
        return False
    at, factors = np.asarray(branch.mesh_frequency, float), np.asarray(branch.orbits.dynamic_factor, float)
    frequency, factor = float(response.mesh_frequency[place]), float(response.dynamic_factor[place])
    inside = (at[1:] - frequency) * (at[:-1] - frequency) <= 0
    low, high = np.minimum(factors[1:], factors[:-1]), np.maximum(factors[1:], factors[:-1])
    return bool((inside & (factor > (1 - _SAME) * low) & (factor < (1 + _SAME) * high)).any())


def _grid_change(result: DynamicsResult) -> dict[str, dict[str, float]]:
    """Change of the largest dynamic factor of every design at twice the positions of the mesh force.

    The steps of the integrator are doubled too: they cannot resolve more positions than their number."""
    settings = result.settings
    finer = replace(settings, positions=2 * settings.positions)
    last = len(settings.mesh_frequencies)
    width = min(2 * _BESIDE + 1, last)
    found = {}
    for name, (pinion, wheel) in result.designs.items():
        of_design = [
            (factor, torque, run, response)
            for other, torque, run, response in result.rows()
            if other == name and np.isfinite(factor := peak(response, "dynamic_factor")[0])
        ]
        if not of_design:
            continue
        largest, torque, run, response = max(of_design, key=lambda row: row[0])
        first = min(max(int(np.nanargmax(response.dynamic_factor)) - _BESIDE, 0), last - width)
        near = slice(first, first + width)
        begin = near.stop - 1 if response.direction == "down" else near.start
        dte, rate = (part[begin] for part in response.state)
        again = speed_sweep(
            finer.oscillator(result.mesh, torque, pinion=pinion, wheel=wheel),
            settings.mesh_frequencies[near],
            direction=response.direction,
            start=(dte, rate),
            steps=[2 * count for count in result.steps[near]],
            kicks=settings.kicks_of(run),
        )
        found[name] = {"worst_dynamic_factor": peak(again, "dynamic_factor")[0] - largest}
    return found


def _steps(
    settings: Dynamics,
    oscillators: Mapping[str, Mapping[float, Oscillator]],
    natural: Mapping[str, Mapping[float, Natural]],
) -> tuple[int, ...]:
    """Steps per mesh cycle that the stiffest oscillator needs at every speed, so that one program serves all."""
    if settings.steps is not None:
        lowest = float(settings.mesh_frequencies[0])
        highest = max(float(of.highest) for several in natural.values() for of in several.values())
        fewest = math.ceil(STABLE_STEPS * highest / lowest)
        if settings.steps < fewest:
            at = f"{lowest:g} Hz and a natural frequency of {highest:.0f} Hz"
            text = f"{settings.steps} must be at least {fewest} for {at}"
            raise DesignFileError("dynamics.steps", f"{text}, with fewer the integration diverges")
        return (settings.steps,) * len(settings.mesh_frequencies)
    each = [steps_for(one, settings.mesh_frequencies) for several in oscillators.values() for one in several.values()]
    return tuple(int(count) for count in np.max(each, axis=0))


@dataclass(frozen=True)
class DynamicsStudy(AbstractStudy[DynamicsResult]):
    """Run the pair through the speeds of the table `dynamics`, up and down, under several torques.

    The command compares the unmodified pair, the rule-based tip relief of ISO 6336-1, and the modification of the
    design file or the optimum of its variables. An interrupted command resumes from its stored results when it is
    repeated.

    Attributes:
        settings: speeds and vibrating masses.
        torques: torques on the pinion [N m], ascending.
        run_up: duration of a run-up [s]; None for no run-up.
        search: search for the optimum of the file; None if its modifications are numbers.
    """

    name: ClassVar = "dynamics"
    coarse: ClassVar = "coarse positions and few speeds"

    settings: Dynamics
    torques: tuple[float, ...]
    run_up: float | None
    search: Search | None

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Speed study of a design file, see `AbstractStudy.of`."""
        with naming(design.path):
            section = design.needed("dynamics", "it says at which speeds the pair runs")
            settings = section.settings(design, _QUICK_SPEEDS if quick else None)
            asked = settings, section.torques(design), section.run_up
        return cls(design, quick, *asked, search_of(design, quick=quick))

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> DynamicsResult:
        """Compute all runs of all designs at all torques, and the branches of one design (quick: its first branch)."""
        highest = max(self.design.torque, *self.torques)
        found = compared(self.design, highest, self.search, checkpoints, stages, quick=self.quick)
        result = self._responses(*found, checkpoints, stages)
        if self.quick:
            return result
        stages.begin("the largest dynamic factors on a finer grid")
        return replace(result, grid_change=_grid_change(result))

    def _responses(
        self, mesh: Mesh, designs: dict[str, Modifications], checkpoints: Checkpoints, stages: Stages
    ) -> DynamicsResult:
        design, settings = self.design, self.settings
        oscillators: dict[str, dict[float, Oscillator]] = {}
        for name, (pinion, wheel) in designs.items():
            stages.begin(f"mesh force of the {name} design")
            oscillators[name] = {
                torque: settings.oscillator(mesh, torque, pinion=pinion, wheel=wheel) for torque in self.torques
            }
        natural = {
            name: {torque: natural_frequencies(one) for torque, one in several.items()}
            for name, several in oscillators.items()
        }
        with naming(design.path):
            steps = _steps(settings, oscillators, natural)
        stages.begin("running through the speeds")
        responses: dict[str, dict[float, dict[str, Any]]] = {}
        total, done = len(designs) * len(self.torques) * len(settings.run_names), 0
        kept = checkpoints.of(SpeedResponses(), total)
        for name, of_torques in oscillators.items():
            responses[name] = {}
            for torque, oscillator in of_torques.items():
                runs = responses[name][torque] = {}
                for run in settings.run_names:
                    stages.count(done, total, f"{name}, {torque:g} N m, {run}")
                    made_of = oscillator, settings.mesh_frequencies, settings.kick, settings.kicks
                    runs[run] = kept((made_of, run, steps), partial(settings.run, oscillator, run, steps=steps))
                    done += 1
        run_ups: dict[str, dict[float, RunUp]] = {}
        if self.run_up is not None:
            stages.begin("running up")
            first, last = (float(settings.mesh_frequencies[place]) for place in (0, -1))
            options: dict[str, Any] = {"first": first, "last": last, "duration": self.run_up, "steps": steps[0]}
            run_ups = {
                name: {torque: run_up(oscillator, **options) for torque, oscillator in of_torques.items()}
                for name, of_torques in oscillators.items()
            }
        stages.begin("following the orbits of the unmodified design")
        torque = next_to_design(design, self.torques)
        runs = responses["unmodified"][torque]
        followed, step = ({UP: runs[UP]}, _QUICK_STEP) if self.quick else (runs, _STEP)
        branches = _branches_of(oscillators["unmodified"][torque], followed, steps, step)
        frequencies = {
            name: {torque: float(of.mesh) for torque, of in several.items()} for name, several in natural.items()
        }
        return DynamicsResult(
            design,
            settings,
            self.torques,
            self.run_up,
            mesh,
            designs,
            oscillators,
            frequencies,
            responses,
            steps,
            tuple(branches),
            run_ups,
        )
