"""What stiffness and compliance matrices have to be."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..numerics import positive_definite

# Entries that mirror each other may differ by this share of the largest ones in their row and column: what a file of
# five or six digits leaves of a symmetric matrix.
_ASYMMETRY = 1e-4
# Smallest eigenvalue over the largest one that may be a rounding error of a semidefinite matrix.
ROUNDING = 1e-9


def symmetric(matrix):
    """Its symmetric part: derivatives see both entries of a pair."""
    return 0.5 * (matrix + matrix.T)


def semidefinite(matrix: Float[Array, "n n"]) -> Bool[Array, ""]:
    """Whether no eigenvalue of a symmetric matrix is negative, but for rounding; for traced ones."""
    # no eigenvalue is larger than the largest sum of a row
    largest = jnp.max(jnp.sum(jnp.abs(matrix), axis=1))
    small = max(ROUNDING, 10 * len(matrix) * float(jnp.finfo(matrix.dtype).eps)) * largest
    lifted = matrix + jnp.where(largest == 0, 1.0, small) * jnp.eye(len(matrix), dtype=matrix.dtype)
    return positive_definite(lifted)


def check_symmetric(owner: str, name: str, matrix: np.ndarray, labels=None) -> None:
    """Raises a one-line `ValueError` that names the entry that differs most from its mirror image."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    size = np.maximum(np.outer(scale, scale), np.finfo(float).tiny)
    apart = np.abs(matrix - matrix.T) / size
    row, column = np.unravel_index(np.argmax(apart), apart.shape)
    if apart[row, column] <= _ASYMMETRY:
        return
    first, second = (row, column) if labels is None else (labels[row], labels[column])
    raise ValueError(
        f"{owner}: {name} must be symmetric, but ({first}, {second}) = {matrix[row, column]:.6g} and "
        f"({second}, {first}) = {matrix[column, row]:.6g}"
    )
