"""Plans that fill the box of the parameters: Latin hypercube and Sobol sequence."""

import math
from typing import Any

import numpy as np
from scipy.stats import qmc

from ..numerics import whole
from .plan import AbstractPlan, Bounds, box

_ROUNDS = 8  # of the Feistel network; four already make a pseudo-random permutation (Luby and Rackoff 1988)
_SOBOL_BITS = 30  # scipy's default: 2^30 points
_PHILOX_WORDS = 4  # random numbers per counter of the generator


class LatinHypercube(AbstractPlan):
    """Latin hypercube: each parameter's range is cut into `samples` strata and every stratum is hit exactly once.

    Row i lies in stratum p(i) of a parameter, at a random place in it, where p is a random permutation. Permutations
    of ten million strata would be tables of ten million numbers per parameter, so p is a keyed bijection that is
    computed number by number: a Feistel network over pairs (left, right) with left * right just above `samples`, whose
    round functions are random tables of about sqrt(samples) entries. A number that lands beyond the last stratum goes
    through the network again until it lands within (cycle walking), which keeps it a bijection.

    References:
        J. Black, P. Rogaway, Ciphers with arbitrary finite domains, CT-RSA 2002.
    """

    def __init__(self, bounds: Bounds, samples: int, *, seed: int):
        """Makes the plan.

        Args:
            bounds: (low, high) of every parameter.
            samples: number of variants, and of strata.
            seed: of permutations and places.

        Raises:
            ValueError: for wrong bounds, samples or seed.
        """
        names, low, high = box("LatinHypercube", bounds)
        super().__init__(names, low, high, whole("LatinHypercube", "samples", samples))
        self.seed = whole("LatinHypercube", "seed", seed, low=0)
        streams = np.random.SeedSequence(self.seed).spawn(len(names) + 1)
        self._permutations = [Permutation(self.size, stream) for stream in streams[1:]]
        self._key = streams[0].generate_state(2, np.uint64)

    def _rows(self, start, stop):
        number = np.arange(start, stop, dtype=np.int64)
        strata = np.stack([permutation(number) for permutation in self._permutations], axis=1)
        return _scaled(self, (strata + self._places(start, stop)) / self.size)

    def _places(self, start: int, stop: int) -> np.ndarray:
        """Uniform random numbers in [0, 1), the same for a row in whichever range it is asked for."""
        width = len(self.names)
        first, skipped = divmod(start * width, _PHILOX_WORDS)
        stream = np.random.Philox(key=self._key)
        stream.advance(first)
        return np.random.Generator(stream).random(skipped + (stop - start) * width)[skipped:].reshape(-1, width)

    def describe(self):
        return {"sampling": "latin_hypercube", **_box(self), "samples": self.size, "seed": self.seed}


class Permutation:
    """A random permutation of 0 ... size - 1 that is computed, not stored; see `LatinHypercube`."""

    def __init__(self, size: int, seed: np.random.SeedSequence):
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


class Sobol(AbstractPlan):
    """Scrambled Sobol sequence, the one of `scipy.stats.qmc.Sobol` with the same seed.

    Sequential ranges continue the sequence, a range further on fast-forwards to its start, and only a range further
    back starts anew: a sweep costs one pass over the sequence however many parts it has.
    """

    def __init__(self, bounds: Bounds, samples: int, *, seed: int):
        """Makes the plan.

        Args:
            bounds: (low, high) of every parameter.
            samples: number of variants, at most 2^30; a power of two is balanced best.
            seed: of the scrambling.

        Raises:
            ValueError: for wrong bounds, samples or seed.
        """
        names, low, high = box("Sobol", bounds)
        if whole("Sobol", "samples", samples) > 2**_SOBOL_BITS:
            raise ValueError(f"Sobol: samples = {samples} must be at most 2^{_SOBOL_BITS} = {2**_SOBOL_BITS}")
        super().__init__(names, low, high, int(samples))
        self.seed = whole("Sobol", "seed", seed, low=0)
        self._engine: qmc.Sobol | None = None

    def _rows(self, start, stop):
        return _scaled(self, self._points(start, stop))

    def _points(self, start: int, stop: int) -> np.ndarray:
        engine = self._engine
        if engine is None or engine.num_generated > start:
            engine = qmc.Sobol(len(self.names), scramble=True, bits=_SOBOL_BITS, rng=self.seed)
            self._engine = engine
        if engine.num_generated < start:
            engine.fast_forward(start - engine.num_generated)
        if start > 0 or stop <= 1:
            return engine.random(stop - start) if stop > start else np.empty((0, len(self.names)))
        # scipy warns when the first call asks for other than a power of two points: a first call for one point is quiet
        return np.concatenate([engine.random(1), engine.random(stop - 1)])

    def describe(self):
        return {"sampling": "sobol", **_box(self), "samples": self.size, "seed": self.seed}


def _scaled(plan: AbstractPlan, unit: np.ndarray) -> np.ndarray:
    low, high = np.asarray(plan.low), np.asarray(plan.high)
    return low + unit * (high - low)


def _box(plan: AbstractPlan) -> dict[str, Any]:
    return {"bounds": {name: [low, high] for name, low, high in zip(plan.names, plan.low, plan.high)}}
