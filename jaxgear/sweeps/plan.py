"""Which variants a sweep evaluates: numbered rows of parameter values that exist only while they are asked for."""

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..numerics import check, whole

Bounds = Mapping[str, tuple[float, float]]

_PIECE = 2**16


class AbstractPlan(ABC):
    """A numbered list of variants.

    Attributes:
        names: of the parameters, in the order of the columns of `rows`.
        low, high: range of every parameter.
        size: number of variants.
    """

    def __init__(self, names: tuple[str, ...], low: Iterable[float], high: Iterable[float], size: int):
        self.names, self.low, self.high, self.size = names, tuple(map(float, low)), tuple(map(float, high)), size

    @abstractmethod
    def _rows(self, start: int, stop: int) -> np.ndarray:
        """Rows of a range that is within the plan."""

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Everything that determines the rows, as plain data."""

    def rows(self, start: int, stop: int) -> np.ndarray:
        """Parameter values of the variants `start` to `stop - 1`.

        A variant has the same values however the plan is cut into ranges, and only the range is held in memory.

        Returns:
            float64, shape (stop - start, len(names)).

        Raises:
            IndexError: for a range that leaves the plan.
        """
        if not 0 <= start <= stop <= self.size:
            raise IndexError(f"rows {start} to {stop} are not within the {self.size} variants of the plan")
        return self._rows(start, stop)


class FullFactorial(AbstractPlan):
    """Every combination of the levels of all parameters; the last parameter runs fastest, as in nested loops.

    Attributes:
        levels: values of every parameter.
    """

    def __init__(self, bounds: Bounds, levels: int | Mapping[str, int | Sequence[float]]):
        """Makes the plan.

        Args:
            bounds: (low, high) of every parameter.
            levels: number of evenly spaced levels from low to high, at least 2, or the values themselves; one number
                for all parameters, or one entry per parameter.

        Raises:
            ValueError: for wrong bounds, missing or unknown parameters, and levels outside the bounds.
        """
        names, low, high = box("FullFactorial", bounds)
        each = {name: levels for name in names} if isinstance(levels, int) else dict(levels)
        if set(each) != set(names):
            odd = sorted(set(each) ^ set(names))
            raise ValueError(f"FullFactorial: levels must be given for {', '.join(names)} ({', '.join(odd)} differ)")
        values = tuple(_levels(name, each[name], *bounds[name]) for name in names)
        size = math.prod(len(value) for value in values)
        super().__init__(names, low, high, whole("FullFactorial", "number of combinations", size))
        self.levels = values

    def _rows(self, start, stop):
        number = np.arange(start, stop, dtype=np.int64)
        table = np.empty((stop - start, len(self.names)))
        for column in reversed(range(len(self.names))):
            values = self.levels[column]
            number, digit = np.divmod(number, len(values))
            table[:, column] = values[digit]
        return table

    def describe(self):
        levels = {name: values.tolist() for name, values in zip(self.names, self.levels)}
        return {"sampling": "full_factorial", "levels": levels}


class VariantList(AbstractPlan):
    """Variants given one by one.

    Attributes:
        values: float64, shape (size, names).
    """

    def __init__(self, names: Sequence[str], values):
        """Makes the plan.

        Args:
            names: of the parameters.
            values: shape (variants, names); numbers that are not finite are failed variants, not errors.

        Raises:
            ValueError: for repeated names, or values of another shape or without a row.
        """
        table = np.ascontiguousarray(values, np.float64)
        if not names or len(set(names)) != len(names):
            raise ValueError(f"VariantList: names {', '.join(names) or '(none)'} must be different and at least one")
        if table.ndim != 2 or table.shape[1] != len(names) or not len(table):
            raise ValueError(f"VariantList: values of shape {table.shape} must be (variants, {len(names)})")
        # in pieces: the values may lie in a file
        pieces = [table[start : start + _PIECE] for start in range(0, len(table), _PIECE)]
        low = np.fmin.reduce([np.fmin.reduce(_finite(piece), axis=0) for piece in pieces])
        high = np.fmax.reduce([np.fmax.reduce(_finite(piece), axis=0) for piece in pieces])
        super().__init__(tuple(names), low, high, len(table))
        self.values = table

    def _rows(self, start, stop):
        return self.values[start:stop]

    def describe(self):
        digest = hashlib.sha256()
        for start in range(0, self.size, _PIECE):
            digest.update(self.values[start : start + _PIECE].tobytes())
        return {"sampling": "list", "names": list(self.names), "sha256": digest.hexdigest()}


def box(owner: str, bounds: Bounds) -> tuple[tuple[str, ...], tuple[float, ...], tuple[float, ...]]:
    """Names, lower and upper bounds, checked.

    Raises:
        ValueError: for no parameter, and for bounds that are not finite or do not ascend.
    """
    if not bounds:
        raise ValueError(f"{owner}: bounds must name at least one parameter")
    for name, (low, high) in bounds.items():
        check(owner, f"lower bound of {name}", low, "")
        check(owner, f"upper bound of {name}", high, "", low=low, open_low=True)
    return tuple(bounds), tuple(low for low, _ in bounds.values()), tuple(high for _, high in bounds.values())


def _finite(values: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(values), values, np.nan)


def _levels(name: str, given, low: float, high: float) -> np.ndarray:
    if isinstance(given, int | np.integer):
        return np.linspace(low, high, whole("FullFactorial", f"levels of {name}", given, low=2))
    values = np.asarray(given, np.float64)
    if values.ndim != 1 or not len(values) or len(np.unique(values)) != len(values):
        raise ValueError(f"FullFactorial: levels of {name} must be a count or a list of different values")
    check("FullFactorial", f"levels of {name}", values, "", low=low, high=high)
    return values
