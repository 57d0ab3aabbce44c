"""Static condensation of a finite-element model of a housing onto the seats of its bearings.

With K the stiffness matrix of the model, its foundation held, and W the nodal forces of a unit force or moment on each
seat direction, the compliance between the seats is

    C = W^T K^-1 W

A seat moves by the mean of its nodes, weighted as W spreads the force (what FE programs call a distributing coupling,
RBE3), so that force times displacement is the work done. Where W picks single degrees of freedom, C is the block of
K^-1 that belongs to them, and its inverse the Schur complement K_rr - K_ri K_ii^-1 K_ir (Guyan's reduction, exact for
static loads on what is retained).

References:
    R. J. Guyan, Reduction of stiffness and mass matrices, AIAA J. 3(2), 1965, p. 380.
"""

from collections.abc import Mapping

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from threadpoolctl import threadpool_limits

from .beam import DIRECTIONS
from .housing import Housing

_ASYMMETRY = 1e-6  # of a stiffness matrix, relative to its largest entry
_MISSED = 1e-6  # of unit loads, where the solution is one


def spread_forces(
    nodes: np.ndarray, center, degrees_of_freedom: np.ndarray, size: int, *, tilting: bool = False
) -> np.ndarray:
    """Nodal forces of unit forces (and moments) on a seat in the directions x, y, z (, rx, ry).

    They are the smallest nodal forces with that resultant and no other: of a force equal on all nodes, where these lie
    evenly around the centre.

    Args:
        nodes: coordinates of the nodes of the bore, shape (nodes, 3) [mm].
        center: of the seat [mm].
        degrees_of_freedom: rows of every node's x, y and z in the stiffness matrix, shape (nodes, 3).
        size: number of rows of the stiffness matrix.
        tilting: whether the seat takes moments.

    Raises:
        ValueError: for nodes that cannot carry the moments because they lie on one line, or rows that are not there.
    """
    arms = np.asarray(nodes, float) - np.asarray(center, float)
    count = len(arms)
    rows = np.asarray(degrees_of_freedom)
    if rows.shape != (count, 3) or rows.min() < 0 or rows.max() >= size:
        raise ValueError(
            f"spread_forces: degrees_of_freedom of shape {rows.shape} must be {count} times 3 rows from 0 to "
            f"{size - 1}: no node of a seat can be held"
        )
    # resultant of nodal forces: x, y, z and moments about the centre
    zero, (x, y, z) = np.zeros(count), arms.T
    one = np.ones(count)
    resultant = np.stack(
        [
            np.stack([one, zero, zero], 1),
            np.stack([zero, one, zero], 1),
            np.stack([zero, zero, one], 1),
            np.stack([zero, -z, y], 1),
            np.stack([z, zero, -x], 1),
            np.stack([-y, x, zero], 1),
        ]
    ).reshape(6, -1)
    gram = resultant @ resultant.T
    scale = 1 / np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    if np.linalg.matrix_rank(scale[:, None] * gram * scale) < 6:
        raise ValueError(f"spread_forces: {count} nodes cannot carry forces and moments: they lie on one line")
    spread = resultant.T @ np.linalg.inv(gram)
    ways = 5 if tilting else 3
    forces = np.zeros((size, ways))
    np.add.at(forces, rows.ravel(), spread[:, :ways])
    return forces


def condense(stiffness, seats: Mapping[str, np.ndarray]) -> Housing:
    """The housing of a finite-element model in mm, N and rad, as its compliance between the seats.

    Args:
        stiffness: sparse symmetric matrix [N/mm], with the rows of held degrees of freedom taken out.
        seats: for every bearing name the nodal forces of unit loads in x, y, z (, rx, ry), for instance
            `spread_forces`, shape (rows, 3 or 5).

    Raises:
        ValueError: for seats that do not fit the matrix, a matrix that is not symmetric, or a model that is not held.
    """
    matrix = scipy.sparse.csc_matrix(stiffness)
    if matrix.shape[0] != matrix.shape[1] or abs(matrix - matrix.T).max() > _ASYMMETRY * abs(matrix).max():
        raise ValueError(
            f"condense: stiffness of shape {matrix.shape} must be square and symmetric, both of its triangles given"
        )
    nodes: list[str] = []
    for name, forces in seats.items():
        if forces.ndim != 2 or forces.shape[0] != matrix.shape[0] or forces.shape[1] not in (3, 5):
            raise ValueError(
                f'condense: seat "{name}" has nodal forces of shape {forces.shape}, must be ({matrix.shape[0]}, 3 or 5)'
            )
        nodes += [f"{name}.{way}" for way in DIRECTIONS[: forces.shape[1]]]
    if not nodes:
        raise ValueError("condense: seats must not be empty")
    loads = np.concatenate(list(seats.values()), axis=1)
    try:
        with threadpool_limits(limits=1):  # many small blocks: threads only get in each other's way
            factors = scipy.sparse.linalg.splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
            moved = factors.solve(loads)
    except RuntimeError:  # exactly singular
        raise ValueError("condense: stiffness is singular: is the housing fixed to its foundation?") from None
    missed = np.abs(matrix @ moved - loads).max() / np.abs(loads).max()
    if not missed < _MISSED:  # a model that floats is singular but for rounding
        raise ValueError(
            f"condense: stiffness is singular, forces are missed by {missed:.2g} of their size: is the housing fixed "
            "to its foundation?"
        )
    compliance = loads.T @ moved  # mm and rad per N and N mm
    return Housing(tuple(nodes), 1e3 * 0.5 * (compliance + compliance.T), "compliance")
