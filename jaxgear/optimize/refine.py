"""The end of a search, on a mesh so fine that its result does not change any more and keeps the limits."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..contact import Mesh, prepare
from ..numerics import whole
from .evaluate import scores
from .goal import FEASIBLE, counted
from .linear_model import Model, NoObjective
from .linearizer import Linearizer
from .minimax import Search, follow
from .problem import Problem
from .search import Record
from .starts import points_nearby, start_points

POSITIONS = 512
_BOUND = 0.02  # change of the objective at twice the positions, relative to it, with which a mesh is fine enough
_LEAST_BOUND = 1e-3  # the same in the unit of the objective
_MOST = 2048
# Searches for a design that keeps the limits, where one for a good design has met none: from about it and all over the
# box; their reach about it, and their steps.
_NEAR, _FAR, _REACH, _STEPS = 4, 4, 0.1, 30
_ENOUGH = 0.1  # of the tolerance of a limit: what a step of theirs has to gain

Polish = Callable[[Problem, Record, np.ndarray], None]


def refined(record: Record, polish: Polish, positions: int | None) -> tuple[Record, float]:
    """Goes on from the best design of a record on a finer mesh.

    The positions are doubled until the objective changes by less than 2 % of itself when they are doubled again, and
    the limits that are kept are kept there, too. Where none of the designs met keeps all limits, one that does is
    sought whatever its objective is.

    Args:
        record: of the search so far.
        polish: searches on, from a point.
        positions: of the first finer mesh; None to stay.

    Returns:
        the record of the finest mesh, with all that was spent, and by how much its objective changes at twice the
        positions.
    """
    if positions is None:
        _kept_to_limits(record, polish)
        return record, float("nan")
    whole("minimize", "positions", positions)
    problem, mesh = record.problem, record.problem.mesh
    count = max(positions, mesh.resolution.positions)
    finer = problem.on(_with_positions(mesh, count))
    while True:
        found = record.on(finer)
        polish(finer, found, record.point)
        found.check()
        _kept_to_limits(found, polish)
        found.spend(1)
        value, violation = _at_twice_the_positions(found)
        change = value - found.value
        count *= 2
        same = abs(change) <= max(_BOUND * abs(found.value), _LEAST_BOUND) and _keeps_as(found.violation, violation)
        if same or count > _MOST:
            return found, finer.objectives[0].sign * change
        record, finer = found, problem.on(_with_positions(mesh, count))


def _keeps_as(violation: float, finer: float) -> bool:
    """Whether a finer mesh does not find limits passed that are kept."""
    return bool(counted(violation) > 0 or finer <= FEASIBLE)


def _kept_to_limits(record: Record, polish: Polish) -> None:
    """Where no design so far keeps the limits, seeks one by their violation alone, and goes on from it."""
    if not counted(record.violation):
        return
    problem = record.problem
    linearizer = record.linearizer or Linearizer(problem, _NEAR + _FAR)
    starts = (
        record.point,
        *points_nearby(record.point, _NEAR - 1, reach=_REACH, seed=0),
        *start_points(problem, _FAR),
    )
    nothing = NoObjective(len(problem.objectives))
    follow(linearizer, _Judging(record), [Search(start, nothing) for start in starts], steps=_STEPS, rtol=_ENOUGH)
    if not counted(record.violation):
        polish(problem, record, record.point)


class _Judging:
    """Tells a record of designs whose models know nothing of the objective."""

    def __init__(self, record: Record):
        self._record = record

    def spend(self, designs: int, *, analyses: int) -> None:
        """Counts contact analyses."""
        self._record.spend(designs, analyses=analyses)

    def take(self, point: np.ndarray, model: Model) -> None:
        """Offers a design by its true objective."""
        self._record.offer(point, model.values[:1], model.violation)

    def look(self, step: int, steps: int) -> None:
        """Nothing to tell: the objective is not what is made small."""


def _at_twice_the_positions(record: Record) -> tuple[float, float]:
    """The objective and the violation of the best design."""
    problem, points = record.problem, record.point[None]
    twice = record.linearizer.at_twice_the_positions() if record.linearizer is not None else None
    if twice is not None:
        model = Model(problem, record.point, twice(points)[0])
        return model.value, model.violation
    mesh = _with_positions(problem.mesh, 2 * problem.mesh.resolution.positions)
    found = scores(problem.on(mesh), points)
    return float(found.value[0, 0]), float(found.violation[0])


def _with_positions(mesh: Mesh, positions: int) -> Mesh:
    """The same mesh at other positions."""
    if positions == mesh.resolution.positions:
        return mesh
    sizes = replace(mesh.resolution, positions=positions)
    return prepare(mesh.pair, compliance=mesh.compliance, resolution=sizes, support=mesh.support)
