"""Contact over whole revolutions, in windows of one base pitch, each with the deviations of the teeth in mesh."""

from dataclasses import fields
from functools import partial, reduce
from operator import add
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..conditions.join import side_by_side
from ..contact import Kinematics, Mesh, MeshCycle, Resolution, solve_removed
from ..contact.face_coupling import check_torque
from ..contact.operating_point import OperatingPoint, Torque, operating_point_of
from ..contact.slide import RemovedMaterial
from ..contact.solve import check_alike, flanks_of, material_of, outermost, wider_mesh
from ..contact.status import Status, Statuses, WithStatus, status_of
from ..geometry import Gear, Margins
from ..microgeometry import AbstractModification, terms
from ..numerics import kernel, program
from .settings import Teeth
from .teeth import TeethDeviations

Curve = Float[Array, "*batch places"]
GearName = Literal["pinion", "wheel"]
GEARS: tuple[GearName, GearName] = ("pinion", "wheel")


class Revolution(WithStatus, eqx.Module):
    """Result of `solve_revolution`: consecutive mesh cycles with different teeth in mesh; `jax.vmap` adds batch axes.

    Attributes:
        cycles: mesh cycles of the windows of one base pitch; the windows are the last batch axis. Metrics accept them
            like any mesh cycles.
        teeth: numbers of teeth of pinion and wheel.
        repeats: True if the windows are periodic: all gears with deviations have made whole revolutions.
    """

    cycles: MeshCycle
    teeth: tuple[int, int] = eqx.field(static=True)
    repeats: bool = eqx.field(static=True)

    @property
    def status(self) -> Array:
        """Status at every place, see `MeshCycle`, shape (places,)."""
        return _joined(self.cycles.status)

    @property
    def windows(self) -> int:
        """Number of windows of one base pitch."""
        return self.cycles.transmission_error.shape[-2]

    @property
    def phase(self) -> Float[Array, " places"]:
        """Mesh position in base pitches, shape (places,) without batch axes; places are windows times positions."""
        phase = self.cycles.phase
        return (jnp.arange(self.windows, dtype=phase.dtype)[:, None] + phase[None]).ravel()

    @property
    def transmission_error(self) -> Curve:
        """Transmission error, see `MeshCycle` [um], shape (places,)."""
        return _joined(self.cycles.transmission_error)

    @property
    def unloaded_transmission_error(self) -> Curve:
        """Unloaded transmission error, see `MeshCycle` [um], shape (places,)."""
        return _joined(self.cycles.unloaded_transmission_error)

    @property
    def tangent_stiffness(self) -> Curve:
        """Tangent stiffness, see `MeshCycle` [N/um], shape (places,)."""
        return _joined(self.cycles.tangent_stiffness)

    @property
    def pair_share(self) -> Float[Array, "*batch meshes"]:
        """Load share of every pair, integrated over its time in mesh [base pitches]; 1 on average.

        Pair 0 touches at the pitch point at phase 0. Periodic windows have as many pairs as windows; otherwise the
        pairs with a complete passage within the windows are included, see `first_pair`.
        """
        forces = self.cycles.pair_force
        shares = jnp.mean(forces / jnp.sum(forces, axis=-2, keepdims=True), axis=-1)
        pairs, leading = shares.shape[-1], self.cycles.kinematics.resolution.leading
        # pair n is row n - window + leading
        if self.repeats:
            return reduce(add, (jnp.roll(shares[..., row], row - leading, axis=-1) for row in range(pairs)))
        whole = self.windows - pairs + 1
        return reduce(add, (shares[..., pairs - 1 - row :, row][..., :whole] for row in range(pairs)))

    @property
    def first_pair(self) -> int:
        """Number of the first pair in `pair_share`."""
        resolution = self.cycles.kinematics.resolution
        return 0 if self.repeats else resolution.chosen_pairs - 1 - resolution.leading

    def __str__(self) -> str:
        error = self.transmission_error
        if error.ndim > 1:
            return f"{error.shape[:-1]} of Revolution, {self.windows} base pitches"
        state = "converged" if bool(jnp.all(self.converged)) else "NOT CONVERGED"
        return (
            f"Revolution of {self.teeth[0]}/{self.teeth[1]} teeth over {self.windows} base pitches, {state}\n"
            f"  transmission error   mean {float(error.mean()):.3f} um, peak to peak {float(jnp.ptp(error)):.3f} um"
        )


