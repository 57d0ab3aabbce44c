"""Results of optimizations."""

from typing import Any

import equinox as eqx
import numpy as np

from ..contact import Mesh, MeshCycle
from ..metrics.findings import finding_of_claim
from ..microgeometry import AbstractModification
from ..numerics import Checked
from .problem import Problem

PENALIZED = " with curvature penalty"  # what the name of an objective says of it
_SHOWN_PARAMETERS = 12  # longer lists, such as table values of flanks, are not printed


class Iterate(Checked):
    """One state of the transmission-error iteration.

    Attributes:
        pinion, wheel: modifications.
        transmission_error: transmission error over the positions [um], shape (positions,).
        ppte: peak-to-peak transmission error [um].
        limit: lower limit of the PPTE, the variation in single contact on unmodified flanks [um].
        max_relief: largest material removed [um].
        max_flank_pressure, max_corner_pressure: largest pressure of flanks and of tip corners [MPa].
    """

    pinion: AbstractModification
    wheel: AbstractModification
    transmission_error: np.ndarray
    ppte: float
    limit: float
    max_relief: float
    max_flank_pressure: float
    max_corner_pressure: float


class Limit(Checked):
    """Constraint at the optimum.

    Attributes:
        value: constrained value, the worst over the cases.
        low, high: limits of the value; None for no limit.
        unit: unit of value and limits; "" for a pure number.
        kept: True if the value is within its limits, up to the tolerance of constraints.
    """

    value: float
    low: float | None
    high: float | None
    unit: str = eqx.field(static=True)
    kept: bool

    def __str__(self) -> str:
        limits = [
            f"{word} {limit:.4g}"
            for word, limit in (("at least", self.low), ("at most", self.high))
            if limit is not None
        ]
        state = "met" if self.kept else "NOT MET"
        return f"{self.value:.4g} {self.unit}".rstrip() + f", {state}: {' and '.join(limits)}"

    def summary(self) -> dict[str, Any]:
        """Values as plain data for tables and files."""
        return {"value": self.value, "low": self.low, "high": self.high, "unit": self.unit, "met": self.kept}


class Rounding(Checked):
    """Rounding of the parameters of an optimum.

    Attributes:
        steps: steps of the rounded parameters, in the units of their bounds; empty if no rounded design meets the
            limits.
        parameters: values of all free parameters before rounding.
        objective: objective before rounding, in its unit, on the same mesh.
    """

    steps: dict[str, float]
    parameters: dict[str, float]
    objective: float

    def summary(self) -> dict[str, Any]:
        """Values as plain data, for a table or a file."""
        return {"steps": self.steps, "parameters_before": self.parameters, "objective_before": self.objective}


