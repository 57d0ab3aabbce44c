"""Rounding of an optimum to steps that can be manufactured."""

from collections.abc import Callable, Iterable, Mapping
from itertools import combinations, product

import numpy as np

from ..numerics import changed, check, real
from .linear_model import LinearModel
from .problem import Problem
from .search import Record

_DIGITS = 12  # behind the decimal point, to which a multiple of a step is the nearest decimal number
_SLACK = 1e-9  # of a step: a bound that is a multiple of it counts as one
_CORNERS = 64  # most grid points around an optimum that are all evaluated
_PAIRS = 8  # most variables of which two are moved at once
_ROUNDS = 20  # most moves to a better neighbour
_AT_ONCE = 32  # designs judged together where no program linearizes them

Polish = Callable[[Problem, Record, np.ndarray], None]
Cell = tuple[int, ...]  # of the grid: a multiple of every step


def check_steps(steps: Mapping[str, float], bounds: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Checked steps of the rounded variables, without steps of 0.

    Raises:
        ValueError: for an unknown variable, a negative step, and a step without a multiple within the bounds.
    """
    for name, step in steps.items():
        if name not in bounds:
            raise ValueError(f'"{name}" of rounding must be one of {", ".join(bounds)}')
        check(f"rounding of {name}", real(step), "", low=0.0)
        low, high = bounds[name]
        if step and not multiples(step, low, high):
            raise ValueError(
                f"rounding of {name} = {step:g} has no multiple from {low:g} to {high:g}; give a smaller step "
                "or 0 for none"
            )
    return {name: float(step) for name, step in steps.items() if step}


def multiples(step: float, low: float, high: float) -> range:
    """Range of whole numbers whose product with a step lies within bounds."""
    return range(int(np.ceil(low / step - _SLACK)), int(np.floor(high / step + _SLACK)) + 1)


def on_step(value: float, step: float) -> float:
    """Multiple of a step nearest to a value."""
    return round(round(value / step) * step, _DIGITS)


def rounded(record: Record, steps: Mapping[str, float], polish: Polish) -> Record:
    """Record of the best rounded design near the best design of a record, by the objective and limits of the search.

    All grid points around the optimum are evaluated; with many variables only the nearest one. From the best of them
    the search moves to the best neighbour, by one step of one or two variables, as long as the objective improves.
    After every move the variables without a step are optimized again.

    Args:
        record: record at the end of a search.
        steps: steps of the rounded variables from `check_steps`.
        polish: function that continues a search from a point.
    """
    found, grid = Record(record.problem, None), _Grid(record.problem, steps)
    found.evaluations, found.history, found.linearizer = record.evaluations, record.history, record.linearizer
    seen: set[Cell] = set()

    def visit(cells: Iterable[Cell], beside: np.ndarray) -> bool:
        """True if one of the new points is better than all before."""
        new = [cell for cell in dict.fromkeys(cells) if cell not in seen]
        seen.update(new)
        before = found.violation, found.value
        if new:
            _judge(found, np.stack([grid.point(cell, beside) for cell in new]))
        return (found.violation, found.value) != before

    visit(grid.around(record.point), record.point)
    for _ in range(_ROUNDS):
        _search_free(found, grid, polish)
        if not visit(grid.neighbours(found.point), found.point):
            break
    record.evaluations = found.evaluations
    return found


class _Grid:
    """Grid of the multiples of the steps within the bounds, in the unit box."""

    def __init__(self, problem: Problem, steps: Mapping[str, float]) -> None:
        low, high = np.asarray(problem.low, float), np.asarray(problem.high, float)
        self.columns = [problem.names.index(name) for name in steps]
        self._step = np.asarray([*steps.values()])
        self._low, self._range = low[self.columns], (high - low)[self.columns]
        self._allowed = [multiples(step, *ends) for step, *ends in zip(self._step, self._low, high[self.columns])]

    def values(self, cell: Cell) -> np.ndarray:
        """Values of the rounded variables."""
        return np.asarray([on_step(number * step, step) for number, step in zip(cell, self._step)])

    def point(self, cell: Cell, beside: np.ndarray) -> np.ndarray:
        """Point of the unit box with rounded variables from a grid cell and the others from the point `beside`."""
        point = np.array(beside, float)
        point[self.columns] = np.clip((self.values(cell) - self._low) / self._range, 0.0, 1.0)
        return point

    def around(self, point: np.ndarray) -> Iterable[Cell]:
        """Grid points around a point; only the nearest one if there are many."""
        place = self._place(point)
        sides = [sorted({self._inside(i, int(side(at))) for side in (np.floor, np.ceil)}) for i, at in enumerate(place)]
        return product(*sides) if np.prod([len(side) for side in sides]) <= _CORNERS else [self.cell(point)]

    def cell(self, point: np.ndarray) -> Cell:
        """Grid point nearest to a point."""
        return tuple(self._inside(i, round(at)) for i, at in enumerate(self._place(point)))

    def neighbours(self, point: np.ndarray) -> Iterable[Cell]:
        """Grid points that differ by a step in one variable, or in two if the variables are few."""
        cell, count = np.asarray(self.cell(point)), len(self.columns)
        together = (1, 2) if count <= _PAIRS else (1,)
        for moved in (each for size in together for each in combinations(range(count), size)):
            for signs in product((-1, 1), repeat=len(moved)):
                other = cell.copy()
                other[list(moved)] += signs
                if all(other[i] in self._allowed[i] for i in moved):
                    yield tuple(other.tolist())

    def _place(self, point: np.ndarray) -> np.ndarray:
        return (self._low + point[self.columns] * self._range) / self._step

    def _inside(self, column: int, number: int) -> int:
        allowed = self._allowed[column]
        return min(max(number, allowed[0]), allowed[-1])


def _judge(record: Record, points: np.ndarray) -> None:
    """Evaluate designs with the compiled program of the search and offer them to the record."""
    if record.linearizer is None:
        record.judge(points, _AT_ONCE)
        return
    record.spend(len(points), analyses=record.problem.gradient_cost)
    batch = record.linearizer.batch
    for some in (points[first : first + batch] for first in range(0, len(points), batch)):
        for point, linearization in zip(some, record.linearizer(some)):
            record.take(point, LinearModel(record.problem, point, linearization))


def _search_free(record: Record, grid: _Grid, polish: Polish) -> None:
    """Continue the search in the variables without a step."""
    problem = record.problem
    if len(grid.columns) == len(problem.names):
        return
    low, high = np.array(problem.low), np.array(problem.high)
    low[grid.columns] = high[grid.columns] = grid.values(grid.cell(record.point))
    fixed = record.on(changed(problem, low=real(low), high=real(high)))
    fixed.history = []
    polish(fixed.problem, fixed, record.point)
    record.evaluations = fixed.evaluations
    point = grid.point(grid.cell(record.point), fixed.point)
    record.offer(point, fixed.value, fixed.violation)
