"""Layout study: flank lines and profile modifications of a design file with shafts, in three steps."""

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import jax
import jax.numpy as jnp
import numpy as np

from ..contact import Mesh, MeshCycle, Resolution, solve
from ..io import DesignFile, DesignFileError
from ..io.errors import naming
from ..shafts import AbstractSupport, ShaftSupport, annex_e
from ..studies import AbstractStudy, Checkpoints, Stages
from ..studies.evaluation import coarse, face_change
from ..studies.manufactured import left_out
from .cases import FlankLineTolerance
from .findings import layout_findings
from .flank_line import FlankLine, at_stations, at_torque
from .life import face_load_over_torques
from .profiles import ProfileLayout, flank_line_contact, vary_profiles
from .result import LayoutResult, flank_lines
from .steps import FlankLineLayout, layout_flank_lines, without_housing
from .table import ProfileSection

_QUICK_STATIONS, _QUICK_AMOUNTS = 21, 3
_TORQUES, _QUICK_TORQUES = 25, 7  # over the range of the file


@dataclass(frozen=True)
class LayoutStudy(AbstractStudy[LayoutResult]):
    """Find the flank lines of the pair on its shafts, and its profile modifications, in three steps.

    Step 1 levels the load over the face or finds the longest life under a duty cycle. Step 2 adds crowning or end
    reliefs so that the face ends carry no excess load within the tolerances. Step 3 evaluates all combinations of
    profile modifications.
    The command computes every step with and without the housing.

    Attributes:
        supports: mesh on its shafts, in the housing first where there is one, then on rigid seats.
        tolerances: tolerances of the flank lines by the kind of their sum.
        options: options of `layout_flank_lines`.
        torques: torques of K_Hbeta on the pinion, those of the duty cycle included [N m].
        profile: profile modifications that step 3 tries; None for no step 3.
        profile_torque: torque of step 3 on the pinion [N m].
    """

    name: ClassVar = "layout"
    coarse: ClassVar = "few stations and variants"
    takes_shafts: ClassVar = True

    supports: dict[str, ShaftSupport]
    tolerances: dict[str, FlankLineTolerance]
    options: dict[str, Any]
    torques: np.ndarray
    profile: ProfileSection | None
    profile_torque: float

    @classmethod
    def of(cls, design: DesignFile, *, quick: bool = False) -> Self:
        """Layout study of a design file, see `AbstractStudy.of`."""
        with naming(design.path):
            section = design.needed("layout", "it says for which tolerances the flank lines are designed")
            support, profile = design.support, section.profile
            assert support is not None  # every file with the table has one
            _check_open(design)
            if quick:
                section = section.changed(stations=min(section.stations, _QUICK_STATIONS))
            tolerances, options = section.tolerances(design), section.options(design)
            if profile is not None:
                profile = profile.variants(_QUICK_AMOUNTS if quick else None)
        housed = support.gearbox.housing is not None
        supports = {"housing": support, "rigid seats": without_housing(support)} if housed else {"rigid seats": support}
        range_of_file = np.linspace(*design.torque_range, _QUICK_TORQUES if quick else _TORQUES)
        torques = np.union1d(range_of_file, section.torques or [])
        torque = design.torque if profile is None else profile.torque_factor * design.torque
        return cls(design, quick, supports, tolerances, options, torques, profile, torque)

    def omits(self) -> str:
        """Tolerances other than those of the flank lines."""
        return left_out(self.design, "flank lines deviate by the limits of [layout]")

    def work_out(self, checkpoints: Checkpoints, stages: Stages) -> LayoutResult:
        """Find flank lines on every support, then profile modifications; writes no checkpoints."""
        design, quick = self.design, self.quick
        layouts: dict[str, FlankLineLayout] = {}
        for name, support in self.supports.items():
            stages.begin(f"flank lines, {name}")
            layouts[name] = layout_flank_lines(support, self.tolerances, **self.options)
        stages.begin("face load factor over the torque")
        over_torque = _over_torque(self, next(iter(layouts.values())))
        meshes: dict[str, Mesh] = {}
        contacts: dict[str, dict[str, dict[str, float]]] = {}
        cases: dict[str, dict[str, dict[str, np.ndarray]]] = {}
        cycles: dict[str, MeshCycle] = {}
        factors: dict[str, dict[str, float]] = {}
        profiles: dict[str, ProfileLayout] = {}
        wanted = self.profile
        if wanted is not None:
            for name in layouts if wanted.shafts else list(layouts)[:1]:
                stages.begin("preparing the mesh" + (f", {name}" if wanted.shafts else ""))
                size = design.resolution()
                held = _held(self.supports[name], self.profile_torque, size)
                given = coarse(size) if quick else size, held if wanted.shafts else None
                mesh = jax.block_until_ready(design.mesh(*given, rigid=not wanted.shafts))
                stages.begin("profile modifications of both gears" + (f", {name}" if wanted.shafts else ""))
                meshes[name], profiles[name] = mesh, _profile(self, wanted, mesh, layouts[name], stages)
                if wanted.shafts:
                    contacts[name], cases[name] = _contacts(self, mesh, layouts[name], profiles[name])
                    cycles = cycles or _cycles(self, mesh, layouts[name], profiles[name])
                    factors[name] = _factors(self, name, layouts[name], stations=size.slices)
        stations_change: dict[str, dict[str, float]] = {}
        slices_change: dict[str, dict[str, float]] = {}
        if not quick:
            stages.begin("face load factor on a finer grid")
            name, stations = next(iter(layouts)), self.options["stations"]
            once, again = (_factors(self, name, layouts[name], stations=count) for count in (stations, 2 * stations))
            stations_change = {step: {"face_load_factor": again[step] - value} for step, value in once.items()}
            if cycles:
                finer = _finer(self, name)
                between = _cycles(self, finer, layouts[name], profiles[name])
                slices_change = {which: face_change(cycle, between[which]) for which, cycle in cycles.items()}
        duty_cycle = self.options.get("duty_cycle")
        unusual = {
            name: layout_findings(
                layout,
                self.supports[name],
                duty_cycle=duty_cycle,
                profiles=profiles.get(name),
                contact=cases.get(name),
            )
            for name, layout in layouts.items()
        }
        return LayoutResult(
            design,
            self.supports,
            self.tolerances,
            self.options,
            self.torques,
            self.profile_torque,
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


def _check_open(design: DesignFile) -> None:
    """Raise a `DesignFileError` for values in the file that a layout determines itself."""
    if design.bounds:
        raise DesignFileError("variables", f"layout needs numbers, these are free: {', '.join(design.bounds)}")
    for gear, parts in (("pinion", design.design.pinion), ("wheel", design.design.wheel)):
        if parts:
            raise DesignFileError(f"{gear}.modification", "layout finds the modifications, leave them out")


def _finer(study: LayoutStudy, name: str) -> Mesh:
    """Mesh of step 3 on its shafts, with twice the slices."""
    design = study.design
    size = design.resolution()
    widths = None if size.parts is None else tuple(int(part) for part in np.repeat(size.parts, 2))
    twice = replace(size, slices=2 * size.slices, slice_widths=widths)
    return design.mesh(twice, _held(study.supports[name], study.profile_torque, twice), rigid=False)


def _over_torque(study: LayoutStudy, layout: FlankLineLayout) -> dict[str, np.ndarray]:
    """K_Hbeta of the design over the torque after every step."""
    support, stations = next(iter(study.supports.values())), study.options["stations"]
    found = {}
    for step, (pinion, wheel) in flank_lines(layout).items():
        given = {"pinion": pinion, "wheel": wheel, "stations": stations}
        found[step] = np.asarray(face_load_over_torques(support, study.torques, **given))
    return found


def _contacts(
    study: LayoutStudy, mesh: Mesh, layout: FlankLineLayout, profile: ProfileLayout
) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, np.ndarray]]]:
    """Contact results of every step without deviations, and K_Hbeta in the five cases by tolerance and step."""
    found = {}
    cases: dict[str, dict[str, np.ndarray]] = {name: {} for name in study.tolerances}
    deviations = np.concatenate([one.slopes for one in study.tolerances.values()])
    for step, (pinion, wheel) in flank_lines(layout).items():
        modifications = pinion.modification, wheel.modification
        all_cases = flank_line_contact(
            mesh, study.profile_torque, modifications, deviations=deviations, kind=profile.kind
        )
        found[step] = {name: float(values[0]) for name, values in all_cases.items()}
        for name, factors in zip(cases, all_cases["face_load_factor"].reshape(len(cases), -1)):
            cases[name][step] = factors
    found["step 3"] = {name: float(profile.table.column(name)[profile.best]) for name in profile.table.results}
    return found, cases


