"""The rack-generated tooth outline: trochoid fillet joined to the involute, undercut included.

Tooth frame: origin in the gear centre, y along the tooth centreline, x to the side. The trochoid is the equidistant of
the path of the rack's tip arc centre, in the parameter g, the inclination of the common normal: g = pi/2 on the root
circle, g = pressure angle where a tooth without undercut passes into the involute.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Checked, bracketed_root, program, result
from .gear import Gear
from .involute import half_tooth_angle

Real = Float[Array, "..."]
Scalar = Float[Array, ""]


class Outline(Checked):
    """One flank of the generated tooth.

    Attributes:
        gear: the gear.
        junction: trochoid parameter where fillet and involute meet [rad].
        form_roll_length: roll length there [mm], the start of the usable involute (ISO 21771 d_Ff).
        root_half_angle: half angle subtended by the tooth at the root circle, theta_f [rad].
        undercut: 1 where the trochoid cuts the involute off above the base circle, else 0.
    """

    gear: Gear
    junction: Scalar = result("rad")
    form_roll_length: Scalar = result("mm")
    root_half_angle: Scalar = result("rad")
    undercut: Scalar = result()

    @property
    def junction_height(self) -> Scalar:
        """y of the junction [mm]."""
        return trochoid(self.gear, self.junction)[1]

    @property
    def root_height(self) -> Scalar:
        """y of the root end of the trochoid [mm], r_f cos(theta_f)."""
        return self.gear.root_circle_radius * jnp.cos(self.root_half_angle)


@program
def outline(gear: Gear) -> Outline:
    """Generates the outline of one gear.

    Equations: the trochoid of the rack's tip arc in the frame of the tooth centreline, as in ISO 6336-3 (tool tip
        centre
    E) written as a curve; its junction angle equals the involute's half tooth angle at d_Ff (ISO 21771).
    """
    alpha = jnp.deg2rad(gear.pressure_angle)
    end_x, end_y = trochoid(gear, jnp.full_like(alpha, jnp.pi / 2))
    tangential = _tangential_form_roll_length(gear)
    # at the limit of undercut both junctions lie on the base circle; rounding must not choose between them
    undercut = tangential < -8 * jnp.finfo(tangential.dtype).eps * gear.pitch_radius
    cut = _undercut_junction(gear)
    junction = jnp.where(undercut, cut, alpha)
    x, y = trochoid(gear, cut)
    rho_cut = jnp.sqrt(jnp.maximum(x**2 + y**2 - gear.base_radius**2, (1e-6 * gear.base_radius) ** 2))
    form = jnp.where(undercut, rho_cut, jnp.maximum(tangential, 0.0))
    return Outline(gear, junction, form, jnp.arctan2(end_x, end_y), undercut.astype(form.dtype))


def rack_tip(gear: Gear) -> tuple[Scalar, Scalar, Scalar]:
    """Centre of the rack's tip arc: distance from the tooth centreline [mm], depth below the pitch line, and radius."""
    alpha, m = jnp.deg2rad(gear.pressure_angle), gear.module
    tip = gear.root_radius * m
    from_rack_centre = jnp.pi * m / 4 - gear.dedendum * m * jnp.tan(alpha) - (1 - jnp.sin(alpha)) * tip / jnp.cos(alpha)
    return jnp.pi * m / 2 - from_rack_centre, (gear.dedendum - gear.profile_shift) * m - tip, tip


def trochoid(gear: Gear, g: Real) -> tuple[Real, Real]:
    """Point (x, y) [mm] of the fillet at the parameter g [rad]."""
    offset, depth, tip = rack_tip(gear)
    r = gear.pitch_radius
    phi = (depth / jnp.tan(g) + offset) / r
    distance = depth / jnp.sin(g) + tip
    return r * jnp.sin(phi) - distance * jnp.cos(g - phi), r * jnp.cos(phi) - distance * jnp.sin(g - phi)


def involute_point(gear: Gear, rho: Real) -> tuple[Real, Real]:
    """Point (x, y) [mm] of the involute at a roll length [mm]."""
    r, gamma = jnp.sqrt(gear.base_radius**2 + rho**2), half_tooth_angle(gear, rho)
    return r * jnp.sin(gamma), r * jnp.cos(gamma)


def _tangential_form_roll_length(gear: Gear) -> Scalar:
    """Roll length of the junction at g = pressure angle [mm]; negative where the tooth is undercut."""
    alpha = jnp.deg2rad(gear.pressure_angle)
    straight = gear.dedendum - gear.profile_shift - gear.root_radius * (1 - jnp.sin(alpha))
    return gear.pitch_radius * jnp.sin(alpha) - straight * gear.module / jnp.sin(alpha)


def _undercut_junction(gear: Gear) -> Scalar:
    """Trochoid parameter where the fillet crosses the involute of an undercut tooth."""
    alpha = jnp.deg2rad(gear.pressure_angle)
    top, bottom = alpha, jnp.full_like(alpha, jnp.pi / 2)
    at_base = jax.lax.stop_gradient(bracketed_root(_height_above_base, top, bottom, gear))
    return bracketed_root(_angle_outside_involute, top, at_base, gear)


# functions of the module, not of a call: a root search compiles once for each function that it is given
def _height_above_base(g: Real, gear: Gear) -> Real:
    x, y = trochoid(gear, g)
    return jnp.sqrt(x**2 + y**2) - gear.base_radius


def _angle_outside_involute(g: Real, gear: Gear) -> Real:
    x, y = trochoid(gear, g)
    squared = x**2 + y**2 - gear.base_radius**2
    rho = jnp.sqrt(jnp.maximum(squared, (1e-9 * gear.base_radius) ** 2))
    return jnp.arctan2(x, y) - half_tooth_angle(gear, rho)
