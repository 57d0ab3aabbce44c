"""Plans of a sweep: numbered variants whose parameter values are computed on request."""

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import scipy  # its packages load when they are used: scipy.stats takes a second

from ..numerics import Numbers, check, whole

Bounds = Mapping[str, tuple[float, float]]

_PIECE = 2**16


class AbstractPlan(ABC):
    """A numbered list of variants.

    Attributes:
        names: names of the parameters, in the order of the columns of `rows`.
        low, high: range of every parameter.
        size: number of variants.
    """

    def __init__(self, names: tuple[str, ...], low: Iterable[float], high: Iterable[float], size: int) -> None:
        self.names, self.low, self.high, self.size = names, tuple(map(float, low)), tuple(map(float, high)), size

    @abstractmethod
    def _rows(self, start: int, stop: int) -> np.ndarray:
        """Rows of a range that is within the plan."""

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """All data that determine the rows, as plain data."""

    def rows(self, start: int, stop: int) -> np.ndarray:
        """Parameter values of the variants `start` to `stop - 1`.

        The values of a variant do not depend on the range, and only the range is in memory.

        Returns:
            float64, shape (stop - start, len(names)).

        Raises:
            IndexError: for a range that leaves the plan.
        """
        if not 0 <= start <= stop <= self.size:
            raise IndexError(f"rows {start} to {stop} are not within the {self.size} variants of the plan")
        return self._rows(start, stop)


class FullFactorial(AbstractPlan):
    """Every combination of the levels of all parameters; the last parameter varies fastest.

    Attributes:
        levels: values of every parameter.
    """

    def __init__(self, bounds: Bounds, levels: int | Mapping[str, int | Sequence[float]]) -> None:
        """Makes the plan.

        Args:
            bounds: (low, high) of every parameter.
            levels: number of evenly spaced levels from low to high, at least 2, or the values themselves; one number
                for all parameters, or one entry per parameter.

        Raises:
            ValueError: for wrong bounds, missing or unknown parameters, and levels outside the bounds.
        """
        names, low, high = box(bounds)
        each = {name: levels for name in names} if isinstance(levels, int) else dict(levels)
        if set(each) != set(names):
            odd = sorted(set(each) ^ set(names))
            raise ValueError(f"FullFactorial: levels must be given for {', '.join(names)} ({', '.join(odd)} differ)")
        values = tuple(_levels(name, each[name], *bounds[name]) for name in names)
        size = math.prod(len(value) for value in values)
        super().__init__(names, low, high, whole("FullFactorial: number of combinations", size))
        self.levels = values

    def _rows(self, start, stop):
        number = np.arange(start, stop, dtype=np.int64)
        table = np.empty((stop - start, len(self.names)))
        for column in reversed(range(len(self.names))):
            values = self.levels[column]
            number, digit = np.divmod(number, len(values))
            table[:, column] = values[digit]
        return table

    def describe(self) -> dict[str, Any]:
        levels = {name: values.tolist() for name, values in zip(self.names, self.levels)}
        return {"sampling": "full_factorial", "levels": levels}


