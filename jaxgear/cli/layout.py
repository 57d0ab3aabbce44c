"""What the command `layout` does, with its options."""

import os
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import jax

from ..contact import Mesh
from ..io import DesignFile, LayoutRequest, layout_request, result_folder, write_flanks, write_summary
from ..io.schema_shafts import ProfileSection
from ..layout import FlankLine, FlankLineLayout, ProfileLayout, at_stations, layout_flank_lines, vary_profiles
from . import interrupt, layout_report, report
from .commands import import_ahead
from .devices import compile_quickly
from .document import document
from .layout_report import Study
from .progress import Stages
from .run import coarse, default_folder, opened


def run_layout(
    file: Path,
    output: Path | None,
    *,
    quick: bool,
    figures: bool,
    cache: bool,
    command: Sequence[str] | None = None,
) -> bool:
    """The command with its options; False when a contact was not found or an edge is touched."""
    asked = document(command, file)
    compile_quickly()
    with Stages() as stages:
        design = opened(file, cache=cache)
        request = layout_request(design, quick=quick)
        target = output or default_folder(file, "layout", quick=quick)
        with ExitStack() as putting_in_place, result_folder(target) as folder:
            if figures:
                import_ahead("matplotlib.pyplot")
            study = _study(design, request, stages, quick=quick)
            stages.begin("writing the results")
            data = {**layout_report.summary(study), "quick": quick}
            write_summary(folder / "summary.json", data)
            if study.profile is not None:
                write_flanks(folder / "flanks.csv", next(iter(study.meshes.values())), layout_report.designs(study))
                study.profile.table.to_csv(folder / "profiles.csv")
            files = layout_report.write_figures(folder, study) if figures else []
            if asked is not None:
                asked.write(folder, design, data, layout_report.found(study, files))
            putting_in_place.enter_context(interrupt.held(f"the results are in {target}{os.sep}"))
    for table in layout_report.tables(study):
        report.console().print(table)
    report.say(*layout_report.verdict(study))
    if quick:
        report.say("quick run: few stations and variants, not a result to build on")
    report.say(f"results in {target}{os.sep}, {stages.elapsed:.1f} s")
    failures = list(layout_report.failures(study))
    for line in failures:
        report.warn(line)
    return not failures


def _study(design: DesignFile, request: LayoutRequest, stages: Stages, *, quick: bool) -> Study:
    layouts: dict[str, FlankLineLayout] = {}
    for name, support in request.supports.items():
        stages.begin(f"flank lines, {name}")
        layouts[name] = layout_flank_lines(support, request.tolerances, **request.options)
    meshes: dict[str, Mesh] = {}
    profiles: dict[str, ProfileLayout] = {}
    wanted = request.profile
    if wanted is not None:
        for name in layouts if wanted.shafts else list(layouts)[:1]:
            stages.begin("preparing the mesh" + (f", {name}" if wanted.shafts else ""))
            size = design.resolution()
            # as numbers, so that what is compiled for one support serves the other
            held = at_stations(request.supports[name], request.profile_torque, stations=size.slices)
            given = coarse(size) if quick else size, held if wanted.shafts else None
            mesh = jax.block_until_ready(design.mesh(*given))
            stages.begin("profile modifications of both gears" + (f", {name}" if wanted.shafts else ""))
            meshes[name], profiles[name] = mesh, _profile(request, wanted, mesh, layouts[name], stages)
    return Study(design, request, layouts, meshes, profiles)


def _profile(
    request: LayoutRequest, wanted: ProfileSection, mesh: Mesh, layout: FlankLineLayout, stages: Stages
) -> ProfileLayout:
    """Step 3 on the flank lines, or on what they leave where they have levelled the load: the further crowning."""
    left = tuple(FlankLine(crowning=amount).modification for amount in layout.further)
    pinion, wheel = layout.modifications if wanted.shafts else left
    return vary_profiles(
        mesh,
        request.profile_torque,
        (pinion, wheel),
        wanted.pinion_amounts,
        wanted.wheel_amounts or wanted.pinion_amounts,
        kind="profile_crowning" if wanted.type == "profile_crowning" else "tip_relief",
        length=wanted.length,
        callback=lambda done, total, _: stages.count(done, total, "variants"),
    )
