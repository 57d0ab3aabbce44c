"""From the contacts of a mesh to the flanks, by Archard's law: where every loaded position wears both gears.

A position stands for the piece of the path of contact from half a step before it to half a step after it. On that piece
the flanks slide past each other by

    S = integral of |rho_1 / r_b1 - rho_2 / r_b2| d path,

rho the roll lengths, and in corner contact by the arc of the mate's flank that the tip corner travels. What is worn off
goes to the points of a grid on each flank by their hat functions, at places all over that piece and across the contact,
with the weight of the Hertzian pressure, as the contact in turn meets the flank. Every piece of worn material lands on
the flank, so that the volume of the depth is the worn volume to rounding, and equal pieces of sliding leave no ripple
of the positions.

A contact is as wide as its own load makes it, up to the full load of one pair: its wear is a mixture of those over a
few shares of that width, by Bernstein polynomials, which are smooth and keep the mean width. What would lie beyond an
end of the flank is folded back, so that an even load wears evenly up to the end. That the contact slides down a slope,
by less than half its width on usual reliefs, is left out.

While one pair of teeth passes through the mesh, every point of flank i is in contact over the distance 2 a of the
rolling, slides past its mate by 2 a |u1 - u2| / u_i, and wears by

    dh_i = k_w p 2 a |u1 - u2| / u_i = k_w q |u1 - u2| / u_i,

p the mean pressure, q the line load, u the rolling speeds of the flanks: the half width of the contact drops out.

Flanks of helical gears slide in the transverse section, along their profiles and across the contact line, every slice
of the face at its own phase. The line load per face width is the normal force per length of the contact line, so that
dh_i is normal to the flank; depths here are those in the transverse section, as modifications are: dh_i / cos(beta_b).

References:
    J. F. Archard, J. Appl. Phys. 24 (1953) 981-988, doi 10.1063/1.1721448.
    A. Flodin, S. Andersson, Simulation of mild wear in spur gears, Wear 207 (1997) 16-23.
"""

from math import comb

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import Mesh, MeshCycle
from ..contact.contact_width import contact_nodes, place_of
from ..contact.kinematics import contacts
from ..geometry import PathOfContact
from ..numerics import Given, Numbers, check, over_slices, program, real, safe_divide, safe_sqrt

Scalar = Float[Array, ""]

# Places along the piece of a position. On a grid coarser than a step the depth changes by 1e-4 with twice as many.
_PLACES = 8

# widths from none to that of the full load, evenly spaced, over which it is known where contacts leave their wear
_WIDTHS = 4

# of the worn material: from contact on the flanks, and of tip corners on the mate's flank
PARTS = "flank", "corner"


class Deposit(eqx.Module):
    """Where contacts wear the flanks of pinion and wheel, in this order along the axis gears.

    Of helical gears what has the axes (pairs, positions) has (pairs, slices, positions).

    Attributes:
        roll_length: of the grid points, from the start of the active profile to the tip [mm], shape (gears, points).
        arc: of the flank that belongs to every point [mm], shape (gears, points).
        sliding: of every position, on the flank and of tip corners [mm], shape (parts, pairs, positions).
        spreads: sliding by the points where contacts leave their wear [mm], from those without width to those of the
            full load, shape (widths, gears, parts, points, pairs, positions).
        full_load: line load of one pair that carries all [N/mm].
        inclination: cos(beta_b), depth normal to the flank over that in the transverse section.
    """

    roll_length: Float[Array, "gears points"]
    arc: Float[Array, "gears points"]
    sliding: Float[Array, "parts pairs *own positions"]
    spreads: Float[Array, "widths gears parts points pairs *own positions"]
    full_load: Scalar
    inclination: Scalar

    def shares(self, line_load: Float[Array, "*contacts"]) -> Float[Array, "widths *contacts"]:
        """What each of the `spreads` counts for in contacts under line loads [N/mm], as wide as the root of these."""
        width, most = safe_sqrt(jnp.minimum(safe_divide(line_load, self.full_load), 1.0)), _WIDTHS - 1
        return jnp.stack([comb(most, i) * width**i * (1 - width) ** (most - i) for i in range(_WIDTHS)])


def grid(mesh: Mesh, points: int) -> Float[Array, "gears points"]:
    """Roll lengths evenly spaced from the start of the active profile to the tip [mm]: pinion, wheel."""
    return jnp.stack([jnp.linspace(side.start_roll_length, side.tip_roll_length, points) for side in mesh.sides])


def arcs(roll_length: Float[Array, " points"], base_radius: Scalar) -> Float[Array, " points"]:
    """Arc of an involute that belongs to every point [mm]: the integral of its hat function rho / r_b d rho."""
    width = jnp.diff(roll_length)
    to_left = width * (roll_length[:-1] + 2 * roll_length[1:]) / 6
    to_right = width * (2 * roll_length[:-1] + roll_length[1:]) / 6
    nothing = jnp.zeros_like(width[:1])
    return (jnp.concatenate([nothing, to_left]) + jnp.concatenate([to_right, nothing])) / base_radius


