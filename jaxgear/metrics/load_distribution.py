"""Load distribution: load sharing of pairs, loaded part of the path of contact, and face load factors.

References:
    ISO 6336-1, clause 7: K_Hbeta is the largest over the mean load per face width, K_Fbeta follows from it and the
    height of the teeth over their width.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import Checked, maximum, minimum, over_batch, program, result, safe_divide
from ..shafts import face_load_factor as factor_of
from ..shafts import tooth_height
from ..shafts.face_load import root_exponent

Scalar = Float[Array, ""]


class ContactShock(Checked):
    """Contact beyond the theoretical path of contact.

    Attributes:
        approach: loaded path length before the start of the path of contact, where the tip corner of the wheel touches
            [mm]; for helical gears the longest of all slices.
        recess: loaded path length after the end of the path of contact, where the tip corner of the pinion touches
            [mm]; for helical gears the longest of all slices.
        force: largest force on a pair beyond the theoretical path of contact [N].
    """

    approach: Scalar = result("mm")
    recess: Scalar = result("mm")
    force: Scalar = result("N")


@over_batch
def load_sharing(cycle: MeshCycle) -> Float[Array, "pairs positions"]:
    """Share of every pair in the total force, shape (pairs, positions); the sum is 1, or 0 at zero torque."""
    return _shares(replace(cycle, pinion=None, wheel=None))


@program
def _shares(cycle: MeshCycle):
    return safe_divide(cycle.pair_force, cycle.force)


@over_batch
def effective_contact_ratio(cycle: MeshCycle) -> Scalar:
    """Loaded length of the path of contact in base pitches, the mean number of loaded pairs.

    A pair is loaded if any of its slices is loaded. The ends of contact are interpolated linearly between positions, so
    that the value is a continuous function of the design. A value above the theoretical contact ratio indicates corner
    contact.
    """
    return jnp.sum(jnp.mean(_loaded_fraction(minimum(cycle.opening, axis=1)), axis=-1))


@over_batch
def contact_shock(cycle: MeshCycle) -> ContactShock:
    """Loaded path length beyond the ends of the path of contact, and the largest corner force."""
    kinematics = cycle.kinematics
    contact, path = kinematics.path_of_contact, kinematics.path
    fraction = _loaded_fraction(cycle.opening if kinematics.helical else minimum(cycle.opening, axis=1)[:, None])
    step = contact.base_pitch / kinematics.resolution.positions
    # Every step [path, path + step] counts with its loaded length minus the part of it that lies on the theoretical
    # path: contact is unbroken, so a step across an end of the path is loaded on the inside first.
    before = jnp.clip(contact.start - path, 0.0, step)
    after = jnp.clip(path + step - contact.end, 0.0, step)
    before, after = (jnp.maximum(fraction * step - (step - part), 0.0) for part in (before, after))
    approach, recess = (maximum(jnp.sum(part, axis=(0, 2))) for part in (before, after))
    return ContactShock(approach, recess, maximum(corner_force(cycle)))


def corner_force(cycle: MeshCycle) -> Float[Array, "pairs positions"]:
    """Force of every pair beyond the path of contact [N]."""
    return jnp.sum(jnp.where(cycle.kinematics.outside > 0, slice_forces(cycle), 0.0), axis=1)


def slice_forces(cycle: MeshCycle) -> Float[Array, "pairs slices positions"]:
    """Force of every slice [N], shape (pairs, slices, positions): `pair_force` in proportion to the line loads."""
    load = cycle.line_load * cycle.kinematics.slice_width[None, :, None]
    return load * safe_divide(cycle.pair_force, jnp.sum(load, axis=1))[:, None]


@partial(jax.jit, inline=True)
def _loaded_fraction(opening: Float[Array, "pairs *slices positions"]) -> Float[Array, "pairs *slices positions"]:
    """Loaded part of every step from one position to the next, per pair."""
    depth = -opening
    # after the last position every pair takes the place of its predecessor
    first, last = depth[..., :1], depth[..., -1:]
    arriving = jnp.concatenate([first[:1] * 0 - jnp.abs(last[:1]), first[:-1]])
    following = jnp.concatenate([depth[..., 1:], arriving], axis=-1)
    rising = following > depth
    low, high = jnp.where(rising, depth, following), jnp.where(rising, following, depth)
    crossing = (high > 0) & (low <= 0)
    partial = high / jnp.where(crossing, high - low, 1.0)
    return jnp.where(crossing, partial, (low > 0).astype(depth.dtype))


Curve = Float[Array, " positions"]


class _Face(NamedTuple):
    """Line load over the face.

    Attributes:
        line_load: line load [N/mm], shape (..., slices).
        width: width of every slice [mm], shape (slices,).
    """

    line_load: Float[Array, "... slices"]
    width: Float[Array, " slices"]

    @property
    def factor(self) -> Float[Array, "..."]:
        """Largest over mean line load."""
        return factor_of(self.line_load, self.width)


@over_batch
def face_load_factors(cycle: MeshCycle) -> Curve:
    """Largest over mean line load over the face at every position, shape (positions,).

    It refers to the pair with the largest line load; for helical gears to the sum of all pairs.

    Raises:
        ValueError: for a cycle of one slice.
    """
    return _at_positions(cycle).factor


@over_batch
def face_load_factor(cycle: MeshCycle) -> Scalar:
    """Face load factor K_Hbeta: largest over mean line load, for the pair and the position of the largest line load.

    For helical gears it is `mean_face_load_factor`: their contact lines also run across the profile, so that a tip
    relief makes a single line uneven, which is not a load concentration over the face. For lead modifications of 10 to
    20 um on a face width of 6 modules both definitions differ by 3 % at most as the helix angle tends to zero.

    The derivative is that of a fixed pair and position.

    Raises:
        ValueError: for a cycle of one slice.
    """
    return _worst(cycle).factor


@over_batch
def mean_face_load_factor(cycle: MeshCycle) -> Scalar:
    """Largest over mean load over the face, for the sum of all pairs and the mean over the cycle.

    This is K_Hbeta of a model with one constant stiffness over the face (ISO 6336-1, Annex E).

    Raises:
        ValueError: for a cycle of one slice.
    """
    _check_slices(cycle)
    return _over_cycle(cycle).factor


@over_batch
def root_face_load_factor(cycle: MeshCycle) -> Scalar:
    """K_Fbeta = K_Hbeta^N_F of ISO 6336-1, Method B, from `face_load_factor` and the height of the teeth.

    Raises:
        ValueError: for a cycle of one slice.
    """
    pair = cycle.kinematics.pair
    factor = _worst(cycle).factor
    return jnp.maximum(factor, 1.0) ** root_exponent(pair.face_width, tooth_height(pair))


@over_batch
def edge_load_factor(cycle: MeshCycle) -> Scalar:
    """Larger line load of both end slices over the mean over the face, for the load of `face_load_factor`.

    It is 0 if both ends are unloaded. At a free end without relief it grows slowly with the number of slices.

    Raises:
        ValueError: for a cycle of one slice.
    """
    face = _worst(cycle)
    mean = jnp.sum(face.line_load * face.width) / jnp.sum(face.width)
    idle = mean <= 0
    ends = jnp.maximum(face.line_load[0], face.line_load[-1])
    return jnp.where(idle, 1.0, ends / jnp.where(idle, 1.0, mean))


def over_several_slices(factor: Callable[[MeshCycle], Scalar], cycle: MeshCycle) -> Scalar | float:
    """Factor of this module for a cycle of several slices; 1 for one slice."""
    return factor(cycle) if cycle.kinematics.resolution.slices > 1 else 1.0


def _at_positions(cycle: MeshCycle) -> _Face:
    """Load over the face of the pair with the largest line load, of helical gears of all; shape (positions, slices)."""
    _check_slices(cycle)
    of, load = cycle.kinematics, jnp.moveaxis(cycle.line_load, 2, 0)  # positions, pairs, slices
    if of.helical:
        return _Face(jnp.sum(load, axis=1), of.slice_width)
    most = jnp.argmax(jnp.max(load, axis=2), axis=1)[:, None, None]
    return _Face(jnp.take_along_axis(load, most, axis=1)[:, 0], of.slice_width)


def _check_slices(cycle: MeshCycle) -> None:
    if cycle.kinematics.resolution.slices == 1:
        raise ValueError("a mesh of 1 slice has no load over the face: prepare with Resolution(slices=11)")


def _worst(cycle: MeshCycle) -> _Face:
    """`_at_positions` where the line load is largest; of helical gears the mean over the cycle; shape (slices,)."""
    if cycle.kinematics.helical:
        _check_slices(cycle)
        return _over_cycle(cycle)
    found = _at_positions(cycle)
    worst = jnp.argmax(jnp.max(found.line_load, axis=1))
    return found._replace(line_load=found.line_load[worst])


def _over_cycle(cycle: MeshCycle) -> _Face:
    """Load over the face of all pairs together, mean over the cycle; shape (slices,)."""
    return _Face(jnp.mean(jnp.sum(cycle.line_load, axis=0), axis=1), cycle.kinematics.slice_width)
