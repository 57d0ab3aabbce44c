"""Linearizations of a problem at many points, by a program that is compiled once."""

import jax
import numpy as np

from ..conditions.batches import padded
from ..contact.parts import later, parts
from ..numerics import kernel
from .linearization import Linearization, Pieces
from .problem import Problem
from .starts import real_points


class Linearizer:
    """Linearizes at points of the unit box, on the host.

    A problem on a fine mesh is linearized on meshes of fewer positions that together have its own, where all that it
    asks for are extremes over the positions: a search that goes on there needs no other program.

    Args:
        problem: the problem.
        batch: most points at once; the program is compiled for so many.
        positions: for which it is compiled; None for those of the mesh.
    """

    def __init__(self, problem: Problem, batch: int, positions: int | None = None):
        self.problem = problem
        self._batch, self._positions = batch, positions or problem.mesh.resolution.positions
        meshes = parts(problem.mesh, self._positions) if problem.is_made_of_extremes else []
        self._parts = [problem.on(mesh) for mesh in meshes] if len(meshes) > 1 else [problem]

    def on(self, problem: Problem) -> "Linearizer":
        """That of the same problem on another mesh, by the same program if there can be one."""
        return Linearizer(problem, self._batch, self._positions)

    def at_more_positions(self, factor: int) -> "Linearizer | None":
        """That of the problem at so many times the positions, by the same program; None where there is none."""
        if not self.problem.is_made_of_extremes:
            return None
        between = (later(self.problem.mesh, number / factor) for number in range(1, factor))
        found = Linearizer(self.problem, self._batch, self._positions)
        found._parts = [*self._parts, *(part for mesh in between for part in self.on(self.problem.on(mesh))._parts)]
        return found

    def __call__(self, points: np.ndarray) -> list[Linearization]:
        """The linearization at every point."""
        found = []
        for part in self._parts:
            batch = _linearizations(part, real_points(part, padded(points, self._batch)))
            leaves, tree = jax.tree.flatten(batch)
            found.append(([np.asarray(leaf) for leaf in leaves], tree))
        return [
            _joined([jax.tree.unflatten(tree, [leaf[row] for leaf in leaves]) for leaves, tree in found])
            for row in range(len(points))
        ]


def _joined(each: list[Linearization]) -> Linearization:
    """The linearization over all positions from those over some."""
    if len(each) == 1:
        return each[0]
    objectives = tuple(map(_together, zip(*(part.objectives for part in each))))
    limits = tuple(map(_together, zip(*(part.limits for part in each))))
    return Linearization(objectives, limits, np.asarray(all(part.fine for part in each)))


def _together(each: tuple[Pieces, ...]) -> Pieces:
    return jax.tree.map(lambda *arrays: np.concatenate(arrays, axis=1), *each)


@kernel
def _linearizations(problem: Problem, points) -> Linearization:
    # one point after the other: as quick on a processor, whose cores a single analysis keeps busy, and compiled in half
    # the time; an accelerator needs all of them to be busy
    batch = None if jax.default_backend() == "cpu" else len(points)
    return jax.lax.map(problem.linearize, points, batch_size=batch)
