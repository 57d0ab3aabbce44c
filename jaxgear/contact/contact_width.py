"""What the contacts see of a modification around a place on the flank: its mean, slope and curvature."""

from collections.abc import Sequence
from functools import reduce
from operator import add, mul
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import reduced_radius
from ..microgeometry import AbstractModification, Flank, NoModification, terms
from ..numerics import over_slices, safe_sqrt
from .kinematics import Side
from .mesh import Mesh

Scalar = Float[Array, ""]
Real = Float[Array, "..."]
Sided = tuple[int, AbstractModification]  # with the number of its gear

# Least half width over which a modification is averaged, relative to the relative radius: without load a slope would be
# 0/0. Contacts are as narrow at a thousandth of usual loads.
_NARROWEST = 1e-3
# Share of the load at the ends of the path of contact (ISO 6336-2 and ISO/TS 6336-20: unmodified spur gears).
_SHARE_AT_ENDS = 1 / 3
_TINY = 1e-6
# Half of the secant that tells the slope, relative to the half width: over a kink anywhere in the contact it is within
# 0.05 of the slope of the mean under the pressure.
_SECANT = 0.8


class PlaceSide(NamedTuple):
    """One gear's side of the contacts: numbers of shape (1, 1, 1), roll length of (pairs, 1 or slices, positions).

    Attributes:
        direction: +1 where moving towards the pinion tip makes the roll length grow, else -1.
    """

    direction: float
    roll_length: Real
    base_radius: Real
    tip_roll_length: Real
    start_roll_length: Real
    face_coordinate: Real
    face_width: Real


class Place(NamedTuple):
    """Where the contacts are and how far they may slide [mm], positive towards the pinion tip; (pairs, 1 or
    slices, positions).

    The half width may differ from slice to slice.

    Attributes:
        radius: relative radius of curvature.
        half_width: of the contact.
        beyond: of the virtual centre of the contact beyond the corner that touches; zero on the path.
        lowest, highest: how far the contact may slide.
    """

    radius: Real
    half_width: Real
    beyond: Real
    lowest: Real
    highest: Real
    sides: tuple[PlaceSide, PlaceSide]


def place_of(mesh: Mesh, torque: Scalar, line_load: Real | None = None) -> Place:
    """Where the contacts of a mesh are; as wide as their line loads make them [N/mm], where these are given."""
    first, second = mesh.sides
    radius = over_slices(reduced_radius(first.contact_roll_length, second.contact_roll_length))
    outside, path, contact = mesh.kinematics.contact_outside, mesh.kinematics.contact_path, mesh.path_of_contact
    over = []
    for side in (first, second):
        # arc length of the tip's involute over the path that is left out
        tip, base = side.tip_roll_length, side.base_radius
        over.append((2 * tip + outside) * outside / (2 * base))
    # the edge of an undercut stays where the path of contact ends on its gear
    tips = (path > contact.end) & (contact.end_shortened <= 0), (path < contact.start) & (contact.start_shortened <= 0)
    beyond = jnp.where(tips[0], over[0], 0.0) - jnp.where(tips[1], over[1], 0.0)
    inside = [
        jnp.maximum(side.tip_roll_length**2 - side.contact_roll_length**2, 0.0) / (2 * side.base_radius)
        for side in (first, second)
    ]
    sides = _side(mesh, first, 1.0), _side(mesh, second, -1.0)
    narrowest = _NARROWEST * radius
    half_width = jnp.maximum(_half_width(mesh, torque, line_load), narrowest)
    beyond, before, ahead = map(over_slices, (beyond, inside[1], inside[0]))
    return Place(radius, half_width, beyond, -before, ahead, sides)


def _side(mesh: Mesh, side: Side, direction: float) -> PlaceSide:
    def number(value: Array) -> Array:
        return jnp.reshape(value, (1, 1, 1))

    return PlaceSide(
        direction,
        over_slices(side.contact_roll_length),
        number(side.base_radius),
        number(side.tip_roll_length),
        number(side.start_roll_length),
        (mesh.face_coordinate + side.face_middle)[None, :, None],
        number(side.face_width),
    )


def terms_of(mesh: Mesh, dtype: np.dtype, pinion: AbstractModification, wheel: AbstractModification) -> list[Sided]:
    """Every term of both modifications with the number of its side, in the precision of the mesh.

    On their own, since most vary along the profile or along the face only.
    """

    def cast(leaf: Any) -> Any:
        return leaf.astype(dtype) if eqx.is_inexact_array(leaf) else leaf

    return [
        (side, jax.tree.map(cast, term))
        for side, modification in enumerate((pinion, wheel))
        for term in terms(modification)
        if not isinstance(term, NoModification)
    ]


