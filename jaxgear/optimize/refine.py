"""End of a search on a mesh so fine that refinement changes neither the result nor the limits that are met."""

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
# Search for a design that meets the limits: number of starts near the best design and over the box, reach of the near
# starts, and number of steps.
_NEAR, _FAR, _REACH, _STEPS = 4, 4, 0.1, 30
_ENOUGH = 0.1  # of the tolerance of a limit: what a step of theirs has to gain

Found = TypeVar("Found")


class _Refined(NamedTuple):
    """Result of the end of a search.

    Attributes:
        record: record on the finest mesh, after rounding, with all contact analyses spent.
        change: change of the objective at twice the positions and, for helical gears, extrapolated to infinitely many
            slices; NaN if not evaluated.
        unrounded: record on the finest mesh before rounding; the same as `record` without steps, or if rounding would
            violate limits.
    """

    record: Record
    change: float
    unrounded: Record


def refined(
    record: Record, polish: Polish, positions: int | None, steps: Mapping[str, float] = MappingProxyType({})
) -> _Refined:
    """Continue a search from its best design on finer meshes, see `on_finer_meshes`, and round the variables.

    If no design so far meets all limits, a design that meets them is sought, whatever its objective.

    Args:
        record: record of the search so far.
        polish: function that continues the search from a point.
        positions: number of positions of the first finer mesh; None to stay on the mesh.
        steps: steps of the variables to be rounded, see `rounded`.
    """
    if positions is None:
        _seek_feasible(record, polish)
        return _Refined(_on_steps(record, steps, polish), float("nan"), record)
    problem = record.problem

    def end_on(mesh: Mesh) -> tuple[_Refined, bool]:
        nonlocal record
        found = record.on(problem.on(mesh))
        polish(found.problem, found, record.point)
        found.check()
        _seek_feasible(found, polish)
        record, ends = found, _on_steps(found, steps, polish)
        values, violations = at_more_positions(ends, ends.point[None])
        change = problem.objectives[0].sign * (float(values[0, 0] - ends.value) + _slice_error(ends))
        found.evaluations = ends.evaluations
        now = np.asarray([[ends.value]]), np.asarray([ends.violation])
        return _Refined(ends, change, found), fine_enough(*now, values, violations)

    return on_finer_meshes(problem.mesh, positions, end_on)


def _on_steps(record: Record, steps: Mapping[str, float], polish: Polish) -> Record:
    """Record of the best rounded design; the given record without steps, or if rounding violates a limit."""
    if not steps:
        return record
    found = rounded(record, steps, polish)
    return record if counted(found.violation) > counted(record.violation) else found


def on_finer_meshes(mesh: Mesh, positions: int, end_on: Callable[[Mesh], tuple[Found, bool]]) -> Found:
    """End a search on finer meshes.

    The number of positions is doubled until a further doubling changes the result little and violates no limit.

    Args:
        mesh: mesh of the search.
        positions: number of positions of the first finer mesh, at least that of `mesh`.
        end_on: function that ends the search on a finer mesh; it returns the result, and True if the mesh is fine
            enough.
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
    """True if no design changes much on a finer mesh, and no design violates a limit there that it met before.

    Args:
        values: objectives, shape (designs, objectives).
        violations: violations of the designs, shape (designs,).
        finer_values, finer_violations: objectives and violations on the finer mesh.
        span: span of the objectives over the designs; the reference of a change is the larger one of value and span.
    """
    same = abs(finer_values - values) <= np.maximum(_BOUND * np.maximum(abs(values), span), _LEAST_BOUND)
    return bool(same.all() and ((counted(violations) > 0) | (finer_violations <= FEASIBLE)).all())


def at_more_positions(record: Record, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Objectives at twice the positions, shape (designs, objectives), and violations at four times the positions.

    Violations need four times the positions, because a peak can also lie between the positions of twice as many.
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


def _slice_error(record: Record) -> float:
    """Estimated change of the objective of the best design for infinitely many slices; zero for spur gears."""
    fewer, linearizer = fewer_slices(record.problem.mesh), record.linearizer
    if fewer is None:
        return 0.0
    posed, point = record.problem.on(fewer), record.point[None]
    record.spend(1)
    if linearizer is None:
        return float(slices_left(record.value, np.asarray(scores(posed, point).value).item()))
    (found,) = linearizer.on(posed)(point)
    return float(slices_left(record.value, LinearModel(posed, record.point, found).value))


def _seek_feasible(record: Record, polish: Polish) -> None:
    """Seek a design that keeps the limits if none does so far, by their violation alone, and polish it."""
    if not counted(record.violation):
        return
    linearizer = record.linearizer or Linearizer(record.problem, _NEAR + _FAR)
    seek_limits(linearizer, _Judging(record), record.point)
    if not counted(record.violation):
        polish(record.problem, record, record.point)


def seek_limits(linearizer: Linearizer, ledger: Ledger, point: np.ndarray) -> None:
    """Search for designs that meet the limits: minimize the violation from starts near `point` and over the box."""
    problem = linearizer.problem
    beside = points_nearby(point, _NEAR - 1, reach=_REACH, seed=0)
    nothing = NoObjective(len(problem.objectives))
    searches = [Search(start, nothing) for start in (point, *beside, *start_points(problem, _FAR))]
    follow(linearizer, ledger, searches, steps=_STEPS, rtol=_ENOUGH)


class _Judging:
    """Ledger for models without objective: offers designs to a record by their true objectives."""

    def __init__(self, record: Record):
        self._record = record

    def spend(self, designs: int, *, analyses: int) -> None:
        """Count contact analyses of a number of designs."""
        self._record.spend(designs, analyses=analyses)

    def take(self, point: np.ndarray, model: LinearModel) -> None:
        """Offers a design by its true objective."""
        self._record.offer(point, model.values[:1], model.violation)

    def look(self, step: int, steps: int) -> None:
        """No report: the search does not minimize the objective."""


def _with_positions(mesh: Mesh, positions: int) -> Mesh:
    """Copy of the mesh with another number of positions."""
    if positions == mesh.resolution.positions:
        return mesh
    sizes = replace(mesh.resolution, positions=positions)
    return prepare(mesh.pair, compliance=mesh.compliance, resolution=sizes, support=mesh.support)
