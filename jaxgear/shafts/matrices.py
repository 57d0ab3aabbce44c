"""What stiffness and compliance matrices have to be."""

import numpy as np

# Entries that mirror each other may differ by this share of the largest ones in their row and column: what a file of
# five or six digits leaves of a symmetric matrix.
_ASYMMETRY = 1e-4


def symmetric(matrix):
    """Its symmetric part: derivatives see both entries of a pair."""
    return 0.5 * (matrix + matrix.T)


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
