"""The tooth outline that a rack or a cutter generates: trochoid fillet joined to the involute, undercut included.

Of helical gears it is that of the transverse section. The basic rack is that of the normal section: in the transverse
one it is 1 / cos(beta) times as long along its pitch line, which makes an ellipse of the circle at its tip.

Tooth frame: origin in the gear centre, y along the tooth centreline, x to the side. The trochoid is the envelope of the
rack's tip, in the parameter g, the inclination of the common normal, which runs through the pitch point: g = pi/2 on
the root circle, g = pressure angle where a tooth without undercut passes into the involute. A protuberance of the tool
cuts that involute off higher up. Its flank is where the tip arc ends; there the normal keeps its direction, and g below
the inclination of that flank counts the way along it.

The trochoid of a pinion-type cutter is the envelope of the arc at its tip, in the same parameter; the pitch point is
then that of cutter and gear, and the junction without undercut at their generating pressure angle. A rack is a cutter
with infinitely many teeth.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Checked, bracketed_root, program, result
from .cutter import cutter_contact
from .gear import Gear, virtual_gear
from .involute import half_tooth_angle, involute

Real = Float[Array, "..."]
Scalar = Float[Array, ""]

_LEAST_PROTUBERANCE = 1e-6  # beyond the grinding allowance [modules]
# depth along the flank of a protuberance [modules per rad of the parameter], and the least parameter there [rad]
_CLIMB, _ALONG_PROTUBERANCE = 10.0, 1e-3


class Curves(NamedTuple):
    """Numbers that define trochoid and involute of one gear.

    They are evaluated once and given the shape of all points (`over`): a derivative then sums over the points once for
    each of these numbers, instead of wherever a number meets a point, and each sum is a loop to compile.

    Attributes:
        pitch_radius: generating pitch radius of the gear [mm].
        base_radius: base radius [mm].
        base_half_angle: half tooth angle on the base circle [rad].
        tip_roll_length: roll length where the involute ends [mm].
        offset, depth, rounding: `rack_tip` [mm].
        stretch: 1 / cos(beta), length of the transverse rack over that of the normal one; None of a spur gear.
        lean: inclination of the flank of the tool's protuberance [rad]; None without protuberance.
        climb: depth along that flank over g [mm/rad]; likewise.
        cutter_radius: generating pitch radius of the cutter [mm]; None for a rack.
    """

    pitch_radius: Real
    base_radius: Real
    base_half_angle: Real
    tip_roll_length: Real
    offset: Real
    depth: Real
    rounding: Real
    stretch: Real | None = None
    lean: Real | None = None
    climb: Real | None = None
    cutter_radius: Real | None = None

    def over(self, shape: tuple[int, ...]) -> "Curves":
        """Curves with all numbers broadcast to the shape of the points."""
        drawn: Curves = jax.tree.map(lambda number: jnp.broadcast_to(number, shape), self)
        return drawn

    def trochoid(self, g: Real) -> tuple[Real, Real]:
        """Point (x, y) [mm] of the fillet at the parameter g [rad]."""
        r, along, depth, rounding = self.pitch_radius, self.offset, self.depth, self.rounding
        if self.lean is not None and self.climb is not None:
            up = self.climb * jnp.maximum(self.lean - g, 0.0)
            along, depth, g = along - up * jnp.tan(self.lean), depth - up, jnp.maximum(g, self.lean)
        if self.cutter_radius is not None:
            reach, phi = self.cutter_contact(g)
            return self._along_normal(g, phi, reach + rounding)
        if self.stretch is not None:  # support point of the ellipse, with half axes of stretch x rounding and rounding
            rounding = rounding / jnp.sqrt((self.stretch * jnp.cos(g)) ** 2 + jnp.sin(g) ** 2)
            along = along - (self.stretch**2 - 1) * rounding * jnp.cos(g)
        phi = (depth / jnp.tan(g) + along) / r
        return self._along_normal(g, phi, depth / jnp.sin(g) + rounding)

    def cutter_contact(self, g: Real) -> tuple[Real, Real]:
        """`cutter_contact` at the parameter g, of a gear that a cutter generates."""
        return cutter_contact(g, self.pitch_radius, self.cutter_radius, self.offset, self.depth)

    def _along_normal(self, g: Real, phi: Real, distance: Real) -> tuple[Real, Real]:
        """Point (x, y) at a distance from the pitch point, which is at the angle phi from the centreline [rad]."""
        r = self.pitch_radius
        return r * jnp.sin(phi) - distance * jnp.cos(g - phi), r * jnp.cos(phi) - distance * jnp.sin(g - phi)

    def half_angle(self, rho: Real) -> Real:
        """`half_tooth_angle` [rad] at a roll length [mm]."""
        return self.base_half_angle - involute(rho / self.base_radius)

    def involute(self, rho: Real) -> tuple[Real, Real]:
        """Point (x, y) [mm] of the involute at a roll length [mm]."""
        r, gamma = jnp.sqrt(self.base_radius**2 + rho**2), self.half_angle(rho)
        return r * jnp.sin(gamma), r * jnp.cos(gamma)


class Outline(Checked):
    """One flank of the generated tooth.

    Attributes:
        gear: the gear.
        curves: numbers that define fillet and involute.
        junction: trochoid parameter where fillet and involute meet [rad].
        form_roll_length: roll length there [mm], the start of the usable involute (ISO 21771 d_Ff).
        root_half_angle: half angle subtended by the tooth at the root circle, theta_f [rad].
        undercut: 1 where the trochoid cuts the involute off above the base circle, else 0.
        normal: of a helical gear that of its `virtual_gear`; None of a spur gear.
    """

    gear: Gear
    curves: Curves = eqx.field(repr=False)
    junction: Scalar = result("rad")
    form_roll_length: Scalar = result("mm")
    root_half_angle: Scalar = result("rad")
    undercut: Scalar = result()
    normal: "Outline | None" = eqx.field(default=None, repr=False)

    @property
    def junction_height(self) -> Scalar:
        """y of the junction [mm]."""
        return self.curves.trochoid(self.junction)[1]

    @property
    def root_height(self) -> Scalar:
        """y of the root end of the trochoid [mm], r_f cos(theta_f)."""
        return self.gear.root_circle_radius * jnp.cos(self.root_half_angle)

    @property
    def root_chord(self) -> Scalar:
        """Thickness of the tooth at the root circle [mm], 2 r_f sin(theta_f)."""
        return 2 * self.gear.root_circle_radius * jnp.sin(self.root_half_angle)


@program
def outline(gear: Gear) -> Outline:
    """Generates the outline of one gear, in the transverse section.

    Equations: the trochoid of the tool's tip arc in the frame of the tooth centreline, as in ISO 6336-3 (tool tip
    centre E) written as a curve; its junction angle equals the involute's half tooth angle at d_Ff (ISO 21771).
    """
    alpha, drawn = _generating_angle(gear), curves(gear)
    end_x, end_y = drawn.trochoid(jnp.full_like(alpha, jnp.pi / 2))
    tangential = _tangential_form_roll_length(gear)
    # at the limit of undercut both junctions lie on the base circle; rounding must not choose between them
    undercut = tangential < -8 * jnp.finfo(tangential.dtype).eps * gear.pitch_radius
    at_base = bracketed_root(_height_above_base, alpha, jnp.full_like(alpha, jnp.pi / 2), drawn)
    if gear.protuberance is None:
        cut = bracketed_root(_angle_outside_involute, alpha, at_base, drawn)
    else:
        highest, lowest = jnp.full_like(alpha, _ALONG_PROTUBERANCE), jnp.where(undercut, at_base, alpha)
        cut = bracketed_root(_angle_outside_involute, highest, lowest, drawn)
    x, y = drawn.trochoid(cut)
    form = jnp.sqrt(jnp.maximum(x**2 + y**2 - gear.base_radius**2, (1e-6 * gear.base_radius) ** 2))
    if gear.protuberance is None:
        cut = jnp.where(undercut, cut, alpha)
        form = jnp.where(undercut, form, jnp.maximum(tangential, 0.0))
    normal = None if gear.helix_angle is None else outline(virtual_gear(gear))
    return Outline(gear, drawn, cut, form, jnp.arctan2(end_x, end_y), undercut.astype(form.dtype), normal)


def curves(gear: Gear) -> Curves:
    """The numbers that the outline of a gear is drawn by."""
    at_base = half_tooth_angle(gear, jnp.zeros_like(gear.base_radius))
    stretch = None if gear.helix_angle is None else 1 / gear.helix_cosine
    cutter = gear.cutter
    if cutter is not None:
        drawn = cutter.offset, cutter.depth, cutter.rounding
        roll = cutter.gear_pitch_radius
        return Curves(roll, gear.base_radius, at_base, gear.tip_roll_length, *drawn, cutter_radius=cutter.pitch_radius)
    lean, climb = None, None
    if gear.protuberance is not None:
        lean = jnp.arctan(jnp.tan(0.5 * jnp.deg2rad(gear.pressure_angle)) / gear.helix_cosine)
        climb = _CLIMB * gear.module
    drawn = rack_tip(gear)
    return Curves(gear.pitch_radius, gear.base_radius, at_base, gear.tip_roll_length, *drawn, stretch, lean, climb)


def rack_tip(gear: Gear) -> tuple[Scalar, Scalar, Scalar]:
    """Centre of the rack's tip arc: distance from the tooth centreline [mm], depth below the pitch line, and radius.

    The distance is that of the transverse section; the arc is a circle of that radius in the normal section.
    """
    alpha, m = jnp.deg2rad(gear.pressure_angle), gear.module
    tip, pitch = gear.root_radius * m, jnp.pi * m
    from_rack_centre = pitch / 4 - gear.dedendum * m * jnp.tan(alpha) - (1 - jnp.sin(alpha)) * tip / jnp.cos(alpha)
    if gear.protuberance is not None:
        allowance = 0.0 if gear.grinding_allowance is None else 1e-3 * gear.grinding_allowance
        # where both are equal the flank is tangent to the fillet, and the derivative of their junction infinite
        protruding = jnp.maximum(gear.protuberance * m, allowance + _LEAST_PROTUBERANCE * m)
        from_rack_centre = from_rack_centre + protruding / jnp.cos(alpha)
    from_centreline = (pitch / 2 - from_rack_centre) / gear.helix_cosine
    return from_centreline, (gear.dedendum - gear.generating_profile_shift) * m - tip, tip


def trochoid(gear: Gear, g: Real) -> tuple[Real, Real]:
    """Point (x, y) [mm] of the fillet at the parameter g [rad]."""
    return curves(gear).over(jnp.shape(g)).trochoid(g)


def involute_point(gear: Gear, rho: Real) -> tuple[Real, Real]:
    """Point (x, y) [mm] of the involute at a roll length [mm]."""
    return curves(gear).over(jnp.shape(rho)).involute(rho)


def _generating_angle(gear: Gear) -> Scalar:
    """Parameter g at which fillet and involute meet without undercut [rad]: alpha_t, or alpha_w0 of a cutter."""
    return gear.transverse_pressure_angle if gear.cutter is None else jnp.arctan(gear.cutter.tangent)


def _tangential_form_roll_length(gear: Gear) -> Scalar:
    """Roll length of the junction at g = pressure angle [mm], of d_Ff in ISO 21771; negative in undercut."""
    if gear.cutter is not None:
        return gear.cutter.form_roll_length
    alpha, rounded = gear.transverse_pressure_angle, 1 - jnp.sin(jnp.deg2rad(gear.pressure_angle))
    straight = gear.dedendum - gear.generating_profile_shift - gear.root_radius * rounded
    return gear.pitch_radius * jnp.sin(alpha) - straight * gear.module / jnp.sin(alpha)


# functions of the module, not of a call: a root search compiles once for each function that it is given
def _height_above_base(g: Real, drawn: Curves) -> Real:
    x, y = drawn.trochoid(g)
    return jnp.sqrt(x**2 + y**2) - drawn.base_radius


def _angle_outside_involute(g: Real, drawn: Curves) -> Real:
    x, y = drawn.trochoid(g)
    squared = x**2 + y**2 - drawn.base_radius**2
    rho = jnp.sqrt(jnp.maximum(squared, (1e-9 * drawn.base_radius) ** 2))
    return jnp.arctan2(x, y) - drawn.half_angle(rho)
