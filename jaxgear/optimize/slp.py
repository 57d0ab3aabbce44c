"""Sequential linear programming for peak-to-peak objectives."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ..numerics.fields import Checked, count, number
from .goal import FEASIBLE
from .linear_model import AbstractScalarization, Linearizer, LinearModel
from .problem import Problem
from .search import AbstractMethod, Record, points_nearby, start_points

# Reach of the start points of a later round about the best design, in the unit box. The kinks of PPTE make many shallow
# local optima close together; on the 19/48 pair they lie within a tenth of the range.
_NEARBY = 0.1
_POLISHED, _BESIDE = 4, 0.03  # searches on the finer mesh, and their reach about the design
_FIRST_RADIUS = 0.25  # of a step in the unit box
_LEAST_RADIUS = 1e-5
_ACCEPT, _POOR, _GOOD = 0.05, 0.25, 0.75  # actual over predicted decrease
_SHRINK, _GROW = 0.35, 2.0


class SLP(Checked, AbstractMethod):
    """Trust-region sequential linear programming from many start points, then again from around the best design.

    Each step solves a linear program in which every position of the transmission error is linear and the extremes are
    exact; see `linear_model`. It converges at the kinks where other gradient methods stall: a few dozen contact
    analyses find a local optimum to many digits. It is local: of several optima it finds those near its starts, and
    each round looks for a better one beside the best.

    Attributes:
        starts: searches that advance together.
        rounds: rounds of so many searches; the first starts all over the box, each further one around the best design.
        steps: most steps of every search.
        rtol: a search ends where the predicted decrease is below this part of the objective.
    """

    starts: int = count(high=4096, default=16)
    rounds: int = count(high=1000, default=2)
    steps: int = count(high=100_000, default=40)
    rtol: float = number("", low=0.0, high=1.0, open_low=True, open_high=True, static=True, default=1e-4)

    @property
    def name(self) -> str:
        return "slp"

    def search(self, problem: Problem, record: Record) -> None:
        """Advances all searches of a round until none finds a better step."""
        points = start_points(problem, self.starts)
        record.linearizer = Linearizer(problem, self.starts)
        for round_ in range(self.rounds):
            if round_:
                points = points_nearby(record.point, self.starts, reach=_NEARBY, seed=round_)
            follow(
                record.linearizer,
                record,
                [Search(point) for point in points],
                steps=self.steps,
                rtol=self.rtol,
                round_of=(round_, self.rounds),
            )

    def polish(self, problem: Problem, record: Record, point: np.ndarray) -> None:
        """Searches again from the design and from a few points beside it."""
        linearizer = record.linearizer or Linearizer(problem, _POLISHED)
        beside = points_nearby(point, _POLISHED - 1, reach=_BESIDE, seed=0)
        follow(linearizer, record, [Search(start) for start in (point, *beside)], steps=self.steps, rtol=self.rtol)


class Ledger(Protocol):
    """Interface to the record of a search, such as `Record`."""

    def spend(self, designs: int, *, analyses: int) -> None:
        """Counts contact analyses."""

    def take(self, point: np.ndarray, model: LinearModel) -> None:
        """Takes a design with its linearization."""

    def look(self, step: int, steps: int) -> None:
        """Marks the progress before a step."""


class Search:
    """One search: where it is, and how far it trusts its model.

    Args:
        point: of the unit box, where it starts.
        scalarization: of several objectives.
    """

    def __init__(self, point: np.ndarray, scalarization: AbstractScalarization | None = None) -> None:
        self.trial, self.scalarization = point, scalarization
        self._point = point
        self._model: LinearModel | None = None
        self._radius, self._predicted = _FIRST_RADIUS, 0.0
        self._ended: float | None = None  # at this tolerance, where it stands: its program need not be solved again

    @property
    def penalty(self) -> float | None:
        """Penalty factor of a relative violation, constant over the search; None before its first point."""
        return None if self._model is None else self._model.penalty

    def propose(self, rtol: float) -> bool:
        """Finds the next trial point; False when the search has ended."""
        if self._model is None or self._radius < _LEAST_RADIUS or self._ended == rtol:
            return False
        step, self._predicted = self._model.best_step(self._radius)
        self.trial = self._point + step
        # a decrease of the violation below the tolerance on it is not worth a step either
        moves = self._predicted > rtol * max(abs(self._model.value), FEASIBLE * self._model.penalty)
        self._ended = None if moves else rtol
        return moves

    def take(self, model: LinearModel) -> None:
        """Goes to the trial point if it is as good as its model says, and adapts the radius."""
        if self._model is None:
            self._model = model if model.fine else None
            return
        gain = (self._model.merit - model.merit) / self._predicted if model.fine else -1.0
        length = float(np.abs(self.trial - self._point).max())
        if gain < _POOR:
            self._radius = _SHRINK * length
        elif gain > _GOOD:
            self._radius = min(_GROW * self._radius, 1.0)
        if gain > _ACCEPT:
            self._point, self._model = self.trial, model


def follow(
    linearizer: Linearizer,
    ledger: Ledger,
    searches: Sequence[Search],
    *,
    steps: int,
    rtol: float,
    round_of: tuple[int, int] = (0, 1),
) -> None:
    """Advances searches until none finds a better step; `round_of` tells the progress which round of how many it is."""
    done, rounds = round_of
    _linearize(linearizer, ledger, searches)
    for step in range(steps):
        ledger.look(done * steps + step, rounds * steps)
        moving = [search for search in searches if search.propose(rtol)]
        if not moving:
            break
        _linearize(linearizer, ledger, moving)
    ledger.look((done + 1) * steps, rounds * steps)


def _linearize(linearizer: Linearizer, ledger: Ledger, searches: Sequence[Search]) -> None:
    """Linearizes at the points that the searches propose."""
    problem = linearizer.problem
    ledger.spend(len(searches), analyses=problem.gradient_cost)
    for search, found in zip(searches, linearizer(np.stack([search.trial for search in searches]))):
        model = LinearModel(problem, search.trial, found, search.scalarization, search.penalty)
        ledger.take(search.trial, model)
        search.take(model)
