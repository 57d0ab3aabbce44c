"""The flank as a state over its life: wear of both gears, and what it makes of the mesh."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..conditions import LoadSpectrum
from ..contact import Mesh, MeshCycle, Operation, removed_material, solve_removed
from ..contact.operation import operation_of
from ..contact.solve import check_mesh, flanks_of
from ..microgeometry import AbstractModification, TabulatedFlank, TabulatedProfile
from ..numerics import Checked, check, kernel, maximum, real, result, whole
from .archard import worn
from .coefficient import wear_law
from .deposit import PARTS, Deposit, deposit
from .march import BLOCKS_OF_A_PAIR, march

Scalar = Float[Array, ""]
Lives = Float[Array, " lives"]
Depths = Float[Array, "lives slices points"]

BLOCKS = 20
# what a cycle holds that differs from flank to flank
_FOUND = (
    "transmission_error",
    "unloaded_transmission_error",
    "line_load",
    "pair_force",
    "opening",
    "gap",
    "shift",
    "bend",
    "tangent_stiffness",
    "residual",
    "converged",
)


class WearLife(Checked):
    """A pair of flanks over its life; at the start of every block and after the last one.

    Attributes:
        revolutions: of the pinion, shape (lives,).
        roll_length: of the grid points of pinion and wheel [mm], shape (gears, points).
        arc: of the flank that belongs to every point [mm], shape (gears, points).
        face_coordinate: of the lines along the profile [mm], shape (slices,).
        slice_width: of the face that belongs to every line [mm], shape (slices,).
        depth: worn off pinion and wheel by contact of the flanks and by tip corners [um], shape (lives, gears, parts,
            slices, points).
        error: estimate of the error of that depth by the length of the blocks, largest of all points [um], shape
            (lives,).
        cycles: the mesh on these flanks, leading axis (lives,); (lives, torques) under a load spectrum.
        weights: of the torques of a load spectrum, shape (torques,); None under one torque.
    """

    revolutions: Lives = result()
    roll_length: Float[Array, "gears points"] = result("mm")
    arc: Float[Array, "gears points"] = result("mm")
    face_coordinate: Float[Array, " slices"] = result("mm")
    slice_width: Float[Array, " slices"] = result("mm")
    depth: Float[Array, "lives gears parts slices points"] = result("um")
    error: Lives = result("um")
    cycles: MeshCycle
    weights: Float[Array, " torques"] | None = result()

    @property
    def pinion_depth(self) -> Depths:
        """Worn off the pinion in all [um], shape (lives, slices, points)."""
        return jnp.sum(self.depth[..., 0, :, :, :], axis=-3)

    @property
    def wheel_depth(self) -> Depths:
        """Worn off the wheel in all [um], shape (lives, slices, points)."""
        return jnp.sum(self.depth[..., 1, :, :, :], axis=-3)

    def flanks(self, life: int = -1) -> tuple[AbstractModification, AbstractModification]:
        """What is worn off pinion and wheel, as modifications: `TabulatedProfile`, or `TabulatedFlank` over slices.

        They add to the modifications of the new flanks. Interpolated linearly, they hold the worn volume.

        Args:
            life: which of the lives; the last one by default.
        """
        return tables(self.roll_length, self.face_coordinate, self.depth[life])


def tables(roll_length, face_coordinate, depth) -> tuple[AbstractModification, AbstractModification]:
    """Worn material (gears, parts, slices, points) as modifications of pinion and wheel."""
    total = jnp.sum(depth, axis=1)

    def of(gear: int) -> AbstractModification:
        if len(face_coordinate) == 1:
            return TabulatedProfile(roll_length[gear], total[gear, 0])
        return TabulatedFlank(roll_length[gear], face_coordinate, total[gear].T)

    return of(0), of(1)


def wear(
    mesh: Mesh,
    torque: Any,
    revolutions: Any,
    *,
    coefficient: Any,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    deviation: Any = None,
    blocks: int = BLOCKS,
    points: int | None = None,
) -> WearLife:
    """Wear of both flanks over their life, in blocks of revolutions of one length: contact, wear, new flank, again.

    Every tooth of a gear wears alike. Differentiable with respect to every number in it, and for `jax.vmap`.

    Wear levels the load, so that a block must not wear off more than the teeth deflect under their load: beyond
    twice that, flanks overshoot from block to block. `error` tells; on smooth loads it falls with the square of the
    number of blocks.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], an `Operation`, or a `LoadSpectrum` whose weights are shares of the revolutions.
        revolutions: of the pinion, all together.
        coefficient: of wear [m2/N] of both gears, or a pair of numbers, (pinion, wheel); from 1e-18 for good films to
            5e-16 for mild wear of mixed lubrication. Or a function of the state of lubrication at every contact, of
            pressure [MPa], sliding speed [m/s] and flash temperature [K], arrays of shape (pairs, slices, positions),
            to such an array or a pair of them; traced. It needs the speed of an `Operation`.
        pinion, wheel: modifications of the new flanks; None for nominal involutes.
        deviation: material that manufacturing deviations remove besides [um], shape (pairs, slices, positions);
            None for perfect gears.
        blocks: of equal length, even: two and two are compared with one of double length.
        points: of the grid on each flank, evenly spaced from the start of the active profile to the tip; None for half
            as many as the mesh has positions, and one. Points nearer to each other than the contact is wide show no
            more, and pile up at the tip what the contact there would wear beyond it.

    Returns:
        flanks and mesh at the start of every block and after the last one.

    Raises:
        TypeError: for something else than a prepared mesh or a modification.
        ValueError: for numbers out of their range, an odd number of blocks, a coefficient that is a function where
            there is no speed, and whatever `solve` refuses.
    """
    check_mesh("wear", mesh)
    pinion, wheel = flanks_of("wear", mesh, pinion, wheel)
    dtype = mesh.slice_width.dtype
    loads, weights = _loads(torque, dtype)
    revolutions = real(revolutions).astype(dtype)
    if revolutions.ndim:
        raise ValueError(f"wear: revolutions has shape {revolutions.shape}, must be a single number")
    check("wear", "revolutions", revolutions, "", low=0.0, open_low=True)
    check_blocks("wear", blocks)
    points = mesh.resolution.positions // 2 + 1 if points is None else whole("wear", "points", points, low=3)
    law = wear_law(coefficient, loads, dtype)
    other = jnp.zeros((), dtype) if deviation is None else real(deviation).astype(dtype)
    return _wear(mesh, loads, weights, revolutions, law, pinion, wheel, other, blocks, points)


def check_blocks(owner: str, blocks: int) -> None:
    """Raises a one-line `ValueError` for something else than an even number of blocks."""
    if whole(owner, "blocks", blocks, low=2) % BLOCKS_OF_A_PAIR:
        raise ValueError(f"{owner}: blocks = {blocks} must be even: two and two are compared with one of double length")


def _loads(torque: Any, dtype) -> tuple[Operation, Float[Array, " torques"] | None]:
    """Operations with a leading axis (torques,), and the shares of a spectrum; None for a single load."""
    if not isinstance(torque, LoadSpectrum):
        single = operation_of("wear", torque, dtype)
        return jax.tree.map(lambda number: number[None], single), None
    load = jax.tree.map(lambda number: number.astype(dtype), torque)
    friction = None if load.friction is None else jnp.broadcast_to(load.friction, load.torques.shape)

    def each(torque, speed, friction):
        return Operation(torque, speed, friction)

    return jax.vmap(each)(load.torques, load.speeds, friction), load.weights


@kernel
def _wear(
    mesh: Mesh, loads: Operation, weights, revolutions, law, pinion, wheel, deviation, blocks: int, points: int
) -> WearLife:
    sizes, dtype = mesh.resolution, mesh.slice_width.dtype
    places = jax.vmap(lambda load: deposit(mesh, load.torque, points))(loads)
    roll_length, face = places.roll_length[0], mesh.face_coordinate
    shares = jnp.ones((1,), dtype) if weights is None else weights
    passages = jnp.stack([jnp.ones((), dtype), mesh.pair.pinion.teeth / mesh.pair.wheel.teeth])

    def cycle_on(depth, load: Operation) -> MeshCycle:
        tabled = tables(roll_length, face, depth)
        now = {"pinion": pinion + tabled[0], "wheel": wheel + tabled[1]}
        return solve_removed(mesh, load, removed_material(mesh, load, **now) + deviation, **now)

    def rate(depth):
        def under(load: Operation, place: Deposit):
            cycle = cycle_on(depth, load)
            return worn(cycle.line_load, law(cycle), place), {name: getattr(cycle, name) for name in _FOUND}

        found, seen = jax.vmap(under)(loads, places)
        return jnp.tensordot(shares, found, 1) * passages[:, None, None, None], seen

    def rebuilt(depth, load: Operation, found) -> MeshCycle:
        first, second = tables(roll_length, face, depth)
        return MeshCycle(
            kinematics=mesh.kinematics,
            margins=mesh.margins,
            operation=load,
            pinion=pinion + first,
            wheel=wheel + second,
            **found,
        )

    start = jnp.zeros((2, len(PARTS), sizes.slices, points), dtype)
    length = jnp.full((blocks // BLOCKS_OF_A_PAIR,), 1.0 / blocks, dtype) * revolutions
    found = march(rate, start, length)
    cycles = jax.vmap(lambda depth, seen: jax.vmap(lambda load, of: rebuilt(depth, load, of))(loads, seen))(
        found.depth, found.seen
    )
    if weights is None:
        cycles = jax.tree.map(lambda leaf: leaf[:, 0], cycles)
    done = jnp.arange(blocks + 1, dtype=dtype) / blocks * revolutions
    return WearLife(
        revolutions=done,
        roll_length=roll_length,
        arc=places.arc[0],
        face_coordinate=face,
        slice_width=mesh.slice_width,
        depth=found.depth,
        error=_total_error(found.error),
        cycles=cycles,
        weights=weights,
    )


def _total_error(error: Float[Array, "pairs gears parts slices points"]) -> Lives:
    """Largest error of the depth so far [um]: at the start, and after both blocks of every pair."""
    error = jnp.sum(error, axis=2)
    before = jnp.cumsum(error, axis=0) - error
    lives = jnp.stack([before, before + error / 2], axis=1).reshape(-1, *error.shape[1:])
    lives = jnp.concatenate([lives, jnp.sum(error, axis=0)[None]])
    return maximum(jnp.abs(lives), axis=(1, 2, 3))
