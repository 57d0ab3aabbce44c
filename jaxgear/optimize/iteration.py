"""Iteration that removes the variation of the transmission error from the flanks until it is constant."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, NamedTuple

import jax.numpy as jnp
import numpy as np

from ..conditions import cycle_status, solve_case, solved
from ..contact import Mesh, MeshCycle
from ..contact.mesh import later, parts
from ..contact.status import Status
from ..metrics import max_relief as largest_relief
from ..metrics import removed_at
from ..microgeometry import AbstractModification, NoModification, TabulatedProfile
from ..numerics import Callback, check
from ..numerics.fields import Checked, count, number
from .goal import Constraint, counted
from .method import SLP, AbstractMethod
from .problem import Problem
from .refine import fine_enough, on_finer_meshes
from .result import Iterate, Limit, Optimum


class IteratedFlanks:
    """Flanks of the iteration: initial modifications plus further material removed at the contact points."""

    def __init__(self, mesh: Mesh, pinion: AbstractModification, wheel: AbstractModification, most: float) -> None:
        contact = mesh.path_of_contact
        pitch, self._most = float(contact.base_pitch), most
        start, end = float(contact.start), float(contact.end)
        positions = mesh.resolution.positions
        first, last = np.ceil(start / pitch * positions), np.floor(end / pitch * positions)
        # the profile points are those that touch at a mesh position, and the ends of the path
        number = np.arange(first, last + 1)
        self._path = np.unique(np.concatenate([[start], number * pitch / positions, [end]]))
        self._phase = np.asarray(mesh.phase)
        # part of the way from the first double contact to either tip
        double = max(end - start - pitch, np.finfo(float).tiny)
        self._way = tuple(np.clip((tip + double) / double, 0.0, 1.0) for tip in (self._path - end, start - self._path))
        self._pitch, self._start = pitch, (pinion, wheel)
        self._roll = (
            np.asarray(contact.pinion_roll_length(jnp.asarray(self._path))),
            np.asarray(contact.wheel_roll_length(jnp.asarray(self._path))),
        )
        self._given = tuple(
            np.asarray(removed_at(side, modification, jnp.asarray(roll)))
            for side, modification, roll in zip(mesh.sides, self._start, self._roll)
        )
        self._extra = [np.zeros_like(self._path), np.zeros_like(self._path)]

    def modifications(self, slant: float = 0.0) -> tuple[AbstractModification, AbstractModification]:
        """Modifications of pinion and wheel, with the material removed slanted towards the tips."""
        made = []
        for index, (given, roll) in enumerate(zip(self._start, self._roll)):
            before = self._given[index]
            slanted = self._extra[index] * np.maximum(1 + slant * (2 * self._way[index] - 1), 0.0)
            extra = np.clip(before + slanted, 0.0, self._most) - before
            order = np.argsort(roll)
            table = TabulatedProfile(jnp.asarray(roll[order]), jnp.asarray(extra[order]))
            made.append(table if isinstance(given, NoModification) else given + table)
        return made[0], made[1]

    def take_off(self, missing: np.ndarray, alone: np.ndarray) -> None:
        """Remove the difference to the level at every position [um]; a negative difference adds material back."""
        at_path = np.interp(self._path / self._pitch, self._phase, missing, period=1.0)
        for index, outwards in enumerate((1.0, -1.0)):
            depth = outwards * self._path
            outer = depth >= self._onset(missing, alone, outwards)
            total = np.clip(self._given[index] + self._extra[index] + at_path, 0.0, self._most)
            self._extra[index] = np.where(outer, total - self._given[index], self._extra[index])

    def _onset(self, missing: np.ndarray, alone: np.ndarray, outwards: float) -> float:
        """Distance from the pitch point at which the transmission error leaves its extreme in single contact [mm]."""
        # phases as distances on the way out, half a base pitch to either side of the pitch point
        distance = outwards * ((self._phase + 0.5) % 1 - 0.5) * self._pitch
        side = alone & (distance >= 0)
        if not side.any():
            return 0.0
        return float(distance[side][np.argmin(missing[side])])


_UNTOUCHED = 0.05  # [um]: a flank with less relief than this counts as unmodified
_LOADED = 1e-6  # a pair with less than this share of the force carries none
_STEEPEST = 2.0  # slant of a relief that begins a quarter of the way to the tip, and is three times as high there
_HALVINGS = 5  # of the range of slants: the slant is the least one within 1/16


class _Levelled(NamedTuple):
    """States of an iteration.

    Attributes:
        iterates, cycles: summary and mesh cycle of every state.
        pressures: largest pressure of every state, on the meshes of `Pressure` [MPa].
        reached: lowest PPTE so far within the limit of the pressure [um].
        best: index of the state that is the result.
    """

    iterates: list[Iterate]
    cycles: list[MeshCycle]
    pressures: list[float]
    reached: list[float]
    best: int


@dataclass(frozen=True)
class Pressure:
    """Largest pressure of flanks and tip edges against its limit, on meshes whose positions together are a fine mesh.

    Attributes:
        limit: limit of the pressure; None for no limit.
        torque: torque on the pinion [N m].
        meshes: meshes with interleaved positions; the first is the mesh of the iteration.
    """

    limit: Constraint | None
    torque: float
    meshes: list[Mesh]

    def largest(self, pinion: AbstractModification, wheel: AbstractModification, cycle: MeshCycle | None) -> float:
        """Largest pressure of flanks and tip edges [MPa]; `cycle` is the solution on the first mesh or None."""
        cycles = [] if cycle is None else [cycle]
        cycles += [_solve(mesh, self.torque, pinion, wheel) for mesh in self.meshes[len(cycles) :]]
        # a contact is on the flank or at the tip edge, and zero in the other field
        return max(float(np.max(np.asarray(of.contact_pressure) + np.asarray(of.corner_pressure))) for of in cycles)

    def excess(self, pressure: float) -> float:
        """Relative excess of a pressure over the limit, counted from its margin; 0 inside or without a limit."""
        return 0.0 if self.limit is None else max(0.0, *map(float, self.limit.excess(jnp.asarray(pressure))))

    def passed(self, pressure: float) -> float:
        """Relative excess of a pressure over the limit, zero within the tolerance."""
        return float(counted(self.excess(pressure)))

    def holds_between(self, found: _Levelled, mesh: Mesh) -> bool:
        """True if the result also meets the limit at four times the positions of the mesh."""
        best, pressure = found.iterates[found.best], found.pressures[found.best]
        count = self.meshes[0].resolution.positions
        between = replace(self, meshes=[part for number in (1, 2, 3) for part in parts(later(mesh, number / 4), count)])
        finer = max(between.largest(best.pinion, best.wheel, None), pressure)
        nothing = np.empty((1, 0))  # its PPTE is that of the mesh of the iteration
        return fine_enough(nothing, np.asarray([self.excess(pressure)]), nothing, np.asarray([self.excess(finer)]))


def levelled(
    mesh: Mesh,
    flanks: IteratedFlanks,
    pressure: Pressure,
    rtol: float,
    steps: int,
    spent: list[int],
    callback: Callback | None,
) -> _Levelled:
    """Run the iteration; appends the number of contact analyses of every step to `spent`."""
    found = _Levelled([], [], [], [], 0)
    level = float("nan")
    for step in range(steps + 1):
        pinion, wheel, cycle, highest, solves = _least_slant(mesh, flanks, pressure, limited=step > 0)
        spent.append(solves)
        error, alone = np.asarray(cycle.transmission_error), _alone(cycle)
        found.iterates.append(_iterate(mesh, cycle, alone, pinion, wheel))
        found.cycles.append(cycle)
        found.pressures.append(highest)
        ranks = [(pressure.passed(of), state.ppte) for of, state in zip(found.pressures, found.iterates)]
        found = found._replace(best=ranks.index(min(ranks)))
        found.reached.append(ranks[found.best][1])
        if callback is not None:
            callback(step, steps, found.reached[-1])
        if step == 0:
            level = float(error[alone].max())
        if step == steps or _ended(found.iterates, rtol):
            break
        flanks.take_off(level - error, alone)
    return found


def _least_slant(
    mesh: Mesh, flanks: IteratedFlanks, pressure: Pressure, *, limited: bool
) -> tuple[AbstractModification, AbstractModification, MeshCycle, float, int]:
    """Flanks with the least slant within the pressure limit, or with the least pressure; and the analyses spent."""
    tried: dict[float, tuple[Any, ...]] = {}

    def passed(slant: float) -> float:
        pinion, wheel = flanks.modifications(slant)
        cycle = _solve(mesh, pressure.torque, pinion, wheel)
        highest = pressure.largest(pinion, wheel, cycle)
        tried[slant] = (pinion, wheel, cycle, highest)
        return pressure.passed(highest) if limited else 0.0

    low, high = 0.0, _STEEPEST
    excess = {low: passed(low)}
    if excess[low] and not excess.setdefault(high, passed(high)):
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            excess[middle] = passed(middle)
            low, high = (middle, high) if excess[middle] else (low, middle)
    slant = min(tried, key=lambda slant: (excess[slant], slant))
    return *tried[slant], len(tried)


def _ended(iterates: list[Iterate], rtol: float) -> bool:
    last = iterates[-1]
    if last.ppte - last.limit <= rtol * last.limit:
        return True
    return len(iterates) > 2 and iterates[-2].ppte - last.ppte < rtol * iterates[-2].ppte


def _solve(mesh: Mesh, torque, pinion: AbstractModification, wheel: AbstractModification) -> MeshCycle:
    cycle = solve_case(mesh, torque, pinion, wheel)
    if not solved(cycle):
        status = Status(int(cycle_status(cycle)))
        raise RuntimeError(f"a contact solution failed: {status.text}: {status.remedy}")
    return cycle


def _alone(cycle: MeshCycle) -> np.ndarray:
    """Indices of positions where a single pair carries the load on unmodified flanks."""
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


class TransmissionErrorIteration(Checked, AbstractMethod):
    """Iteration that levels the transmission error by removing its variation from the flanks.

    The deflection in single contact is given. In double contact the transmission error is smaller by h = q_max - q:
    this amount is removed from both pairs, from the pinion in recess and from the wheel in approach. The relief starts
    where the transmission error leaves its single-contact extreme. The step is repeated with the new flanks, because
    the contact of pairs beyond the path of contact begins the later, the more material is removed.

    Source: eq. (1) and the algorithm of "Design for manufacturing of a spur gears profile modification based on the
    static transmission error for improving the dynamic behavior", Int J Adv Manuf Technol 2023,
    doi 10.1007/s00170-023-12340-x, with the opposite sign of its q_0. As in the paper the total h is limited to values
    above zero: if a step has removed too much, the next one adds material back. The level q_max is that of the first
    state, since the single contact of unmodified flanks does not change; the paper takes its lower limit of the PPTE
    from the first state as well.

    With equal reliefs on both pairs the relief has a plateau up to the tip, and corner contact remains. The
    transmission error depends on the sum of both gaps, weighted by the stiffnesses of the pairs: other distributions
    between the leaving and the entering pair are equally level ("infinite solutions with equal peak-to-peak
    transmission error"). With `max_pressure` the relief is slanted: from the first double contact (u = 0) to the tip
    (u = 1) it is multiplied by 1 + t (2 u - 1), not less than 0, with the least slant t from 0 to 2 that keeps the
    pressure of flanks and tip edges within the limit. The amount at the tip follows from the pressure, as in the paper.

    The optimum is the state with the lowest PPTE within the pressure limit, or else the state with the lowest pressure;
    `Optimum.iterations` contains all states. The pressure is evaluated on a finer mesh of `positions`, which is refined
    until the limit is also met at four times its positions; everything else is evaluated on the mesh of the problem.

    Attributes:
        start: flanks of the first step: involutes ("unmodified", type 1 of the paper), the design of a problem without
            variables ("given", type 2), or the design of its variables with the least contact pressure
            ("low_pressure", type 3).
        max_relief: largest total material removed, the start included.
        max_pressure: largest pressure of flanks and tip edges; None for no limit.
        rtol: relative tolerance: the iteration ends when PPTE is within this part of its lower limit, or decreases by
            less than this part.
        steps: largest number of steps.
        search: method of the search for the start of low pressure.
    """

    name: ClassVar[str] = "te_iteration"
    takes_variables: ClassVar[bool] = False
    start: Literal["unmodified", "given", "low_pressure"] = "unmodified"
    max_relief: float = number("um", low=0.0, open_low=True, static=True, default=7.0)
    max_pressure: float | None = number("MPa", low=0.0, open_low=True, static=True, optional=True, default=None)
    rtol: float = number("", low=0.0, open_low=True, static=True, default=0.1)
    steps: int = count(default=5)
    search: AbstractMethod = SLP()

    def find(
        self, problem: Problem, *, positions: int | None, rounding: Mapping[str, float], callback: Callback | None
    ) -> Optimum:
        """Run the iteration.

        Raises:
            ValueError: for several torques, manufactured gears, constraints, another objective than PPTE, or rounding.
            RuntimeError: when a contact solution does not converge.
        """
        began, mesh, torque = time.perf_counter(), problem.mesh, float(problem.cases.torque[0])
        self._check(problem, rounding)
        pinion, wheel, before = self._first(problem, callback)
        limit = None if self.max_pressure is None else Constraint("max_contact_pressure", high=self.max_pressure)
        spent: list[int] = []

        def end_on(finer: Mesh, between: bool = True) -> tuple[_Levelled, bool]:
            flanks = IteratedFlanks(mesh, pinion, wheel, self.max_relief)
            pressure = Pressure(limit, torque, parts(finer, mesh.resolution.positions))
            found = levelled(mesh, flanks, pressure, self.rtol, self.steps, spent, callback)
            return found, between and pressure.holds_between(found, finer)

        if limit is None or positions is None:
            found, _ = end_on(mesh, between=False)
        else:
            found = on_finer_meshes(mesh, positions, end_on)
        best, highest = found.iterates[found.best], found.pressures[found.best]
        limits = {"max_relief": Limit(best.max_relief, None, self.max_relief, "um", True)}
        excess = 0.0
        if self.max_pressure is not None:
            excess = max(highest / self.max_pressure - 1, 0.0)
            limits["max_contact_pressure"] = Limit(highest, None, self.max_pressure, "MPa", excess == 0.0)
        return Optimum(
            method=self.name,
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
            evaluations=before + sum(spent),
            history=np.asarray(found.reached),
            history_evaluations=before + np.cumsum(spent)[-len(found.reached) :],
            seconds=time.perf_counter() - began,
            iterations=tuple(found.iterates),
        )

    def _check(self, problem: Problem, rounding: Mapping[str, float]) -> None:
        check("torque", problem.cases.torque, "N m", low=0.0, open_low=True)
        if problem.cases.count > 1 or problem.cases.removed is not None:
            raise ValueError("te_iteration levels the transmission error of nominal gears at a single torque")
        if [of.name for of in problem.objectives] != ["ppte"]:
            raise ValueError("objective must be ppte with te_iteration")
        if problem.constraints or rounding:
            raise ValueError("constraints and rounding have no effect with te_iteration; max_pressure is its limit")
        if self.start == "given" and problem.names:
            raise ValueError('start = "given" needs a design without variables')

    def _first(
        self, problem: Problem, callback: Callback | None
    ) -> tuple[AbstractModification, AbstractModification, int]:
        """Flanks of the first step, and the number of contact analyses to find them."""
        if self.start == "unmodified":
            return NoModification(), NoModification(), 0
        if self.start == "given":
            return *problem.modifications(np.empty(0)), 0
        posed = Problem(
            problem.mesh,
            problem.cases.first,
            problem.design,
            problem.bounds,
            objective="max_contact_pressure",
            constraints=(Constraint("max_relief", high=self.max_relief),),
        )
        found = self.search.find(posed, positions=None, rounding={}, callback=callback)
        return found.pinion, found.wheel, found.evaluations
