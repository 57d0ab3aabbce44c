"""Which variants ask for a modification that cannot be."""

import numpy as np


class Possible:
    """Finds the variants whose modifications refuse their numbers, such as a relief of negative length.

    Modifications check concrete numbers only and are traced in the evaluation, which would turn an impossible variant
    into some number. Their checks accept arrays, so a whole part of the table passes in one call, and only where that
    is refused it is halved until the culprits are found. A design that cannot be called with arrays is not checked.
    """

    def __init__(self, design, names, example: np.ndarray):
        """Makes the check.

        Args:
            design: of the sweep.
            names: of its parameters.
            example: values of one variant, by which to tell whether the design takes arrays.
        """
        self._design, self._names = design, names
        self._checks = _outcome(lambda: self._build(example)) == _outcome(lambda: self._build(np.stack([example] * 2)))

    def __call__(self, rows: np.ndarray) -> np.ndarray:
        """Which rows are possible, bool of shape (rows,)."""
        possible = np.isfinite(rows).all(axis=1)
        if self._checks:
            kept = np.flatnonzero(possible)
            possible[kept] = self._search(rows[kept])
        return possible

    def _search(self, rows: np.ndarray) -> np.ndarray:
        if not len(rows) or _outcome(lambda: self._build(rows)) is None:
            return np.ones(len(rows), bool)
        if len(rows) == 1:
            return np.zeros(1, bool)
        half = len(rows) // 2
        return np.concatenate([self._search(rows[:half]), self._search(rows[half:])])

    def _build(self, rows: np.ndarray) -> None:
        self._design(dict(zip(self._names, rows.T)))


def _outcome(call) -> type[Exception] | None:
    """What a call raises."""
    try:
        call()
    except Exception as error:  # noqa: BLE001 - a design is foreign code
        return type(error)
    return None
