"""The layout study: from a design file with shafts to its flank lines and profiles, in three steps."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
import numpy as np

from ..contact import Mesh, MeshCycle, Resolution, solve
from ..io import DesignFile, LayoutRequest, layout_request
from ..io.layout_table import ProfileSection
from ..layout import (
    FlankLine,
    FlankLineLayout,
    ProfileLayout,
    at_stations,
    at_torque,
    face_load_over_torques,
    flank_line_contact,
    layout_findings,
    layout_flank_lines,
    vary_profiles,
)
from ..shafts import AbstractSupport, ShaftSupport, annex_e
from . import manufactured
from .checkpoints import Checkpoints
from .evaluation import coarse, face_change
from .layout_result import LayoutResult, flank_lines
from .progress import Stages
from .study import AbstractStudy


@dataclass(frozen=True)
class LayoutStudy(AbstractStudy[LayoutResult]):
    """Find the flank lines of the pair on its shafts, and its profile modifications, in three steps.

    Step 1 levels the load over the face or finds the longest life under a duty cycle, step 2 keeps the load off the
    edges within the tolerances, step 3 tries profile modifications in all combinations. With and without housing.

    Attributes:
        request: what the file asks for.
    """

    name: ClassVar = "layout"
    coarse: ClassVar = "few stations and variants"
    takes_shafts: ClassVar = True

    request: LayoutRequest

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Layout study of a design file, see `AbstractStudy.of`."""
        return cls(design, quick, layout_request(design, quick=quick))

    def omits(self) -> str:
        """Tolerances other than those of the flank lines."""
        return manufactured.left_out(self.design, "flank lines deviate by the limits of [layout]")

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> LayoutResult:
        """Flank lines on every support, then profile modifications; keeps no checkpoints."""
        design, request, quick = self.design, self.request, self.quick
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
            name: layout_findings(
                layout,
                request.supports[name],
                duty_cycle=duty_cycle,
                profiles=profiles.get(name),
                contact=cases.get(name),
            )
            for name, layout in layouts.items()
        }
        return LayoutResult(
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
    """Contact results of every step without deviations, and K_Hbeta in the five cases by tolerance and step."""
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
    """K_Hbeta of the one-dimensional analysis by step."""
    found = {}
    face = at_stations(request.supports[name], request.profile_torque, stations=stations)
    for step, (pinion, wheel) in flank_lines(layout).items():
        load = annex_e(face, face.torque, pinion=pinion.modification, wheel=wheel.modification, stations=stations)
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
