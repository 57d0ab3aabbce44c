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
        """Count contact analyses."""

    def take(self, point: np.ndarray, model: LinearModel) -> None:
        """Take a design with its linear model."""

    def look(self, step: int, steps: int) -> None:
        """Report the progress before a step."""


class Search:
    """State of one search: its point, linear model and trust radius.

    Args:
        point: start point in the unit box, shape (parameters,).
        scalarization: scalarization of several objectives; None for a single one.
    """

    def __init__(self, point: np.ndarray, scalarization: AbstractScalarization | None = None) -> None:
        self.trial, self.scalarization = point, scalarization
        self._point = point
        self._model: LinearModel | None = None
        self._radius, self._predicted = _FIRST_RADIUS, 0.0
        self._ended: float | None = None  # tolerance at which the search has ended

    @property
    def penalty(self) -> float | None:
        """Penalty factor of a relative violation, constant over the search; None before its first point."""
        return None if self._model is None else self._model.penalty

    def propose(self, rtol: float) -> bool:
        """Find the next trial point; False if the search has ended."""
        if self._model is None or self._radius < _LEAST_RADIUS or self._ended == rtol:
            return False
        step, self._predicted = self._model.best_step(self._radius)
        self.trial = self._point + step
        # a decrease of the violation below the tolerance on it is not worth a step either
        moves = self._predicted > rtol * max(abs(self._model.value), FEASIBLE * self._model.penalty)
        self._ended = None if moves else rtol
        return moves

    def take(self, model: LinearModel) -> None:
        """Accept or reject the trial point by actual over predicted decrease, and adapt the trust radius."""
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
    """Advance searches until none finds a better step; `round_of` is (index, number) of the round, for the progress."""
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
    """Linearize at the points that the searches propose."""
    problem = linearizer.problem
    ledger.spend(len(searches), analyses=problem.gradient_cost)
    for search, found in zip(searches, linearizer(np.stack([search.trial for search in searches]))):
        model = LinearModel(problem, search.trial, found, search.scalarization, search.penalty)
        ledger.take(search.trial, model)
        search.take(model)
