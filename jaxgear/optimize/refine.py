"""The end of a search, on a mesh so fine that its result does not change any more and keeps the limits."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple, TypeVar

import numpy as np

from ..contact import Mesh, prepare
from ..contact.mesh import fewer_slices, slices_left
from ..numerics import whole
from .goal import FEASIBLE, counted
from .linear_model import Linearizer, LinearModel, NoObjective
from .rounding import Polish, rounded
from .search import Record, points_nearby, scores, start_points
from .slp import Ledger, Search, follow

POSITIONS = 512
_BOUND = 0.02  # change of the objective at twice the positions, relative to it, with which a mesh is fine enough
_LEAST_BOUND = 1e-3  # the same in the unit of the objective
_MOST = 2048
# Searches for a design that keeps the limits, where one for a good design has met none: from about it and all over the
# box; their reach about it, and their steps.
_NEAR, _FAR, _REACH, _STEPS = 4, 4, 0.1, 30
_ENOUGH = 0.1  # of the tolerance of a limit: what a step of theirs has to gain

Found = TypeVar("Found")


class Refined(NamedTuple):
    """The end of a search.

    Attributes:
        record: of the finest mesh, with all that was spent; of the design on the steps.
        change: of the objective at twice the positions and, of helical gears, with slices without end; NaN where it was
            not evaluated.
        unrounded: of the finest mesh before the variables were rounded; the same as `record` without steps, and where
            no design on them keeps the limits that it keeps.
    """

    record: Record
    change: float
    unrounded: Record


def refined(
    record: Record, polish: Polish, positions: int | None, steps: Mapping[str, float] = MappingProxyType({})
) -> Refined:
    """Goes on from the best design of a record on a finer mesh, see `on_finer_meshes`, and ends on the steps.

    Where none of the designs met keeps all limits, one that does is sought whatever its objective is.

    Args:
        record: of the search so far.
        polish: searches on, from a point.
        positions: of the first finer mesh; None to stay.
        steps: of the variables to be rounded, see `rounded`.
    """
    if positions is None:
        _kept_to_limits(record, polish)
        return Refined(_on_steps(record, steps, polish), float("nan"), record)
    problem = record.problem

    def end_on(mesh: Mesh) -> tuple[Refined, bool]:
        nonlocal record
        found = record.on(problem.on(mesh))
        polish(found.problem, found, record.point)
        found.check()
        _kept_to_limits(found, polish)
        record, ends = found, _on_steps(found, steps, polish)
        values, violations = at_more_positions(ends, ends.point[None])
        change = problem.objectives[0].sign * (float(values[0, 0] - ends.value) + _left_by_slices(ends))
        found.evaluations = ends.evaluations
        now = np.asarray([[ends.value]]), np.asarray([ends.violation])
        return Refined(ends, change, found), fine_enough(*now, values, violations)

    return on_finer_meshes(problem.mesh, positions, end_on)


def _on_steps(record: Record, steps: Mapping[str, float], polish: Polish) -> Record:
    """The best design on the steps, or that of the record without steps and where rounding breaks a limit."""
    if not steps:
        return record
    found = rounded(record, steps, polish)
    return record if counted(found.violation) > counted(record.violation) else found


def on_finer_meshes(mesh: Mesh, positions: int, end_on: Callable[[Mesh], tuple[Found, bool]]) -> Found:
    """The end of a search on a finer mesh.

    The positions are doubled until what is found changes little when they are doubled again, and keeps its limits
    there, too.

    Args:
        mesh: of the search.
        positions: of the first finer mesh, at least those of the mesh.
        end_on: ends the search on a finer mesh; tells what it has found and whether that mesh is fine enough.
    """
    whole("positions", positions)
    count = max(positions, mesh.resolution.positions)
    while True:
        found, enough = end_on(_with_positions(mesh, count))
        count *= 2
        if enough or count > _MOST:
            return found


def fine_enough(
    values: np.ndarray,
    violations: np.ndarray,
    finer_values: np.ndarray,
    finer_violations: np.ndarray,
    span: float | np.ndarray = 0.0,
) -> bool:
    """Whether no design changes much on a finer mesh, and none passes a limit there that it keeps.

    Args:
        values: objectives, shape (designs, objectives).
        violations: of the designs.
        finer_values, finer_violations: the same on the finer mesh.
        span: of the objectives over the designs, which a change is compared with where it is larger than a value.
    """
    same = abs(finer_values - values) <= np.maximum(_BOUND * np.maximum(abs(values), span), _LEAST_BOUND)
    return bool(same.all() and ((counted(violations) > 0) | (finer_violations <= FEASIBLE)).all())


def at_more_positions(record: Record, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Objectives of designs at twice the positions of a record, shape (designs, objectives), and their violations.

    Violations are those at four times the positions: a peak between two positions may lie between those of twice as
    many as well.
    """
    problem = record.problem
    record.spend(len(points))
    finer = record.linearizer and record.linearizer.at_more_positions(points)
    if not finer:
        own = problem.mesh.resolution.positions
        twice = scores(problem.on(_with_positions(problem.mesh, 2 * own)), points)
        four = scores(problem.on(_with_positions(problem.mesh, 4 * own)), points) if problem.constraints else twice
        return np.asarray(twice.value), np.asarray(four.violation)
    models = [[LinearModel(problem, point, of) for of in both] for point, both in zip(points, finer)]
    values = [[twice.value] if len(problem.objectives) == 1 else twice.values for twice, _ in models]
    return np.asarray(values), np.asarray([four.violation for _, four in models])


