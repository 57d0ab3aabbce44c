"""Hertzian pressure on the flank and at the tip corners."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance.plane import combined_modulus
from ..geometry import reduced_radius
from ..numerics import program, safe_sqrt
from .kinematics import Kinematics

Load = Float[Array, "pairs slices positions"]
Bend = Float[Array, "pairs #slices positions"]

# A concave flank is taken to be this much flatter than the involutes at most: one that fits its mate closer has no
# Hertzian contact.
FLATTEST = 0.1


@program
def pressures(kinematics: Kinematics, line_load: Load, bend: Bend) -> tuple[Load, Load]:
    """`flank_pressure` and `corner_pressure`."""
    return flank_pressure(kinematics, line_load, bend), corner_pressure(kinematics, line_load)


def flank_pressure(kinematics: Kinematics, line_load: Load, bend: Bend) -> Load:
    """p = sqrt(q E* / (pi R)) [MPa] with the local radii of both flanks; zero outside the path of contact.

    `bend` is what modifications add to 1 / R, relative to that of the involutes, as seen over the contact. At a kink,
    where the pressure is singular, that is its mean over the contact: finite elements have up to 55 % more there.

    E* is that of plane strain, the usual form, unless the compliance model is in plane stress throughout: 5 % less.
    """
    pinion, wheel = kinematics.sides
    reduced = reduced_radius(pinion.contact_roll_length, wheel.contact_roll_length)
    inside = kinematics.outside <= 0
    reduced = reduced[:, None] / jnp.maximum(1 + bend, FLATTEST)
    return jnp.where(inside[:, None], _hertz(kinematics, line_load, reduced), 0.0)


def corner_pressure(kinematics: Kinematics, line_load: Load) -> Load:
    """Pressure of the rounded tip edge on the mate's involute [MPa]; zero on the path of contact.

    1 / R = 1 / tip_edge_radius + 1 / rho_mate, taken as an elastic cylinder on the flank: 7 % (edge radius 0.2 mm) to
    about 50 % (0.002 mm) above the exact solution of a rounded edge.
    """
    pinion, wheel = kinematics.sides
    before = kinematics.path < kinematics.path_of_contact.start
    edge = jnp.where(before, wheel.gear.tip_edge_radius, pinion.gear.tip_edge_radius)
    mate = jnp.where(before, pinion.contact_roll_length, wheel.contact_roll_length)
    outside = kinematics.outside > 0
    return jnp.where(outside[:, None], _hertz(kinematics, line_load, reduced_radius(edge, mate)[:, None]), 0.0)


def _hertz(kinematics: Kinematics, line_load: Load, reduced) -> Load:
    pair = kinematics.pair
    modulus = combined_modulus(pair.pinion.material, pair.wheel.material, kinematics.plane)
    return safe_sqrt(line_load * modulus / (jnp.pi * reduced))
