"""Search for the best variables of a design, by any method."""

from collections.abc import Mapping
from types import MappingProxyType

from ..numerics import Callback
from .free_form import FreeForm
from .iteration import TransmissionErrorIteration
from .method import SLP, AbstractMethod
from .other_methods import CMAES, LBFGS, Adam, DifferentialEvolution, Factorial, Genetic
from .problem import Problem
from .refine import POSITIONS
from .result import Optimum

# Methods by name, also for design files, where the fields of a class are its options. Add a method of your own by
# `METHODS["name"] = Class`.
METHODS: dict[str, type[AbstractMethod]] = {
    "slp": SLP,
    "adam": Adam,
    "lbfgs": LBFGS,
    "genetic": Genetic,
    "cma_es": CMAES,
    "differential_evolution": DifferentialEvolution,
    "factorial": Factorial,
    "te_iteration": TransmissionErrorIteration,
    "free_form": FreeForm,
}


def minimize(
    problem: Problem,
    method: str | AbstractMethod = "slp",
    *,
    positions: int | None = POSITIONS,
    rounding: Mapping[str, float] = MappingProxyType({}),
    callback: Callback | None = None,
) -> Optimum:
    """Find the variables of the best design of a problem.

    Args:
        problem: mesh, loads, design, bounds and objective.
        method: name of one of `METHODS`, such as "slp" (sequential linear programming); or a method with its
            options, such as `SLP(starts=8)`.
        positions: number of positions of the finer mesh on which the search ends and its result is evaluated, at least
            the number of the mesh. An optimum on few positions fits these positions, and larger extremes lie between
            them. None to stay on the mesh.
        rounding: steps to which variables are rounded, by name and in the unit of their bounds, such as
            `{"amount": 0.5}`: the result is the best design found on multiples of the steps, see `Optimum.rounding`.
            Variables without a step, or with a step of 0, keep all digits.
        callback: called as callback(step, steps, best objective) between steps.

    Returns:
        the best design found.

    Raises:
        ValueError: for an unknown method, several objectives, and problems that the method does not accept.
        RuntimeError: if no design has a converged contact solution.
    """
    if isinstance(method, str):
        if method not in METHODS:
            raise ValueError(f'method "{method}" is not known, must be one of {", ".join(METHODS)}')
        method = METHODS[method]()
    if len(problem.objectives) > 1:
        raise ValueError("objective must be one quantity; jaxgear.optimize.pareto finds a front of several")
    return method.find(problem, positions=positions, rounding=rounding, callback=callback)
