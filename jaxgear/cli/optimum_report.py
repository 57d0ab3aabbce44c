"""What a run says and writes about its optimum, alike for every method."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..contact import Mesh
from ..io import DesignFile, describe
from ..optimize import Front, Optimum, Projection
from ..optimize.result import PENALIZED
from ..report import Table
from . import report
from .front import front_rows, others_of
from .gains import gains
from .grinding import to_grind
from .study import response_surface

_SHOWN_BOUNDS = 8


def first_screen(
    file: DesignFile,
    optimum: Optimum,
    front: Front | None,
    projection: Projection | None,
    evaluations: report.Evaluations,
    *,
    searched_at: int,
    trust: Iterable[tuple[str, str]],
) -> Iterator[Table]:
    """What an engineer looks for first: what to grind, what it gains and whether to trust it.

    Args:
        file: the design file.
        optimum: what the search has found.
        front: of which it is the compromise; None without.
        projection: of it on a curve.
        evaluations: designs by their names, the first of which is unmodified.
        searched_at: positions at which the search began.
        trust: further rows about the last, such as what is not usual.
    """
    name, best = report.main_name(evaluations), report.main(evaluations)
    rows = [*to_grind(optimum.mesh, best.pinion, best.wheel)]
    if projection is not None:
        rows += to_grind(optimum.mesh, projection.pinion, projection.wheel, f"as {projection.curve}")
    yield Table(("", ""), tuple(rows), f"What to grind: {name} of {file.title}")
    gained = [*gains(evaluations, optimum.problem)]
    if front is not None and optimum.problem is not None:
        gained += front_rows(front, [of.sign for of in optimum.problem.objectives], evaluations)
    yield Table(("", ""), tuple(gained), f"What it gains at {file.torque:g} N m: unmodified -> {name}")
    judged_by = (
        *_feasibility(optimum),
        *_bounds(file, optimum),
        ("grid", _positions(optimum, evaluations, searched_at)),
    )
    yield Table(("", ""), (*judged_by, *trust), "Whether to trust it")


def search_lines(optimum: Optimum, front: Front | None, projection: Projection | None) -> Iterator[str]:
    """How the search has gone, for who wants to know."""
    if optimum.objective_name.endswith(PENALIZED):  # no other design pays it
        yield f"{optimum.objective_name}: {optimum.objective:.4g}"
    for step, state in enumerate(optimum.iterations):
        yield (
            f"iteration {step}: PPTE {state.ppte:.3f} um (lower limit {state.limit:.3f}), up to "
            f"{state.max_relief:.2f} um removed, {state.max_flank_pressure:.0f} MPa on the flank, "
            f"{state.max_corner_pressure:.0f} at the corner"
        )
    if projection is not None:
        yield from str(projection).splitlines()
    left = optimum.optimality if front is None else float(np.nanmax(front.optimality, initial=0.0))
    if np.isfinite(left):
        of = (
            f"{left:.2g} {optimum.objective_unit}".rstrip()
            if front is None
            else f"at most {left:.2g} of the front's span"
        )
        yield f"first-order optimality: {of}, the largest predicted decrease over the full range of a variable"
    price = "one with gradient counts as three, each further gradient as two"
    yield f"{optimum.evaluations} contact analyses by method {optimum.method} ({price})"


def summary(file: DesignFile, optimum: Optimum, projection: Projection | None) -> dict[str, Any]:
    """The optimum as plain data."""
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
            "ppte_um": projection.ppte,
            "loss_um": projection.loss,
            "misfit_um": projection.misfit,
            "pinion_modification": describe(projection.pinion),
            "wheel_modification": describe(projection.wheel),
        }
    return data


def write_figures(
    folder: Path, mesh: Mesh, torque: float, optimum: Optimum, front: Front | None, evaluations: report.Evaluations
) -> list[Path]:
    """Writes the figures of the search and of the optimum over all loads; gives the files."""
    from .. import plot

    torques, errors = response_surface(mesh, torque, optimum.pinion, optimum.wheel)
    unloaded, name = optimum.cycle.unloaded_transmission_error, report.main_name(evaluations)
    axes: dict[str, Any] = {
        "response_surface": plot.response_surface(
            mesh.phase, torques, errors, unloaded, design_torque=float(optimum.cycle.torque), design=name
        ),
    }
    if front is None:  # the compromise of a front is measured by the front so far, which moves
        axes["convergence"] = plot.convergence({optimum.method: optimum})
    if optimum.iterations:
        axes["iterations_relief"] = plot.iterations_relief(mesh, optimum)
        axes["iterations_transmission_error"] = plot.iterations_transmission_error(optimum, mesh.phase)
    if front is not None:
        axes["front"] = plot.optimum_front(front, chosen=front.chosen, others=others_of(front, evaluations))
    return report.save_figures(folder, axes)


def _feasibility(optimum: Optimum) -> Iterator[tuple[str, str]]:
    label = "limits"
    for name, limit in optimum.constraints.items():
        yield label, f"{name} {limit}"
        label = ""
    if not optimum.feasible:
        passed = f"the nearest passes one by {100 * optimum.violation:.2g} %"
        alone = optimum.problem is not None and len(optimum.problem.objectives) == 1
        sought = ", not by their violation alone either" if alone else ""
        yield label, f"NOT FEASIBLE: the search met no design within all limits{sought}; {passed}"


def _bounds(file: DesignFile, optimum: Optimum) -> Iterator[tuple[str, str]]:
    active = optimum.active_bounds
    if not optimum.parameters:
        return
    label = "variables"
    if set(optimum.parameters) != set(file.bounds):
        yield label, f"{len(optimum.parameters)} values of the flanks, {len(active)} of them at a bound"
        return
    for name, side in list(active.items())[:_SHOWN_BOUNDS]:
        bound = file.bounds[name][side == "upper"]
        yield label, f"{name} is at its {side} bound {bound:g} {file.units[name]}".rstrip()
        label = ""
    if len(active) > _SHOWN_BOUNDS:
        yield label, f"and {len(active) - _SHOWN_BOUNDS} more are at a bound"
    if not active:
        yield label, "no variable is at a bound"


def _positions(optimum: Optimum, evaluations: report.Evaluations, searched_at: int) -> str:
    said = f"searched at {searched_at} positions, " if searched_at != optimum.positions else ""
    change = f"the objective by {optimum.grid_change:+.2g} {optimum.objective_unit}".rstrip()
    shown = {
        name: evaluations[name] for name in dict.fromkeys([next(iter(evaluations)), report.main_name(evaluations)])
    }
    return said + report.grid(shown, change * bool(np.isfinite(optimum.grid_change)))


def _with_unit(file: DesignFile, name: str) -> str:
    unit = file.units.get(name, "")
    return f"{name}_{unit}" if unit and not name.endswith(f"_{unit}") else name
