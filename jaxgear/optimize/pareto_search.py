"""Pareto fronts of several objectives."""

import time
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from ..contact import Mesh
from ..numerics import Callback, halton
from ..numerics.fields import Checked, count
from ..numerics.pareto import pareto_front
from .goal import counted
from .linear_model import AbstractScalarization, Linearizer, LinearModel
from .problem import Problem
from .refine import POSITIONS, at_more_positions, fine_enough, on_finer_meshes, seek_limits
from .result import Front
from .search import Record, start_points
from .slp import Search, follow
from .verdict import PROBE, optimum_of

END = 1e-6  # weight of the other objectives at the ends of a front: too small to bend the way there
_SUM = 0.05  # part of the plain sum in the scalarization, which keeps weakly dominated designs away
_NEAR = 0.01  # spans of the front; designs that are nearer to each other in every objective count as one
_SPAN = 1e-3  # least span of an objective over the designs, relative to its ideal


class Chebyshev(AbstractScalarization):
    """Scalarization by the largest weighted distance from the ideal point, in spans of the objectives."""

    part = _SUM

    def __init__(self, weight: np.ndarray, frame: Callable[[], tuple[np.ndarray, np.ndarray]]) -> None:
        self._weight, self._frame = weight, frame

    def scales(self) -> tuple[np.ndarray, np.ndarray]:
        """Factor and offset of every objective."""
        low, span = self._frame()
        factor = self._weight / span
        return factor, -factor * low


