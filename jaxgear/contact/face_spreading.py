"""How teeth and bodies of both gears spread a load over their faces, each over its own."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance import AbstractCompliance, face_ends, face_kernel
from ..geometry import GearPair, is_even
from ..geometry.outline import Outline
from .resolution import Resolution


class Spreading(NamedTuple):
    """How the gears of a pair spread loads.

    Attributes:
        shares: mean deflection of the common face under a load that is uniform over it, of pinion and wheel, over that
            of gears which end with it: less than 1 where a gear overhangs the load and helps to carry it.
        kernels: of pinion and wheel, `face_kernel` over its share; a single one where both faces are known to be one.
        ends: `face_ends`; None where both faces are known to be one.
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
        sizes: for the number of slices.
        even: as of `ends_together`.
    """
    root_chord = 0.5 * (outlines[0].root_chord + outlines[1].root_chord)
    if even:
        kernel = face_kernel(pair.face_width, root_chord, sizes.slices)
        return Spreading(jnp.ones((2,), kernel.dtype), kernel[None])
    both = [face_kernel(pair.face_width, root_chord, sizes.slices, overhang) for overhang in pair.overhangs]
    kernels = jnp.stack(both)
    shares = jnp.sum(kernels, axis=(1, 2)) / sizes.slices
    ends = face_ends(pair.face_width, root_chord, sizes.slices)
    return Spreading(shares, kernels / shares[:, None, None], ends)
