"""Result of a search from its best design, and verification by finite elements."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..compliance import TabulatedCompliance, finite_element_compliance
from ..conditions import in_words, solve_case, solved, two_modifications
from ..contact import Mesh, MeshCycle, OperatingPoint, prepare
from ..contact.mesh import begin_mesh
from ..metrics import Analysis
from ..microgeometry import AbstractModification
from ..numerics import program, real
from .goal import FEASIBLE, Constraint
from .linear_model import Linearizer, LinearModel
from .problem import Problem
from .result import PENALIZED, Limit, Optimum, Rounding
from .rounding import on_step
from .search import Record

_AT_BOUND = 1e-6  # a parameter this close to a bound, relative to its range, is at the bound
PROBE = 1e-3  # step for the first-order optimality, relative to the ranges


def optimum_of(
    record: Record,
    method: str,
    began: float,
    grid_change: float = float("nan"),
    *,
    left: float | None = None,
    unrounded: Record | None = None,
    steps: Mapping[str, float] = MappingProxyType({}),
) -> Optimum:
    """Optimum from the best design of a record.

    Args:
        record: record of the search.
        method: name of the method.
        began: start time of the search by `time.perf_counter` [s].
        grid_change: change of the objective at twice the positions, in its unit.
        left: first-order optimality; None to compute it.
        unrounded: record of the search before rounding; None without rounding.
        steps: steps of the rounded variables.
    """
    problem = record.problem
    x = np.asarray(record.point, np.dtype(problem.low.dtype))
    parameters = _on_steps(problem.parameters(x), steps)
    pinion, wheel = two_modifications(problem.design(parameters))
    heaviest = np.asarray(problem.cases.torque)[np.asarray(problem.cases.weight).argmax()]
    cycle = solve_case(problem.mesh, heaviest, pinion, wheel)
    left = _optimality(unrounded or record) if left is None else left  # before the analyses are counted
    several = len(problem.objectives) > 1
    sign = 1 if several else problem.objectives[0].sign
    rounding = None
    if unrounded is not None:
        record.evaluations = unrounded.evaluations
        exact = {name: float(value) for name, value in problem.parameters(unrounded.point).items()}
        rounding = Rounding(dict(steps), exact, sign * unrounded.value)
    return Optimum(
        method=method,
        objective_name=objective_name(problem),
        objective_unit="" if several else problem.objectives[0].unit,
        parameters={name: float(value) for name, value in parameters.items()},
        pinion=pinion,
        wheel=wheel,
        mesh=problem.mesh,
        cycle=cycle,
        ppte=float(np.ptp(np.asarray(cycle.transmission_error))),
        objective=sign * record.value,
        positions=problem.mesh.resolution.positions,
        grid_change=grid_change,
        optimality=left,
        active_bounds=_active_bounds(problem.names, record.point),
        constraints=_limits(problem, x, pinion, wheel),
        violation=max(record.violation - FEASIBLE, 0.0),  # excess is counted from the safety margin inside the limit
        evaluations=record.evaluations,
        history=sign * np.asarray([value for _, value, _ in record.history]),
        history_evaluations=np.asarray([spent for spent, _, _ in record.history]),
        history_positions=np.asarray([positions for _, _, positions in record.history], int),
        seconds=time.perf_counter() - began,
        problem=problem,
        rounding=rounding,
    )


def _on_steps(parameters: dict[str, Array], steps: Mapping[str, float]) -> dict[str, Array]:
    """Parameters, rounded to the decimal number of the nearest multiple where a step is given."""
    rounded = {name: on_step(float(parameters[name]), step) for name, step in steps.items()}
    return parameters | {name: real(np.asarray(value, parameters[name].dtype)) for name, value in rounded.items()}


def _optimality(record: Record) -> float:
    """First-order optimality at the best point: largest predicted decrease per full range of every parameter."""
    model = record.model
    if model is None:
        problem = record.problem
        record.spend(1, analyses=problem.gradient_cost)
        (found,) = Linearizer(problem, 1)(record.point[None])
        model = LinearModel(problem, record.point, found)
    return model.optimality(PROBE)


def objective_name(problem: Problem) -> str:
    """Name of the minimized objective, with measure and penalty."""
    names = [of.name for of in problem.objectives]
    if len(names) > 1:
        return f"distance from the ideal of {' and '.join(names)}"
    return over_cases(problem) + names[0] + (PENALIZED if problem.roughness is not None else "")


def judged(
    problem: Problem, pinion: AbstractModification | None = None, wheel: AbstractModification | None = None
) -> dict[str, float]:
    """Objectives of a problem for any modifications, by name and unit as "95 % CVaR of ppte [um]".

    The measure of the problem is applied over its cases; the value is infinite if a contact has not converged. No
    penalty is added.
    """
    if _is_single(problem):
        cycle, mesh = _single(problem, problem.objectives, pinion, wheel)
        values = np.asarray(_of_one(problem.objectives, cycle, mesh, problem.settings))
    else:
        values = np.asarray(_score_of(problem, pinion, wheel).value)
    names = (f"{over_cases(problem)}{of.named}" for of in problem.objectives)
    return {name: of.sign * float(value) for name, of, value in zip(names, problem.objectives, values)}


def _is_single(problem: Problem) -> bool:
    """True for a problem with a single case of nominal gears, whose program serves every modification."""
    return problem.cases.count == 1 and problem.cases.removed is None


def _single(problem: Problem, quantities, pinion, wheel) -> tuple[MeshCycle, Mesh | None]:
    """Solution of the single case, and the mesh if a quantity needs it."""
    cases, mesh = problem.cases, problem.mesh
    speed = None if cases.speed is None else np.asarray(cases.speed)[0]
    point = OperatingPoint(np.asarray(cases.torque)[0], speed, cases.friction)
    cycle = solve_case(mesh, point, pinion, wheel)
    if all(of.local for of in quantities):  # local quantities depend on the flanks only by the material removed
        return replace(cycle, pinion=None, wheel=None), None
    return cycle, mesh


def over_cases(problem: Problem) -> str:
    """Measure of a problem as a prefix of the name of a quantity, "95 % CVaR of "; "" for a single case."""
    return f"{in_words(problem.measure)} " if problem.cases.count > 1 else ""


@program
def _of_one(objectives, cycle, mesh, settings):
    analysis = Analysis(cycle, mesh, settings)
    values = jnp.stack([of.sign * of(analysis) for of in objectives])
    return jnp.where(solved(cycle) & jnp.all(jnp.isfinite(values)), values, jnp.inf)


@program
def _score_of(problem: Problem, pinion, wheel):
    return problem.score_of(pinion, wheel)


def _limits(problem: Problem, x, pinion, wheel) -> dict[str, Limit]:
    if not problem.constraints:
        return {}
    named: dict[str, Limit] = {}
    for constraint, values in zip(problem.constraints, _constrained(problem, x, pinion, wheel)):
        worst = max(np.asarray(values), key=lambda value: _excess(constraint, value))
        name, repeated = constraint.name, 2
        while name in named:
            name, repeated = f"{constraint.name} ({repeated})", repeated + 1
        low, high = (None if limit is None else float(limit) for limit in (constraint.low, constraint.high))
        named[name] = Limit(float(worst), low, high, constraint.unit, _excess(constraint, worst) <= FEASIBLE)
    return named


def _excess(constraint: Constraint, value) -> float:
    return float(max(constraint.excess(jnp.asarray(value))))


def _constrained(problem: Problem, x, pinion, wheel) -> Sequence[np.ndarray]:
    """Values of every constraint, leading axis (cases,)."""
    parameters = problem.parameters(x)
    wanted = tuple(limit.quantity for limit in problem.constraints if limit.quantity is not None)
    of_cycle = iter(_numbers(problem, wanted, x, pinion, wheel) if wanted else ())
    return [
        np.atleast_1d(limit.of_parameters(parameters) if limit.quantity is None else next(of_cycle))
        for limit in problem.constraints
    ]


def _numbers(problem: Problem, wanted, x, pinion, wheel):
    if not _is_single(problem):
        return _over_cases(problem, wanted, x)
    return _at_single(wanted, *_single(problem, wanted, pinion, wheel), problem.settings)


@program
def _at_single(wanted, cycle, mesh, settings):
    analysis = Analysis(cycle, mesh, settings)
    return [of(analysis) for of in wanted]


@program
def _over_cases(problem: Problem, wanted, x):
    return problem.over_cases(x, lambda analysis: [of(analysis) for of in wanted])


def _active_bounds(names, x) -> dict[str, str]:
    active = {}
    for name, value in zip(names, x):
        if value <= _AT_BOUND:
            active[name] = "lower"
        elif value >= 1 - _AT_BOUND:
            active[name] = "upper"
    return active


class Verified(eqx.Module):
    """PPTE and objectives of a design by the structure model of the mesh and by finite elements.

    Attributes:
        claimed: PPTE by the structure of the mesh [um].
        ppte: PPTE by the finite-element structure [um]; infinite if a contact has not converged.
        claimed_objectives: objectives of the search, by name and unit; empty for the transmission-error iteration.
        objectives: objectives by the finite-element structure, by the same measure over the same cases.
        cycle: mesh cycle by the finite-element structure.
    """

    claimed: float
    ppte: float
    claimed_objectives: dict[str, float]
    objectives: dict[str, float]
    cycle: MeshCycle

    def __str__(self) -> str:
        rows = [("PPTE [um]", self.claimed, self.ppte)]
        rows += [(name, self.claimed_objectives[name], value) for name, value in self.objectives.items()]
        lines = [f"{'':<24} {'claimed':>10} {'finite elements':>16}"]
        return "\n".join([*lines, *(f"{name:<24} {claimed:>10.4g} {found:>16.4g}" for name, claimed, found in rows)])


@dataclass(frozen=True)
class Verification:
    """Evaluate designs of a mesh with the finite-element structure in place of its own; made by `verification`."""

    _mesh: Mesh
    _problem: Problem | None  # on the mesh with the finite-element structure

    def __call__(
        self, cycle: MeshCycle, objectives: dict[str, float], pinion: AbstractModification, wheel: AbstractModification
    ) -> Verified:
        """Evaluate a design with the finite-element structure.

        Args:
            cycle: mesh cycle of the design on the original mesh; the PPTE is compared at its operating point.
            objectives: objectives on the original mesh, from `judged`.
            pinion, wheel: modifications of the design.
        """
        found = solve_case(self._mesh, cycle.operating_point, pinion, wheel)
        others = {} if self._problem is None else judged(self._problem, pinion, wheel)
        return Verified(_ppte(cycle), _ppte(found), objectives, others, found)


def verification(mesh: Mesh, compliance: TabulatedCompliance, problem: Problem | None = None) -> Verification:
    """Verification of designs of a mesh with finite-element tables of its gears.

    Args:
        mesh: prepared mesh with the structure model to be verified.
        compliance: finite-element tables of its gears, see `structure_for`.
        problem: problem whose objectives are compared in addition to the PPTE; None for PPTE alone.
    """
    other = prepare(mesh.pair, compliance=compliance, resolution=mesh.resolution, support=mesh.support)
    other = replace(other, automatic=mesh.automatic)
    return Verification(other, None if problem is None else problem.on(other))


def structure_for(mesh: Mesh, *, cache: str | Path | bool | None = True) -> TabulatedCompliance:
    """Finite-element tables for the gears and the plane state of a mesh; takes seconds unless they are cached.

    Args:
        mesh: prepared mesh of concrete gears.
        cache: as for `finite_element_compliance`.

    Raises:
        ValueError: for a mesh whose structure is a table already, traced gears, and a shape that cannot be meshed.
    """
    if isinstance(mesh.compliance, TabulatedCompliance):
        raise ValueError("mesh has the finite-element structure already, there is nothing to compare it with")
    return finite_element_compliance(mesh.pair, mesh.compliance.plane, cache=cache)


def begin_verification(mesh: Mesh, compliance: TabulatedCompliance, positions: int | None = None) -> None:
    """Start to compile the programs of `verification` in the background of a search, if programs are cached.

    Args:
        mesh: prepared mesh at the start of the search.
        compliance: finite-element tables of its gears.
        positions: number of positions of the mesh at the end of the search; None for that of `mesh`.
    """
    count = mesh.resolution.positions if positions is None else positions
    sizes = replace(mesh.resolution, positions=count)
    begin_mesh(mesh.pair, compliance, sizes, mesh.support, mesh.even)


def verify(optimum: Optimum, *, cache: str | Path | bool | None = True) -> Verified:
    """Evaluate an optimum again with the finite-element structure, on the same mesh and in the same cases.

    A search finds the best design of its model: improvements below the accuracy of the model may not be real. New
    tables of the gears take seconds, cached ones milliseconds.

    Args:
        optimum: optimum of any method, or the compromise of a front.
        cache: as for `finite_element_compliance`.

    Raises:
        ValueError: errors of `structure_for`.
    """
    flanks = optimum.pinion, optimum.wheel
    second = verification(optimum.mesh, structure_for(optimum.mesh, cache=cache), optimum.problem)
    claimed = {} if optimum.problem is None else judged(optimum.problem, *flanks)
    return second(optimum.cycle, claimed, *flanks)


def _ppte(cycle: MeshCycle) -> float:
    return float(np.ptp(np.asarray(cycle.transmission_error))) if solved(cycle) else float("inf")
