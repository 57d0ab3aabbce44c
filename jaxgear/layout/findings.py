"""Layouts out of the usual range: what an experienced engineer would ask about.

Nothing is refused here: a finding is a warning. The limits are of this project where no source is named.
"""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from ..conditions import LoadSpectrum
from ..geometry import GearPair
from ..metrics import Finding
from ..metrics.findings import LIMITS as LIMITS_OF_MESH
from ..metrics.findings import of_limits, unusual
from ..numerics import Usual
from ..shafts import AbstractSupport, Gearbox, Shaft, ShaftSupport, bearing_reactions
from ..shafts.gearbox import tip_clearances
from ..shafts.shaft import facts_of
from .profiles import AMOUNTS, ProfileLayout
from .steps import FlankLineLayout

# By so much K_Hbeta without deviations may be above that of unmodified flanks.
_COST = 1.2

# Of a load that falls straight to zero over m stations, K_Hbeta is 2 n / m, and 1 / 2 m of it below that at the end.
_FEWEST = 8

LIMITS = {
    "K_Hbeta": Usual(
        0.0,
        np.inf,
        "",
        f"fewer than {_FEWEST} stations carry the load, the result depends on their number: take more stations; are "
        "the units of bearings, shafts and housing right?",
    ),
    "K_Hbeta without deviations": Usual(
        0.0,
        np.inf,
        "",
        f"more than {_COST:g} times that of unmodified flanks; compare the worst cases of deviations, and try "
        'layout.further_amount = "least"',
    ),
    "K_Hbeta of the worst case": Usual(
        0.0, np.inf, "", 'no better than without step 2; try layout.further_amount = "least"'
    ),
    "slope and crowning in modules": Usual(
        0.0, 0.04, "", "above twice the tip relief of ISO 53:1974: are the units of bearings, shafts and housing right?"
    ),
    "radial displacement in modules": Usual(
        0.0, 0.05, "", "about the backlash of a gear: center distance and contact ratio are those of undeflected shafts"
    ),
    "radial stiffness": Usual(1.0, 20_000.0, "N/um", "rolling bearings have ten to some thousand: is it in N/um?"),
    "clearance": Usual(0.1, 500.0, "um", "rolling bearings have 2 to 100 um to either side: is it in um?"),
    "distance from the face": Usual(
        0.0, np.inf, "mm", "a bearing within the face of a gear cannot support the shaft: is its position right?"
    ),
    "number of meshes": Usual(1.0, np.inf, "", "a gear without load: is a mesh missing?"),
    "tip clearance": Usual(0.0, np.inf, "mm", "they overlap: are angles of the meshes and positions right?"),
    "shaft diameter over bore": Usual(
        0.0, 1.0, "", "only an integral gear has a shaft thicker than its bore: is integral missing?"
    ),
    "misalignment over the face": Usual(0.1, np.inf, "um", "below what can be measured: is it in mm?"),
    "damage by the duty cycle": Usual(
        1e-12, 1.0, "", "1 is the end of life: are torques in N m, strengths in MPa and cycles single ones?"
    ),
    **{name: LIMITS_OF_MESH[name] for name in ("depth of the modification", "depth of the modification in modules")},
    "pitch line velocity": LIMITS_OF_MESH["pitch line velocity"],
}


# K_Hbeta of the five cases by the names of tolerance and step
ContactCases = Mapping[str, Mapping[str, np.ndarray]]
_Factors = dict[str, list[Any]]  # of every step, by the deviations


def layout_findings(
    layout: FlankLineLayout,
    support: AbstractSupport,
    *,
    duty_cycle: LoadSpectrum | None = None,
    profiles: ProfileLayout | None = None,
    contact: ContactCases | None = None,
) -> tuple[Finding, ...]:
    """Unusual numbers of a layout and its shafts; empty where there are none.

    Args:
        layout: flank lines, not traced.
        support: support of the layout; bearings move under the torques of its couplings.
        duty_cycle: duty cycle of the layout; None without one.
        profiles: profile modifications tried on the flank lines in step 3; None without it.
        contact: K_Hbeta of the contact analysis in the five cases, by the names of the tolerance and of the step,
            "unmodified", "step 1" and "step 2"; None or empty without it.
    """
    numbers = [*_of_load(layout), *_of_step_2(layout, contact or {}), *_of_flank_lines(layout), *_of_axes(layout)]
    if isinstance(support, ShaftSupport):
        gearbox, module = support.gearbox, float(layout.pair.pinion.module)
        mesh = gearbox.meshes[support.mesh]
        own = [gearbox.shafts[gearbox.place(name)[0]] for name in (mesh.pinion, mesh.wheel)]
        numbers += [*_of_bearings(gearbox, own, module), *(each for shaft in own for each in _of_bores(shaft))]
        numbers += _of_meshes(gearbox)
    if duty_cycle is not None:
        numbers += _of_duty_cycle(layout, duty_cycle)
    if profiles is not None:
        numbers += _of_profiles(profiles, float(layout.pair.pinion.module))
    return unusual(numbers)


_finding = partial(of_limits, LIMITS)


def _of_load(layout: FlankLineLayout) -> Iterator[Finding]:
    cases = list(layout.after.values())
    stations = cases[0].load.line_load.shape[-1]
    worst = max(float(np.max(each.face_load_factor)) for each in cases)
    for where, factor in zip(("without modification", "after step 1", "after step 2"), (*layout.factors, worst)):
        yield _finding("K_Hbeta", where, factor, high=2 * stations / _FEWEST)