class _Archive:
    """Non-dominated designs so far that meet the constraints."""

    def __init__(self, record: Record, frame: tuple[np.ndarray, np.ndarray] | None = None) -> None:
        objectives = len(record.problem.objectives)
        self.record = record
        self._points = np.empty((0, len(record.problem.names)))
        self._values = np.empty((0, objectives))
        self._new: list[tuple[np.ndarray, np.ndarray]] = []
        self._low: np.ndarray = np.zeros(objectives) if frame is None else frame[0]
        self._span: np.ndarray = np.ones(objectives) if frame is None else frame[1]
        self._worst = np.full(objectives, -np.inf)
        self._solved = False  # the contact of any design so far

    @property
    def found(self) -> bool:
        """True if any design has been found."""
        return len(self._values) > 0

    def spend(self, designs: int, *, analyses: int) -> None:
        """Count contact analyses of a number of designs."""
        self.record.spend(designs, analyses=analyses)

    def take(self, point: np.ndarray, model: LinearModel) -> None:
        """Store a design until the next `look`, if it has converged and meets the constraints."""
        solved = bool(np.isfinite(model.values).all())
        self._solved |= solved
        if solved and not counted(model.violation):
            self._new.append((point, model.values))

    def look(self, step: int, steps: int) -> None:
        """Merge new designs into the front; ideal and span only change here, so that steps are comparable."""
        if self._new:
            points, values = (np.stack(part) for part in zip(*self._new))
            self._new = []
            self._worst = np.maximum(self._worst, values.max(axis=0))
            points, values = np.concatenate([self._points, points]), np.concatenate([self._values, values])
            best = pareto_front(values)
            self._points, self._values = points[best], values[best]
            self._low = self._values.min(axis=0)
            # while one design dominates all others, the front has no span
            high = self._values.max(axis=0) if len(self._values) > len(self._low) else self._worst
            self._span = np.maximum(high - self._low, _SPAN * np.maximum(np.abs(self._low), 1.0))
        self.record.report(step, steps, self.compromise()[1])

    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """Ideal point and span of the objectives, shape (objectives,) each."""
        return self._low, self._span

    def weight(self, values: np.ndarray) -> np.ndarray:
        """Weights of the Chebyshev scalarization that lead to given objectives, shape (objectives,)."""
        weight = 1 / np.maximum((values - self._low) / self._span, END)
        return weight / weight.sum()

    def best(self, way: Chebyshev) -> np.ndarray:
        """Design with the least scalarized distance, a point of the unit box."""
        return self._points[way.join(self._values).argmin()]

    def compromise(self) -> tuple[np.ndarray, float]:
        """Design with about the least largest distance from the ideal in spans of the front, and that distance.

        The sum of the distances decides between designs of nearly the same largest distance.
        """
        if not self.found:
            return np.full(self._points.shape[1], 0.5), np.inf
        best = int(Chebyshev(np.ones_like(self._low), self.frame).join(self._values).argmin())
        return self._points[best], float(((self._values[best] - self._low) / self._span).max())

    def end(self, most: int) -> None:
        """Reduce the front to at most `most` designs; without any design, first seek one that meets the limits.

        Raises:
            RuntimeError: if no design meets the constraints, or none has a converged contact solution.
        """
        if not self._solved:
            self.record.check()
        if not self.found and self.record.linearizer is not None:
            seek_limits(self.record.linearizer, self, self.compromise()[0])
        if not self.found:
            raise RuntimeError(
                "no evaluated design meets the constraints, also when their violation alone is minimized"
            )
        self.thin(most)

    def thin(self, most: int) -> None:
        """Reduce to at most `most` designs: the best of every objective, the compromise, then repeatedly the farthest.

        Designs within `_NEAR` of a kept design are dropped.
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
        """Points and values without duplicates, ascending in the first objective."""
        _, order = np.unique(self._values, axis=0, return_index=True)
        return self._points[order], self._values[order]


class _Descent(AbstractScalarization):
    """Scalarization by the largest change of the objectives from their values at a point, in spans of the front."""

    part = 0.0

    def __init__(self, values: np.ndarray, span: np.ndarray) -> None:
        self._values, self._span = values, span

    def scales(self) -> tuple[np.ndarray, np.ndarray]:
        """Factor and offset of every objective."""
        return 1 / self._span, -self._values / self._span


_ROUNDS = 3
_POLISH = 3  # steps of every design on a finer mesh
_RTOL = 1e-3  # a search ends where the predicted decrease is below this part of its distance from the ideal


class Pareto(Checked):
    """Pareto front by the augmented Chebyshev scalarization (Steuer and Choo 1983), one weight per design.

    Every design minimizes the largest weighted distance from the ideal point by sequential linear programming as in
    `SLP`; this also reaches concave parts of the front. All designs advance together. Ideal and nadir are updated with
    the designs found. The first round seeks the ends of the front, the best design of each objective, from start points
    all over the box. Further rounds seek designs for evenly spread weights, each from the best design so far for its
    weight. The designs of the front are continued on a finer mesh, each with the weight that leads to it.

    Attributes:
        points: number of designs sought, and the largest number of the front.
        steps: largest number of steps of every design in each round.
    """

    name: ClassVar[str] = "pareto"
    points: int = count(low=2, high=4096, default=32)
    steps: int = count(high=100_000, default=20)

    def search(self, problem: Problem, record: Record) -> "_Archive":
        """Run all rounds; returns at most `points` designs.

        Raises:
            ValueError: for fewer points than objectives.
            RuntimeError: if no design meets the constraints.
        """
        archive, objectives = _Archive(record), len(problem.objectives)
        if self.points < objectives:
            raise ValueError(f"Pareto: points = {self.points} must be at least the number of objectives, {objectives}")
        # in blocks: every other point of the Halton sequence covers half of the box only
        ends = _ends(objectives)[np.arange(self.points) * objectives // self.points]
        spread = _weights(self.points, objectives)
        record.linearizer = Linearizer(problem, self.points)
        points = list(start_points(problem, self.points))
        for number in range(_ROUNDS):
            ways = [Chebyshev(weight, archive.frame) for weight in (spread if number else ends)]
            if number and archive.found:
                points = [archive.best(way) for way in ways]
            searches = [Search(point, way) for point, way in zip(points, ways)]
            follow(record.linearizer, archive, searches, steps=self.steps, rtol=_RTOL, round_of=(number, _ROUNDS))
        archive.end(self.points)
        return archive

    def end_on(self, mesh: Mesh, archive: "_Archive") -> tuple["_Archive", bool]:
        """Continue the designs of a front on a finer mesh; returns them, and True if the mesh is fine enough."""
        record = archive.record.on(archive.record.problem.on(mesh))
        finer = _Archive(record, archive.frame())
        rows = zip(*archive.rows())
        searches = [Search(point, Chebyshev(archive.weight(value), finer.frame)) for point, value in rows]
        linearizer = record.linearizer or Linearizer(record.problem, self.points)
        follow(linearizer, finer, searches, steps=_POLISH, rtol=_RTOL)
        finer.end(self.points)
        points, values = finer.rows()
        at_twice = at_more_positions(record, points)
        return finer, fine_enough(values, np.zeros(len(points)), *at_twice, span=finer.frame()[1])


def pareto(
    problem: Problem,
    method: Pareto = Pareto(),
    *,
    positions: int | None = POSITIONS,
    callback: Callback | None = None,
) -> Front:
    """Find the Pareto front of several objectives: designs that no other design dominates.

    Args:
        problem: mesh, loads, design, bounds and two or more objectives.
        method: number of designs and of steps.
        positions: number of positions of the finer mesh on which the search ends, as for `minimize`.
        callback: called as callback(step, steps, distance of the compromise from the ideal).

    Returns:
        the front, evaluated on the mesh of the compromise, on which the search ends; limits are also met at twice its
        positions.

    Raises:
        ValueError: for fewer than two objectives.
        RuntimeError: if no design meets the constraints.
    """
    if len(problem.objectives) < 2:
        raise ValueError("objective must be at least two quantities; a single one is for jaxgear.minimize")
    began = time.perf_counter()
    archive = method.search(problem, Record(problem, callback))
    if positions is not None:

        def end_on(finer: Mesh) -> tuple[_Archive, bool]:
            nonlocal archive
            archive, enough = method.end_on(finer, archive)
            return archive, enough

        archive = on_finer_meshes(problem.mesh, positions, end_on)
    record = archive.record
    record.offer(*archive.compromise(), 0.0)
    points, values = archive.rows()
    left = _evidence(record, points, values, archive.frame()[1], method.points)
    chosen = int(np.abs(points - record.point).max(axis=1).argmin())
    low, high = np.asarray(problem.low), np.asarray(problem.high)
    parameters = low + points * (high - low)
    compromise = optimum_of(record, method.name, began, left=float(left[chosen]))
    return Front(
        objectives=tuple(of.name for of in problem.objectives),
        units=tuple(of.unit for of in problem.objectives),
        values=values * np.asarray([of.sign for of in problem.objectives]),
        parameters={name: parameters[:, index] for index, name in enumerate(problem.names)},
        optimality=left,
        compromise=compromise,
        chosen=chosen,
    )


def _evidence(record: Record, points, values, span, batch: int) -> np.ndarray:
    """First-order optimality of every point: largest common decrease of all objectives per step, in spans."""
    left, problem = np.empty(len(points)), record.problem
    linearizer = record.linearizer or Linearizer(problem, batch)
    for start in range(0, len(points), batch):
        rows = slice(start, min(start + batch, len(points)))
        record.spend(len(points[rows]), analyses=problem.gradient_cost)
        for index, found in zip(range(rows.start, rows.stop), linearizer(points[rows])):
            way = _Descent(values[index], span)
            left[index] = LinearModel(problem, points[index], found, way).optimality(PROBE)
    return left


def _ends(objectives: int) -> np.ndarray:
    """Weights of the ends of the front, one objective each, with `END` for the others."""
    return np.where(np.eye(objectives, dtype=bool), 1 - (objectives - 1) * END, END)


def _weights(count: int, objectives: int) -> np.ndarray:
    """Weights that sum to 1: evenly along the line of two objectives, of a low-discrepancy sequence for more."""
    if objectives == 2:
        first = np.linspace(END, 1 - END, count)
        return np.stack([first, 1 - first], axis=1)
    # spacings of sorted uniform numbers are uniform on the simplex
    cuts = np.sort(halton(objectives - 1, count + 1)[1:], axis=1)
    return np.diff(np.concatenate([np.zeros((count, 1)), cuts, np.ones((count, 1))], axis=1), axis=1)
