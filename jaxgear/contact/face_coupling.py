"""How teeth and bodies spread a load over their faces, and how the slices of a mesh are elastically coupled."""

from functools import reduce
from operator import add
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..compliance import AbstractCompliance, face_ends, face_kernel, few_modes, slice_basis
from ..geometry import GearPair, is_even
from ..geometry.outline import Outline
from ..numerics import Body, SliceCoupling, concrete, real
from .kinematics import Kinematics
from .resolution import Resolution
from .support import AbstractSupport


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
    angle = pair.pinion.helix_angle
    if even:
        kernel = face_kernel(pair.face_width, root_chord, parts, helix_angle=angle)
        return Spreading(jnp.ones((2,), kernel.dtype), _over_slices(kernel, sizes)[None])
    both = [face_kernel(pair.face_width, root_chord, parts, overhang, helix_angle=angle) for overhang in pair.overhangs]
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


_SAME = 1e-6  # relative difference of numbers that single precision keeps apart
_SAME_TORQUE = 1e-4
_MOST_MISSED = 0.05


def slices_alike(
    structures: Float[Array, "gears pairs pairs slices positions"],
) -> tuple[Float[Array, "gears pairs pairs 1 positions"], Float[Array, "pairs slices positions"]]:
    """Compliances of slices that touch at different heights of the teeth, by those of one slice and a scale of each.

    Between slices s and t of pairs p and j they are d[p, s] C[p, j] d[j, t], with d^2 the compliance of every pair in
    a slice over its mean over the face, and C from the correlation of the pairs, its mean over the face: one term of a
    product of functions of both heights. It is exact for every pair within a slice, and for all pairs where heights do
    not differ. Of a cantilever whose ends are loaded at heights that differ by a fifth, which is more than they do over
    the length that a load is felt, it is 2 % above the bending between them.

    Returns:
        of both gears C, and the scale of their sum.
    """
    total = jnp.sum(structures, axis=0)
    own = jnp.stack([total[i, i] for i in range(len(total))])
    mean = jnp.mean(own, axis=1)
    scale = jnp.sqrt(own / mean[:, None])
    return jnp.mean(structures / (scale[:, None] * scale[None])[None], axis=3, keepdims=True), scale


def coupling_of(
    moving: Kinematics,
    spreading: Spreading,
    structures: Float[Array, "gears pairs pairs #slices positions"],
    scale: Float[Array, "pairs slices positions"] | None,
    support: AbstractSupport | None,
    slopes: Float[Array, "gears"],
) -> SliceCoupling | None:
    """The coupling of the slices; None where they are not coupled.

    A support bends in polynomials over the face, as many as the resolution has modes; bodies of helical gears, which
    tilt, in the first two.

    Args:
        moving: kinematics of the pair.
        spreading: how both gears spread loads.
        structures: compliance of both gears, see `Mesh.structure`.
        scale: of the slices, see `slices_alike`; None where all are alike.
        support: shafts, bearings and housing.
        slopes: of both bodies, see `AbstractCompliance.slope`.
    """
    sizes = moving.resolution
    if not sizes.is_coupled:
        return None
    kernels = spreading.kernels
    modes, shares, rests = few_modes(kernels, sizes.face_modes, spreading.ends, sizes.parts)
    mean = jnp.mean(moving.slice_width)
    weight = moving.slice_width / mean
    if sizes.parts is not None:  # modes of the loads times the roots of the widths
        modes = modes / jnp.sqrt(weight)[:, None]
    # gears that spread loads alike are one body
    compliances = structures[:, :, :, 0]
    compliances = compliances if len(kernels) > 1 else jnp.sum(compliances, axis=0)[None]
    bodies = tuple(map(Body, compliances, shares / mean, rests))
    parts = [_tilt(moving, slopes)] if moving.helical else []
    if support is not None:
        parts.append(support.influence(moving.face_coordinate))
    if not parts:
        return SliceCoupling(modes, bodies, scale)
    bends = jnp.asarray(_polynomials(sizes), kernels.dtype)[:, : 2 if support is None else None]
    loads = weight[:, None] * bends
    influence = reduce(add, parts).astype(kernels.dtype)
    return SliceCoupling(modes, bodies, scale, bends, jnp.linalg.multi_dot([loads.T, influence, loads]))


