"""The transmission error taken off the flank, again and again, until it is level."""

import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..conditions import Design, solve_case, solved
from ..contact import Mesh, MeshCycle
from ..metrics import max_relief as largest_relief
from ..microgeometry import AbstractModification, NoModification
from ..numerics import Callback, check, whole
from .goal import Constraint
from .iterated_flanks import Flanks
from .minimax import Minimax
from .minimize import minimize
from .result import Iterate, Limit, Optimum
from .search import AbstractMethod

_UNTOUCHED = 0.05  # [um]: a flank with less relief than this counts as unmodified
_LOADED = 1e-6  # a pair with less than this share of the force carries none
_STEEPEST = 2.0  # slant of a relief that begins a quarter of the way to the tip, and is three times as high there
_HALVINGS = 5  # of the range of slants: the slant is the least one within 1/16


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
    flanks = Flanks(mesh, pinion or NoModification(), wheel or NoModification(), float(max_relief))
    limit = np.inf if max_pressure is None else float(max_pressure)
    cycles: list[MeshCycle] = []
    iterates: list[Iterate] = []
    spent: list[int] = []
    reached: list[float] = []
    level = float("nan")
    for step in range(steps + 1):
        pinion, wheel, cycle, solves = _least_slant(mesh, torque, flanks, limit if step else np.inf)
        cycles.append(cycle)
        spent.append(solves)
        error, alone = np.asarray(cycle.transmission_error), _alone(cycle)
        iterates.append(_iterate(mesh, cycle, alone, pinion, wheel))
        reached.append(iterates[_best(iterates, limit)].ppte)
        if callback is not None:
            callback(step, steps, reached[-1])
        if step == 0:
            level = float(error[alone].max())
        if step == steps or _ended(iterates, rtol):
            break
        flanks.take_off(level - error, alone)
    number = _best(iterates, limit)
    best = iterates[number]
    limits = {"max_relief": Limit(best.max_relief, None, float(max_relief), "um", True)}
    excess = max(best.max_pressure / limit - 1, 0.0)
    if max_pressure is not None:
        limits["max_contact_pressure"] = Limit(best.max_pressure, None, limit, "MPa", excess == 0.0)
    return Optimum(
        method="te_iteration",
        objective_name="ppte",
        parameters={},
        pinion=best.pinion,
        wheel=best.wheel,
        mesh=mesh,
        cycle=cycles[number],
        ppte=best.ppte,
        objective=best.ppte,
        objective_unit="um",
        positions=mesh.resolution.positions,
        grid_change=float("nan"),
        decrease_left=float("nan"),
        active_bounds={},
        constraints=limits,
        violation=excess,
        evaluations=sum(spent),
        history=np.asarray(reached),
        history_evaluations=np.cumsum(spent),
        seconds=time.perf_counter() - began,
        iterations=tuple(iterates),
    )


def iterate_from_low_pressure(
    design: Design,
    bounds: Mapping[str, tuple[float, float]],
    *,
    mesh: Mesh,
    torque,
    max_relief: float = 7.0,
    method: AbstractMethod = Minimax(),
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


def _best(iterates: list[Iterate], limit: float) -> int:
    """Number of the state with the least PPTE within the limit of the pressure, else of the one with the least."""
    excess = [max(state.max_pressure - limit, 0.0) for state in iterates]
    return min(range(len(iterates)), key=lambda number: (excess[number], iterates[number].ppte))


def _least_slant(
    mesh: Mesh, torque, flanks: Flanks, limit: float
) -> tuple[AbstractModification, AbstractModification, MeshCycle, int]:
    """Both flanks with the least slant that keeps the pressure, or else the least pressure; solved, by how many."""
    tried: dict[float, tuple] = {}

    def kept(slant: float) -> bool:
        pinion, wheel = flanks.modifications(slant)
        cycle = _solve(mesh, torque, pinion, wheel)
        # a contact is on the flank or at the tip edge, and zero in the other field
        pressure = float(np.max(np.asarray(cycle.contact_pressure) + np.asarray(cycle.corner_pressure)))
        tried[slant] = (pinion, wheel, cycle, pressure)
        return tried[slant][-1] <= limit

    low, high = 0.0, _STEEPEST
    if not kept(low) and kept(high):
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if kept(middle) else (middle, high)
    slant = min(tried, key=lambda slant: (max(tried[slant][-1] - limit, 0.0), slant))
    return *tried[slant][:3], len(tried)


def _ended(iterates: list[Iterate], rtol: float) -> bool:
    last = iterates[-1]
    if last.ppte - last.limit <= rtol * last.limit:
        return True
    return len(iterates) > 2 and iterates[-2].ppte - last.ppte < rtol * iterates[-2].ppte


def _solve(mesh: Mesh, torque, pinion: AbstractModification, wheel: AbstractModification) -> MeshCycle:
    cycle = solve_case(mesh, torque, pinion, wheel)
    if not solved(cycle):
        raise RuntimeError("iterate_transmission_error: a contact solution did not converge")
    return cycle


def _alone(cycle: MeshCycle) -> np.ndarray:
    """Positions where one pair alone carries the load, on unmodified flank."""
    error = np.asarray(cycle.transmission_error)
    loaded = np.asarray(cycle.pair_force) > _LOADED * float(cycle.force)
    single = loaded.sum(axis=0) == 1
    untouched = (np.asarray(cycle.gap).min(axis=1) < _UNTOUCHED) | ~loaded
    # a relief over the whole profile leaves no such position, and a high contact ratio no single contact at all
    choices = single & untouched.all(axis=0), single, error == error.max()
    return next(choice for choice in choices if choice.any())


def _iterate(mesh: Mesh, cycle: MeshCycle, alone: np.ndarray, pinion, wheel) -> Iterate:
    error = np.asarray(cycle.transmission_error)
    return Iterate(
        pinion=pinion,
        wheel=wheel,
        transmission_error=error,
        ppte=float(np.ptp(error)),
        limit=float(np.ptp(error[alone])),
        max_relief=float(largest_relief(mesh, pinion=pinion, wheel=wheel)),
        max_flank_pressure=float(np.max(np.asarray(cycle.contact_pressure))),
        max_corner_pressure=float(np.max(np.asarray(cycle.corner_pressure))),
    )
