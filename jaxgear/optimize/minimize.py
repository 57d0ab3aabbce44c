"""Search for the best variables of a design, by any method."""

from collections.abc import Mapping
from types import MappingProxyType

from ..numerics import Callback
from .free_form import FreeForm
from .gradient_search import LBFGS, Adam
from .iteration import TransmissionErrorIteration
from .method import SLP, AbstractMethod
from .population import CMAES, DifferentialEvolution, Factorial, Genetic
from .problem import Problem
from .refine import POSITIONS
from .result import Optimum

# Known by name, here and in design files, where the fields of a class are its options. A method of your own joins them
# by `METHODS["name"] = Class`.
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
    """Finds the variables of the design with the least transmission error, or the best of something else.

    Args:
        problem: mesh, loads, design, bounds and objective.
        method: name of one of `METHODS`, such as "slp" (sequential linear programming); or a method with its
            options, such as `SLP(starts=8)`.
        positions: of the finer mesh on which the search ends and its result is evaluated, at least those of the mesh.
            An extreme over few positions is fitted to them: the true one lies in between. None to stay on the mesh.
        rounding: steps of variables in which the result is wanted, by name and in the unit of their bounds, such as
            `{"amount": 0.5}`: the best design found on multiples of them, see `Optimum.rounding`. Variables without a
            step, and with 0, keep all digits.
        callback: called as callback(step, steps, best objective) between steps.

    Returns:
        the best design met.

    Raises:
        ValueError: for an unknown method, several objectives, and whatever the method refuses.
        RuntimeError: when no design gave a converged contact solution.
    """
    if isinstance(method, str):
        if method not in METHODS:
            raise ValueError(f'method "{method}" is not known, must be one of {", ".join(METHODS)}')
        method = METHODS[method]()
    if len(problem.objectives) > 1:
        raise ValueError("objective must be one quantity; jaxgear.optimize.pareto finds a front of several")
    return method.find(problem, positions=positions, rounding=rounding, callback=callback)
