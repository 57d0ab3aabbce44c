"""The optimization problem that all methods share: a box of parameters, cases, objectives and constraints."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..conditions import (
    Cases,
    Conditions,
    Design,
    Modifications,
    Parameters,
    Variants,
    call_with,
    conditions,
    cycle_status,
    solve_case,
    solved,
    two_modifications,
)
from ..conditions.cases import Loads
from ..contact import Mesh, removed_material, solve_removed
from ..contact.status import Status, Statuses, status_of
from ..metrics import AbstractSettings, Analysis, Quantity, share_settings
from ..microgeometry import AbstractModification
from ..numerics import AbstractMeasure, Mean, Numbers, changed, maximum, real
from ..sweeps.plan import box
from ..tolerance import ManufacturedGears
from ..vocabulary import quantity_of
from .goal import Constraint, Objective, scale_of
from .linearization import Linearization, Pieces, Sloped, any_slopes, local_slopes, pieces_of

Scalar = Float[Array, ""]
Vector = Float[Array, " parameters"]
Result = TypeVar("Result")  # a tree of arrays

# Cost in contact analyses of a value with its gradient, and of the gradient of every further quantity.
GRADIENT_COST = 3
_FURTHER_GRADIENT = 2


class Score(NamedTuple):
    """Objectives and violation of a design.

    Attributes:
        value: objectives to be minimized, shape (objectives,); the negative value for quantities whose larger values
            are better; inf if a contact has not converged.
        violation: largest relative excess over a constraint, 0 if all are met.
    """

    value: Float[Array, " objectives"]
    violation: Scalar


class Roughness(eqx.Module):
    """Penalty on the largest absolute value of linear forms of the parameters, such as the curvature of a table.

    Only sequential linear programming supports it.

    Attributes:
        forms: coefficients of the linear forms over the unit box, shape (forms, parameters).
        weight: weight of the largest absolute value, in units of the objective.
    """

    forms: Float[Array, "forms parameters"]
    weight: Scalar


def unmodified(parameters: Parameters) -> Modifications:
    """Default design without variables: nominal involutes."""
    return None, None


class Problem(eqx.Module):
    """Optimization problem: minimize measures of quantities over cases within bounds and constraints.

    Points of the problem lie in the unit box. For your own optimizer: `score` evaluates a point, `linearize` serves
    sequential linear programming, `parameters` and `modifications` convert a point. All are traceable: use
    `jax.vmap(problem.score)` for many points and `jax.grad` through `score`.

    Attributes:
        design: function that returns (pinion, wheel) modifications from the named variables.
        names: names of the variables.
        low, high: bounds of the variables, shape (variables,).
        mesh: prepared mesh.
        conditions: loads and manufactured gears; with the mesh they give the `cases`.
        objectives: quantities, minimized, or maximized if larger values are better.
        measure: measure that reduces the values of the cases to one.
        constraints: limits in every case.
        settings: settings shared by objectives and constraints, see `metrics.share_settings`.
        roughness: penalty on the variables; None for no penalty.
    """

    design: Design
    names: tuple[str, ...] = eqx.field(static=True)
    low: Vector
    high: Vector
    mesh: Mesh
    conditions: Conditions
    cases: Cases
    objectives: tuple[Quantity, ...] = eqx.field(static=True)
    measure: AbstractMeasure
    constraints: tuple[Constraint, ...]
    settings: tuple[AbstractSettings, ...]
    roughness: Roughness | None

    def __init__(
        self,
        mesh: Mesh,
        torque: Loads,
        design: Design = unmodified,
        bounds: Mapping[str, tuple[float, float]] = MappingProxyType({}),
        *,
        objective: Objective | Sequence[Objective] = "ppte",
        measure: AbstractMeasure | None = None,
        constraints: Sequence[Constraint] = (),
        manufactured: ManufacturedGears | None = None,
        roughness: Roughness | None = None,
    ) -> None:
        """Set up the problem.

        Args:
            mesh: prepared mesh.
            torque: torque on the pinion [N m], or a `LoadSpectrum`.
            design: function that returns (pinion, wheel) modifications from the named variables; traced, so it must be
                pure. Nominal involutes for a method with its own variables.
            bounds: (low, high) of every variable, in the unit that `design` expects; empty for a method with its own
                variables.
            objective: a quantity, or several for `pareto`: its name, a `Quantity`, or a function of a mesh cycle. It is
                maximized if larger values are better.
            measure: measure of the objective over torques and manufactured gears: `Mean()`, `Worst()`,
                `Quantile(level)` or `CVaR(level)`; None for the mean.
            constraints: limits in every case.
            manufactured: manufactured gears, each analysed under every torque; None for nominal gears.
            roughness: penalty on the variables; None for no penalty.

        Raises:
            ValueError: for reversed bounds, unknown names of objectives or constrained variables, a variable without
                effect, and for all errors of the cases.
        """
        self.names, *ends = box(bounds) if bounds else ((), (), ())
        several = [objective] if isinstance(objective, str | Quantity) or callable(objective) else list(objective)
        if not several:
            raise ValueError("objective must name at least one quantity")
        for name in (name for constraint in constraints for name, _ in constraint.terms):
            if name not in self.names:
                raise ValueError(f'"{name}" of a constraint must be one of {", ".join(self.names)}')
        self.design, self.mesh, self.roughness, self.measure = design, mesh, roughness, measure or Mean()
        self.low, self.high = (real(np.asarray(side, np.dtype(mesh.slice_width.dtype))) for side in ends)
        self.conditions = conditions(mesh, torque, manufactured)
        self.cases = self.conditions.on(mesh)
        limited = [limit.quantity for limit in constraints if limit.quantity is not None]
        bare, self.settings = share_settings([*map(quantity_of, several), *limited])
        self.objectives, of_limits = bare[: len(several)], iter(bare[len(several) :])
        self.constraints = tuple(
            limit if limit.quantity is None else changed(limit, quantity=next(of_limits)) for limit in constraints
        )
        Variants(self.names, design, mesh, None, self.conditions, self.cases).traced(np.asarray(self.low))

    def __str__(self) -> str:
        what = ", ".join(of.name for of in self.objectives)
        return f"Problem: {what} of {', '.join(self.names)} in {self.cases.count} cases, {len(self.constraints)} limits"

    def on(self, mesh: Mesh) -> "Problem":
        """Copy of the problem on another mesh."""
        return changed(self, mesh=mesh, cases=self.conditions.on(mesh))

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """(low, high) of every variable by its name."""
        low, high = np.asarray(self.low).tolist(), np.asarray(self.high).tolist()
        return dict(zip(self.names, zip(low, high)))

    @property
    def is_made_of_extremes(self) -> bool:
        """True if all objectives and limited quantities are extremes of local values over the positions."""
        limited = [limit.quantity for limit in self.constraints if limit.quantity is not None]
        return all(of.local and of.reduction.factors(of.sign) is not None for of in (*self.objectives, *limited))

    @property
    def gradient_cost(self) -> int:
        """Cost of a linearization in one case, in contact analyses."""
        limits = sum(limit.quantity is not None for limit in self.constraints)
        return GRADIENT_COST + _FURTHER_GRADIENT * (len(self.objectives) - 1 + limits)

    def parameters(self, x: Vector | np.ndarray) -> dict[str, Scalar]:
        """Parameters by name at a point of the unit box, in the units of their bounds."""
        if isinstance(x, np.ndarray) and not isinstance(self.low, jax.core.Tracer):  # NumPy has nothing to compile
            low, high = np.asarray(self.low), np.asarray(self.high)
            return dict(zip(self.names, map(real, low + x * (high - low))))
        return dict(zip(self.names, self.low + x * (self.high - self.low)))

    def modifications(self, x: Vector | np.ndarray) -> tuple[AbstractModification, AbstractModification]:
        """Modifications at a point of the unit box.

        Raises:
            ValueError: if the design does not return two modifications.
        """
        return two_modifications(call_with("design", self.design, self.parameters(x)))

    def score(self, x: Vector) -> Score:
        """True objectives and violation at a point of the unit box."""
        return self._scored(self.over_cases(x, self._judged), self._linear_excess(x))

    def score_of(self, pinion: AbstractModification | None = None, wheel: AbstractModification | None = None) -> Score:
        """True objectives and violation of any modifications, with the same measure over the same cases.

        Linear constraints on the free parameters are ignored.
        """
        found = self.cases.each(lambda *case: self._judged(self._analysis((pinion, wheel), *case)))
        return self._scored(found, jnp.zeros((0,), self.low.dtype))

    def status(self, x: Vector) -> Statuses:
        """Worst `Status` of a point of the unit box over all cases.

        The status is `OUT_OF_VALIDITY` if the contact has converged but an objective or a limit is not finite.
        """

        def of_case(analysis: Analysis):
            values, excess, fine = self._judged(analysis)
            infinite = ~jnp.isfinite(jnp.sum(values)) | ~jnp.isfinite(jnp.sum(excess))
            return status_of({Status.OUT_OF_VALIDITY: fine & infinite}, cycle_status(analysis.cycle))

        return jnp.max(self.over_cases(x, of_case))

    def _judged(self, analysis: Analysis):
        values = jnp.stack([of.sign * of(analysis) for of in self.objectives])
        return values, self._excess(analysis), solved(analysis.cycle)

    def _scored(self, found, linear) -> Score:
        numbers, excess, fine = found
        values = self._measured(numbers)
        excess = jnp.concatenate([excess.reshape(-1), linear])
        good = jnp.all(fine) & jnp.isfinite(jnp.sum(values)) & jnp.isfinite(jnp.sum(excess))
        return Score(jnp.where(good, values, jnp.inf), _worst(excess))

    def soft_and_true(
        self, x: Vector, width: Scalar
    ) -> tuple[Float[Array, " objectives"], Float[Array, " objectives"], Float[Array, " limits"], Bool[Array, ""]]:
        """Soft and true objectives and excesses from one analysis, for gradient methods.

        Args:
            x: point of the unit box.
            width: width of the soft extremes, in the unit of the objective.

        Returns:
            objectives with soft extremes, true objectives, the worst excess over every limit, and True if all contact
            solutions have converged.
        """

        def of_case(analysis: Analysis):
            soft = [of.sign * of.reduction.soft(of.values(analysis).ravel(), width) for of in self.objectives]
            return jnp.stack(soft), *self._judged(analysis)

        soft, true, excess, fine = self.over_cases(x, of_case)
        worst = maximum(excess, 0) if excess.size else excess[0]
        worst = jnp.concatenate([worst, self._linear_excess(x)])
        return self._measured(soft), self._measured(true), worst, jnp.all(fine)

    def linearize(self, x: Vector) -> Linearization:
        """Linearize objectives and constraints at a point of the unit box; extremes stay exact, see `Pieces`."""
        limited = [limit.quantity for limit in self.constraints if limit.quantity is not None]
        found, fine = self._slopes(x, tuple(dict.fromkeys((*self.objectives, *limited))))
        objectives = tuple(pieces_of(of, found[of], of.sign) for of in self.objectives)
        limits = []
        for limit in self.constraints:
            for sign, bound in limit.sides:
                if limit.quantity is None:
                    pieces = self._linear_pieces(x, limit, sign)
                else:
                    pieces = pieces_of(limit.quantity, found[limit.quantity], sign)
                scale, margin = scale_of(bound, x.dtype), limit.margin(bound, x.dtype)
                limits.append(pieces.scaled(scale, sign * bound.astype(x.dtype) - margin * scale))
        known = jnp.stack([jnp.sum(leaf) for leaf in jax.tree.leaves((objectives, limits))])
        return Linearization(objectives, tuple(limits), jnp.all(fine) & jnp.all(jnp.isfinite(known)))

    def _slopes(self, x: Vector, wanted: tuple[Quantity, ...]) -> tuple[dict[Quantity, Sloped], Array]:
        """Values and slopes of quantities in every case, and True if the contact solutions have converged."""
        local = [of for of in wanted if of.local]
        others = [of for of in wanted if not of.local]

        def at(torque, deviation):
            def solve(removed):
                return Analysis(solve_removed(self.mesh, torque, removed + deviation), None, self.settings)

            def analyze(x):
                return self._analysis(self.modifications(x), torque, deviation)

            def removed_of(x):
                pinion, wheel = self.modifications(x)
                return removed_material(self.mesh, torque, pinion=pinion, wheel=wheel)

            found, fine = local_slopes(local, solve, removed_of, x) if local else ([], jnp.asarray(True))
            more, well = any_slopes(others, analyze, x) if others else ([], jnp.asarray(True))
            return found, more, fine & well

        found, more, fine = self.cases.each(at)
        return dict(zip((*local, *others), (*found, *more))), fine

    def _linear_pieces(self, x: Vector, limit: Constraint, sign: int) -> Pieces:
        factors = jnp.asarray([dict(limit.terms).get(name, 0.0) for name in self.names], x.dtype)
        value = factors @ (self.low + x * (self.high - self.low))
        return Pieces(sign * value[None, None], sign * (factors * (self.high - self.low))[None, None])

    def over_cases(self, x: Vector, of_case: Callable[[Analysis], Result]) -> Result:
        """Values of a function of the analysis in every case, leading axis (cases,)."""
        both = self.modifications(x)
        return self.cases.each(lambda *case: of_case(self._analysis(both, *case)))

    def _analysis(self, both: Modifications, torque, deviation) -> Analysis:
        return Analysis(solve_case(self.mesh, torque, *both, deviation), self.mesh, self.settings)

    def _excess(self, analysis: Analysis):
        limited = [(limit, limit.quantity) for limit in self.constraints if limit.quantity is not None]
        return self._stacked([limit.excess(quantity(analysis)) for limit, quantity in limited])

    def _linear_excess(self, x: Vector):
        parameters = self.parameters(x)
        linear = [limit for limit in self.constraints if limit.quantity is None]
        return self._stacked([limit.excess(limit.of_parameters(parameters)) for limit in linear])

    def _stacked(self, excess: list[list[Scalar]]):
        sides = [side for sides in excess for side in sides]
        return jnp.stack(sides) if sides else jnp.zeros((0,), self.low.dtype)

    def _measured(self, numbers):
        return jax.vmap(lambda column: self.measure(column, self.cases.weights), 1)(numbers)


def _worst(excess):
    return jnp.maximum(maximum(excess), 0.0) if excess.size else jnp.zeros((), excess.dtype)


def real_points(problem: Problem, points: Numbers) -> jax.Array:
    """Points of the unit box in the floating-point type of the problem."""
    return jnp.asarray(points, problem.low.dtype)
