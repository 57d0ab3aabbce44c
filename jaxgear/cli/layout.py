"""What the command `layout` does, with its options."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from ..contact import Mesh, MeshCycle, Resolution, solve
from ..contact.kinematics import kinematics
from ..io import DesignFile, LayoutRequest, layout_request, write_flanks
from ..io.layout import ProfileSection
from ..layout import (
    FlankLine,
    FlankLineLayout,
    ProfileLayout,
    at_stations,
    at_torque,
    face_load_over_torques,
    findings_of,
    flank_line_contact,
    layout_flank_lines,
    vary_profiles,
)
from ..numerics import real
from ..shafts import AbstractSupport, ShaftSupport, annex_e
from . import layout_report, manufactured
from .layout_report import LayoutStudy, designs, flank_lines
from .progress import Stages
from .run import coarse
from .study import face_change
from .study_command import Make, StudyCommand


def _plan(design: DesignFile, quick: bool) -> Make[LayoutStudy]:
    request = layout_request(design, quick=quick)
    return lambda target, stages: (_study(design, request, stages, quick=quick), lambda: None)


def _write(folder: Path, study: LayoutStudy) -> None:
    design = study.design
    # the flanks need no mesh, which only step 3 has
    moving = kinematics(design.pair(), real(0.0), design.resolution(), "strain")
    write_flanks(folder / "flanks.csv", moving, designs(study))
    if study.profile is not None:
        study.profile.table.to_csv(folder / "profiles.csv")


def _study(design: DesignFile, request: LayoutRequest, stages: Stages, *, quick: bool) -> LayoutStudy:
    layouts: dict[str, FlankLineLayout] = {}
    for name, support in request.supports.items():
        stages.begin(f"flank lines, {name}")
        layouts[name] = layout_flank_lines(support, request.tolerances, **request.options)
    stages.begin("face load factor over the torque")
    over_torque = _over_torque(request, next(iter(layouts.values())))
    meshes: dict[str, Mesh] = {}
    contacts: dict[str, dict[str, dict[str, float]]] = {}
    cases: dict[str, dict[str, dict[str, np.ndarray]]] = {}
    cycles: dict[str, MeshCycle] = {}
    factors: dict[str, dict[str, float]] = {}
    profiles: dict[str, ProfileLayout] = {}
    wanted = request.profile
    if wanted is not None:
        for name in layouts if wanted.shafts else list(layouts)[:1]:
            stages.begin("preparing the mesh" + (f", {name}" if wanted.shafts else ""))
            size = design.resolution()
            held = _held(request.supports[name], request.profile_torque, size)
            given = coarse(size) if quick else size, held if wanted.shafts else None
            mesh = jax.block_until_ready(design.mesh(*given, rigid=not wanted.shafts))
            stages.begin("profile modifications of both gears" + (f", {name}" if wanted.shafts else ""))
            meshes[name], profiles[name] = mesh, _profile(request, wanted, mesh, layouts[name], stages)
            if wanted.shafts:
                contacts[name], cases[name] = _contacts(request, mesh, layouts[name], profiles[name])
                cycles = cycles or _cycles(request, mesh, layouts[name], profiles[name])
                factors[name] = _factors(request, name, layouts[name], stations=size.slices)
    stations_change: dict[str, dict[str, float]] = {}
    slices_change: dict[str, dict[str, float]] = {}
    if not quick:
        stages.begin("face load factor on a finer grid")
        name, stations = next(iter(layouts)), request.options["stations"]
        once, again = (_factors(request, name, layouts[name], stations=count) for count in (stations, 2 * stations))
        stations_change = {step: {"face_load_factor": again[step] - value} for step, value in once.items()}
        if cycles:
            finer = _finer(design, request, name)
            between = _cycles(request, finer, layouts[name], profiles[name])
            slices_change = {which: face_change(cycle, between[which]) for which, cycle in cycles.items()}
    duty_cycle = request.options.get("duty_cycle")
    unusual = {
        name: findings_of(
            layout,
            request.supports[name],
            duty_cycle=duty_cycle,
            profiles=profiles.get(name),
            contact=cases.get(name),
        )
        for name, layout in layouts.items()
    }
    return LayoutStudy(
        design,
        request,
        layouts,
        over_torque,
        meshes,
        contacts,
        cases,
        cycles,
        factors,
        profiles,
        unusual,
        stations_change,
        slices_change,
    )


def _finer(design: DesignFile, request: LayoutRequest, name: str) -> Mesh:
    """The mesh of step 3 on its shafts with twice the slices."""
    size = design.resolution()
    widths = None if size.parts is None else tuple(int(part) for part in np.repeat(size.parts, 2))
    twice = replace(size, slices=2 * size.slices, slice_widths=widths)
    return design.mesh(twice, _held(request.supports[name], request.profile_torque, twice), rigid=False)


def _over_torque(request: LayoutRequest, layout: FlankLineLayout) -> dict[str, np.ndarray]:
    """K_Hbeta of the design over the torque after every step."""
    support, stations = next(iter(request.supports.values())), request.options["stations"]
    found = {}
    for step, (pinion, wheel) in flank_lines(layout).items():
        given = {"pinion": pinion, "wheel": wheel, "stations": stations}
        found[step] = np.asarray(face_load_over_torques(support, request.torques, **given))
    return found


def _contacts(
    request: LayoutRequest, mesh: Mesh, layout: FlankLineLayout, profile: ProfileLayout
) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, np.ndarray]]]:
    """What the contact says of every step without deviations, and its K_Hbeta in the five cases by tolerance."""
    found = {}
    cases: dict[str, dict[str, np.ndarray]] = {name: {} for name in request.tolerances}
    deviations = np.concatenate([one.slopes for one in request.tolerances.values()])
    for step, (pinion, wheel) in flank_lines(layout).items():
        modifications = pinion.modification, wheel.modification
        all_cases = flank_line_contact(
            mesh, request.profile_torque, modifications, deviations=deviations, kind=profile.kind
        )
        found[step] = {name: float(values[0]) for name, values in all_cases.items()}
        for name, factors in zip(cases, all_cases["face_load_factor"].reshape(len(cases), -1)):
            cases[name][step] = factors
    found["step 3"] = {name: float(profile.table.column(name)[profile.best]) for name in profile.table.results}
    return found, cases


def _cycles(
    request: LayoutRequest, mesh: Mesh, layout: FlankLineLayout, profile: ProfileLayout
) -> dict[str, MeshCycle]:
    """The contact without modification and with all three steps."""
    modified = tuple(line + own for line, own in zip(layout.modifications, profile.profiles))
    # of zero amounts: one program serves both
    nothing = jax.tree.map(jnp.zeros_like, modified)
    torque = request.profile_torque
    return {
        name: solve(mesh, torque, pinion=pinion, wheel=wheel)
        for name, (pinion, wheel) in (("unmodified", nothing), ("layout", modified))
    }


def _factors(request: LayoutRequest, name: str, layout: FlankLineLayout, *, stations: int) -> dict[str, float]:
    """K_Hbeta of the one-dimensional analysis, on as many stations as the contact has slices."""
    found = {}
    face = at_stations(request.supports[name], request.profile_torque, stations=stations)
    for step, (pinion, wheel) in flank_lines(layout).items():
        on = {"pinion": pinion.modification, "wheel": wheel.modification}
        load = annex_e(face, torque=face.torque, stations=stations, **on)
        found[step] = float(load.face_load_factor)
    return found


def _held(support: ShaftSupport, torque: float, size: Resolution) -> AbstractSupport:
    """The support of a mesh."""
    if size.parts is None:  # as numbers, so that what is compiled for one support serves the other
        return at_stations(support, torque, stations=size.slices)
    return at_torque(support, torque)


def _profile(
    request: LayoutRequest, wanted: ProfileSection, mesh: Mesh, layout: FlankLineLayout, stages: Stages
) -> ProfileLayout:
    """Step 3 on the flank lines, or on what they leave where they have levelled the load: the further crowning."""
    for_pinion, for_wheel = (FlankLine(crowning=amount) for amount in layout.further)
    left = for_pinion.on(layout.pair, "pinion").modification, for_wheel.on(layout.pair, "wheel").modification
    return vary_profiles(
        mesh,
        request.profile_torque,
        layout.modifications if wanted.shafts else left,
        wanted.pinion_amounts,
        wanted.wheel_amounts or wanted.pinion_amounts,
        slopes=wanted.slopes or (0.0,),
        crownings=wanted.crownings or (0.0,),
        kind="profile_crowning" if wanted.type == "profile_crowning" else "tip_relief",
        length=wanted.length,
        callback=lambda done, total, _: stages.count(done, total, "variants"),
    )


run_layout = StudyCommand(
    "layout",
    "few stations and variants",
    _plan,
    layout_report.summary,
    _write,
    layout_report.write_figures,
    layout_report.tables,
    layout_report.verdict,
    layout_report.failures,
    findings=layout_report.findings,
    takes_shafts=True,
    omits=partial(manufactured.left_out, why="flank lines deviate by the limits of [layout]"),
)