def varies_along_profile(sided: Sided, place: Place) -> bool:
    """Whether a term has other values along the profile than across the face: its array then has those axes."""
    number, term = sided
    shape = eqx.filter_eval_shape(lambda: term(flank_at(place.sides[number], jnp.zeros_like(place.radius)))).shape
    return shape[0] > 1 or shape[-1] > 1


def flank_at(side: PlaceSide, moved: Real) -> Flank:
    """Points of one gear's flank at a distance from the nominal contact, towards the pinion tip [mm]."""
    # arc length of an involute: ds = rho / r_b d rho
    roll_length = side.roll_length + side.direction * moved * (side.base_radius / side.roll_length)
    return Flank(
        roll_length=jnp.where(roll_length > 0, roll_length, 0.0),
        tip_roll_length=side.tip_roll_length,
        start_roll_length=side.start_roll_length,
        base_radius=side.base_radius,
        face_coordinate=side.face_coordinate,
        face_width=side.face_width,
    )


class Node(NamedTuple):
    """A point across the contact, relative to its half width, and what it weighs in mean, slope and curvature.

    The curvature is that of the parabola that fits best with the weight of the pressure, the slope that of a secant.
    """

    place: float
    mean: float
    slope: float
    curvature: float


def contact_nodes(nodes: int) -> tuple[Node, ...]:
    """Chebyshev nodes of the second kind, which integrate with the weight of the semi-elliptic pressure."""
    angle = np.pi * np.arange(1, nodes + 1) / (nodes + 1)
    x, mean = np.cos(angle), np.sin(angle) ** 2 * 2 / (nodes + 1)
    square = x**2 - mean @ x**2
    ends = np.abs(np.abs(x) - _SECANT)
    slope = np.where(np.isclose(ends, ends.min()), 0.5 / x, 0.0) if nodes > 1 else 0 * x
    curvature = 2 * mean * square / (mean @ square**2) if nodes > 2 else 0 * x
    return tuple(Node(*map(float, row)) for row in zip(x, mean, slope, curvature))


class Probe(NamedTuple):
    """Removed material around a point of the flank: mean [um], slope [um/mm] and curvature [um/mm^2]."""

    mean: Real
    slope: Real
    curvature: Real


def probe(sided_terms: Sequence[Sided], place: Place, moved: Real, nodes: tuple[Node, ...]) -> Probe:
    """What a contact at a place sees; no point of it passes a corner."""
    points = [within(moved + node.place * place.half_width, place.lowest, place.highest) for node in nodes]
    removed = [reduce(add, [term(flank_at(place.sides[side], at)) for side, term in sided_terms]) for at in points]
    mean, curvature = (reduce(add, map(mul, weights, removed)) for weights in zip(*((n.mean, n.curvature) for n in nodes)))
    ends = [i for i, node in enumerate(nodes) if node.slope]
    slope = jnp.zeros_like(mean)
    if ends:
        first, last = ends
        slope = (removed[first] - removed[last]) / (points[first] - points[last])
    return Probe(mean, slope, curvature / place.half_width**2)


def within(x: Real, low: Real, high: Real) -> Real:
    # no nested maxima: the derivative of a tie is a division
    return jnp.where(x < low, low, jnp.where(x > high, high, x))


def _half_width(mesh: Mesh, torque: Scalar, line_load: Real | None) -> Float[Array, "pairs #slices positions"]:
    """Half width of the contact over which modifications are averaged [mm]: by default of one pair that carries all."""
    if line_load is not None:
        return safe_sqrt(over_slices(mesh.width_factor) * line_load)
    force = 1e3 * torque / mesh.pair.pinion.base_radius * over_slices(_load_share(mesh))
    return safe_sqrt(over_slices(mesh.width_factor) * force / mesh.pair.face_width)


def _load_share(mesh: Mesh) -> Real:
    """Share of the load that a contact on the path has about, of unmodified flanks: all of it where it is alone, and
    less towards the ends of the path."""
    path, contact = mesh.kinematics.contact_path, mesh.path_of_contact
    inside = jnp.minimum(path - contact.start, contact.end - path)
    shared = jnp.maximum(contact.end - contact.start - mesh.pair.base_pitch, 0.0)
    return jnp.clip(_SHARE_AT_ENDS + (1 - _SHARE_AT_ENDS) * inside / (shared + _TINY), _SHARE_AT_ENDS, 1.0)
