"""How pairs share the load, over which part of the path they carry it, and how uneven it is over the face.

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
from ..numerics import Checked, maximum, minimum, over_batch, over_slices, program, result, safe_divide
from ..shafts import face_load_factor as factor_of
from ..shafts import tooth_height
from ..shafts.face_load import root_exponent

Scalar = Float[Array, ""]


class ContactShock(Checked):
    """Contact beyond the theoretical path of contact.

    Attributes:
        approach: loaded path length before its start, where the wheel's tip corner touches; of helical gears in the
            slice where it is longest.
        recess: loaded path length after its end, where the pinion's tip corner touches, likewise.
        force: largest force on a pair beyond the theoretical path of contact [N].
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
    return jnp.sum(jnp.mean(_loaded_fraction(minimum(cycle.opening, axis=1)), axis=-1))


@over_batch
def contact_shock(cycle: MeshCycle) -> ContactShock:
    """Loaded path beyond its theoretical ends and the largest corner force there."""
    kinematics = cycle.kinematics
    contact, path = kinematics.path_of_contact, kinematics.contact_path
    fraction = _loaded_fraction(cycle.opening if kinematics.helical else minimum(cycle.opening, axis=1))
    step = contact.base_pitch / kinematics.resolution.positions
    # Every step [path, path + step] counts with its loaded length minus the part of it that lies on the theoretical
    # path: contact is unbroken, so a step across an end of the path is loaded on the inside first.
    before = jnp.clip(contact.start - path, 0.0, step)
    after = jnp.clip(path + step - contact.end, 0.0, step)
    before, after = (jnp.maximum(fraction * step - (step - part), 0.0) for part in (before, after))
    if kinematics.helical:  # over pairs and positions
        approach, recess = (maximum(jnp.sum(part, axis=(0, 2))) for part in (before, after))
    else:
        approach, recess = jnp.sum(before), jnp.sum(after)
    return ContactShock(approach, recess, maximum(corner_force(cycle)))


def corner_force(cycle: MeshCycle) -> Float[Array, "pairs positions"]:
    """Force of every pair beyond the path of contact [N]."""
    outside = cycle.kinematics.contact_outside > 0
    if cycle.kinematics.helical:
        return jnp.sum(jnp.where(outside, slice_forces(cycle), 0.0), axis=1)
    return jnp.where(outside, cycle.pair_force, 0.0)


def slice_forces(cycle: MeshCycle) -> Float[Array, "pairs slices positions"]:
    """Force of every slice [N]: `pair_force`, divided in proportion to the loads of the slices."""
    load = cycle.line_load * cycle.kinematics.slice_width[None, :, None]
    return load * over_slices(safe_divide(cycle.pair_force, jnp.sum(load, axis=1)))


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
    """Load over the face.

    Attributes:
        line_load: slices last [N/mm].
        width: of every slice [mm].
    """

    line_load: Float[Array, "... slices"]
    width: Float[Array, " slices"]

    @property
    def factor(self) -> Float[Array, "..."]:
        """Largest over mean line load."""
        return factor_of(self.line_load, self.width)


@over_batch
def face_load_factors(cycle: MeshCycle) -> Curve:
    """Largest over mean line load over the face at every position, of the pair with the largest line load there; of
    helical gears, of all pairs together.

    Raises:
        ValueError: for a cycle of one slice.
    """
    return _at_positions(cycle).factor


@over_batch
def face_load_factor(cycle: MeshCycle) -> Scalar:
    """K_Hbeta: largest over mean line load over the face, of the pair and at the position with the largest line load.

    Of helical gears it is `mean_face_load_factor`: their contact lines run across the profile too, so that a single
    line is uneven by a tip relief, which ratings must not count as a fault of the face. For lead modifications of 10 to
    20 um on a face of 6 modules both differ by 3 % or less where the angle goes to zero.

    Differentiable where that pair and position stay the same.

    Raises:
        ValueError: for a cycle of one slice.
    """
    return _worst(cycle).factor


@over_batch
def mean_face_load_factor(cycle: MeshCycle) -> Scalar:
    """Largest over mean load over the face, of all pairs together and of the mean over the cycle: what a model with one
    stiffness over the face calls K_Hbeta (ISO 6336-1, Annex E).

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
    """Larger line load of both end slices over the mean over the face, where `face_load_factor` is taken; 0 at ends
    that carry nothing.

    At a free end without relief it grows slowly with the number of slices.

    Raises:
        ValueError: for a cycle of one slice.
    """
    face = _worst(cycle)
    mean = jnp.sum(face.line_load * face.width) / jnp.sum(face.width)
    idle = mean <= 0
    ends = jnp.maximum(face.line_load[0], face.line_load[-1])
    return jnp.where(idle, 1.0, ends / jnp.where(idle, 1.0, mean))


def over_several_slices(factor: Callable[[MeshCycle], Scalar], cycle: MeshCycle) -> Scalar | float:
    """A factor of this module, 1 on one slice, over which the load is even."""
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
