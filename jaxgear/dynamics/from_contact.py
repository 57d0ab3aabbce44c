"""Mesh forces of a prepared mesh: the force map of its contact, and simpler models."""

from collections.abc import Callable
from typing import Any, Literal, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import Mesh
from ..contact.mesh import resized
from ..contact.operating_point import Torque, operating_point_of
from ..contact.solve import check_alike, more_pairs_help
from ..contact.status import Status, status_of
from ..microgeometry import AbstractModification
from ..numerics import Given, check, concrete, program, real, whole
from ..numerics.programs import is_eager
from .force import AbstractMeshForce
from .force_map import Both, FlankSprings, ForceMap, Static, Tangent, coast_flanks, drive_flanks, static, tabulate

Scalar = Float[Array, ""]
Model = Literal["map", "varying stiffness", "loaded error", "tangent"]

# Flanks that press on both sides without a load by more than this jam [um]; rounding of single precision is less.
_JAMMED = 1e-2
_LEVELS, _REACH = 48, 5.0


def mesh_force(
    mesh: Mesh,
    torque: Torque,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    coast: Both | None = None,
    model: Model = "map",
    positions: int = 640,
    levels: int = _LEVELS,
    reach: Given = _REACH,
    compliance: Given = 0.0,
    deviation: Given | None = None,
) -> AbstractMeshForce:
    """Force of a mesh as a function of mesh position and DTE, for oscillators.

    The DTE includes the deflection of the teeth, the wind-up of the gear bodies (`mesh.hub`) and `compliance` in
    series.

    Args:
        mesh: prepared mesh, of any number of positions.
        torque: positive torque on the pinion [N m]. For the map it sets the contact width over which modifications are
            averaged and, with `reach`, the largest DTE of the table; the simpler models are made for it.
        pinion: modification of the drive flanks of the pinion; None for the nominal involute.
        wheel: modification of the drive flanks of the wheel; None for the nominal involute.
        coast: modifications of the coast flanks (pinion, wheel), each None for the nominal involute; None for the
            modifications of the drive flanks.
        model: "map" for `ForceMap`, the contact at every DTE; "varying stiffness" and "loaded error" for
            `FlankSprings`; "tangent" for `Tangent`. All give the static transmission error of the torque.
        positions: number of mesh positions of the force, which is linear between them. They limit the accuracy of the
            map: with 64 positions the DTE at which a pair comes into contact changes by several um between neighbours;
            half a percent needs 512. For an integrator, positions beyond its number of steps have no effect.
        levels: number of DTE levels of the map on either side of the clearance, closer together near first contact.
        reach: largest deflection of the map, relative to the largest static deflection of the drive flanks; the map is
            linear beyond.
        compliance: compliance of shafts, bearings and bodies in series with the mesh [um/N].
        deviation: material removed from the drive flanks by manufacturing deviations [um], in addition to the
            modifications, shape (pairs, slices, positions) of the mesh; linear between its positions. None for nominal
            gears.

    Returns:
        the mesh force, differentiable with respect to every number. If the number of pairs of the mesh was chosen
        automatically and is too small for the deflections of the map, more pairs are used, unless traced.

    Raises:
        TypeError: if the arguments are not a prepared mesh or modifications.
        ValueError: for a number outside its range, flanks that jam, or a modification that varies along the face on a
            mesh of one slice.
    """
    return force_and_mesh(
        mesh, torque, model=model, positions=positions, levels=levels, reach=reach, compliance=compliance,
        pinion=pinion, wheel=wheel, coast=coast, deviation=deviation,
    )[0]  # fmt: skip


def force_and_mesh(
    mesh: Mesh,
    torque: Torque,
    *,
    model: Model,
    positions: int,
    compliance: Given,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    coast: Both | None = None,
    deviation: Given | None = None,
    levels: int = _LEVELS,
    reach: Given = _REACH,
) -> tuple[AbstractMeshForce, Mesh]:
    """Mesh force as from `mesh_force`, and the mesh of its contact analyses."""
    check_alike(mesh)
    torque = operating_point_of(torque, mesh.slice_width.dtype).torque
    check("torque", torque, "N m", low=0.0, open_low=True)
    series = _number("compliance", compliance, "um/N", mesh, low=0.0)
    farthest = _number("reach", reach, "", mesh, low=1.0)
    if model not in get_args(Model):
        wanted = ", ".join(f'"{name}"' for name in get_args(Model))
        raise ValueError(f"model = {model!r} must be one of {wanted}")
    whole("levels", levels, 4, 4096)
    whole("positions", positions, 4, 65536)
    given, mesh = mesh, resized(mesh, positions=positions)
    both = (pinion, wheel), _coast_of(coast, (pinion, wheel))
    off = _besides(deviation, given, mesh)
    made = _made(mesh, torque, both, off, model, levels, farthest, series)
    while more_pairs_help(mesh, made.status):
        mesh = resized(mesh, pairs=mesh.resolution.chosen_pairs + 1)
        made = _made(mesh, torque, both, _besides(deviation, given, mesh), model, levels, farthest, series)
    return made, mesh


