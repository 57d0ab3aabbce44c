"""Evaluation of a design over the torques of a design file."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import jax
import numpy as np

from ..contact import Mesh, MeshCycle, OperatingPoint, Resolution
from ..contact.mesh import fewer_slices, half_way, slices_left
from ..contact.status import Status, reason
from ..io import DesignFile, quantities_of_tables
from ..io.tables import FurtherTable
from ..metrics import (
    AbstractSettings,
    Analysis,
    Quantity,
    excited_by,
    face_load_factor,
    rating_factors,
    share_settings,
    summary,
)
from ..microgeometry import AbstractModification
from ..numerics import optional_real, program, real
from ..optimize import Verified
from ..sweeps import Scatter, over_torques
from ..vocabulary import quantities

_SURFACE_REACH, _SURFACE_TORQUES = 2.0, 21
_TORQUES, _QUICK_TORQUES = 25, 7  # over the range of the file
_QUICK_POSITIONS = 16
# extremes over the positions, which depend on their number
_EXTREMES = "ppte_um", "force_excitation_N", "max_flank_pressure_MPa", "max_corner_pressure_MPa"


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of one design.

    Attributes:
        pinion, wheel: modifications of pinion and wheel.
        cycle: mesh cycle at the design torque.
        metrics: values of quantities at the design torque, by name and unit.
        transmission_error: transmission error over the torques [um], shape (torques, positions).
        ppte: peak-to-peak transmission error over the torques [um], shape (torques,).
        objectives: values of the objectives of an optimization for this design, by name and unit; empty without one.
        grid_change: change of the values at the design torque at twice the positions and, for helical gears,
            extrapolated to infinitely many slices, by name and unit.
        failed_torques: torques without a converged contact solution [N m], the design torque included.
        cause: most basic reason at the failed torques, in words.
        seconds: time for search and evaluation [s], without compilation of the evaluation.
        factors: factors of the rating by ISO 6336 at the design torque, by name and unit.
        verified: results with the finite-element structure; None where they were not computed.
        face_load: face load factor over the torques, shape (torques,); empty for one slice.
        scatter: scatter over manufactured gears; None if the file has no tolerances.
    """

    pinion: AbstractModification
    wheel: AbstractModification
    cycle: MeshCycle
    metrics: dict[str, float | bool]
    transmission_error: np.ndarray
    ppte: np.ndarray
    grid_change: Mapping[str, float]
    failed_torques: list[float]
    cause: str
    seconds: float
    objectives: dict[str, float] = field(default_factory=dict)
    factors: dict[str, float] = field(default_factory=dict)
    verified: Verified | None = None
    face_load: np.ndarray = field(default_factory=lambda: np.empty(0))
    scatter: Scatter | None = None


def coarse(size: Resolution) -> Resolution:
    """Array sizes of a quick run, with fewer positions."""
    return replace(size, positions=min(size.positions, _QUICK_POSITIONS))


def torques_of(design: DesignFile, *, quick: bool) -> np.ndarray:
    """Torques at which designs are evaluated, over the range of the design file [N m], shape (torques,)."""
    return np.linspace(*design.torque_range, _QUICK_TORQUES if quick else _TORQUES)


def evaluation_of(
    file: DesignFile, mesh: Mesh, torques: np.ndarray, pinion: AbstractModification, wheel: AbstractModification
) -> Evaluation:
    """Evaluate a design at the torque of its file and at further torques [N m]."""
    every = np.concatenate([[file.torque], torques])
    over_torques(mesh, every[:1], pinion=pinion, wheel=wheel)  # compiles, where it has to
    began = time.perf_counter()
    cycles = over_torques(mesh, every, pinion=pinion, wheel=wheel)
    seconds = time.perf_counter() - began
    curves = np.asarray([cycle.transmission_error for cycle in cycles])
    infinite = Status.NOT_CONVERGED * ~np.isfinite(curves).all(axis=1)
    status = np.maximum([np.asarray(cycle.status).max() for cycle in cycles], infinite)
    running = OperatingPoint(real(file.torque), optional_real(file.speed), optional_real(file.friction))
    further, settings = share_settings(tuple(quantities_of_tables(file)))
    bare = replace(cycles[0], operating_point=running)
    if not any(isinstance(each, FurtherTable) and each.shown for each in file.tables.values()):
        bare = replace(bare, pinion=None, wheel=None)  # one program serves every kind of flank
    metrics, factors = jax.tree.map(lambda value: np.asarray(value).item(), _numbers(bare, further, settings))
    return Evaluation(
        pinion=pinion,
        wheel=wheel,
        cycle=cycles[0],
        metrics=metrics,
        transmission_error=curves[1:],
        ppte=np.ptp(curves[1:], axis=1),
        grid_change=grid_change(mesh, cycles[0], pinion, wheel),
        failed_torques=sorted({float(torque) for torque in every[status != Status.CONVERGED]}),
        cause=reason(status),
        seconds=seconds,
        factors=factors,
        face_load=_face_load(cycles[1:]),
    )


