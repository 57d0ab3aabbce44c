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

# Contact analyses that a value with its gradient counts for, and the gradient of every further number of the contact.
GRADIENT_COST = 3
_FURTHER_GRADIENT = 2


class Score(NamedTuple):
    """A design judged.

    Attributes:
        value: the objectives to be made small, shape (objectives,); negative for quantities of which large values are
            the better ones; inf where a contact solution failed.
        violation: largest relative excess over a constraint, 0 where all are kept.
    """

    value: Float[Array, " objectives"]
    violation: Scalar


class Roughness(eqx.Module):
    """Penalty on the largest absolute value of linear forms of the parameters, such as the curvature of a table.

    The method "slp" alone follows it.

    Attributes:
        forms: coefficients over the unit box, shape (forms, parameters).
        weight: of the largest absolute value, in units of the objective.
    """

    forms: Float[Array, "forms parameters"]
    weight: Scalar


def unmodified(parameters: Parameters) -> Modifications:
    """Design of nominal involutes."""
    return None, None


class Problem(eqx.Module):
    """Minimize measures of quantities over cases, within a box and constraints; variables live in the unit box.

    For an optimizer of your own: `score` is what any method needs, `linearize` what a sequence of linear programs
    needs, `parameters` and `modifications` say what a point means. All are traceable, so that
    `jax.vmap(problem.score)` judges many points and `jax.grad` goes through `score`.

    Attributes:
        design: makes (pinion, wheel) modifications from the named variables.
        names: of the variables.
        low, high: their bounds, shape (variables,).
        mesh: prepared mesh.
        conditions: loads and manufactured gears, with the `cases` that they make on the mesh.
        objectives: quantities; those of which large values are the better ones are made large.
        measure: turns the numbers of the cases into one.
        constraints: limits that hold in every case.
        settings: that objectives and constraints share, see `metrics.share_settings`.
        roughness: penalty on the variables, None without.
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
        """Poses the problem.

        Args:
            mesh: prepared mesh.
            torque: on the pinion [N m], or a `LoadSpectrum`.
            design: makes (pinion, wheel) modifications from the named variables; traced, so it must be pure. Nominal
                involutes for a method that brings its own variables.
            bounds: (low, high) of every variable, in the unit that `design` expects; none for such a method.
            objective: a quantity, or several for `pareto`: its name, a `Quantity`, or a function of a cycle. It is made
                large where large values are the better ones.
            measure: of the objective over torques and manufactured gears: `Mean()`, `Worst()`, `Quantile(level)` or
                `CVaR(level)`; None for the mean.
            constraints: limits that hold in every case.
            manufactured: manufactured gears, which run under every torque; None for nominal gears.
            roughness: penalty on the variables; None without.

        Raises:
            ValueError: for reversed bounds, unknown names of objectives or constrained variables, a variable
                on which nothing depends, and whatever the cases refuse.
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
        """Whether all that is asked for are extremes of what happens at each position by itself."""
        limited = [limit.quantity for limit in self.constraints if limit.quantity is not None]
        return all(of.local and of.reduction.factors(of.sign) is not None for of in (*self.objectives, *limited))

    @property
    def gradient_cost(self) -> int:
        """Contact analyses that a linearization in one case counts for."""
        limits = sum(limit.quantity is not None for limit in self.constraints)
        return GRADIENT_COST + _FURTHER_GRADIENT * (len(self.objectives) - 1 + limits)

    def parameters(self, x: Vector | np.ndarray) -> dict[str, Scalar]:
        """Parameters at a point of the unit box."""
        if isinstance(x, np.ndarray) and not isinstance(self.low, jax.core.Tracer):  # NumPy has nothing to compile
            low, high = np.asarray(self.low), np.asarray(self.high)
            return dict(zip(self.names, map(real, low + x * (high - low))))
        return dict(zip(self.names, self.low + x * (self.high - self.low)))

    def modifications(self, x: Vector | np.ndarray) -> tuple[AbstractModification, AbstractModification]:
        """Modifications at a point of the unit box.

        Raises:
            ValueError: when the design gives anything but two modifications.
        """
        return two_modifications(call_with("design", self.design, self.parameters(x)))

    def score(self, x: Vector) -> Score:
        """True objectives and violation."""
        return self._scored(self.over_cases(x, self._judged), self._linear_excess(x))

    def score_of(self, pinion: AbstractModification | None = None, wheel: AbstractModification | None = None) -> Score:
        """True objectives and violation of any modifications, judged by the same measure over the same cases.

        Linear constraints on the free parameters do not apply to them.
        """
        found = self.cases.each(lambda *case: self._judged(self._analysis((pinion, wheel), *case)))
        return self._scored(found, jnp.zeros((0,), self.low.dtype))

    def status(self, x: Vector) -> Statuses:
        """Number of `Status` of a point of the unit box over all cases.

        `OUT_OF_VALIDITY` stands where the contact has converged and an objective or a limit is not finite.
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
            width: of the soft extremes, in the unit of the objective.

        Returns:
            the objectives with soft extremes, the true ones, the worst excess over every limit, and whether all
            contact solutions converged.
        """

        def of_case(analysis: Analysis):
            soft = [of.sign * of.reduction.soft(of.values(analysis).ravel(), width) for of in self.objectives]
            return jnp.stack(soft), *self._judged(analysis)

        soft, true, excess, fine = self.over_cases(x, of_case)
        worst = maximum(excess, 0) if excess.size else excess[0]
        worst = jnp.concatenate([worst, self._linear_excess(x)])
        return self._measured(soft), self._measured(true), worst, jnp.all(fine)

    def linearize(self, x: Vector) -> Linearization:
        """The objectives and the constraints with their slopes; extremes stay exact extremes, see `Pieces`."""
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
        """Values and slopes of quantities in every case, and whether the contact solutions converged."""
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
        """A function of the analysis of every case, cases leading."""
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
    """Points of the unit box in the type of the problem."""
    return jnp.asarray(points, problem.low.dtype)
