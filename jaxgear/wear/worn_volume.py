"""Conservative mapping of the worn volume from the contacts of a mesh to grids on both flanks, by Archard's law.

A position represents the interval of the path of contact from half a step before it to half a step after it. In this
interval the sliding distance of the flanks is

    S = integral of |rho_1 / r_b1 - rho_2 / r_b2| d path,

rho the roll lengths; in corner contact it is the arc of the mate's flank that the tip corner travels. The worn material
is distributed to the grid points of each flank by their hat functions, at sampling points along the interval and across
the contact width, weighted by the Hertzian pressure. All worn material is mapped to the flank: the volume of the depth
equals the worn volume to rounding, and equal sliding distances leave no ripple with the spacing of the positions.

The contact width follows from the load of each contact, up to the full load of one pair. A contact wears both flanks at
its actual place: on the slope of a relief it shifts by the same arc along either flank (`RemovedMaterial.shift`),
linear
between positions. To first order the sliding there equals the sliding at the nominal contact. Material that would lie
beyond an end of the flank is folded back, so that an even load wears evenly up to the end.

While one pair of teeth passes through the mesh, every point of flank i is in contact over the distance 2 a of the
rolling, slides past its mate by 2 a |u1 - u2| / u_i, and wears by

    dh_i = k_w p 2 a |u1 - u2| / u_i = k_w q |u1 - u2| / u_i,

p the mean pressure, q the line load, u the rolling speeds of the flanks: the half width of the contact drops out.

Flanks of helical gears slide in the transverse section, along their profiles, every slice of the face at its own phase.
The line load per face width is the normal force per length of the contact line, so that dh_i is normal to the flank.
Depths here are measured in the transverse section, like modifications: dh_i / cos(beta_b).

References:
    J. F. Archard, J. Appl. Phys. 24 (1953) 981-988, doi 10.1063/1.1721448.
    A. Flodin, S. Andersson, Simulation of mild wear in spur gears, Wear 207 (1997) 16-23.
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import Mesh, MeshCycle
from ..contact.contact_width import contact_nodes, full_load, place_of
from ..contact.kinematics import contacts
from ..geometry import PathOfContact
from ..numerics import Given, Numbers, check, program, real, safe_divide, safe_sqrt

Scalar = Float[Array, ""]
Load = Float[Array, "pairs slices positions"]

# Places along the piece of a position, and across a contact that has a width: four across it leave steps on the flank
# where the load sets in.
_PLACES, _ACROSS = 4, 12
# middle of every part of a piece, and its ends
_MIDDLES, _ENDS = (np.arange(_PLACES) + 0.5) / _PLACES - 0.5, np.arange(_PLACES + 1) / _PLACES - 0.5

# of the worn material: from contact on the flanks, and of tip corners on the mate's flank
PARTS = "flank", "corner"


_TOWARDS_PINION_TIP = np.array([1.0, -1.0])  # sign of the growth of roll length on pinion and wheel

Contact = Float[Array, "pairs #slices positions"]


class Deposit(eqx.Module):
    """Mapping of worn volume from contacts to the grids on the flanks; the axis `gears` is (pinion, wheel).

    Attributes:
        roll_length: roll lengths of the grid points, from the start of the active profile to the tip [mm], shape
            (gears, points).
        arc: arc length of the flank that belongs to every grid point [mm], shape (gears, points).
        base_radius: base radii [mm], shape (gears,).
        nominal: arc length of the flanks from the base circle to the nominal contact [mm], at the sampling points in
            the interval of every position, shape (gears, pairs, 1, positions, places); slices in place of 1 for helical
            gears.
        sliding: sliding distance at the sampling points, on the flank and of tip corners [mm], shape (parts, pairs, 1
            or slices, positions, places).
        half_width: half width of contacts under the full load [mm], shape (pairs, 1 or slices, positions).
        beyond: distance of the virtual centre of the contact beyond the tip corner that touches [mm], shape as
            `half_width`; zero on the path of contact.
        lowest, highest: limits of the shift of contacts from their nominal places, positive towards the pinion tip
            [mm], shapes as `half_width`.
        full_load: line load of one pair that carries the full load [N/mm].
        inclination: cos(beta_b), ratio of the depth normal to the flank to the depth in the transverse section.
        nodes: number of sampling points across the contact width.
    """

    roll_length: Float[Array, "gears points"]
    arc: Float[Array, "gears points"]
    base_radius: Float[Array, " gears"]
    nominal: Float[Array, "gears pairs #slices positions places"]
    sliding: Float[Array, "parts pairs #slices positions places"]
    half_width: Contact
    beyond: Contact
    lowest: Contact
    highest: Contact
    full_load: Scalar
    inclination: Scalar
    nodes: int = eqx.field(static=True)

    def arcs(self, line_load: Load, shift: Contact) -> Float[Array, "gears pairs slices positions places nodes"]:
        """Arcs from the base circle to the worn places [mm], for contacts with line loads [N/mm] and shifts [mm]."""
        moved = _along_pieces(jnp.clip(self.beyond + shift, self.lowest, self.highest))
        centre = self.nominal + _first(jnp.asarray(_TOWARDS_PINION_TIP, moved.dtype), 5) * moved[None]
        share = safe_sqrt(jnp.minimum(safe_divide(line_load, self.full_load), 1.0))
        across = _last([node.place for node in contact_nodes(self.nodes)], 5, moved.dtype)
        arc = centre[..., None] + ((self.half_width * share)[..., None, None] * across)[None]
        # the part of the contact width that would lie beyond the end of the flank is folded back
        first, last = (_first(_arc(self.roll_length[:, end], self.base_radius), arc.ndim) for end in (0, -1))
        return jnp.clip(
            jnp.where(arc < first, 2 * first - arc, jnp.where(arc > last, 2 * last - arc, arc)), first, last
        )


def grid(mesh: Mesh, points: int) -> Float[Array, "gears points"]:
    """Evenly spaced roll lengths from the start of the active profile to the tip [mm], shape (gears, points)."""
    return jnp.stack([jnp.linspace(side.start_roll_length, side.tip_roll_length, points) for side in mesh.sides])


def arcs(roll_length: Float[Array, " points"], base_radius: Scalar) -> Float[Array, " points"]:
    """Arc of an involute that belongs to every grid point [mm]: integral of its hat function times rho / r_b d rho."""
    width = jnp.diff(roll_length)
    to_left = width * (roll_length[:-1] + 2 * roll_length[1:]) / 6
    to_right = width * (2 * roll_length[:-1] + roll_length[1:]) / 6
    nothing = jnp.zeros_like(width[:1])
    return (jnp.concatenate([nothing, to_left]) + jnp.concatenate([to_right, nothing])) / base_radius


@program
def deposit(mesh: Mesh, torque: Scalar, points: int) -> Deposit:
    """Mapping of worn volume for a mesh under a torque on the pinion [N m], which sets the contact widths."""
    contact, path, dtype = mesh.path_of_contact, mesh.kinematics.path, mesh.slice_width.dtype
    step = contact.base_pitch / mesh.resolution.positions

    def along(places: np.ndarray) -> Array:
        return path[..., None] + step * _last(places, 4, dtype)

    at, bases = contacts(mesh.pair, contact, along(_MIDDLES)), [side.base_radius for side in mesh.sides]
    rolls = at.pinion_roll_length, at.wheel_roll_length
    full = full_load(mesh.pair, torque)
    knots, place = grid(mesh, points), place_of(mesh, torque, full)
    return Deposit(
        roll_length=knots,
        arc=jnp.stack([arcs(of, base) for of, base in zip(knots, bases)]),
        base_radius=jnp.stack(bases),
        nominal=jnp.stack([_arc(roll, base) for roll, base in zip(rolls, bases)]),
        sliding=_sliding(mesh, along(_ENDS)),
        half_width=place.half_width,
        beyond=place.beyond,
        lowest=place.lowest,
        highest=place.highest,
        full_load=full,
        inclination=jnp.cos(mesh.pair.pinion.base_helix_angle),
        nodes=1 if mesh.resolution.contact_nodes == 1 else _ACROSS,
    )


def _first(values: Array, ndim: int) -> Array:
    """Values along the first of `ndim` axes."""
    return values.reshape(-1, *[1] * (ndim - 1))


def _last(values: Sequence[float] | np.ndarray, ndim: int, dtype: np.dtype) -> Array:
    """Values along the last of `ndim` axes."""
    return jnp.asarray(values, dtype).reshape(*[1] * (ndim - 1), -1)


def _along_pieces(field: Contact) -> Float[Array, "pairs #slices positions places"]:
    """Field of the contacts, interpolated linearly between positions, at the sampling points of every interval."""
    pairs, slices, positions = field.shape
    # in the order of the path of contact: the last pair comes first
    line = jnp.swapaxes(field[::-1], 0, 1).reshape(slices, -1)
    step = jnp.diff(line, prepend=line[:, :1], append=line[:, -1:])  # step to every contact; zero beyond the last one
    before, after = step[:, :-1, None], step[:, 1:, None]
    places = _last(_MIDDLES, 3, field.dtype)
    found = line[..., None] + jnp.where(places < 0, before, after) * places
    return jnp.swapaxes(found.reshape(slices, pairs, positions, -1), 0, 1)[::-1]


def _sliding(
    mesh: Mesh, ends: Float[Array, "pairs #slices positions ends"]
) -> Float[Array, "parts pairs #slices positions places"]:
    """Sliding distance between neighbouring path positions [mm], on the flank and of tip corners."""
    contact = mesh.path_of_contact
    on_path = jnp.clip(ends, contact.start, contact.end)
    # on the path rho_1 / r_b1 - rho_2 / r_b2 is s (1 / r_b1 + 1 / r_b2), at the distance s from the pitch point
    flank = 0.5 * on_path * jnp.abs(on_path) * (1 / contact.pinion_base_radius + 1 / contact.wheel_base_radius)
    at = contacts(mesh.pair, contact, ends)
    corner = sum(
        0.5 * (roll**2 - of_path(on_path) ** 2) / base
        for roll, of_path, base in (
            (at.pinion_roll_length, contact.pinion_roll_length, contact.pinion_base_radius),
            (at.wheel_roll_length, contact.wheel_roll_length, contact.wheel_base_radius),
        )
    )
    return jnp.stack([jnp.diff(flank, axis=-1), jnp.abs(jnp.diff(corner, axis=-1))])


def _arc(roll_length: Float[Array, "..."], base_radius: Float[Array, "..."]) -> Float[Array, "..."]:
    """Arc of an involute from the base circle [mm]."""
    return roll_length**2 / (2 * base_radius)


# wear depth [um] = 1e9 x coefficient [m2/N] x line load [N/mm]: 1e6 mm2/m2 times 1e3 um/mm
UM_PER_LOAD = 1e9


def specific_sliding(contact: PathOfContact, path: Given) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Specific sliding |u1 - u2| / u_i of pinion and wheel at path positions [mm], two arrays of the shape of `path`.

    Beyond the path of contact, where a tip corner slides over the mate's flank, it is the value at the end of the path.
    """
    path = jnp.clip(path, contact.start, contact.end)
    sliding = jnp.abs(path) * (1 / contact.pinion_base_radius + 1 / contact.wheel_base_radius)
    pinion = contact.pinion_roll_length(path) / contact.pinion_base_radius
    wheel = contact.wheel_roll_length(path) / contact.wheel_base_radius
    return sliding / pinion, sliding / wheel


