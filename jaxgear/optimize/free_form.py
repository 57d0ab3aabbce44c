"""Free-form flanks, whose table values are the parameters, and the nearest tip relief of a named curve."""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jaxtyping import Array, Float

from ..conditions import Parameters, solve_case
from ..contact import Mesh, MeshCycle, Side
from ..metrics import peak_to_peak, removed_at
from ..microgeometry import (
    AbstractCurve,
    AbstractModification,
    Linear,
    ParabolicLinear,
    Polynomial,
    Power,
    TabulatedProfile,
    TipRelief,
)
from ..numerics import changed, program, real
from ..numerics.fields import Checked, count, number
from ..sizing import iso_relief
from .linear_model import Linearizer
from .method import AbstractSearch
from .problem import Problem, Roughness
from .result import Optimum
from .search import Record
from .slp import Search, follow

_RTOL = 1e-3  # a search ends where the predicted decrease is below this part of the objective


class _Tables(eqx.Module):
    """Design of two tables from the pitch points to the tips, whose values are the parameters.

    Attributes:
        roll: roll lengths of pinion and wheel [mm], shape (2, points).
    """

    roll: Float[Array, "2 points"]

    def __call__(self, parameters: Parameters):
        """Tables (pinion, wheel) from the parameters in the order of their names [um]."""
        values = jnp.stack(list(parameters.values())).reshape(self.roll.shape)
        return TabulatedProfile(self.roll[0], values[0]), TabulatedProfile(self.roll[1], values[1])


class FreeForm(Checked, AbstractSearch):
    """Free-form flanks with the least PPTE, or another best objective, by sequential linear programming.

    Each flank is a table of material removed from the pitch point to the tip, linear between its points. The amounts of
    pinion and wheel add up in the contact: modifications of both addenda cover the whole path of contact. The penalty
    on the largest curvature keeps the flanks smooth and limits the local contact pressure: 1 um/mm^2 is 0.001 / mm, to
    be compared with the relative curvature of the pair, 1 / R.

    The values of the tables are the variables, in place of those of the problem. The objective of the optimum includes
    the penalty. An amount that is constant over a flank has no effect on PPTE; it is subtracted, unless the problem has
    constraints.

    Attributes:
        points: number of table values per flank.
        max_relief: largest material removed.
        curvature: penalty on the largest second derivative of either table, PPTE in um per um/mm^2.
        steps: largest number of steps.
        start: modifications of a second search, in addition to unmodified flanks; None for the rule-based relief.
    """

    name: ClassVar[str] = "free_form"
    takes_variables: ClassVar[bool] = False
    points: int = count(low=4, default=40)
    max_relief: float = number("um", low=0.0, open_low=True, static=True, default=20.0)
    curvature: float = number("", low=0.0, static=True, default=1e-3)
    steps: int = count(default=60)
    start: tuple[AbstractModification, AbstractModification] | None = None

    def pose(self, problem: Problem) -> Problem:
        if any(limit.quantity is None for limit in problem.constraints):
            raise ValueError("a linear constraint names parameters, and the values of a table have no names")
        roll, width = _roll_lengths(problem.mesh, self.points), len(str(self.points))
        numbers = [f"{number:0{width}d}" for number in range(1, self.points + 1)]
        return changed(
            problem,
            design=_Tables(roll),
            names=tuple(f"{gear} {number}" for gear in ("pinion", "wheel") for number in numbers),
            low=jnp.zeros(2 * self.points, roll.dtype),
            high=jnp.full(2 * self.points, self.max_relief, roll.dtype),
            roughness=_roughness(roll, self.max_relief, self.curvature),
        )

    def search(self, problem: Problem, record: Record) -> None:
        """Run two searches, from unmodified flanks and from `start`."""
        mesh, load, start = problem.mesh, problem.conditions.load, self.start
        if start is None:
            relief = iso_relief(mesh.pair, float(load.torques[int(np.argmax(load.weights))]))
            start = relief, relief
        given = _values(mesh, problem.design.roll, start) / self.max_relief  # type: ignore[attr-defined]
        starts = [Search(np.zeros(2 * self.points)), Search(np.clip(given, 0.0, 1.0))]
        record.linearizer = Linearizer(problem, len(starts))
        follow(record.linearizer, record, starts, steps=self.steps, rtol=_RTOL)

    def polish(self, problem: Problem, record: Record, point: np.ndarray) -> None:
        """Search again from the design at a point of the unit box."""
        linearizer = record.linearizer or Linearizer(problem, 1)
        follow(linearizer, record, [Search(point)], steps=self.steps, rtol=_RTOL)

    def finish(self, record: Record) -> None:
        """Subtract the smallest amount of each flank from its table, unless the problem has constraints."""
        if not record.problem.constraints:
            flanks = record.point.reshape(2, self.points)
            record.point = (flanks - flanks.min(axis=1, keepdims=True)).ravel()


def _roll_lengths(mesh: Mesh, points: int):
    first = jnp.stack([side.pitch_roll_length for side in mesh.sides])
    last = jnp.stack([side.tip_roll_length for side in mesh.sides])
    return jnp.linspace(first, last, points, axis=1).astype(mesh.slice_width.dtype)


