"""What is said about the best design of a search."""

import time
from collections.abc import Sequence
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from ..conditions import in_words, solve_case, solved
from ..contact import OperatingPoint
from ..microgeometry import AbstractModification
from ..numerics import program
from .goal import FEASIBLE, Constraint
from .linear_model import Model
from .linearizer import Linearizer
from .problem import Problem
from .result import PENALIZED, Limit, Optimum
from .search import Record

_AT_BOUND = 1e-6  # a parameter this close to a bound, relative to its range, is at the bound
PROBE = 1e-3  # step over which the decrease that is left is measured, relative to the ranges


def optimum_of(
    record: Record, method: str, began: float, grid_change: float = float("nan"), *, left: float | None = None
) -> Optimum:
    """The best design of a record with all that is said about it.

    Args:
        record: of the search.
        method: its name.
        began: when the search began, as `time.perf_counter` tells.
        grid_change: of the objective at twice the positions.
        left: decrease that is left, where it is known.
    """
    problem = record.problem
    x = np.asarray(record.point, np.dtype(problem.low.dtype))
    parameters, (pinion, wheel) = problem.parameters(x), problem.modifications(x)
    heaviest = np.asarray(problem.cases.torque)[np.asarray(problem.cases.weight).argmax()]
    cycle = solve_case(problem.mesh, heaviest, pinion, wheel)
    left = _optimality(record) if left is None else left  # before the analyses are counted
    several = len(problem.objectives) > 1
    sign = 1 if several else problem.objectives[0].sign
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
        constraints=_limits(problem, x),
        violation=max(record.violation - FEASIBLE, 0.0),  # as an excess is counted from inside a limit
        evaluations=record.evaluations,
        history=sign * np.asarray([value for _, value, _ in record.history]),
        history_evaluations=np.asarray([spent for spent, _, _ in record.history]),
        history_positions=np.asarray([positions for _, _, positions in record.history], int),
        seconds=time.perf_counter() - began,
        problem=problem,
    )


def _optimality(record: Record) -> float:
    """Fastest decrease of the objective at the best point, per step of the full range of every parameter."""
    model = record.model
    if model is None:
        problem = record.problem
        record.spend(1, analyses=problem.gradient_cost)
        (found,) = Linearizer(problem, 1)(record.point[None])
        model = Model(problem, record.point, found)
    return model.optimality(PROBE)


def objective_name(problem: Problem) -> str:
    """What is minimized, in words."""
    names = [of.name for of in problem.objectives]
    if len(names) > 1:
        return f"distance from the ideal of {' and '.join(names)}"
    return _over_cases(problem) + names[0] + (PENALIZED if problem.roughness is not None else "")


def judged(
    problem: Problem, pinion: AbstractModification | None = None, wheel: AbstractModification | None = None
) -> dict[str, float]:
    """What any modifications are worth in a problem: its objectives, by name and unit as "95 % CVaR of ppte [um]".

    They are joined by its measure over its cases; infinite where a contact solution failed. No penalty is added.
    """
    cases = problem.cases
    if cases.count == 1 and cases.removed is None:  # the program that solves the one case serves every modification
        speed = None if cases.speed is None else np.asarray(cases.speed)[0]
        cycle = solve_case(
            problem.mesh, OperatingPoint(np.asarray(cases.torque)[0], speed, cases.friction), pinion, wheel
        )
        if all(of.local for of in problem.objectives):  # they know nothing of the flanks but what is removed
            cycle = replace(cycle, pinion=None, wheel=None)
        else:
            cycle = cycle.on(problem.mesh)
        values = np.asarray(_of_one(problem.objectives, cycle))
    else:
        values = np.asarray(_score_of(problem, pinion, wheel).value)
    names = (f"{_over_cases(problem)}{of.named}" for of in problem.objectives)
    return {name: of.sign * float(value) for name, of, value in zip(names, problem.objectives, values)}


def _over_cases(problem: Problem) -> str:
    return f"{in_words(problem.measure)} " if problem.cases.count > 1 else ""


@program
def _of_one(objectives, cycle):
    values = jnp.stack([of.sign * of(cycle) for of in objectives])
    return jnp.where(solved(cycle) & jnp.all(jnp.isfinite(values)), values, jnp.inf)


@program
def _score_of(problem: Problem, pinion, wheel):
    return problem.score_of(pinion, wheel)


def _limits(problem: Problem, x) -> dict[str, Limit]:
    if not problem.constraints:
        return {}
    named: dict[str, Limit] = {}
    for constraint, values in zip(problem.constraints, _constrained(problem, x)):
        worst = max(np.asarray(values), key=lambda value: _excess(constraint, value))
        name, repeated = constraint.name, 2
        while name in named:
            name, repeated = f"{constraint.name} ({repeated})", repeated + 1
        low, high = (None if limit is None else float(limit) for limit in (constraint.low, constraint.high))
        named[name] = Limit(float(worst), low, high, constraint.unit, _excess(constraint, worst) <= FEASIBLE)
    return named


def _excess(constraint: Constraint, value) -> float:
    return float(max(constraint.excess(jnp.asarray(value))))


def _constrained(problem: Problem, x) -> Sequence[np.ndarray]:
    """Values of every constraint, cases leading."""
    parameters = problem.parameters(x)
    of_cycle = iter(_numbers(problem, x) if any(limit.quantity for limit in problem.constraints) else ())
    return [
        np.atleast_1d(limit.of_parameters(parameters) if limit.quantity is None else next(of_cycle))
        for limit in problem.constraints
    ]


@program
def _numbers(problem: Problem, x):
    wanted = [limit.quantity for limit in problem.constraints if limit.quantity is not None]
    return problem.over_cases(x, lambda cycle: [of(cycle) for of in wanted])


def _active_bounds(names, x) -> dict[str, str]:
    active = {}
    for name, value in zip(names, x):
        if value <= _AT_BOUND:
            active[name] = "lower"
        elif value >= 1 - _AT_BOUND:
            active[name] = "upper"
    return active
