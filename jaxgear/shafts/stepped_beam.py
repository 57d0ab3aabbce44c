"""Elastic line of a stepped shaft: Timoshenko bending, torsion and tension by integrals of unit loads.

A shaft is clamped at its left end, without bearings. Its displacement at s under a unit load at t is an integral from
the left end to the nearer one of s and t (principle of virtual work). For pieces of constant cross-section the integral
is a polynomial: it is exact for any positions of loads and points, needs no nodes, and is differentiable with respect
to every position and diameter.

Displacements are in um, rotations in mrad, forces in N, moments in N mm: force times displacement and moment times
rotation are the same unit of work, so compliance matrices are symmetric.
"""

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..geometry import Material
from ..numerics import positive_definite

# Entries of a pair may differ by this share of the largest entries of their row and column: the rounding of a
# symmetric matrix in a file of five or six digits.
_ASYMMETRY = 1e-4
# Smallest ratio of the extreme eigenvalues that may be a rounding error of a semidefinite matrix.
ROUNDING = 1e-9

_Matrix = TypeVar("_Matrix", jax.Array, np.ndarray)


def symmetric(matrix: _Matrix) -> _Matrix:
    """Symmetric part of a matrix; its derivatives reach both entries of a pair."""
    return 0.5 * (matrix + matrix.T)


def semidefinite(matrix: Float[Array, "n n"]) -> Bool[Array, ""]:
    """True if a symmetric matrix has no negative eigenvalue, except for rounding; traceable."""
    # no eigenvalue is larger than the largest sum of a row
    largest = jnp.max(jnp.sum(jnp.abs(matrix), axis=1))
    small = max(ROUNDING, 10 * len(matrix) * float(jnp.finfo(matrix.dtype).eps)) * largest
    lifted = matrix + jnp.where(largest == 0, 1.0, small) * jnp.eye(len(matrix), dtype=matrix.dtype)
    return positive_definite(lifted)


def check_symmetric(name: str, matrix: np.ndarray, labels: Sequence[str] | None = None) -> None:
    """Raise a one-line `ValueError` for a matrix that is not symmetric, with the entry of the largest difference."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    size = np.maximum(np.outer(scale, scale), np.finfo(float).tiny)
    apart = np.abs(matrix - matrix.T) / size
    row, column = np.unravel_index(np.argmax(apart), apart.shape)
    if apart[row, column] <= _ASYMMETRY:
        return
    first, second = (row, column) if labels is None else (labels[int(row)], labels[int(column)])
    raise ValueError(
        f"{name} must be symmetric, but ({first}, {second}) = {matrix[row, column]:.6g} and "
        f"({second}, {first}) = {matrix[column, row]:.6g}"
    )


Points = Float[Array, " points"]
Pieces = Float[Array, " pieces"]

DIRECTIONS = ("x", "y", "z", "rx", "ry")  # displacements and rotations of a cross-section without its twist
_UM = 1e3  # um per mm, mrad per rad


class SteppedBeam(NamedTuple):
    """Pieces of constant cross-section, from left to right; some may have no length. All arrays have shape (pieces,).

    Attributes:
        start, end: ends of the pieces [mm].
        bending: curvature per bending moment [mrad/mm per N mm].
        shear: slope of the elastic line per shear force [um/mm per N].
        torsion: twist per length and torque [mrad/mm per N mm].
        tension: strain per axial force [um/mm per N].
    """

    start: Pieces
    end: Pieces
    bending: Pieces
    shear: Pieces
    torsion: Pieces
    tension: Pieces


def shear_coefficient(bore_ratio: Float[Array, "..."], poisson_ratio: Float[Array, ""]) -> Float[Array, "..."]:
    """Shear coefficient of a hollow circular section (G. R. Cowper, J. Appl. Mech. 33, 1966, pp. 335-340).

    Args:
        bore_ratio: inner over outer diameter.
        poisson_ratio: nu.
    """
    square = bore_ratio**2
    whole = (1 + square) ** 2
    return 6 * (1 + poisson_ratio) * whole / ((7 + 6 * poisson_ratio) * whole + (20 + 12 * poisson_ratio) * square)


def beam(edges: Float[Array, " edges"], diameter: Pieces, bore: Pieces, material: Material) -> SteppedBeam:
    """Stepped beam with a piece between every two neighbouring edges.

    Args:
        edges: ends of the pieces in ascending order [mm], shape (edges,).
        diameter, bore: outer and inner diameter of every piece [mm].
        material: material of all pieces.
    """
    modulus, poisson_ratio = material.elastic_modulus, material.poisson_ratio
    area = jnp.pi / 4 * (diameter**2 - bore**2)
    inertia = jnp.pi / 64 * (diameter**4 - bore**4)
    shear_modulus = modulus / (2 * (1 + poisson_ratio))
    effective = shear_coefficient(bore / diameter, poisson_ratio) * area
    return SteppedBeam(
        edges[:-1],
        edges[1:],
        _UM / (modulus * inertia),
        _UM / (shear_modulus * effective),
        _UM / (shear_modulus * 2 * inertia),
        _UM / (modulus * area),
    )


def flexibility(beam: SteppedBeam, at: Points) -> Float[Array, "points 5 points 5"]:
    """Displacements at all points under unit loads at all points, for the beam clamped at its left end.

    Args:
        beam: the clamped beam.
        at: positions on the beam [mm], shape (points,).

    Returns:
        displacements x, y, z and rotations rx, ry per force and moment in the same directions [um/N, mrad/N,
        mrad/(N mm)], shape (points, 5, points, 5).
    """
    beam = jax.tree.map(lambda leaf: leaf[None, None], beam)
    s, t = at[:, None, None], at[None, :, None]
    stop = jnp.clip(jnp.minimum(s, t), beam.start, beam.end)
    length, middle = stop - beam.start, 0.5 * (stop + beam.start)
    # moments over the common part are (s - z) and (t - z)
    both = jnp.sum(length * (beam.bending * ((s - middle) * (t - middle) + length**2 / 12) + beam.shear), axis=-1)
    first = jnp.sum(length * beam.bending * (s - middle), axis=-1)
    angle = jnp.sum(length * beam.bending, axis=-1)
    stretch = jnp.sum(length * beam.tension, axis=-1)
    zero = jnp.zeros_like(both)
    rows = (
        (both, zero, zero, zero, first),
        (zero, both, zero, -first, zero),
        (zero, zero, stretch, zero, zero),
        (zero, -first.T, zero, angle, zero),
        (first.T, zero, zero, zero, angle),
    )
    return jnp.moveaxis(jnp.stack([jnp.stack(row) for row in rows]), (2, 3), (0, 2))


def rigid(at: Points) -> Float[Array, "points 5 5"]:
    """Displacements of points per rigid-body displacement of the left end, shape (points, 5, 5)."""
    one, zero = jnp.ones_like(at), jnp.zeros_like(at)
    rows = (
        (one, zero, zero, zero, at),
        (zero, one, zero, -at, zero),
        (zero, zero, one, zero, zero),
        (zero, zero, zero, one, zero),
        (zero, zero, zero, zero, one),
    )
    return jnp.moveaxis(jnp.stack([jnp.stack(row) for row in rows]), 2, 0)


def twist(beam: SteppedBeam, at: Float[Array, "..."]) -> Float[Array, "..."]:
    """Twist between the left end and points under a unit torque [mrad per N mm]."""
    beam = jax.tree.map(lambda leaf: jnp.expand_dims(leaf, tuple(range(at.ndim))), beam)
    length = jnp.clip(at[..., None], beam.start, beam.end) - beam.start
    return jnp.sum(length * beam.torsion, axis=-1)
