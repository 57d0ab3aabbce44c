"""Mean, slope and curvature of a modification over the width of a contact."""

from collections.abc import Sequence
from functools import partial, reduce
from operator import add
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import GearPair, reduced_radius
from ..microgeometry import AbstractModification, Flank, NoModification, terms
from ..numerics import by_numbers, safe_sqrt
from .kinematics import Side
from .mesh import Mesh

Scalar = Float[Array, ""]
Real = Float[Array, "..."]
Sided = tuple[int, AbstractModification]  # with the number of its gear

# Least half width over which a modification is averaged, relative to the relative radius: without load a slope would be
# 0/0. Contacts are as narrow at a thousandth of usual loads.
_NARROWEST = 1e-3
# Share of the load at the ends of the path of contact, of unmodified spur gears (ISO/TS 6336-20, accurate gears).
_SHARE_AT_ENDS = 1 / 3
_LEAST_SHARED = 1e-6  # length of the path on which pairs share the load [mm], of contact ratios of one and below
# Half of the secant that tells the slope, relative to the half width: over a kink anywhere in the contact it is within
# 0.05 of the slope of the mean under the pressure, relative to the change of slope at the kink.
_SECANT = 0.8


class PlaceSide(NamedTuple):
    """One gear's side of the contacts: numbers of shape (1, 1, 1), roll length of (pairs, 1 or slices, positions).

    Attributes:
        rate: derivative of the roll length by the arc length along the flank towards the pinion tip; negative on the
            wheel.
    """

    rate: Real
    roll_length: Real
    base_radius: Real
    tip_roll_length: Real
    start_roll_length: Real
    face_coordinate: Real
    face_width: Real


class Place(NamedTuple):
    """Nominal contacts, their widths and sliding ranges along the flank [mm], positive towards the pinion tip; shape
    (pairs, 1 or slices, positions).

    Attributes:
        radius: relative radius of curvature.
        half_width: half width of the contact; it may differ from slice to slice.
        beyond: distance of the virtual centre of the contact beyond the corner that touches; zero on the path.
        lowest, highest: limits of the shift of the contact.
        sides: pinion's and wheel's side.
    """

    radius: Real
    half_width: Real
    beyond: Real
    lowest: Real
    highest: Real
    sides: tuple[PlaceSide, PlaceSide]


def place_of(mesh: Mesh, torque: Scalar, line_load: Real | None = None) -> Place:
    """Nominal contacts of a mesh, as wide as the line loads [N/mm] make them; by default `usual_load`."""
    first, second = mesh.sides
    radius = reduced_radius(first.contact_roll_length, second.contact_roll_length)
    outside, path, contact = mesh.kinematics.outside, mesh.kinematics.path, mesh.path_of_contact
    over = []
    for side in (first, second):
        # arc length of the tip's involute over the path that is left out
        tip, base = side.tip_roll_length, side.base_radius
        over.append((2 * tip + outside) * outside / (2 * base))
    # the edge of an undercut stays where the path of contact ends on its gear
    tips = (path > contact.end) & (contact.end_shortened <= 0), (path < contact.start) & (contact.start_shortened <= 0)
    beyond = jnp.where(tips[0], over[0], 0.0) - jnp.where(tips[1], over[1], 0.0)
    inside = [
        jnp.maximum((side.tip_roll_length**2 - side.contact_roll_length**2) / (2 * side.base_radius), 0.0)
        for side in (first, second)
    ]
    sides = _side(mesh, first, 1.0), _side(mesh, second, -1.0)
    narrowest = _NARROWEST * radius
    half_width = jnp.maximum(_half_width(mesh, torque, line_load), narrowest)
    return Place(radius, half_width, beyond, -inside[1], inside[0], sides)


