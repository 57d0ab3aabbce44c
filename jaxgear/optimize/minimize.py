"""The best parameters of a modification, by any method."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import fields
from types import MappingProxyType

from ..conditions import Design
from ..conditions.cases import Loads
from ..contact import Mesh
from ..numerics import AbstractMeasure, Callback
from ..tolerance import Tolerance
from .goal import Constraint, Objective
from .gradient_search import LBFGS, Adam
from .population import CMAES, BinaryGenetic, DifferentialEvolution, Factorial, Genetic
from .problem import make_problem
from .refine import POSITIONS, refined
from .result import Optimum
from .rounding import check_steps
from .search import AbstractMethod, Record
from .slp import SLP
from .verdict import optimum_of

# Known by name, here and in design files, where the fields of a class are its options. A method of your own joins them
# by `METHODS["name"] = Class`.
METHODS: dict[str, type[AbstractMethod]] = {
    "slp": SLP,
    "adam": Adam,
    "lbfgs": LBFGS,
    "genetic": Genetic,
    "binary_genetic": BinaryGenetic,
    "cma_es": CMAES,
    "differential_evolution": DifferentialEvolution,
    "factorial": Factorial,
}


def method_named(
    method: str | AbstractMethod, *, starts: int | None = None, steps: int | None = None, seed: int = 0
) -> AbstractMethod:
    """A method from its name, with the options that it has.

    Raises:
        ValueError: for an unknown name, or starts or steps where they cannot be given.
    """
    given = {name: value for name, value in {"starts": starts, "steps": steps}.items() if value is not None}
    if not isinstance(method, str):
        if given:
            raise ValueError(f"{min(given)} must be given to the method, {type(method).__name__}(...)")
        return method
    if method not in METHODS:
        raise ValueError(f'method "{method}" is not known, must be one of {", ".join(METHODS)}')
    make = METHODS[method]
    options = {field.name for field in fields(make)}
    for name in given:
        if name not in options:
            raise ValueError(f'{name} has no effect with method "{method}"')
    return make(**given, **({"seed": seed} if "seed" in options else {}))


def minimize(
    design: Design,
    bounds: Mapping[str, tuple[float, float]],
    mesh: Mesh,
    torque: Loads,
    *,
    objective: Objective = "ppte",
    measure: AbstractMeasure | None = None,
    constraints: Sequence[Constraint] = (),
    tolerance: Tolerance | None = None,
    samples: int | None = None,
    seed: int = 0,
    method: str | AbstractMethod = "slp",
    starts: int | None = None,
    steps: int | None = None,
    positions: int | None = POSITIONS,
    rounding: Mapping[str, float] = MappingProxyType({}),
    callback: Callback | None = None,
) -> Optimum:
    """Finds the parameters of a modification with the least transmission error, or the best of something else.

    Args:
        design: makes (pinion, wheel) modifications from the named parameters; traced, so it must be pure.
        bounds: (low, high) of every parameter, in the unit that `design` expects.
        mesh: prepared mesh.
        torque: on the pinion [N m], or a `LoadSpectrum`.
        objective: a quantity: its name, a `Quantity`, or a function of a cycle. It is made large where large values are
            the better ones. For several see `pareto`.
        measure: of the objective over torques and manufactured gears: `Mean()`, `Worst()`, `Quantile(level)` or
            `CVaR(level)`; None for the mean.
        constraints: limits that hold in every case.
        tolerance: of manufactured gears, of which `samples` run under every torque; None for nominal gears.
        samples: manufactured gears; None for 64 with a tolerance.
        seed: of their random numbers, and of a method that draws some.
        method: name of one of `METHODS`, such as "slp" (sequential linear programming); or a method with its
            options, such as `SLP(starts=8)`.
        starts: start points of a gradient method that is given by name.
        steps: steps of every start, likewise.
        positions: of the finer mesh on which the search ends and its result is evaluated, at least those of `mesh`. An
            extreme over few positions is fitted to them: the true one lies in between. None to stay on `mesh`.
        rounding: steps of parameters in which the result is wanted, by name and in the unit of their bounds, such as
            `{"amount": 0.5}`: the best design found on multiples of them, see `Optimum.rounding`. Parameters without a
            step, and with 0, keep all digits.
        callback: called as callback(step, steps, best objective) between steps.

    Returns:
        the best design met.

    Raises:
        ValueError: for empty or reversed bounds, unknown names, and whatever the method or the cases refuse.
        RuntimeError: when no design gave a converged contact solution.
    """
    method = method_named(method, starts=starts, steps=steps, seed=seed)
    if not (isinstance(objective, str) or callable(objective)):
        raise ValueError("objective must be one quantity; jaxgear.optimize.pareto finds a front of several")
    began = time.perf_counter()
    rounded_to = check_steps(rounding, bounds)
    posed = make_problem(
        design,
        bounds,
        mesh=mesh,
        torque=torque,
        objective=objective,
        measure=measure,
        constraints=constraints,
        tolerance=tolerance,
        samples=samples,
        seed=seed,
    )
    record = Record(posed, callback)
    method.search(posed, record)
    record.check()
    found = refined(record, method.polish, positions, rounded_to)
    unrounded = found.unrounded if rounded_to else None
    taken = {} if found.record is found.unrounded else rounded_to
    return optimum_of(found.record, method.name, began, found.change, unrounded=unrounded, steps=taken)
