"""Linearizations of a problem at many points, by a program that is compiled once."""

import jax
import jax.numpy as jnp
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

    def __call__(self, points: np.ndarray) -> list[Linearization]:
        """The linearization at every point."""
        return [_joined(each) for each in self._at_parts(points)]

    def at_more_positions(self, points: np.ndarray) -> list[tuple[Linearization, Linearization]] | None:
        """Linearizations at two and at four times the positions, by the same program; None where there is none."""
        if not self.problem.is_made_of_extremes:
            return None
        half, *quarters = (self.on(self.problem.on(later(self.problem.mesh, share))) for share in (0.5, 0.25, 0.75))
        twice = zip(self._at_parts(points), half._at_parts(points))
        between = zip(*(each._at_parts(points) for each in quarters))
        return [
            (_joined([*own, *other]), _joined([*own, *other, *first, *last]))
            for (own, other), (first, last) in zip(twice, between)
        ]

    def _at_parts(self, points: np.ndarray) -> list[list[Linearization]]:
        """At every point, the linearizations on each of the meshes."""
        found = []
        for part in self._parts:
            rows = _linearizations(part, real_points(part, padded(points, self._batch)), np.asarray(len(points)))
            leaves, tree = jax.tree.flatten(rows)
            found.append(([np.asarray(leaf) for leaf in leaves], tree))
        return [
            [jax.tree.unflatten(tree, [leaf[row] for leaf in leaves]) for leaves, tree in found]
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
def _linearizations(problem: Problem, points, count) -> Linearization:
    """At the first `count` points; what stands in the other rows means nothing."""
    if jax.default_backend() != "cpu":  # an accelerator needs all of them to be busy
        return jax.vmap(problem.linearize)(points)
    # one point after the other: as quick on a processor, whose cores a single analysis keeps busy, and compiled in half
    # the time; jit has it traced once for both its shapes and the loop
    linearize = jax.jit(lambda point: problem.linearize(point), inline=True)  # a method of tracers has no hash
    nothing = jax.tree.map(
        lambda leaf: jnp.zeros((len(points), *leaf.shape), leaf.dtype), jax.eval_shape(linearize, points[0])
    )

    def with_row(row, found):
        return jax.tree.map(lambda rows, one: rows.at[row].set(one), found, linearize(points[row]))

    return jax.lax.fori_loop(0, count, with_row, nothing)
