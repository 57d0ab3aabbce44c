"""How uneven the load is over the face: factors of a mesh cycle.

References:
    ISO 6336-1, clause 7: K_Hbeta is the largest over the mean load per face width, K_Fbeta follows from it and the
    height of the teeth over their width.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import MeshCycle
from ..numerics import over_batch
from ..shafts import face_load_factor as factor_of
from ..shafts import tooth_height
from ..shafts.face_load import root_exponent

Scalar = Float[Array, ""]
Curve = Float[Array, " positions"]


class _Face(NamedTuple):
    """Line load over the face [N/mm], slices last, and the width of every slice [mm]."""

    line_load: Float[Array, "... slices"]
    width: Float[Array, " slices"]


@over_batch
def face_load_factors(cycle: MeshCycle) -> Curve:
    """Of every position, largest over mean line load over the face of the pair with the largest line load there.

    Raises:
        ValueError: for a cycle of one slice.
    """
    return factor_of(*_at_positions("face_load_factors", cycle))


@over_batch
def face_load_factor(cycle: MeshCycle) -> Scalar:
    """K_Hbeta: largest over mean line load over the face, of the pair and at the position with the largest line load.

    Differentiable where that pair and position stay the same.

    Raises:
        ValueError: for a cycle of one slice.
    """
    return factor_of(*_worst("face_load_factor", cycle))


@over_batch
def root_face_load_factor(cycle: MeshCycle) -> Scalar:
    """K_Fbeta = K_Hbeta^N_F of ISO 6336-1, Method B, from `face_load_factor` and the height of the teeth.

    Raises:
        ValueError: for a cycle of one slice.
    """
    pair = cycle.kinematics.pair
    factor = factor_of(*_worst("root_face_load_factor", cycle))
    return jnp.maximum(factor, 1.0) ** root_exponent(pair.face_width, tooth_height(pair))


@over_batch
def edge_load_factor(cycle: MeshCycle) -> Scalar:
    """Larger line load of both end slices over the mean over the face, where `face_load_factor` is taken; 0 at ends
    that carry nothing.

    At a free end without relief it grows slowly with the number of slices.

    Raises:
        ValueError: for a cycle of one slice.
    """
    face = _worst("edge_load_factor", cycle)
    mean = jnp.sum(face.line_load * face.width) / jnp.sum(face.width)
    idle = mean <= 0
    ends = jnp.maximum(face.line_load[0], face.line_load[-1])
    return jnp.where(idle, 1.0, ends / jnp.where(idle, 1.0, mean))


def over_several_slices(factor: Callable[[MeshCycle], Scalar], cycle: MeshCycle) -> Scalar | float:
    """A factor of this module, 1 on one slice, over which the load is even."""
    return factor(cycle) if cycle.kinematics.resolution.slices > 1 else 1.0


def _at_positions(owner: str, cycle: MeshCycle) -> _Face:
    """Of every position, the pair with the largest line load; shape (positions, slices)."""
    slices = cycle.kinematics.resolution.slices
    if slices == 1:
        raise ValueError(f"{owner}: a mesh of 1 slice has no load over the face: prepare with Resolution(slices=11)")
    load = jnp.moveaxis(cycle.line_load, 2, 0)  # positions, pairs, slices
    most = jnp.argmax(jnp.max(load, axis=2), axis=1)
    return _Face(jnp.take_along_axis(load, most[:, None, None], axis=1)[:, 0], cycle.kinematics.slice_width)


def _worst(owner: str, cycle: MeshCycle) -> _Face:
    """The pair and position with the largest line load; shape (slices,)."""
    found = _at_positions(owner, cycle)
    return found._replace(line_load=found.line_load[jnp.argmax(jnp.max(found.line_load, axis=1))])