def _cycles(study: LayoutStudy, mesh: Mesh, layout: FlankLineLayout, profile: ProfileLayout) -> dict[str, MeshCycle]:
    """Mesh cycles without modification and with the modifications of all three steps."""
    modified = tuple(line + own for line, own in zip(layout.modifications, profile.profiles))
    # zero amounts in place of no modification: one program serves both
    nothing = jax.tree.map(jnp.zeros_like, modified)
    torque = study.profile_torque
    return {
        name: solve(mesh, torque, pinion=pinion, wheel=wheel)
        for name, (pinion, wheel) in (("unmodified", nothing), ("layout", modified))
    }


def _factors(study: LayoutStudy, name: str, layout: FlankLineLayout, *, stations: int) -> dict[str, float]:
    """K_Hbeta of the one-dimensional analysis by step."""
    found = {}
    face = at_stations(study.supports[name], study.profile_torque, stations=stations)
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
    study: LayoutStudy, wanted: ProfileSection, mesh: Mesh, layout: FlankLineLayout, stages: Stages
) -> ProfileLayout:
    """Step 3 on the flank lines; on shafts that step 1 has compensated, on what step 2 adds alone."""
    for_pinion, for_wheel = (FlankLine().further(amount, layout.end_relief) for amount in layout.further)
    left = for_pinion.on(layout.pair, "pinion").modification, for_wheel.on(layout.pair, "wheel").modification
    return vary_profiles(
        mesh,
        study.profile_torque,
        layout.modifications if wanted.shafts else left,
        wanted.pinion_amounts,
        wanted.wheel_amounts or wanted.pinion_amounts,
        slopes=wanted.slopes or (0.0,),
        crownings=wanted.crownings or (0.0,),
        kind="profile_crowning" if wanted.type == "profile_crowning" else "tip_relief",
        length=wanted.length,
        callback=lambda done, total, _: stages.count(done, total, "variants"),
    )
