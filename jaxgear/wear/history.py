"""Wear history: wear depths of both flanks and mesh cycles after every block of revolutions."""

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
    """Wear of a pair of flanks at time steps: at the start of every block and after the last block.

    Attributes:
        revolutions: revolutions of the pinion, shape (steps,).
        roll_length: roll lengths of the grid points of pinion and wheel [mm], shape (gears, points).
        arc: arc length of the flank that belongs to every grid point [mm], shape (gears, points).
        face_coordinate: face coordinates of the slices, from the middle of the face of each gear [mm], shape (gears,
            slices).
        slice_width: width of every slice [mm], shape (slices,).
        depth: wear depth of pinion and wheel by contact of the flanks and by tip corners [um], shape (steps, gears,
            parts, slices, points).
        error: estimated error of the wear depth due to the length of the blocks, largest of all points [um], shape
            (steps,); NaN where the comparison with a block of double length has not converged.
        pressure_error: estimated error of the largest flank pressure due to the grid and to the width over which
            contacts average the worn flanks [MPa], shape (steps,), (steps, torques) under a load spectrum; zero on new
            flanks, NaN on flanks that have not converged. It is not part of `error`, which covers the blocks only.
        status: worst status up to every time step, shape (steps,): of all contacts that have worn the flanks, also
            within blocks, of the motion, of the wear coefficient, and of the remaining tooth thickness.
        cycles: mesh cycles on the flanks, leading axis (steps,); (steps, torques) under a load spectrum. A cycle is not
            converged if the wear of its flanks is not.
        weights: shares of the torques of a load spectrum in the revolutions, shape (torques,); None under one torque.
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
        """Total wear depth of the pinion [um], shape (steps, slices, points)."""
        return jnp.sum(self.depth[..., 0, :, :, :], axis=-3)

    @property
    def wheel_depth(self) -> Depths:
        """Total wear depth of the wheel [um], shape (steps, slices, points)."""
        return jnp.sum(self.depth[..., 1, :, :, :], axis=-3)

    @property
    def gears(self) -> tuple[Gear, Gear]:
        """Pinion and wheel of the worn pair."""
        pair = self.cycles.kinematics.pair
        first = (0,) * self.cycles.batch_ndim  # the gears are the same at all time steps
        pinion, wheel = jax.tree.map(lambda leaf: leaf[first], (pair.pinion, pair.wheel))
        return pinion, wheel

    def flanks(self, step: int = -1) -> tuple[AbstractModification, AbstractModification]:
        """Wear depth of pinion and wheel as modifications: `TabulatedProfile`, or `TabulatedFlank` over slices.

        They add to the modifications of the new flanks. Linear interpolation of the tables keeps the worn volume.

        Args:
            step: index of the time step; the last one by default.

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
    """Wear of both flanks in blocks of revolutions; every block solves the contact and updates the flanks.

    All teeth of a gear wear alike. The result is differentiable with respect to every number and supports `jax.vmap`;
    all blocks then are one program. `largest_increment`, `keep` and `callback` need concrete numbers; with them one
    compiled program computes two blocks per call.

    Wear levels the load. A block should therefore wear off less than the tooth deflection under load: above twice the
    deflection the flanks overshoot from block to block. The field `error` of the result shows this; under smooth loads
    it falls with the square of the number of blocks.

    Args:
        mesh: prepared mesh.
        torque: torque on the pinion [N m], an `OperatingPoint`, or a `LoadSpectrum`. The weights of a spectrum are
            shares of the revolutions; the weights of a spectrum with a duration (`LoadSpectrum.from_hours`) are shares
            of the hours and are multiplied by the speeds.
        revolutions: total revolutions of the pinion.
        coefficient: wear coefficient [m2/N] of both gears, or a pair of numbers (pinion, wheel); from 1e-18 for good
            films to 5e-16 for mild wear in mixed lubrication. Or a function of pressure [MPa], sliding speed [m/s] and
            flash temperature [K] at every contact, arrays of shape (pairs, slices, positions), which returns an array
            of this shape or a pair of them; it is traced, its values count at loaded contacts, and it needs the speed
            of an `OperatingPoint`. Wear by NaN or a negative coefficient is out of validity. Parameters of the function
            that are to be differentiated may be fields of an `equinox.Module`.
        pinion, wheel: modifications of the new flanks; None for nominal involutes.
        deviation: material removed by manufacturing deviations [um], in addition to the modifications, shape (pairs,
            slices, positions); None for nominal gears.
        blocks: even number of blocks of equal length; every two blocks are compared with one of double length.
        points: number of grid points on each flank, evenly spaced from the start of the active profile to the tip;
            None for one and a half times the positions, from 33 to 97. A spacing below the contact width shows no
            further detail, and collects at the tip the wear of the part of the contact that lies beyond the tip.
        dynamics: masses and damping of the vibration; its speeds are not used, the motion is computed at the speed of
            the `OperatingPoint`, or of every load of a spectrum. None for no vibration.
        line_load: "dynamic" for wear under the elastic mesh force of the steady motion from rest, computed anew in
            every contact analysis. The contact at every mesh position carries the force of the motion there, and the
            wear is the mean over the mesh cycles of the orbit, as if every tooth took part in each of them. The result
            has not converged where the motion does not settle on an orbit of up to four mesh cycles, or where coast
            flanks touch, whose wear is not modelled. "static" for wear under the static load, with dynamic factors as
            a result only. None for "dynamic" with dynamics, "static" without.
        largest_increment: limit of the wear depth per block [um], used instead of `blocks` and exceeded by a tenth at
            most. It should be below the tooth deflection under load.
        keep: function called for every two blocks with all inputs of the two blocks and the function that computes
            them; it returns the two blocks, computed now or stored before. None to compute all blocks.
        callback: called as callback(revolutions so far, total revolutions, None) after every two blocks.

    Returns:
        wear depths and mesh cycles at the start of every block and after the last one.

    Raises:
        TypeError: for something else than a prepared mesh or a modification.
        ValueError: for numbers out of their range, an odd number of blocks, a coefficient that is a function without a
            speed, a load spectrum with hours but without speeds, a torque that differs from the torque of the gearbox
            that supports the gears, dynamics without a speed, a dynamic load without dynamics, and for all errors of
            `solve` and `mesh_force`.
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
    """Raise a one-line `ValueError` if the number of blocks is not even or is below 2."""
    if whole("blocks", blocks, low=2) % BLOCKS_OF_A_PAIR:
        raise ValueError(f"blocks = {blocks} must be even: two and two are compared with one of double length")


@program
def history_of(case: Case, found: March, revolutions: Steps) -> WearHistory:
    """Wear history from a computed march; `revolutions` of the pinion at the time steps, shape (steps,)."""
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


# Share of the revolutions over which the wear rate of new flanks is determined: far shorter than a block.
_TRIAL = 1e-9
# A block whose wear exceeds the increment by the first factor is repeated; the next block grows by the second at most.
_SLACK, _GROWTH = 1.1, 2.0


def _by_pairs(case: Case, total: float, blocks: int, limit: float | None, keep, callback) -> WearHistory:
    """Compute `wear` by pairs of blocks, of equal length or as long as the limit of the wear depth allows."""
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
            # the remaining revolutions are split into pairs of equal length, without a short last pair
            rest = total - done - BLOCKS_OF_A_PAIR * now
            length = rest / (BLOCKS_OF_A_PAIR * max(1, np.ceil(rest / (BLOCKS_OF_A_PAIR * length) - 1e-9)))
            if lost:  # later flanks do not converge either, however short the blocks
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
    """Revolutions of the first block, from the wear rate of the new flanks."""
    most = _most(two(case.start(), _TRIAL * total)) / _TRIAL
    return total / (BLOCKS_OF_A_PAIR * max(1.0, np.ceil(most / (BLOCKS_OF_A_PAIR * limit))))


def _most(pair: March) -> float:
    """Largest wear depth of a single block of the pair [um]; 0 if it is not finite."""
    most = float(np.diff(np.asarray(pair.depth).sum(axis=2), axis=0).max())
    return most if np.isfinite(most) else 0.0


@quick_jit
def _together(pairs: list[March]) -> March:
    """Join consecutive marches: each one starts with the last flank of the previous one."""

    def joined(*leaves):
        return jnp.concatenate([*(leaf[:-1] for leaf in leaves), leaves[-1][-1:]])

    depth, seen = jax.tree.map(joined, *[(pair.depth, pair.seen) for pair in pairs])
    # the first flank of a march takes the status of the last flank of the previous march
    status = jnp.concatenate([pairs[0].status[:1], *(pair.status[1:] for pair in pairs)])
    error = jnp.concatenate([pair.error for pair in pairs])
    return March(depth, error, jax.lax.cummax(status), seen)
