"""Steps of sequential linear programming for peak-to-peak objectives."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from .goal import FEASIBLE
from .linear_model import AbstractScalarization, Linearizer, LinearModel

_FIRST_RADIUS = 0.25  # of a step in the unit box
_LEAST_RADIUS = 1e-5
_ACCEPT, _POOR, _GOOD = 0.05, 0.25, 0.75  # actual over predicted decrease
_SHRINK, _GROW = 0.35, 2.0


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
