"""The optimization problem that all methods share: a box of parameters, cases, objectives and constraints."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..conditions import Cases, solved
from ..contact import Mesh, removed_material, solve_removed
from ..metrics import smooth_peak_to_peak
from ..microgeometry import AbstractModification, NoModification
from ..numerics import AbstractMeasure, check, maximum, real
from .goal import PPTE, Candidate, Constraint, Number, known, number

Scalar = Float[Array, ""]
Vector = Float[Array, " parameters"]
Parameters = Mapping[str, Scalar]
Modifications = tuple[AbstractModification | None, AbstractModification | None]
Design = Callable[[Parameters], Modifications]

# Contact analyses that a value with its gradient counts for, and the gradient of every further number of the contact.
GRADIENT_COST = 3
_FURTHER_GRADIENT = 2


class Score(NamedTuple):
    """A design judged.

    Attributes:
        value: the true objectives, shape (objectives,); inf where a contact solution failed.
        violation: largest relative excess over a constraint, 0 where all are kept.
    """

    value: Float[Array, " objectives"]
    violation: Scalar


class Pieces(NamedTuple):
    """An objective in every case, max(upper) - min(lower), with its slopes over the unit box.

    Attributes:
        upper, lower: shape (cases, pieces).
        slope, lower_slope: of `upper` and `lower`, shape (cases, pieces, parameters).
    """

    upper: Float[Array, "cases pieces"]
    lower: Float[Array, "cases pieces"]
    slope: Float[Array, "cases pieces parameters"]
    lower_slope: Float[Array, "cases pieces parameters"]


class Linearization(NamedTuple):
    """Objectives and constraints at a point with their slopes over the unit box.

    Attributes:
        objectives: of every objective its pieces.
        excess: of the constraints, shape (constraints,), with `excess_slope`, shape (constraints, parameters).
        fine: whether all contact solutions converged.
    """

    objectives: tuple[Pieces, ...]
    excess: Float[Array, " constraints"]
    excess_slope: Float[Array, "constraints parameters"]
    fine: Bool[Array, ""]


class Roughness(eqx.Module):
    """Penalty on the largest absolute value of linear forms of the parameters, such as the curvature of a table.

    The method "minimax" alone follows it.

    Attributes:
        forms: coefficients over the unit box, shape (forms, parameters).
        weight: of the largest absolute value, in units of the objective.
    """

    forms: Float[Array, "forms parameters"]
    weight: Scalar


class Problem(eqx.Module):
    """Minimize measures of numbers over cases, within a box and constraints; parameters live in the unit box.

    Attributes:
        design: makes (pinion, wheel) modifications from the named parameters.
        names: of the parameters.
        low, high: their bounds, shape (parameters,).
        mesh: prepared mesh.
        cases: loads and manufactured gears.
        objectives: names of quantities or functions of a `Candidate`.
        measure: turns the numbers of the cases into one.
        constraints: limits that hold in every case.
        roughness: penalty on the parameters, None without.
    """

    design: Design
    names: tuple[str, ...] = eqx.field(static=True)
    low: Vector
    high: Vector
    mesh: Mesh
    cases: Cases
    objectives: tuple[str | Number, ...] = eqx.field(static=True)
    measure: AbstractMeasure
    constraints: tuple[Constraint, ...] = ()
    roughness: Roughness | None = None

    @property
    def gradient_cost(self) -> int:
        """Contact analyses that a linearization in one case counts for."""
        limits = sum(limit.of_contact for limit in self.constraints)
        return GRADIENT_COST + _FURTHER_GRADIENT * (len(self.objectives) - 1 + limits)

    def parameters(self, x: Vector) -> dict[str, Scalar]:
        """Parameters at a point of the unit box."""
        values = self.low + x * (self.high - self.low)
        return dict(zip(self.names, values))

    def modifications(self, x: Vector) -> tuple[AbstractModification, AbstractModification]:
        """Modifications at a point of the unit box."""
        pinion, wheel = self.design(self.parameters(x))
        return pinion or NoModification(), wheel or NoModification()

    def score(self, x: Vector) -> Score:
        """True objectives and violation."""

        def of_case(candidate: Candidate):
            return self._numbers(candidate, None), self._excess(candidate), solved(candidate.cycle)

        numbers, excess, fine = self.over_cases(x, of_case)
        values = self._measured(numbers)
        good = jnp.all(fine) & jnp.isfinite(jnp.sum(values)) & jnp.isfinite(jnp.sum(excess))
        return Score(jnp.where(good, values, jnp.inf), jnp.maximum(jnp.max(excess, initial=0.0), 0.0))

    def soft_and_true(self, x: Vector, width):
        """What gradient methods need of one analysis.

        Args:
            x: point of the unit box.
            width: of the soft extremes of PPTE [um].

        Returns:
            the objectives with soft extremes, the true ones, the worst excess over every constraint, and whether all
            contact solutions converged.
        """

        def of_case(candidate: Candidate):
            numbers = self._numbers(candidate, width), self._numbers(candidate, None)
            return *numbers, self._excess(candidate), solved(candidate.cycle)

        soft, true, excess, fine = self.over_cases(x, of_case)
        return self._measured(soft), self._measured(true), maximum(excess, axis=0), jnp.all(fine)

    def linearize(self, x: Vector) -> Linearization:
        """The objectives and the constraints with their slopes."""
        fine = jnp.asarray(True)
        found: dict[str | Number, Pieces] = {}
        if PPTE in self.objectives:
            curve, slope, fine = self._curves(x)
            found[PPTE] = Pieces(curve, curve, slope, slope)
        others = tuple(of for of in self.objectives if of != PPTE)
        excess, excess_slope = jnp.zeros((0,), x.dtype), jnp.zeros((0, x.shape[0]), x.dtype)
        if others or self.constraints:
            values, slopes, converged = self._numbers_and_slopes(x, others)
            if PPTE not in self.objectives:  # else the same contact solutions have been judged already
                fine = jnp.all(converged)
            for index, of in enumerate(others):
                piece, slope = values[:, index, None], slopes[:, index, None]
                found[of] = Pieces(piece, jnp.zeros_like(piece), slope, jnp.zeros_like(slope))
            excess = values[:, len(others) :].reshape(-1)
            excess_slope = slopes[:, len(others) :].reshape(-1, x.shape[0])
        objectives = tuple(found[of] for of in self.objectives)
        known = jnp.stack([jnp.sum(leaf) for leaf in jax.tree.leaves((objectives, excess, excess_slope))])
        return Linearization(objectives, excess, excess_slope, jnp.all(fine) & jnp.all(jnp.isfinite(known)))

    def _numbers_and_slopes(self, x: Vector, objectives: tuple[str | Number, ...]):
        """Objectives and excesses of every case with their slopes, and whether the contact solutions converged."""

        def at(torque, deviation):
            def numbers(x):
                candidate = self._candidate(x, torque, deviation)
                each = jnp.asarray([number(of)(candidate) for of in objectives], x.dtype)
                values = jnp.concatenate([each, self._excess(candidate)])
                return values, (values, solved(candidate.cycle))

            # case by case: the numbers of one do not depend on the others
            slopes, (values, fine) = jax.jacrev(numbers, has_aux=True)(x)
            return values, slopes, fine

        return self._each_case(at)

    def _curves(self, x: Vector):
        """Transmission error of every case, its slopes, and whether the contact solutions converged.

        The transmission error at a position depends on the material removed at that position alone, by as much as the
        contacts share the load: one gradient of the contact analysis gives the slopes at all positions.
        """

        def at(torque, deviation):
            def material(x):
                removed = self._removed(x, torque)
                return removed, removed

            def curve(removed):
                cycle = solve_removed(self.mesh, torque, removed)
                return cycle.transmission_error, solved(cycle)

            slope, removed = jax.jacfwd(material, has_aux=True)(x)
            error, back, fine = jax.vjp(curve, removed + deviation, has_aux=True)
            (share,) = back(jnp.ones_like(error))
            return error, jnp.einsum("isp,ispx->px", share, slope), fine

        return self._each_case(at)

    def _removed(self, x: Vector, torque):
        """Material that the design removes, (pairs, slices, positions)."""
        pinion, wheel = self.modifications(x)
        return removed_material(self.mesh, torque, pinion=pinion, wheel=wheel)

    def over_cases(self, x: Vector, of_case):
        """A function of a candidate in every case, cases leading."""
        return self._each_case(lambda torque, deviation: of_case(self._candidate(x, torque, deviation)))

    def _candidate(self, x: Vector, torque, deviation) -> Candidate:
        pinion, wheel = self.modifications(x)
        removed = self._removed(x, torque) + deviation
        cycle = solve_removed(self.mesh, torque, removed, pinion=pinion, wheel=wheel)
        return Candidate(self.parameters(x), pinion, wheel, cycle)

    def _each_case(self, function):
        """A function of torque and deviation in every case, cases leading."""
        return self.cases.each(function)

    def _numbers(self, candidate: Candidate, width):
        """Objectives of a case, with soft extremes where a width is given."""
        values = []
        for of in self.objectives:
            if of == PPTE and width is not None:
                values.append(smooth_peak_to_peak(candidate.cycle.transmission_error, width))
            else:
                values.append(number(of)(candidate))
        return jnp.stack(values)

    def _excess(self, candidate: Candidate):
        over = [excess for limit in self.constraints for excess in limit.excess(limit.value(candidate))]
        return jnp.stack(over) if over else jnp.zeros((0,), self.low.dtype)

    def _measured(self, numbers):
        return jax.vmap(lambda column: self.measure(column, self.cases.weights), 1)(numbers)


def make_problem(
    design: Design,
    bounds: Mapping[str, tuple[float, float]],
    mesh: Mesh,
    cases: Cases,
    objectives,
    measure: AbstractMeasure,
    constraints,
) -> Problem:
    """Checks and collects a problem.

    Raises:
        ValueError: for empty or reversed bounds, and unknown names of objectives or constrained parameters.
    """
    names, low, high = box(bounds)
    for objective in objectives:
        if isinstance(objective, str):
            known("minimize", objective)
    for constraint in constraints:
        for name in constraint.parameters:
            if name not in names:
                raise ValueError(f'minimize: "{name}" of a constraint must be one of {", ".join(names)}')
    return Problem(design, names, low, high, mesh, cases, tuple(objectives), measure, tuple(constraints))


def box(bounds: Mapping[str, tuple[float, float]]):
    """Names, lower and upper bounds."""
    if not bounds:
        raise ValueError("minimize: bounds must name at least one free parameter")
    for name, (low, high) in bounds.items():
        check("minimize", f"lower bound of {name}", low, "")
        check("minimize", f"upper bound of {name}", high, "", low=low, open_low=True)
    pairs = jnp.stack([jnp.stack([real(low), real(high)]) for low, high in bounds.values()])
    return tuple(bounds), pairs[:, 0], pairs[:, 1]
