"""Flanks of free form: every value of a table is a parameter."""

import time
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy
from jaxtyping import Array, Float

from ..conditions import Parameters, conditions
from ..contact import Mesh
from ..metrics import quantities, removed_at
from ..microgeometry import AbstractModification, TabulatedProfile
from ..numerics import AbstractMeasure, Callback, Mean, check, whole
from ..sizing import iso_relief
from ..tolerance import Tolerance
from .goal import Constraint
from .linearizer import Linearizer
from .problem import Problem, Roughness
from .refine import POSITIONS, refined
from .result import Optimum
from .search import Record
from .slp import Search, follow
from .verdict import optimum_of

_FEWEST = 4  # values per flank
_RTOL = 1e-3  # a search ends where the predicted decrease is below this part of the objective


class _Tables(eqx.Module):
    """Design of two tables, from the pitch points to the tips; the parameters are their values.

    Attributes:
        roll: roll lengths of pinion and wheel [mm], shape (2, points).
    """

    roll: Float[Array, "2 points"]

    def __call__(self, parameters: Parameters):
        """Both tables, of the parameters in the order of their names."""
        values = jnp.stack(list(parameters.values())).reshape(self.roll.shape)
        return TabulatedProfile(self.roll[0], values[0]), TabulatedProfile(self.roll[1], values[1])


def free_form(
    mesh: Mesh,
    torque,
    *,
    points: int = 40,
    max_relief: float = 20.0,
    curvature: float = 1e-3,
    measure: AbstractMeasure | None = None,
    constraints: Sequence[Constraint] = (),
    tolerance: Tolerance | None = None,
    samples: int | None = None,
    seed: int = 0,
    start: tuple[AbstractModification, AbstractModification] | None = None,
    steps: int = 60,
    positions: int | None = POSITIONS,
    callback: Callback | None = None,
) -> Optimum:
    """Finds the flanks with the least PPTE, whatever their form, by sequential linear programming.

    Each flank is a table of material removed from the pitch point to the tip, linear in between. What pinion and wheel
    remove where they touch adds up, so that two addenda reach every point of the path of contact. The penalty on the
    largest curvature keeps the flanks smooth and the local contact pressure down: 1 um/mm^2 is 0.001 / mm, to be
    compared with the curvature of the pair, 1 / R.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], or a `LoadSpectrum`.
        points: values per flank.
        max_relief: largest material removed [um].
        curvature: penalty on the largest second derivative of either table, PPTE in um per um/mm^2.
        measure: of the PPTE over torques and manufactured gears: `Mean()`, `Worst()` or `CVaR(level)`; None for the
            mean.
        constraints: limits that hold in every case; they can name no single parameter.
        tolerance, samples, seed: of manufactured gears, as for `minimize`.
        start: modifications to start from besides unmodified flanks; None for the rule-based relief.
        steps: most steps.
        positions: of the finer mesh on which the search ends, as for `minimize`.
        callback: called as callback(step, steps, best objective).

    Returns:
        the optimum; its objective includes the penalty, its parameters are the values of both tables. What a flank
        has in common all over, and no variation shows, is not removed, unless constraints may depend on it.

    Raises:
        ValueError: for numbers outside their range.
        RuntimeError: when no design gave a converged contact solution.
    """
    whole("free_form", "points", points, _FEWEST)
    whole("free_form", "steps", steps, 1)
    check("free_form", "max_relief", max_relief, "um", low=0.0, open_low=True)
    check("free_form", "curvature", curvature, "um/(um/mm^2)", low=0.0)
    if any(limit.quantity is None for limit in constraints):
        raise ValueError("free_form: a linear constraint names parameters, and the values of a table have no names")
    began = time.perf_counter()
    judged = conditions("free_form", mesh, torque, tolerance=tolerance, samples=samples, seed=seed)
    roll = _roll_lengths(mesh, points)
    width = len(str(points))
    problem = Problem(
        design=_Tables(roll),
        names=tuple(f"{gear} {number + 1:0{width}d}" for gear in ("pinion", "wheel") for number in range(points)),
        low=jnp.zeros(2 * points, roll.dtype),
        high=jnp.full(2 * points, max_relief, roll.dtype),
        mesh=mesh,
        conditions=judged,
        cases=judged.on(mesh),
        objectives=(quantities["ppte"],),
        measure=measure or Mean(),
        constraints=tuple(constraints),
        roughness=_roughness(roll, max_relief, curvature),
    )
    heaviest = float(judged.load.torques[int(np.argmax(judged.load.weights))])
    if start is None:
        relief = iso_relief(mesh.pair, heaviest)
        start = relief, relief
    record = Record(problem, callback)
    unmodified = np.zeros(2 * points)
    given = np.clip(_values(mesh, roll, start) / max_relief, 0.0, 1.0)
    starts = [Search(unmodified), Search(given)]
    record.linearizer = Linearizer(problem, len(starts))
    follow(record.linearizer, record, starts, steps=steps, rtol=_RTOL)
    record.check()

    def polished(problem, record, point):
        follow(record.linearizer, record, [Search(point)], steps=steps, rtol=_RTOL)

    record, change = refined(record, polished, positions)
    if not constraints:  # which may depend on what both flanks have in common
        flanks = record.point.reshape(2, points)
        record.point = (flanks - flanks.min(axis=1, keepdims=True)).ravel()
    return optimum_of(record, "free_form", began, change)


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
    """Values of the tables of the modifications to start from [um]."""
    return np.concatenate([removed_at(side, flank, where) for side, flank, where in zip(mesh.sides, start, roll)])
