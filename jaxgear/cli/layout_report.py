"""What `jaxgear layout` says, writes and draws."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from ..contact import Mesh
from ..io import DesignFile, LayoutRequest, describe
from ..layout import CASES, FlankLine, FlankLineLayout, ProfileLayout, ToleranceCases
from ..metrics import Doubt
from ..microgeometry import AbstractModification
from ..shafts import bearing_reactions
from . import report
from .geometry import geometry
from .written import doubt_data, versions

_PANEL, _HEIGHT = 92.0, 90.0  # [mm]


@dataclass(frozen=True)
class Study:
    """What has been found.

    Attributes:
        design: the design file.
        request: what it asks for.
        layouts: flank lines, by the name of the support; the first is that of the design.
        meshes: of step 3, likewise; empty without it.
        profiles: profile modifications of step 3.
        unusual: what of every layout is not usual, by the name of the support.
    """

    design: DesignFile
    request: LayoutRequest
    layouts: Mapping[str, FlankLineLayout]
    meshes: Mapping[str, Mesh]
    profiles: Mapping[str, ProfileLayout]
    unusual: Mapping[str, tuple[Doubt, ...]]

    @property
    def profile(self) -> ProfileLayout | None:
        """The profile modifications of the design; None without step 3."""
        return next(iter(self.profiles.values()), None)

    @property
    def main(self) -> FlankLineLayout:
        """The layout of the design."""
        return next(iter(self.layouts.values()))


def designs(study: Study) -> dict[str, tuple[AbstractModification, AbstractModification]]:
    """Modifications of pinion and wheel: the flank lines, and with the profile modification."""
    pinion, wheel = study.main.modifications
    found = {"flank lines": (pinion, wheel)}
    if study.profile is not None:
        # the profile was made on the further crowning, which the flank line has as well
        first, second = study.profile.profiles
        found["layout"] = pinion + first, wheel + second
    return found


def tables(study: Study) -> Iterator[Table]:
    """The steps, and the bearings."""
    yield _steps(study)
    yield _bearings(study)


def _steps(study: Study) -> Table:
    result = Table(title=f"{study.design.title}: flank lines", title_justify="left", box=SIMPLE_HEAD)
    result.add_column("", no_wrap=True)
    for name in study.layouts:
        result.add_column(name, justify="right", no_wrap=True)

    def row(text: str, values: Iterator[str]) -> None:
        result.add_row(text, *values)

    each = list(study.layouts.values())
    row("torque of the layout [N m]", (f"{float(one.torque):g}" for one in each))
    row("K_Hbeta without modification", (f"{float(one.factors[0]):.3f}" for one in each))
    result.add_section()
    row(f"step 1, {study.main.gear}: slope [um]", (f"{float(one.line.slope):.2f}" for one in each))
    row("  crowning [um]", (f"{float(one.line.crowning):.2f}" for one in each))
    row("  K_Hbeta", (f"{float(one.factors[1]):.3f}" for one in each))
    result.add_section()
    for index, gear in enumerate(("pinion", "wheel")):
        row(f"step 2, {gear}: crowning C_b [um]", (f"{float(one.further[index]):.2f}" for one in each))
    for name in study.request.tolerances:
        result.add_section()
        tolerance = study.request.tolerances[name]
        row(
            f"{name}: f_Hb {float(tolerance.helix_slope):.1f}, f_ma {float(tolerance.misalignment):.1f} um",
            ("step 1 / step 2" for _ in each),
        )
        for number, case in enumerate(CASES):
            row(
                f"  K_Hbeta, {case}",
                (f"{_cell(one.before[name], number)} / {_cell(one.after[name], number)}" for one in each),
            )
    if study.main.damage:
        result.add_section()
        for number, text in enumerate(("without modification", "after step 1", "after step 2")):
            row(f"life {text} [h]", (f"{float(one.damage[number].life):.4g}" for one in each))
    result.caption = "* largest load at an edge"
    return result


def _cell(cases: ToleranceCases, number: int) -> str:
    return f"{float(cases.face_load_factor[number]):.3f}{'*' if bool(cases.edge_contact[number]) else ' '}"


def _bearings(study: Study) -> Table:
    """Displacements of the shafts at the bearings."""
    result = Table(title="bearings: displacement of the shaft [um]", title_justify="left", box=SIMPLE_HEAD)
    result.add_column("bearing", no_wrap=True)
    result.add_column("force [N]", justify="right")
    found = {name: bearing_reactions(support.gearbox) for name, support in study.request.supports.items()}
    for name in found:
        for way in "xy":
            result.add_column(f"{way}, {name}", justify="right", no_wrap=True)
    first = next(iter(found.values()))
    for number, name in enumerate(first.names):
        force = float(np.hypot(*np.asarray(first.force)[number, :2]))
        moved = [f"{float(each.shaft[number, way]):.2f}" for each in found.values() for way in range(2)]
        result.add_row(name, f"{force:.0f}", *moved)
    return result


def verdict(study: Study) -> Iterator[str]:
    """The layout in words."""
    layout = study.main
    for name, line in (("pinion", layout.pinion), ("wheel", layout.wheel)):
        yield f"{name}: slope {float(line.slope):.1f} um, crowning {float(line.crowning):.1f} um"
    if layout.damage:
        before, _, after = np.asarray(layout.relative_life)
        yield f"life relative to the even load: {before:.2f} without modification, {after:.2f} after step 2"
    for name, profile in study.profiles.items():
        yield from _profile_verdict(study, profile, f", {name}" if len(study.profiles) > 1 else "")


def _profile_verdict(study: Study, profile: ProfileLayout, where: str) -> Iterator[str]:
    words = "tip relief" if profile.kind == "tip_relief" else "profile crowning"
    first, second = profile.amounts
    torque = study.request.profile_torque
    yield f"step 3 at {torque:g} N m{where}: {words} {first:g} um on the pinion, {second:g} um on the wheel"
    ratio = profile.table.column("effective_contact_ratio")
    yield (
        f"  PPTE {profile.change('ppte'):+.0f} %, loss {profile.change('mesh_loss_factor'):+.0f} %; effective contact "
        f"ratio {ratio[0]:.3f} to {ratio[profile.best]:.3f}, theoretical {profile.contact_ratio:.3f}"
    )


def failures(study: Study) -> Iterator[str]:
    """What is not to be trusted or not reached."""
    for name, layout in study.layouts.items():
        cases = [*layout.before.values(), *layout.after.values()]
        found = [*(one.load.converged for one in cases), *(one.converged for one in layout.damage)]
        if not all(bool(np.all(one)) for one in found):
            yield f"LOAD OVER THE FACE NOT FOUND: {name}; its numbers are not to be trusted"
        if layout.touches_edges:
            yield f"the largest load is at an edge: {name}"
    for profile in study.profiles.values():
        failed = profile.table.failures()
        if failed:
            total = len(profile.table)
            yield f"NOT CONVERGED: {failed} of {total} profile modifications; raise resolution.newton_steps"
        if not profile.without_shock[profile.best]:
            yield "every profile modification has contact shock: larger amounts are needed"


def doubts(study: Study) -> Iterator[str]:
    """What is not usual."""
    return report.doubt_lines(study.unusual)


def summary(study: Study) -> dict[str, Any]:
    """Contents of `summary.json`."""
    return {
        "title": study.design.title,
        "design_file": study.design.path.name,
        "torque_Nm": study.design.torque,
        "tolerances": {
            name: {"f_Hbeta_um": one.helix_slope, "f_ma_um": one.misalignment}
            for name, one in study.request.tolerances.items()
        },
        "layouts": {
            name: {**_layout(layout), "doubts": [doubt_data(doubt) for doubt in study.unusual[name]]}
            for name, layout in study.layouts.items()
        },
        "bearings": {name: _reactions(support) for name, support in study.request.supports.items()},
        "profiles": {name: _profile(study, profile) for name, profile in study.profiles.items()},
        "designs": {
            name: {"pinion_modification": describe(pinion), "wheel_modification": describe(wheel)}
            for name, (pinion, wheel) in designs(study).items()
        },
        "geometry": geometry(study.design.pair()),
        "versions": versions(),
    }


def _layout(layout: FlankLineLayout) -> dict[str, Any]:
    def line(of: FlankLine) -> dict[str, Any]:
        return {"slope_um": of.slope, "crowning_um": of.crowning}

    def cases(of: Mapping[str, ToleranceCases]) -> dict[str, Any]:
        return {
            name: {
                "face_load_factor": one.face_load_factor,
                "edge_contact": one.edge_contact,
                "loaded_share": one.loaded_share,
            }
            for name, one in of.items()
        }

    life = (
        {"life_h": [one.life for one in layout.damage], "relative_life": layout.relative_life} if layout.damage else {}
    )
    return {
        "torque_Nm": layout.torque,
        "gear": layout.gear,
        "step_1": line(layout.line),
        "further_crowning_um": layout.further,
        "least_further_crowning_um": layout.needed,
        "pinion": line(layout.pinion),
        "wheel": line(layout.wheel),
        "face_load_factor": {"unmodified": layout.factors[0], "step_1": layout.factors[1]},
        "cases": CASES,
        "step_1_cases": cases(layout.before),
        "step_2_cases": cases(layout.after),
        **life,
    }


def _reactions(support) -> dict[str, Any]:
    found = bearing_reactions(support.gearbox)
    return {
        name: {"force_N": force[:3], "shaft_um": shaft[:3], "seat_um": seat[:3]}
        for name, force, shaft, seat in zip(found.names, *map(np.asarray, (found.force, found.shaft, found.seat)))
    }


def _profile(study: Study, profile: ProfileLayout) -> dict[str, Any]:
    values = {name: profile.table.column(name) for name in profile.table.results}
    return {
        "type": profile.kind,
        "torque_Nm": study.request.profile_torque,
        "variants": len(profile.table),
        "amounts_um": profile.amounts,
        "contact_ratio": profile.contact_ratio,
        "unmodified": {name: column[0] for name, column in values.items()},
        "best": {name: column[profile.best] for name, column in values.items()},
    }


def write_figures(folder: Path, study: Study) -> list[Path]:
    """Writes all figures: the cases of both steps, and charts of the profile modifications; gives the files."""
    import matplotlib

    matplotlib.use("Agg")  # the command line never shows a window
    from .. import plot

    layout = study.main
    name = list(layout.after)[-1]
    axes: dict[str, Any] = {}
    with plot.figure.report_axes(None, columns=2, width=2 * _PANEL, height=_HEIGHT) as panels:
        for panel, of, title in zip(np.ravel(panels), (layout.before, layout.after), ("step 1", "step 2")):
            plot.tolerance_line_load(of[name], panel, title=f"{title}, {name} deviations")
        panels[1].set_ylabel("")
    axes["tolerance_cases"] = panels
    shown = {
        f"step {step}, {kind}": one
        for step, of in enumerate((layout.before, layout.after), 1)
        for kind, one in of.items()
    }
    axes["face_load_factors"] = plot.face_load_factors(shown)
    if study.profile is not None:
        rows, names = study.profile.radar_variants()
        results = ["ppte_um", "effective_contact_ratio", "mesh_loss_factor", "max_flank_pressure_MPa"]
        values = {one: study.profile.table.column(one) for one in results}
        axes["radar"] = plot.radar(values, results, rows, names)
    return report.save_figures(folder, axes)
