"""The transmission error taken off the flank, again and again, until it is level."""

import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..conditions import Design
from ..contact import Mesh
from ..contact.parts import parts
from ..microgeometry import AbstractModification, NoModification
from ..numerics import Callback, check, whole
from .goal import Constraint
from .iterated_flanks import Flanks
from .levelling import Levelled, Pressure, levelled
from .minimize import minimize
from .refine import POSITIONS, on_finer_meshes
from .result import Limit, Optimum
from .search import AbstractMethod
from .slp import SLP


def iterate_transmission_error(
    mesh: Mesh,
    torque,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    max_relief: float = 7.0,
    max_pressure: float | None = None,
    rtol: float = 0.1,
    steps: int = 5,
    positions: int | None = POSITIONS,
    callback: Callback | None = None,
) -> Optimum:
    """Levels the transmission error by taking it off the flanks.

    While one pair alone carries the load its deflection is given. Where two pairs share it the gears lag less, by
    h = q_max - q: that much is taken off both flanks there, off the pinion in recess and off the wheel in approach, so
    that both pairs give way by it. It starts where the transmission error leaves its single-contact extreme, and is
    repeated with the flanks so made, because pairs that meet beyond the path of contact come in later the more is
    taken off.

    Source: eq. (1) and the algorithm of "Design for manufacturing of a spur gears profile modification based on the
    static transmission error for improving the dynamic behavior", Int J Adv Manuf Technol 2023,
    doi 10.1007/s00170-023-12340-x, with the sign of its q_0 turned. There the total h is cut off at zero, and so it is
    here: where a step has taken off too much, the next one gives back. The level q_max is that of the first state,
    since the single contact of unmodified flanks does not change; the study takes its lower limit of the PPTE from
    there as well.

    Of equal reliefs on both pairs, a plateau up to the tip is left: the tip edges meet the mates as before. But the
    gears lag by the sum of both gaps, weighted by the stiffnesses of the pairs, so that any other share between the
    pair that leaves and the one that enters is as level ("infinite solutions with equal peak-to-peak transmission
    error"). With `max_pressure`, the relief is slanted: from the first double contact (u = 0) to the tip (u = 1) it is
    multiplied by 1 + t (2 u - 1), not less than 0, with the least slant t from 0 to 2 that keeps the pressure of flanks
    and tip edges within that limit. The height at the tip follows from the pressure, as it does in the study.

    Args:
        mesh: prepared mesh.
        torque: on the pinion, at which the transmission error is levelled [N m].
        pinion, wheel: modifications to start from (the study's type 2); None for the nominal involute (its type 1).
        max_relief: most that is left removed anywhere [um].
        max_pressure: largest pressure of flanks and tip edges [MPa]; None for no limit.
        rtol: ends the iteration where PPTE is within this part of its lower limit, or has fallen by less than
            this part of itself.
        steps: most steps.
        positions: of the finer mesh on which the pressure is judged, doubled until its limit is kept at four times as
            many, too; None for those of `mesh`, on which all else is evaluated.
        callback: called as callback(step, steps, best PPTE).

    Returns:
        the state with the least PPTE of those within the limit of the pressure, or else with the least pressure;
        `iterations` has all of them.

    Raises:
        ValueError: for numbers outside their range.
        RuntimeError: when a contact solution does not converge.
    """
    check("iterate_transmission_error", "torque", torque, "N m", low=0.0, open_low=True)
    check("iterate_transmission_error", "max_relief", max_relief, "um", low=0.0, open_low=True)
    if max_pressure is not None:
        check("iterate_transmission_error", "max_pressure", max_pressure, "MPa", low=0.0, open_low=True)
    check("iterate_transmission_error", "rtol", rtol, "", low=0.0, open_low=True)
    whole("iterate_transmission_error", "steps", steps, 1)
    began = time.perf_counter()
    given = pinion or NoModification(), wheel or NoModification()
    limit = None if max_pressure is None else Constraint("max_contact_pressure", high=max_pressure)
    spent: list[int] = []

    def end_on(finer: Mesh, between: bool = True) -> tuple[Levelled, bool]:
        flanks = Flanks(mesh, *given, float(max_relief))
        pressure = Pressure(limit, torque, parts(finer, mesh.resolution.positions))
        found = levelled(mesh, flanks, pressure, rtol, steps, spent, callback)
        return found, between and pressure.holds_between(found, finer)

    if limit is None or positions is None:
        found, _ = end_on(mesh, between=False)
    else:
        found = on_finer_meshes("iterate_transmission_error", mesh, positions, end_on)
    best, highest = found.iterates[found.best], found.pressures[found.best]
    limits = {"max_relief": Limit(best.max_relief, None, float(max_relief), "um", True)}
    excess = 0.0
    if max_pressure is not None:
        excess = max(highest / float(max_pressure) - 1, 0.0)
        limits["max_contact_pressure"] = Limit(highest, None, float(max_pressure), "MPa", excess == 0.0)
    return Optimum(
        method="te_iteration",
        objective_name="ppte",
        parameters={},
        pinion=best.pinion,
        wheel=best.wheel,
        mesh=mesh,
        cycle=found.cycles[found.best],
        ppte=best.ppte,
        objective=best.ppte,
        objective_unit="um",
        positions=mesh.resolution.positions,
        grid_change=float("nan"),
        optimality=float("nan"),
        active_bounds={},
        constraints=limits,
        violation=excess,
        evaluations=sum(spent),
        history=np.asarray(found.reached),
        history_evaluations=np.cumsum(spent)[-len(found.reached) :],
        seconds=time.perf_counter() - began,
        iterations=tuple(found.iterates),
    )


def iterate_from_low_pressure(
    design: Design,
    bounds: Mapping[str, tuple[float, float]],
    *,
    mesh: Mesh,
    torque,
    max_relief: float = 7.0,
    method: AbstractMethod = SLP(),
    callback: Callback | None = None,
    **options,
) -> Optimum:
    """The iteration from the relief of a design that has the least contact pressure (the study's type 3).

    Args:
        design, bounds: of the relief to start from, as for `minimize`.
        mesh: prepared mesh.
        torque: on the pinion [N m].
        max_relief: most that is left removed anywhere, by the start too [um].
        method: of the search for the start.
        callback: of the search for the start and of the iteration.
        options: further ones of `iterate_transmission_error`.

    Returns:
        as `iterate_transmission_error`, with the analyses and the time of the start.
    """
    limit = Constraint("max_relief", high=max_relief)
    start = minimize(
        design,
        bounds,
        mesh=mesh,
        torque=torque,
        objective="max_contact_pressure",
        constraints=(limit,),
        method=method,
        positions=None,
        callback=callback,
    )
    options |= {"max_relief": max_relief, "callback": callback}
    found = iterate_transmission_error(mesh, torque, pinion=start.pinion, wheel=start.wheel, **options)
    return replace(
        found,
        evaluations=found.evaluations + start.evaluations,
        history_evaluations=found.history_evaluations + start.evaluations,
        seconds=found.seconds + start.seconds,
    )