def _roughness(roll, max_relief: float, curvature: float) -> Roughness:
    """Penalty on the second derivatives of both tables."""
    second = np.diff(np.eye(roll.shape[1]), 2, axis=0) * max_relief
    steps = np.asarray(roll[:, 1] - roll[:, 0])
    forms = scipy.linalg.block_diag(second / steps[0] ** 2, second / steps[1] ** 2)
    return Roughness(jnp.asarray(forms, roll.dtype), jnp.asarray(curvature, roll.dtype))


def _values(mesh: Mesh, roll, start) -> np.ndarray:
    """Table values of the modifications at the start [um]."""
    return np.concatenate([removed_at(side, flank, where) for side, flank, where in zip(mesh.sides, start, roll)])


_SAMPLES = 201  # points of the fit, from the pitch point to the tip
_LENGTHS = (0.3, 0.5, 0.7, 0.9)  # of the relief, relative to the addendum, from which the fits start
_LEAST_LENGTH = 0.02

# Shape parameters of a curve: how to make it, where the fit starts, and its bounds. Polynomials keep their amount in
# their coefficients.
_Shape = tuple[Callable[..., AbstractCurve], tuple[float, ...], tuple[float, ...], tuple[float, ...]]
CURVES: Mapping[str, _Shape] = MappingProxyType(
    {
        "linear": (Linear, (), (), ()),
        "power": (Power, (1.5,), (0.3,), (6.0,)),
        "parabolic_linear": (ParabolicLinear, (0.5,), (0.01,), (1.0,)),
        "quadratic": (lambda b: Polynomial(jnp.stack([0.0 * b, b, 1 - b])), (0.5,), (-6.0,), (6.0,)),
        "cubic": (
            lambda b, c: Polynomial(jnp.stack([0.0 * b, b, c, 1 - b - c])),
            (0.5, 0.5),
            (-12.0, -12.0),
            (12.0, 12.0),
        ),
    }
)


class Projection(eqx.Module):
    """Tip reliefs of a named curve fitted to other flanks.

    Attributes:
        curve: name of the curve.
        pinion, wheel: tip reliefs.
        cycle: mesh cycle with the tip reliefs, under the torque of the original flanks.
        ppte: peak-to-peak transmission error [um].
        loss: increase of the PPTE over the original flanks [um].
        misfit: largest deviation from the original flanks, from the pitch points to the tips [um].
    """

    curve: str = eqx.field(static=True)
    pinion: TipRelief
    wheel: TipRelief
    cycle: MeshCycle
    ppte: float
    loss: float
    misfit: float

    def __str__(self) -> str:
        lines = [f"{self.curve}: PPTE {self.ppte:.3f} um, {self.loss:+.3f} um; misfit {self.misfit:.2f} um"]
        for name, relief in (("pinion", self.pinion), ("wheel", self.wheel)):
            lines.append(f"  {name} {float(relief.amount):.2f} um over {float(relief.length):.2f} mm")
        return "\n".join(lines)


def project(optimum: Optimum, curve: str = "power") -> Projection:
    """Fit a tip relief of a named curve to each flank of an optimum, by least squares from the pitch point to the tip.

    Grinding and drawings need an amount, a length and a curve in place of a free-form or iterated flank. The fit
    minimizes the deviation of the flanks, not the PPTE: `minimize` with the same curve finds a lower PPTE.

    Args:
        optimum: optimum of `FreeForm` or `TransmissionErrorIteration`.
        curve: "linear", "power", "parabolic_linear", "quadratic" or "cubic".

    Raises:
        ValueError: for an unknown curve.
    """
    if curve not in CURVES:
        raise ValueError(f'curve = "{curve}" is not known, must be one of {", ".join(CURVES)}')
    mesh, torque = optimum.mesh, optimum.cycle.operating_point
    fits = [_fit(side, flank, curve) for side, flank in zip(mesh.sides, (optimum.pinion, optimum.wheel))]
    pinion, wheel = (relief for relief, _ in fits)
    cycle = solve_case(mesh, torque, pinion, wheel)
    ppte = float(peak_to_peak(cycle.transmission_error))
    misfit = max(distance for _, distance in fits)
    return Projection(curve, pinion, wheel, cycle, ppte, ppte - optimum.ppte, misfit)


def _fit(side: Side, modification: AbstractModification, curve: str):
    """Best tip relief of one gear, and its largest deviation from the flank [um]."""
    _, first, low, high = CURVES[curve]
    roll = jnp.linspace(side.pitch_roll_length, side.tip_roll_length, _SAMPLES)
    addendum = float(roll[-1] - roll[0])
    flank = removed_at(side, modification, roll)
    most = max(float(flank.max()), 1e-3)

    def residual(values, of=_distance):
        return np.asarray(of(jnp.asarray(values), side, flank, roll, curve)) / most

    bounds = [0.0, _LEAST_LENGTH * addendum, *low], [3 * most, addendum, *high]
    starts = [[most, share * addendum, *first] for share in _LENGTHS]
    fits = [
        scipy.optimize.least_squares(residual, values, jac=partial(residual, of=_slope), bounds=bounds)
        for values in starts
    ]
    best = min(fits, key=lambda fit: fit.cost)
    return _relief(jnp.asarray(best.x), curve), float(np.abs(best.fun).max()) * most


def _relief(values, curve: str) -> TipRelief:
    amount, length, *shape = values
    return TipRelief(real(amount), real(length), CURVES[curve][0](*shape))


@program
def _distance(values, side: Side, flank, roll, curve: str):
    return removed_at(side, _relief(values, curve), roll) - flank


_slope = program(jax.jacfwd(_distance))