def _joined(values: Array) -> Array:
    """Values (windows, positions) of one place after the other."""
    return values.reshape(*values.shape[:-2], -1)


def solve_revolution(
    mesh: Mesh,
    torque: Torque,
    teeth: Teeth,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> Revolution:
    """Loaded tooth contact over whole revolutions of gears with deviations of single teeth.

    Window k is the base pitch that lies k base pitches after that of the mesh; pair n is tooth n mod z1 of the pinion
    on tooth n mod z2 of the wheel. Each window is a separate contact problem, solved like `solve` for the material
    removed by modifications and by the deviations of its teeth. Few windows are in memory at a time; reverse mode
    computes them again.

    Args:
        mesh: prepared mesh; deviations that vary over the face need several slices.
        torque: torque on the pinion [N m], shape (); or an `OperatingPoint`.
        teeth: deviations of the teeth, and number of base pitches.
        pinion: modification of all teeth of the pinion; None for the nominal involute.
        wheel: modification of all teeth of the wheel; None for the nominal involute.

    Returns:
        the revolution, differentiable with respect to every number. If the number of pairs was chosen automatically and
        is too small for this load, more pairs are used, unless traced.

    Raises:
        TypeError: if the arguments are not a prepared mesh, settings of teeth or modifications.
        ValueError: for deviations of another number of teeth, and for all errors of `solve`.
    """
    check_alike(mesh)
    if not isinstance(teeth, Teeth):
        raise TypeError(f"teeth is a {type(teeth).__name__}, must be of Teeth")
    operating_point = operating_point_of(torque, mesh.slice_width.dtype)
    check_torque(mesh.support_torque, operating_point.torque)
    flanks = flanks_of(mesh, pinion, wheel)
    _check_slices(mesh, teeth)
    counts = teeth.counts_of(mesh.pair)
    windows = teeth.windows(counts)
    found: dict[str, Any] = _contacts(mesh, operating_point, flanks, teeth.deviations, counts, windows)
    wider = wider_mesh(mesh, found["status"])
    if wider is not None:
        return solve_revolution(wider, operating_point, teeth, pinion=pinion, wheel=wheel)
    return Revolution(_cycles(mesh.kinematics, mesh.margins, operating_point, found), counts, teeth.repeats(counts))


def _check_slices(mesh: Mesh, teeth: Teeth) -> None:
    """Raise a `ValueError` for deviations that vary along the face on a mesh of one slice."""
    if mesh.resolution.slices > 1:
        return
    for name, of in zip(GEARS, teeth.deviations):
        if of is None or of.flanks is None:
            continue
        for tooth in range(of.teeth):
            flank = jax.tree.map(lambda leaf, tooth=tooth: jnp.asarray(leaf)[tooth], of.flanks)
            if any(term.varies_along_face for term in terms(flank)):
                raise ValueError(
                    f"flanks of the {name} vary along the face, which a mesh of 1 slice cannot show: "
                    "prepare with Resolution(slices=11)"
                )


Flanks = tuple[AbstractModification, AbstractModification]
Deviations = tuple[TeethDeviations | None, TeethDeviations | None]


# fields of a mesh cycle that do not differ between windows
_COMMON = "kinematics", "margins", "operating_point", "pinion", "wheel"
_CONTACT = tuple(field.name for field in fields(MeshCycle) if field.name not in _COMMON)


@program
def _cycles(kinematics: Kinematics, margins: Margins, at: OperatingPoint, found: dict[str, Any]) -> MeshCycle:
    """Mesh cycles of all windows from their results and the common kinematics and load."""
    return jax.vmap(lambda each: MeshCycle(kinematics, margins, at, None, None, **each))(found)


@kernel
def _contacts(
    mesh: Mesh, at: OperatingPoint, flanks: Flanks, deviations: Deviations, counts: tuple[int, int], windows: int
) -> dict[str, Array]:
    """Contact results and status of every window, leading axis (windows,)."""
    dtype, sizes = mesh.slice_width.dtype, mesh.resolution
    deviations = jax.tree.map(lambda leaf: leaf.astype(dtype) if eqx.is_inexact_array(leaf) else leaf, deviations)
    # without teeth of their own shape the material is the same in all windows, but for a displacement of every pair
    alike = not any(of is not None and of.differ_in_shape for of in deviations)
    design = material_of(mesh, at.torque, *flanks) if alike else None

    @partial(jax.checkpoint, prevent_cse=False)
    def cycle(window: Int[Array, ""]) -> dict[str, Array]:
        numbers = window + pairs_in_window(sizes)
        pitch = _displacement(mesh, deviations, counts, numbers)
        removed = design
        if removed is None:
            own = _own(mesh, deviations, counts, numbers[1:-1])
            removed = material_of(mesh, at.torque, *flanks, own)
        found, status = displaced(mesh, at, removed, pitch)
        return {**{name: getattr(found, name) for name in _CONTACT}, "status": status}

    batches = -(-windows // side_by_side(mesh))
    size = -(-windows // batches)
    # whole batches only: a rest would be a program of its own, which takes as long to compile
    found = jax.lax.map(cycle, jnp.arange(batches * size), batch_size=size)
    return jax.tree.map(lambda part: part[:windows], found)


def pairs_in_window(sizes: Resolution) -> Int[np.ndarray, " pairs"]:
    """Numbers of the pairs of teeth of window 0, with one more pair on either side."""
    return np.arange(-1, sizes.chosen_pairs + 1) - sizes.leading


def displaced(mesh: Mesh, at: Torque, removed: RemovedMaterial, pitch: Array) -> tuple[MeshCycle, Statuses]:
    """Mesh cycle and status of a window with pitch deviations of its pairs [um], in the order of `pairs_in_window`."""
    removed = removed + pitch[1:-1, None, None]
    found = solve_removed(mesh, at, removed)
    return found, _status(mesh, found, removed, pitch)


def _displacement(mesh: Mesh, deviations: Deviations, counts: tuple[int, int], numbers: Array) -> Float[Array, " n"]:
    """Separation of the pairs by their pitch deviations [um], shape (n,)."""
    total = jnp.zeros(numbers.shape, mesh.slice_width.dtype)
    for gear, of, count in zip(mesh.pair.gears, deviations, counts):
        if of is not None:
            total = total + of.along_line(gear).astype(total.dtype)[numbers % count]
    return total


def _own(mesh: Mesh, deviations: Deviations, counts: tuple[int, int], numbers: Array) -> Flanks:
    """Modifications of the teeth of every pair besides their pitch deviations, for `material_of`."""

    def of_gear(gear: Gear, of: TeethDeviations | None, count: int, direction: float) -> Any:
        of = TeethDeviations(jnp.zeros(count, mesh.slice_width.dtype)) if of is None else of
        return jax.vmap(lambda number: of.of_tooth(number, gear, direction))(numbers % count)

    pinion, wheel = map(of_gear, mesh.pair.gears, deviations, counts, (1.0, -1.0))
    return pinion, wheel


def _status(mesh: Mesh, cycle: MeshCycle, removed: Any, pitch: Array) -> Array:
    """Status of a cycle; the next pairs behind and ahead may be displaced against those at the edges."""
    apart = jnp.minimum(jnp.minimum(pitch[0] - pitch[1], pitch[-1] - pitch[-2]), 0.0)
    windup = mesh.hub * cycle.force / mesh.pair.face_width
    error = cycle.transmission_error - windup - mesh.support_deflection(cycle.line_load)
    near = error >= outermost(mesh, removed) + apart
    return status_of({Status.MORE_PAIRS_NEEDED: near & cycle.converged}, cycle.status)


def whole_revolutions(revolution: Revolution, gear: GearName) -> int:
    """Revolutions of a gear in the windows.

    Raises:
        ValueError: for an unknown gear, or if the gear does not make whole revolutions and so has no orders.
    """
    if gear not in GEARS:
        raise ValueError(f'gear = {gear!r} must be "pinion" or "wheel"')
    teeth, windows = revolution.teeth[GEARS.index(gear)], revolution.windows
    if windows % teeth or not revolution.repeats:
        raise ValueError(
            f"{windows} base pitches are no whole revolutions of all gears whose teeth differ, or of the "
            f'{gear} ({teeth} teeth): solve over "hunting"'
        )
    return windows // teeth
