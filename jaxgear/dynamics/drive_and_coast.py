"""Drive and coast flanks of a mesh: two contact problems of one gear pair, and the backlash between them."""

from dataclasses import replace
from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import Mesh, RemovedMaterial, removed_material, solve_removed
from ..contact.mesh import prepare_from
from ..geometry import tooth_thickness
from ..microgeometry import AbstractModification
from ..numerics import program

Scalar = Float[Array, ""]
Curve = Float[Array, " positions"]
Both = tuple[AbstractModification | None, AbstractModification | None]


class Flanks(NamedTuple):
    """Drive or coast flanks of a mesh.

    Attributes:
        mesh: mesh prepared at the mesh positions of these flanks.
        removed: material removed from these flanks.
        order: index of the position of `mesh` for each position of the drive flanks, shape (positions,).
        clearance: offset added to the DTE of these flanks, for a count from the contact of the unmodified drive flanks
            [um]: the backlash for the coast flanks, 0 for the drive flanks.
    """

    mesh: Mesh
    removed: RemovedMaterial
    order: Any
    clearance: Scalar


class Static(NamedTuple):
    """Static contact of one side under a torque, shape (positions,) each, in the order of the drive flanks.

    Attributes:
        unloaded: DTE at which the flanks touch [um].
        loaded: DTE under the torque, series compliance included [um].
        stiffness: tangent stiffness under the torque [N/um].
        status: status of the contact.
    """

    unloaded: Curve
    loaded: Curve
    stiffness: Curve
    status: Any


def drive_flanks(mesh: Mesh, torque: Scalar, modification: Both) -> Flanks:
    """Drive flanks of a prepared mesh with modifications (pinion, wheel)."""
    mesh = replace(mesh, automatic=False)  # as that of the coast flanks, which then need no programs of their own
    pinion, wheel = modification
    removed = removed_material(mesh, torque, pinion=pinion, wheel=wheel)
    return Flanks(mesh, removed, jnp.arange(mesh.resolution.positions), jnp.zeros_like(torque))


def coast_flanks(mesh: Mesh, torque: Scalar, modification: Both) -> Flanks:
    """Coast flanks of a mesh with modifications (pinion, wheel), solved at their own mesh positions.

    In a mirror image the coast flanks are drive flanks of the same gears with reversed rotation. Their force is

        F(phase, q) = -F_coast(phase_c - phase, -q - j),    phase_c = 1/2 + (s_1 - s_2) / (2 p)

    with the backlash j on the line of action, the tooth thicknesses s_1 of the pinion and s_2 of the wheel on the
    working pitch circles, and the pitch p = s_1 + s_2 + j / cos(alpha_w) there.

    Each gear takes half of a DTE q: the pinion is q/2 ahead of its mean position, the wheel q/2 behind, as everywhere
    in jaxgear. On the pitch circle the leading flank of the reference tooth of the pinion is then
    phase p + q / (2 cos(alpha_w)) ahead of the pitch point, and the coast flank is s_1 behind that flank. The coast
    flanks touch at q = -j, in the pitch point at phase p = s_1 + j / (2 cos(alpha_w)), modulo p, which is phase_c.
    The coast contact moves against the mirrored direction while the gears turn on, hence the sign of the phase; its
    DTE is measured from q = -j, and half of it again moves either gear. (R. G. Parker and co-workers name the
    phase between both sides: Y. Guo, R. G. Parker, Mech. Mach. Theory 78, 2014.)

    For helical gears every slice of the face, at the coordinate y, has its own phase + y tan(beta_b) / p_bt, and the
    coast phase of the slice follows as above: coast flanks behave like drive flanks of gears of the opposite hand. Face
    coordinates are those of the drive flanks.

    Supports are modelled along the line of action of the drive flanks only: coast flanks are computed on rigid,
    parallel shafts.
    """
    pair, sizes = mesh.pair, mesh.resolution
    first, shift, play = _coast_phase(mesh)
    turned = prepare_from(first, pair.coast, mesh.compliance, sizes, None, mesh.even)
    pinion, wheel = modification
    removed = removed_material(turned, torque, pinion=pinion, wheel=wheel)
    order = (shift - jnp.arange(sizes.positions)) % sizes.positions
    return Flanks(turned, removed, order, play)


@program
def _coast_phase(mesh: Mesh):
    """First mesh position of the coast flanks, index of the position of the first drive position, and backlash."""
    pair, count = mesh.pair, mesh.resolution.positions
    secant = 1 / jnp.cos(pair.working_pressure_angle)
    thickness = [tooth_thickness(gear, 2 * gear.base_radius * secant) for gear in (pair.pinion, pair.wheel)]
    middle = 0.5 + (thickness[0] - thickness[1]) / (2 * pair.base_pitch * secant)
    first = mesh.resolution.first_phase
    places = (middle - mesh.kinematics.first_phase - first) * count
    shift = jnp.floor(places)
    return first + (places - shift) / count, shift.astype(int), mesh.margins.backlash


def static(flanks: Flanks, torque: Scalar, compliance: Scalar) -> Static:
    """Static contact of drive or coast flanks under a torque [N m], with a series compliance [um/N]."""
    cycle = solve_removed(flanks.mesh, torque, flanks.removed)
    found = Static(cycle.unloaded_transmission_error, cycle.transmission_error, cycle.tangent_stiffness, cycle.status)
    return _in_series(found, cycle.force, compliance, flanks.order)


@program
def _in_series(found: Static, force: Scalar, compliance: Scalar, order: Any) -> Static:
    """Static contact with the series compliance, in the order of the drive flanks."""
    loaded, stiffness = found.loaded + compliance * force, 1 / (1 / found.stiffness + compliance)
    return Static(*(part[order] for part in found._replace(loaded=loaded, stiffness=stiffness)))
