"""The end of a search, on a mesh so fine that its result does not change any more."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..contact import Mesh, prepare
from ..numerics import whole
from .evaluate import scores
from .linear_model import Model
from .problem import Problem
from .search import Record

POSITIONS = 512
_BOUND = 0.02  # change of the objective at twice the positions, relative to it, with which a mesh is fine enough
_LEAST_BOUND = 1e-3  # the same in the unit of the objective
_MOST = 2048

Polish = Callable[[Problem, Record, np.ndarray], None]


def refined(record: Record, polish: Polish, positions: int | None) -> tuple[Record, float]:
    """Goes on from the best design of a record on a finer mesh.

    The positions are doubled until the objective changes by less than 2 % of itself when they are doubled again.

    Args:
        record: of the search so far.
        polish: searches on, from a point.
        positions: of the first finer mesh; None to stay.

    Returns:
        the record of the finest mesh, with all that was spent, and by how much its objective changes at twice the
        positions.
    """
    if positions is None:
        return record, float("nan")
    whole("minimize", "positions", positions)
    problem, mesh = record.problem, record.problem.mesh
    count = max(positions, mesh.resolution.positions)
    finer = problem.on(_with_positions(mesh, count))
    while True:
        found = record.on(finer)
        polish(finer, found, record.point)
        found.check()
        found.spend(1)
        change = _at_twice_the_positions(found) - found.value
        count *= 2
        if abs(change) <= max(_BOUND * abs(found.value), _LEAST_BOUND) or count > _MOST:
            return found, finer.objectives[0].sign * change
        record, finer = found, problem.on(_with_positions(mesh, count))


def _at_twice_the_positions(record: Record) -> float:
    """The objective of the best design."""
    problem, points = record.problem, record.point[None]
    twice = record.linearizer.at_twice_the_positions() if record.linearizer is not None else None
    if twice is not None:
        return Model(problem, record.point, twice(points)[0]).value
    mesh = _with_positions(problem.mesh, 2 * problem.mesh.resolution.positions)
    return float(scores(problem.on(mesh), points).value[0, 0])


def _with_positions(mesh: Mesh, positions: int) -> Mesh:
    """The same mesh at other positions."""
    if positions == mesh.resolution.positions:
        return mesh
    sizes = replace(mesh.resolution, positions=positions)
    return prepare(mesh.pair, compliance=mesh.compliance, resolution=sizes, support=mesh.support)