def _side(mesh: Mesh, side: Side, direction: float) -> PlaceSide:
    def number(value: Array) -> Array:
        return jnp.reshape(value, (1, 1, 1))

    roll_length = side.contact_roll_length
    return PlaceSide(
        # arc length of an involute: ds = rho / r_b d rho
        direction * side.base_radius / roll_length,
        roll_length,
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
    roll_length = side.roll_length + moved * side.rate
    return Flank(
        roll_length=jnp.where((roll_length > 0) == (side.base_radius > 0), roll_length, 0.0),
        tip_roll_length=side.tip_roll_length,
        start_roll_length=side.start_roll_length,
        base_radius=side.base_radius,
        face_coordinate=side.face_coordinate,
        face_width=side.face_width,
    )


class Node(NamedTuple):
    """A point across the contact, relative to its half width, and what it weighs in mean and curvature.

    The curvature is that of the parabola that fits best with the weight of the pressure.

    Attributes:
        ends: whether the secant that tells the slope ends here.
    """

    place: float
    mean: float
    curvature: float
    ends: bool


def contact_nodes(nodes: int) -> tuple[Node, ...]:
    """Chebyshev nodes of the second kind, which integrate with the weight of the semi-elliptic pressure."""
    angle = np.pi * np.arange(1, nodes + 1) / (nodes + 1)
    x, mean = np.cos(angle), np.sin(angle) ** 2 * 2 / (nodes + 1)
    square = x**2 - mean @ x**2
    curvature = 2 * mean * square / (mean @ square**2) if nodes > 2 else 0 * x
    off = np.abs(np.abs(x) - _SECANT)
    ends = np.isclose(off, off.min()) & (x != 0) & (nodes > 1)
    return tuple(Node(float(p), float(m), float(c), bool(e)) for p, m, c, e in zip(x, mean, curvature, ends))


class Probe(NamedTuple):
    """Removed material around a point of the flank: mean [um], slope [um/mm] and curvature [um/mm^2]."""

    mean: Real
    slope: Real
    curvature: Real


def probe(sided_terms: Sequence[Sided], place: Place, moved: Real, nodes: tuple[Node, ...]) -> Probe:
    """Modification over the width of a contact moved from its nominal place [mm]; no point of it passes a corner."""
    span = place.half_width, place.lowest, place.highest
    seen = [_seen(term, moved, place.sides[side], span, nodes) for side, term in sided_terms]
    return jax.tree.map(lambda *parts: reduce(add, parts), *seen)


@partial(by_numbers, entrywise=(1, 2, 3))
def _seen(
    term: AbstractModification, moved: Real, side: PlaceSide, span: tuple[Real, Real, Real], nodes: tuple[Node, ...]
) -> Probe:
    half_width, lowest, highest = span
    points = [within(moved + node.place * half_width, lowest, highest) for node in nodes]
    removed = [term(flank_at(side, at)) for at in points]
    mean = reduce(add, [node.mean * each for node, each in zip(nodes, removed)])
    curvature = reduce(add, [node.curvature * each for node, each in zip(nodes, removed)])
    ends = [(at, each) for node, at, each in zip(nodes, points, removed) if node.ends]
    return Probe(mean, _secant(*ends) if ends else jnp.zeros_like(mean), curvature / half_width**2)


def _secant(first: tuple[Real, Real], last: tuple[Real, Real]) -> Real:
    return (first[1] - last[1]) / (first[0] - last[0])


def within(x: Real, low: Real, high: Real) -> Real:
    # no nested maxima: the derivative of a tie is a division
    return jnp.where(x < low, low, jnp.where(x > high, high, x))


def _half_width(mesh: Mesh, torque: Scalar, line_load: Real | None) -> Float[Array, "pairs #slices positions"]:
    """Half width of the contact over which modifications are averaged [mm]."""
    load = usual_load(mesh, torque) if line_load is None else line_load
    return safe_sqrt(mesh.width_factor * load)


def usual_load(mesh: Mesh, torque: Scalar) -> Float[Array, "pairs #slices positions"]:
    """Line load of contacts of unmodified flanks, about [N/mm].

    It is the full one where a pair is alone and falls to the ends of the path of contact from there, without the jump
    where a second pair comes into contact.
    """
    path, contact = mesh.kinematics.path, mesh.path_of_contact
    inside = jnp.minimum(path - contact.start, contact.end - path)
    shared = jnp.maximum(contact.end - contact.start - mesh.pair.base_pitch, _LEAST_SHARED)
    share = jnp.clip(_SHARE_AT_ENDS + (1 - _SHARE_AT_ENDS) * inside / shared, _SHARE_AT_ENDS, 1.0)
    return share * full_load(mesh.pair, torque)


def full_load(pair: GearPair, torque: Scalar) -> Scalar:
    """Line load of one pair that carries all of it [N/mm]."""
    return 1e3 * torque / (pair.pinion.base_radius * pair.face_width)