class VariantList(AbstractPlan):
    """Variants given as a table.

    Attributes:
        values: parameter values, float64, shape (size, names).
    """

    def __init__(self, names: Sequence[str], values: Numbers) -> None:
        """Makes the plan.

        Args:
            names: names of the parameters.
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

    def describe(self) -> dict[str, Any]:
        digest = hashlib.sha256()
        for start in range(0, self.size, _PIECE):
            digest.update(self.values[start : start + _PIECE].tobytes())
        return {"sampling": "list", "names": list(self.names), "sha256": digest.hexdigest()}


def box(bounds: Bounds) -> tuple[tuple[str, ...], tuple[float, ...], tuple[float, ...]]:
    """Names, lower and upper bounds, checked.

    Raises:
        ValueError: for no parameter, and for bounds that are not finite or do not ascend.
    """
    if not isinstance(bounds, Mapping):
        kind = type(bounds).__name__
        raise ValueError(f'bounds is a {kind}, must be a dict such as {{"amount": (0.0, 20.0)}}')
    if not bounds:
        raise ValueError("bounds must name at least one parameter")
    for name, ends in bounds.items():
        if np.shape(ends) != (2,):
            raise ValueError(f"bounds of {name} = {ends!r} must be two numbers, (low, high)")
        low, high = ends
        check(f"lower bound of {name}", low, "")
        check(f"upper bound of {name}", high, "", low=low, open_low=True)
    return tuple(bounds), tuple(low for low, _ in bounds.values()), tuple(high for _, high in bounds.values())


def _finite(values: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(values), values, np.nan)


def _levels(name: str, given, low: float, high: float) -> np.ndarray:
    if isinstance(given, int | np.integer):
        return np.linspace(low, high, whole(f"FullFactorial: levels of {name}", given, low=2))
    values = np.asarray(given, np.float64)
    if values.ndim != 1 or not len(values) or len(np.unique(values)) != len(values):
        raise ValueError(f"FullFactorial: levels of {name} must be a count or a list of different values")
    check(f"FullFactorial: levels of {name}", values, "", low=low, high=high)
    return values


_ROUNDS = 8  # of the Feistel network; four already make a pseudo-random permutation (Luby and Rackoff 1988)
_SOBOL_BITS = 30  # scipy's default: 2^30 points
_PHILOX_WORDS = 4  # random numbers per counter of the generator


class _Sampling(AbstractPlan):
    """Samples of the unit box, scaled to the bounds."""

    _kind: ClassVar[str]

    def __init__(self, bounds: Bounds, samples: int, *, seed: int):
        """Makes the plan.

        Args:
            bounds: (low, high) of every parameter.
            samples: number of variants.
            seed: seed of the random numbers.

        Raises:
            ValueError: for wrong bounds, samples or seed.
        """
        super().__init__(*box(bounds), whole("samples", samples))
        self.seed = whole("seed", seed, low=0)

    @abstractmethod
    def _points(self, start: int, stop: int) -> np.ndarray:
        """Rows of a range in the unit box."""

    def _rows(self, start, stop):
        low, high = np.asarray(self.low), np.asarray(self.high)
        return low + self._points(start, stop) * (high - low)

    def describe(self):
        bounds = {name: [low, high] for name, low, high in zip(self.names, self.low, self.high)}
        return {"sampling": self._kind, "bounds": bounds, "samples": self.size, "seed": self.seed}


class LatinHypercube(_Sampling):
    """Latin hypercube: each parameter's range is cut into `samples` strata and every stratum is hit exactly once.

    Row i lies in stratum p(i) of a parameter, at a random place in it, where p is a random permutation. Permutations
    of ten million strata would be tables of ten million numbers per parameter, so p is a keyed bijection that is
    computed number by number: a Feistel network over pairs (left, right) with left * right just above `samples`, whose
    round functions are random tables of about sqrt(samples) entries. A number that lands beyond the last stratum goes
    through the network again until it lands within (cycle walking), which keeps it a bijection.

    References:
        J. Black, P. Rogaway, Ciphers with arbitrary finite domains, CT-RSA 2002.
    """

    _kind = "latin_hypercube"

    def __init__(self, bounds: Bounds, samples: int, *, seed: int) -> None:
        super().__init__(bounds, samples, seed=seed)
        streams = np.random.SeedSequence(self.seed).spawn(len(self.names) + 1)
        self._permutations = [_Permutation(self.size, stream) for stream in streams[1:]]
        self._key = streams[0].generate_state(2, np.uint64)

    def _points(self, start, stop):
        number = np.arange(start, stop, dtype=np.int64)
        strata = np.stack([permutation(number) for permutation in self._permutations], axis=1)
        return (strata + self._places(start, stop)) / self.size

    def _places(self, start: int, stop: int) -> np.ndarray:
        """Uniform random numbers in [0, 1), the same for a row in whichever range it is asked for."""
        width = len(self.names)
        first, skipped = divmod(start * width, _PHILOX_WORDS)
        stream = np.random.Philox(key=self._key)
        stream.advance(first)
        return np.random.Generator(stream).random(skipped + (stop - start) * width)[skipped:].reshape(-1, width)


class _Permutation:
    """A random permutation of 0 ... size - 1 that is computed, not stored; see `LatinHypercube`."""

    def __init__(self, size: int, seed: np.random.SeedSequence) -> None:
        self._size = size
        self._right = math.isqrt(size - 1) + 1
        self._left = -(-size // self._right)
        random = np.random.default_rng(seed)
        sizes = ((self._left, self._right), (self._right, self._left))
        self._tables = [random.integers(sizes[i % 2][0], size=sizes[i % 2][1]) for i in range(_ROUNDS)]

    def __call__(self, number: np.ndarray) -> np.ndarray:
        """Images of int64 numbers."""
        image = self._network(number)
        beyond = np.flatnonzero(image >= self._size)
        while len(beyond):
            image[beyond] = self._network(image[beyond])
            beyond = beyond[image[beyond] >= self._size]
        return image

    def _network(self, number: np.ndarray) -> np.ndarray:
        left, right = np.divmod(number, self._right)
        for step, table in enumerate(self._tables):
            if step % 2 == 0:
                left = left + table[right]
                left = np.where(left >= self._left, left - self._left, left)
            else:
                right = right + table[left]
                right = np.where(right >= self._right, right - self._right, right)
        return left * self._right + right


class Sobol(_Sampling):
    """Scrambled Sobol sequence, the one of `scipy.stats.qmc.Sobol` with the same seed.

    Sequential ranges continue the sequence, a range further on fast-forwards to its start, and only a range further
    back starts anew: a sweep costs one pass over the sequence however many parts it has. There are at most 2^30
    samples; a power of two is balanced best.
    """

    _kind = "sobol"

    def __init__(self, bounds: Bounds, samples: int, *, seed: int) -> None:
        super().__init__(bounds, samples, seed=seed)
        if self.size > 2**_SOBOL_BITS:
            raise ValueError(f"Sobol: samples = {samples} must be at most 2^{_SOBOL_BITS} = {2**_SOBOL_BITS}")
        self._engine: Any = None

    def _points(self, start, stop):
        engine = self._engine
        if engine is None or engine.num_generated > start:
            engine = scipy.stats.qmc.Sobol(len(self.names), scramble=True, bits=_SOBOL_BITS, rng=self.seed)
            self._engine = engine
        if engine.num_generated < start:
            engine.fast_forward(start - engine.num_generated)
        if start > 0 or stop <= 1:
            return engine.random(stop - start) if stop > start else np.empty((0, len(self.names)))
        # scipy warns when the first call asks for other than a power of two points: a first call for one point is quiet
        return np.concatenate([engine.random(1), engine.random(stop - 1)])
