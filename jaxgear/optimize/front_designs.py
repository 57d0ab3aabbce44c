"""The designs that a search for a front has met, and the scalarizations that lead to more of them."""

from collections.abc import Callable

import numpy as np

from ..numerics.pareto import pareto_front
from .goal import counted
from .linear_model import AbstractScalarization, Model
from .refine import seek_limits
from .search import Record

END = 1e-6  # weight of the other objectives at the ends of a front: too small to bend the way there
_SUM = 0.05  # part of the plain sum in the scalarization, which keeps weakly dominated designs away
_NEAR = 0.01  # spans of the front; designs that are nearer to each other in every objective count as one
_SPAN = 1e-3  # least span of an objective over the designs, relative to its ideal


class Chebyshev(AbstractScalarization):
    """Largest weighted distance from the ideal point, in spans of the objectives."""

    part = _SUM

    def __init__(self, weight: np.ndarray, frame: Callable[[], tuple[np.ndarray, np.ndarray]]):
        self._weight, self._frame = weight, frame

    def scales(self) -> tuple[np.ndarray, np.ndarray]:
        """Factor and offset of every objective."""
        low, span = self._frame()
        factor = self._weight / span
        return factor, -factor * low


class Met:
    """Designs met so far that keep the constraints and that no other one beats."""

    def __init__(self, record: Record, frame: tuple[np.ndarray, np.ndarray] | None = None):
        objectives = len(record.problem.objectives)
        self.record = record
        self._points = np.empty((0, len(record.problem.names)))
        self._values = np.empty((0, objectives))
        self._new: list[tuple[np.ndarray, np.ndarray]] = []
        self._low: np.ndarray = np.zeros(objectives) if frame is None else frame[0]
        self._span: np.ndarray = np.ones(objectives) if frame is None else frame[1]
        self._worst = np.full(objectives, -np.inf)

    @property
    def found(self) -> bool:
        """Whether there are any."""
        return len(self._values) > 0

    def spend(self, designs: int, *, analyses: int) -> None:
        """Counts contact analyses."""
        self.record.spend(designs, analyses=analyses)

    def take(self, point: np.ndarray, model: Model) -> None:
        """Keeps a design until the next look."""
        if np.isfinite(model.values).all() and not counted(model.violation):
            self._new.append((point, model.values))

    def look(self, step: int, steps: int) -> None:
        """Sorts out what is new; ideal and span stay the same in between, so that steps can be compared."""
        if self._new:
            points, values = (np.stack(part) for part in zip(*self._new))
            self._new = []
            self._worst = np.maximum(self._worst, values.max(axis=0))
            points, values = np.concatenate([self._points, points]), np.concatenate([self._values, values])
            best = pareto_front(values)
            self._points, self._values = points[best], values[best]
            self._low = self._values.min(axis=0)
            # as long as one design beats all others, the front has no span of its own
            high = self._values.max(axis=0) if len(self._values) > len(self._low) else self._worst
            self._span = np.maximum(high - self._low, _SPAN * np.maximum(np.abs(self._low), 1.0))
        self.record.report(step, steps, self.compromise()[1])

    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """Ideal point, and the span of the objectives."""
        return self._low, self._span

    def weight(self, values: np.ndarray) -> np.ndarray:
        """The weight by whose largest distance from the ideal point a design of these objectives is sought."""
        weight = 1 / np.maximum((values - self._low) / self._span, END)
        return weight / weight.sum()

    def best(self, way: Chebyshev) -> np.ndarray:
        """The design of the least distance."""
        return self._points[way.join(self._values).argmin()]

    def compromise(self) -> tuple[np.ndarray, float]:
        """The design whose worst distance from the ideal, in spans of the front, is about the least; and that distance.

        The part of the sum decides between designs that hardly differ in the worst.
        """
        if not self.found:
            return np.full(self._points.shape[1], 0.5), np.inf
        best = int(Chebyshev(np.ones_like(self._low), self.frame).join(self._values).argmin())
        return self._points[best], float(((self._values[best] - self._low) / self._span).max())

    def end(self, most: int) -> None:
        """Keeps at most so many designs; where none keeps the limits, one that does is sought before.

        Raises:
            RuntimeError: when no design keeps the constraints.
        """
        if not self.found and self.record.linearizer is not None:
            seek_limits(self.record.linearizer, self, self.compromise()[0])
        if not self.found:
            raise RuntimeError(
                "pareto: no design that was met keeps the constraints, though one was sought by their violation alone"
            )
        self.thin(most)

    def thin(self, most: int) -> None:
        """Keeps at most so many designs: the best of every objective, the compromise, and ever the farthest from those.

        A design that hardly differs from a kept one goes.
        """
        scaled = (self._values - self._low) / self._span
        compromise = int(np.abs(self._points - self.compromise()[0]).max(axis=1).argmin())
        kept = list(dict.fromkeys([*scaled.argmin(axis=0).tolist(), compromise]))[:most]
        distance = np.stack([np.abs(scaled - scaled[one]).max(axis=1) for one in kept]).min(axis=0)
        while len(kept) < most and distance.max() > _NEAR:
            kept.append(int(distance.argmax()))
            distance = np.minimum(distance, np.abs(scaled - scaled[kept[-1]]).max(axis=1))
        self._points, self._values = self._points[kept], self._values[kept]

    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Points and values, ascending in the first objective; equal designs once."""
        _, order = np.unique(self._values, axis=0, return_index=True)
        return self._points[order], self._values[order]


class Descent(AbstractScalarization):
    """Largest change of the objectives from what they are at a point, in spans of the front."""

    part = 0.0

    def __init__(self, values: np.ndarray, span: np.ndarray):
        self._values, self._span = values, span

    def scales(self) -> tuple[np.ndarray, np.ndarray]:
        """Factor and offset of every objective."""
        return 1 / self._span, -self._values / self._span
