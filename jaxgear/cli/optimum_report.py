"""What a run says and writes about its optimum, alike for every method."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..contact import Mesh
from ..io import DesignFile, describe
from ..optimize import Front, Optimum, Projection, Verified
from ..optimize.result import PENALIZED
from . import report
from .study import response_surface

_SHOWN_BOUNDS = 8


def verdict(
    file: DesignFile,
    optimum: Optimum,
    projection: Projection | None,
    evaluations: report.Evaluations,
    *,
    searched_at: int,
) -> Iterator[str]:
    """Lines under the table of an optimization, from its numbers; it began at so many positions."""
    before, after = next(iter(evaluations.values())), report.main(evaluations)
    ppte = [evaluation.metrics["ppte_um"] for evaluation in (before, after)]
    fall = report.reduction(evaluations)
    yield f"PPTE at {file.torque:g} N m {ppte[0]:.3f} -> {ppte[1]:.3f} um: {fall:.1f} % less than unmodified"
    for label in report.objectives(evaluations):
        yield f"{label} {before.objectives[label]:.4g} -> {after.objectives[label]:.4g}"
    if before.verified is not None and after.verified is not None:
        yield from _verified(report.objectives(evaluations), before.verified, after.verified)
    if optimum.objective_name.endswith(PENALIZED):  # no other design pays it
        yield f"{optimum.objective_name}: {optimum.objective:.4g}"
    yield from _bounds(file, optimum)
    for name, limit in optimum.constraints.items():
        yield f"{name} {limit}"
    if not optimum.feasible:
        passed = f"the nearest passes one by {100 * optimum.violation:.2g} %"
        alone = optimum.problem is not None and len(optimum.problem.objectives) == 1
        sought = ", not by their violation alone either" if alone else ""
        yield f"NOT FEASIBLE: the search met no design within all limits{sought}; {passed}"
    for step, state in enumerate(optimum.iterations):
        yield (
            f"iteration {step}: PPTE {state.ppte:.3f} um (lower limit {state.limit:.3f}), up to "
            f"{state.max_relief:.2f} um removed, {state.max_flank_pressure:.0f} MPa on the flank, "
            f"{state.max_corner_pressure:.0f} at the corner"
        )
    if projection is not None:
        yield from str(projection).splitlines()
    yield _positions(optimum, searched_at)
    if np.isfinite(optimum.decrease_left):
        yield f"decrease left at the optimum {optimum.decrease_left:.2g} per full range of the variables"
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


def front_lines(front: Front) -> Iterator[str]:
    """Lines about a front, whose compromise is the optimum of the run."""
    yield f"{len(front.values)} designs on the Pareto front, in front.csv; the optimum is the compromise"
    left = float(np.nanmax(front.decrease_left, initial=0.0))
    yield f"no step improves all objectives of one of them by more than {left:.2g} spans per full range"


def write_figures(folder: Path, mesh: Mesh, torque: float, optimum: Optimum, front: Front | None) -> list[Path]:
    """Writes the figures of the search and of the optimum over all loads; gives the files."""
    from .. import plot

    torques, errors = response_surface(mesh, torque, optimum.pinion, optimum.wheel)
    unloaded = optimum.cycle.unloaded_transmission_error
    axes: dict[str, Any] = {
        "response_surface": plot.response_surface(
            mesh.phase, torques, errors, unloaded, design_torque=float(optimum.cycle.torque), design="optimum"
        ),
    }
    if front is None:  # the compromise of a front is measured by the front so far, which moves
        axes["convergence"] = plot.convergence({optimum.method: optimum})
    if optimum.iterations:
        axes["iterations_relief"] = plot.iterations_relief(mesh, optimum)
        axes["iterations_transmission_error"] = plot.iterations_transmission_error(optimum, mesh.phase)
    if front is not None:
        axes["front"] = plot.optimum_front(front, chosen=front.chosen)
    return report.save_figures(folder, axes)


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
        yield f"and {len(active) - _SHOWN_BOUNDS} more variables are at a bound"
    if not active:
        yield "no variable is at a bound"


def _verified(labels: list[str], before: Verified, after: Verified) -> Iterator[str]:
    """The same lines by finite elements."""
    fall = f": {100 * (1 - after.ppte / before.ppte):.1f} % less than unmodified" if before.ppte else ""
    yield f"PPTE by finite elements {before.ppte:.3f} -> {after.ppte:.3f} um{fall}"
    for label in labels:
        yield f"{label} by finite elements {before.objectives[label]:.4g} -> {after.objectives[label]:.4g}"


def _positions(optimum: Optimum, searched_at: int) -> str:
    said = f"searched at {searched_at} positions, " if searched_at != optimum.positions else ""
    said += f"evaluated at {optimum.positions} positions"
    if np.isfinite(optimum.grid_change):
        said += f"; twice as many change the objective by {optimum.grid_change:+.2g} {optimum.objective_unit}".rstrip()
    return said


def _with_unit(file: DesignFile, name: str) -> str:
    unit = file.units.get(name, "")
    return f"{name}_{unit}" if unit and not name.endswith(f"_{unit}") else name
