"""Full factorial: what a designer's table of variants does."""

from collections.abc import Mapping

import equinox as eqx
import numpy as np

from ..numerics import whole
from ..sweeps import FullFactorial
from .evaluate import scores
from .problem import Problem
from .search import AbstractMethod, Record
from .starts import real_points

_LEVELS = 5
_MOST_DESIGNS = 10**7
_CHUNK = 2048  # designs between two looks


class Factorial(AbstractMethod):
    """Every combination of equally spaced levels of every parameter, bounds included.

    Attributes:
        levels: how many per parameter: one number, or one by the name of every parameter.
    """

    levels: int | tuple[tuple[str, int], ...] = eqx.field(static=True, default=_LEVELS)

    def __post_init__(self):
        if isinstance(self.levels, Mapping):
            self.levels = tuple(self.levels.items())

    def __check_init__(self):
        for value in [self.levels] if isinstance(self.levels, int) else dict(self.levels).values():
            whole("Factorial", "levels", value, 2)

    @property
    def name(self) -> str:
        return "factorial"

    def search(self, problem: Problem, record: Record) -> None:
        """Evaluates all."""
        levels = self.levels if isinstance(self.levels, int) else dict(self.levels)
        plan = FullFactorial({name: (0.0, 1.0) for name in problem.names}, levels)
        if plan.size > _MOST_DESIGNS:
            raise ValueError(f"Factorial: {plan.size} designs must be at most {_MOST_DESIGNS}; take fewer levels")
        chunk = min(_CHUNK, plan.size)
        for start in range(0, plan.size, chunk):
            rows = np.asarray(plan.rows(start, min(start + chunk, plan.size)), float)
            padded = np.concatenate([rows, np.repeat(rows[-1:], chunk - len(rows), axis=0)])
            score = scores(problem, real_points(problem, padded))
            record.spend(len(rows))
            count = slice(len(rows))
            record.offer(rows, np.asarray(score.value)[count, 0], np.asarray(score.violation)[count])
            record.look(start + len(rows), plan.size)
