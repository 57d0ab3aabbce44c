"""Generation by a pinion-type cutter: rolling with the gear, and position of its tip rounding.

The cutter is a gear of the same basic rack; it rolls without backlash with the gear that it cuts. Tooth numbers may be
signed: they are negative for an internal gear, as in ISO 21771.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

# of NumPy or of JAX, as the numbers are that they are made of
Number = Any

_NEWTON_STEPS = 7  # from the third root of three times the involute function, to double precision below 70 degrees
_ROUNDING_STEPS = 12
_LEAST_INVOLUTE = 1e-6  # keeps a traced, impossible mesh finite


class Cutter(NamedTuple):
    """A cutter and its mesh with the gear that it cuts.

    Attributes:
        tangent: tan(alpha_w0) of the generating pressure angle, with
            inv(alpha_w0) = inv(alpha) + 2 tan(alpha) (x_E + x_0) / (z + z_0).
        gear_pitch_radius, pitch_radius: generating pitch radii r_w of the gear and r_w0 of the cutter [mm].
        gear_base_radius, base_radius: base radii r_b and r_b0 [mm].
        tip_radius: tip radius of the cutter r_a0 = m (z_0 / 2 + x_0 + h_a0) [mm].
        rounding: radius rho_a0 of its tip's rounding [mm].
        center_radius: radius c_0 = r_a0 - rho_a0 of the rounding's centre [mm].
        gap_angle: angle at the cutter's axis from the middle of its space to the centre of the rounding [rad]. The
            centre lies on the involute that is parallel to the flank, at the distance rho_a0 inside of the tooth.
        pitch_angle: half the angular pitch of the cutter, upper limit of `gap_angle` [rad].
    """

    tangent: Number
    gear_pitch_radius: Number
    pitch_radius: Number
    gear_base_radius: Number
    base_radius: Number
    tip_radius: Number
    rounding: Number
    center_radius: Number
    gap_angle: Number
    pitch_angle: Number

    @property
    def center_distance(self) -> Number:
        """Generating centre distance a_0 = m (z + z_0) cos(alpha) / (2 cos(alpha_w0)) [mm]."""
        return self.gear_pitch_radius + self.pitch_radius

    @property
    def root_circle_radius(self) -> Number:
        """Root circle radius of the gear, r_f = a_0 - r_a0 [mm]."""
        return self.center_distance - self.tip_radius

    @property
    def depth(self) -> Number:
        """Depth of the rounding's centre, c_0 - r_w0, positive outside the cutter's pitch circle [mm]."""
        return self.center_radius - self.pitch_radius

    @property
    def offset(self) -> Number:
        """Arc on the cutter's pitch circle from the middle of its space to the centre of the rounding [mm]."""
        return self.pitch_radius * self.gap_angle

    @property
    def line_length(self) -> Number:
        """Length of the line of action between both base circles, (r_b + r_b0) tan(alpha_w0) [mm].

        It is the roll length of the gear at which the base circle of the cutter, the end of its involute, touches.
        """
        return (self.gear_base_radius + self.base_radius) * self.tangent

    @property
    def involute_roll_length(self) -> Number:
        """Roll length of the cutter at which its involute ends and its rounding begins [mm]."""
        of = _library(self.base_radius)
        own = of.maximum(self.center_radius**2 - self.base_radius**2, (1e-6 * self.base_radius) ** 2)
        return of.sqrt(own) + self.rounding

    @property
    def form_roll_length(self) -> Number:
        """Roll length of the gear at which fillet and involute meet [mm]; negative in undercut."""
        return self.line_length - self.involute_roll_length

    @property
    def involute_radius(self) -> Number:
        """Radius of the cutter at which its involute ends and its rounding begins [mm]."""
        return _library(self.base_radius).sqrt(self.base_radius**2 + self.involute_roll_length**2)

    @property
    def tip_half_width(self) -> Number:
        """Half the tip width between its roundings, as an arc through their centres [mm]; 0 for a tip of one arc."""
        return self.center_radius * (self.pitch_angle - self.gap_angle)


