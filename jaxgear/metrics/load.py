"""How the pairs share the load and over which part of the path they carry it."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import Checked, maximum, minimum, over_batch, program, result, safe_divide

Scalar = Float[Array, ""]


class ContactShock(Checked):
    """Contact beyond the theoretical path of contact.

    Attributes:
        approach: loaded path length before its start, where the wheel's tip corner touches.
        recess: loaded path length after its end, where the pinion's tip corner touches.
        force: largest force on a pair there.
    """

    approach: Scalar = result("mm")
    recess: Scalar = result("mm")
    force: Scalar = result("N")


@over_batch
def load_sharing(cycle: MeshCycle) -> Float[Array, "pairs positions"]:
    """Share of every pair in the total force; the shares of a position sum to 1, or are 0 at zero torque."""
    return _shares(replace(cycle, pinion=None, wheel=None))


@program
def _shares(cycle: MeshCycle):
    return safe_divide(cycle.pair_force, cycle.force)


@over_batch
def effective_contact_ratio(cycle: MeshCycle) -> Scalar:
    """Loaded length of the path of contact in base pitches, the mean number of loaded pairs.

    A pair counts as loaded where any of its slices is. Ends of contact are interpolated linearly between positions, so
    the value changes continuously with the design. Above the theoretical contact ratio the teeth meet with their
    corners.
    """
    return jnp.sum(jnp.mean(_loaded_fraction(cycle.opening), axis=-1))


@over_batch
def contact_shock(cycle: MeshCycle) -> ContactShock:
    """Loaded path beyond its theoretical ends and the largest corner force there."""
    kinematics, fraction = cycle.kinematics, _loaded_fraction(cycle.opening)
    contact, path = kinematics.path_of_contact, kinematics.path
    step = contact.base_pitch / kinematics.resolution.positions
    # Every step [path, path + step] counts with its loaded length minus the part of it that lies on the theoretical
    # path: contact is unbroken, so a step across an end of the path is loaded on the inside first.
    before = jnp.clip(contact.start - path, 0.0, step)
    after = jnp.clip(path + step - contact.end, 0.0, step)
    return ContactShock(
        jnp.sum(jnp.maximum(fraction * step - (step - before), 0.0)),
        jnp.sum(jnp.maximum(fraction * step - (step - after), 0.0)),
        maximum(corner_force(cycle)),
    )


def corner_force(cycle: MeshCycle) -> Float[Array, "pairs positions"]:
    """Force of every pair beyond the path of contact [N]."""
    return jnp.where(cycle.kinematics.outside > 0, cycle.pair_force, 0.0)


@partial(jax.jit, inline=True)
def _loaded_fraction(opening: Float[Array, "pairs slices positions"]) -> Float[Array, "pairs positions"]:
    """Loaded part of every step from one position to the next, per pair."""
    depth = -minimum(opening, axis=1)
    # after the last position every pair takes the place of its predecessor
    arriving = jnp.concatenate([depth[:1, :1] * 0 - jnp.abs(depth[:1, -1:]), depth[:-1, :1]])
    following = jnp.concatenate([depth[:, 1:], arriving], axis=1)
    rising = following > depth
    low, high = jnp.where(rising, depth, following), jnp.where(rising, following, depth)
    crossing = (high > 0) & (low <= 0)
    partial = high / jnp.where(crossing, high - low, 1.0)
    return jnp.where(crossing, partial, (low > 0).astype(depth.dtype))
