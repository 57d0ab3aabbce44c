"""What every optimization returns."""

from typing import Any

import equinox as eqx
import numpy as np

from ..contact import Mesh, MeshCycle
from ..microgeometry import AbstractModification
from ..numerics import Checked

PENALIZED = " with curvature penalty"  # what the name of an objective says of it
_SHOWN_PARAMETERS = 12  # a table of a hundred flank values tells a reader nothing


class Iterate(Checked):
    """One state of the transmission-error iteration.

    Attributes:
        pinion, wheel: modifications.
        transmission_error: over the positions [um], shape (positions,).
        ppte: peak-to-peak transmission error [um].
        limit: its lower limit, the variation while one pair alone carries the load on unmodified flank [um].
        max_relief: largest material removed [um].
        max_flank_pressure, max_corner_pressure: [MPa].
    """

    pinion: AbstractModification
    wheel: AbstractModification
    transmission_error: np.ndarray
    ppte: float
    limit: float
    max_relief: float
    max_flank_pressure: float
    max_corner_pressure: float


class Front(Checked):
    """Designs of which none is better in every objective.

    Attributes:
        objectives: their names.
        units: their units.
        values: shape (designs, objectives), ascending in the first objective.
        parameters: value of every free parameter, each of shape (designs,).
    """

    objectives: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    values: np.ndarray
    parameters: dict[str, np.ndarray]


class Optimum(eqx.Module):
    """Result of every method of optimization.

    Attributes:
        method: its name.
        objective_name: what was minimized, such as "ppte", "95 % CVaR of ppte" or "ppte with curvature penalty".
        parameters: value of every free parameter; none where the flanks themselves were sought.
        pinion, wheel: the modifications.
        mesh: prepared mesh of the search.
        cycle: mesh cycle of the optimum, of perfect gears under the torque (of a load spectrum, its heaviest weight).
        ppte: peak-to-peak transmission error of that cycle [um].
        objective: least value found of what was minimized, in its unit.
        gradient_norm: fastest decrease of the objective that is left within bounds and constraints, per step of the
            full range of every parameter; 0 at an optimum. It comes from the linearized problem (`linear_model`) and
            counts the kinks of PPTE, where the plain gradient does not vanish. NaN of a front, where there are no
            parameters, and where the slopes are not finite.
        active_bounds: which parameters ended at their "lower" or "upper" bound.
        constraints: value of every constrained number, the worst over the cases.
        violation: largest relative excess over a constraint.
        evaluations: contact analyses spent, one per design, torque and manufactured gear; one with its gradient
            counts as three, each further gradient as two.
        history: best objective after every look at the search.
        history_evaluations: contact analyses spent until then.
        seconds: wall time of the search, compilation included [s].
        iterations: states of the transmission-error iteration, the first one before any change; else empty.
        front: of several objectives; else None.
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
    gradient_norm: float
    active_bounds: dict[str, str]
    constraints: dict[str, float]
    violation: float
    evaluations: int
    history: np.ndarray
    history_evaluations: np.ndarray
    seconds: float
    iterations: tuple[Iterate, ...] = ()
    front: Front | None = None

    def __str__(self) -> str:
        lines = [f"Optimum by {self.method}"]
        lines += [f"  {label:<22} {text}" for label, text in self._rows()]
        return "\n".join(lines)

    def _rows(self):
        yield self.objective_name, f"{self.objective:.4g}"
        if self.objective_name != "ppte":
            yield "PPTE", f"{self.ppte:.4g} um"
        yield "contact analyses", f"{self.evaluations} in {self.seconds:.2f} s"
        if np.isfinite(self.gradient_norm):
            yield "gradient norm", f"{self.gradient_norm:.2g} per full range"
        if len(self.parameters) > _SHOWN_PARAMETERS:
            yield "parameters", f"{len(self.parameters)} values"
        else:
            for name, value in self.parameters.items():
                bound = self.active_bounds.get(name)
                yield name, f"{value:.4g}" + (f" (at its {bound} bound)" if bound else "")
        for name, value in self.constraints.items():
            yield name, f"{value:.4g}"
        if self.violation > 0:
            yield "violation", f"{100 * self.violation:.2g} % of the limit"

    def summary(self) -> dict[str, Any]:
        """Plain numbers, for a table or a file."""
        return {
            "method": self.method,
            "objective_name": self.objective_name,
            "objective": self.objective,
            "ppte_um": self.ppte,
            "gradient_norm_per_range": self.gradient_norm,
            "active_bounds": self.active_bounds,
            "constraints": self.constraints,
            "violation": self.violation,
            "evaluations": self.evaluations,
            "history": {"evaluations": self.history_evaluations, "objective": self.history},
        }
