"""Evaluation of a design over the torques of a design file, kept until all of it is there."""

import dataclasses
import hashlib
import io
import os
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from ..contact import Mesh, MeshCycle, OperatingPoint
from ..contact.mesh import half_way
from ..dynamics import SpeedResponse
from ..io import DesignFile, quantities_of_tables, writing
from ..metrics import excited_by, face_load_factor, quantities, rating_factors, summary
from ..metrics.settings import of_tables
from ..microgeometry import AbstractModification
from ..numerics import Checked, optional_real, program, real
from ..numerics.durable import sealed, unsealed, write_durably
from ..optimize import Verified
from ..sweeps import Scatter, over_torques
from ..wear import March
from . import interrupt
from .version import version

_SURFACE_REACH, _SURFACE_TORQUES = 2.0, 21
# extremes over the positions, which depend on their number
_EXTREMES = "ppte_um", "force_excitation_N", "max_flank_pressure_MPa", "max_corner_pressure_MPa"


@dataclass(frozen=True)
class Evaluation:
    """One design.

    Attributes:
        pinion, wheel: its modifications.
        cycle: mesh cycle at the design torque.
        metrics: numbers at the design torque, by name and unit.
        transmission_error: over the torques, shape (torques, positions) [um].
        ppte: peak-to-peak transmission error over the torques [um].
        objectives: what an optimization made small, by name and unit, of this design; empty without one.
        grid_change: by how much numbers at the design torque change at twice the positions, by name and unit.
        failed_torques: torques without a converged contact solution [N m], the design torque included.
        seconds: what finding and evaluating it took, without compilation of the latter [s].
        factors: of the rating by ISO 6336 at the design torque, by name and unit.
        verified: what it is worth with the finite-element structure; None where nobody asked.
        face_load: face load factor over the torques; empty on one slice.
        scatter: over manufactured gears; None where the file has no tolerances.
    """

    pinion: AbstractModification
    wheel: AbstractModification
    cycle: MeshCycle
    metrics: dict[str, float | bool]
    transmission_error: np.ndarray
    ppte: np.ndarray
    grid_change: Mapping[str, float]
    failed_torques: list[float]
    seconds: float
    objectives: dict[str, float] = field(default_factory=dict)
    factors: dict[str, float] = field(default_factory=dict)
    verified: Verified | None = None
    face_load: np.ndarray = field(default_factory=lambda: np.empty(0))
    scatter: Scatter | None = None


def evaluate(
    file: DesignFile, mesh: Mesh, torques: np.ndarray, pinion: AbstractModification, wheel: AbstractModification
) -> Evaluation:
    """Evaluates a design at the torque of its file and at further ones [N m]."""
    every = np.concatenate([[file.torque], torques])
    over_torques(mesh, every[:1], pinion=pinion, wheel=wheel)  # compiles, where it has to
    began = time.perf_counter()
    cycles = over_torques(mesh, every, pinion=pinion, wheel=wheel)
    seconds = time.perf_counter() - began
    curves = np.asarray([cycle.transmission_error for cycle in cycles])
    converged = np.asarray([cycle.converged for cycle in cycles]) & np.isfinite(curves)
    # without the flanks: one program serves every kind of them
    running = OperatingPoint(real(file.torque), optional_real(file.speed), optional_real(file.friction))
    bare = replace(cycles[0], pinion=None, wheel=None, operating_point=running)
    # names and settings, which are arrays: one program serves all oils and strengths
    further = tuple(quantity.name for quantity in quantities_of_tables(file))
    tables = {name: file.tables.get(name) for name in ("lubricant", "strength")}
    metrics, factors = jax.tree.map(lambda value: np.asarray(value).item(), _numbers(bare, further, tables))
    return Evaluation(
        pinion=pinion,
        wheel=wheel,
        cycle=cycles[0],
        metrics=metrics,
        transmission_error=curves[1:],
        ppte=np.ptp(curves[1:], axis=1),
        grid_change=grid_change(mesh, cycles[0], pinion, wheel),
        failed_torques=sorted({float(torque) for torque in every[~converged.all(axis=1)]}),
        seconds=seconds,
        factors=factors,
        face_load=_face_load(cycles[1:]),
    )


def grid_change(
    mesh: Mesh, cycle: MeshCycle, pinion: AbstractModification, wheel: AbstractModification
) -> dict[str, float]:
    """By how much the extremes of a cycle change at twice the positions of its mesh, by name and unit."""
    torque = np.asarray([float(cycle.torque)])
    (between,) = over_torques(half_way(mesh), torque, pinion=pinion, wheel=wheel)
    before, after = _extremes(cycle), _extremes(cycle, between)
    return {name: after[name] - value for name, value in before.items()}


def _extremes(*cycles: MeshCycle) -> dict[str, float]:
    """Extremes over the positions of several cycles together."""
    error, stiffness, flank, corner = (
        np.concatenate([np.asarray(getattr(cycle, name)).ravel() for cycle in cycles])
        for name in ("transmission_error", "tangent_stiffness", "contact_pressure", "corner_pressure")
    )
    found = np.ptp(error), np.ptp(excited_by(error, stiffness)), flank.max(), corner.max()
    return dict(zip(_EXTREMES, map(float, found)))


def face_change(before: MeshCycle, after: MeshCycle) -> dict[str, float]:
    """By how much numbers change from a cycle to the same one on other slices, by name and unit."""
    found = [{"face_load_factor": float(_face_load([cycle])[0]), **_extremes(cycle)} for cycle in (before, after)]
    return {name: found[1][name] - value for name, value in found[0].items()}