def _tilt(moving: Kinematics, slopes: Float[Array, "gears"]) -> Float[Array, "slices slices"]:
    """Deflection that the slope of helical bodies adds at one place of the face under a force at another [um/N].

    Contacts at y from the middle of a body move by y times the slope along the radius, sin(alpha_wt) of which counts on
    the line of action, where the axial force is tan(beta_b) times that along it; and the other way round. The axial
    force turns both bodies the same way, so that their slopes are subtracted. The part of y y' alone, which spur gears
    have too, is left out: it is less than a hundredth of the compliance.
    """
    pair = moving.pair
    leans = pair.path_slope * jnp.sin(pair.working_pressure_angle) * slopes
    middles = [0.5 * (real(beyond[1]) - real(beyond[0])) for beyond in pair.overhangs]
    one, other = (lean * (moving.face_coordinate - middle) for lean, middle in zip(leans, middles))
    return (one[:, None] + one[None]) - (other[:, None] + other[None])


def _polynomials(sizes: Resolution) -> Float[np.ndarray, "slices bends"]:
    """Polynomials of degree 0, 1, ... at the middles of the slices, one per mode, orthonormal by the slice weights."""
    edges, count = sizes.slice_edges, min(sizes.face_modes, sizes.slices)
    root = np.ones(sizes.slices) if sizes.slice_weights is None else np.sqrt(sizes.slice_weights)
    powers = np.polynomial.legendre.legvander(edges[1:] + edges[:-1], count - 1)
    found, upper = np.linalg.qr(root[:, None] * powers)
    return found * np.sign(np.diagonal(upper)) / root[:, None]


def check_support(support: AbstractSupport | None, pair: GearPair, resolution: Resolution) -> None:
    """Refuses a support that the mesh cannot take.

    Raises:
        TypeError: for something else than a support.
        ValueError: for a support of other gears, or slices that are not coupled.
    """
    if support is None:
        return
    if not isinstance(support, AbstractSupport):
        raise TypeError(f"support is a {type(support).__name__}, must be a support: jaxgear.shafts.support makes one")
    if resolution.slices == 1:
        raise ValueError("support acts over the face, which a mesh of 1 slice cannot show: Resolution(slices=11)")
    if not resolution.coupled_slices:
        raise ValueError("support needs coupled slices: Resolution(coupled_slices=True)")
    if support.needs_even_slices and resolution.parts is not None:
        raise ValueError(
            f"support is a {type(support).__name__}, over slices of equal width, the mesh has others: leave "
            "slice_widths out of the resolution, or give a support that is defined all over the face"
        )
    # numbers that one pair has and the other leaves to its defaults cannot be compared one by one
    given, own = (jax.tree.leaves(each, is_leaf=lambda leaf: leaf is None) for each in (support.pair, pair))
    for one, other in zip(given, own, strict=True):
        here, there = (None if leaf is None else concrete(leaf) for leaf in (one, other))
        if here is not None and there is not None and not np.allclose(here, there, rtol=_SAME):
            raise ValueError("support holds another pair than the one to prepare: take support.pair")


def check_modes(support: AbstractSupport | None, resolution: Resolution) -> None:
    """Refuses a tabulated support that the polynomials of the resolution cannot follow, as far as it is known.

    Raises:
        ValueError: where they miss more than a twentieth of the matrix.
    """
    table = None if support is None else support.tabulated
    matrix = None if table is None else concrete(table)
    if matrix is None or not matrix.any():
        return
    bends = _polynomials(resolution)
    kept = bends @ (bends.T @ matrix @ bends) @ bends.T
    missed = np.linalg.norm(matrix - kept) / np.linalg.norm(matrix)
    if missed > _MOST_MISSED:
        raise ValueError(
            f"support: {resolution.face_modes} polynomials over the face miss {missed:.0%} of matrix, must "
            f"miss at most {_MOST_MISSED:.0%}: Resolution(face_modes={resolution.slices}) takes all of it"
        )


def holds_at(wanted: Float[Array, ""], torque: Float[Array, ""]) -> Bool[Array, ""]:
    """Whether a support that belongs to one torque holds at another; `check_torque` refuses it where both are known."""
    return jnp.abs(torque - wanted) <= _SAME_TORQUE * jnp.abs(wanted)


def check_torque(wanted: Float[Array, ""] | None, torque: Float[Array, "*loads"]) -> None:
    """Refuses torques at which a support that belongs to one does not hold, as far as all are known.

    Args:
        wanted: torque of the gearbox whose shafts are the support [N m]; None where there is no such support.
        torque: on the pinion [N m].

    Raises:
        ValueError: for another torque than that of the gearbox.
    """
    given, known = (None if number is None else concrete(number) for number in (torque, wanted))
    if given is None or known is None:
        return
    others = np.atleast_1d(given)[~np.isclose(np.atleast_1d(given), known, rtol=_SAME_TORQUE, atol=0.0)]
    if len(others):
        raise ValueError(
            f"torque = {float(others[0]):g} N m, but the gearbox that supports the gears has {float(known):g} "
            "N m on this pinion: prepare with the gearbox at that torque"
        )
