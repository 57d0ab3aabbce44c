"""Contacts over one base pitch: positions of the tooth pairs, both gears' sides of every contact, tip corners.

A pair that is a distance x outside the path of contact touches with the tip corner of one gear on the flank of the
other. With the corner's gear in its nominal position, the gap is the arc of the mate's base circle by which the mate
has to turn until its involute passes through the corner. In the frame of the line of action this is a closed form: no
root, no table.

    Q = corner, at (du, dv) from the end of the path,  rho_Q = tangent length from Q to the mate's base circle,
    S = x + rho_Q - rho_mate + r_b,mate tau,  tau = turn of that tangent away from the line of action.

To second order S = x^2 rho_tip C / (2 rho_mate r_b,tip^2) with C = rho_tip + rho_mate, so the gap joins the path with
zero slope. Of a ring gear, roll lengths and base radii are negative, and so is rho_Q where it is the mate. All
differences are formed without cancellation, so single precision keeps 1e-4 um where contact is possible.

Where the path ends at the form circle of an undercut tooth, there is no involute for the mate's tip corner to touch.
Beyond that end it is the edge of the undercut that touches the mate's flank: the same closed form with the roles of the
gears exchanged and the corner on its way towards the end of the path instead of from it (x < 0). It ends where the edge
passes the mate's tip: the gap then opens as around the rounded tip edge.

References:
    The geometry is that of R. G. Munro, L. Morrish, D. Palmer, Proc. IMechE C 213 (1999) 389-400; the closed form here
    is derived from the involute's generation.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..compliance import Plane
from ..geometry import Gear, GearPair, PathOfContact, explicit, path_of_contact
from ..microgeometry import Flank
from ..numerics import Checked, changed, concrete, on_both, over_batch, program, real, result
from .resolution import Resolution

Real = Float[Array, "..."]

# Beyond this many base pitches outside the path the gap is hundreds of um; it goes on along its tangent there. Tips of
# a planet stay close to the flank of a ring gear with few teeth more; with many more, so far out, they swing back.
REACH, _CLOSE_REACH, _CLOSE_TEETH = 0.4, 1.5, 15.0


def corner_gap(
    x: Real, tip_roll_length: Real, tip_base_radius: Real, mate_roll_length: Real, mate_base_radius: Real
) -> tuple[Real, Real]:
    """Gap and contact point of a tip corner outside the path of contact.

    Args:
        x: distance outside the path along the line of action [mm], not negative.
        tip_roll_length: roll length of the corner on its gear [mm]; this and what follows one number, or one for every
            x.
        tip_base_radius: base radius of that gear [mm].
        mate_roll_length: roll length of the mate at the end of the path [mm].
        mate_base_radius: base radius of the mate [mm].

    Returns:
        the gap [um] and the roll length of the touched point of the mate [mm].
    """
    angle = x / tip_base_radius
    sine, versine = jnp.sin(angle), 2 * jnp.sin(0.5 * angle) ** 2
    du = versine * tip_roll_length - sine * tip_base_radius
    dv = sine * tip_roll_length + versine * tip_base_radius
    # squared tangent length from the corner to the mate's base circle, minus its value at the end of the path
    change = (2 * mate_roll_length + du) * du + (2 * mate_base_radius + dv) * dv
    floor = (1e-3 * mate_base_radius) ** 2
    squared = jnp.maximum(mate_roll_length**2 + change, floor)
    tangent = jnp.copysign(jnp.sqrt(squared), mate_base_radius)
    growth = (squared - mate_roll_length**2) / (tangent + mate_roll_length)
    cross = mate_base_radius * (du - growth) - dv * tangent
    dot = (mate_roll_length + du) * tangent + (mate_base_radius + dv) * mate_base_radius
    gap = x + growth + mate_base_radius * jnp.arctan2(cross, dot)
    return 1e3 * gap, tangent


Scalar = Float[Array, ""]
Field = Float[Array, "pairs #slices positions"]  # one slice where all are at the same phase


class Side(Checked):
    """One gear's side of the contact.

    Attributes:
        gear: the gear, with numbers where that of the pair leaves the diameters of tip or bore open.
        start_roll_length, pitch_roll_length: roll lengths at the start of the active profile and at the pitch point
            [mm].
        contact_roll_length: roll length of every contact [mm], shape (pairs, 1 or slices, positions).
        face_middle: middle of the common face of the pair, from the middle of the gear's own face [mm].
        common_width: width of the common face, over which both gears overlap [mm].
    """

    gear: Gear
    start_roll_length: Scalar = result("mm")
    pitch_roll_length: Scalar = result("mm")
    contact_roll_length: Field = result("mm")
    face_middle: Scalar = result("mm")
    common_width: Scalar = result("mm")

    @property
    def base_radius(self) -> Float[Array, "*cycles"]:
        """Base radius of the gear [mm]."""
        return self.gear.base_radius

    @property
    def face_width(self) -> Float[Array, "*cycles"]:
        """Face width of the gear [mm]."""
        return self.gear.face_width

    @property
    def tip_roll_length(self) -> Float[Array, "*cycles"]:
        """Roll length at the tip [mm]."""
        return self.gear.tip_roll_length

    def flank(self, roll_length: Float[Array, "..."], face_coordinate: Float[Array, "..."]) -> Flank:
        """Points of the flank, for its modification; roll lengths and face coordinates [mm] broadcast.

        Face coordinates count from the middle of the gear's own face: those of a mesh lie `face_middle` farther.
        """
        return Flank(
            roll_length=roll_length,
            tip_roll_length=self.tip_roll_length,
            start_roll_length=self.start_roll_length,
            base_radius=self.base_radius,
            face_coordinate=face_coordinate,
            face_width=self.face_width,
        )


class Kinematics(Checked):
    """How two gears move past each other over one base pitch: a few numbers, from which everything else follows.

    Attributes:
        pair: the gear pair.
        path_of_contact: points A to E.
        first_phase: mesh position with which the base pitch begins, in base pitches: that of all cycles of a batch.
        resolution: array sizes.
        plane: "stress" or "strain", of the contact.
        helical: whether every slice has its own phase: where the gears have a helix angle that is not known to be zero.
    """

    pair: GearPair
    path_of_contact: PathOfContact
    first_phase: Scalar = result("base pitches")
    resolution: Resolution
    plane: Plane = eqx.field(static=True)
    helical: bool = eqx.field(static=True, default=False)

    @property
    def batch_ndim(self) -> int:
        """Number of leading batch axes."""
        return self.path_of_contact.base_pitch.ndim

    @property
    def phase(self) -> Float[Array, " positions"]:
        """Mesh positions in base pitches, shape (positions,) without batch axes."""
        return _phases(self.first_phase, self.resolution.positions)

    @property
    @over_batch
    @program
    def path(self) -> Field:
        """Nominal path position of every contact [mm], shape (pairs, 1 or slices, positions)."""
        offset = self.resolution.leading - self._count(self.resolution.chosen_pairs)
        middle = (self.phase[None] + offset[:, None]) * self.path_of_contact.base_pitch
        if not self.helical:
            return middle[:, None]
        return middle[:, None] + (self.face_coordinate * self.pair.path_slope)[None, :, None]

    @property
    @over_batch
    @program
    def outside(self) -> Field:
        """Distance of every contact outside the path of contact [mm], zero on it, of the shape of `path`."""
        path, contact = self.path, self.path_of_contact
        return jnp.maximum(jnp.maximum(contact.start - path, path - contact.end), 0.0)

    @property
    @over_batch
    def wheel_edge(self) -> Bool[Array, "pairs #slices positions"]:
        """Whether an edge of the wheel touches the pinion outside the path of contact, and not one of the pinion.

        Ahead of the path that is the tip of the wheel, or, where the path begins at the form circle of the pinion, its
        edge there; behind the path the other way round.
        """
        path, contact = self.path, self.path_of_contact
        ahead = (path < contact.start) & (contact.start_shortened <= 0)
        return ahead | ((path > contact.end) & (contact.end_shortened > 0))

    @property
    @over_batch
    def sides(self) -> tuple[Side, Side]:
        """Pinion and wheel."""
        return _sides(self.explicit)

    @property
    def explicit(self) -> "Kinematics":
        """Kinematics of the pair with all diameters as numbers, for programs that serve gears with and without them."""
        return changed(self, pair=explicit(self.pair))

    @property
    @over_batch
    def face_coordinate(self) -> Float[Array, " slices"]:
        """Middle of every slice, from the middle of the common face [mm], shape (slices,)."""
        slices, edges = self.resolution.slices, self.resolution.slice_edges
        if self.resolution.parts is None:
            return ((self._count(slices) + 0.5) / slices - 0.5) * self.pair.face_width
        return jnp.asarray(0.5 * (edges[1:] + edges[:-1]), self._dtype) * self.pair.face_width

    @property
    @over_batch
    def slice_width(self) -> Float[Array, " slices"]:
        """Width of every slice [mm], shape (slices,)."""
        slices = self.resolution.slices
        if self.resolution.parts is None:
            return jnp.full((slices,), 1.0 / slices, self._dtype) * self.pair.face_width
        return jnp.asarray(np.diff(self.resolution.slice_edges), self._dtype) * self.pair.face_width

    def _count(self, number: int) -> Array:
        return jnp.arange(number, dtype=self._dtype)

    @property
    def _dtype(self) -> np.dtype:
        return self.path_of_contact.start.dtype


@program
def _sides(moving: Kinematics) -> tuple[Side, Side]:
    pair, contact = moving.pair, moving.path_of_contact
    ends = _ends(pair, contact, moving.path)
    return sides(pair, contact, *_roll_lengths(contact, moving.path, ends, on_both(_touched, *ends)))


def _phases(first: Array, count: int) -> Array:
    known = concrete(first)
    if known is None:
        return first[(0,) * first.ndim] + jnp.arange(count, dtype=first.dtype) / count
    return real(known.ravel()[0] + np.arange(count, dtype=known.dtype) / count)


class Contacts(eqx.Module):
    """Contact points of tooth pairs; fields of one shape.

    Attributes:
        pinion_roll_length, wheel_roll_length: [mm].
        corner_gap: gap of the unmodified flanks outside the path of contact [um], zero on it.
        lever: what a pair closes per unit of transmission error; 1 on the path of contact, less beyond it, because the
            corner's gap opens while the gears turn on.
        beyond_tip: distance outside the path of contact of those where a tip corner touches [mm], zero elsewhere.
    """

    pinion_roll_length: Float[Array, "..."]
    wheel_roll_length: Float[Array, "..."]
    corner_gap: Float[Array, "..."]
    lever: Float[Array, "..."]
    beyond_tip: Float[Array, "..."]


def contacts(pair: GearPair, contact: PathOfContact, path: Float[Array, "..."], extended: bool = True) -> Contacts:
    """Contact points at path positions [mm], on the path of contact and outside it.

    Where contact is not `extended`, corners outside the path are a base pitch farther apart: no teeth bend as much.

    A position is the mean one of both gears: under a transmission error d the pinion leads it by d/2 and the wheel
    lags by d/2, so a corner is d/2 farther out than its nominal position and its gap grows by half its slope times d.
    """
    ends = _ends(pair, contact, path)
    edges = pair.wheel.edge_radius, pair.pinion.edge_radius
    before, after = on_both(lambda given: _corner(*given), *zip(ends, edges))
    beyond = (ends[0].outside > 0) | (ends[1].outside > 0)
    apart = 0.0 if extended else jnp.where(beyond, 1e3 * contact.base_pitch, 0.0)
    return Contacts(
        *_roll_lengths(contact, path, ends, (before.touched, after.touched)),
        before.gap + after.gap + apart,
        1 - 0.5e-3 * (before.slope + after.slope),
        jnp.add(*(jnp.where(end.at_form, 0.0, jnp.maximum(end.outside, 0.0)) for end in ends)),
    )


class _End(NamedTuple):
    """One end of the path of contact and every contact outside it.

    Attributes:
        outside: distance of the contacts outside this end [mm], negative before it.
        at_form: whether the path ends at the form circle of the mate, whose edge touches then.
        lengths: of the tip corner and its mate, as `corner_gap` takes them.
        tip_gear_end: roll length at this end of the gear whose tip is there [mm].
        farthest: largest roll length of the mate that a tip corner touches [mm]. In an internal pair it ends at the
            middle of the mate's flank, and where flanks would not fit into each other: corners far out swing back.
        reach: beyond this distance the gap goes on along its tangent, so that far pairs stay finite and apart [mm].
        least_reach: in an internal pair, distance whose tangent the gap never falls below: corners far out, where the
            mate has no flank, may come back; None in an external pair [mm].
    """

    outside: Real
    at_form: Bool[Array, ""]
    lengths: tuple[Scalar, Scalar, Scalar, Scalar]
    tip_gear_end: Scalar
    farthest: Scalar
    reach: Scalar
    least_reach: Scalar | None

    def at_contacts(self, value: Array) -> Array:
        """One number at every contact each: a derivative then sums over the contacts once."""
        return jnp.broadcast_to(value, self.outside.shape)

    def touching(self, x: Real) -> tuple[Real, Real]:
        """Gap of a sharp corner [um] and roll length of the involute that it touches, at distances outside [mm]."""
        tip, tip_base, mate, mate_base = self.lengths
        chosen = [
            self.at_contacts(jnp.where(self.at_form, *both))
            for both in zip((mate, mate_base, self.tip_gear_end, tip_base), self.lengths)
        ]
        return corner_gap(jnp.where(self.at_contacts(self.at_form), -x, x), *chosen)

    def on_flank(self, touched: Real) -> Real:
        """Roll lengths of the involute that is touched, of a form circle's edge up to the tip of the mate."""
        return jnp.minimum(touched, self.at_contacts(jnp.where(self.at_form, self.lengths[0], self.farthest)))

    @property
    def near(self) -> Real:
        """Distance of the contacts outside [mm], from zero to the reach."""
        return jnp.clip(self.outside, 0.0, self.reach)

    def going_on(self, gap: Real, slope: Real, reach: Scalar) -> Real:
        """Gap [um] that goes on along its tangent beyond a distance [mm]."""
        return gap + slope * (jnp.maximum(self.outside, reach) - reach)


