"""The best rows and the Pareto front of a stream of rows, holding no more than what is selected so far."""

from collections.abc import Iterable

import numpy as np

from ..numerics.pareto import pareto_front

Numbered = tuple[np.ndarray, np.ndarray]  # row numbers, and values that are to be small


def smallest(parts: Iterable[Numbered], count: int) -> np.ndarray:
    """Numbers of the rows with the `count` smallest values, ascending; equal values in the order of their numbers.

    Args:
        parts: row numbers and values, shape (rows,), NaN where a row does not take part.
        count: how many.
    """
    numbers, values = np.empty(0, np.int64), np.empty(0)
    for more, new in parts:
        fine = ~np.isnan(new)
        numbers, values = np.concatenate([numbers, more[fine]]), np.concatenate([values, new[fine]])
        if len(values) > count:
            limit = np.partition(values, count - 1)[count - 1]
            numbers, values = numbers[values <= limit], values[values <= limit]
        order = np.lexsort((numbers, values))[:count]
        numbers, values = numbers[order], values[order]
    return numbers


def front(parts: Iterable[Numbered]) -> np.ndarray:
    """Numbers of the rows that no other row beats: none is as good everywhere and better somewhere.

    Of rows with equal values the first is kept. The front is sorted by the first column.

    Args:
        parts: row numbers and values, shape (rows, two or three columns), with NaN where a row does not take part.
    """
    numbers, values = np.empty(0, np.int64), None
    for more, new in parts:
        numbers = np.concatenate([numbers, more])
        values = new if values is None else np.concatenate([values, new])
        best = np.flatnonzero(pareto_front(values))
        order = best[np.lexsort((numbers[best], *values[best].T[::-1]))]
        first = np.r_[True, (values[order[1:]] != values[order[:-1]]).any(axis=1)][: len(order)]
        numbers, values = numbers[order[first]], values[order[first]]
    return numbers
