"""What a modification asks of the grinding machine: amounts, monotony and volume of the material removed.

All functions take a prepared mesh and the modifications of both gears (None for the nominal involute). They look at the
active profile, from its start to the tip, and across the common face width. They need no solution of the contact, are
differentiable, compiled, and work under `vmap`.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import Mesh
from ..geometry import Gear
from ..microgeometry import AbstractModification, Flank, NoModification
from ..numerics import gauss_legendre, maximum

Scalar = Float[Array, ""]
Profile = Float[Array, " points"]

_PROFILE_POINTS = 257  # of a search for extremes
_FACE_POINTS = 33  # odd: the middle of the face is one of them
# of the volume: nodes are dense enough that kinks, as at the start of a relief, cost less than 1e-3 of it
_PROFILE_CELLS, _FACE_CELLS, _NODES = 64, 16, 4


class _Side(NamedTuple):
    """One gear's flank; roll lengths of the start of its active profile and of the pitch point [mm]."""

    modification: AbstractModification
    gear: Gear
    start: Scalar
    pitch: Scalar


@eqx.filter_jit
def profile_relief(
    mesh: Mesh,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    *,
    points: int = 101,
) -> tuple[Profile, Profile]:
    """Material removed in the middle of the face, over the active profile.

    Args:
        mesh: prepared mesh.
        pinion: modification of the pinion flank.
        wheel: modification of the wheel flank.
        points: number of points, evenly spaced in roll length from the start of the active profile to the tip.

    Returns:
        material removed from pinion and wheel [um], each of shape (points,).
    """
    on_pinion, on_wheel = (
        _profile(mesh, side, jnp.linspace(side.start, side.gear.tip_roll_length, points))
        for side in _sides(mesh, pinion, wheel)
    )
    return on_pinion, on_wheel


@eqx.filter_jit
def max_relief(
    mesh: Mesh, pinion: AbstractModification | None = None, wheel: AbstractModification | None = None
) -> Scalar:
    """Largest material removed anywhere on either flank [um]."""
    face = jnp.linspace(-0.5, 0.5, _FACE_POINTS, dtype=mesh.phase.dtype) * mesh.pair.face_width
    removed = jnp.stack(
        [
            _removed(mesh, side, jnp.linspace(side.start, side.gear.tip_roll_length, _PROFILE_POINTS), face)
            for side in _sides(mesh, pinion, wheel)
        ]
    )
    return maximum(removed)


@eqx.filter_jit
def relief_reversal(
    mesh: Mesh, pinion: AbstractModification | None = None, wheel: AbstractModification | None = None
) -> Scalar:
    """By how much the material removed fails to grow steadily from the pitch point towards tip and root [um].

    The sum of all its decreases along both ways, in the middle of the face, of the worse gear. It is zero for any
    relief that only grows, and the depth of the dip for one that dips. A profile slope decreases on one of the ways.
    """
    worst = [_decrease(mesh, side) for side in _sides(mesh, pinion, wheel)]
    return maximum(jnp.stack(worst))


@eqx.filter_jit
def removed_volume(
    mesh: Mesh, pinion: AbstractModification | None = None, wheel: AbstractModification | None = None
) -> Scalar:
    """Material ground off all teeth of both gears, both flanks of every tooth alike [mm^3].

    V = sum over the gears of 2 z int int max(h, 0) rho / r_b d rho dy, with the arc length rho / r_b d rho of an
    involute of roll length rho. Where h is negative there is material to add, which does not count.
    """
    total = jnp.zeros((), mesh.phase.dtype)
    along, profile_weight = _gauss(_PROFILE_CELLS, mesh)
    across, face_weight = _gauss(_FACE_CELLS, mesh)
    width = mesh.pair.face_width
    for side in _sides(mesh, pinion, wheel):
        length = side.gear.tip_roll_length - side.start
        rho = side.start + along * length
        removed = _removed(mesh, side, rho, (across - 0.5) * width)
        # >= and not maximum: at an amount of zero the slope is that of the material which is about to be removed
        removed = jnp.where(removed >= 0, removed, 0.0)
        per_flank = face_weight @ removed @ (profile_weight * rho) * width * length / side.gear.base_radius
        total = total + 1e-3 * 2 * side.gear.teeth * per_flank
    return total


@eqx.filter_jit
def removed_at(
    mesh: Mesh, modification: AbstractModification, roll_length: Profile, face_coordinate=None, *, of_pinion: bool
) -> Float[Array, "*lines points"]:
    """Material that a modification of one gear removes at given places [um].

    Args:
        mesh: prepared mesh.
        modification: of the pinion or the wheel.
        roll_length: shape (points,) [mm].
        face_coordinate: lines along the profile, from the middle of the face, shape (lines,) [mm]; None for one line in
            the middle.
        of_pinion: whether it is the pinion's.

    Returns:
        shape (lines, points), or (points,) without a face coordinate.
    """
    side = _sides(mesh, modification, modification)[0 if of_pinion else 1]
    if face_coordinate is None:
        return _profile(mesh, side, roll_length)
    return _removed(mesh, side, roll_length, face_coordinate)


def _sides(mesh: Mesh, pinion: AbstractModification | None, wheel: AbstractModification | None) -> tuple[_Side, _Side]:
    contact, pair = mesh.path_of_contact, mesh.pair
    nominal = NoModification()
    return (
        _Side(
            nominal if pinion is None else pinion,
            pair.pinion,
            contact.pinion_roll_length(contact.start),
            contact.pinion_pitch_roll_length,
        ),
        _Side(
            nominal if wheel is None else wheel,
            pair.wheel,
            contact.wheel_roll_length(contact.end),
            contact.wheel_pitch_roll_length,
        ),
    )


def _removed(mesh: Mesh, side: _Side, rho: Profile, face: Float[Array, " lines"]) -> Float[Array, "lines points"]:
    """Material removed at roll lengths and face coordinates [um]."""
    flank = Flank(
        roll_length=rho[None],
        tip_roll_length=side.gear.tip_roll_length,
        start_roll_length=side.start,
        base_radius=side.gear.base_radius,
        face_coordinate=face[:, None],
        face_width=mesh.pair.face_width,
    )
    return jnp.broadcast_to(side.modification(flank), (face.shape[0], rho.shape[0]))


def _profile(mesh: Mesh, side: _Side, rho: Profile) -> Profile:
    return _removed(mesh, side, rho, jnp.zeros((1,), mesh.phase.dtype))[0]


def _decrease(mesh: Mesh, side: _Side) -> Scalar:
    total = jnp.zeros((), mesh.phase.dtype)
    tip = side.gear.tip_roll_length
    # profile shift can move the pitch point off the active profile: there is only one way then
    pitch = jnp.clip(side.pitch, side.start, tip)
    for end in (tip, side.start):
        step = jnp.diff(_profile(mesh, side, jnp.linspace(pitch, end, _PROFILE_POINTS)))
        total = total + jnp.sum(jnp.where(step < 0, -step, 0.0))
    return total


def _gauss(cells: int, mesh: Mesh) -> tuple[Profile, Profile]:
    """Nodes and weights on [0, 1], Gauss-Legendre in each of the cells."""
    nodes, weights = gauss_legendre(_NODES)
    places = (np.arange(cells)[:, None] + nodes[None]).reshape(-1) / cells
    dtype = mesh.phase.dtype
    return jnp.asarray(places, dtype), jnp.asarray(np.tile(weights, cells) / cells, dtype)