def _ends(pair: GearPair, contact: PathOfContact, path: Real) -> tuple[_End, _End]:
    """Start and end of the path of contact."""
    pinion_base, wheel_base = contact.pinion_base_radius, contact.wheel_base_radius
    (first, second), (last, before_last) = (
        (contact.pinion_roll_length(place), contact.wheel_roll_length(place)) for place in (contact.start, contact.end)
    )
    # the edge of an undercut passes the tip of the mate about as far outside the path as this is shortened
    reach: Scalar | float = REACH
    if pair.wheel.is_internal:
        reach = jnp.where(pair.wheel.teeth - pair.pinion.teeth < _CLOSE_TEETH, _CLOSE_REACH, REACH)
    start, end = (
        (shortened > 0, reach * contact.base_pitch + shortened, REACH * contact.base_pitch + shortened)
        for shortened in (contact.start_shortened, contact.end_shortened)
    )
    least = (start[2], end[2]) if pair.wheel.is_internal else (None, None)
    approach = pair.wheel.tip_roll_length, wheel_base, first, pinion_base
    recess = pair.pinion.tip_roll_length, pinion_base, before_last, wheel_base
    farthest = [jnp.full_like(first, jnp.inf)] * 2
    if pair.wheel.is_internal:
        middles = 0.5 * (first + last), 0.5 * (second + before_last)
        farthest = [
            jnp.minimum(0.5 * (mate - tip), middle) for (tip, _, mate, _), middle in zip((approach, recess), middles)
        ]
    return (
        _End(contact.start - path, start[0], approach, second, farthest[0], start[1], least[0]),
        _End(path - contact.end, end[0], recess, last, farthest[1], end[1], least[1]),
    )


