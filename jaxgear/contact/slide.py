"""Where loaded flanks touch on a modification, and over which width it is averaged.

Two flanks of relative radius R, from which material c has been removed, touch where bulge and removed material together
are least: over the distance u along the flank from the nominal contact

    e = min over u of [ ((u - o)^2 - o^2) / (2 R) + mean c(u) ],

the mean taken over the contact with the weight of the Hertzian pressure. Beyond the path of contact a tip corner
touches, o away from the virtual centre of the contact; there, and before the corner on the path, u cannot pass the
corner. A slope s moves the virtual centre by -R s and lets the gap fall by R s^2 / 2.

The contact rests where the slope over its middle, with that of the bulge, is zero. A search in single precision comes
near, a step of Newton's method gets there, and the derivatives of any order follow from what stays zero (implicit
function theorem). The mean at rest gives the least gap. Of steep, short reliefs, whose slope jumps to and fro, two
places in a thousand are not found to rounding; their derivatives are then near ones. Against a fine search with more
points the gap is off by 0.03 um on reliefs and crowning, 0.1 um on a root relief of 8 um over 1.5 mm, and 0.3 um on a
table that jumps by several um from millimetre to millimetre (19/48, module 3).

Finite elements have no width of their own: what their contacts meet of a relief follows from the load that each of them
carries. Where the structure is as accurate as that, it shows: on steep reliefs the wider mean makes PPTE up
to 9 % too small, and the loaded width leaves 2.5 % at worst.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..compliance import default_compliance
from ..geometry import GearPair
from ..microgeometry import AbstractModification, NoModification
from ..numerics import Checked, Numbers, changed, jvp_of_given, program, real, result, stored
from .contact_width import (
    Node,
    Place,
    Sided,
    contact_nodes,
    flank_at,
    place_of,
    probe,
    secant_slope,
    terms_of,
    varies_along_profile,
)
from .mesh import Mesh
from .resolution import Resolution

Scalar = Float[Array, ""]
Load = Float[Array, "pairs slices positions"]
Field = Float[Array, "pairs #slices positions"]
Real = Float[Array, "..."]
Mask = Bool[Array, "..."]
Own = tuple[AbstractModification, AbstractModification]


# Share of the curvature of the bulge below which there is no least gap to lead to.
_LEAST_CURVATURE = 0.1
# By how much the least gap may lie beyond what single precision says [mm]: far above its rounding.
_SLACK = 1e-3


class RemovedMaterial(Checked):
    """Material removed from both flanks as the contacts meet it; adding a field adds to the amount.

    Attributes:
        amount: by which the gap is wider than that of the unmodified flanks [um], shape (pairs, slices, positions).
        shift: of the centre of contact along the flanks, positive towards the pinion tip [mm], shape (pairs, slices or
            1, positions).
        relative_curvature: curvature that the removed material adds, times the relative radius of the flanks; of the
            same shape.
    """

    amount: Load = result("um")
    shift: Field = result("mm")
    relative_curvature: Field = result()

    def __add__(self, field: Float[Array, "..."] | float) -> "RemovedMaterial":
        return RemovedMaterial(self.amount + field, self.shift, self.relative_curvature)

    __radd__ = __add__


def nothing_removed(sizes: Resolution, dtype: np.dtype) -> RemovedMaterial:
    """That of nominal involutes."""
    return as_removed(sizes, np.zeros((sizes.chosen_pairs, sizes.slices, sizes.positions), dtype))


def as_removed(sizes: Resolution, amount: Numbers) -> RemovedMaterial:
    """A bare amount [um], met at the nominal contact."""
    amount = real(amount)
    flat = real(np.zeros((sizes.chosen_pairs, 1, sizes.positions), amount.dtype))
    return RemovedMaterial(amount, flat, flat)


@program
def nominal_material(
    mesh: Mesh, torque: Scalar, pinion: AbstractModification, wheel: AbstractModification
) -> Float[Array, "pairs slices positions"]:
    """Mean of the removed material around the nominal contact [um], linear in the modifications."""
    place, sizes = place_of(mesh, torque), mesh.resolution
    total = jnp.zeros((sizes.chosen_pairs, sizes.slices, sizes.positions), torque.dtype)
    nodes = contact_nodes(sizes.contact_nodes)
    for sided in terms_of(mesh, torque.dtype, pinion, wheel):
        total = total + probe([sided], place, jnp.zeros_like(place.radius), nodes).mean
    return total


@program
def slid_material(
    mesh: Mesh,
    torque: Scalar,
    pinion: AbstractModification,
    wheel: AbstractModification,
    line_load: Load | None = None,
    own: Own | None = None,
) -> RemovedMaterial:
    """What the contacts meet of the modifications; its arguments in the precision of the mesh.

    The contacts are as wide as their line loads make them [N/mm]; by default as one pair that carries the full load.
    `own` are further modifications of pinion and wheel, every array of which has one entry per pair in front.
    """
    place, sizes, dtype = place_of(mesh, torque, line_load), mesh.resolution, torque.dtype
    sided = terms_of(mesh, dtype, pinion, wheel)
    if own is None:
        return _slid(place, sided, sizes, sizes.chosen_pairs)
    # one pair after the other has a place of its own, with an axis of length one for it
    places, count = jax.tree.map(lambda leaf: _by_pair(leaf, sizes.chosen_pairs), place), 1

    def of_pair(place: Place, own: Own) -> RemovedMaterial:
        return _slid(place, [*sided, *terms_of(mesh, dtype, *own)], sizes, count)

    found = eqx.filter_vmap(of_pair)(places, own)
    return RemovedMaterial(found.amount[:, 0], found.shift[:, 0], found.relative_curvature[:, 0])


def _by_pair(leaf: Array | float, pairs: int) -> Array | float:
    """A number of every place with the pairs as an axis in front; a plain number for all."""
    return leaf if jnp.ndim(leaf) == 0 else jnp.broadcast_to(leaf, (pairs, *jnp.shape(leaf)[1:]))[:, None]


def _slid(place: Place, sided: Sequence[Sided], sizes: Resolution, pairs: int) -> RemovedMaterial:
    given = [(each, varies_along_profile(each, place)) for each in sided]
    along = [each for each, slopes in given if slopes]  # what the contact slides down
    amount = jnp.zeros((pairs, sizes.slices, sizes.positions), place.radius.dtype)
    for side, term in (each for each, slopes in given if not slopes):
        amount = amount + term(flank_at(place.sides[side], jnp.zeros_like(place.radius)))
    if not along:
        flat = jnp.zeros((pairs, 1, sizes.positions), amount.dtype)
        return RemovedMaterial(amount, flat, flat)
    found = _slide(along, place, contact_nodes(sizes.contact_nodes), sizes.chosen_slide_steps)
    return RemovedMaterial(amount + found[0], found[1], found[2])


def _slide(sided_terms: Sequence[Sided], place: Place, nodes: tuple[Node, ...], steps: int) -> tuple[Real, Real, Real]:
    """Amount [um], shift [mm] and relative curvature of `RemovedMaterial`, of the shape that the terms have."""
    bulge, shift = 1e3 / place.radius, jnp.zeros_like(place.radius)
    moved = shift
    if steps:
        shift = stored(_rest(_near_rest(sided_terms, place, steps), sided_terms, place))
        moved = _moved(shift, place)
    seen = probe(sided_terms, place, moved, nodes)
    amount = 0.5 * bulge * ((moved - place.beyond) ** 2 - place.beyond**2) + seen.mean
    return amount, shift, seen.curvature / bulge


def _moved(shift: Real, place: Place) -> Real:
    """Place of a contact on its flank [mm], which no corner passes."""
    return _within(place.beyond + shift, place.lowest, place.highest)


def _slope(shift: Real, sided_terms: Sequence[Sided], place: Place) -> Real:
    """Slope of bulge and removed material together [um/mm]; zero where the contact is at rest."""
    return 1e3 / place.radius * shift + secant_slope(sided_terms, place, _moved(shift, place))


class _Near(NamedTuple):
    """A shift near that of the least gap, between which it lies [mm], and the curvature there [um/mm^2]."""

    shift: Real
    low: Real
    high: Real
    curvature: Real


def _near_rest(sided_terms: Sequence[Sided], place: Place, steps: int) -> _Near:
    """Where the gap is about least, by a search in single precision, without derivatives.

    A parabola leads from try to try, at first that of the bulge. Between tries with slopes of either sign its curvature
    is at least what both tell, of an end that stays a second time with half its slope (Illinois; M. Dowell, P. Jarratt,
    BIT 11, 1971).
    """

    def single(leaf: Any) -> Any:
        return jax.lax.stop_gradient(leaf).astype("float32") if eqx.is_inexact_array(leaf) else leaf

    terms, at = jax.tree.map(single, (list(sided_terms), place))
    bulge = 1e3 / at.radius
    shift = jnp.zeros(jax.eval_shape(lambda: _slope(at.radius, terms, at)).shape, "float32")

    def try_again(_: int, state: tuple[Real, _Tried, _Tried, Mask]) -> tuple[Real, _Tried, _Tried, Mask]:
        shift, below, above, fell = state
        slope = stored(_slope(shift, terms, at))
        falls = slope < 0
        here, other = _Tried(shift, slope), _chosen(falls, above, below)
        other = _Tried(other.shift, jnp.where(falls == fell, 0.5 * other.slope, other.slope))
        apart = shift - other.shift
        across = (slope - other.slope) / jnp.where(apart != 0, apart, 1.0)
        shift = stored(shift - slope / jnp.where((other.slope != 0) & (across > bulge), across, bulge))
        return shift, _chosen(falls, here, other), _chosen(falls, other, here), falls

    nothing = _Tried(shift, shift)
    # a loop is compiled once
    shift, below, above, _ = jax.lax.fori_loop(0, steps, try_again, (shift, nothing, nothing, shift < 0))
    found = (shift, *_either(below, above), _curvature(shift, terms, at))
    return _Near(*(each.astype(place.radius.dtype) for each in found))


class _Tried(NamedTuple):
    """A shift that was tried [mm] and the slope there [um/mm]; zeros before there is one."""

    shift: Real
    slope: Real


def _either(below: _Tried, above: _Tried) -> tuple[Real, Real]:
    """Between which shifts the slope changes its sign [mm], where both have been seen."""
    both = (below.slope != 0) & (above.slope != 0)
    low, high = jnp.minimum(below.shift, above.shift) - _SLACK, jnp.maximum(below.shift, above.shift) + _SLACK
    return jnp.where(both, low, -jnp.inf), jnp.where(both, high, jnp.inf)


def _chosen(first: Mask, one: _Tried, other: _Tried) -> _Tried:
    return jax.tree.map(partial(jnp.where, first), one, other)


@eqx.filter_custom_jvp
def _rest(near: _Near, sided_terms: Sequence[Sided], place: Place) -> Real:
    """Shift of the least gap [mm]: the slope is zero there, by a step of Newton's method."""
    return _within(near.shift - _slope(near.shift, sided_terms, place) / near.curvature, near.low, near.high)


