"""Where loaded flanks touch on a modification, and over which width it is averaged.

Two flanks of relative radius R, from which material c has been removed, touch where bulge and removed material together
are least: over the distance u along the flank from the nominal contact

    e = min over u of [ ((u - o)^2 - o^2) / (2 R) + mean c(u) ],

the mean taken over the contact with the weight of the Hertzian pressure. Beyond the path of contact a tip corner
touches, o away from the virtual centre of the contact; there, and before the corner on the path, neither u nor a point
of the contact can pass the corner. A slope s moves the virtual centre by -R s and lets the gap fall by R s^2 / 2.

The contact rests where the slope of bulge and removed material together is zero. The slope is that of a secant over
four fifths of the contact, which is that of the mean but for hundredths. Next to a corner it is over the part of the
contact that the corner leaves, with which every convex relief has one place of rest; the gap there is above the least
one, by up to 0.08 um on usual reliefs and 0.4 um on one of 15 um over 1 mm. A search finds the place to rounding, and
derivatives of any order follow from what stays zero (implicit function theorem). Random tables that jump by several um
from millimetre to millimetre hold several such places: the one that is found is 0.04 um above the least gap in the mean
and 3 um at worst (0 to 8 um every 0.5 mm), and one contact in 16,000 is not found in 20 steps, with a derivative that
is near. Points across the contact give mean and curvature of c, the latter by least squares with the weight of the
pressure, which kinks and corners of a table do not upset; where points stop at a corner, c seems hollow, and pressures
there are those of corners. Against a fine search with more points the gap is off by 0.01 um on reliefs and crowning,
0.03 um on a root relief of 8 um over 1.5 mm (19/48, module 3, 50 N m).

A contact is as wide as its load makes it. The share of the load by which the width goes is that of unmodified flanks:
all of it where a pair is alone, a third of it at the ends of the path. With a compliance that averages over the loaded
width, as that by finite elements, it is that of every contact's own load, from a first solution with the former.
"""

from collections.abc import Callable, Sequence
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..compliance import default_compliance
from ..microgeometry import AbstractModification, NoModification
from ..numerics import Checked, Numbers, at_root, changed, program, real, result, rising_root
from .contact_width import (
    Node,
    Place,
    Sided,
    contact_nodes,
    flank_at,
    place_of,
    probe,
    terms_of,
    usual_load,
    varies_along_profile,
    within,
)
from .mesh import Mesh
from .resolution import Resolution

Scalar = Float[Array, ""]
Load = Float[Array, "pairs slices positions"]
Field = Float[Array, "pairs #slices positions"]
Real = Float[Array, "..."]
Own = tuple[AbstractModification, AbstractModification]


class RemovedMaterial(Checked):
    """Material removed from both flanks as the contacts meet it; adding a field adds to the amount.

    Attributes:
        amount: gap minus that of the unmodified flanks [um], shape (pairs, slices, positions).
        shift: shift of the centre of contact along the flanks, positive towards the pinion tip [mm], shape (pairs,
            slices or 1, positions).
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
    """Removed material of nominal involutes: zero."""
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
    """Removed material at the resting contacts; the arguments are in the precision of the mesh.

    The contacts are as wide as their line loads make them [N/mm]; by default as those of unmodified flanks.
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
    slid, curvature, *shift = _slide(along, place, contact_nodes(sizes.contact_nodes), sizes.chosen_slide_steps)
    return RemovedMaterial(amount + slid, shift[0] if shift else jnp.zeros_like(curvature), curvature)


def _slide(sided_terms: Sequence[Sided], place: Place, nodes: tuple[Node, ...], steps: int) -> tuple[Real, ...]:
    """Amount [um], relative curvature and, of a contact that slides, shift [mm] of `RemovedMaterial`, of the shape that
    the terms have."""
    if steps:
        return at_root(_met, partial(_at_rest, steps=steps), sided_terms, place, nodes)
    seen = probe(sided_terms, place, jnp.zeros_like(place.radius), nodes)
    return seen.mean, seen.curvature * _give(place)


def _met(shift: Real, sided_terms: Sequence[Sided], place: Place, nodes: tuple[Node, ...]) -> tuple[Real, Real, Real]:
    """Amount [um] and relative curvature at a contact with a shift [mm], and its residual of the rest condition [mm].

    At rest the slope of bulge and removed material together is zero.
    """
    give, moved = _give(place), within(place.beyond + shift, place.lowest, place.highest)
    seen = probe(sided_terms, place, moved, nodes)
    amount = 0.5 * ((moved - place.beyond) ** 2 - place.beyond**2) / give + seen.mean
    return amount, seen.curvature * give, shift + seen.slope * give


def _give(place: Place) -> Real:
    """Way that a contact moves by a slope [mm per um/mm]."""
    return 1e-3 * place.radius


# Step below which the search for the place of rest ends [mm]; what is left is far below.
_LAST_STEP = {jnp.dtype(jnp.float32): 1e-6, jnp.dtype(jnp.float64): 1e-9}


def _at_rest(sided_terms: Sequence[Sided], place: Place, nodes: tuple[Node, ...], *, steps: int) -> Real:
    """Shift of a contact at rest [mm], which the ends of the secant decide."""
    ends = tuple(node for node in nodes if node.ends)

    def missing(shift: Real) -> Real:
        return _met(shift, sided_terms, place, ends)[-1]

    start = jax.tree.map(jnp.zeros_like, jax.eval_shape(missing, place.radius))
    return rising_root(missing, start, most=steps, within=_LAST_STEP[start.dtype])


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
        torque: torque on the pinion [N m].
        pinion, wheel: modifications.
        first_contact: function that gives line loads [N/mm] and residual of the contact for a removed material.
        own: further modifications of every pair, see `slid_material`.
    """
    if own is None and isinstance(pinion, NoModification) and isinstance(wheel, NoModification):
        return nothing_removed(mesh.resolution, torque.dtype)
    sizes = mesh.resolution
    prepared = _unlabelled(mesh, sizes.of_material)
    first = slid_material(prepared, torque, pinion, wheel, _usual_load(prepared, torque), own)
    if not mesh.compliance.averages_over_loaded_width:
        return first
    line_load, residual = first_contact(first)
    # once: what the loads of a second solution change is below the error of the model
    removed = slid_material(prepared, torque, pinion, wheel, line_load, own)
    known = _where_known(removed.amount, residual, max(_WIDTHS_KNOWN, sizes.rtol or 0.0))
    return RemovedMaterial(known, removed.shift, removed.relative_curvature)


# by a program of its own: that of the removed material then is the same with the loads of a first solution
_usual_load = program(usual_load)


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
