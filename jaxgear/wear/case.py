"""Inputs of a wear analysis: mesh, loads, wear coefficients, flanks; and the contact on worn flanks."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..conditions import LoadSpectrum, cycle_status, solved
from ..conditions.cases import Loads
from ..contact import Mesh, MeshCycle, OperatingPoint, RemovedMaterial, removed_material, solve_removed
from ..contact.cycle import FLATTEST, flank_pressure
from ..contact.face_coupling import check_torque
from ..contact.operating_point import operating_point_of
from ..contact.prescribed import solve_forces
from ..contact.slide import slid_material
from ..contact.solve import check_alike, flanks_of
from ..contact.status import Status, Statuses, status_of
from ..dynamics import Dynamics
from ..dynamics.steady import SteadyForce
from ..geometry import GearPair
from ..geometry.involute import half_tooth_angle
from ..metrics.lubrication import flash_temperature
from ..microgeometry import AbstractModification, Flank, TabulatedFlank, TabulatedProfile
from ..numerics import Numbers, check, kernel, program, real, result, whole
from .march import Depth, March, WearRate, march
from .vibration import Flanks, LineLoad, Vibration, vibration_of
from .worn_volume import PARTS, Deposit, deposit, grid, worn


class WornFlank(AbstractModification):
    """Wear depth on an evenly spaced grid along the profile, for every slice of a mesh; linear between grid points.

    The depth is constant beyond the ends of the grid. At the slices of the mesh the values are those of
    `TabulatedProfile` and `TabulatedFlank`. These classes search for the grid interval of every contact, which takes
    far longer than the contact itself; an even grid gives the interval by a division.

    Attributes:
        roll_length: roll lengths of the grid points [mm], shape (points,).
        amount: wear depth [um], shape (slices, points).
    """

    roll_length: Float[Array, " points"] = result("mm")
    amount: Float[Array, "slices points"] = result("um")

    @property
    def varies_along_face(self) -> bool:
        return len(self.amount) > 1

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        cells = self.amount.shape[-1] - 1
        first, last = self.roll_length[0], self.roll_length[-1]
        place = jnp.clip((flank.roll_length - first) * (cells / (last - first)), 0.0, cells)
        left = jnp.minimum(jax.lax.stop_gradient(place).astype(jnp.int32), cells - 1)
        line = jnp.arange(len(self.amount), dtype=jnp.int32)[None, :, None]
        low, high = self.amount[line, left], self.amount[line, left + 1]
        return low + (place - left.astype(place.dtype)) * (high - low)


def _every_other(depth: Float[Array, "*shape points"]) -> Float[Array, "*shape points"]:
    """Depth interpolated linearly from every other point of an even grid; the last point keeps its value."""
    between = 0.5 * (depth[..., :-2:2] + depth[..., 2::2])
    return depth.at[..., 1:-1:2].set(between)


def worn_through(
    pair: GearPair, roll_length: Float[Array, "gears points"], depth: Float[Array, "gears parts slices points"]
) -> Bool[Array, ""]:
    """True if a tooth of either gear is worn through at some radius.

    A uniform depth on an involute turns the involute about the gear axis by depth / base radius. The tooth is worn
    through where this angle reaches the angle of the tooth.
    """
    left = [
        2e3 * half_tooth_angle(gear, lengths) * gear.base_radius - jnp.max(jnp.sum(worn, axis=0), axis=0)
        for gear, lengths, worn in zip((pair.pinion, pair.wheel), roll_length, depth)
    ]
    return jnp.any(jnp.stack(left) <= 0)


Field = Float[Array, "#gears #pairs #slices #positions"]
_GEARS = 2

# one of both gears, or a pair; or a function of the state of lubrication at every contact
Coefficient = Numbers | Callable[..., Any]

# Lubricated steel has 1e-18 to 5e-16 m2/N, see `wear`; two hundred times the upper end is no such gear any more, and a
# larger number most often one in mm2/N, which is 1e6 times as large.
LARGEST_COEFFICIENT = 1e-13


class Constant(eqx.Module):
    """Constant wear coefficient of each gear [m2/N], shape (gears, 1, 1, 1)."""

    value: Field

    def __call__(self, cycle: MeshCycle) -> Field:
        return self.value


class OfLubrication(eqx.Module):
    """Wear coefficient as a function of pressure [MPa], sliding speed [m/s] and flash temperature [K] of a contact."""

    of: Callable[..., Any]

    def __call__(self, cycle: MeshCycle) -> Field:
        kinematics, speed = cycle.kinematics, cycle.operating_point.speed
        assert speed is not None  # `_wear_law` has asked for it
        friction = {} if cycle.operating_point.friction is None else {"friction": cycle.operating_point.friction}
        contact = kinematics.path_of_contact
        sliding = contact.sliding_speed(jnp.clip(kinematics.path, contact.start, contact.end), speed)
        pressure = cycle.contact_pressure + cycle.corner_pressure
        shape = cycle.line_load.shape
        given = (
            pressure,
            jnp.broadcast_to(jnp.abs(sliding), shape),
            flash_temperature(cycle, speed, **friction),
        )
        # without load nothing wears, and the slope of a power of no pressure may be infinite
        loaded = cycle.line_load > 0
        found = self.of(*(jnp.where(loaded, field, 1.0) for field in given))
        both = found if isinstance(found, tuple | list) else (found, found)
        if len(both) != _GEARS:
            raise ValueError(f"coefficient gives {len(both)} values, must give one or a pair: pinion, wheel")
        fields = [jnp.asarray(field, pressure.dtype) for field in both]
        for field in fields:
            if jnp.broadcast_shapes(field.shape, shape) != shape:
                raise ValueError(f"coefficient gives an array of shape {field.shape}, must be {shape}")
        return jnp.where(loaded, jnp.stack([jnp.broadcast_to(field, shape) for field in fields]), 0.0)


def _wear_law(coefficient: Coefficient, loads: OperatingPoint, dtype: np.dtype) -> Constant | OfLubrication:
    """Wear coefficient of both gears as a function of a cycle [m2/N], for (gears, pairs, slices, positions).

    Raises:
        ValueError: for negative coefficients, more than two, and a function where the loads have no speed.
    """
    if callable(coefficient):
        if loads.speed is None:
            raise ValueError("coefficient is a function, which needs a speed: give OperatingPoint(torque, speed)")
        return OfLubrication(coefficient)
    values = real(coefficient).astype(dtype)
    if values.shape not in ((), (_GEARS,)):
        raise ValueError(f"coefficient has shape {values.shape}, must be one number or a pair: pinion, wheel")
    check("coefficient", values, "m2/N", low=0.0, high=LARGEST_COEFFICIENT)
    return Constant(jnp.broadcast_to(values, (_GEARS,))[:, None, None, None])


# what a cycle holds that differs from flank to flank
_FOUND = (
    "transmission_error",
    "unloaded_transmission_error",
    "line_load",
    "pair_force",
    "opening",
    "gap",
    "shift",
    "relative_curvature",
    "tangent_stiffness",
    "residual",
    "status",
)


_DYNAMIC_FACTOR = "dynamic_factor"

# Of the grid on each flank: three to two positions, as finer grids would show the step from position to position; from
# the fewest that the depth takes (17 hide 2.3 % at the root of the driver) to as many as the width of usual contacts
# shows. Few blunt the ridge that wear leaves at the pitch point: against 193 points and contacts as wide as their own
# loads make them, the flank pressure is 3 % low with 33, 1.4 % with 65 and 0.3 % with 97 (30/30 pair of module 2,
# 150 N m, 2 um of wear, 64 positions; 19/48 pair of module 3: 1.2, 0.1 and 0.5 %).
FEWEST_POINTS, MOST_POINTS = 33, 97


def points_for(positions: int) -> int:
    """Default number of grid points on each flank."""
    return min(max(3 * positions // 2 + 1, FEWEST_POINTS), MOST_POINTS)


class Case(eqx.Module):
    """Inputs of a wear analysis.

    Attributes:
        mesh: prepared mesh.
        loads: operating points, with a leading axis (torques,).
        weights: shares of the revolutions, shape (torques,); None under one torque.
        law: wear coefficient of both gears at the contacts of a mesh cycle [m2/N].
        pinion, wheel: modifications of the new flanks.
        deviation: material removed by manufacturing deviations [um], in addition to the modifications.
        points: number of grid points along the profile of each flank.
        vibration: the vibrating system; None without dynamics.
    """

    mesh: Mesh
    loads: OperatingPoint
    weights: Float[Array, " torques"] | None
    law: Constant | OfLubrication
    pinion: AbstractModification
    wheel: AbstractModification
    deviation: Float[Array, "*shape"]
    points: int = eqx.field(static=True)
    vibration: Vibration | None = None

    def start(self) -> Depth:
        """Zero wear depth [um], shape (gears, parts, slices, points)."""
        gears, slices = len(self.mesh.sides), self.mesh.resolution.slices
        return jnp.zeros((gears, len(PARTS), slices, self.points), self.mesh.slice_width.dtype)

    @property
    def face_coordinate(self) -> Float[Array, "gears slices"]:
        """Face coordinate of the middle of every slice [mm], from the middle of the face of each gear."""
        return jnp.stack([self.mesh.face_coordinate + side.face_middle for side in self.mesh.sides])

    def places(self) -> Deposit:
        """Mapping from the contacts to the grids on the flanks for every load, leading axis (torques,)."""
        return jax.vmap(lambda load: deposit(self.mesh, load.torque, self.points))(self.loads)

    def under(self, load: OperatingPoint, place: Deposit, depth: Depth) -> WearRate:
        """Contact of the worn flanks under one load, and the wear depth of one passage of a tooth pair [um]."""
        flanks = self._worn(place.roll_length, depth)
        removed = removed_material(self.mesh, load, **flanks) + self.deviation
        cycle = solve_removed(self.mesh, load, removed, **flanks)
        found = {name: getattr(cycle, name) for name in _FOUND}
        rate, status = self._rate(cycle, place)
        if self.vibration is not None:
            motion = self.vibration.force(flanks, load, self.mesh.phase)
            found[_DYNAMIC_FACTOR] = jnp.where(motion.status == Status.CONVERGED, motion.dynamic_factor, jnp.nan)
            if self.vibration.wears:
                rate, status = self._dynamic_rate(cycle, motion, removed, place)
        return WearRate(rate, found, jnp.maximum(status, cycle_status(cycle)))

    def _worn(self, roll_length, depth: Depth) -> Flanks:
        """Modifications of both flanks including wear, as `WornFlank` on the slices of the mesh."""
        total = jnp.sum(depth, axis=1)
        pinion, wheel = (WornFlank(lengths, amount) for lengths, amount in zip(roll_length, total))
        return {"pinion": self.pinion + pinion, "wheel": self.wheel + wheel}

    def _rate(self, cycle: MeshCycle, place: Deposit) -> tuple[Depth, Statuses]:
        """Wear depth of one passage [um], and the status of the coefficient: out of validity below 0 or NaN."""
        coefficient = self.law(cycle)
        # a function may return any value: NaN and negative coefficients are out of validity
        valid = jnp.all(coefficient >= 0)
        return worn(cycle.line_load, cycle.shift, coefficient, place), status_of({Status.OUT_OF_VALIDITY: ~valid})

    def _dynamic_rate(
        self, cycle: MeshCycle, motion: SteadyForce, removed: RemovedMaterial, place: Deposit
    ) -> tuple[Depth, Statuses]:
        """`_rate` under the mesh force of a motion, mean over its mesh cycles: each tooth takes part in all."""

        def of_cycle(force):
            contact = solve_forces(self.mesh, jnp.maximum(force, 0.0), removed)
            rate, status = self._rate(replace(cycle, line_load=contact.line_load), place)
            return rate, jnp.maximum(status, jnp.max(contact.status))

        rates, statuses = jax.lax.map(of_cycle, motion.force)
        status = status_of({Status.OUT_OF_VALIDITY: motion.back_side_contact}, jnp.max(statuses), motion.status)
        return jnp.mean(rates, axis=0), status

    def flanks(self, roll_length: Float[Array, "gears points"], depth: Depth) -> dict[str, AbstractModification]:
        """Modifications of both flanks including wear, as tables for any mesh."""
        pinion, wheel = tables(roll_length, self.face_coordinate, depth)
        return {"pinion": self.pinion + pinion, "wheel": self.wheel + wheel}

    def cycles(self, roll_length: Float[Array, "gears points"], marched: March) -> MeshCycle:
        """Mesh cycles at all time steps, leading axis (steps,); (steps, torques) under a load spectrum."""

        def under(flanks, load: OperatingPoint, found) -> MeshCycle:
            return MeshCycle(
                kinematics=self.mesh.kinematics, margins=self.mesh.margins, operating_point=load, **flanks, **found
            )

        def on(depth, found, status) -> MeshCycle:
            found = {name: found[name] for name in _FOUND}
            # a contact that has not converged makes all later flanks invalid
            found = found | {"status": jnp.maximum(found["status"], status)}
            flanks = self.flanks(roll_length, depth)
            return jax.vmap(lambda load, of: under(flanks, load, of))(self.loads, found)

        cycles = jax.vmap(on)(marched.depth, marched.seen, marched.status)
        return jax.tree.map(lambda leaf: leaf[:, 0], cycles) if self.weights is None else cycles

    def pressure_errors(
        self, roll_length: Float[Array, "gears points"], marched: March, cycles: MeshCycle
    ) -> Float[Array, "steps *torques"]:
        """Estimated error of the largest flank pressure at all time steps [MPa], axes as those of `cycles`.

        The estimate is the change of the pressure with the worn flanks on every other grid point, and with contact
        widths by the load and curvature of each contact instead of the loads of unmodified flanks.
        """

        def largest(depth, cycle: MeshCycle, load: OperatingPoint, line_load):
            flanks = self._worn(roll_length, depth)
            removed = slid_material(self.mesh, load.torque, flanks["pinion"], flanks["wheel"], line_load)
            return jnp.max(flank_pressure(cycle.kinematics, cycle.line_load, removed.relative_curvature))

        def under(depth, load: OperatingPoint, cycle: MeshCycle):
            own = cycle.line_load / jnp.maximum(1 + cycle.relative_curvature, FLATTEST)
            given = cycle.line_load if self.mesh.compliance.averages_over_loaded_width else None
            here = largest(depth, cycle, load, given)
            coarse, narrow = largest(_every_other(depth), cycle, load, given), largest(depth, cycle, load, own)
            return jnp.abs(coarse - here) + jnp.abs(narrow - here)

        def on(state):
            depth, cycle = state
            if self.weights is None:
                return under(depth, jax.tree.map(lambda number: number[0], self.loads), cycle)
            return jax.vmap(partial(under, depth))(self.loads, cycle)

        return jnp.where(solved(cycles), jax.lax.map(on, (marched.depth, cycles)), jnp.nan)

    def dynamic_factor(self, marched: March) -> Float[Array, "steps *torques"] | None:
        """Dynamic factor at all time steps, axes as those of `cycles`; None without dynamics."""
        if self.vibration is None:
            return None
        found = jnp.where(marched.status[:, None] == Status.CONVERGED, marched.seen[_DYNAMIC_FACTOR], jnp.nan)
        return found[:, 0] if self.weights is None else found


def tables(
    roll_length: Float[Array, "gears points"], face_coordinate: Float[Array, "gears slices"], depth: Depth
) -> tuple[AbstractModification, AbstractModification]:
    """Modifications of pinion and wheel from a wear depth [um], shape (gears, parts, slices, points)."""
    total = jnp.sum(depth, axis=1)

    def of(gear: int) -> AbstractModification:
        if depth.shape[-2] == 1:
            return TabulatedProfile(roll_length[gear], total[gear, 0])
        return TabulatedFlank(roll_length[gear], face_coordinate[gear], total[gear].T)

    return of(0), of(1)


def marched(case: Case, start: Depth, revolutions: Float[Array, " pairs"]) -> March:
    """Wear depth of a case after every block, see `march`."""
    return (_marched if case.vibration is None else _marched_quickly)(case, start, revolutions)


def _march(case: Case, start: Depth, revolutions: Float[Array, " pairs"]) -> March:
    places, mesh = case.places(), case.mesh
    shares = jnp.ones((1,), start.dtype) if case.weights is None else case.weights
    passages = jnp.stack([jnp.ones((), start.dtype), mesh.pair.pinion.teeth / mesh.pair.wheel.teeth])

    def through(depth) -> Statuses:
        return status_of({Status.GEARS_CANNOT_RUN: worn_through(mesh.pair, grid(mesh, case.points), depth)})

    def analyze(depth) -> WearRate:
        rates, seen, statuses = over_loads(lambda load, place: case.under(load, place, depth))
        rate = jnp.tensordot(shares, rates, 1) * passages[:, None, None, None]
        return WearRate(rate, seen, jnp.maximum(jnp.max(statuses), through(depth)))

    def over_loads(under):
        if case.vibration is None:
            return jax.vmap(under)(case.loads, places)
        # in sequence: in a batch, orbits of one mesh cycle would be computed over as many cycles as the longest orbit
        return jax.lax.map(lambda each: under(*each), (case.loads, places))

    found = march(analyze, start, revolutions)
    gone = jax.lax.cummax(jax.vmap(through)(found.depth))
    return found._replace(status=jnp.maximum(found.status, gone))


# of a motion it is twice as many programs in one, which compile for a hundred times as long as they run
_marched, _marched_quickly = kernel(_march), program(_march)


def case_of(
    mesh: Mesh,
    torque: Loads,
    *,
    coefficient: Coefficient,
    pinion: AbstractModification | None,
    wheel: AbstractModification | None,
    deviation: Numbers | None,
    points: int | None,
    dynamics: Dynamics | None = None,
    line_load: LineLoad | None = None,
) -> Case:
    """Check the arguments of `wear` and collect them in a `Case`; raises the errors of `wear`."""
    check_alike(mesh)
    pinion, wheel = flanks_of(mesh, pinion, wheel)
    dtype = mesh.slice_width.dtype
    loads, weights = _loads(torque, dtype)
    check_torque(mesh.support_torque, loads.torque)
    law = _wear_law(coefficient, loads, dtype)
    points = points_for(mesh.resolution.positions) if points is None else whole("points", points, low=3)
    other = _deviation(mesh, deviation)
    flanks = {"pinion": pinion, "wheel": wheel}
    vibration = vibration_of(mesh, loads, dynamics, line_load, flanks, None if deviation is None else other)
    return Case(mesh, loads, weights, law, pinion, wheel, other, points, vibration)


def _deviation(mesh: Mesh, deviation: Numbers | None) -> Float[Array, "*shape"]:
    """Material removed by manufacturing deviations [um]; zero where there are none."""
    if deviation is None:
        return jnp.zeros((), mesh.slice_width.dtype)
    deviation = real(deviation).astype(mesh.slice_width.dtype)
    wanted = mesh.resolution.pairs, mesh.resolution.slices, mesh.resolution.positions
    if deviation.shape != wanted:
        shown = "(pairs, slices, positions)"
        raise ValueError(f"deviation has shape {deviation.shape}, must be {wanted} {shown}")
    check("deviation", deviation, "um")
    return deviation


def _loads(torque: Loads, dtype: np.dtype) -> tuple[OperatingPoint, Float[Array, " torques"] | None]:
    """Operating points with a leading axis (torques,), and the weights of a spectrum; None for a single load."""
    if not isinstance(torque, LoadSpectrum):
        single = operating_point_of(torque, dtype)
        return jax.tree.map(lambda number: number[None], single), None
    load = jax.tree.map(lambda number: number.astype(dtype), torque)
    friction = None if load.friction is None else jnp.broadcast_to(load.friction, load.torques.shape)

    def each(torque, speed, friction):
        return OperatingPoint(torque, speed, friction)

    turns = load.turns()
    if load.duration is not None:
        check("sum of hours times speeds", jnp.sum(turns), "", low=0.0, open_low=True)
        turns = turns / jnp.sum(turns)
    return jax.vmap(each)(load.torques, load.speeds, friction), turns