@program
def deposit(mesh: Mesh, torque: Scalar, points: int) -> Deposit:
    """The deposit of a mesh under a torque on the pinion [N m], which tells how wide its contacts are."""
    contact, path, dtype = mesh.path_of_contact, mesh.kinematics.contact_path, mesh.slice_width.dtype
    step = contact.base_pitch / mesh.resolution.positions
    # middle of every part of a piece, and its ends
    middles, ends = (np.arange(_PLACES) + 0.5) / _PLACES - 0.5, np.arange(_PLACES + 1) / _PLACES - 0.5

    def along(places: np.ndarray) -> Array:
        return path[..., None] + step * jnp.asarray(places, dtype).reshape(*[1] * path.ndim, -1)

    sliding = _sliding(mesh, along(ends))
    at = contacts(mesh.pair, contact, along(middles))
    rolls = at.pinion_roll_length, at.wheel_roll_length
    half_width = place_of(mesh, torque).half_width.reshape(path.shape)[..., None]
    lengths = grid(mesh, points)

    def over(width) -> Float[Array, "gears parts points pairs *own positions"]:
        made = [
            _spread(roll, width * half_width, sliding, knots, side.base_radius, mesh.resolution.contact_nodes)
            for roll, side, knots in zip(rolls, mesh.sides, lengths)
        ]
        return jnp.stack(made)

    spreads = jax.lax.map(over, jnp.linspace(0.0, 1.0, _WIDTHS, dtype=dtype))
    arc = jnp.stack([arcs(knots, side.base_radius) for knots, side in zip(lengths, mesh.sides)])
    full_load = 1e3 * torque / (mesh.pair.pinion.base_radius * mesh.pair.face_width)
    inclination = jnp.cos(mesh.pair.pinion.base_helix_angle)
    return Deposit(lengths, arc, jnp.sum(sliding, axis=-1), spreads, full_load, inclination)


def _sliding(
    mesh: Mesh, ends: Float[Array, "pairs *own positions ends"]
) -> Float[Array, "parts pairs *own positions places"]:
    """Sliding between neighbouring ends [mm], on the flank and of tip corners."""
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


def _spread(
    roll, half_width, sliding, knots, base_radius, nodes: int
) -> Float[Array, "parts points pairs *own positions"]:
    """Sliding by the points of one grid."""
    total = jnp.zeros((sliding.shape[0], *knots.shape, *roll.shape[:-1]), roll.dtype)
    width, first, last = knots[1] - knots[0], _arc(knots[0], base_radius), _arc(knots[-1], base_radius)
    for node in contact_nodes(nodes):
        arc = _arc(roll, base_radius) + node.place * half_width
        # the contact ends with the flank: the share that would lie beyond wears what is left of it
        arc = jnp.clip(jnp.where(arc < first, 2 * first - arc, jnp.where(arc > last, 2 * last - arc, arc)), first, last)
        place = jnp.clip(jnp.sqrt(2 * base_radius * arc), knots[0], knots[-1])
        hat = jnp.maximum(1 - jnp.abs(place[None] - knots.reshape(-1, *[1] * place.ndim)) / width, 0.0)
        total = total + node.mean * jnp.einsum("x...m,k...m->kx...", hat, sliding)
    return total


def _arc(roll_length: Float[Array, "..."], base_radius: Scalar) -> Float[Array, "..."]:
    """Arc of an involute from the base circle [mm]."""
    return roll_length**2 / (2 * base_radius)


Load = Float[Array, "pairs slices positions"]

# A coefficient of 1 m2/N makes 1e6 mm2/N, and these times N/mm are 1e3 um each.
UM_PER_LOAD = 1e9


def specific_sliding(contact: PathOfContact, path: Given) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Sliding over rolling |u1 - u2| / u_i of pinion and wheel at a path position [mm], of its shape.

    Beyond the path of contact it is that at its end: there a tip corner slides over the mate's flank.
    """
    path = jnp.clip(path, contact.start, contact.end)
    sliding = jnp.abs(path) * (1 / contact.pinion_base_radius + 1 / contact.wheel_base_radius)
    pinion = contact.pinion_roll_length(path) / contact.pinion_base_radius
    wheel = contact.wheel_roll_length(path) / contact.wheel_base_radius
    return sliding / pinion, sliding / wheel


def passage_depth(cycle: MeshCycle, coefficient: Numbers) -> tuple[Load, Load]:
    """Wear depth that one passage of a pair leaves where every contact of a cycle is, on pinion and wheel [um].

    In the transverse section, as that of a modification.

    Args:
        cycle: solved mesh cycle, without batch axes.
        coefficient: of wear [m2/N], a number, or one for every contact, shape (pairs, slices, positions).

    Returns:
        k_w q |u1 - u2| / (u_i cos(beta_b)) of both gears, shape (pairs, slices, positions) each.

    Raises:
        ValueError: for a negative coefficient.
    """
    coefficient = real(coefficient).astype(cycle.line_load.dtype)
    check("passage_depth", "coefficient", coefficient, "m2/N", low=0.0)
    moving = cycle.kinematics
    pinion, wheel = map(over_slices, specific_sliding(moving.path_of_contact, moving.contact_path))
    worn = UM_PER_LOAD * coefficient * cycle.line_load / jnp.cos(moving.pair.pinion.base_helix_angle)
    return worn * pinion, worn * wheel


@program
def worn(line_load: Load, coefficient: Given, place: Deposit) -> Float[Array, "gears parts slices points"]:
    """Wear depth that one passage leaves on the grids of both flanks [um], on the flank and by tip corners.

    In the transverse section, as that of a modification.

    Args:
        line_load: [N/mm], shape (pairs, slices, positions).
        coefficient: of wear [m2/N]; of every gear and contact, to be broadcast to (gears, pairs, slices, positions).
        place: where contacts wear the flanks.
    """
    taken = UM_PER_LOAD * coefficient * line_load[None] / place.inclination
    left = place.shares(line_load)[:, None] * jnp.broadcast_to(taken, (2, *line_load.shape))[None]
    axes = "isj" if place.sliding.ndim == line_load.ndim + 1 else "ij"
    return jnp.einsum(f"ugkx{axes},ugisj->gksx", place.spreads, left) / place.arc[:, None, None]
