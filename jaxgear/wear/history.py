"""Wear history: both flanks after every block of revolutions, and the mesh on them."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int8

from ..conditions.cases import Loads
from ..contact import Mesh, MeshCycle
from ..contact.status import WithStatus
from ..dynamics import Dynamics
from ..geometry import Gear
from ..microgeometry import AbstractModification
from ..numerics import Callback, Checked, Given, Numbers, check, maximum, program, quick_jit, real, result, whole
from .case import Case, Coefficient, case_of, marched, tables
from .march import BLOCKS_OF_A_PAIR, Depth, March
from .vibration import LineLoad
from .worn_volume import arcs, grid

Scalar = Float[Array, ""]
Steps = Float[Array, " steps"]
Depths = Float[Array, "steps slices points"]

BLOCKS = 20

Keep = Callable[[Any, Callable[[], March]], March]


class WearHistory(WithStatus, Checked):
    """A pair of flanks at time steps: at the start of every block and after the last one.

    Attributes:
        revolutions: of the pinion, shape (steps,).
        roll_length: of the grid points of pinion and wheel [mm], shape (gears, points).
        arc: of the flank that belongs to every point [mm], shape (gears, points).
        face_coordinate: of the lines along the profile, from the middle of each gear's own face [mm], shape (gears,
            slices).
        slice_width: of the face that belongs to every line [mm], shape (slices,).
        depth: worn off pinion and wheel by contact of the flanks and by tip corners [um], shape (steps, gears, parts,
            slices, points).
        error: estimate of the error of that depth by the length of the blocks, largest of all points [um], shape
            (steps,); NaN where that of two blocks has not converged.
        pressure_error: estimate of the error of the largest flank pressure by the grid and by the width over which
            contacts average the worn flanks [MPa], shape (steps,), (steps, torques) under a load spectrum; zero on new
            flanks, NaN on flanks that have not converged. It is not part of `error`, which is that of the blocks alone.
        status: the worst so far, shape (steps,): of the contacts that have worn these flanks, also within blocks; of
            the motion, the coefficient of wear, and what is left of the teeth.
        cycles: the mesh on these flanks, leading axis (steps,); (steps, torques) under a load spectrum. None has
            converged on flanks that have not.
        weights: of the torques of a load spectrum in the revolutions, shape (torques,); None under one torque.
        dynamic_factor: largest mesh force of the steady motion over the static one, at the speed of the load (K_v),
            shape (steps,), (steps, torques) under a load spectrum; NaN where the motion does not settle on an orbit of
            up to four mesh cycles, and on flanks that have not converged. None without dynamics.
    """

    revolutions: Steps = result()
    roll_length: Float[Array, "gears points"] = result("mm")
    arc: Float[Array, "gears points"] = result("mm")
    face_coordinate: Float[Array, "gears slices"] = result("mm")
    slice_width: Float[Array, " slices"] = result("mm")
    depth: Float[Array, "steps gears parts slices points"] = result("um")
    error: Steps = result("um")
    pressure_error: Float[Array, "steps *torques"] = result("MPa")
    status: Int8[Array, " steps"] = result()
    cycles: MeshCycle
    weights: Float[Array, " torques"] | None = result()
    dynamic_factor: Float[Array, "steps *torques"] | None = result()

    @property
    def pinion_depth(self) -> Depths:
        """Worn off the pinion in all [um], shape (steps, slices, points)."""
        return jnp.sum(self.depth[..., 0, :, :, :], axis=-3)

    @property
    def wheel_depth(self) -> Depths:
        """Worn off the wheel in all [um], shape (steps, slices, points)."""
        return jnp.sum(self.depth[..., 1, :, :, :], axis=-3)

    @property
    def gears(self) -> tuple[Gear, Gear]:
        """Pinion and wheel."""
        pair = self.cycles.kinematics.pair
        first = (0,) * self.cycles.batch_ndim  # of all time steps the same
        pinion, wheel = jax.tree.map(lambda leaf: leaf[first], (pair.pinion, pair.wheel))
        return pinion, wheel

    def flanks(self, step: int = -1) -> tuple[AbstractModification, AbstractModification]:
        """Wear depth of pinion and wheel as modifications: `TabulatedProfile`, or `TabulatedFlank` over slices.

        They add to the modifications of the new flanks. Interpolated linearly, they hold the worn volume.

        Args:
            step: which of the time steps; the last one by default.

        Raises:
            IndexError: for a time step that does not exist.
        """
        count = len(self.depth)
        if not -count <= step < count:
            raise IndexError(f"WearHistory: step = {step} must be from {-count} to {count - 1}, of {count} time steps")
        return tables(self.roll_length, self.face_coordinate, self.depth[step])


def wear(
    mesh: Mesh,
    torque: Loads,
    revolutions: Given,
    *,
    coefficient: Coefficient,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    deviation: Numbers | None = None,
    blocks: int = BLOCKS,
    points: int | None = None,
    dynamics: Dynamics | None = None,
    line_load: LineLoad | None = None,
    largest_increment: Given | None = None,
    keep: Keep | None = None,
    callback: Callback | None = None,
) -> WearHistory:
    """Wear of both flanks, in blocks of revolutions: contact, wear, new flank, again.

    Every tooth of a gear wears alike. Differentiable with respect to every number in it, and for `jax.vmap`: all blocks
    are one program then. With `largest_increment`, `keep` or `callback`, which take concrete numbers, every two blocks
    are one call of a program, which serves any number of them.

    Wear levels the load, so that a block must not wear off more than the teeth deflect under their load: beyond
    twice that, flanks overshoot from block to block. `error` tells; on smooth loads it falls with the square of the
    number of blocks.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m], an `OperatingPoint`, or a `LoadSpectrum`. Its weights are shares of the
            revolutions; those of one with a duration, `LoadSpectrum.from_hours`, are shares of the hours and count
            times the speeds.
        revolutions: of the pinion, all together.
        coefficient: of wear [m2/N] of both gears, or a pair of numbers, (pinion, wheel); from 1e-18 for good films to
            5e-16 for mild wear of mixed lubrication. Or a function of the state of lubrication at every contact, of
            pressure [MPa], sliding speed [m/s] and flash temperature [K], arrays of shape (pairs, slices, positions),
            to such an array or a pair of them; traced, and asked where there is load. It needs the speed of an
            `OperatingPoint`. Flanks that NaN or a negative number have worn are out of validity. Where it depends on
            numbers of its own to differentiate by, they may be fields of an `equinox.Module`.
        pinion, wheel: modifications of the new flanks; None for nominal involutes.
        deviation: material that manufacturing deviations remove besides [um], shape (pairs, slices, positions);
            None for nominal gears.
        blocks: of equal length, even: two and two are compared with one of double length.
        points: of the grid on each flank, evenly spaced from the start of the active profile to the tip; None for
            one and a half times the positions, from 33 to 97. Points nearer to each other than the contact is wide show
            no more, and pile up at the tip what the contact there would wear beyond it.
        dynamics: what vibrates, its speeds aside: the motion is that at the speed of an `OperatingPoint`, or of every
            load of a spectrum. None for no vibration.
        line_load: "dynamic" for the flanks to wear under the elastic force of the steady motion that begins at rest,
            found anew in every contact analysis: the contact at every mesh position is that under the force of the
            motion there, and the wear is the mean of the mesh cycles of its orbit, as if every tooth took part in each
            of them. Flanks have not converged where the motion does not settle on an orbit of up to four mesh cycles,
            or where coast flanks touch, which do not wear here. "static" for dynamic factors alone. None for "dynamic"
            with dynamics, "static" without.
        largest_increment: depth that no block wears off beyond a tenth more [um], in place of `blocks`. It should stay
            below what the teeth deflect under their load.
        keep: called for every two blocks with all that they depend on and with what makes them; gives them, made now or
            before. None to make them all.
        callback: called as callback(revolutions so far, all of them, None) after every two blocks.

    Returns:
        flanks and mesh at the start of every block and after the last one.

    Raises:
        TypeError: for something else than a prepared mesh or a modification.
        ValueError: for numbers out of their range, an odd number of blocks, a coefficient that is a function where
            there is no speed, a load spectrum with hours without speeds, a torque that is not that of the gearbox which
            holds the gears, dynamics without a speed, a dynamic load without dynamics, and whatever `solve` and
            `mesh_force` refuse.
    """
    check_blocks(blocks)
    flanks: dict[str, Any] = {"pinion": pinion, "wheel": wheel, "deviation": deviation}
    vibrating: dict[str, Any] = {"dynamics": dynamics, "line_load": line_load}
    case = case_of(mesh, torque, coefficient=coefficient, points=points, **flanks, **vibrating)
    revolutions = real(revolutions).astype(mesh.slice_width.dtype)
    if revolutions.ndim:
        raise ValueError(f"revolutions has shape {revolutions.shape}, must be a single number")
    check("revolutions", revolutions, "", low=0.0, open_low=True)
    check("largest_increment", largest_increment, "um", low=0.0, open_low=True)
    if largest_increment is not None or keep is not None or callback is not None:
        limit = None if largest_increment is None else float(largest_increment)
        return _by_pairs(case, float(revolutions), blocks, limit, keep, callback)
    pairs = blocks // BLOCKS_OF_A_PAIR
    found = marched(case, case.start(), jnp.full((pairs,), 1.0 / blocks, revolutions.dtype) * revolutions)
    return history_of(case, found, jnp.arange(blocks + 1, dtype=revolutions.dtype) / blocks * revolutions)


def check_blocks(blocks: int) -> None:
    """Raises a one-line `ValueError` for something else than an even number of blocks."""
    if whole("blocks", blocks, low=2) % BLOCKS_OF_A_PAIR:
        raise ValueError(f"blocks = {blocks} must be even: two and two are compared with one of double length")


@program
def history_of(case: Case, found: March, revolutions: Steps) -> WearHistory:
    """The history of a march; `revolutions` at its time steps."""
    roll_length = grid(case.mesh, case.points)
    cycles = case.cycles(roll_length, found)
    return WearHistory(
        revolutions=revolutions,
        roll_length=roll_length,
        arc=jnp.stack([arcs(knots, side.base_radius) for knots, side in zip(roll_length, case.mesh.sides)]),
        face_coordinate=case.face_coordinate,
        slice_width=case.mesh.slice_width,
        depth=found.depth,
        error=_total_error(found.error),
        pressure_error=case.pressure_errors(roll_length, found, cycles),
        status=found.status,
        cycles=cycles,
        weights=case.weights,
        dynamic_factor=case.dynamic_factor(found),
    )


def _total_error(error: Float[Array, "pairs gears parts slices points"]) -> Steps:
    """Largest error of the depth so far [um]: at the start, and after both blocks of every pair."""
    error = jnp.sum(error, axis=2)
    after = jnp.cumsum(error, axis=0)
    before = jnp.concatenate([jnp.zeros_like(after[:1]), after[:-1]])
    steps = jnp.stack([before, before + error / 2], axis=1).reshape(-1, *error.shape[1:])
    steps = jnp.concatenate([steps, after[-1:]])
    return maximum(jnp.abs(steps), axis=(1, 2, 3))


# Share of the revolutions in which the first rate of wear is found: short beside any block.
_TRIAL = 1e-9
# A block that wears more than the increment by this factor is done again; the next one grows by the second at most.
_SLACK, _GROWTH = 1.1, 2.0


def _by_pairs(case: Case, total: float, blocks: int, limit: float | None, keep, callback) -> WearHistory:
    """`wear` pair by pair of blocks: of equal length, or as long as a limit of their wear allows."""
    taken = keep or (lambda _, make: make())

    def two(start: Depth, length: float) -> March:
        lengths = jnp.full((1,), length, start.dtype)
        return taken((case, start, lengths), lambda: jax.block_until_ready(marched(case, start, lengths)))

    done, depth, found, at = 0.0, case.start(), [], [0.0]
    length = total / blocks if limit is None else _first(two, case, total, limit)
    left, lost = blocks // BLOCKS_OF_A_PAIR, False
    while (left > 0) if limit is None else (done < total):
        now = length if limit is None else min(length, (total - done) / BLOCKS_OF_A_PAIR)
        pair = two(depth, now)
        if limit is not None:
            most = _most(pair)
            length = now * min(limit / most, _GROWTH) if most > 0 else _GROWTH * now
            if most > _SLACK * limit and not lost:
                continue
            lost = lost or bool(np.asarray(pair.status).any())
            # the rest is gone through in pairs of one length, not in a last short one
            rest = total - done - BLOCKS_OF_A_PAIR * now
            length = rest / (BLOCKS_OF_A_PAIR * max(1, np.ceil(rest / (BLOCKS_OF_A_PAIR * length) - 1e-9)))
            if lost:  # the flanks of the rest have not converged, however short the blocks
                length = rest / BLOCKS_OF_A_PAIR
        at += [done + now, done + BLOCKS_OF_A_PAIR * now]
        done, left = at[-1], left - 1
        if limit is not None and (total - done) < 1e-9 * total:
            done = at[-1] = total
        depth = pair.depth[-1]
        found.append(pair)
        if callback is not None:
            callback(int(done), int(total), None)
    return history_of(case, _together(found), jnp.asarray(at, depth.dtype))


def _first(two: Callable[[Depth, float], March], case: Case, total: float, limit: float) -> float:
    """Length of the first block by the wear of new flanks."""
    most = _most(two(case.start(), _TRIAL * total)) / _TRIAL
    return total / (BLOCKS_OF_A_PAIR * max(1.0, np.ceil(most / (BLOCKS_OF_A_PAIR * limit))))


def _most(pair: March) -> float:
    """Largest depth that one of two blocks wears off [um]."""
    most = float(np.diff(np.asarray(pair.depth).sum(axis=2), axis=0).max())
    return most if np.isfinite(most) else 0.0


@quick_jit
def _together(pairs: list[March]) -> March:
    """One march after the other: each begins with the flank with which the one before has ended."""

    def joined(*leaves):
        return jnp.concatenate([*(leaf[:-1] for leaf in leaves), leaves[-1][-1:]])

    depth, seen = jax.tree.map(joined, *[(pair.depth, pair.seen) for pair in pairs])
    # the flank with which a march begins has the status of that with which the one before has ended
    status = jnp.concatenate([pairs[0].status[:1], *(pair.status[1:] for pair in pairs)])
    error = jnp.concatenate([pair.error for pair in pairs])
    return March(depth, error, jax.lax.cummax(status), seen)
