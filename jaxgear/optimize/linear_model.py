"""Linearizations of a problem at many points, and the best step of a linearized problem as a linear program.

A peak-to-peak value is the largest minus the smallest of many smooth values. Each value is linearized separately and
the extremes stay exact, so that the model contains the kinks that stop a gradient method (K. Madsen, J. Inst. Maths
Applics 16 (1975) 321). Mean, worst case and conditional value at risk over the cases are linear programs too
(Rockafellar and Uryasev 2000, doi 10.21314/JOR.2000.038); other measures use the weights of the cases at the point.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy

from ..conditions.join import padded
from ..contact.mesh import later, parts
from ..numerics import AbstractMeasure, CVaR, Worst, kernel, program
from .goal import FEASIBLE
from .linearization import Linearization, Pieces
from .problem import Problem, real_points


class Linearizer:
    """Linearize a problem at points of the unit box.

    If a problem contains only extremes over the positions, a fine mesh is split into meshes of fewer positions: a
    search that continues on the fine mesh reuses the compiled program.

    Args:
        problem: the problem.
        batch: number of points per call of the compiled program.
        positions: number of positions of the compiled program; None for the number of the mesh.
    """

    def __init__(self, problem: Problem, batch: int, positions: int | None = None) -> None:
        self.problem, self.batch = problem, batch
        self._positions = positions or problem.mesh.resolution.positions
        meshes = parts(problem.mesh, self._positions) if problem.is_made_of_extremes else []
        self._parts = [problem.on(mesh) for mesh in meshes] if len(meshes) > 1 else [problem]

    def on(self, problem: Problem) -> "Linearizer":
        """Linearizer of the problem on another mesh, split into the same number of positions to reuse the program."""
        return Linearizer(problem, self.batch, self._positions)

    def __call__(self, points: np.ndarray) -> list[Linearization]:
        """Linearizations at points of the unit box, shape (points, parameters)."""
        return [_joined(each) for each in self._at_parts(points)]

    def at_more_positions(self, points: np.ndarray) -> list[tuple[Linearization, Linearization]] | None:
        """Linearizations at two and four times the positions by the same program; None if not all are extremes."""
        if not self.problem.is_made_of_extremes:
            return None
        half, *quarters = (self.on(self.problem.on(later(self.problem.mesh, share))) for share in (0.5, 0.25, 0.75))
        twice = zip(self._at_parts(points), half._at_parts(points))
        between = zip(*(each._at_parts(points) for each in quarters))
        return [
            (_joined([*own, *other]), _joined([*own, *other, *first, *last]))
            for (own, other), (first, last) in zip(twice, between)
        ]

    def _at_parts(self, points: np.ndarray) -> list[list[Linearization]]:
        """Linearizations on each of the meshes, for every point."""
        found = []
        for part in self._parts:
            rows = _linearizations(part, real_points(part, padded(points, self.batch)), np.asarray(len(points)))
            leaves, tree = jax.tree.flatten(rows)
            found.append(([np.asarray(leaf) for leaf in leaves], tree))
        return [
            [jax.tree.unflatten(tree, [leaf[row] for leaf in leaves]) for leaves, tree in found]
            for row in range(len(points))
        ]


def _joined(each: list[Linearization]) -> Linearization:
    """Linearization over all positions, joined from linearizations over parts of the positions."""
    if len(each) == 1:
        return each[0]
    objectives = tuple(map(_together, zip(*(part.objectives for part in each))))
    limits = tuple(map(_together, zip(*(part.limits for part in each))))
    return Linearization(objectives, limits, np.asarray(all(part.fine for part in each)))


def _together(each: tuple[Pieces, ...]) -> Pieces:
    return jax.tree.map(lambda *arrays: np.concatenate(arrays, axis=1), *each)


@kernel
def _linearizations(problem: Problem, points, count) -> Linearization:
    """Linearizations at the points; rows beyond the first `count` may be arbitrary."""
    if jax.default_backend() != "cpu":  # an accelerator needs all of them to be busy
        return jax.vmap(problem.linearize)(points)
    # one point after the other: as quick on a processor, whose cores a single analysis keeps busy, and compiled in half
    # the time; jit has it traced once for both its shapes and the loop
    linearize = jax.jit(lambda point: problem.linearize(point), inline=True)  # a method of tracers has no hash
    nothing = jax.tree.map(
        lambda leaf: jnp.zeros((len(points), *leaf.shape), leaf.dtype), jax.eval_shape(linearize, points[0])
    )

    def with_row(row, found):
        return jax.tree.map(lambda rows, one: rows.at[row].set(one), found, linearize(points[row]))

    return jax.lax.fori_loop(0, count, with_row, nothing)


# Weight of a relative violation of 1 against the objective at the start of a search (at least 1 in its own unit): above
# the multiplier of any sensible constraint, so that the penalty is exact.
PENALTY = 100.0


class Step(NamedTuple):
    """Solution of the linear program.

    Attributes:
        step: step in the unit box, shape (parameters,).
        decrease: predicted decrease of the penalized objective.
    """

    step: np.ndarray
    decrease: float


class AbstractScalarization(ABC):
    """Scalarization of several objectives: the largest scaled objective plus `part` times the sum of all.

    Attributes:
        part: factor of the sum.
    """

    part: float

    @abstractmethod
    def scales(self) -> tuple[np.ndarray, np.ndarray]:
        """Factor and offset of every objective."""

    def join(self, values: np.ndarray) -> np.ndarray:
        """Scalarized value of the objectives on the last axis."""
        factor, offset = self.scales()
        scaled = factor * values + offset
        return scaled.max(axis=-1) + self.part * scaled.sum(axis=-1)


class NoObjective(AbstractScalarization):
    """Zero objective, for searches that minimize only the violation of the limits."""

    part = 0.0

    def __init__(self, objectives: int) -> None:
        self._none = np.zeros(objectives)

    def scales(self) -> tuple[np.ndarray, np.ndarray]:
        """Zero factor and offset of every objective."""
        return self._none, self._none


class LinearModel:
    """Linear model of a problem at a point: objectives, limits, measures over cases, and penalty.

    Args:
        problem: the problem.
        x: point of the unit box, shape (parameters,).
        linearization: linearization of the problem at the point.
        scalarization: scalarization of several objectives; None for a single one.
        penalty: penalty of a relative violation of 1; None to scale it by the objective at the point.

    Attributes:
        values: objectives at the point, shape (objectives,); inf if a contact has not converged.
    """

    def __init__(
        self,
        problem: Problem,
        x: np.ndarray,
        linearization: Linearization,
        scalarization: AbstractScalarization | None = None,
        penalty: float | None = None,
    ) -> None:
        self._lin: Linearization = jax.tree.map(lambda part: np.asarray(part, float), linearization)
        self._measure, self._weights = problem.measure, np.asarray(problem.cases.weights, float)
        self._shares, self.values = self._measured_cases()
        self._scalarization = scalarization
        self._x, roughness = np.asarray(x, float), problem.roughness
        self._forms = np.zeros((0, len(x))) if roughness is None else np.asarray(roughness.forms, float)
        self._rough_weight = 0.0 if roughness is None else float(roughness.weight)
        if penalty is None:  # scaled objectives are of about 1
            size = abs(self.value) if self.fine and scalarization is None else 1.0
            penalty = PENALTY * max(1.0, size)
        self.penalty = penalty

    @property
    def fine(self) -> bool:
        """True if all contact solutions have converged and all values are finite."""
        return bool(self._lin.fine)

    @property
    def value(self) -> float:
        """Scalarized objective at the point with the penalty of the roughness; inf if not converged."""
        if not self.fine:
            return np.inf
        rough = np.abs(self._forms @ self._x).max(initial=0.0)
        joined = self.values[0] if self._scalarization is None else self._scalarization.join(self.values)
        return float(joined) + self._rough_weight * float(rough)

    @property
    def violation(self) -> float:
        """Largest relative excess over a constraint."""
        return max([0.0, *(float(pieces.value.max()) for pieces in self._lin.limits)])

    @property
    def merit(self) -> float:
        """Objective plus penalty times violation at the point."""
        return self.value + self.penalty * self.violation

    def best_step(self, radius: float) -> Step:
        """Step with the largest predicted decrease within `radius` of every parameter and within the unit box."""
        x = self._x
        low, high = np.maximum(-radius, -x), np.minimum(radius, 1 - x)
        program = _Program(len(x))
        cost, offset = self._cost(program, low, high)
        if self._lin.limits:
            (slack,) = program.variables(1, low=0.0)  # the largest violation
            for pieces in self._lin.limits:
                for case in range(len(pieces.upper)):
                    _below(program, pieces, case, low, high, slack)
            cost[slack] = self.penalty
        if len(self._forms):
            (rough,) = program.variables(1)
            for sign in (1.0, -1.0):
                program.at_most(sign * self._forms, -sign * (self._forms @ x), {rough: -1.0})
            cost[rough] = self._rough_weight
        found = program.solve(cost, low, high)
        if found is None:
            return Step(np.zeros_like(x), 0.0)
        step, predicted = found
        return Step(step, self.merit - predicted - offset)

    def optimality(self, reach: float) -> float:
        """First-order optimality: largest predicted decrease over a distance `reach`, divided by it; NaN without
        slopes.

        A constraint that is violated within the tolerance counts as met exactly.
        """
        if not self.fine:
            return np.nan
        settled = copy(self)
        settled._lin = self._lin._replace(limits=tuple(map(_settled, self._lin.limits)))
        return max(settled.best_step(reach).decrease / reach, 0.0)

    def _measured_cases(self) -> tuple[list[np.ndarray], np.ndarray]:
        """Weights of the cases in every objective, and the values of the objectives."""
        if not self.fine:
            return [], np.full(len(self._lin.objectives), np.inf)
        cases = [pieces.value for pieces in self._lin.objectives]
        shares = [np.asarray(_shares(self._measure, each, self._weights)) for each in cases]
        return shares, np.asarray([share @ each for share, each in zip(shares, cases)])

    def _cost(self, program: "_Program", low, high) -> tuple[dict[int, float], float]:
        """Coefficients of the scalarized objective over the variables, and its constant."""
        pairs = zip(self._lin.objectives, self._shares)
        each = [self._measured(program, pieces, shares, low, high) for pieces, shares in pairs]
        if self._scalarization is None:
            return each[0], 0.0
        (largest,) = program.variables(1)
        cost, constant = {largest: 1.0}, 0.0
        part = self._scalarization.part
        for expression, factor, offset in zip(each, *self._scalarization.scales()):
            scaled = {column: factor * value for column, value in expression.items()}
            program.at_most(program.nothing, np.array([-offset]), {**scaled, largest: -1.0})
            cost |= {column: part * value for column, value in scaled.items()}
            constant += part * offset
        return cost, constant

    def _measured(self, program: "_Program", pieces: Pieces, shares: np.ndarray, low, high) -> dict[int, float]:
        """Coefficients of an objective over the variables; adds the rows of the measure to the program."""
        measure = self._measure
        weights = self._weights if isinstance(measure, Worst | CVaR) else shares
        carrying = np.flatnonzero(weights > 0)
        spans = [_span(program, pieces, int(case), low, high) for case in carrying]
        weights = weights[carrying]
        if isinstance(measure, Worst):
            (worst,) = program.variables(1)
            for span in spans:
                program.at_most(program.nothing, np.zeros(1), {**span, worst: -1.0})
            return {worst: 1.0}
        if isinstance(measure, CVaR):
            (threshold,) = program.variables(1)
            cost = {threshold: 1.0}
            tail = weights / weights.sum() / (1 - float(measure.level))
            for span, weight in zip(spans, tail):
                (beyond,) = program.variables(1, low=0.0)
                program.at_most(program.nothing, np.zeros(1), {**span, threshold: -1.0, beyond: -1.0})
                cost[beyond] = weight
            return cost
        return {column: weight * sign for span, weight in zip(spans, weights) for column, sign in span.items()}


@program
def _shares(measure: AbstractMeasure, values, weights):
    return measure.shares(values, weights)


def _settled(pieces: Pieces) -> Pieces:
    """Pieces of a limit, shifted so that a violation within the tolerance is zero."""
    excess = pieces.value
    passed = np.where((excess > 0) & (excess <= FEASIBLE), excess, 0.0)
    return pieces._replace(upper=pieces.upper - passed[:, None])


def _span(program: "_Program", pieces: Pieces, case: int, low, high) -> Mapping[int, float]:
    """Bounds of the upper and the lower pieces of a case as variables, with their signs in the value."""
    (top,) = program.variables(1)
    _below(program, Pieces(pieces.upper, pieces.slope), case, low, high, top)
    return {top: 1.0, **_bottom(program, pieces, case, low, high)}


def _below(program: "_Program", pieces: Pieces, case: int, low, high, bound: int) -> None:
    """Add rows that keep the value of a case below a variable."""
    values, slope = _reachable(pieces.upper[case], pieces.slope[case], low, high)
    program.at_most(slope, -values, {bound: -1.0, **_bottom(program, pieces, case, low, high)})


def _bottom(program: "_Program", pieces: Pieces, case: int, low, high) -> dict[int, float]:
    """Add a variable below all lower pieces of a case; empty without lower pieces."""
    if pieces.lower is None or pieces.lower_slope is None:
        return {}
    (bottom,) = program.variables(1)
    values, slope = _reachable(-pieces.lower[case], -pieces.lower_slope[case], low, high)
    program.at_most(slope, -values, {bottom: 1.0})
    return {bottom: -1.0}


def _reachable(values, slope, low, high):
    """Pieces that can become the largest for some step between `low` and `high`."""
    most = values + np.maximum(slope * low, slope * high).sum(axis=1)
    least = values + np.minimum(slope * low, slope * high).sum(axis=1)
    near = most >= least.max()
    return values[near], slope[near]


class _Program:
    """A linear program over the step and further variables, built row by row."""

    def __init__(self, parameters: int):
        self.parameters = parameters
        self.nothing = np.zeros((1, parameters))  # a row in which the step has no part
        self._lows: list[float | None] = []
        self._rows: list[tuple[np.ndarray, dict[int, float]]] = []
        self._limits: list[np.ndarray] = []

    def variables(self, count: int, low: float | None = None) -> list[int]:
        """Numbers of new variables, free or bounded from below."""
        first = self.parameters + len(self._lows)
        self._lows += [low] * count
        return list(range(first, first + count))

    def at_most(self, slope: np.ndarray | jax.Array, limit: np.ndarray | jax.Array, others: dict[int, float]) -> None:
        """Rows slope @ step + sum of the other variables times their coefficients <= limit."""
        self._rows.append((np.asarray(slope), others))
        self._limits.append(np.asarray(limit))

    def solve(self, cost: dict[int, float], low, high) -> tuple[np.ndarray, float] | None:
        """Optimal step and cost; None if the solver fails."""
        size = self.parameters + len(self._lows)
        matrix = np.zeros((sum(map(len, self._limits)), size))
        start = 0
        for slope, others in self._rows:
            rows = slice(start, start + len(slope))
            matrix[rows, : self.parameters] = slope
            for column, value in others.items():
                matrix[rows, column] = value
            start = rows.stop
        coefficients = np.zeros(size)
        for column, value in cost.items():
            coefficients[column] = value
        lowest = [-np.inf if bound is None else bound for bound in self._lows]
        # a mixed-integer program without integers: the solver of `linprog` with less overhead
        found = scipy.optimize.milp(
            coefficients,
            constraints=scipy.optimize.LinearConstraint(matrix, -np.inf, np.concatenate(self._limits)),
            bounds=scipy.optimize.Bounds([*low, *lowest], [*high, *np.full(len(lowest), np.inf)]),
        )
        if not found.success:
            return None
        return np.clip(found.x[: self.parameters], low, high), float(found.fun)