def passage_depth(cycle: MeshCycle, coefficient: Numbers) -> tuple[Load, Load]:
    """Wear depth of one passage of a tooth pair at every contact of a mesh cycle, on pinion and wheel [um].

    Depths are measured in the transverse section, like modifications.

    Args:
        cycle: solved mesh cycle, without batch axes.
        coefficient: wear coefficient [m2/N], shape (), or (pairs, slices, positions) for one value per contact.

    Returns:
        k_w q |u1 - u2| / (u_i cos(beta_b)) of both gears, shape (pairs, slices, positions) each.

    Raises:
        ValueError: for a negative coefficient.
    """
    coefficient = real(coefficient).astype(cycle.line_load.dtype)
    check("coefficient", coefficient, "m2/N", low=0.0)
    moving = cycle.kinematics
    pinion, wheel = specific_sliding(moving.path_of_contact, moving.path)
    worn = UM_PER_LOAD * coefficient * cycle.line_load / jnp.cos(moving.pair.pinion.base_helix_angle)
    return worn * pinion, worn * wheel


@program
def worn(
    line_load: Load, shift: Contact, coefficient: Given, place: Deposit
) -> Float[Array, "gears parts slices points"]:
    """Wear depth of one passage of a tooth pair on the grids of both flanks [um], by flank contact and by tip corners.

    Depths are measured in the transverse section, like modifications.

    Args:
        line_load: line load [N/mm], shape (pairs, slices, positions).
        shift: contact shift, see `RemovedMaterial` [mm], shape (pairs, slices or 1, positions).
        coefficient: wear coefficient [m2/N], broadcast to (gears, pairs, slices, positions).
        place: mapping of worn volume to the grids.

    Returns:
        wear depth [um], shape (gears, parts, slices, points).
    """
    gears, slices, points = len(place.base_radius), line_load.shape[1], place.roll_length.shape[-1]
    taken = jnp.broadcast_to(UM_PER_LOAD * coefficient * line_load[None] / place.inclination, (gears, *line_load.shape))
    mean = _last([node.mean for node in contact_nodes(place.nodes)], 7, line_load.dtype)
    left = (taken[None, ..., None] * place.sliding[:, None])[..., None] * mean
    # grid interval of every sampling point, and the place within it
    base, knots, next_knots = (_first(of, 6) for of in (place.base_radius, *place.roll_length.T[:2]))
    step = next_knots - knots
    roll = jnp.copysign(safe_sqrt(2 * base * place.arcs(line_load, shift)), base)
    at = jnp.clip((roll - knots) / step, 0.0, points - 1)
    cell = jnp.minimum(jax.lax.stop_gradient(at).astype(jnp.int32), points - 2)
    ahead = at - cell.astype(at.dtype)
    gear = _first(jnp.arange(gears, dtype=jnp.int32), 6)
    face = jnp.arange(slices, dtype=jnp.int32).reshape(1, 1, -1, 1, 1, 1)
    left = jnp.moveaxis(left, 0, -1)
    # one scatter to both ends of a grid interval: every entry of a scatter costs the same
    ends = jnp.concatenate([left * (1 - ahead)[..., None], left * ahead[..., None]], axis=-1)
    cells = jnp.zeros((gears, slices, points - 1, 2 * len(PARTS)), line_load.dtype).at[gear, face, cell].add(ends)
    first, second = jnp.split(jnp.pad(cells, ((0, 0), (0, 0), (1, 1), (0, 0))), 2, axis=-1)
    depth = first[:, :, 1:] + second[:, :, :-1]
    return jnp.moveaxis(depth, -1, 1) / place.arc[:, None, None]
