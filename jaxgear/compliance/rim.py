"""A ring gear on arcs or on an elastic foundation: compliance beyond that of a ring held all round.

Between separate supports the rim bends. What that adds to the compliance of the ring held all round (`ring`) is found
on a ring whose inner circle lies a fifth of a module inside the root circle, as the teeth stiffen the rim:

    C_ij = u_i^T K_clamped u_j at r_f  +  v_i^T [K_free - W_i^T F^-1 W_j - K_clamped] v_j at r_e,   r_e = r_f - 0.20 m

with the load modes u of a tooth about its root circle and v about the inner circle, the motion W of the supports under
them and F of the supports under each other. The reaction of an arc is constant on each of its segments, which get
narrower towards its ends. A ring without supports moves as a rigid body: springs that act on its rigid motions alone
make W and F finite, and equilibrium of loads and reactions takes the forces of the springs out again, whatever their
stiffness.

Harmonic by harmonic, the ring has a matrix G between displacements and forces per angle on its two circles, r and o.
Held all round it has G_rr - G_ro G_oo^-1 G_or, so that the bracket begins with G_ro G_oo^-1 G_or; on an elastic
foundation, which is a spring in G, this is all of it.

The depth of the inner circle is fitted to plane finite elements of 19/64 teeth on six arcs of 6 degrees, in the middle
between two, with a rim of one tooth height in plane stress.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry.rim_support import AbstractRimSupport, ElasticFoundation, SupportArcs
from ..numerics import solve_dense
from .ring import Circle, arc_modes, michell_terms

Scalar = Float[Array, ""]
Loads = Float[Array, "loads n 2 2"]  # Fourier coefficients of forces per angle, see `_loads`

# Depth of the inner circle inside the root circle [modules].
STIFFENED = 0.20


def support_compliance(
    half_angle: Scalar,
    thickness_ratio: Scalar,
    poisson: Scalar,
    place: Float[Array, " teeth"],
    support: AbstractRimSupport,
    softness: Scalar,
) -> Float[Array, "teeth teeth 3 3"]:
    """Compliance between teeth by the supports, beyond that of a ring held all round.

    Args:
        half_angle: half angle of the root arc [rad].
        thickness_ratio: inner over outer radius of the ring.
        poisson: Poisson's ratio of the plane problem.
        place: angles of the teeth on the ring, counter-clockwise [rad], shape (teeth,).
        support: what holds the outer circle.
        softness: compliance of one arc or of the foundation, see `softness`.

    Returns:
        the matrices times the plane modulus, as `ring.arc_compliance` has them, shape (teeth, teeth, 3, 3).
    """
    harmonics = support.harmonics
    teeth = _teeth(half_angle, place, harmonics)
    weight = np.pi * np.where(np.arange(harmonics + 1) == 0, 2.0, 1.0)
    arcs = support if isinstance(support, SupportArcs) else None
    springs = _foundation(1 / softness, harmonics) if arcs is None else _rigid_motions(teeth.dtype, harmonics)
    of_ring = _ring(thickness_ratio, poisson, springs, harmonics)
    weighted = of_ring * jnp.asarray(weight, teeth.dtype)[:, None, None]
    between, outer = weighted[:, :2, 2:], weighted[:, 2:, 2:]
    moved = jnp.einsum("anpi,nij->anpj", teeth, between)
    found = jnp.einsum("anpi,nij,bnpj->ab", moved, _inverse(outer), moved)
    if arcs is not None:
        found = found - _reactions(teeth, moved, outer, arcs, softness, 1 / thickness_ratio)
    count = len(place)
    return jnp.transpose(found.reshape(count, 3, count, 3), (0, 2, 1, 3))


def softness(support: AbstractRimSupport, plane_modulus: Scalar, inner_radius: Scalar, face_width: Scalar) -> Scalar:
    """Compliance of a support, times the plane modulus [MPa] and relative to inner radius and face width [mm]."""
    if support.stiffness is None:
        return jnp.zeros_like(plane_modulus)
    if isinstance(support, ElasticFoundation):
        return plane_modulus / (support.stiffness * inner_radius)
    return 1e-3 * plane_modulus * face_width / support.stiffness


def _reactions(
    teeth: Loads, moved: Loads, outer: Float[Array, "n 2 2"], support: SupportArcs, softness: Scalar, radius: Scalar
) -> Float[Array, "loads loads"]:
    """Compliance that the reactions of the arcs take away; `moved` are the harmonics of the outer circle."""
    segments = _segments(support, teeth.shape[1] - 1)
    loads = segments.loads
    flat = loads.reshape(len(loads), -1)
    among = jnp.einsum("anpi,nij->anpj", loads, outer).reshape(len(loads), -1) @ flat.T
    among = among + jnp.diag(softness / segments.share)
    # resultants: forces along both axes, moment
    own, given = _resultants(loads, radius), _resultants(teeth, jnp.ones_like(radius))
    matrix = jnp.block([[among, own.T], [own, jnp.zeros((3, 3), own.dtype)]])
    right = jnp.concatenate([flat @ moved.reshape(len(moved), -1).T, given])
    return right.T @ solve_dense(matrix, right)


def _resultants(loads: Loads, radius: Scalar) -> Float[Array, "3 loads"]:
    """Forces along the axes and moment about the middle of unit loads on a circle of the radius."""
    force = np.pi * (loads[:, 1, :, 0] - loads[:, 1, :, 1])
    return jnp.stack([force[:, 0], force[:, 1], -2 * np.pi * radius * loads[:, 0, 1, 1]])


def _teeth(half_angle: Scalar, place: Array, harmonics: int) -> Loads:
    modes = arc_modes(half_angle, harmonics)
    # moment and shear have odd radial and even tangential stress, normal the reverse
    return _loads(jnp.tile(modes, (len(place), 1, 1)), jnp.repeat(place, 3), np.tile([False, False, True], len(place)))


class _Segments(NamedTuple):
    """Unit forces on the segments of all arcs.

    Attributes:
        loads: their Fourier coefficients.
        share: width of the segment over that of its arc.
    """

    loads: Loads
    share: Float[Array, " loads"]


def _segments(support: SupportArcs, harmonics: int) -> _Segments:
    count, reach = support.segments, 0.5 * jnp.deg2rad(support.width)
    edges = -np.cos(np.pi * np.arange(count + 1) / count)  # of an arc from -1 to 1
    middle, half = (jnp.asarray(of, reach.dtype) for of in (0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)))
    spacing = 2 * np.pi / support.arcs * jnp.arange(support.arcs, dtype=reach.dtype)
    place = (jnp.deg2rad(support.first) + spacing[:, None] + reach * middle[None]).reshape(-1)
    order = jnp.arange(harmonics + 1, dtype=reach.dtype)
    scale = jnp.where(order == 0, 0.5, 1.0) / np.pi
    density = jnp.tile(jnp.sinc(order[None] * (reach * half)[:, None] / np.pi) * scale[None], (support.arcs, 1))
    none, share = jnp.zeros_like(density), jnp.tile(half, support.arcs)
    tangential = _loads(jnp.stack([none, -density], -1), place, np.zeros(len(place), bool))
    if not support.radial:
        return _Segments(tangential, share)
    radial = _loads(jnp.stack([density, none], -1), place, np.ones(len(place), bool))
    return _Segments(jnp.concatenate([radial, tangential]), jnp.concatenate([share, share]))


def _loads(series: Float[Array, "loads n 2"], place: Float[Array, " loads"], even: np.ndarray) -> Loads:
    """Fourier coefficients on the circle of forces per angle about their own places.

    Of every harmonic, the first row has the coefficients of cos in radial and sin in tangential direction, the second
    of sin and, negative, cos: a ring answers to both alike.

    Args:
        series: radial and tangential coefficients about the place of each load: of cos and sin where the radial force
            is even, of sin and, negative, of cos where it is odd.
        place: angles of the loads [rad].
        even: whether the radial force of a load is even about its place.
    """
    angle = place[:, None] * jnp.arange(series.shape[1], dtype=place.dtype)[None]
    cosine, sine = jnp.cos(angle), jnp.sin(angle)
    even = even[:, None]
    rows = jnp.stack([jnp.where(even, cosine, -sine), jnp.where(even, sine, cosine)], -1)
    return rows[..., None] * series[:, :, None]


def _rigid_motions(dtype: np.dtype, harmonics: int) -> Float[Array, "n 2 2"]:
    """Springs on translations and turns of the outer circle alone, of unit stiffness."""
    springs = np.zeros((harmonics + 1, 2, 2))
    springs[0, 1, 1] = 1.0
    springs[1] = [[0.5, -0.5], [-0.5, 0.5]]
    return jnp.asarray(springs, dtype)


def _foundation(stiffness: Scalar, harmonics: int) -> Float[Array, "n 2 2"]:
    return stiffness * jnp.broadcast_to(jnp.eye(2, dtype=stiffness.dtype), (harmonics + 1, 2, 2))


def _ring(
    thickness_ratio: Scalar, poisson: Scalar, springs: Float[Array, "n 2 2"], harmonics: int
) -> Float[Array, "n 4 4"]:
    """Displacements (u_r, u_theta) of inner and outer circle per force per angle on them, n = 0 ... harmonics."""
    terms = [_uniform(thickness_ratio, poisson), *michell_terms(thickness_ratio, poisson, harmonics, True)]
    inner, outer = (Circle(*(jnp.concatenate(part) for part in zip(*circles))) for circles in zip(*terms))
    held = outer.stress + (1 + poisson) * springs @ outer.displacement
    # the outward normal of the inner circle points to the axis
    system = jnp.concatenate([-inner.stress, held / thickness_ratio], axis=-2)
    unit = jnp.broadcast_to(jnp.eye(4, dtype=system.dtype), system.shape)
    moved = jnp.concatenate([inner.displacement, outer.displacement], axis=-2)
    return (1 + poisson) * moved @ jax.vmap(solve_dense)(system, unit)


def _uniform(thickness_ratio: Scalar, poisson: Scalar) -> tuple[Circle, Circle]:
    """Terms of harmonic 0: r and 1 / r in radial and in tangential direction."""

    def circle(r: Array) -> Circle:
        zero, one = jnp.zeros_like(r), jnp.ones_like(r)
        displacement = [[r, 1 / r, zero, zero], [zero, zero, r, 1 / r]]
        stress = [[(1 + poisson) / (1 - poisson) * one, -(r**-2), zero, zero], [zero, zero, zero, -(r**-2)]]
        return Circle(*(jnp.stack([jnp.stack(row) for row in rows])[None] for rows in (displacement, stress)))

    return circle(jnp.ones_like(thickness_ratio)), circle(1 / thickness_ratio)


def _inverse(matrix: Float[Array, "n 2 2"]) -> Float[Array, "n 2 2"]:
    (a, b), (c, d) = jnp.moveaxis(matrix, 0, -1)
    return jnp.moveaxis(jnp.stack([jnp.stack([d, -b]), jnp.stack([-c, a])]) / (a * d - b * c)[None, None], -1, 0)