@_rest.def_jvp
def _rest_jvp(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Real, Real]:
    """The slope stays zero (implicit function theorem); nothing follows from where the search has ended."""
    shift, (_, *given), (_, *given_dot) = _rest(*primals), primals, tangents
    _, slope_dot = jvp_of_given(lambda given: _slope(shift, *given), given, given_dot)
    return shift, -slope_dot / stored(_curvature(shift, *given))


def _curvature(shift: Real, sided_terms: Sequence[Sided], place: Place) -> Real:
    """By how much the slope rises [um/mm^2] where that leads to a least gap, else that of the bulge."""
    _, rise = jax.jvp(lambda shift: _slope(shift, sided_terms, place), (shift,), (jnp.ones_like(shift),))
    bulge = 1e3 / place.radius
    return jnp.where(rise > _LEAST_CURVATURE * bulge, rise, bulge)


def _within(x: Real, low: Real, high: Real) -> Real:
    # no nested maxima: the derivative of a tie is a division
    return jnp.where(x < low, low, jnp.where(x > high, high, x))


# Largest relative violation of the contact conditions at which loads still tell how wide the contacts are.
_WIDTHS_KNOWN = 1e-4

Curve = Float[Array, " positions"]


def loaded_material(
    mesh: Mesh,
    torque: Scalar,
    pinion: AbstractModification,
    wheel: AbstractModification,
    first_contact: Callable[[RemovedMaterial], tuple[Load, Curve]],
    own: Own | None = None,
) -> RemovedMaterial:
    """Material removed, over contacts as wide as the compliance asks for; its arguments in the precision of the mesh.

    Args:
        mesh: prepared mesh.
        torque: on the pinion [N m].
        pinion, wheel: modifications.
        first_contact: line loads [N/mm] and residual of the contact on material that has been removed.
        own: further modifications of every pair, see `slid_material`.
    """
    if own is None and isinstance(pinion, NoModification) and isinstance(wheel, NoModification):
        return nothing_removed(mesh.resolution, torque.dtype)
    sizes = mesh.resolution
    prepared = _unlabelled(mesh, sizes.of_material)
    if not mesh.compliance.averages_over_loaded_width:
        return slid_material(prepared, torque, pinion, wheel, own=own)
    line_load = _full_load(mesh.pair, torque, (sizes.chosen_pairs, sizes.slices, sizes.positions))
    line_load, residual = first_contact(slid_material(prepared, torque, pinion, wheel, line_load, own))
    # once: what the loads of a second solution change is below the error of the model
    removed = slid_material(prepared, torque, pinion, wheel, line_load, own)
    known = _where_known(removed.amount, residual, max(_WIDTHS_KNOWN, sizes.rtol or 0.0))
    return RemovedMaterial(known, removed.shift, removed.relative_curvature)


