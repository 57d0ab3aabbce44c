"""How teeth and bodies of both gears spread a load over their faces, each over its own."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance import AbstractCompliance, face_ends, face_kernel, slice_basis
from ..geometry import GearPair, is_even
from ..geometry.outline import Outline
from .resolution import Resolution


class Spreading(NamedTuple):
    """How the gears of a pair spread loads.

    Attributes:
        shares: mean deflection of the common face under a load that is uniform over it, of pinion and wheel, over that
            of gears which end with it: less than 1 where a gear overhangs the load and helps to carry it.
        kernels: of pinion and wheel, `face_kernel` over its share; a single one where both faces are known to be one.
            Of slices of unequal width between loads and deflections times the roots of the widths.
        ends: `face_ends` likewise; None where both faces are known to be one.
    """

    shares: Float[Array, "gears"]
    kernels: Float[Array, "gears slices slices"]
    ends: Float[Array, "slices ends"] | None = None


def ends_together(pair: GearPair, compliance: AbstractCompliance) -> bool:
    """Whether neither gear is known to help beyond the common face: in one plane nothing lies beyond it."""
    return is_even(pair) or compliance.plane != "auto"


def spreading_of(pair: GearPair, outlines: tuple[Outline, Outline], sizes: Resolution, even: bool) -> Spreading:
    """How both gears spread loads over the slices of a mesh.

    They share the root chord of their mean (see `face_kernel`).

    Args:
        pair: the gears.
        outlines: of both.
        sizes: for the slices.
        even: as of `ends_together`.
    """
    root_chord = 0.5 * (outlines[0].root_chord + outlines[1].root_chord)
    parts = sizes.slices if sizes.parts is None else sum(sizes.parts)
    if even:
        kernel = face_kernel(pair.face_width, root_chord, parts)
        return Spreading(jnp.ones((2,), kernel.dtype), _over_slices(kernel, sizes)[None])
    both = [face_kernel(pair.face_width, root_chord, parts, overhang) for overhang in pair.overhangs]
    kernels = jnp.stack(both)
    shares = jnp.sum(kernels, axis=(1, 2)) / parts
    ends = face_ends(pair.face_width, root_chord, parts)
    if sizes.parts is not None:
        ends = jnp.asarray(slice_basis(sizes.parts).T, ends.dtype) @ ends
    return Spreading(shares, _over_slices(kernels, sizes) / shares[:, None, None], ends)


def _over_slices(kernel: Float[Array, "*gears parts parts"], sizes: Resolution) -> Float[Array, "*gears slices slices"]:
    """A kernel of parts of equal width as one of the slices."""
    if sizes.parts is None:
        return kernel
    basis = jnp.asarray(slice_basis(sizes.parts), kernel.dtype)
    return basis.T @ kernel @ basis
