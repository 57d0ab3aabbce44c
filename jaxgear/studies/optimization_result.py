"""Result of an optimization: text, tables and figures of an optimum, alike for every method."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, repeat
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ..contact import Mesh, Side
from ..io import DesignFile, describe, write_front
from ..io.results import unit_of
from ..metrics import Finding, Quantity, flank_surface
from ..microgeometry import AbstractModification
from ..numerics import UnitKey
from ..optimize import Front, Optimum, Problem, Projection
from ..optimize.result import PENALIZED
from ..optimize.verdict import over_cases
from ..report import Figure, Table, text
from ..vocabulary import quantities
from . import side_by_side
from .comparison import ComparisonResult
from .evaluation import response_surface
from .gear_data import mounting
from .summary import flanks_data

_SAME = 0.05  # [%]; a smaller change rounds to nothing
_USUAL = "none, inputs and results lie within the usual ranges"
_SHOWN_BOUNDS = 8
Rows = Iterator[tuple[str, str]]  # label and text
_NO_RATIO = ("degC",)  # units whose zero is a convention


@dataclass(frozen=True)
class Judged:
    """Quantity by which designs are compared.

    Attributes:
        of: quantity.
        label: name in words, with the measure over several cases.
        values: values by the name of the design.
        verified: values with the finite-element structure; empty if not requested.
    """

    of: Quantity
    label: str
    values: Mapping[str, float]
    verified: Mapping[str, float]

    def change(self, before: float, after: float, than: str) -> str:
        """Change of a number in words: "31.1 % less than unmodified"; "" if either is not finite."""
        if not (math.isfinite(before) and math.isfinite(after)):
            return ""
        worse = " (worse)" if self.of.sign * (after - before) > 0 else ""
        if self.of.unit in _NO_RATIO or before <= 0:
            return f"{after - before:+.3g} {self.of.unit}".rstrip() + f"{worse} against {than}"
        percent = 100 * (after / before - 1)
        if abs(percent) < _SAME:
            return f"as {than}"
        return f"{abs(percent):.1f} % {'more' if percent > 0 else 'less'}{worse} than {than}"

    def row(self, values: Mapping[str, float]) -> str:
        """Comparison in words of the main design, which is the last, with the first and with the others."""
        form = self.of.form
        (first, before), *others, (_, after) = values.items()
        changes = [self.change(before, after, first)]
        changes += [self.change(value, after, f"{other} ({value:{form}})") for other, value in others]
        said = ", ".join(change for change in changes if change)
        return f"{before:{form}} -> {after:{form}} {self.of.unit}".rstrip() + f": {said}" * bool(said)


def gains(evaluations: side_by_side.Evaluations, problem: Problem | None) -> Rows:
    """Rows (label, text) of the gains: all objectives, PPTE if it is not an objective, and values by finite elements.

    Args:
        evaluations: evaluations by the name of the design, the unmodified design first.
        problem: problem with the objectives; None for PPTE alone.
    """
    main = side_by_side.main_name(evaluations)
    compared = {name: found for name, found in evaluations.items() if not name.startswith("as ")}
    compared = {name: compared[name] for name in (*(name for name in compared if name != main), main)}
    for judged in _numbers(compared, problem):
        yield judged.label, judged.row(judged.values)
        if judged.verified:
            yield "  by finite elements", judged.row(judged.verified)


def _numbers(evaluations: side_by_side.Evaluations, problem: Problem | None) -> Iterator[Judged]:
    labels = list(next(iter(evaluations.values())).objectives)
    asked = [] if problem is None else [(of, f"{over_cases(problem)}{of.words}") for of in problem.objectives]
    several = all(found.verified is not None for found in evaluations.values())
    for label, (of, said) in zip(labels, asked):
        verified = {name: found.verified.objectives[label] for name, found in evaluations.items() if found.verified}
        values = {name: found.objectives[label] for name, found in evaluations.items()}
        yield Judged(of, said, values, verified if several else {})
    ppte = quantities["ppte"]
    if ppte.named not in labels:
        verified = {name: found.verified.ppte for name, found in evaluations.items() if found.verified}
        values = {name: float(found.metrics[ppte.key]) for name, found in evaluations.items()}
        yield Judged(ppte, ppte.words, values, verified if several else {})


COMPROMISE = "compromise"  # name of the design of a front that is reported
_SHOWN_PARAMETERS = 6  # with more parameters the columns are only written to a file


def _others_of(front: Front, evaluations: side_by_side.Evaluations) -> dict[str, np.ndarray]:
    """Objectives of the designs that are compared with the front, by name, shape (objectives,)."""
    return {
        name: np.asarray(list(found.objectives.values()))
        for name, found in evaluations.items()
        if name != COMPROMISE and len(found.objectives) == len(front.objectives)
    }


def front_table(front: Front, evaluations: side_by_side.Evaluations, of_variables: Mapping[str, str]) -> Table:
    """Table of the designs of a front, followed by the designs it is compared with.

    Args:
        front: Pareto front.
        evaluations: evaluations by the name of the design.
        of_variables: units by the name of the variable.
    """
    title = f"Pareto front, {len(front.values)} designs, all in front.csv"
    names = list(front.parameters) if len(front.parameters) <= _SHOWN_PARAMETERS else []
    objectives = () if front.compromise.problem is None else front.compromise.problem.objectives
    columns = [*((of.words, of.unit) for of in objectives), *((name, of_variables.get(name, "")) for name in names)]
    result = Table(("", *(f"{name}\n[{unit}]" if unit else name for name, unit in columns)), title=title)
    for row, values in enumerate(front.values):
        cells = [*values, *(front.parameters[name][row] for name in names)]
        label = f"{row + 1}, {COMPROMISE}" if row == front.chosen else f"{row + 1}"
        result.add_row(label, *(f"{value:.4g}" for value in cells))
    result.add_section()
    for name, values in _others_of(front, evaluations).items():
        result.add_row(name, *(f"{value:.4g}" for value in values), *("-" for _ in names))
    return result


def front_rows(front: Front, signs: Sequence[int], evaluations: side_by_side.Evaluations) -> Rows:
    """Rows (label, text) on the compromise of a front, and on the designs of the front that dominate other designs.

    Args:
        front: Pareto front.
        signs: sign of every objective, 1 if smaller values are better, else -1.
        evaluations: evaluations by the name of the design.
    """
    yield COMPROMISE, "the design of the front whose worst distance from the best of each objective is least"
    for name, values in _others_of(front, evaluations).items():
        better = ((front.values - values) * np.asarray(signs) < 0).all(axis=1)
        found = ", ".join(str(row + 1) for row in np.flatnonzero(better)) or "none"
        rows = "all" if better.all() else found
        yield "front", f"better than {name} in every objective: {rows} of its {len(front.values)} designs"


_NOTHING = "nothing, the involute stays"
_DIGITS = {"um": ".2f", "mm": ".3f"}
_MOST = 4  # most numbers of a curve that are printed


def _to_grind(mesh: Mesh, pinion: AbstractModification, wheel: AbstractModification, design: str = "") -> Rows:
    """Rows (gear, text) of the modifications to grind, one for every part of both modifications.

    Args:
        mesh: prepared mesh.
        pinion, wheel: modifications of concrete numbers.
        design: name of the design, if several designs are listed.
    """
    for gear, side, modification in zip(("pinion", "wheel"), mesh.sides, (pinion, wheel)):
        parts = [_part(part, side, modification) for part in describe(modification)] or [_NOTHING]
        yield from _under(f"{gear}, {design}" if design else gear, parts)


def _under(label: str, lines: Iterable[str]) -> Rows:
    """Rows (label, text) with the label in the first row only."""
    return zip(chain((label,), repeat("")), lines)


def _part(part: Mapping[str, Any], side: Side, modification: AbstractModification) -> str:
    """One part: "tip relief 5.60 um over 5.581 mm of roll length, parabolic, from diameter 59.931 mm to the tip"."""
    rest = dict(part)
    kind = rest.pop("type")
    if isinstance(rest.get("amount"), list):
        values = np.asarray(rest["amount"])
        return (
            f"{kind.replace('_', ' ')} of {values.size} values, {values.min():.2f} to {values.max():.2f} um, flanks.csv"
        )
    text = kind.replace("_", " ")
    if "amount" in rest:
        text += f" {_number(rest.pop('amount'), unit_of(kind, 'amount'))}"
    length = rest.pop("length", None)
    if length is not None:
        text += f" over {_number(length, unit_of(kind, 'length'))}"
        text += " of roll length" * (kind in _ENDS)
    if "curve" in rest:
        text += f", {_curve(rest.pop('curve'))}"
    for name, value in rest.items():
        text += f", {name.replace('_', ' ')} {_number(value, unit_of(kind, name))}"
    return text + (_ENDS[kind](side, modification, length) if kind in _ENDS and length else "")


def _from_tip(side: Side, modification: AbstractModification, length: float) -> str:
    return f", from {_place(side, modification, -1, -length)} to the tip"


def _to_root(side: Side, modification: AbstractModification, length: float) -> str:
    return f", from the start of the active profile to {_place(side, modification, 0, length)}"


_ENDS = {"tip_relief": _from_tip, "root_relief": _to_root}


def _place(side: Side, modification: AbstractModification, end: int, further: float) -> str:
    """Diameter and roll angle of a roll length, counted from an end of the active profile."""
    surface = jax.tree.map(np.asarray, flank_surface(side, modification))
    base = np.sqrt((0.5 * surface.diameter[-1]) ** 2 - surface.roll_length[-1] ** 2)
    roll = max(float(side.gear.signed(surface.roll_length[end] + further)), 0.0)
    return f"diameter {2 * np.hypot(base, roll):.3f} mm (roll angle {np.rad2deg(roll / base):.2f} deg)"


def _curve(curve: Mapping[str, Any]) -> str:
    given = [np.ravel(value) for name, value in curve.items() if name != "type"]
    numbers = [f"{number:.3g}" for of in given for number in of]
    shown = numbers if len(numbers) <= _MOST else [f"of {len(numbers)} values"]
    return " ".join([curve["type"].replace("_", " "), *shown])


def _number(value: Any, unit: str) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:{_DIGITS.get(unit, '.4g')}} {unit}".rstrip()
    return str(value)


_LIMITED = {"corner pressure": "max_corner_pressure", "flank pressure": "max_flank_pressure"}


def _overloads(unusual: Iterable[Finding], optimum: Optimum) -> Rows:
    """Rows on contact pressures above the usual range, with the constraint that limits them."""
    for finding in unusual:
        name = _LIMITED.get(finding.key)
        if name is not None and name not in optimum.constraints:
            limit = f'[[optimize.constraint]] with of = "{name}", high = {finding.usual.high:g}'
            yield "overload", f"{finding.key} {finding.number} exceeds {finding.usual.high:g} MPa; limit it: {limit}"


def _rounding(file: DesignFile, optimum: Optimum) -> Rows:
    """Row on the steps to which variables are rounded, and on the resulting change of the objective."""
    rounding = optimum.rounding
    if rounding is None:
        return
    if not rounding.steps:
        yield "rounding", "none: no design on the steps was found that keeps all limits, the variables have all digits"
        return
    steps = dict.fromkeys(f"{step:g} {file.units[name]}".rstrip() for name, step in rounding.steps.items())
    kept = [name for name in optimum.parameters if name not in rounding.steps]
    digits = f"; all digits: {', '.join(kept)}" if kept else ""
    cost = f"{rounding.objective:.4g} -> {optimum.objective:.4g} {optimum.objective_unit}".rstrip()
    yield "rounding", f"to steps of {' and '.join(steps)}: {optimum.objective_name} {cost}{digits}"


@dataclass(frozen=True)
class OptimizationResult(ComparisonResult):
    """Result of a search: the optimum beside the designs with which it is compared.

    Attributes:
        optimum: result of the search.
        front: Pareto front of which the optimum is the compromise; None without one.
        projection: projection of the optimum on a curve; None without one.
        searched_at: number of positions at which the search began.
    """

    optimum: Optimum
    front: Front | None
    projection: Projection | None
    searched_at: int

    def summary(self) -> dict[str, Any]:
        """Numbers of the gears, of every design and of the optimum, as plain data."""
        optimum, projection, file = self.optimum, self.projection, self.design
        data = optimum.summary()
        data["parameters"] = {_with_unit(file, name): value for name, value in optimum.parameters.items()}
        if set(optimum.parameters) == set(file.bounds):
            data["bounds"] = {_with_unit(file, name): limits for name, limits in file.bounds.items()}
        if optimum.iterations:
            names = ("ppte", "limit", "max_relief", "max_flank_pressure", "max_corner_pressure")
            data["iterations"] = [{name: getattr(state, name) for name in names} for state in optimum.iterations]
        if projection is not None:
            data["projection"] = {
                "curve": projection.curve,
                quantities["ppte"].key: projection.ppte,
                UnitKey("loss", "um"): projection.loss,
                UnitKey("misfit", "um"): projection.misfit,
                **flanks_data(projection.pinion, projection.wheel),
            }
        return {**super().summary(), "optimum": data}

    def write(self, folder: Path) -> None:
        """Write the flanks of all designs to `flanks.csv`, and a front to `front.csv`."""
        super().write(folder)
        if self.front is not None:
            write_front(folder / "front.csv", self.front)

    def figures(self) -> Iterator[Figure]:
        """Figures of the designs, their scatter over manufactured gears, the optimum over all loads, and the search."""
        from .. import plot

        yield from super().figures()
        mesh, optimum, front = self.mesh, self.optimum, self.front
        torques, errors = response_surface(mesh, self.design.torque, optimum.pinion, optimum.wheel)
        unloaded, name = optimum.cycle.unloaded_transmission_error, side_by_side.main_name(self.evaluations)
        about = {"design_torque": float(optimum.cycle.torque), "design": name}
        yield Figure.of(plot.response_surface, mesh.phase, torques, errors, unloaded, **about)
        if front is None:  # the compromise of a front is measured by the front so far, which moves
            yield Figure.of(plot.convergence, {optimum.method: optimum})
        else:
            others = _others_of(front, self.evaluations)
            yield replace(Figure.of(plot.optimum_front, front, chosen=front.chosen, others=others), name="front")
        if optimum.iterations:
            yield Figure.of(plot.iterations_relief, mesh, optimum)
            yield Figure.of(plot.iterations_transmission_error, optimum, mesh.phase)

    def headlines(self) -> Iterator[Table]:
        """Tables of the modification to grind, the gain, and the checks of the result."""
        optimum, projection, evaluations = self.optimum, self.projection, self.evaluations
        name, best = side_by_side.main_name(evaluations), side_by_side.main(evaluations)
        rows = [*_overloads(self.unusual[name], optimum), *_to_grind(optimum.mesh, best.pinion, best.wheel)]
        if projection is not None:
            rows += _to_grind(optimum.mesh, projection.pinion, projection.wheel, f"as {projection.curve}")
        yield Table(("", ""), tuple(rows), f"Modification to grind: {name} of {self.design.title}")
        gained = [*gains(evaluations, optimum.problem), *_rounding(self.design, optimum)]
        if self.front is not None and optimum.problem is not None:
            gained += front_rows(self.front, [of.sign for of in optimum.problem.objectives], evaluations)
        yield Table(("", ""), tuple(gained), f"Gain at {self.design.load_in_words}: unmodified -> {name}")
        findings = [line.removeprefix(side_by_side.WARNING) for line in self.findings()]
        checks = (
            *_under("limits", _feasibility(optimum)),
            *_under("variables", _bounds(self.design, optimum)),
            *_under("grid", self._grid()),
            *(("failed", line) for line in super().failures()),
            *(("note", line) for line in self.notes()),
            *(("warning", line) for line in findings),
            *([] if findings else [("warnings", _USUAL)]),
        )
        yield Table(("", ""), checks, "Checks of the result")

    def tables(self) -> Iterator[Table]:
        """Table of the designs side by side, and of the designs of a front."""
        yield from super().tables()
        if self.front is not None:
            yield front_table(self.front, self.evaluations, self.design.units)

    def verdict(self) -> Iterator[str]:
        """Line on the mounting of the gears; the headlines contain the results."""
        yield mounting(self.design)

    def details(self) -> Iterator[str]:
        """Lines on the search: iterations, projection, first-order optimality and number of analyses."""
        optimum, front = self.optimum, self.front
        if optimum.objective_name.endswith(PENALIZED):  # no other design has the penalty
            yield f"{optimum.objective_name}: {optimum.objective:.4g}"
        for step, state in enumerate(optimum.iterations):
            yield (
                f"iteration {step}: PPTE {state.ppte:.3f} um (lower limit {state.limit:.3f}), up to "
                f"{state.max_relief:.2f} um removed, {state.max_flank_pressure:.0f} MPa on the flank, "
                f"{state.max_corner_pressure:.0f} at the corner"
            )
        if self.projection is not None:
            yield from str(self.projection).splitlines()
        left = optimum.optimality if front is None else float(np.nanmax(front.optimality, initial=0.0))
        if np.isfinite(left):
            unit = f" {optimum.objective_unit}".rstrip()
            of = f"{left:.2g}{unit}" if front is None else f"at most {left:.2g} of the front's span"
            yield f"first-order optimality: {of}, the largest predicted decrease over the full range of a variable"
        price = "one with gradient counts as three, each further gradient as two"
        yield f"{optimum.evaluations} contact analyses by method {optimum.method} ({price})"

    def failures(self) -> Iterator[str]:
        """Results that did not converge, and limits that are not met."""
        yield from super().failures()
        if not self.optimum.feasible:
            yield "constraints are not met"

    def checks(self) -> Iterator[tuple[str, str]]:
        """Checks of a report: convergence of all designs, values by finite elements, and convergence of the search."""
        yield from super().checks()
        optimum = self.optimum
        yield "all constraints met", text(optimum.feasible)
        yield "change of the objective at twice the positions, in its unit", text(optimum.grid_change)
        yield "first-order optimality, in the unit of the objective", text(optimum.optimality)
        yield "contact analyses", text(optimum.evaluations)

    def _grid(self) -> Iterator[str]:
        optimum, evaluations = self.optimum, self.evaluations
        said = f"searched at {self.searched_at} positions, " * (self.searched_at != optimum.positions)
        change = f"the objective by {optimum.grid_change:+.2g} {optimum.objective_unit}".rstrip()
        names = dict.fromkeys([next(iter(evaluations)), side_by_side.main_name(evaluations)])
        shown = {name: evaluations[name] for name in names}
        first, *others = side_by_side.grid(shown, change * bool(np.isfinite(optimum.grid_change)))
        yield from (said + first, *others)


def _feasibility(optimum: Optimum) -> Iterator[str]:
    yield from (f"{name} {limit}" for name, limit in optimum.constraints.items())
    if not optimum.feasible:
        passed = f"the nearest design exceeds one by {100 * optimum.violation:.2g} %"
        alone = optimum.problem is not None and len(optimum.problem.objectives) == 1
        sought = ", also when it minimized their violation alone" if alone else ""
        yield f"NOT FEASIBLE: the search found no design within all limits{sought}; {passed}"


def _bounds(file: DesignFile, optimum: Optimum) -> Iterator[str]:
    active = optimum.active_bounds
    if not optimum.parameters:
        return
    if set(optimum.parameters) != set(file.bounds):
        yield f"{len(optimum.parameters)} values of the flanks, {len(active)} of them at a bound"
        return
    for name, side in list(active.items())[:_SHOWN_BOUNDS]:
        bound = file.bounds[name][side == "upper"]
        yield f"{name} is at its {side} bound {bound:g} {file.units[name]}".rstrip()
    if len(active) > _SHOWN_BOUNDS:
        yield f"and {len(active) - _SHOWN_BOUNDS} more are at a bound"
    if not active:
        yield "no variable is at a bound"


def _with_unit(file: DesignFile, name: str) -> UnitKey:
    unit = file.units.get(name, "")
    return UnitKey(name.removesuffix(f"_{unit}") if unit else name, unit)