@program
def _full_load(pair: GearPair, torque: Scalar, shape: tuple[int, ...]) -> Load:
    """Line load of one pair that carries all of it [N/mm]."""
    return jnp.broadcast_to(1e3 * torque / (pair.pinion.base_radius * pair.face_width), shape)


@program
def _where_known(amount: Load, residual: Curve, largest: float) -> Load:
    """Material removed where the loads are known, else NaN; written so that NaN counts as not known."""
    return jnp.where(residual < largest, amount, jnp.nan)


def for_contact(mesh: Mesh) -> Mesh:
    """The mesh for programs that solve its contact for material that is known."""
    return _unlabelled(mesh, mesh.resolution.of_contact)


def _unlabelled(mesh: Mesh, resolution: Resolution) -> Mesh:
    """The mesh for programs that read its prepared arrays alone: one serves all whose arrays are of the same shapes.

    It is without its own models, of sizes that the program asks for, and its pair is of the gears of its sides, for
    which it makes no difference which diameters were given.
    """
    pinion, wheel = (side.gear for side in mesh.sides)
    pair = changed(mesh.pair, pinion=pinion, wheel=wheel)
    own = {"compliance": default_compliance(), "support": None, "automatic": False, "even": False}
    return changed(mesh, kinematics=changed(mesh.kinematics, pair=pair, resolution=resolution), **own)
