"""The best parameters of a modification, by any method."""

import time
from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..conditions import Variants, check_used, conditions, in_words
from ..contact import Mesh, removed_material, solve_removed
from ..metrics import peak_to_peak
from ..numerics import AbstractMeasure, Mean
from ..tolerance import Tolerance
from .goal import Constraint, Number, name_of
from .linear_model import Model
from .methods import method_named
from .problem import Design, Problem, make_problem
from .result import PENALIZED, Front, Optimum
from .search import AbstractMethod, Callback, Record
from .starts import real_points

_AT_BOUND = 1e-6  # a parameter this close to a bound, relative to its range, is at the bound
_PROBE = 1e-3  # step over which the decrease that is left is measured, relative to the ranges


def minimize(
    design: Design,
    bounds: Mapping[str, tuple[float, float]],
    *,
    mesh: Mesh,
    torque,
    objective: str | Number | Sequence[str | Number] = "ppte",
    measure: AbstractMeasure | None = None,
    constraints: Sequence[Constraint] = (),
    tolerance: Tolerance | None = None,
    samples: int | None = None,
    seed: int = 0,
    method: str | AbstractMethod = "minimax",
    starts: int | None = None,
    steps: int | None = None,
    callback: Callback | None = None,
) -> Optimum:
    """Finds the parameters of a modification with the least transmission error, or the least of something else.

    Args:
        design: makes (pinion, wheel) modifications from the named parameters; traced, so it must be pure.
        bounds: (low, high) of every parameter, in the unit that `design` expects.
        mesh: prepared mesh.
        torque: on the pinion [N m], or a `LoadSpectrum`.
        objective: name of a result or of "max_relief", "relief_reversal", "removed_volume"; or a function of a
            `Candidate`. Several, for a Pareto front, with method "pareto".
        measure: of the objective over torques and manufactured gears: `Mean()`, `Worst()`, `Quantile(level)` or
            `CVaR(level)`; None for the mean.
        constraints: limits that hold in every case.
        tolerance: of manufactured gears, of which `samples` run under every torque; None for perfect gears.
        samples: manufactured gears; None for 64 with a tolerance.
        seed: of their random numbers, and of a method that draws some.
        method: "minimax" (sequential linear programming), "adam", "lbfgs", "genetic", "cma_es",
            "differential_evolution", "factorial" or "pareto"; or one with its options, such as `Minimax(starts=8)`.
        starts: start points of a gradient method that is given by name.
        steps: steps of every start, likewise.
        callback: called as callback(step, steps, best objective) between steps.

    Returns:
        the best design met.

    Raises:
        ValueError: for empty or reversed bounds, unknown names, and whatever the method or the cases refuse.
        RuntimeError: when no design gave a converged contact solution.
    """
    method = method_named(method, starts=starts, steps=steps, seed=seed)
    objectives = (objective,) if isinstance(objective, str) or callable(objective) else tuple(objective)
    if (len(objectives) > 1) != (method.name == "pareto"):
        raise ValueError(
            f"minimize: {len(objectives)} objectives with method {method.name!r}: a Pareto front takes several and is "
            'found by method "pareto", the others take one'
        )
    judged = conditions("minimize", mesh, torque, tolerance=tolerance, samples=samples, seed=seed)
    measure = Mean() if measure is None else measure
    problem = make_problem(design, bounds, mesh, judged.on(mesh), objectives, measure, constraints)
    made = Variants(problem.names, design, mesh, None, judged, problem.cases)
    check_used("minimize", problem.names, made.traced(problem.low)[1])
    began = time.perf_counter()
    record = Record(problem, callback)
    front = method.search(problem, record)
    return optimum_of(problem, record, method.name, began, front)


def optimum_of(problem: Problem, record: Record, method: str, began: float, front: Front | None = None) -> Optimum:
    """The best design of a record with all that is said about it.

    Raises:
        RuntimeError: when the record is empty.
    """
    if not np.isfinite(record.value):
        raise RuntimeError("minimize: no design within the bounds gave a converged contact solution")
    x = real_points(problem, record.point)
    parameters, (pinion, wheel) = problem.parameters(x), problem.modifications(x)
    heaviest = problem.cases.torque[int(np.argmax(problem.cases.weight))]
    # the removed material as an array: the program that solves for it is the one that every other design uses
    removed = removed_material(problem.mesh, heaviest, pinion=pinion, wheel=wheel)
    cycle = solve_removed(problem.mesh, heaviest, removed, pinion=pinion, wheel=wheel)
    left = float("nan") if front is not None else _decrease_left(problem, record)
    return Optimum(
        method=method,
        objective_name=objective_name(problem),
        parameters={name: float(value) for name, value in parameters.items()},
        pinion=pinion,
        wheel=wheel,
        mesh=problem.mesh,
        cycle=cycle,
        ppte=float(peak_to_peak(cycle.transmission_error)),
        objective=record.value,
        gradient_norm=left,
        active_bounds=_active_bounds(problem.names, record.point),
        constraints=_constraint_values(problem, x),
        violation=record.violation,
        evaluations=record.evaluations,
        history=np.asarray([value for _, value in record.history]),
        history_evaluations=np.asarray([spent for spent, _ in record.history]),
        seconds=time.perf_counter() - began,
        front=front,
    )


def _decrease_left(problem: Problem, record: Record) -> float:
    """Fastest decrease of the objective at the best point, per step of the full range of every parameter."""
    model = record.model
    if model is None:
        record.spend(1, analyses=problem.gradient_cost)
        found = jax.tree.map(np.asarray, _linearization(problem, real_points(problem, record.point)))
        model = Model(problem, record.point, found)
    return model.decrease_left(_PROBE)


def objective_name(problem: Problem) -> str:
    """What is minimized, in words."""
    names = [name_of(of) for of in problem.objectives]
    if len(names) > 1:
        return f"distance from the ideal of {' and '.join(names)}"
    prefix = ""
    if problem.cases.count > 1:
        prefix = in_words(problem.measure) + " "
    return prefix + names[0] + (PENALIZED if problem.roughness is not None else "")


def _constraint_values(problem: Problem, x) -> dict[str, float]:
    if not problem.constraints:
        return {}
    values = np.asarray(_numbers(problem, x))
    named = {}
    for index, constraint in enumerate(problem.constraints):
        worst = max(values[:, index], key=lambda value: float(max(constraint.excess(jnp.asarray(value)))))
        name, repeated = constraint.name, 2
        while name in named:
            name, repeated = f"{constraint.name} ({repeated})", repeated + 1
        named[name] = float(worst)
    return named


@eqx.filter_jit
def _numbers(problem: Problem, x):
    def of_case(candidate):
        return jnp.stack([constraint.value(candidate) for constraint in problem.constraints])

    return problem.over_cases(x, of_case)


@eqx.filter_jit
def _linearization(problem: Problem, x):
    return problem.linearize(x)


def _active_bounds(names, x) -> dict[str, str]:
    active = {}
    for name, value in zip(names, x):
        if value <= _AT_BOUND:
            active[name] = "lower"
        elif value >= 1 - _AT_BOUND:
            active[name] = "upper"
    return active
