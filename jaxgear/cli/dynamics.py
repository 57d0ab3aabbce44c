"""The command `jaxgear dynamics`: from a design file to the vibration of its designs over the speed."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

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
from ..io import DesignFile, DesignFileError, DynamicsRequest, dynamics_request
from ..io.errors import naming
from . import dynamics_figures, dynamics_report, manufactured
from .comparison import Modifications, compared, search_of
from .dynamics_report import DynamicsStudy, next_to_design, peak
from .progress import Stages
from .study import Kept, SpeedResponses, runs_beside
from .study_command import Make, StudyCommand

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


_BESIDE = 4  # speeds on either side of a peak that are gone through again on a finer grid


def _plan(design: DesignFile, quick: bool) -> Make[DynamicsStudy]:
    request = dynamics_request(design, quick=quick)
    search = search_of(design, quick=quick)

    def make(target: Path, stages: Stages):
        mesh, designs = compared(design, max(design.torque, *request.torques), search, target, stages, quick=quick)
        kept = Kept(runs_beside(target), SpeedResponses(), _count(designs, request))
        study = _study(design, request, mesh, designs, kept, stages, quick=quick)
        if not quick:
            stages.begin("the largest dynamic factors on a finer grid")
            study = replace(study, grid_change=_grid_change(study))
        return study, kept.remove

    return make


def _count(designs: Mapping[str, Any], request: DynamicsRequest) -> int:
    return len(designs) * len(request.torques) * len(request.settings.run_names)


def _study(
    design: DesignFile,
    request: DynamicsRequest,
    mesh: Mesh,
    designs: dict[str, Modifications],
    kept: Kept,
    stages: Stages,
    *,
    quick: bool,
) -> DynamicsStudy:
    """All runs of all designs under all torques, and the branches of one; a quick look follows its first branch."""
    settings = request.settings
    oscillators: dict[str, dict[float, Oscillator]] = {}
    for name, (pinion, wheel) in designs.items():
        stages.begin(f"mesh force of the {name} design")
        oscillators[name] = {
            torque: settings.oscillator(mesh, torque, pinion=pinion, wheel=wheel) for torque in request.torques
        }
    natural = {
        name: {torque: natural_frequencies(one) for torque, one in several.items()}
        for name, several in oscillators.items()
    }
    with naming(design.path):
        steps = _steps(settings, oscillators, natural)
    stages.begin("running through the speeds")
    responses: dict[str, dict[float, dict[str, Any]]] = {}
    total, done = _count(designs, request), 0
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
    if request.run_up is not None:
        stages.begin("running up")
        first, last = (float(settings.mesh_frequencies[place]) for place in (0, -1))
        options: dict[str, Any] = {"first": first, "last": last, "duration": request.run_up, "steps": steps[0]}
        run_ups = {
            name: {torque: run_up(oscillator, **options) for torque, oscillator in of_torques.items()}
            for name, of_torques in oscillators.items()
        }
    stages.begin("following the orbits of the unmodified design")
    torque = next_to_design(design, request)
    runs = responses["unmodified"][torque]
    branches = branches_of(oscillators["unmodified"][torque], {UP: runs[UP]} if quick else runs, steps)
    frequencies = {
        name: {torque: float(of.mesh) for torque, of in several.items()} for name, several in natural.items()
    }
    found = responses, steps, tuple(branches), run_ups
    return DynamicsStudy(design, request, mesh, designs, oscillators, frequencies, *found)


def _grid_change(study: DynamicsStudy) -> dict[str, dict[str, float]]:
    """By how much the largest dynamic factor of every design changes at twice the positions of the mesh force and the
    steps, which meet no more positions than they are themselves."""
    settings = study.request.settings
    finer = replace(settings, positions=2 * settings.positions)
    last = len(settings.mesh_frequencies)
    width = min(2 * _BESIDE + 1, last)
    found = {}
    for name, (pinion, wheel) in study.designs.items():
        of_design = [
            (factor, torque, run, response)
            for other, torque, run, response in study.rows()
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
            finer.oscillator(study.mesh, torque, pinion=pinion, wheel=wheel),
            settings.mesh_frequencies[near],
            direction=response.direction,
            start=(dte, rate),
            steps=[2 * count for count in study.steps[near]],
            kicks=settings.kicks_of(run),
        )
        found[name] = {"worst_dynamic_factor": peak(again, "dynamic_factor")[0] - largest}
    return found


def _steps(
    settings: Dynamics,
    oscillators: Mapping[str, Mapping[float, Oscillator]],
    natural: Mapping[str, Mapping[float, Natural]],
) -> tuple[int, ...]:
    """As many as the stiffest oscillator needs at every speed: one compiled program serves all."""
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


run_dynamics = StudyCommand(
    "dynamics",
    "coarse positions and few speeds",
    _plan,
    dynamics_report.summary,
    dynamics_report.write_tables,
    dynamics_figures.write_figures,
    lambda study: [dynamics_report.table(study)],
    dynamics_report.verdict,
    dynamics_report.failures,
    (dynamics_report.ASSUMED,),
    omits=manufactured.left_out,
)