def interpolated(deviation: Given, of: Mesh, mesh: Mesh) -> Float[Array, "pairs slices positions"]:
    """Material removed by deviations [um], interpolated to the positions of another mesh of the same gears."""
    wanted = of.resolution.chosen_pairs, of.resolution.slices, of.resolution.positions
    if jnp.shape(deviation) != wanted:
        raise ValueError(f"deviation has shape {jnp.shape(deviation)}, must be {wanted} (pairs, slices, positions)")

    def rows(field):  # of every slice: one pair follows the other on the path of contact, the last one first
        return jnp.moveaxis(field[::-1], 1, 0).reshape(field.shape[1], -1)

    wide = of.resolution.slices
    there, here = (
        jnp.broadcast_to(path, (wide, path.shape[-1])) for path in (rows(each.kinematics.path) for each in (of, mesh))
    )
    found = jax.vmap(jnp.interp)(here, there, rows(jnp.asarray(deviation)))
    return jnp.moveaxis(found.reshape(wide, -1, mesh.resolution.positions), 0, 1)[::-1]


def _besides(deviation: Given | None, of: Mesh, mesh: Mesh) -> Array | None:
    """Deviations `interpolated` to a mesh; None without deviations."""
    return None if deviation is None else interpolated(deviation, of, mesh)


def _number(name: str, value: Any, unit: str, mesh: Mesh, **limits) -> Scalar:
    value = real(value)
    if value.ndim:
        raise ValueError(f"{name} has shape {value.shape}, must be a single number; make many with jax.vmap")
    check(name, value, unit, **limits)
    return value.astype(mesh.slice_width.dtype)


def _coast_of(coast: Any, drive: Both) -> Both:
    if coast is None:
        return drive
    if not isinstance(coast, tuple) or len(coast) != 2:
        raise TypeError(f"coast is {coast!r}, must be a tuple (pinion, wheel) of modifications, or None")
    return coast


def _made(mesh, torque, both, deviation, model, levels, reach, compliance) -> ForceMap | FlankSprings | Tangent:
    drive = drive_flanks(mesh, torque, both[0])
    drive = drive if deviation is None else drive._replace(removed=drive.removed + deviation)
    sides = drive, coast_flanks(mesh, torque, both[1])
    found = _of_both(lambda side: static(side, torque, compliance), sides)
    force, first = 1e3 * torque / mesh.pair.pinion.base_radius, mesh.kinematics.first_phase
    if model == "tangent":
        return Tangent(first, force, found[0].loaded, found[0].stiffness, jnp.max(found[0].status))
    start, deflection, farthest, least, status = _touching(found, [side.clearance for side in sides], reach)
    _check_clearance(least)
    if model == "varying stiffness":
        return FlankSprings(first, start, force / deflection, status)
    if model == "loaded error":
        mean = jnp.mean(deflection, axis=1)
        return FlankSprings(first, start + deflection - mean[:, None], force / mean, status)
    touching = (sides[0], found[0].unloaded), (sides[1], found[1].unloaded)
    tables = _of_both(lambda of: tabulate(of[0], of[1], compliance, farthest, levels), touching)
    return _map_of(first, start, farthest, tables, status)


@program
def _touching(found: list[Static], clearances: list[Any], reach: Scalar) -> tuple[Array, Array, Scalar, Scalar, Any]:
    """DTE at first contact of both flanks, deflection under the torque, its largest value times `reach`, clearance,
    status."""
    start = jnp.stack([each.unloaded + clearance for each, clearance in zip(found, clearances)])
    deflection = jnp.stack([each.loaded - each.unloaded for each in found])
    least = jnp.min(start[0] + start[1])
    statuses = [jnp.max(each.status) for each in found]
    status = status_of({Status.GEARS_CANNOT_RUN: least < -_JAMMED}, *statuses)
    return start, deflection, reach * jnp.max(deflection[0]), least, status


@program
def _map_of(first_phase: Any, start: Array, reach: Scalar, tables: list[Any], status: Any) -> ForceMap:
    (drive, coast) = tables
    return ForceMap(
        first_phase=first_phase,
        start=start,
        reach=reach,
        node_force=jnp.stack([drive[0], coast[0]]),
        node_stiffness=jnp.stack([drive[1], coast[1]]),
        status=status_of({}, status, drive[2], coast[2]),
    )


def _of_both(function: Callable[[Any], Any], sides: tuple[Any, Any]) -> list[Any]:
    """Apply a function to each side; within another program by a loop, so that it is compiled once."""
    (drive, like), (coast, other) = (eqx.partition(side, eqx.is_array) for side in sides)
    trees: list[Any] = [jax.tree.structure(arrays) for arrays in (drive, coast)]
    if is_eager() or trees[0] != trees[1] or not eqx.tree_equal(like, other):
        return [function(side) for side in sides]
    stacked = jax.tree.map(lambda *parts: jnp.stack(parts), drive, coast)
    found = jax.lax.map(lambda arrays: function(eqx.combine(arrays, like)), stacked)
    return [jax.tree.map(lambda part: part[number], found) for number in range(len(sides))]  # noqa: B023 - at once


def _check_clearance(least: Scalar) -> None:
    """Raise for concrete flanks that jam: contact on both sides without a load."""
    known = concrete(least)
    if known is not None and known < -_JAMMED:
        raise ValueError(
            f"the clearance between drive and coast flanks = {float(known):.4g} um must be at least 0 um: "
            "the modifications add material, and the pair has too little backlash"
        )
