"""Full factorial: what a designer's table of variants does."""

from collections.abc import Mapping
from typing import ClassVar

import equinox as eqx

from ..numerics import whole
from ..sweeps import FullFactorial
from .problem import Problem
from .search import AbstractMethod, Record

_LEVELS = 5
_MOST_DESIGNS = 10**7
_CHUNK = 2048  # designs between two looks


class Factorial(AbstractMethod):
    """Every combination of equally spaced levels of every parameter, bounds included.

    Attributes:
        levels: how many per parameter: one number, or one by the name of every parameter.
    """

    name: ClassVar[str] = "factorial"
    levels: int | tuple[tuple[str, int], ...] = eqx.field(static=True, default=_LEVELS)

    def __post_init__(self):
        if isinstance(self.levels, Mapping):
            self.levels = tuple(self.levels.items())

    def __check_init__(self):
        for value in [self.levels] if isinstance(self.levels, int) else dict(self.levels).values():
            whole("Factorial", "levels", value, 2)

    def search(self, problem: Problem, record: Record) -> None:
        """Evaluates all."""
        levels = self.levels if isinstance(self.levels, int) else dict(self.levels)
        plan = FullFactorial({name: (0.0, 1.0) for name in problem.names}, levels)
        if plan.size > _MOST_DESIGNS:
            raise ValueError(f"Factorial: {plan.size} designs must be at most {_MOST_DESIGNS}; take fewer levels")
        chunk = min(_CHUNK, plan.size)
        for start in range(0, plan.size, chunk):
            stop = min(start + chunk, plan.size)
            record.judge(plan.rows(start, stop), chunk)
            record.look(stop, plan.size)
