"""Fields over the contacts of a mesh cycle as tables over one gear's flank: what wears it away, for one."""

from typing import Literal

import jax.numpy as jnp

from ..microgeometry import TabulatedFlank, TabulatedProfile
from ..numerics import Given
from .kinematics import Kinematics


def flank_table(
    kinematics: Kinematics,
    field: Given,
    gear: Literal["pinion", "wheel"],
    method: Literal["linear", "natural_cubic", "monotonic"] = "linear",
) -> TabulatedFlank | TabulatedProfile:
    """A field over the contacts as a table over roll length and face coordinate of one gear.

    While the gears turn on by a base pitch, every pair takes the place of its predecessor: each point of the active
    profile is touched by one pair at one position. Contacts outside the path of contact, where a tip corner touches,
    are left out; towards the ends of the profile the field of the last contact on the path goes on.

        depth = rate * cycle.line_load
        worn = wheel_relief + jg.contact.flank_table(cycle.kinematics, depth, "wheel")

    Args:
        kinematics: of the cycle or the mesh that the field belongs to.
        field: what the contacts remove [um], shape (pairs, slices, positions).
        gear: whose flank.
        method: interpolation along the profile.

    Returns:
        the modification with one row per contact and one column per slice, at its middle; of one slice a table over the
        profile alone. It is differentiable with respect to the field and to every number of the kinematics.

    Raises:
        ValueError: for a field of another shape, or no such gear.
    """
    sizes = kinematics.resolution
    wanted = (sizes.pairs, sizes.slices, sizes.positions)
    if jnp.shape(field) != wanted:
        raise ValueError(f"field has shape {jnp.shape(field)}, must be {wanted} (pairs, slices, positions)")
    if gear not in ("pinion", "wheel"):
        raise ValueError(f'gear = {gear!r} must be "pinion" or "wheel"')
    # the last pair is the first along the path; every roll length beyond the active profile only continues the table
    if kinematics.helical:
        raise ValueError("kinematics is of helical gears: flank_table is known of spur gears alone")
    path = kinematics.path[::-1].reshape(-1)
    inside = kinematics.outside[::-1].reshape(-1) <= 0
    amount = jnp.moveaxis(field, 1, 2)[::-1].reshape(-1, sizes.slices)
    count = len(path)
    first, last = jnp.argmax(inside), count - 1 - jnp.argmax(inside[::-1])
    amount = amount[jnp.clip(jnp.arange(count), first, last)]
    contact = kinematics.path_of_contact
    if gear == "pinion":
        roll_length = contact.pinion_roll_length(path)
    else:
        roll_length, amount = contact.wheel_roll_length(path)[::-1], amount[::-1]
    if sizes.slices == 1:
        return TabulatedProfile(roll_length, amount[:, 0], method=method)
    middle = kinematics.pair.face_middles[gear == "wheel"]
    return TabulatedFlank(roll_length, kinematics.face_coordinate + middle, amount, method)
