"""PPTE of one variant after the other with SciPy: a standard root finder and an active-set loop at every position."""

from dataclasses import fields

import numpy as np
from scipy.optimize import root

from .law import Law, deflection
from .problem import Problem, removed


class ScipyKernel:
    """All pairs of the mesh, one slice; the unknowns are the loads of the closed pairs and the approach."""

    def __init__(self, problem: Problem):
        """Raises `ValueError` for more than one slice."""
        if len(problem.slice_width) != 1:
            raise ValueError("ScipyKernel: written for one slice")
        self._problem = problem

    def ppte(self, variants: np.ndarray) -> np.ndarray:
        """Peak-to-peak transmission error [um], shape (variants,)."""
        gaps = self._problem.corner_gap + removed(self._problem, variants)
        positions = range(gaps.shape[-1])
        return np.array([np.ptp([self._approach(gap[:, n], n) for n in positions]) for gap in gaps])

    def _approach(self, gap: np.ndarray, position: int) -> float:
        """Adds the pair that penetrates most, or drops one that pulls, until neither is left."""
        lever, structure = self._problem.lever[:, position], self._problem.structure[:, :, position]
        closed = [int(np.argmin(gap / lever))]
        for _ in range(4 * len(gap)):
            load, approach = self._balance(gap, position, closed)
            if min(load) < 0:
                del closed[int(np.argmin(load))]
                continue
            opening = gap + structure[:, closed] @ load - lever * approach
            opening[closed] = 0.0
            if opening.min() >= 0:
                return approach
            closed.append(int(np.argmin(opening)))
        raise RuntimeError("the active set does not settle")

    def _balance(self, gap: np.ndarray, position: int, closed: list[int]):
        """Loads and approach of the closed pairs."""
        problem = self._problem
        lever, gap = problem.lever[closed, position], gap[closed]
        structure = problem.structure[np.ix_(closed, closed)][..., position]
        law = Law(**{field.name: getattr(problem.law, field.name)[..., closed, position] for field in fields(Law)})
        width = problem.slice_width[0]
        # the approach is measured in units of the load, so that the unknowns are of the same size
        scale = problem.force / width / 10

        def conditions(unknown):
            load, approach = unknown[:-1], unknown[-1] / scale
            # below zero the law goes on as a straight line through the origin
            stiff, slope = deflection(law, np.maximum(load, 0.0))
            stiff = np.where(load > 0, stiff, slope * load)
            mismatch = structure @ load + stiff + gap - lever * approach
            jacobian = np.block([[structure + np.diag(slope), -lever[:, None] / scale], [lever, np.zeros(1)]])
            return np.append(mismatch, lever @ load - problem.force / width), jacobian

        start = np.append(np.full(len(closed), problem.force / width / len(closed)), (gap.max() + 10) * scale)
        found = root(conditions, start, jac=True, tol=1e-12)
        if np.abs(found.fun).max() > 1e-8:
            raise RuntimeError(f"no solution at position {position}: {found.message}")
        return found.x[:-1], found.x[-1] / scale
