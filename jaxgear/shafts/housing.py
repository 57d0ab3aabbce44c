"""The housing between the bearing seats: a matrix condensed from a finite-element model."""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..numerics import Checked, concrete, number, positive_definite, solve_dense
from .beam import DIRECTIONS
from .matrices import check_symmetric, semidefinite, symmetric

Matrix = Float[Array, "rows columns"]
Kind = Literal["stiffness", "compliance"]

# Smallest eigenvalue over the largest one, of a matrix scaled to a diagonal of 1, that is more than rounding.
_DEFINITE = 1e-10


class Housing(Checked):
    """Stiffness or compliance of a housing at the seats of the bearings, foundation included.

    Attributes:
        nodes: what each row and column is, "SEAT.DIRECTION" with the name of a bearing and x, y, z, rx or ry; a seat
            does not give way in directions that are missing.
        matrix: N/um, N/mrad, N mm/mrad, or their inverses for a compliance (um/N ...).
        kind: "stiffness" or "compliance". A stiffness must be positive definite: a housing that floats in space has to
            be fixed to its foundation. A compliance may have no deformation at all in some direction.

    Raises:
        ValueError: for rows that are unknown or named twice, a matrix that does not fit them, is not symmetric or not
            definite.
    """

    nodes: tuple[str, ...] = eqx.field(static=True, converter=tuple)
    matrix: Matrix = number("N/um or um/N", shape=("nodes", "nodes"))
    kind: Kind = eqx.field(static=True, default="stiffness")

    def check_together(self) -> None:
        _check_nodes(self.nodes)
        size = len(self.nodes)
        if self.matrix.shape != (size, size):
            raise ValueError(f"Housing: matrix has shape {self.matrix.shape}, must be ({size}, {size}) as its nodes")
        known = concrete(self.matrix)
        if known is not None:
            check_symmetric("Housing", self.kind, known, self.nodes)
            _check_definite(known, self.kind, self.nodes)

    @property
    def seats(self) -> tuple[str, ...]:
        """Names of the seats in the order of their first rows."""
        return tuple(dict.fromkeys(_split(node)[0] for node in self.nodes))

    @property
    def valid(self) -> Bool[Array, ""]:
        """Whether the symmetric part of the matrix is definite, a compliance semidefinite; traced ones may not be."""
        even = symmetric(self.matrix)
        diagonal, unit = jnp.diagonal(even), jnp.eye(len(even), dtype=even.dtype)
        scale = 1 / jnp.sqrt(jnp.where(diagonal > 0, diagonal, 1.0))
        scaled = scale[:, None] * even * scale[None]
        if self.kind == "stiffness":
            return jnp.all(diagonal > 0) & positive_definite(scaled - _DEFINITE * unit)
        return jnp.all(diagonal >= 0) & semidefinite(scaled)

    @property
    def compliance(self) -> Matrix:
        """Displacement per force in the order of `nodes`."""
        even = symmetric(self.matrix)
        return even if self.kind == "compliance" else solve_dense(even, jnp.eye(len(even), dtype=even.dtype))

    def at(self, bearings: tuple[str, ...]) -> Float[Array, "directions directions"]:
        """Compliance in x, y, z, rx, ry of one bearing seat after the other [um/N, mrad/N, mrad/(N mm)]."""
        places = {name: index for index, name in enumerate(bearings)}
        rows = np.array(
            [len(DIRECTIONS) * places[seat] + DIRECTIONS.index(way) for seat, way in map(_split, self.nodes)]
        )
        size = len(DIRECTIONS) * len(bearings)
        return jnp.zeros((size, size), self.matrix.dtype).at[rows[:, None], rows].set(self.compliance)


def _split(node: str) -> tuple[str, str]:
    seat, _, direction = node.rpartition(".")
    return seat, direction


def _check_nodes(nodes: tuple[str, ...]) -> None:
    if not nodes:
        raise ValueError("Housing: nodes must not be empty")
    for index, node in enumerate(nodes):
        seat, direction = _split(node) if isinstance(node, str) else ("", "")
        if not seat or direction not in DIRECTIONS:
            raise ValueError(
                f"Housing: node {node!r} must be SEAT.DIRECTION with a direction of {', '.join(DIRECTIONS)}"
            )
        if node in nodes[:index]:
            raise ValueError(f'Housing: node "{node}" is given twice')


def _check_definite(matrix: np.ndarray, kind: Kind, nodes: tuple[str, ...]) -> None:
    diagonal = np.diag(matrix)
    least = np.argmin(diagonal)
    if diagonal[least] < 0 or (kind == "stiffness" and diagonal[least] == 0):
        sign = "greater than 0" if kind == "stiffness" else "at least 0"
        raise ValueError(f"Housing: {kind} of {nodes[least]} is {diagonal[least]:.6g}, must be {sign}")
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    lowest = np.linalg.eigvalsh(scale[:, None] * (0.5 * (matrix + matrix.T)) * scale)[0]
    if kind == "stiffness" and lowest <= _DEFINITE:
        raise ValueError(
            f"Housing: stiffness must be positive definite, but its smallest eigenvalue is {lowest:.3g} of its "
            "diagonal: is the housing fixed to its foundation?"
        )
    if lowest < -max(_DEFINITE, 10 * len(matrix) * np.finfo(matrix.dtype).eps):
        raise ValueError(
            f"Housing: {kind} must be positive semidefinite, but its smallest eigenvalue is {lowest:.3g} of its "
            "diagonal"
        )
