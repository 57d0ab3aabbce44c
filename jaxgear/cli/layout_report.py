"""What `jaxgear layout` says and writes."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..io import describe
from ..layout import CASES, FlankLine, FlankLineLayout, ProfileLayout, ToleranceCases
from ..shafts import bearing_reactions
from . import report
from .geometry import gears
from .layout_study import STEPS, Study, designs, lives, root_factor
from .study import grid_line
from .written import finding_data, identity, versions


def verdict(study: Study) -> Iterator[str]:
    """The layout in words."""
    layout = study.main
    for name, line in (("pinion", layout.pinion), ("wheel", layout.wheel)):
        yield f"flank line of the {name}: slope {float(line.slope):.1f} um, crowning {float(line.crowning):.1f} um"
    added = float(np.sum(layout.further))
    yield f"further crowning of step 2: {added:.1f} um on both together, the least is {float(layout.needed):.1f} um"
    if layout.damage:
        before, _, after = np.asarray(layout.relative_life)
        yield f"life relative to the even load: {before:.2f} without modification, {after:.2f} after step 2"
        for name in layout.lives:
            none, first, second = np.asarray(layout.worst_relative_life(name))
            yield (
                f"  worst case of {name} deviations: {none:.2f} without modification, {first:.2f} after step 1, "
                f"{second:.2f} after step 2"
            )
    for name, profile in study.profiles.items():
        yield from _profile_verdict(study, profile, f", {name}" if len(study.profiles) > 1 else "")
    if study.stations_change:
        grid = f"{study.request.options['stations']} stations (ISO 6336-1 Annex E)"
        yield grid_line(grid, study.stations_change)
    if study.slices_change:
        yield grid_line(f"{study.design.resolution().slices} slices (contact analysis)", study.slices_change)


def _profile_verdict(study: Study, profile: ProfileLayout, where: str) -> Iterator[str]:
    words = "tip relief" if profile.kind == "tip_relief" else "profile crowning"
    first, second = profile.amounts
    torque = study.request.profile_torque
    yield f"step 3 at {torque:g} N m{where}: {words} {first:g} um on the pinion, {second:g} um on the wheel"
    if any(profile.further):
        slope, crowning = profile.further
        yield f"  on top of the flank lines, over the common face: slope {slope:+g} um, crowning {crowning:+g} um"
    ratio = profile.table.column("effective_contact_ratio")
    yield (
        f"  than without it: PPTE {profile.change('ppte'):+.0f} %, loss {profile.change('mesh_loss_factor'):+.0f} %, "
        f"max flank pressure {profile.change('max_flank_pressure'):+.0f} %, effective contact ratio {ratio[0]:.3f} -> "
        f"{ratio[profile.best]:.3f} (theoretical {profile.contact_ratio:.3f})"
    )


def failures(study: Study) -> Iterator[str]:
    """What is not to be trusted or not reached."""
    for name, layout in study.layouts.items():
        cases = [one for of in layout.cases for one in of.values()]
        found = [*(one.load.converged for one in cases), *(one.converged for one in layout.damage)]
        if not all(bool(np.all(one)) for one in found):
            yield f"LOAD OVER THE FACE NOT FOUND: {name}; its numbers are not to be trusted"
        if layout.touches_edges:
            yield f"the largest load is at an edge: {name}"
    known = np.isfinite(list(study.over_torque.values())).all(axis=0)
    if not known.all():
        missed = ", ".join(f"{torque:g}" for torque in study.request.torques[~known])
        yield f"LOAD OVER THE FACE NOT FOUND at {missed} N m"
    for name, steps in study.contacts.items():
        for step, numbers in steps.items():
            if not np.isfinite(numbers["face_load_factor"]):
                yield f"NOT CONVERGED: contact analysis of {step}, {name}; raise resolution.newton_steps"
    for profile in study.profiles.values():
        failed = profile.table.failures()
        if failed:
            total = len(profile.table)
            yield f"NOT CONVERGED: {failed} of {total} profile modifications; raise resolution.newton_steps"
        if not profile.without_shock[profile.best]:
            yield "every profile modification has contact shock: larger amounts are needed"


def findings(study: Study) -> Iterator[str]:
    """What is not usual."""
    return report.finding_lines(study.unusual)


def summary(study: Study) -> dict[str, Any]:
    """Contents of `summary.json`."""
    return {
        **identity(study.design),
        "torque_Nm": study.design.torque,
        "tolerances": {
            name: {"f_Hbeta_um": one.helix_slope, "f_ma_um": one.misalignment}
            for name, one in study.request.tolerances.items()
        },
        "layouts": {
            name: {**_layout(layout), "findings": [finding_data(finding) for finding in study.unusual[name]]}
            for name, layout in study.layouts.items()
        },
        "face_load_over_torque": {"torque_Nm": study.request.torques, **_by_step(study.over_torque)},
        "contact": {
            name: {
                "torque_Nm": study.request.profile_torque,
                **_by_step(steps),
                "annex_e_face_load_factor": _by_step(study.factors[name]),
                "cases": CASES,
                "cases_face_load_factor": {
                    tolerance: _by_step(factors) for tolerance, factors in study.contact_cases[name].items()
                },
            }
            for name, steps in study.contacts.items()
        },
        **({"change_at_twice_the_stations": _by_step(study.stations_change)} if study.stations_change else {}),
        **({"change_at_twice_the_slices": study.slices_change} if study.slices_change else {}),
        "bearings": {name: _reactions(support) for name, support in study.request.supports.items()},
        "profiles": {name: _profile(study, profile) for name, profile in study.profiles.items()},
        "designs": {
            name: {"pinion_modification": describe(pinion), "wheel_modification": describe(wheel)}
            for name, (pinion, wheel) in designs(study).items()
        },
        **gears(study.design),
        "versions": versions(),
    }


def _layout(layout: FlankLineLayout) -> dict[str, Any]:
    def line(of: FlankLine) -> dict[str, Any]:
        return {"slope_um": of.slope, "crowning_um": of.crowning}

    def cases(of: Mapping[str, ToleranceCases], step: int) -> dict[str, Any]:
        return {
            name: {
                **({"life_h": layout.lives[name][step]} if layout.lives else {}),
                "face_load_factor": one.face_load_factor,
                "root_face_load_factor": root_factor(layout, one.face_load_factor),
                "edge_contact": one.edge_contact,
                "loaded_share": one.loaded_share,
            }
            for name, one in of.items()
        }

    life = (
        {
            "life_h": [one.life for one in layout.damage],
            "relative_life": layout.relative_life,
            "worst_relative_life": {name: layout.worst_relative_life(name) for name in layout.lives},
        }
        if layout.damage
        else {}
    )
    factors = np.asarray(layout.factors)
    return {
        "torque_Nm": layout.torque,
        "gear": layout.gear,
        "step_1": line(layout.line),
        "further_crowning_um": layout.further,
        "least_further_crowning_um": layout.needed,
        "pinion": line(layout.pinion),
        "wheel": line(layout.wheel),
        "face_load_factor": dict(zip(("unmodified", "step_1"), factors)),
        "root_face_load_factor": dict(zip(("unmodified", "step_1"), root_factor(layout, factors))),
        "cases": CASES,
        **{
            f"{step.replace(' ', '_')}_cases": cases(of, number)
            for number, (step, of) in enumerate(zip(STEPS, layout.cases))
        },
        **life,
    }


def _by_step(of: Mapping[str, Any]) -> dict[str, Any]:
    return {step.replace(" ", "_"): value for step, value in of.items()}


def _reactions(support) -> dict[str, Any]:
    found = bearing_reactions(support.gearbox)
    return {
        name: {"force_N": force[:3], "shaft_um": shaft[:3], "seat_um": seat[:3]}
        for name, force, shaft, seat in zip(found.names, *map(np.asarray, (found.force, found.shaft, found.seat)))
    }


def _profile(study: Study, profile: ProfileLayout) -> dict[str, Any]:
    values = {name: profile.table.column(name) for name in profile.table.results} | lives(study, profile)
    return {
        "type": profile.kind,
        "torque_Nm": study.request.profile_torque,
        "variants": len(profile.table),
        "amounts_um": profile.amounts,
        "further_slope_and_crowning_um": profile.further,
        "contact_ratio": profile.contact_ratio,
        "unmodified": {name: column[0] for name, column in values.items()},
        "best": {name: column[profile.best] for name, column in values.items()},
    }
