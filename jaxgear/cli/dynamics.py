"""The command `jaxgear dynamics`: from a design file to the vibration of its designs over the speed."""

import os
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ..contact import Mesh
from ..dynamics import Dynamics, Oscillator, steps_for
from ..io import (
    DesignFile,
    DynamicsRequest,
    OptimizeRequest,
    dynamics_request,
    optimize_request,
    result_folder,
    write_summary,
)
from ..io.schema import METHODS_WITHOUT_VARIABLES
from ..microgeometry import AbstractModification, NoModification
from ..optimize import Front
from . import dynamics_figures, dynamics_report, interrupt, report
from .commands import import_ahead, rule_based
from .devices import compile_quickly
from .document import document
from .dynamics_branches import branches_of
from .dynamics_report import Study, next_to_design
from .kept import Kept
from .progress import Stages
from .run import coarse, default_folder, opened

Modifications = tuple[AbstractModification, AbstractModification]


def run_dynamics(
    file: Path,
    output: Path | None,
    *,
    quick: bool,
    figures: bool,
    cache: bool,
    command: Sequence[str] | None = None,
) -> bool:
    """The command with its options; False when a contact was not found."""
    asked = document(command, file)
    compile_quickly()
    with Stages() as stages:
        design = opened(file, cache=cache)
        request = dynamics_request(design, quick=quick)
        search = _search(design, quick=quick)
        target = output or default_folder(file, "dynamics", quick=quick)
        with ExitStack() as putting_in_place, result_folder(target) as folder:
            if figures:
                import_ahead("matplotlib.pyplot")
            mesh, designs = _designs(design, request, search, stages, quick=quick)
            kept = Kept(target.with_name(f".{target.name}.runs"), _count(designs, request))
            study = _study(design, request, mesh, designs, kept, stages)
            stages.begin("writing the results")
            data = {**dynamics_report.summary(study), "quick": quick}
            write_summary(folder / "summary.json", data)
            dynamics_report.write_responses(folder / "responses.csv", study)
            files = dynamics_figures.write_figures(folder, study) if figures else []
            if asked is not None:
                asked.write(folder, design, data, dynamics_report.found(study, files))
            putting_in_place.enter_context(interrupt.held(f"the results are in {target}{os.sep}"))
            putting_in_place.callback(kept.remove)
    report.console().print(dynamics_report.table(study))
    report.say(*dynamics_report.verdict(study))
    if quick:
        report.say("quick run: coarse positions and few speeds, not a result to build on")
    report.say(f"results in {target}{os.sep}, {stages.elapsed:.1f} s")
    failures = list(dynamics_report.failures(study))
    for line in failures:
        report.warn(line)
    return not failures


def _search(design: DesignFile, *, quick: bool) -> OptimizeRequest | None:
    """The search that the file asks for; None where its modifications are numbers and it names no method."""
    if design.bounds or design.optimize.method in METHODS_WITHOUT_VARIABLES:
        return optimize_request(design, quick=quick)
    return None


def _designs(
    design: DesignFile, request: DynamicsRequest, search: OptimizeRequest | None, stages: Stages, *, quick: bool
) -> tuple[Mesh, dict[str, Modifications]]:
    """The designs by their names, and the mesh on which they are compared."""
    stages.begin("preparing the mesh")
    size = design.resolution(max(design.torque, *request.torques))
    mesh = jax.block_until_ready(design.mesh(coarse(size) if quick else size))
    involute = NoModification()
    relief = rule_based(design)
    designs: dict[str, Modifications] = {"unmodified": (involute, involute), "rule-based": (relief, relief)}
    if not design.bounds:
        given = design.design({})
        if any(not isinstance(flank, NoModification) for flank in given):
            designs["modified"] = given
    if search is not None:
        stages.begin(f"searching the optimum ({search.method})")
        found = search(mesh, stages.step)
        optimum = found.compromise if isinstance(found, Front) else found
        designs["optimum"] = optimum.pinion, optimum.wheel
        mesh = optimum.mesh  # on which the search has ended
    return mesh, designs


def _count(designs: Mapping[str, Any], request: DynamicsRequest) -> int:
    return len(designs) * len(request.torques) * len(request.settings.run_names)


def _study(
    design: DesignFile,
    request: DynamicsRequest,
    mesh: Mesh,
    designs: dict[str, Modifications],
    kept: Kept,
    stages: Stages,
) -> Study:
    """All runs of all designs under all torques."""
    settings = request.settings
    oscillators: dict[str, dict[float, Oscillator]] = {}
    for name, (pinion, wheel) in designs.items():
        stages.begin(f"mesh force of the {name} design")
        oscillators[name] = {
            torque: settings.oscillator(mesh, torque, pinion=pinion, wheel=wheel) for torque in request.torques
        }
    steps = _steps(settings, oscillators)
    stages.begin("running through the speeds")
    responses: dict[str, dict[float, dict[str, Any]]] = {}
    total, done = _count(designs, request), 0
    for name, of_torques in oscillators.items():
        responses[name] = {}
        for torque, oscillator in of_torques.items():
            runs = responses[name][torque] = {}
            for run in settings.run_names:
                stages.count(done, total, f"{name}, {torque:g} N m, {run}")
                made_of = oscillator, settings.mesh_frequencies, settings.kick
                runs[run] = kept((made_of, run, steps), partial(settings.run, oscillator, run, steps=steps))
                done += 1
    stages.begin("following the orbits of the unmodified design")
    torque = next_to_design(design, request)
    branches = branches_of(oscillators["unmodified"][torque], responses["unmodified"][torque], steps)
    return Study(design, request, mesh, designs, oscillators, responses, steps, tuple(branches))


def _steps(settings: Dynamics, oscillators: Mapping[str, Mapping[float, Oscillator]]) -> tuple[int, ...]:
    """As many as the stiffest oscillator needs at every speed: one compiled program serves all."""
    if settings.steps is not None:
        return (settings.steps,) * len(settings.mesh_frequencies)
    each = [steps_for(one, settings.mesh_frequencies) for several in oscillators.values() for one in several.values()]
    return tuple(int(count) for count in np.max(each, axis=0))
