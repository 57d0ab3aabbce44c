"""What the command `layout` does, with its options."""

from pathlib import Path

import jax

from ..contact import Mesh, Resolution
from ..io import DesignFile, LayoutRequest, layout_request, write_flanks
from ..io.schema_shafts import ProfileSection
from ..layout import (
    FlankLine,
    FlankLineLayout,
    ProfileLayout,
    at_stations,
    at_torque,
    layout_flank_lines,
    plausibility,
    vary_profiles,
)
from ..shafts import AbstractSupport, ShaftSupport
from . import layout_report
from .layout_report import Study
from .progress import Stages
from .run import coarse
from .study_command import Make, StudyCommand


def _plan(design: DesignFile, quick: bool) -> Make[Study]:
    request = layout_request(design, quick=quick)
    return lambda target, stages: (_study(design, request, stages, quick=quick), lambda: None)


def _write(folder: Path, study: Study) -> None:
    if study.profile is not None:
        write_flanks(folder / "flanks.csv", next(iter(study.meshes.values())), layout_report.designs(study))
        study.profile.table.to_csv(folder / "profiles.csv")


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
            held = _held(request.supports[name], request.profile_torque, size)
            given = coarse(size) if quick else size, held if wanted.shafts else None
            mesh = jax.block_until_ready(design.mesh(*given))
            stages.begin("profile modifications of both gears" + (f", {name}" if wanted.shafts else ""))
            meshes[name], profiles[name] = mesh, _profile(request, wanted, mesh, layouts[name], stages)
    unusual = {name: plausibility(layout, request.supports[name]) for name, layout in layouts.items()}
    return Study(design, request, layouts, meshes, profiles, unusual)


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
    doubts=layout_report.doubts,
)
