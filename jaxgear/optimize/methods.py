"""The methods of optimization by name."""

from dataclasses import fields

from .evolution import CMAES, DifferentialEvolution, Genetic
from .factorial import Factorial
from .first_order import Adam
from .genetic import BinaryGenetic
from .quasi_newton import LBFGS
from .search import AbstractMethod
from .slp import SLP

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
            raise ValueError(f"minimize: {min(given)} must be given to the method, {type(method).__name__}(...)")
        return method
    if method not in METHODS:
        raise ValueError(f'minimize: method "{method}" is not known, must be one of {", ".join(METHODS)}')
    make = METHODS[method]
    options = {field.name for field in fields(make)}
    for name in given:
        if name not in options:
            raise ValueError(f'minimize: {name} has no effect with method "{method}"')
    return make(**given, **({"seed": seed} if "seed" in options else {}))
