"""Plane elasticity of a gear as a ring of equal sectors, held at the bore, or at the rim circle of a ring gear.

The sector is factorised once with its cuts free. What joins the sectors are forces on the cuts: for each harmonic of
the ring, in which a sector moves as its neighbour does but for a phase exp(2 pi i n / z), they follow from a small
dense system. A load on one tooth is the mean of its harmonics, so that the effort grows little with the tooth number.
"""

from typing import NamedTuple

import numpy as np
import scipy  # its packages load when they are used
import threadpoolctl

from .sector import Sector, quadratic, shape_gradients

_GAUSS = 3  # points in each direction: exact for a biquadratic parallelogram


class Places(NamedTuple):
    """Forces, or what they do work on: weights of all displacements, x and y in turn, one column each."""

    weights: np.ndarray

    @classmethod
    def of_points(cls, nodes: np.ndarray, shapes: np.ndarray, directions: np.ndarray, size: int) -> "Places":
        """One column for each row of nodes (columns, n), of their shape functions, and a direction (columns, 2)."""
        weights = np.zeros((2 * size, len(nodes)))
        column = np.arange(len(nodes))[:, None]
        for axis in (0, 1):
            np.add.at(weights, (2 * nodes + axis, column), shapes * directions[:, axis, None])
        return cls(weights)


def along_edge(nodes: np.ndarray, lengths: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and shape functions of points along a chain of quadratic edges.

    Args:
        nodes: of the chain, (2 edges + 1,).
        lengths: coordinate of the nodes along it, monotonic.
        wanted: coordinates of the points, shape (points,).

    Returns:
        nodes and shape functions, (points, 3).
    """
    sign = np.sign(lengths[-1] - lengths[0])
    ends = sign * lengths[::2]
    edge = np.clip(np.searchsorted(ends, sign * wanted, side="right") - 1, 0, len(ends) - 2)
    place = 2 * (sign * wanted - ends[edge]) / (ends[edge + 1] - ends[edge]) - 1
    return nodes[2 * edge[:, None] + np.arange(3)], quadratic(place)[0]


def responses(sector: Sector, poisson: float, teeth: int, loads: Places, seen: Places, neighbours: int) -> np.ndarray:
    """Displacements of the teeth of a ring under loads on one of them, for unit modulus of the plane problem.

    Args:
        sector: the mesh.
        poisson: Poisson's ratio of the plane problem.
        teeth: number of sectors.
        loads: on one tooth.
        seen: what is asked of each tooth, in its own frame.
        neighbours: how many teeth counter-clockwise of the loaded one, itself not counted.

    Returns:
        shape (neighbours + 1, seen, loads).
    """
    free = np.setdiff1d(np.arange(len(sector.points)), sector.held)
    keep = (2 * free[:, None] + np.arange(2)).ravel()
    left, right = _cut(sector, sector.left), _cut(sector, sector.right)
    acting = np.concatenate([left, right, loads.weights], axis=1)[keep]
    asked = np.concatenate([left, right, seen.weights], axis=1)[keep]
    stiffness = _stiffness(sector, poisson)[keep][:, keep].tocsc()
    # ordering and pivots of a symmetric positive definite matrix
    factor = scipy.sparse.linalg.splu(
        stiffness, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    # SuperLU calls BLAS for small blocks, whose threads get into each other's way: eight times slower on busy cores
    with threadpoolctl.threadpool_limits(1, user_api="blas"):
        flexibility = asked.T @ factor.solve(acting)
    return _ring(flexibility, left.shape[1], teeth, neighbours)


def _cut(sector: Sector, nodes: np.ndarray) -> np.ndarray:
    """Unit forces on the nodes of a cut, radial and tangential, shape (2 nodes of the mesh, 2 nodes of the cut)."""
    x, y = sector.points[nodes].T / np.linalg.norm(sector.points[nodes], axis=1)
    columns = [
        Places.of_points(nodes[:, None], np.ones((len(nodes), 1)), np.stack(way, axis=1), len(sector.points)).weights
        for way in ((x, y), (-y, x))
    ]
    return np.concatenate(columns, axis=1)


def _ring(flexibility: np.ndarray, cut: int, teeth: int, neighbours: int) -> np.ndarray:
    """Responses of the teeth of the ring from those of the free sector, whose first rows and columns are the cuts."""
    first, second, rest = slice(0, cut), slice(cut, 2 * cut), slice(2 * cut, None)
    total = np.zeros((neighbours + 1, *flexibility[rest, rest].shape))
    for harmonic in range(teeth // 2 + 1):
        phase = np.exp(2j * np.pi * harmonic / teeth)
        # the left cut of a sector moves as the right one of its neighbour
        gap = flexibility[first] - phase * flexibility[second]
        held = gap[:, first] - np.conj(phase) * gap[:, second]
        pull = flexibility[rest, first] - np.conj(phase) * flexibility[rest, second]
        moved = flexibility[rest, rest] - pull @ np.linalg.solve(held, gap[:, rest])
        twice = 1 if harmonic == 0 or 2 * harmonic == teeth else 2
        turned = phase ** np.arange(neighbours + 1)
        total += twice / teeth * (turned[:, None, None] * moved).real
    return total


def _stiffness(sector: Sector, poisson: float) -> "scipy.sparse.csr_matrix":
    """Stiffness matrix for unit modulus, x and y displacements of the nodes in turn."""
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    local = shape_gradients(nodes, nodes)
    corners = sector.points[sector.elements]
    jacobian = np.einsum("pni,enc->epic", local, corners)
    volume = np.linalg.det(jacobian) * np.outer(weights, weights).ravel()
    gradient = np.einsum("epci,pni->epnc", np.linalg.inv(jacobian), local)
    # isotropic plane stress: s_ab = lame delta_ab e_cc + 2 shear e_ab
    lame, shear = poisson / (1 - poisson**2), 0.5 / (1 + poisson)
    weighted = gradient * volume[..., None, None]
    products = np.einsum("epna,epmb->enamb", weighted, gradient, optimize=True)
    element = lame * products + shear * products.transpose(0, 1, 4, 3, 2)
    trace = shear * np.einsum("enama->enm", products)
    element[:, :, 0, :, 0] += trace
    element[:, :, 1, :, 1] += trace
    numbers = (2 * sector.elements[:, :, None] + np.arange(2)).reshape(-1, 18)
    rows, columns = np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :])
    size = 2 * len(sector.points)
    return scipy.sparse.csr_matrix((element.reshape(-1), (rows.ravel(), columns.ravel())), shape=(size, size))
