"""Demands of a modification on the grinding machine: amounts, monotony and volume of the material removed.

All functions take a prepared mesh, or the `Kinematics` of a mesh or a cycle, and the modifications of both gears (None
for the nominal involute). They evaluate the active profile, from its start to the tip, and the common face width. They
need no solution of the contact, are differentiable and compiled, and support `vmap`.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import Kinematics, Mesh, Side
from ..geometry import diameter, roll_angle
from ..microgeometry import AbstractModification, NoModification
from ..numerics import gauss_legendre, maximum, program

Scalar = Float[Array, ""]
Profile = Float[Array, " points"]

_PROFILE_POINTS = 257  # of a search for extremes
_SHOWN_POINTS, _SHOWN_LINES = 201, 11  # of a flank as charts and tables have it; odd, as above
_FACE_POINTS = 33  # odd: the middle of the face is one of them
# of the volume: nodes are dense enough that kinks, as at the start of a relief, cost less than 1e-3 of it
_PROFILE_CELLS, _FACE_CELLS, _NODES = 64, 16, 4


class FlankSurface(NamedTuple):
    """One gear's active flank, from the start of its active profile to the tip and across its own face width.

    Attributes:
        roll_length: roll lengths [mm], shape (points,).
        roll_angle: roll angles [deg], shape (points,).
        diameter: diameters [mm], shape (points,).
        face_coordinate: face coordinates from the middle of the face [mm], shape (lines,).
        removed: material that the modification removes [um], shape (lines, points).
    """

    roll_length: Profile
    roll_angle: Profile
    diameter: Profile
    face_coordinate: Float[Array, " lines"]
    removed: Float[Array, "lines points"]


@program
def flank_surface(side: Side, modification: AbstractModification) -> FlankSurface:
    """Active flank of one gear with its modification, for charts, tables and findings."""
    roll = _roll_lengths(side, _SHOWN_POINTS)
    face = jnp.linspace(-0.5, 0.5, _SHOWN_LINES, dtype=roll.dtype) * side.face_width
    removed = removed_at(side, modification, roll, face)
    return FlankSurface(roll, roll_angle(side.gear, roll), diameter(side.gear, roll), face, removed)


@program
def profile_relief(
    mesh: Mesh | Kinematics,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    *,
    points: int = 101,
) -> tuple[Profile, Profile]:
    """Material removed in the middle of the face, over the active profile.

    Args:
        mesh: prepared mesh, or its kinematics.
        pinion: modification of the pinion flank.
        wheel: modification of the wheel flank.
        points: number of points, evenly spaced in roll length from the start of the active profile to the tip.

    Returns:
        material removed from pinion and wheel [um], each of shape (points,).
    """
    on_pinion, on_wheel = (
        removed_at(side, modification, _roll_lengths(side, points))
        for side, modification in _flanks(mesh, pinion, wheel)
    )
    return on_pinion, on_wheel


@program
def max_relief(
    mesh: Mesh | Kinematics,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> Scalar:
    """Largest material removed anywhere on either flank [um]."""
    face = jnp.linspace(-0.5, 0.5, _FACE_POINTS, dtype=_dtype(mesh))
    removed = [
        removed_at(side, flank, _roll_lengths(side, _PROFILE_POINTS), face * side.face_width)
        for side, flank in _flanks(mesh, pinion, wheel)
    ]
    return maximum(jnp.stack(removed))


@program
def relief_reversal(
    mesh: Mesh | Kinematics,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> Scalar:
    """Sum of the decreases of the material removed from the pitch point towards tip and root [um].

    The value is that of the worse gear in the middle of the face: zero for a monotone relief, the depth of the dip for
    a relief with a dip. A profile slope decreases in one of the directions.
    """
    worst = [_decrease(side, modification) for side, modification in _flanks(mesh, pinion, wheel)]
    return maximum(jnp.stack(worst))


@program
def removed_volume(
    mesh: Mesh | Kinematics,
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> Scalar:
    """Material ground off all teeth of both gears, both flanks of every tooth alike [mm^3].

    V = sum over the gears of 2 z int int max(h, 0) rho / r_b d rho dy, with the arc length rho / r_b d rho of an
    involute of roll length rho. Where h is negative there is material to add, which does not count.
    """
    on_pinion, on_wheel = (gear_volume(side, modification) for side, modification in _flanks(mesh, pinion, wheel))
    return on_pinion + on_wheel


@program
def gear_volume(side: Side, modification: AbstractModification) -> Scalar:
    """Material ground off all teeth of one gear, both flanks of every tooth alike [mm^3]; see `removed_volume`."""
    dtype = side.start_roll_length.dtype
    along, profile_weight = _gauss(_PROFILE_CELLS, dtype)
    across, face_weight = _gauss(_FACE_CELLS, dtype)
    length = side.tip_roll_length - side.start_roll_length
    rho = side.start_roll_length + along * length
    removed = removed_at(side, modification, rho, (across - 0.5) * side.face_width)
    # >= and not maximum: at an amount of zero the slope is that of the material which is about to be removed
    removed = jnp.where(removed >= 0, removed, 0.0)
    per_flank = face_weight @ removed @ (profile_weight * rho) * side.face_width * length / side.base_radius
    return 1e-3 * 2 * side.gear.teeth * per_flank


@program
def removed_at(
    side: Side,
    modification: AbstractModification,
    roll_length: Profile,
    face_coordinate: Float[Array, "..."] | None = None,
) -> Float[Array, "*lines points"]:
    """Material removed by the modification of one gear at given points [um].

    Args:
        side: side of the gear in the contact, from `mesh.sides`.
        modification: modification of the gear.
        roll_length: roll lengths [mm], shape (points,).
        face_coordinate: face coordinates of the lines along the profile, from the middle of the face of the gear [mm],
            shape (lines,); None for one line in the middle.

    Returns:
        material removed [um], shape (lines, points), or (points,) without a face coordinate.
    """
    face = jnp.zeros((1,), roll_length.dtype) if face_coordinate is None else face_coordinate
    removed = modification(side.flank(roll_length[None], face[:, None]))
    removed = jnp.broadcast_to(removed, (face.shape[0], roll_length.shape[0]))
    return removed[0] if face_coordinate is None else removed


def _flanks(mesh: Mesh | Kinematics, pinion: AbstractModification | None, wheel: AbstractModification | None):
    """Every gear's side and modification."""
    return zip(mesh.sides, (pinion or NoModification(), wheel or NoModification()))


def _roll_lengths(side: Side, points: int) -> Profile:
    """Evenly spaced over the active profile."""
    return jnp.linspace(side.start_roll_length, side.tip_roll_length, points)


def _decrease(side: Side, modification: AbstractModification) -> Scalar:
    total, tip = jnp.zeros_like(side.tip_roll_length), side.tip_roll_length
    # profile shift can move the pitch point off the active profile: there is only one way then
    pitch = jnp.clip(side.pitch_roll_length, side.start_roll_length, tip)
    for end in (tip, side.start_roll_length):
        step = jnp.diff(removed_at(side, modification, jnp.linspace(pitch, end, _PROFILE_POINTS)))
        total = total + jnp.sum(jnp.where(step < 0, -step, 0.0))
    return total


def _gauss(cells: int, dtype) -> tuple[Profile, Profile]:
    """Nodes and weights on [0, 1], Gauss-Legendre in each of the cells."""
    nodes, weights = gauss_legendre(_NODES)
    places = (np.arange(cells)[:, None] + nodes[None]).reshape(-1) / cells
    return jnp.asarray(places, dtype), jnp.asarray(np.tile(weights, cells) / cells, dtype)


def _dtype(mesh: Mesh | Kinematics):
    return mesh.path_of_contact.start.dtype