def _of_step_2(layout: FlankLineLayout, contact: ContactCases) -> Iterator[Finding]:
    """K_Hbeta after step 2, without deviations and in the worst case, by both analyses."""
    by_annex_e: _Factors = {
        f"{name} deviations": [of[name].face_load_factor for of in layout.cases] for name in layout.before
    }
    by_contact: _Factors = {
        f"{name} deviations, contact analysis": [steps[step] for step in ("unmodified", "step 1", "step 2")]
        for name, steps in contact.items()
    }
    for number, analysis in enumerate((by_annex_e, by_contact)):
        for where, cases in analysis.items():
            unmodified, *_, crowned = (float(factors[0]) for factors in cases)
            *others, worst = (float(np.max(factors)) for factors in cases)
            if where == next(iter(analysis)):
                place = "after step 2" + (", contact analysis" if number else "")
                yield _finding("K_Hbeta without deviations", place, crowned, high=_COST * unmodified)
            yield _finding("K_Hbeta of the worst case", f"after step 2, {where}", worst, high=min(others))


def _of_flank_lines(layout: FlankLineLayout) -> Iterator[Finding]:
    for where, line, gear in zip(("pinion", "wheel"), (layout.pinion, layout.wheel), layout.pair.gears):
        amounts = line.slope, line.crowning, *(end.amount for end in line.ends[:1])
        removed = sum(abs(float(amount)) for amount in amounts)
        yield _finding("slope and crowning in modules", where, 1e-3 * removed / float(gear.module))


def _of_bearings(gearbox: Gearbox, shafts: list[Shaft], module: float) -> Iterator[Finding]:
    found = bearing_reactions(gearbox)
    moved = dict(zip(found.names, np.hypot(*np.asarray(found.shaft)[:, :2].T)))
    for bearing in (bearing for shaft in shafts for bearing in shaft.bearings):
        where = f'bearing "{bearing.name}"'
        yield _finding("radial displacement in modules", where, 1e-3 * moved[bearing.name] / module)
        for stiffness in np.unique(np.diagonal(np.asarray(bearing.matrix))[:2]):
            if stiffness > 0:
                yield _finding("radial stiffness", where, stiffness)
        if bearing.play is not None and bearing.play > 0:
            yield _finding("clearance", where, bearing.play)
    for shaft in shafts:
        for bearing in shaft.bearings:
            beside = [
                abs(float(bearing.position - gear.position)) - 0.5 * float(gear.gear.face_width) for gear in shaft.gears
            ]
            yield _finding("distance from the face", f'bearing "{bearing.name}"', min(beside))


def _of_bores(shaft: Shaft) -> Iterator[Finding]:
    for mounted, thickest in zip(shaft.gears, np.asarray(facts_of(shaft).thickest)):
        gear, body = mounted.gear, mounted.body_diameter
        integral = body is not None and float(body) >= 2 * float(gear.root_circle_radius)
        if gear.bore_diameter is not None and not integral:
            yield _finding("shaft diameter over bore", f'gear "{mounted.name}"', thickest / float(gear.bore_diameter))


def _of_meshes(gearbox: Gearbox) -> Iterator[Finding]:
    """Gears that nothing meshes with or that run into others, and axes that deviate by next to nothing."""
    names = [name for mesh in gearbox.meshes for name in (mesh.pinion, mesh.wheel)]
    for shaft in gearbox.shafts:
        for gear in shaft.gears:
            yield _finding("number of meshes", f'gear "{gear.name}"', names.count(gear.name))
    for where, room in tip_clearances(gearbox).items():
        yield _finding("tip clearance", where, room)
    for index, mesh in enumerate(gearbox.meshes):
        yield from _of_misalignment(
            f'"{mesh.pinion}" and "{mesh.wheel}"', mesh.misalignment.over_face(gearbox.pair(index))
        )


def _of_axes(layout: FlankLineLayout) -> Iterator[Finding]:
    for name, cases in layout.before.items():
        _, both, apart, *_ = np.asarray(cases.slope)  # +f_Hb +f_ma, +f_Hb -f_ma
        yield from _of_misalignment(f"{name} deviations", 0.5 * (both - apart))


def _of_misalignment(where: str, value) -> Iterator[Finding]:
    if value != 0:
        yield _finding("misalignment over the face", where, abs(float(value)))


def _of_duty_cycle(layout: FlankLineLayout, duty_cycle: LoadSpectrum) -> Iterator[Finding]:
    if duty_cycle.speeds is not None:
        yield _finding("pitch line velocity", "", _velocity(layout.pair, np.max(duty_cycle.speeds)))
    if layout.damage and duty_cycle.duration is not None:
        yield _finding("damage by the duty cycle", "after step 2", layout.damage[-1].largest)


def _velocity(pair: GearPair, speed) -> float:
    """[m/s]"""
    return 1e-3 * float(pair.pinion.pitch_radius) * 2 * np.pi / 60 * float(speed)


def _of_profiles(profiles: ProfileLayout, module: float) -> Iterator[Finding]:
    for where, name in zip(("pinion", "wheel"), AMOUNTS):
        deepest = float(np.max(profiles.table.column(name)))
        if deepest > 0:
            yield _finding("depth of the modification", where, deepest)
        yield _finding("depth of the modification in modules", where, 1e-3 * deepest / module)
