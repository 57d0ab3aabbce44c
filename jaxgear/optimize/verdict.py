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
PROBE = 1e-3  # step over which the decrease that is left is measured, relative to the ranges


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
    """The best design of a record with all that is said about it.

    Args:
        record: of the search.
        method: its name.
        began: when the search began, as `time.perf_counter` tells.
        grid_change: of the objective at twice the positions.
        left: decrease that is left, where it is known.
        unrounded: record of the search before its variables were rounded; None where they were not to be.
        steps: to which they were rounded.
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
        violation=max(record.violation - FEASIBLE, 0.0),  # as an excess is counted from inside a limit
        evaluations=record.evaluations,
        history=sign * np.asarray([value for _, value, _ in record.history]),
        history_evaluations=np.asarray([spent for spent, _, _ in record.history]),
        history_positions=np.asarray([positions for _, _, positions in record.history], int),
        seconds=time.perf_counter() - began,
        problem=problem,
        rounding=rounding,
    )


def _on_steps(parameters: dict[str, Array], steps: Mapping[str, float]) -> dict[str, Array]:
    """Parameters of which those with a step are the decimal number nearest to its multiple."""
    rounded = {name: on_step(float(parameters[name]), step) for name, step in steps.items()}
    return parameters | {name: real(np.asarray(value, parameters[name].dtype)) for name, value in rounded.items()}


def _optimality(record: Record) -> float:
    """Fastest decrease of the objective at the best point, per step of the full range of every parameter."""
    model = record.model
    if model is None:
        problem = record.problem
        record.spend(1, analyses=problem.gradient_cost)
        (found,) = Linearizer(problem, 1)(record.point[None])
        model = LinearModel(problem, record.point, found)
    return model.optimality(PROBE)


def objective_name(problem: Problem) -> str:
    """Name of the minimized number."""
    names = [of.name for of in problem.objectives]
    if len(names) > 1:
        return f"distance from the ideal of {' and '.join(names)}"
    return over_cases(problem) + names[0] + (PENALIZED if problem.roughness is not None else "")


def judged(
    problem: Problem, pinion: AbstractModification | None = None, wheel: AbstractModification | None = None
) -> dict[str, float]:
    """Objectives of a problem for any modifications, by name and unit as "95 % CVaR of ppte [um]".

    Joined by the measure over the cases; infinite where a contact solution failed. No penalty is added.
    """
    if _is_single(problem):
        cycle, mesh = _single(problem, problem.objectives, pinion, wheel)
        values = np.asarray(_of_one(problem.objectives, cycle, mesh, problem.settings))
    else:
        values = np.asarray(_score_of(problem, pinion, wheel).value)
    names = (f"{over_cases(problem)}{of.named}" for of in problem.objectives)
    return {name: of.sign * float(value) for name, of, value in zip(names, problem.objectives, values)}


def _is_single(problem: Problem) -> bool:
    """Whether the program that solves one case serves every modification."""
    return problem.cases.count == 1 and problem.cases.removed is None


def _single(problem: Problem, quantities, pinion, wheel) -> tuple[MeshCycle, Mesh | None]:
    """The solution of the only case, and the mesh if any of the quantities asks for it."""
    cases, mesh = problem.cases, problem.mesh
    speed = None if cases.speed is None else np.asarray(cases.speed)[0]
    point = OperatingPoint(np.asarray(cases.torque)[0], speed, cases.friction)
    cycle = solve_case(mesh, point, pinion, wheel)
    if all(of.local for of in quantities):  # they know nothing of the flanks but what is removed
        return replace(cycle, pinion=None, wheel=None), None
    return cycle, mesh


def over_cases(problem: Problem) -> str:
    """The measure of a problem before the name of what it measures, "95 % CVaR of "; "" where it has a single case."""
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
    """Values of every constraint, cases leading."""
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
    """PPTE and objectives of a design by one structure model and by finite elements, all else being equal.

    Attributes:
        claimed: PPTE by the structure of the mesh [um].
        ppte: PPTE by the finite-element structure [um]; infinite where a contact solution failed.
        claimed_objectives: objectives of the search, by name and unit; empty where a curve was levelled.
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
    """Evaluates designs of a mesh with the finite-element structure in place of its own; `verification` makes one."""

    _mesh: Mesh
    _problem: Problem | None  # on that mesh

    def __call__(
        self, cycle: MeshCycle, objectives: dict[str, float], pinion: AbstractModification, wheel: AbstractModification
    ) -> Verified:
        """Both numbers of a design.

        Args:
            cycle: of the design on the mesh; its operating point is that of the PPTE.
            objectives: as `judged` by the problem on the mesh.
            pinion, wheel: its modifications.
        """
        found = solve_case(self._mesh, cycle.operating_point, pinion, wheel)
        others = {} if self._problem is None else judged(self._problem, pinion, wheel)
        return Verified(_ppte(cycle), _ppte(found), objectives, others, found)


def verification(mesh: Mesh, compliance: TabulatedCompliance, problem: Problem | None = None) -> Verification:
    """Verification of designs of a mesh with finite-element tables of its gears.

    Args:
        mesh: prepared mesh, by whose structure the numbers are claimed.
        compliance: tables of its gears, see `structure_for`.
        problem: whose objectives are compared besides the PPTE.
    """
    other = prepare(mesh.pair, compliance=compliance, resolution=mesh.resolution, support=mesh.support)
    other = replace(other, automatic=mesh.automatic)
    return Verification(other, None if problem is None else problem.on(other))


def structure_for(mesh: Mesh, *, cache: str | Path | bool | None = True) -> TabulatedCompliance:
    """Finite-element tables for the gears and the plane of a mesh, which take seconds where they are not on the disk.

    Args:
        mesh: prepared mesh of concrete gears.
        cache: as in `finite_element_compliance`.

    Raises:
        ValueError: for a mesh whose structure is a table already, gears that are traced, and a shape that cannot be
            meshed.
    """
    if isinstance(mesh.compliance, TabulatedCompliance):
        raise ValueError("mesh has the finite-element structure already, there is nothing to compare it with")
    return finite_element_compliance(mesh.pair, mesh.compliance.plane, cache=cache)


def begin_verification(mesh: Mesh, compliance: TabulatedCompliance, positions: int | None = None) -> None:
    """Starts to compile what `verification` needs, where programs are kept, while a search goes on.

    Args:
        mesh: prepared mesh on which the search begins.
        compliance: tables of its gears.
        positions: of the mesh on which it ends; None for those of the mesh.
    """
    count = mesh.resolution.positions if positions is None else positions
    sizes = replace(mesh.resolution, positions=count)
    begin_mesh(mesh.pair, compliance, sizes, mesh.support, mesh.even)


def verify(optimum: Optimum, *, cache: str | Path | bool | None = True) -> Verified:
    """Evaluates an optimum again with the finite-element structure on the same mesh, in the same cases.

    A search finds the best design of its model: what it claims below the accuracy of the model is not there. It takes
    seconds for the tables of the gears when they are new, and then milliseconds.

    Args:
        optimum: of any method; of a front, its compromise.
        cache: as in `finite_element_compliance`.

    Raises:
        ValueError: as `structure_for`.
    """
    flanks = optimum.pinion, optimum.wheel
    second = verification(optimum.mesh, structure_for(optimum.mesh, cache=cache), optimum.problem)
    claimed = {} if optimum.problem is None else judged(optimum.problem, *flanks)
    return second(optimum.cycle, claimed, *flanks)


def _ppte(cycle: MeshCycle) -> float:
    return float(np.ptp(np.asarray(cycle.transmission_error))) if solved(cycle) else float("inf")