def grid_lines(grid: str, changes: Mapping[str, Mapping[str, float]], more: str = "") -> Iterator[str]:
    """How fine a grid was, and what twice that would change, a quantity a line; `changes` by the name of the design."""
    said = [more] * bool(more)
    for metric in next(iter(changes.values())):
        quantity = quantities[metric]
        unit = f" {quantity.unit}".rstrip()
        # the same extreme: at a position that both grids have
        each = (
            f"{name} by {by:+.2g}{unit}" if (by := change[metric]) else f"{name} not"
            for name, change in changes.items()
        )
        said.append(f"{quantity.words}: {', '.join(each)}")
    yield f"evaluated at {grid}; twice as many change {said[0]}"
    yield from (f"  and {change}" for change in said[1:])


def response_surface(mesh: Mesh, torque: float, pinion: AbstractModification, wheel: AbstractModification):
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
def _numbers(cycle: MeshCycle, further: tuple[str, ...], tables: Mapping[str, Checked | None]):
    """The numbers of a cycle and some quantities of [lubricant] and [strength], and the factors of ISO 6336."""
    numbers = summary(cycle) | {quantities[name].key: of_tables(name, tables, cycle) for name in further}
    return numbers, rating_factors(cycle)


_Found = TypeVar("_Found")

_PAIR = "state"  # a field of two arrays


class Codec(Protocol[_Found]):
    """How results become named arrays and results again."""

    def arrays(self, found: _Found) -> dict[str, Any]:
        """All that a result holds."""

    def result(self, arrays: dict[str, Any]) -> _Found:
        """The result; raises `KeyError`, `TypeError` or `ValueError` for other arrays."""


class Kept(Generic[_Found]):
    """Results on the disk, by the digest of what they were made of.

    Args:
        folder: where they lie, beside the results; it goes when these are complete.
        codec: of the results.
        total: how many there will be; None where it is not known.
    """

    def __init__(self, folder: Path, codec: Codec[_Found], total: int | None = None):
        self._folder, self._codec, self._total, self._done = folder, codec, total, 0

    def __call__(self, made_of: Any, make: Callable[[], _Found]) -> _Found:
        """The result that is there, or that is made and then kept.

        Args:
            made_of: a pytree of all that it depends on.
            make: makes it.
        """
        path = self._folder / _digest(made_of)
        found = self._read(path)
        if found is None:
            found = jax.block_until_ready(make())
            with writing(path):
                self._folder.mkdir(parents=True, exist_ok=True)
                self._write(path, found)
        self._done += 1
        of_all = "" if self._total is None else f" of {self._total}"
        _note(f"{self._done}{of_all}", self._folder)
        return found

    def _write(self, path: Path, found: _Found) -> None:
        arrays: dict[str, Any] = {name: np.asarray(value) for name, value in self._codec.arrays(found).items()}
        content = io.BytesIO()
        np.savez(content, **arrays)
        write_durably(path, lambda file: file.write(sealed(content.getvalue())))

    def _read(self, path: Path) -> _Found | None:
        try:
            content = unsealed(path.read_bytes())
        except OSError:  # not there
            return None
        if content is None:  # torn, or no longer what was written
            return None
        with np.load(io.BytesIO(content)) as file:
            return self._codec.result(dict(file))

    def remove(self) -> None:
        """All is in the results now."""
        shutil.rmtree(self._folder, ignore_errors=True)


def runs_beside(target: Path) -> Path:
    """Where results are kept until those of a folder are there."""
    return target.with_name(f".{target.name}.runs")


def note_runs(target: Path) -> None:
    """Tells of the results that an interrupted command has kept for a folder, where there are any."""
    folder = runs_beside(target)
    with writing(folder):
        there = sum(not path.name.startswith(".") for path in folder.iterdir()) if folder.is_dir() else 0
    if there:
        _note(str(there), folder)


def _note(count: str, folder: Path) -> None:
    interrupt.note(f"{count} runs are kept in {folder}{os.sep}, go on with the same command")


def _digest(tree: Any) -> str:
    leaves, structure = jax.tree.flatten(tree)
    digest = hashlib.sha256(f"{version()} {jax.__version__} {structure}".encode())
    for leaf in leaves:
        array = np.asarray(leaf)
        digest.update(f"{array.dtype}{array.shape}".encode() + array.tobytes())
    return digest.hexdigest()


class SpeedResponses:
    """Speed responses as arrays."""

    def arrays(self, found: SpeedResponse) -> dict[str, Any]:
        """All that a response holds."""
        fields = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
        displacement, velocity = fields.pop(_PAIR)
        return {"displacement": displacement, "velocity": velocity, **fields}

    def result(self, arrays: dict[str, Any]) -> SpeedResponse:
        """The response."""
        orders = tuple(arrays.pop("orders").tolist())
        direction: Any = str(arrays.pop("direction"))
        known: dict[str, Any] = {name: jnp.asarray(value) for name, value in arrays.items()}
        known[_PAIR] = known.pop("displacement"), known.pop("velocity")
        return SpeedResponse(**known, orders=orders, direction=direction)


class Marches:
    """Blocks of wear as arrays."""

    def arrays(self, found: March) -> dict[str, Any]:
        """All that they hold."""
        return {"depth": found.depth, "error": found.error, "known": found.known, **found.seen}

    def result(self, arrays: dict[str, Any]) -> March:
        """The blocks."""
        known = {name: jnp.asarray(value) for name, value in arrays.items()}
        return March(known.pop("depth"), known.pop("error"), known.pop("known"), known)
