"""The states of the transmission-error iteration, and how its pressure is judged."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from ..conditions import solve_case, solved
from ..contact import Mesh, MeshCycle
from ..contact.parts import later, parts
from ..metrics import max_relief as largest_relief
from ..microgeometry import AbstractModification
from ..numerics import Callback
from .goal import Constraint, counted
from .iterated_flanks import Flanks
from .refine import fine_enough
from .result import Iterate

_UNTOUCHED = 0.05  # [um]: a flank with less relief than this counts as unmodified
_LOADED = 1e-6  # a pair with less than this share of the force carries none
_STEEPEST = 2.0  # slant of a relief that begins a quarter of the way to the tip, and is three times as high there
_HALVINGS = 5  # of the range of slants: the slant is the least one within 1/16


class Levelled(NamedTuple):
    """All states of an iteration.

    Attributes:
        iterates, cycles: of every state.
        pressures: largest pressure of every state, on the mesh that judges it [MPa].
        reached: least PPTE so far within the limit of the pressure [um].
        best: number of the state that is the result.
    """

    iterates: list[Iterate]
    cycles: list[MeshCycle]
    pressures: list[float]
    reached: list[float]
    best: int


@dataclass(frozen=True)
class Pressure:
    """Largest pressure of flanks and tip edges against its limit, on meshes that together are a finer one.

    Attributes:
        limit: None without.
        torque: on the pinion [N m].
        meshes: the first is that of the iteration.
    """

    limit: Constraint | None
    torque: float
    meshes: list[Mesh]

    def largest(self, pinion: AbstractModification, wheel: AbstractModification, cycle: MeshCycle | None) -> float:
        """The largest pressure [MPa]; the cycle of the first mesh is known, or None."""
        cycles = [] if cycle is None else [cycle]
        cycles += [_solve(mesh, self.torque, pinion, wheel) for mesh in self.meshes[len(cycles) :]]
        # a contact is on the flank or at the tip edge, and zero in the other field
        return max(float(np.max(np.asarray(of.contact_pressure) + np.asarray(of.corner_pressure))) for of in cycles)

    def excess(self, pressure: float) -> float:
        """By how much of the limit a pressure misses what is aimed at; 0 without a limit."""
        return 0.0 if self.limit is None else max(0.0, *map(float, self.limit.excess(jnp.asarray(pressure))))

    def passed(self, pressure: float) -> float:
        """The excess that counts."""
        return float(counted(self.excess(pressure)))

    def holds_between(self, found: Levelled, mesh: Mesh) -> bool:
        """Whether the result keeps the limit at four times the positions of the mesh as well."""
        best, pressure = found.iterates[found.best], found.pressures[found.best]
        count = self.meshes[0].resolution.positions
        between = replace(self, meshes=[part for number in (1, 2, 3) for part in parts(later(mesh, number / 4), count)])
        finer = max(between.largest(best.pinion, best.wheel, None), pressure)
        nothing = np.empty((1, 0))  # its PPTE is that of the mesh of the iteration
        return fine_enough(nothing, np.asarray([self.excess(pressure)]), nothing, np.asarray([self.excess(finer)]))


def levelled(
    mesh: Mesh,
    flanks: Flanks,
    pressure: Pressure,
    rtol: float,
    steps: int,
    spent: list[int],
    callback: Callback | None,
) -> Levelled:
    """Runs the iteration; appends the contact analyses of every step to those that were spent."""
    found = Levelled([], [], [], [], 0)
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
    mesh: Mesh, flanks: Flanks, pressure: Pressure, *, limited: bool
) -> tuple[AbstractModification, AbstractModification, MeshCycle, float, int]:
    """Both flanks with the least slant that keeps the pressure, or else the least pressure; solved, by how many."""
    tried: dict[float, tuple] = {}

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
