"""Elimination of a few unknowns at many positions at once, unrolled so that a compiler fuses it into few loops."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Shaped

from .safe import unit

Rows = list[Float[Array, "slices positions"]]
Slopes = list[Float[Array, "#slices positions"]]  # one row where a slope is the same in every slice
Curve = Float[Array, " positions"]
Active = Sequence[Bool[Array, "slices positions"]]
Load = Float[Array, ""] | Curve  # a scalar where it is the same everywhere


def over_slices(field: Shaped[Array, "pairs *slices positions"]) -> Shaped[Array, "pairs #slices positions"]:
    """A field of springs with an axis of slices, of length one where it is the same in all of them."""
    return field if field.ndim == 3 else field[:, None]


class Factors(NamedTuple):
    """L D L^T of the active systems C + slope, with rows and columns of springs that are apart set to zero.

    Attributes:
        rows: D L^T below the diagonal.
        diagonal, inverse: D and 1 / D.
        lever: L^-1 lever, zero for springs that are apart.
        active: 1 for springs in contact, else 0.
    """

    rows: list[Rows]
    diagonal: Slopes
    inverse: Slopes
    lever: Rows
    active: Rows

    @property
    def per_slope(self) -> Slopes:
        """Load per opening of every spring, about."""
        return self.inverse


def factorize(
    compliance: Float[Array, "pairs pairs *own positions"],
    lever: Float[Array, "pairs *each positions"],
    active: Active,
    slope: Slopes,
) -> Factors:
    """Eliminates the active springs from C + slope.

    Args:
        compliance: C.
        lever: what a spring closes per unit of common approach.
        active: which springs are in contact, (slices, positions) each.
        slope: dh/dq of every spring, (slices, positions) or (1, positions) each.
    """
    mask = [row.astype(compliance.dtype) for row in active]
    compliance = compliance if compliance.ndim == 4 else compliance[:, :, None]
    rows: list[Rows] = []
    diagonal: Slopes = []
    inverse: Slopes = []
    for i in range(len(mask)):
        row = [mask[i] * mask[j] * compliance[i, j] for j in range(i)]
        for j in range(i):
            for k in range(j):
                row[j] = row[j] - row[k] * rows[j][k] * inverse[k]
        pivot = compliance[i, i] + slope[i]
        for j in range(i):
            pivot = pivot - row[j] * row[j] * inverse[j]
        rows.append(row)
        diagonal.append(pivot)
        inverse.append(1 / pivot)
    levers = [flag * row for flag, row in zip(mask, over_slices(lever))]
    return Factors(rows, diagonal, inverse, forward(rows, inverse, levers), mask)


def forward(rows: list[Rows], inverse: Slopes, right: Rows) -> Rows:
    """L^-1 right"""
    result: Rows = []
    for i, value in enumerate(right):
        for j in range(i):
            value = value - rows[i][j] * inverse[j] * result[j]
        result.append(value)
    return result


def inverse_of(factors: Factors) -> list[Rows]:
    """Inverses of the active systems, zero where springs are apart, by springs."""
    springs = range(len(factors.active))
    none = jnp.zeros_like(factors.active[0])
    ahead = [
        forward(factors.rows, factors.inverse, [factors.active[j] if i == j else none for i in springs])
        for j in springs
    ]
    half = {}
    for i in springs:
        for j in range(i + 1):
            value = sum(ahead[i][k] * ahead[j][k] * factors.inverse[k] for k in springs[i:])
            half[i, j] = half[j, i] = value / unit(value)
    return [[half[i, j] for j in springs] for i in springs]


def small_inverse(matrix: Float[Array, "pairs pairs positions"]) -> Float[Array, "pairs pairs positions"]:
    """Inverse of a symmetric, positive definite matrix at every position, bordered row by row."""
    rows = [[1 / matrix[0, 0]]]
    for k in range(1, len(matrix)):
        border = [matrix[k, j] for j in range(k)]
        across = [sum(a * b for a, b in zip(row, border)) for row in rows]
        last = 1 / (matrix[k, k] - sum(a * b for a, b in zip(across, border)))
        beside = [-a * last for a in across]
        rows = [[*(a - x * b for a, x in zip(row, across)), b] for row, b in zip(rows, beside)] + [[*beside, last]]
    whole = jnp.stack([jnp.stack(row) for row in rows])
    return whole / unit(whole)


def product(weight: Float[Array, " slices"], factors: Factors, first: Rows, second: Rows) -> Curve:
    """sum_{p, s} w first D^-1 second"""
    terms = sum(a * b * inverse for a, b, inverse in zip(first, second, factors.inverse))
    return jnp.sum(weight[:, None] * terms, axis=0)


def balance(weight: Float[Array, " slices"], factors: Factors, known: Rows, load: Load) -> tuple[Rows, Curve]:
    """Solves (C + slope) q = known + lever d on the active rows, q = 0 on the others, with sum lever w q = load."""
    part = _of_known(factors, known)
    stiffness = product(weight, factors, factors.lever, factors.lever)
    approach = (load - product(weight, factors, factors.lever, part)) / stiffness
    return _backward(factors, part, approach), approach


def at_approach(factors: Factors, known: Rows, approach: Curve) -> Rows:
    """Solves (C + slope) q = known + lever d on the active rows, q = 0 on the others, for a given approach d."""
    return _backward(factors, _of_known(factors, known), approach)


def _of_known(factors: Factors, known: Rows) -> Rows:
    """L^-1 known on the active rows."""
    return forward(factors.rows, factors.inverse, [flag * row for flag, row in zip(factors.active, known)])


def _backward(factors: Factors, part: Rows, approach: Curve) -> Rows:
    """q from L^-1 known and the approach."""
    count = len(part)
    result: dict[int, Array] = {}
    for i in reversed(range(count)):
        value = factors.lever[i] * approach[None] + part[i]
        for k in range(i + 1, count):
            value = value - factors.rows[k][i] * result[k]
        result[i] = value / factors.diagonal[i]
    return [result[i] for i in range(count)]
