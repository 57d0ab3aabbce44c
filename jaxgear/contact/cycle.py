"""The loaded mesh over one base pitch: what a solution holds, and its Hertzian pressure."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int8

from ..compliance.plane import combined_modulus
from ..geometry import Margins, reduced_radius
from ..microgeometry import AbstractModification
from ..numerics import over_batch, program, safe_sqrt
from .kinematics import Kinematics, Side
from .operating_point import OperatingPoint
from .status import WithStatus, reason

Load = Float[Array, "pairs slices positions"]
Curvature = Float[Array, "pairs #slices positions"]

# A concave flank is taken to be this much flatter than the involutes at most: one that fits its mate closer has no
# Hertzian contact.
FLATTEST = 0.1


@program
def pressures(kinematics: Kinematics, line_load: Load, relative_curvature: Curvature) -> tuple[Load, Load]:
    """`flank_pressure` and `corner_pressure`."""
    return flank_pressure(kinematics, line_load, relative_curvature), corner_pressure(kinematics, line_load)


def flank_pressure(kinematics: Kinematics, line_load: Load, relative_curvature: Curvature) -> Load:
    """p = sqrt(q E* / (pi R)) [MPa] with the local radii of both flanks; zero outside the path of contact.

    `relative_curvature` is the curvature 1 / R that modifications add, as a share of that of the involutes, over the
    contact width. At a kink, where the pressure is singular, that is its mean over the contact: finite elements have up
    to 55 % more there.

    E* is that of plane strain, the usual form, unless the compliance model is in plane stress throughout: 5 % less. The
    flanks of helical gears touch in the section normal to the contact line, R / cos(beta_b).
    """
    pinion, wheel = kinematics.sides
    reduced = reduced_radius(pinion.contact_roll_length, wheel.contact_roll_length)
    reduced = reduced / jnp.maximum(1 + relative_curvature, FLATTEST)
    return jnp.where(kinematics.outside <= 0, _hertz(kinematics, line_load, reduced), 0.0)


def corner_pressure(kinematics: Kinematics, line_load: Load) -> Load:
    """Pressure of the rounded edge of tip or undercut on the mate's involute [MPa]; zero on the path of contact.

    1 / R = 1 / tip edge radius + 1 / rho_mate, taken as an elastic cylinder on the flank: 7 % (edge radius 0.2 mm) to
    about 50 % (0.002 mm) above the exact solution of a rounded edge.
    """
    pinion, wheel = kinematics.sides
    of_wheel = kinematics.wheel_edge
    edge = jnp.where(of_wheel, wheel.gear.edge_radius, pinion.gear.edge_radius)
    mate = jnp.where(of_wheel, pinion.contact_roll_length, wheel.contact_roll_length)
    return jnp.where(kinematics.outside > 0, _hertz(kinematics, line_load, reduced_radius(edge, mate)), 0.0)


def _hertz(kinematics: Kinematics, line_load: Load, reduced) -> Load:
    pair = kinematics.pair
    modulus = combined_modulus(pair.pinion.material, pair.wheel.material, kinematics.plane)
    if kinematics.helical:
        reduced = reduced / jnp.cos(pair.pinion.base_helix_angle)
    return safe_sqrt(line_load * modulus / (jnp.pi * reduced))


Curve = Float[Array, " positions"]


class MeshCycle(WithStatus, eqx.Module):
    """Result of `solve`: one design under one torque, over one base pitch.

    It contains its pair, load and modifications, but not the prepared mesh (see `metrics.Analysis`), so that many can
    be stacked. Of many cycles made by `jax.vmap` every array has the batch axes in front, and so have properties and
    metrics.

    Attributes:
        kinematics: the pair, its path of contact and the array sizes.
        margins: distances of the pair from geometry that cannot run.
        operating_point: torque, speed and friction.
        pinion, wheel: modifications of the flanks; None where only the material removed was given (`solve_removed`).
        transmission_error: loaded, on the line of action, positive when the wheel lags [um], shape (positions,);
            with the deflection of shafts, bearings and housing, where the mesh was prepared with them.
        unloaded_transmission_error: the same at vanishing load [um].
        line_load: [N/mm], shape (pairs, slices, positions): force on the transverse line of action per face width,
            which of helical gears is the normal force per length of the contact line.
        pair_force: force on the line of action that every pair contributes [N], shape (pairs, positions); the pairs of
            a position sum to `force`.
        opening: remaining gap [um] where positive, minus the contact deflection where loaded.
        gap: gap of the undeformed flanks at zero transmission error [um]: corner gap plus both modifications, at the
            shifted contact, on rigid, parallel shafts.
        shift: contact shift: of the centre of contact along the flanks, by the slope of the modifications, positive
            towards the pinion tip [mm]; shape (pairs, slices or 1, positions).
        relative_curvature: curvature that the modifications add, times the relative radius of the flanks; of the same
            shape.
        tangent_stiffness: d force / d transmission error at fixed position [N/um].
        residual: largest relative violation of the contact conditions, shape (positions,).
        status: of every position, see `Status`, shape (positions,): `converged` where the residual is below the
            resolution's rtol, no pair beyond those carried along could touch, and gears and support are possible.
    """

    kinematics: Kinematics
    margins: Margins
    operating_point: OperatingPoint
    pinion: AbstractModification | None
    wheel: AbstractModification | None
    transmission_error: Curve
    unloaded_transmission_error: Curve
    line_load: Load
    pair_force: Float[Array, "pairs positions"]
    opening: Load
    gap: Load
    shift: Float[Array, "pairs #slices positions"]
    relative_curvature: Float[Array, "pairs #slices positions"]
    tangent_stiffness: Curve
    residual: Curve
    status: Int8[Array, " positions"]

    @property
    def batch_ndim(self) -> int:
        """Number of leading batch axes."""
        return self.transmission_error.ndim - 1

    @property
    def phase(self) -> Curve:
        """Mesh position in base pitches, shape (positions,) without batch axes."""
        return self.kinematics.phase

    @property
    def torque(self) -> Float[Array, "*cycles"]:
        """On the pinion [N m]."""
        return self.operating_point.torque

    @property
    def force(self) -> Float[Array, "*cycles"]:
        """Total force on the line of action [N]."""
        return 1e3 * self.torque / self.kinematics.pair.pinion.base_radius

    @property
    def sides(self) -> tuple[Side, Side]:
        """Pinion's and wheel's side of every contact."""
        return self.kinematics.sides

    @property
    @over_batch
    def contact_pressure(self) -> Load:
        """Largest Hertzian pressure on the flank [MPa]; zero where the pair is apart or touches with a tip corner.

        p = sqrt(q E* / (pi R)) (Hertz) with the curvature 1 / R of both involutes and of what is removed from them, in
        plane strain unless the compliance model is in plane stress throughout.
        """
        return pressures(self.kinematics.explicit, self.line_load, self.relative_curvature)[0]

    @property
    @over_batch
    def corner_pressure(self) -> Load:
        """Hertzian pressure of the tip edge on the mate's flank [MPa]; zero on the theoretical path of contact."""
        return pressures(self.kinematics.explicit, self.line_load, self.relative_curvature)[1]

    def __str__(self) -> str:
        if self.batch_ndim:
            fine = np.asarray(self.converged).all(axis=-1)
            failed = f", {np.sum(~fine)} of {fine.size} NOT CONVERGED ({reason(self.status)})" if not fine.all() else ""
            return f"{self.transmission_error.shape[:-1]} of MeshCycle, {self.phase.shape[0]} positions{failed}"
        error, pressure = np.asarray(self.transmission_error), np.asarray(self.contact_pressure)
        corner = np.asarray(self.corner_pressure)
        state = "converged" if np.all(self.converged) else f"NOT CONVERGED ({reason(self.status)})"
        return "\n".join(
            [
                f"MeshCycle at {float(self.torque):g} N m, {len(error)} positions, {state}",
                f"  transmission error   mean {error.mean():.3f} um, peak to peak {np.ptp(error):.3f} um",
                f"  flank pressure       max {pressure.max():.0f} MPa, tip corners {corner.max():.0f} MPa",
                f"  mesh stiffness       mean {np.mean(self.tangent_stiffness):.1f} N/um",
                f"  contact ratio        {float(self.kinematics.path_of_contact.contact_ratio):.3f}",
                *[f"  overlap ratio        {float(self.kinematics.pair.overlap_ratio):.3f}"] * self.kinematics.helical,
            ]
        )