def _left_by_slices(record: Record) -> float:
    """Estimate of what slices without end add to the objective of the best design, zero of spur gears."""
    fewer, linearizer = fewer_slices(record.problem.mesh), record.linearizer
    if fewer is None:
        return 0.0
    posed, point = record.problem.on(fewer), record.point[None]
    record.spend(1)
    if linearizer is None:
        return float(slices_left(record.value, np.asarray(scores(posed, point).value).item()))
    (found,) = linearizer.on(posed)(point)
    return float(slices_left(record.value, LinearModel(posed, record.point, found).value))


def _kept_to_limits(record: Record, polish: Polish) -> None:
    """Seek a design that keeps the limits if none does so far, by their violation alone, and polish it."""
    if not counted(record.violation):
        return
    linearizer = record.linearizer or Linearizer(record.problem, _NEAR + _FAR)
    seek_limits(linearizer, _Judging(record), record.point)
    if not counted(record.violation):
        polish(record.problem, record, record.point)


def seek_limits(linearizer: Linearizer, ledger: Ledger, point: np.ndarray) -> None:
    """Searches for designs that keep the limits, by their violation alone, from about a point and all over the box."""
    problem = linearizer.problem
    beside = points_nearby(point, _NEAR - 1, reach=_REACH, seed=0)
    nothing = NoObjective(len(problem.objectives))
    searches = [Search(start, nothing) for start in (point, *beside, *start_points(problem, _FAR))]
    follow(linearizer, ledger, searches, steps=_STEPS, rtol=_ENOUGH)


class _Judging:
    """Tells a record of designs whose models know nothing of the objective."""

    def __init__(self, record: Record):
        self._record = record

    def spend(self, designs: int, *, analyses: int) -> None:
        """Counts contact analyses."""
        self._record.spend(designs, analyses=analyses)

    def take(self, point: np.ndarray, model: LinearModel) -> None:
        """Offers a design by its true objective."""
        self._record.offer(point, model.values[:1], model.violation)

    def look(self, step: int, steps: int) -> None:
        """Nothing to tell: the objective is not what is made small."""


def _with_positions(mesh: Mesh, positions: int) -> Mesh:
    """Copy of the mesh with another number of positions."""
    if positions == mesh.resolution.positions:
        return mesh
    sizes = replace(mesh.resolution, positions=positions)
    return prepare(mesh.pair, compliance=mesh.compliance, resolution=sizes, support=mesh.support)
