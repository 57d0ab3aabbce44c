"""PPTE of a batch of variants in pure NumPy: Newton's method on the active set, all variants and positions at once."""

from dataclasses import fields

import numpy as np

from .law import Law, deflection
from .problem import Problem, removed, two_candidates

_STEPS = 30
# change of the approach [um] that ends the iteration; convergence is quadratic, so the error is far smaller
_SMALL = 1e-9


class NumpyKernel:
    """Evaluates variants in batches whose arrays fit the cache.

    On one core: threads do not help, since Python's lock is held between the many short operations.
    """

    def __init__(self, problem: Problem, *, batch: int = 64):
        """Prepares the two candidate pairs of every position; `batch` variants share one NumPy call."""
        self._problem = two_candidates(problem)
        self._batch = batch
        # arrays (pairs, variants, slices, positions)
        law = self._problem.law
        self._law = Law(**{field.name: getattr(law, field.name)[..., None, None, :] for field in fields(Law)})

    def ppte(self, variants: np.ndarray) -> np.ndarray:
        """Peak-to-peak transmission error [um], shape (variants,)."""
        batches = [variants[i : i + self._batch] for i in range(0, len(variants), self._batch)]
        return np.concatenate([np.ptp(self._approach(batch), axis=-1) for batch in batches])

    def _approach(self, variants: np.ndarray) -> np.ndarray:
        problem = self._problem
        width = problem.slice_width[:, None]
        lever = problem.lever[:, None, None]
        own = np.stack([problem.structure[0, 0], problem.structure[1, 1]])[:, None, None]
        coupling = problem.structure[0, 1]
        gap = (problem.corner_gap + removed(problem, variants)).swapaxes(0, 1)[:, :, None]
        gap = gap + problem.crowning[:, None]
        load = np.full(gap.shape, problem.force / problem.slice_width.sum())
        stiff, slope = deflection(self._law, load)
        # the approach stays below that of any pair that bears the load alone
        bound = np.min(np.max((gap + stiff + own * load / lever) / lever, axis=2), axis=0)
        active = lever * bound[:, None] > gap
        approach = bound
        for _ in range(_STEPS):
            before = approach
            known = np.where(active, slope * load - stiff - gap, 0.0)
            closing = np.where(active, lever, 0.0)
            first, second = np.where(active, own + slope, 1.0)
            both = np.where(active[0] & active[1], coupling, 0.0)
            scale = 1 / (first * second - both**2)
            inverse = scale * second, scale * first, -scale * both
            part = _apply(inverse, known)
            unit = _apply(inverse, closing)
            carried, stiffness = ((width * closing * x).sum(axis=(0, 2)) for x in (part, unit))
            approach = (problem.force - carried) / stiffness
            load = np.maximum(part + unit * approach[:, None], 0.0)
            if np.max(np.abs(approach - before)) < _SMALL:
                return approach
            stiff, slope = deflection(self._law, load)
            mismatch = own * load + coupling * load[::-1] + stiff + gap - lever * approach[:, None]
            active = (own + slope) * load > mismatch
        raise RuntimeError(f"no convergence in {_STEPS} steps")


def _apply(inverse, right):
    first, second, mixed = inverse
    return np.stack([first * right[0] + mixed * right[1], mixed * right[0] + second * right[1]])