def _touched(end: _End) -> Real:
    """Roll lengths of the mate where a corner at this end touches it [mm]."""
    return end.on_flank(end.touching(end.near)[1])


def _roll_lengths(
    contact: PathOfContact, path: Real, ends: tuple[_End, _End], touched: tuple[Real, Real]
) -> tuple[Real, Real]:
    """Roll lengths of the contacts on pinion and wheel [mm]; `touched` by corners at both ends."""
    on_path = jnp.clip(path, contact.start, contact.end)
    ahead, behind = (end.outside > 0 for end in ends)
    at_start, at_end = (end.at_form for end in ends)
    before, after = touched
    pinion = jnp.select([ahead & ~at_start, behind & at_end], [before, after], contact.pinion_roll_length(on_path))
    wheel = jnp.select([behind & ~at_end, ahead & at_start], [after, before], contact.wheel_roll_length(on_path))
    return pinion, wheel


class _Corner(NamedTuple):
    """A corner at the mate's flank: gap [um], its slope [um/mm] and the roll length of the touched flank [mm]."""

    gap: Real
    slope: Real
    touched: Real


def _corner(end: _End, edge_radius: Scalar) -> _Corner:
    """The corners outside an end of the path; `edge_radius` is that of the tip there [mm]."""
    tip, tip_base, rounding = map(end.at_contacts, (*end.lengths[:2], edge_radius))

    def touching(x: Real) -> tuple[Real, Real]:
        gap, touched = end.touching(x)
        past = jnp.maximum((touched**2 - tip**2) / (2 * tip_base), 0.0)  # the tip, along the flank
        opened = 1e3 * (jnp.sqrt(past**2 + rounding**2) - rounding)
        return jnp.where(end.at_form, gap + opened, gap), end.on_flank(touched)

    near, beyond = end.near, end.outside > 0
    (gap, touched), (slope, _) = jax.jvp(touching, (near,), (jnp.ones_like(near),))
    gap = end.going_on(gap, slope, end.reach)
    if end.least_reach is not None:
        near = jnp.clip(end.outside, 0.0, end.least_reach)
        (least, _), (rise, _) = jax.jvp(touching, (near,), (jnp.ones_like(near),))
        least = end.going_on(least, rise, end.least_reach)
        gap, slope = jnp.maximum(gap, least), jnp.where(gap < least, rise, slope)
    return _Corner(jnp.where(beyond, gap, 0.0), jnp.where(beyond, slope, 0.0), touched)


def sides(pair: GearPair, contact: PathOfContact, pinion: Real, wheel: Real) -> tuple[Side, Side]:
    """Pinion and wheel with contacts at given roll lengths [mm]."""
    on_pinion, on_wheel = pair.face_middles
    return (
        Side(
            pair.pinion,
            contact.pinion_roll_length(contact.start),
            contact.pinion_pitch_roll_length,
            pinion,
            on_pinion,
            pair.face_width,
        ),
        Side(
            pair.wheel,
            contact.wheel_roll_length(contact.end),
            contact.wheel_pitch_roll_length,
            wheel,
            on_wheel,
            pair.face_width,
        ),
    )


def kinematics(
    pair: GearPair, first_phase: Scalar, resolution: Resolution, plane: Plane, contact: PathOfContact | None = None
) -> Kinematics:
    """The kinematics of a pair; `contact` is its path of contact where that is known."""
    contact = path_of_contact(pair) if contact is None else contact
    helical = pair.pinion.helix_angle is not None
    return Kinematics(pair, contact, first_phase.astype(contact.start.dtype), resolution, plane, helical)
