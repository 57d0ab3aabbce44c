"""Elimination of a few unknowns at many positions at once, unrolled so that a compiler fuses it into few loops."""

from collections.abc import Sequence

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .safe import unit

Rows = list[Float[Array, "slices positions"]]
Slopes = list[Float[Array, "#slices positions"]]  # one row where a slope is the same in every slice
Curve = Float[Array, " positions"]
Active = Sequence[Bool[Array, "slices positions"]]
Load = Float[Array, ""] | Curve  # a scalar where it is the same everywhere
Inverse = list[Rows]  # of a matrix of every slice, by springs


def inverse_of(
    compliance: Float[Array, "springs springs #slices positions"], active: Active, slope: Slopes
) -> tuple[Inverse, Slopes]:
    """Inverses of C + slope of the active springs, zero where springs are apart, and load per opening of all, about.

    Args:
        compliance: C.
        active: which springs are in contact, (slices, positions) each.
        slope: dh/dq of every spring, (slices, positions) or (1, positions) each.
    """
    mask = [flag.astype(compliance.dtype) for flag in active]
    lower = [
        [*(mask[i] * mask[j] * compliance[i, j] for j in range(i)), compliance[i, i] + slope[i]]
        for i in range(len(mask))
    ]
    return _bordered(lower, mask)


def _bordered(lower: list[list[Array]], mask: Sequence[Array | float]) -> tuple[list[list[Array]], list[Array]]:
    """Inverse of a symmetric, positive definite matrix, _bordered row by row, and the inverse pivots.

    Args:
        lower: its rows up to the diagonal.
        mask: of every row; what belongs to those of zero, which have to be zero beside the diagonal, is left out.
    """
    inverse: list[list[Array]] = []
    pivots: list[Array] = []
    for (*border, own), kept in zip(lower, mask):
        across = [sum(a * b for a, b in zip(row, border)) for row in inverse]
        pivots.append(1 / (own - sum(a * b for a, b in zip(across, border))))
        last = kept * pivots[-1]
        beside = [-a * last for a in across]
        inverse = [[*(a - x * b for a, x in zip(row, across)), b] for row, b in zip(inverse, beside)] + [
            [*beside, last]
        ]
    return inverse, pivots


def small_inverse(matrix: Float[Array, "rows rows positions"]) -> Float[Array, "rows rows positions"]:
    """Inverse of a symmetric, positive definite matrix at every position."""
    count = len(matrix)
    inverse, _ = _bordered([[matrix[i, j] for j in range(i + 1)] for i in range(count)], [1.0] * count)
    whole = jnp.stack([jnp.stack(row) for row in inverse])
    return whole / unit(whole)
