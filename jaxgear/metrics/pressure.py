"""Hertzian pressure on the flank and at the tip corners."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance.plane import plane_modulus
from ..contact import MeshCycle
from ..numerics import safe_sqrt

Load = Float[Array, "pairs slices positions"]


def flank_pressure(cycle: MeshCycle) -> Load:
    """p = sqrt(q E* / (pi R)) [MPa] with the local radii of both involutes; zero outside the path of contact.

    E* uses the plane moduli of the compliance model, so plane stress gives 5 % less than the usual plane strain form.
    """
    mesh = cycle.mesh
    reduced = _reduced_radius(mesh.pinion_load.roll_length, mesh.wheel_load.roll_length)
    inside = mesh.outside <= 0
    return jnp.where(inside[:, None], _hertz(cycle, reduced), 0.0)


def corner_pressure(cycle: MeshCycle) -> Load:
    """Pressure of the rounded tip edge on the mate's involute [MPa]; zero on the path of contact.

    1 / R = 1 / tip_edge_radius + 1 / rho_mate, taken as an elastic cylinder on the flank: 7 % (edge radius 0.2 mm) to
    about 50 % (0.002 mm) above the exact solution of a rounded edge.
    """
    mesh = cycle.mesh
    before = mesh.path < mesh.path_of_contact.start
    edge = jnp.where(before, mesh.pair.wheel.tip_edge_radius, mesh.pair.pinion.tip_edge_radius)
    mate = jnp.where(before, mesh.pinion_load.roll_length, mesh.wheel_load.roll_length)
    outside = mesh.outside > 0
    return jnp.where(outside[:, None], _hertz(cycle, _reduced_radius(edge, mate)), 0.0)


def _reduced_radius(first, second):
    return first * second / (first + second)


def _hertz(cycle: MeshCycle, reduced) -> Load:
    pair, plane = cycle.mesh.pair, cycle.mesh.compliance.plane
    moduli = plane_modulus(pair.pinion.material, plane), plane_modulus(pair.wheel.material, plane)
    combined = 1 / (1 / moduli[0] + 1 / moduli[1])
    return safe_sqrt(cycle.line_load * combined / (jnp.pi * reduced[:, None]))