def rolling(
    teeth: Number,
    cutter_teeth: Number,
    *,
    module: Number,
    pressure_angle: Number,
    generating_shift: Number,
    cutter_shift: Number,
    radius: Number,
    height: Number | None = None,
    root_circle_radius: Number | None = None,
) -> Cutter:
    """Cutter in mesh with a gear, in the transverse section.

    Args:
        teeth, cutter_teeth: numbers of teeth z and z_0.
        module: module [mm].
        pressure_angle: pressure angle of the basic rack [deg].
        generating_shift, cutter_shift: profile shift coefficients x_E of the gear and x_0 of the cutter.
        radius: tip radius rho_a0 of the cutter, in modules.
        height: addendum h_a0 of the cutter, in modules; None for the one that reaches the root circle.
        root_circle_radius: root circle radius of the gear, where the addendum of the cutter is None [mm].
    """
    of = _library(module)
    alpha = of.deg2rad(pressure_angle)
    tangent, cosine = of.tan(alpha), of.cos(alpha)
    shift = generating_shift + cutter_shift
    working = _tangent_of(_involute(tangent) + 2 * tangent * shift / (teeth + cutter_teeth))
    secant = of.sqrt(1 + working**2)
    reference, base = 0.5 * module * cutter_teeth, 0.5 * module * cutter_teeth * cosine
    gear_base = 0.5 * module * teeth * cosine
    rounding = module * radius
    # the rounding's centre above the reference circle
    if height is None:
        above = (gear_base + base) * secant - root_circle_radius - reference - rounding
    else:
        above = module * (cutter_shift + height) - rounding
    center = reference + above
    # inv(alpha_c) - inv(alpha) without a difference of large cutters' nearly equal numbers
    own = of.sqrt(of.maximum((center / base) ** 2 - 1, 1e-12))
    apart = above * (center + reference) / (base**2 * (own + tangent))
    rise = apart - of.arctan(apart / (1 + own * tangent))
    gap = (0.5 * np.pi - 2 * cutter_shift * tangent) / cutter_teeth + rounding / base + rise
    return Cutter(
        working,
        gear_base * secant,
        base * secant,
        gear_base,
        base,
        center + rounding,
        rounding,
        center,
        gap,
        np.pi / cutter_teeth,
    )


def full_rounding(cutter_teeth: Number, pressure_angle: Number, cutter_shift: Number, height: Number) -> Number:
    """Full tip radius of the cutter, in modules; negative for a pointed tooth.

    If the centre of the full radius would lie inside the base circle, the radius with its centre on the base circle is
    returned.
    """
    of = _library(cutter_teeth)
    alpha = of.deg2rad(pressure_angle)
    tangent, base = of.tan(alpha), 0.5 * cutter_teeth * of.cos(alpha)
    tip = 0.5 * cutter_teeth + cutter_shift + height
    at_base = (0.5 * np.pi + 2 * cutter_shift * tangent) / cutter_teeth + _involute(tangent)
    most = tip - base
    radius = of.zeros_like(tip)
    for _ in range(_ROUNDING_STEPS):  # the half angle at the centre falls, more and more: from above it converges
        own = of.sqrt(of.maximum(((tip - radius) / base) ** 2 - 1, 1e-12))
        left = base * (at_base - _involute(own)) - radius
        radius = of.minimum(radius + left / (1 - own / of.sqrt(1 + own**2)), most)
    return radius


def cutter_contact(
    g: Number, pitch_radius: Number, cutter_radius: Number, offset: Number, depth: Number
) -> tuple[Number, Number]:
    """Contact of the tip arc of the cutter with the fillet, on a common normal with the inclination g.

    L = -r_w0 sin(g) + sqrt(c_0^2 - r_w0^2 cos(g)^2), computed without cancellation (depth / sin(g) for a rack), and
    phi = (r_w0 theta + offset) / r_w with theta = atan2(L cos(g), r_w0 + L sin(g)). The inclination of the normal of
    the fillet is g - phi.

    Args:
        g: inclination of the normal to the tangent of the pitch circles [rad].
        pitch_radius, cutter_radius: generating pitch radii r_w of the gear and r_w0 of the cutter [mm].
        offset: arc on the pitch circle of the cutter from the middle of its space to the centre of its rounding [mm].
        depth: radial distance c_0 - r_w0 of the centre of the rounding outside the pitch circle of the cutter [mm].

    Returns:
        distance L from the pitch point to the centre of the rounding [mm], and angle phi of the pitch point from the
        middle of the tooth of the gear [rad].
    """
    of = _library(depth)
    power, along = depth * (2 * cutter_radius + depth), cutter_radius * of.sin(g)
    reach = power / (along + of.sqrt(of.maximum(along**2 + power, (1e-6 * cutter_radius) ** 2)))
    theta = of.arctan2(reach * of.cos(g), cutter_radius + reach * of.sin(g))
    return reach, (cutter_radius * theta + offset) / pitch_radius


def _tangent_of(involute: Number) -> Number:
    """tan(alpha) of inv(alpha) [rad], of NumPy's or JAX's numbers; derivatives of all orders are those of the root."""
    of = _library(involute)
    wanted = of.maximum(involute, _LEAST_INVOLUTE)
    tangent = (3 * wanted) ** (1 / 3)
    for _ in range(_NEWTON_STEPS):
        tangent = tangent - (_involute(tangent) - wanted) * (1 + tangent**2) / tangent**2
    return tangent


def _involute(tangent: Number) -> Number:
    return tangent - _library(tangent).arctan(tangent)


def _library(number: Number) -> Any:
    return jnp if isinstance(number, jax.Array) else np
