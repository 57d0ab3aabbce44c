"""The modified tooth space in the transverse plane, which the profile of a form-grinding wheel fills.

Frame: origin in the gear centre, y along the centreline of the space outwards, x to the side of the flank. The normal
of the involute at a roll length L touches the base circle at T = r_b (sin phi, cos phi) with phi = theta + atan(L/r_b),
where theta is half the angle of the space there; the flank point lies on it at P = T + (L - h) n, n = (-cos phi,
sin phi), with the material h that the modification removes. That is exact: the modification is measured on the normal.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import Side
from ..geometry import outline
from ..geometry.involute import load_angle
from ..metrics import removed_at
from ..microgeometry import AbstractModification
from ..numerics import program, whole

Profile = Float[Array, " points"]

_POINTS = 201  # of a profile, where nobody asks for others


class SpaceFlank(NamedTuple):
    """One flank of a tooth space, in the middle of the face.

    Attributes:
        roll_length: of the unmodified flank [mm], shape (points,).
        x: from the centreline of the space [mm].
        y: from the gear centre along the centreline [mm].
        inclination: of the unmodified flank to the centreline, positive where the space widens outwards [rad].
        removed: material that the modification removes, along the normal [um].
    """

    roll_length: Profile
    x: Profile
    y: Profile
    inclination: Profile
    removed: Profile


def space_flank(
    side: Side, modification: AbstractModification, roll_length: Profile | None = None, *, points: int = _POINTS
) -> SpaceFlank:
    """The flank of a tooth space of one gear: the involute minus the modification.

    Args:
        side: the gear's side of the contact, of `mesh.sides`.
        modification: of this flank; the other one is its mirror image where both are alike.
        roll_length: where [mm], shape (points,); None for evenly spaced points from the form circle to the tip.
        points: their number.

    Raises:
        ValueError: for less than 2 points.
    """
    return _space_flank(side, modification, roll_length, whole("space_flank", "points", points, 2))


@program
def _space_flank(side: Side, modification, roll_length: Profile | None, points: int) -> SpaceFlank:
    if roll_length is None:
        roll_length = jnp.linspace(outline(side.gear).form_roll_length, side.tip_roll_length, points)
    removed = removed_at(side, modification, roll_length)
    x, y, inclination = space_point(side, roll_length, removed)
    return SpaceFlank(roll_length, x, y, inclination, removed)


def space_point(
    side: Side, roll_length: Float[Array, "..."], removed: Float[Array, "..."]
) -> tuple[Float[Array, "..."], ...]:
    """x, y [mm] and inclination [rad] of points of the flank with so much material removed [um]."""
    gear = side.gear
    base = jnp.broadcast_to(gear.base_radius, roll_length.shape)
    angle = jnp.pi / gear.teeth + load_angle(gear, roll_length)
    left = roll_length - 1e-3 * removed
    x = base * jnp.sin(angle) - left * jnp.cos(angle)
    return x, base * jnp.cos(angle) + left * jnp.sin(angle), angle
