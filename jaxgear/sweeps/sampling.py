"""Plans that fill the box of the parameters: Latin hypercube and Sobol sequence."""

import math
from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
import scipy  # its packages load when they are used: scipy.stats takes a second

from ..numerics import whole
from .plan import AbstractPlan, Bounds, box

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
            seed: of the random numbers.

        Raises:
            ValueError: for wrong bounds, samples or seed.
        """
        owner = type(self).__name__
        super().__init__(*box(owner, bounds), whole(owner, "samples", samples))
        self.seed = whole(owner, "seed", seed, low=0)

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

    def __init__(self, bounds: Bounds, samples: int, *, seed: int):
        super().__init__(bounds, samples, seed=seed)
        streams = np.random.SeedSequence(self.seed).spawn(len(self.names) + 1)
        self._permutations = [Permutation(self.size, stream) for stream in streams[1:]]
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


class Sobol(_Sampling):
    """Scrambled Sobol sequence, the one of `scipy.stats.qmc.Sobol` with the same seed.

    Sequential ranges continue the sequence, a range further on fast-forwards to its start, and only a range further
    back starts anew: a sweep costs one pass over the sequence however many parts it has. There are at most 2^30
    samples; a power of two is balanced best.
    """

    _kind = "sobol"

    def __init__(self, bounds: Bounds, samples: int, *, seed: int):
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