def grid_change(
    mesh: Mesh, cycle: MeshCycle, pinion: AbstractModification, wheel: AbstractModification
) -> dict[str, float]:
    """Change of the extremes of a cycle at twice the positions of its mesh, by name and unit.

    For helical gears the error of the slices is added (see `slices_left`), with equal signs so that the two do not
    cancel.
    """

    def solved(mesh: Mesh) -> MeshCycle:
        return over_torques(mesh, np.asarray([float(cycle.torque)]), pinion=pinion, wheel=wheel)[0]

    before, after = _extremes(cycle), _extremes(cycle, solved(half_way(mesh)))
    change = {name: after[name] - value for name, value in before.items()}
    fewer = fewer_slices(mesh)
    if fewer is None:
        return change
    coarse = solved(fewer)
    left = {name: slices_left(before[name], value) for name, value in _extremes(coarse).items()}
    # two curves may have the same extremes by chance: their difference does not vanish with them
    ripple = float(np.ptp(slices_left(np.asarray(cycle.transmission_error), np.asarray(coarse.transmission_error))))
    left["ppte_um"] = math.copysign(ripple, left["ppte_um"])
    return {name: max(by, left[name], by + left[name], key=abs) for name, by in change.items()}


def grid_of(sizes: Resolution, *, helical: bool) -> str:
    """Number of positions and, for helical gears, of slices, in words."""
    slices = f" and {sizes.slices} slices, whose error is estimated from a third of them" if helical else ""
    return f"{sizes.positions} positions{slices}"


def _extremes(*cycles: MeshCycle) -> dict[str, float]:
    """Extremes over the positions of several cycles together."""
    error, stiffness, flank, corner = (
        np.concatenate([np.asarray(getattr(cycle, name)).ravel() for cycle in cycles])
        for name in ("transmission_error", "tangent_stiffness", "contact_pressure", "corner_pressure")
    )
    found = np.ptp(error), np.ptp(excited_by(error, stiffness)), flank.max(), corner.max()
    return dict(zip(_EXTREMES, map(float, found)))


def face_change(before: MeshCycle, after: MeshCycle) -> dict[str, float]:
    """Change of K_Hbeta and of extremes between two mesh cycles with different slices, by name and unit."""
    found = [{"face_load_factor": float(_face_load([cycle])[0]), **_extremes(cycle)} for cycle in (before, after)]
    return {name: found[1][name] - value for name, value in found[0].items()}


def grid_lines(grid: str, changes: Mapping[str, Mapping[str, float]], more: str = "") -> Iterator[str]:
    """Lines on a grid and on the changes on a finer grid, one per quantity; `changes` by the name of the design."""
    said = [more] * bool(more)
    for metric in next(iter(changes.values())):
        quantity = quantities[metric]
        unit = f" {quantity.unit}".rstrip()
        # no change: the extreme lies at a position of both grids
        each = (
            f"{name} by {by:+.2g}{unit}" if (by := change[metric]) else f"{name} not"
            for name, change in changes.items()
        )
        said.append(f"{quantity.words}: {', '.join(each)}")
    yield f"evaluated at {grid}; twice as many change {said[0]}"
    yield from (f"  and {change}" for change in said[1:])


def response_surface(
    mesh: Mesh, torque: float, pinion: AbstractModification, wheel: AbstractModification
) -> tuple[np.ndarray, np.ndarray]:
    """Transmission error from zero load to twice the design torque.

    Returns:
        the torques [N m], shape (torques,), and the transmission error [um], shape (torques, positions).
    """
    torques = np.linspace(0.0, _SURFACE_REACH * torque, _SURFACE_TORQUES)
    cycles = over_torques(mesh, torques, pinion=pinion, wheel=wheel)
    return torques, np.asarray([cycle.transmission_error for cycle in cycles])


def _face_load(cycles: Sequence[MeshCycle]) -> np.ndarray:
    if not cycles or cycles[0].kinematics.resolution.slices == 1:
        return np.empty(0)
    bare = (replace(cycle, pinion=None, wheel=None) for cycle in cycles)  # one program serves every kind of flank
    return np.asarray([_factor(cycle) for cycle in bare])


@program
def _factor(cycle: MeshCycle):
    return face_load_factor(cycle)


@program
def _numbers(cycle: MeshCycle, further: tuple[Quantity, ...], settings: tuple[AbstractSettings, ...]):
    """Summary of a mesh cycle with further quantities that have settings, and rating factors of ISO 6336."""
    analysis = Analysis(cycle, None, settings)
    return summary(cycle) | {quantity.key: quantity(analysis) for quantity in further}, rating_factors(cycle)
