"""A prepared mesh: everything that depends neither on the modification nor on the torque."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypedDict, TypeVar, Unpack

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..compliance import AbstractCompliance, default_compliance
from ..compliance.hertz import ContactGeometry, contact_geometry
from ..compliance.plane import Plane, contact_plane
from ..compliance.tooth import ToothLoad, tooth_load
from ..geometry import GearPair, Margins, Outline, PathOfContact, explicit, pair_geometry
from ..geometry.pair import PairGeometry
from ..microgeometry import Flank
from ..numerics import AbstractSpring, Given, SliceCoupling, changed, on_both, program
from ..numerics.programs import begin
from .covering import check_cover, closing, helical_slices, pairs_alternate, pairs_for
from .face_coupling import (
    Spreading,
    check_modes,
    check_support,
    coupling_of,
    ends_together,
    slices_alike,
    spreading_of,
)
from .kinematics import Contacts, Kinematics, Side, contacts, kinematics, sides
from .resolution import Resolution
from .status import Status, Statuses, status_of
from .support import AbstractSupport


# Programs of their own, so that little is compiled twice: `pair_geometry` is the same for all numbers of positions and
# slices, and the places of the contacts for all compliances.
@program
def _for_gears(compliance: AbstractCompliance, outlines: tuple[Outline, Outline], count: int) -> AbstractCompliance:
    """The compliance for these gears alone; `count` tooth pairs are carried along."""
    return compliance.of_gears(*outlines, count)


Scalar = Float[Array, ""]
Field = Float[Array, "pairs #slices positions"]  # one slice where all are at the same phase


class Mesh(eqx.Module):
    """A gear pair prepared for contact analysis; made by `prepare`.

    What is the same in all slices has one for all; of helical gears every slice of the face is at its own phase.

    Attributes:
        kinematics: the pair, its path of contact and the array sizes, which the results keep.
        compliance: the compliance model.
        sides: both gears' sides of every contact.
        corner_gap: gap of the unmodified flanks outside the path of contact [um], shape (pairs, 1 or slices,
            positions).
        lever: closing of a pair per unit of transmission error; 1 on the path of contact, less beyond it, because the
            corner's gap opens while the gears turn on.
        margins: distances of the pair from gears that cannot run; the only sign of it where the gears are traced.
        outer_gap: transmission error at which the pairs behind and ahead of those carried along touch if they are not
            modified [um], shape (2, 1 or slices, positions).
        outer_lever: lever of these outer pairs, of the same shape.
        outer_roll_length: of these outer pairs, of the one behind on the pinion and of the one ahead on the wheel [mm],
            of the same shape.
        structure: compliance of both gears under a load that is uniform over the common face, the mean over that face,
            (pairs, pairs, 1, positions) [um per N/mm]; of helical gears whose slices are not coupled that of every
            slice.
        law: prepared contact law.
        width_factor: squared half width of the contact per line load [mm^2 per N/mm].
        hub: common wind-up of the gear bodies, each over its own face, under a line load over the common one [um per
            N/mm].
        slice_width: width of the slices [mm], shape (slices,).
        coupling: elastic coupling of the slices; None where they are not coupled.
        support: shafts, bearings and housing; None for rigid, parallel shafts.
        support_gap: gap between the flanks by the support without the force of this mesh [um], shape (slices,); None
            without a support.
        support_torque: torque at which the support holds [N m]; None where it does at every torque.
        support_status: whether the support is possible; None without a support.
        automatic: True if the number of pairs was left to `prepare`: `solve` takes more where they are too few.
        even: True if neither gear is known to help beyond the common face: both end together, or the model is one of
            two dimensions.
        alternates: True if at most one of the even and one of the odd pairs can touch in any slice, see
            `pairs_alternate`: slices of helical gears then have two springs each, however many pairs touch over the
            face.
    """

    kinematics: Kinematics
    compliance: AbstractCompliance
    sides: tuple[Side, Side]
    corner_gap: Field
    lever: Field
    margins: Margins
    outer_gap: Float[Array, "2 #slices positions"]
    outer_lever: Float[Array, "2 #slices positions"]
    outer_roll_length: Float[Array, "2 #slices positions"]
    structure: Float[Array, "pairs pairs #slices positions"]
    law: AbstractSpring
    width_factor: Field
    hub: Scalar
    slice_width: Float[Array, " slices"]
    coupling: SliceCoupling | None = None
    support: AbstractSupport | None = None
    support_gap: Float[Array, " slices"] | None = None
    support_torque: Scalar | None = None
    support_status: Statuses | None = None
    automatic: bool = eqx.field(static=True, default=False)
    even: bool = eqx.field(static=True, default=False)
    alternates: bool = eqx.field(static=True, default=False)

    def __repr__(self) -> str:
        return f"Mesh(pair={self.pair!r}, resolution={self.resolution!r})"

    @property
    def pair(self) -> GearPair:
        """The gear pair."""
        return self.kinematics.pair

    @property
    def status(self) -> Statuses:
        """Whether such gears can run and such a support is possible, shape (); only traced ones may fail to."""
        parts = () if self.support_status is None else (self.support_status,)
        return status_of({Status.GEARS_CANNOT_RUN: ~self.margins.valid}, *parts)

    @property
    def path_of_contact(self) -> PathOfContact:
        """Points A to E."""
        return self.kinematics.path_of_contact

    @property
    def resolution(self) -> Resolution:
        """Array sizes."""
        return self.kinematics.resolution

    @property
    def phase(self) -> Float[Array, " positions"]:
        """Mesh positions in base pitches, shape (positions,)."""
        return self.kinematics.phase

    @property
    def path(self) -> Field:
        """Nominal path position of every contact [mm], shape (pairs, 1 or slices, positions)."""
        return self.kinematics.path

    @property
    def outside(self) -> Field:
        """Distance of every contact outside the path of contact [mm], zero on it, of the shape of `path`."""
        return self.kinematics.outside

    @property
    def face_coordinate(self) -> Float[Array, " slices"]:
        """Middle of every slice, from the middle of the common face [mm], shape (slices,)."""
        return self.kinematics.face_coordinate

    @property
    def own_structure(self) -> Float[Array, "pairs pairs #slices positions"]:
        """Compliance of every slice on its own [um per N/mm]."""
        return self.structure if self.coupling is None else self.coupling.local(len(self.structure))

    @property
    def leans(self) -> bool:
        """Whether what moves all slices alike is the tilt of helical bodies alone, on rigid, parallel shafts."""
        return self.coupling is not None and self.kinematics.helical and self.support_gap is None

    def held(self, gap: Float[Array, "pairs slices positions"]) -> Float[Array, "pairs slices positions"]:
        """A gap of the flanks [um] with the gap of the support."""
        return gap if self.support_gap is None else gap + self.lever * self.support_gap[None, :, None]

    def support_deflection(self, line_load: Float[Array, "pairs slices positions"]) -> Float[Array, " positions"]:
        """Transmission error by deflection of shafts and tilt of the bodies, alike for all pairs [um].

        Args:
            line_load: of all pairs [N/mm].
        """
        if self.coupling is None:
            return jnp.zeros_like(line_load[0, 0])
        bent = self.coupling.support_deflection(self.slice_width, self.lever, list(line_load))
        return jnp.zeros_like(line_load[0, 0]) if bent is None else jnp.min(bent, axis=0)

    def flanks(self, offset: Given = 0.0) -> tuple[Flank, Flank]:
        """Points of pinion and wheel that face each other at a distance from the centre of contact.

        Args:
            offset: distance along the flanks, towards the pinion tip [mm], scalar or of the shape of `path`.

        Returns:
            points whose fields broadcast to (pairs, slices, positions).
        """
        pinion, wheel = self.sides
        return self._flank(pinion, offset), self._flank(wheel, -offset)

    def _flank(self, side: Side, offset: Given) -> Flank:
        rho = side.contact_roll_length
        # arc length of an involute: ds = rho / r_b d rho
        moved = side.gear.signed(jnp.maximum(side.gear.signed(rho + offset * side.base_radius / rho), 0.0))
        return side.flank(moved, (self.face_coordinate + side.face_middle)[None, :, None])


def prepare(
    pair: GearPair,
    *,
    compliance: AbstractCompliance | None = None,
    resolution: Resolution | None = None,
    deflection: float | None = None,
    support: AbstractSupport | None = None,
) -> Mesh:
    """Prepare a gear pair for `solve` over one base pitch: points of contact, gaps of the tip corners, compliances.

    The mesh holds all that depends neither on the torque nor on the modifications; it is made once and shared by any
    number of them. It is differentiable with respect to every number of pair, compliance and support.

    Args:
        pair: gear pair, concrete or traced.
        compliance: compliance model; None for `default_compliance()`.
        resolution: array sizes; None for `Resolution()`. Helical gears, which one slice cannot show, take
            `helical_slices` where it has one.
        deflection: transmission error up to which the number of tooth pairs is chosen [um], shape (); it counts where
            `resolution.pairs` is None. None for 16 um per mm of module, at which root stresses are beyond 1000 MPa.
            Traced gears take four pairs whatever it is.
        support: deflection of shafts, bearings and housing, or misalignment, as `support` of a gearbox gives it; None
            for rigid, parallel shafts. It needs coupled slices and takes `resolution.face_modes` polynomials over the
            face. The support of a gearbox is linearized at one torque, and `solve` refuses another one. Transmission
            error and stiffness contain the deflection of the support.

    Returns:
        the mesh.

    Raises:
        ValueError: when the path of contact is longer than the pairs of the resolution can cover, or the compliance is
            a table of other gears; for a support of other gears, or on a mesh whose slices are not coupled.
    """
    compliance = default_compliance() if compliance is None else compliance
    compliance.check(pair)
    resolution = Resolution() if resolution is None else resolution
    if resolution.slices == 1:
        resolution = replace(resolution, slices=helical_slices(pair))
    automatic = resolution.pairs is None
    if automatic:
        resolution = replace(resolution, pairs=pairs_for(explicit(pair), deflection))
    check_support(support, pair, resolution)
    first = np.asarray(resolution.first_phase)
    mesh = prepare_from(first, pair, compliance, resolution, support, ends_together(pair, compliance))
    check_cover(mesh.pair, mesh.path_of_contact, resolution)
    check_modes(support, resolution)
    return replace(mesh, automatic=automatic, alternates=pairs_alternate(explicit(pair), resolution, deflection))


def prepare_from(
    first_phase: Given,
    pair: GearPair,
    compliance: AbstractCompliance,
    resolution: Resolution,
    support: AbstractSupport | None,
    even: bool,
) -> Mesh:
    """The mesh over the base pitch that begins with a mesh position [base pitches]; `even` as of the mesh."""
    return _prepared(_run, first_phase, pair, compliance, resolution, support, even)


def begin_mesh(
    pair: GearPair,
    compliance: AbstractCompliance,
    resolution: Resolution,
    support: AbstractSupport | None,
    even: bool,
) -> Mesh | None:
    """Starts to compile what `prepare` runs; gives the mesh of shapes that it will make, see `begin`."""
    return _prepared(begin, np.zeros(()), pair, compliance, resolution, support, even)


def _run(function: Callable[..., Any], *args: Any) -> Any:
    return function(*args)


# Positions that the programs prepare at once, of meshes with a multiple of them: finer meshes then compile nothing.
_AT_ONCE = 64


def _prepared(
    run: Callable[..., Any],
    first_phase: Given,
    pair: GearPair,
    compliance: AbstractCompliance,
    resolution: Resolution,
    support: AbstractSupport | None,
    even: bool,
) -> Any:
    """`prepare_from` by programs that `run` runs or begins; None where it begins nothing."""
    given = explicit(pair)
    gears = run(pair_geometry, given)
    if gears is None:
        return None
    known = run(_for_gears, compliance, gears.outlines, resolution.chosen_pairs)
    count, left = divmod(resolution.positions, _AT_ONCE)
    traced = any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves((first_phase, given, known, support)))
    if left or traced:
        count = 1
    sizes = changed(resolution.of_arrays, positions=resolution.positions // count)
    made = []
    for number in range(count):
        first = first_phase + number / resolution.positions if number else first_phase
        places = run(_places_of, first, given, gears, sizes, contact_plane(compliance.plane), even)
        made.append(run(_arrays_of, places, gears.margins, known, support, even))
    mesh = made[0]
    if count > 1:
        mesh = eqx.tree_at(_by_position, mesh, run(_joined, [_by_position(part) for part in made]))
    # what the programs leave out, so as to serve many
    return changed(mesh, kinematics=changed(mesh.kinematics, pair=pair, resolution=resolution), compliance=compliance)


class _Places(eqx.Module):
    """All of a mesh that does not depend on its compliance.

    Attributes:
        kinematics, sides: as of the mesh.
        points, outer: contacts of the pairs carried along, and of those behind and ahead of them.
        loads: on pinion and wheel, fields of shape (pairs, positions), those of all slices in a row.
        contact: flanks at the contacts.
        spreading: of loads over the face.
    """

    kinematics: Kinematics
    sides: tuple[Side, Side]
    points: Contacts
    outer: Contacts
    loads: tuple[ToothLoad, ToothLoad]
    contact: ContactGeometry
    spreading: Spreading


@program
def _places_of(
    first_phase: Any,
    pair: GearPair,
    gears: PairGeometry,
    resolution: Resolution,
    plane: Plane,
    even: bool,
) -> _Places:
    """The places of an `explicit` pair in the sizes `of_arrays`; `plane` is that of the contact."""
    outlines, path = gears.outlines, gears.path_of_contact
    moving = kinematics(pair, first_phase, resolution, plane, path)
    points = contacts(pair, path, moving.path, resolution.extended_contact)
    # what compliances know of are pairs at positions: those of all slices
    rolls = [at.reshape(len(at), -1) for at in (points.pinion_roll_length, points.wheel_roll_length)]
    pinion, wheel = on_both(lambda given: tooth_load(*given), *zip(outlines, rolls))
    beyond = jnp.stack([moving.path[-1] - path.base_pitch, moving.path[0] + path.base_pitch])
    outer = contacts(pair, path, beyond, resolution.extended_contact)
    return _Places(
        kinematics=moving,
        sides=sides(pair, path, points.pinion_roll_length, points.wheel_roll_length),
        points=points,
        outer=outer,
        loads=(pinion, wheel),
        contact=contact_geometry(pinion, wheel, plane, pair.face_width),
        spreading=spreading_of(pair, outlines, resolution, even),
    )


@program
def _arrays_of(
    places: _Places, margins: Margins, compliance: AbstractCompliance, support: AbstractSupport | None, even: bool
) -> Mesh:
    """The mesh at its places, of a compliance for its gears."""
    moving, points, (pinion, wheel) = places.kinematics, places.points, places.loads
    law = compliance.law(places.contact, pinion, wheel, points.beyond_tip.reshape(pinion.roll_length.shape))
    structures = places.spreading.shares[:, None, None, None] * compliance.structure(pinion, wheel)
    shape, scale = moving.path.shape, None
    structures = structures.reshape(*structures.shape[:-1], *shape[1:])
    if moving.helical and moving.resolution.is_coupled:
        structures, scale = slices_alike(structures)
    hubs = compliance.hub(pinion, wheel)
    if not even:
        pair = moving.pair
        hubs = hubs * (pair.face_width / jnp.stack([gear.face_width for gear in pair.gears]))
    slopes = compliance.slope(pinion, wheel)
    return Mesh(
        kinematics=moving,
        compliance=compliance,
        sides=places.sides,
        corner_gap=points.corner_gap,
        lever=points.lever,
        margins=margins,
        outer_gap=closing(places.outer),
        outer_lever=places.outer.lever,
        outer_roll_length=jnp.stack([places.outer.pinion_roll_length[0], places.outer.wheel_roll_length[1]]),
        structure=structures[0] + structures[1],
        law=jax.tree.map(lambda leaf: leaf.reshape(shape), law),
        width_factor=places.contact.width_factor.reshape(shape),
        hub=jnp.sum(hubs),
        slice_width=moving.slice_width,
        coupling=coupling_of(moving, places.spreading, structures, scale, support, slopes),
        support=support,
        support_gap=None if support is None else support.gap(moving.face_coordinate).astype(moving.slice_width.dtype),
        support_torque=None if support is None else support.torque,
        support_status=None if support is None else support.status,
        even=even,
    )


class Sizes(TypedDict, total=False):
    """Array sizes that `resized` may change."""

    positions: int
    slices: int
    pairs: int


def resized(mesh: Mesh, **sizes: Unpack[Sizes]) -> Mesh:
    """The mesh in other array sizes, with its number of pairs fixed or open as before."""
    wanted = replace(mesh.resolution, **sizes)
    if wanted == mesh.resolution:
        return mesh
    made = prepare_from(mesh.kinematics.first_phase, mesh.pair, mesh.compliance, wanted, mesh.support, mesh.even)
    return replace(made, automatic=mesh.automatic, alternates=mesh.alternates and "pairs" not in sizes)


def half_way(mesh: Mesh) -> Mesh:
    """The mesh at positions half a step later: both meshes together have twice the positions."""
    return later(mesh, 0.5)


def later(mesh: Mesh, share: float) -> Mesh:
    """The mesh at positions later by a share of the step between two."""
    first = np.asarray(mesh.kinematics.first_phase) + share / mesh.resolution.positions
    moved = prepare_from(first, mesh.pair, mesh.compliance, mesh.resolution, mesh.support, mesh.even)
    return replace(moved, automatic=mesh.automatic, alternates=mesh.alternates)


_GROUP = 3  # slices, that of the middle one of which can stand for all of them
# Part of what a third of the slices changes that is taken as the error of all. Of an error of second order an eighth is
# left; contacts set in more abruptly.
_LEFT = 0.25


Value = TypeVar("Value", float, np.ndarray)


def fewer_slices(mesh: Mesh) -> Mesh | None:
    """The mesh of helical gears with every three slices at the phase of their middle, in arrays of the same shapes.

    What that changes tells the error of the slices without another program, see `slices_left`. None for spur gears, all
    slices of which are at one phase.
    """
    if not mesh.kinematics.helical:
        return None
    count = mesh.resolution.slices
    middles = np.minimum(np.arange(count) // _GROUP * _GROUP + _GROUP // 2, count - 1)
    return eqx.tree_at(_by_slice, mesh, jax.tree.map(lambda leaf: leaf[..., middles, :], _by_slice(mesh)))


def slices_left(value: Value, of_fewer: Value) -> Value:
    """Estimate of what slices without end would add to a value, from that of `fewer_slices`."""
    return _LEFT * (value - of_fewer)


def parts(mesh: Mesh, positions: int) -> list[Mesh]:
    """Meshes of so many positions each, evenly over the base pitch, that together have those of a concrete mesh.

    The mesh itself where it has no multiple of so many.
    """
    count, left = divmod(mesh.resolution.positions, positions)
    if left or count == 1:
        return [mesh]
    return [_part(np.asarray(first), count, mesh) for first in range(count)]


def at_position(mesh: Mesh, place: Array) -> Mesh:
    """The mesh of the position of this number alone."""
    return _part(place, mesh.resolution.positions, mesh)


@program
def _part(first: Array | np.ndarray, count: int, mesh: Mesh) -> Mesh:
    """Every so many positions from the first one on."""

    def take(leaf: Array) -> Array:
        rows = leaf.reshape(*leaf.shape[:-1], -1, count)
        return jax.lax.dynamic_index_in_dim(rows, first, axis=-1, keepdims=False)

    moving = mesh.kinematics
    positions = moving.resolution.positions
    taken = jax.tree.map(take, _by_position(mesh))
    phase = moving.first_phase + first.astype(moving.first_phase.dtype) / positions
    resolution = changed(moving.resolution, positions=positions // count)
    moved = replace(moving, first_phase=phase, resolution=resolution)
    return eqx.tree_at(lambda m: [*_by_position(m), m.kinematics], mesh, [*taken, moved])


@program
def _joined(parts: list[list[Array | AbstractSpring]]) -> list[Array | AbstractSpring]:
    """`_by_position` of all positions of some meshes, each a little later than the one before; undoes `_part`."""

    def join(*leaves: Array) -> Array:
        return jnp.stack(leaves, axis=-1).reshape(*leaves[0].shape[:-1], -1)

    return jax.tree.map(join, *parts)


def _by_position(mesh: Mesh) -> list[Array | AbstractSpring]:
    """Everything whose last axis is that of the positions."""
    coupled: list[Array] = []
    if mesh.coupling is not None:
        coupled = [body.compliance for body in mesh.coupling.bodies]
        coupled += [] if mesh.coupling.scale is None else [mesh.coupling.scale]
    return [*_by_contact(mesh), mesh.structure, *coupled]


def _by_slice(mesh: Mesh) -> list[Array | AbstractSpring]:
    """Everything of helical gears whose last axes are those of slices and positions."""
    scale = mesh.structure if mesh.coupling is None else mesh.coupling.scale
    assert scale is not None  # slices of helical gears have one
    return [*_by_contact(mesh), scale]


def _by_contact(mesh: Mesh) -> list[Array | AbstractSpring]:
    return [
        mesh.outer_gap,
        mesh.outer_lever,
        mesh.outer_roll_length,
        mesh.corner_gap,
        mesh.lever,
        mesh.law,
        mesh.width_factor,
        *(side.contact_roll_length for side in mesh.sides),
    ]