class Optimum(eqx.Module):
    """Result of every optimization method.

    Attributes:
        method: name of the method.
        objective_name: name of the objective, such as "ppte", "95 % CVaR of ppte" or "ppte with curvature penalty".
        parameters: value of every free parameter; empty for methods whose variables are the flanks.
        pinion, wheel: modifications of the optimum.
        mesh: prepared mesh of the evaluation.
        cycle: mesh cycle of the optimum with nominal gears, under the torque (for a load spectrum the torque of the
            largest weight).
        ppte: peak-to-peak transmission error of `cycle` [um].
        objective: value of the objective, in its unit.
        objective_unit: unit of the objective; "" for a pure number.
        positions: number of positions per base pitch of `mesh`, on which objective, cycle and constraints were
            evaluated.
        grid_change: change of the objective at twice the positions and, for helical gears, extrapolated to infinitely
            many slices, in its unit; NaN if not evaluated, as for a search that stays on its mesh.
        optimality: first-order optimality: largest predicted decrease of the objective within bounds and constraints,
            per full range of a parameter; 0 at an optimum. It comes from the linearized problem (`linear_model`) and
            includes the kinks of extremes, where the plain gradient does not vanish. NaN without parameters, and for
            slopes that are not finite. With `rounding` it is the value before rounding.
        active_bounds: "lower" or "upper" for every parameter that ended at a bound, by name.
        constraints: constraints by name, each with its value and limits.
        violation: largest relative excess over a constraint; 0 if all are met.
        evaluations: contact analyses spent, one per design, torque and manufactured gear; one with its gradient
            counts as three, each further gradient as two.
        history: best objective after every report of the search, on its mesh at that time.
        history_evaluations: contact analyses spent until every report.
        history_positions: number of positions of the mesh at every report; None if it is always `positions`.
        seconds: wall time of the search, compilation included [s].
        iterations: states of the transmission-error iteration, starting with the initial flanks; empty for other
            methods.
        problem: optimization problem on `mesh`, with which `judged` evaluates other designs; None for the
            transmission-error iteration.
        rounding: steps of the parameters, and their values before rounding; None without rounding.
    """

    method: str = eqx.field(static=True)
    objective_name: str = eqx.field(static=True)
    parameters: dict[str, float]
    pinion: AbstractModification
    wheel: AbstractModification
    mesh: Mesh
    cycle: MeshCycle
    ppte: float
    objective: float
    objective_unit: str = eqx.field(static=True)
    positions: int
    grid_change: float
    optimality: float
    active_bounds: dict[str, str]
    constraints: dict[str, "Limit"]
    violation: float
    evaluations: int
    history: np.ndarray
    history_evaluations: np.ndarray
    seconds: float
    iterations: tuple[Iterate, ...] = ()
    history_positions: np.ndarray | None = None
    problem: Problem | None = None
    rounding: Rounding | None = None

    @property
    def feasible(self) -> bool:
        """True if all constraints are met."""
        return self.violation == 0.0

    def __str__(self) -> str:
        lines = [f"Optimum by {self.method}"]
        lines += [f"  {label:<22} {text}" for label, text in self._rows()]
        return "\n".join(lines)

    def _rows(self):
        yield self.objective_name, f"{self.objective:.4g} {self.objective_unit}".rstrip()
        if self.rounding is not None and self.rounding.steps:
            yield "before rounding", f"{self.rounding.objective:.4g} {self.objective_unit}".rstrip()
        if self.objective_name != "ppte":
            yield "PPTE", f"{self.ppte:.4g} um"
        yield "contact analyses", f"{self.evaluations} in {self.seconds:.2f} s"
        if np.isfinite(self.grid_change):
            yield "at twice the positions", f"{self.grid_change:+.2g} {self.objective_unit}".rstrip()
        if np.isfinite(self.optimality):
            yield "optimality", f"{self.optimality:.2g} (predicted decrease over the full range of a variable)"
        if len(self.parameters) > _SHOWN_PARAMETERS:
            yield "parameters", f"{len(self.parameters)} values"
        else:
            for name, value in self.parameters.items():
                bound = self.active_bounds.get(name)
                yield name, f"{value:.4g}" + (f" (at its {bound} bound)" if bound else "")
        for name, limit in self.constraints.items():
            yield name, str(limit)
        for finding in finding_of_claim(self.ppte, self.mesh.compliance):
            yield "warning", str(finding)
        if not self.feasible:
            yield "NOT FEASIBLE", f"a limit is passed by {100 * self.violation:.2g} %"

    def summary(self) -> dict[str, Any]:
        """Values of the optimum as plain data, for a table or a file."""
        return {
            "method": self.method,
            "objective_name": self.objective_name,
            "objective": self.objective,
            "ppte_um": self.ppte,
            "positions": self.positions,
            "objective_change_at_twice_the_positions": self.grid_change,
            "first_order_optimality": self.optimality,
            "active_bounds": self.active_bounds,
            "feasible": self.feasible,
            "constraints": {name: limit.summary() for name, limit in self.constraints.items()},
            "violation": self.violation,
            **({} if self.rounding is None else {"rounding": self.rounding.summary()}),
            "evaluations": self.evaluations,
            "history": {"evaluations": self.history_evaluations, "objective": self.history},
        }


class Front(Checked):
    """Pareto front: designs that no other design dominates.

    Attributes:
        objectives: names of the objectives.
        units: units of the objectives.
        values: objectives of the designs, shape (designs, objectives), sorted by the first objective.
        parameters: values of every free parameter, shape (designs,) each.
        optimality: first-order optimality of every design, shape (designs,): largest predicted common decrease of all
            objectives within bounds and constraints, in spans of the front per full range of every parameter; 0 if no
            direction improves all objectives.
        compromise: design with about the least largest distance from the ideal point, in spans of the front; its
            objective is this distance.
        chosen: row of the compromise.
    """

    objectives: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    values: np.ndarray
    parameters: dict[str, np.ndarray]
    optimality: np.ndarray
    compromise: Optimum
    chosen: int

    def __str__(self) -> str:
        spans = zip(self.objectives, self.units, self.values.min(axis=0), self.values.max(axis=0))
        lines = [f"Front of {len(self.values)} designs"]
        lines += [f"  {name:<22} {low:.4g} to {high:.4g} {unit}".rstrip() for name, unit, low, high in spans]
        left = float(np.nanmax(self.optimality, initial=0.0))
        said = f"at most {left:.2g} spans, the largest predicted decrease over the full range of a variable"
        return "\n".join([*lines, f"  optimality             {said}"])
