"""Result of a layout study: tables, text, figures and files."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..contact import Mesh, MeshCycle
from ..contact.kinematics import kinematics
from ..contact.status import Status
from ..io import DesignFile, write_flanks
from ..metrics import Finding
from ..microgeometry import AbstractModification
from ..numerics import Given, UnitKey, real
from ..report import Figure, Record, Table, table_of
from ..shafts import ShaftSupport, bearing_reactions, root_face_load_factor, tooth_height
from ..studies import AbstractStudyResult
from ..studies.evaluation import grid_lines
from ..studies.side_by_side import finding_lines
from ..studies.summary import finding_data, flanks_data
from ..sweeps.columns import described
from .cases import CASES, FlankLineTolerance, ToleranceCases
from .flank_line import FlankLine
from .life import gear_lives
from .profiles import ProfileLayout
from .steps import FlankLineLayout

STEPS = ("unmodified", "step 1", "step 2")
LIVES = UnitKey("pinion_life", "h"), UnitKey("wheel_life", "h")
FACTORS = ("face_load_factor", "root_face_load_factor", "edge_load_factor")
_AFTER = "without modification", "after step 1", "after step 2"
_PATTERNS = {
    "unmodified": "Contact pattern without modification: largest pressure of every place of the flank.",
    "layout": "Contact pattern after all three steps: largest pressure of every place of the flank.",
}
_PANEL, _HEIGHT = 92.0, 90.0  # [mm]


@dataclass(frozen=True)
class LayoutResult(AbstractStudyResult):
    """Result of a layout study.

    Attributes:
        design: the design file.
        supports: mesh on its shafts, in the housing first where there is one, then on rigid seats.
        tolerances: tolerances of the flank lines by the kind of their sum.
        options: options of `layout_flank_lines`.
        torques: torques of K_Hbeta on the pinion [N m].
        profile_torque: torque of step 3 on the pinion [N m].
        layouts: flank lines, by the name of the support; the first is that of the design.
        over_torque: K_Hbeta of the design over the torques, without deviations, by step of `STEPS`.
        meshes: meshes of step 3, by the name of the support; empty without step 3.
        contacts: contact results of the flank lines of every step on their shafts, by the names of the support and of
            the step; empty without step 3 on shafts.
        contact_cases: K_Hbeta of the contact in the five cases of deviations, by the names of the support, of the
            tolerance and of the step; empty without step 3 on shafts.
        cycles: mesh cycles on the first support, "unmodified" and "layout" with all three steps; empty without step 3
            on shafts.
        factors: K_Hbeta of the one-dimensional analysis at the torque of step 3, with as many stations as the contact
            has slices, by the names of the support and of the step; empty without step 3 on shafts.
        profiles: profile modifications of step 3, by the name of the support.
        unusual: findings of every layout, by the name of the support.
        stations_change: change of K_Hbeta of the one-dimensional analysis at twice the stations, of the design at the
            torque of the profiles, by step; empty in a quick run.
        slices_change: change of the numbers of `cycles` at twice the slices, by name and unit; empty in a quick run.
    """

    design: DesignFile
    supports: Mapping[str, ShaftSupport]
    tolerances: Mapping[str, FlankLineTolerance]
    options: Mapping[str, Any]
    torques: np.ndarray
    profile_torque: float
    layouts: Mapping[str, FlankLineLayout]
    over_torque: Mapping[str, np.ndarray]
    meshes: Mapping[str, Mesh]
    contacts: Mapping[str, Mapping[str, Mapping[str, float]]]
    contact_cases: Mapping[str, Mapping[str, Mapping[str, np.ndarray]]]
    cycles: Mapping[str, MeshCycle]
    factors: Mapping[str, Mapping[str, float]]
    profiles: Mapping[str, ProfileLayout]
    unusual: Mapping[str, tuple[Finding, ...]]
    stations_change: Mapping[str, Mapping[str, float]]
    slices_change: Mapping[str, Mapping[str, float]]

    @property
    def profile(self) -> ProfileLayout | None:
        """The profile modifications of the design; None without step 3."""
        return next(iter(self.profiles.values()), None)

    @property
    def main(self) -> FlankLineLayout:
        """The layout of the design."""
        return next(iter(self.layouts.values()))

    def lives(self, profile: ProfileLayout) -> dict[str, np.ndarray]:
        """Life [h] of pinion and wheel with every profile modification, by K_Hbeta of its contact, shape (variants,).

        K_Hbeta at the torque of step 3 is used for every load. The result is empty without a duty cycle.
        """
        load, strength = (self.options.get(name) for name in ("duty_cycle", "strength"))
        if load is None or strength is None:
            return {}
        found = gear_lives(self.design.pair(), load, strength, profile.table.column("face_load_factor"))
        return dict(zip(LIVES, np.asarray(found).T))

    def designs(self) -> dict[str, tuple[AbstractModification, AbstractModification]]:
        """Modifications of pinion and wheel after every step."""
        _, first, _ = flank_lines(self.main).values()
        pinion, wheel = self.main.modifications
        found = {"step 1": (first[0].modification, first[1].modification), "step 2": (pinion, wheel)}
        if self.profile is not None:
            # the profile was made on the flank lines of step 2, or on what that step adds
            of_pinion, of_wheel = self.profile.profiles
            found["step 3"] = pinion + of_pinion, wheel + of_wheel
        return found

    def verdict(self) -> Iterator[str]:
        """Lines that describe the layout."""
        layout = self.main
        for name, line in (("pinion", layout.pinion), ("wheel", layout.wheel)):
            amounts = f"slope {float(line.slope):.1f} um, crowning {float(line.crowning):.1f} um"
            ends = dict.fromkeys(f"{float(end.amount):.1f} um x {float(end.length):.2f} mm" for end in line.ends)
            yield f"flank line of the {name}: {amounts}" + (f", end relief {' and '.join(ends)}" if ends else "")
        added = float(np.sum(layout.further))
        least = f"the least is {float(layout.needed):.1f} um"
        yield f"further {layout.means} of step 2: {added:.1f} um on both together, {least}"
        if layout.damage:
            before, _, after = np.asarray(layout.relative_life)
            yield f"life relative to the even load: {before:.2f} without modification, {after:.2f} after step 2"
            for name in layout.lives:
                none, first, second = np.asarray(layout.worst_relative_life(name))
                yield (
                    f"  worst case of {name} deviations: {none:.2f} without modification, {first:.2f} after step 1, "
                    f"{second:.2f} after step 2"
                )
        for name, profile in self.profiles.items():
            yield from self._profile_verdict(profile, f", {name}" if len(self.profiles) > 1 else "")
        if self.stations_change:
            grid = f"{self.options['stations']} stations (ISO 6336-1 Annex E)"
            yield from grid_lines(grid, self.stations_change)
        if self.slices_change:
            yield from grid_lines(f"{self.design.resolution().slices} slices (contact analysis)", self.slices_change)

    def _profile_verdict(self, profile: ProfileLayout, where: str) -> Iterator[str]:
        words = "tip relief" if profile.kind == "tip_relief" else "profile crowning"
        first, second = profile.amounts
        torque = self.profile_torque
        long = "" if profile.length is None else f", {profile.length:.3g} mm long"
        yield f"step 3 at {torque:g} N m{where}: {words} {first:g} um on the pinion, {second:g} um on the wheel{long}"
        if any(profile.further):
            slope, crowning = profile.further
            yield f"  on top of the flank lines, over the common face: slope {slope:+g} um, crowning {crowning:+g} um"
        ratio = profile.table.column("effective_contact_ratio")
        yield (
            f"  than without it: PPTE {profile.change('ppte'):+.0f} %, "
            f"loss {profile.change('mesh_loss_factor'):+.0f} %, "
            f"max flank pressure {profile.change('max_flank_pressure'):+.0f} %, "
            f"effective contact ratio {ratio[0]:.3f} -> {ratio[profile.best]:.3f} "
            f"(theoretical {profile.contact_ratio:.3f})"
        )

    def failures(self) -> Iterator[str]:
        """Results that did not converge, and limits that are not met."""
        for name, layout in self.layouts.items():
            cases = [one for of in layout.cases for one in of.values()]
            statuses = [*(one.load.status for one in cases), *(one.status for one in layout.damage)]
            status = Status(max(int(np.max(one)) for one in statuses))
            if status != Status.CONVERGED:
                yield f"LOAD OVER THE FACE NOT CONVERGED: {name}, {status.text}; do not use its numbers"
            if layout.touches_edges:
                yield f"the largest load is at an edge: {name}"
        known = np.isfinite(list(self.over_torque.values())).all(axis=0)
        if not known.all():
            missed = ", ".join(f"{torque:g}" for torque in self.torques[~known])
            yield f"LOAD OVER THE FACE NOT CONVERGED at {missed} N m"
        for name, steps in self.contacts.items():
            for step, numbers in steps.items():
                if not np.isfinite(numbers["face_load_factor"]):
                    yield f"NOT CONVERGED: contact analysis of {step}, {name}; raise resolution.newton_steps"
        for profile in self.profiles.values():
            failed = profile.table.failures()
            if failed:
                total = len(profile.table)
                yield f"NOT CONVERGED: {failed} of {total} profile modifications; raise resolution.newton_steps"
            if not profile.without_shock[profile.best]:
                yield "every profile modification has contact shock: larger amounts are needed"

    def findings(self) -> Iterator[str]:
        """Lines of the findings: values out of the usual range."""
        return finding_lines(self.unusual)

    def inputs(self) -> dict[str, Any]:
        """Torque and tolerances."""
        tolerances = {
            name: {UnitKey("f_Hbeta", "um"): one.helix_slope, UnitKey("f_ma", "um"): one.misalignment}
            for name, one in self.tolerances.items()
        }
        return {UnitKey("torque", "N m"): self.design.torque, "tolerances": tolerances}

    def summary(self) -> dict[str, Any]:
        """Layouts, contact, bearings and profiles."""
        torque = UnitKey("torque", "N m")
        return {
            "layouts": {
                name: {**_layout(layout), "findings": [finding_data(finding) for finding in self.unusual[name]]}
                for name, layout in self.layouts.items()
            },
            "face_load_over_torque": {torque: self.torques, **_by_step(self.over_torque)},
            "contact": {
                name: {
                    torque: self.profile_torque,
                    **_by_step(steps),
                    "annex_e_face_load_factor": _by_step(self.factors[name]),
                    "cases": CASES,
                    "cases_face_load_factor": {
                        tolerance: _by_step(factors) for tolerance, factors in self.contact_cases[name].items()
                    },
                }
                for name, steps in self.contacts.items()
            },
            **({"change_at_twice_the_stations": _by_step(self.stations_change)} if self.stations_change else {}),
            **({"change_at_twice_the_slices": self.slices_change} if self.slices_change else {}),
            "bearings": {name: _reactions(support) for name, support in self.supports.items()},
            "profiles": {name: self._profile(profile) for name, profile in self.profiles.items()},
            "designs": {name: flanks_data(*flanks) for name, flanks in self.designs().items()},
        }

    def _profile(self, profile: ProfileLayout) -> dict[str, Any]:
        found = profile.table.values(*profile.table.results)
        values = {column.quantity.key: each for column, each in found.items()} | self.lives(profile)
        return {
            "type": profile.kind,
            UnitKey("torque", "N m"): self.profile_torque,
            "variants": len(profile.table),
            UnitKey("amounts", "um"): profile.amounts,
            UnitKey("length", "mm"): profile.length,
            UnitKey("further_slope_and_crowning", "um"): profile.further,
            "contact_ratio": profile.contact_ratio,
            "unmodified": {key: column[0] for key, column in values.items()},
            "best": {key: column[profile.best] for key, column in values.items()},
        }

    def tables(self) -> Iterator[Table]:
        """Tables of the steps, of their contact results, and of the bearings."""
        yield self._steps()
        if self.contacts:
            yield self._contacts()
            yield self._contact_cases()
        yield self._bearings()

    def _steps(self) -> Table:
        wears = bool(self.main.damage)
        groups = [
            [
                Record("torque", "", lambda of: of.torque, "torque of the layout [N m]", "g"),
                *_factors("{} without modification", 0),
            ],
            [
                _record(f"step 1, {self.main.gear}: slope [um]", lambda of: of.line.slope, ".2f"),
                _record("  crowning [um]", lambda of: of.line.crowning, ".2f"),
                *_factors("  {}", 1),
            ],
            [
                _record(f"step 2, pinion: {self.main.means}, C_b [um]", lambda of: of.further[0], ".2f"),
                _record(f"step 2, wheel: {self.main.means}, C_b [um]", lambda of: of.further[1], ".2f"),
                _record("  least of both together [um]", lambda of: of.needed, ".2f"),
            ],
            *([*_cases(name, tolerance, lives=wears)] for name, tolerance in self.tolerances.items()),
            *([[_life(number, text) for number, text in enumerate(_AFTER)]] * wears),
        ]
        note = "* largest load at an edge" + "; last rows: no deviation" * wears
        records = [record for group in groups for record in group]
        result = table_of(records, self.layouts, f"{self.design.title}: flank lines", across=True, note=note)
        result.ends = tuple(int(end) - 1 for end in np.cumsum([len(group) for group in groups])[:-1])
        return result

    def _contacts(self) -> Table:
        """The contact analysis of every step, beside the one-dimensional one at the same torque."""
        title = f"contact analysis at {self.profile_torque:g} N m, without deviations"
        result = Table(("", "K_Hbeta", "K_Fbeta", "edge load factor", "K_Hbeta of Annex E"), title=title)
        for support, steps in self.contacts.items():
            for step, found in steps.items():
                given = self.factors[support].get(step)
                cells = *(f"{found[name]:.3f}" for name in FACTORS), "" if given is None else f"{given:.3f}"
                result.add_row(f"{support}: {step}", *cells)
        return result

    def _contact_cases(self) -> Table:
        """K_Hbeta of the contact analysis in the five cases."""
        title = f"K_Hbeta of the contact analysis at {self.profile_torque:g} N m in the cases of deviations"
        result = Table(("", *CASES), title=title)
        for support, tolerances in self.contact_cases.items():
            for tolerance, steps in tolerances.items():
                for step, factors in steps.items():
                    result.add_row(f"{support}, {tolerance}: {step}", *(f"{factor:.3f}" for factor in factors))
        return result

    def _bearings(self) -> Table:
        """Displacements of the shafts at the bearings."""
        found = {name: bearing_reactions(support.gearbox) for name, support in self.supports.items()}
        header = "bearing", "force [N]", "axial [N]", *(f"{way}, {name}" for name in found for way in "xy")
        result = Table(header, title="bearings: displacement of the shaft [um]")
        first = next(iter(found.values()))
        for number, name in enumerate(first.names):
            force = float(np.hypot(*np.asarray(first.force)[number, :2]))
            moved = [f"{float(each.shaft[number, way]):.2f}" for each in found.values() for way in range(2)]
            result.add_row(name, f"{force:.0f}", f"{float(first.force[number, 2]):.0f}", *moved)
        return result

    def write(self, folder: Path) -> None:
        """Write the flanks after every step to `flanks.csv`, and the variants of step 3 to `profiles.csv`."""
        # the flanks need no mesh, which only step 3 has
        moving = kinematics(self.design.pair(), real(0.0), self.design.resolution(), "strain")
        write_flanks(folder / "flanks.csv", moving, self.designs())
        if self.profile is not None:
            self.profile.table.to_csv(folder / "profiles.csv")

    def figures(self) -> Iterator[Figure]:
        """Figures of the tolerance cases, K_Hbeta over the torque, shafts, profile modifications and the contact."""
        from .. import plot
        from . import figures

        steps, name = dict(zip(STEPS, self.main.cases)), list(self.main.after)[-1]

        def draw(panel: Any, step: str) -> None:
            figures.tolerance_line_load(steps[step][name], panel, title=f"{step}, {name} deviations")

        caption = "Load over the face under the combinations of deviations within the tolerances."
        yield Figure("tolerance_cases", caption, plot.panels(draw, steps, width=_PANEL, height=_HEIGHT))
        shown = {f"{step}, {kind}": one for step, of in steps.items() for kind, one in of.items()}
        yield Figure.of(figures.face_load_factors, shown)
        loads = {"design_torque": self.design.torque}
        yield Figure.of(plot.face_load_over_torque, self.torques, self.over_torque, **loads)
        yield Figure.of(plot.shaft_deflection, next(iter(self.supports.values())).gearbox)
        if self.cycles:
            yield Figure.of(plot.transmission_error, self.cycles)
            yield Figure.of(plot.load_sharing, self.cycles)
            for step, cycle in self.cycles.items():
                yield Figure(f"contact_pattern_{step}", _PATTERNS[step], plot.contact_pattern(cycle))
            yield Figure.of(plot.lead_chart, next(iter(self.meshes.values())), self.designs())
        if self.profile is not None:
            rows, names = self.profile.radar_variants()
            values = self.profile.radar_table()
            for gear, hours in zip(("pinion", "wheel"), self.lives(self.profile).values()):
                if np.isfinite(hours[rows]).all():
                    values[described(f"{gear}_life", "h", better="larger")] = hours
            yield Figure.of(plot.radar, values, rows, names)


def flank_lines(layout: FlankLineLayout) -> dict[str, tuple[FlankLine, FlankLine]]:
    """Flank lines (pinion, wheel) over the faces of the gears, by step of `STEPS`."""
    none = FlankLine()
    level = layout.line.on(layout.pair, layout.gear)
    first = (level, none) if layout.gear == "pinion" else (none, level)
    return dict(zip(STEPS, ((none, none), first, (layout.pinion, layout.wheel))))


def _root_factor(layout: FlankLineLayout, factor: Given) -> np.ndarray:
    """K_Fbeta from K_Hbeta for the gears of a layout."""
    pair = layout.pair
    return np.asarray(root_face_load_factor(np.maximum(factor, 1.0), pair.face_width, tooth_height(pair)))


def _layout(layout: FlankLineLayout) -> dict[str, Any]:
    hours = UnitKey("life", "h")

    def line(of: FlankLine) -> dict[UnitKey, Any]:
        ends = {
            UnitKey("end_relief", "um"): [end.amount for end in of.ends],
            UnitKey("end_relief_width", "mm"): [end.length for end in of.ends],
        }
        return {UnitKey("slope", "um"): of.slope, UnitKey("crowning", "um"): of.crowning, **(ends if of.ends else {})}

    def cases(of: Mapping[str, ToleranceCases], step: int) -> dict[str, Any]:
        return {
            name: {
                **({hours: layout.lives[name][step]} if layout.lives else {}),
                "face_load_factor": one.face_load_factor,
                "root_face_load_factor": _root_factor(layout, one.face_load_factor),
                "edge_contact": one.edge_contact,
                "loaded_share": one.loaded_share,
            }
            for name, one in of.items()
        }

    life: dict[str, Any] = {}
    if layout.damage:  # there is a duty cycle
        life[hours] = [one.life for one in layout.damage]
        life["relative_life"] = layout.relative_life
        life["worst_relative_life"] = {name: layout.worst_relative_life(name) for name in layout.lives}
    factors = np.asarray(layout.factors)
    return {
        UnitKey("torque", "N m"): layout.torque,
        "gear": layout.gear,
        "step_1": line(layout.line),
        "further": layout.means,
        UnitKey("further_amount", "um"): layout.further,
        UnitKey("least_further_amount", "um"): layout.needed,
        "pinion": line(layout.pinion),
        "wheel": line(layout.wheel),
        "face_load_factor": dict(zip(("unmodified", "step_1"), factors)),
        "root_face_load_factor": dict(zip(("unmodified", "step_1"), _root_factor(layout, factors))),
        "cases": CASES,
        **_by_step({f"{step} cases": cases(of, number) for number, (step, of) in enumerate(zip(STEPS, layout.cases))}),
        **life,
    }


def _by_step(of: Mapping[str, Any]) -> dict[str, Any]:
    return {step.replace(" ", "_"): value for step, value in of.items()}


def _reactions(support: ShaftSupport) -> dict[str, Any]:
    found = bearing_reactions(support.gearbox)
    keys = UnitKey("force", "N"), UnitKey("shaft", "um"), UnitKey("seat", "um")
    columns = map(np.asarray, (found.force, found.shaft, found.seat))
    return {name: dict(zip(keys, (each[:3] for each in row))) for name, *row in zip(found.names, *columns)}


def _record(heading: str, of: Callable[[FlankLineLayout], Any], form: str = ".3f") -> Record[FlankLineLayout]:
    return Record(heading, "", of, heading, form)


def _factors(heading: str, step: int) -> Iterator[Record[FlankLineLayout]]:
    """K_Hbeta and K_Fbeta after a step without deviations."""
    yield _record(heading.format("K_Hbeta"), lambda of: of.factors[step])
    yield _record(heading.format("K_Fbeta"), lambda of: _root_factor(of, of.factors[step]))


def _life(step: int, after: str) -> Record[FlankLineLayout]:
    return _record(f"life {after} [h]", lambda of: of.damage[step].life, ".4g")


def _cases(name: str, tolerance: FlankLineTolerance, *, lives: bool) -> Iterator[Record[FlankLineLayout]]:
    """K_Hbeta after every step in the cases of deviations within a tolerance, with K_Fbeta and life of the worst."""

    def record(heading: str, each: Callable[[FlankLineLayout], Iterable[str]]) -> Record[FlankLineLayout]:
        return Record(heading, "", lambda of: " / ".join(each(of)), heading, "s")

    def factor(number: int) -> Callable[[FlankLineLayout], Iterable[str]]:
        return lambda of: (_cell(step[name], number) for step in of.cases)

    limits = f"f_Hb {float(tolerance.helix_slope):.1f}, f_ma {float(tolerance.misalignment):.1f} um"
    yield record(f"{name}: {limits}", lambda of: STEPS)
    for number, case in enumerate(CASES):
        yield record(f"  K_Hbeta, {case}", factor(number))
    yield record(
        "  K_Fbeta, worst case",
        lambda of: (f"{float(_root_factor(of, np.max(step[name].face_load_factor))):.3f} " for step in of.cases),
    )
    if lives:
        yield record("  life, worst case [h]", lambda of: (f"{float(np.min(each)):.4g} " for each in of.lives[name]))


def _cell(cases: ToleranceCases, number: int) -> str:
    return f"{float(cases.face_load_factor[number]):.3f}{'*' if bool(cases.edge_contact[number]) else ' '}"
