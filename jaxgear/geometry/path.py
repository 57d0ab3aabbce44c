"""Path of contact: operating pressure angle, points A to E, contact ratio, sliding."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Checked, Given, bracketed_root, on_both, program, result
from .gear import Gear
from .involute import involute
from .outline import outline

Real = Float[Array, "..."]
Scalar = Float[Array, ""]

_WIDEST_ANGLE = 1.2  # rad; no gear pair works beyond about 45 degrees


class PathOfContact(Checked):
    """Points on the line of action, as `path` positions from the pitch point C [mm] (ISO 21771).

    Attributes:
        start: A, tip of the wheel meets the root of the pinion; form circle of the pinion (d_Ff = d_Nf) where that tip
            would reach below it, as it does on undercut teeth.
        inner_single: B, a preceding pair leaves contact at E; A where the contact ratio is below 1.
        outer_single: D, the following pair enters contact at A; E where the contact ratio is below 1.
        end: E, tip of the pinion leaves, or form circle of the wheel.
        base_pitch: of both gears.
        pinion_pitch_roll_length, wheel_pitch_roll_length: roll lengths of the two gears at C.
        pinion_base_radius, wheel_base_radius: base radii.
        start_shortened, end_shortened: lengths by which the form circles of pinion and wheel shorten the path, zero
            where it runs to the tip circle of the mate [mm].
    """

    start: Scalar = result("mm")
    inner_single: Scalar = result("mm")
    outer_single: Scalar = result("mm")
    end: Scalar = result("mm")
    base_pitch: Scalar = result("mm")
    pinion_pitch_roll_length: Scalar = result("mm")
    wheel_pitch_roll_length: Scalar = result("mm")
    pinion_base_radius: Scalar = result("mm")
    wheel_base_radius: Scalar = result("mm")
    start_shortened: Scalar = eqx.field(repr=False)
    end_shortened: Scalar = eqx.field(repr=False)

    @property
    def contact_ratio(self) -> Real:
        """Transverse contact ratio."""
        return (self.end - self.start) / self.base_pitch

    def pinion_roll_length(self, path: Given) -> Real:
        """Roll length of the pinion [mm], also its radius of curvature, at a path position [mm]."""
        return self.pinion_pitch_roll_length + path

    def wheel_roll_length(self, path: Given) -> Real:
        """Roll length of the wheel [mm], also its radius of curvature, at a path position [mm]."""
        return self.wheel_pitch_roll_length - path

    def rolling_speeds(self, path: Given, speed: Given) -> tuple[Real, Real]:
        """Speeds of the two surfaces through the contact [m/s] at a pinion speed [rpm]."""
        omega = speed * jnp.pi / 30
        ratio = self.pinion_base_radius / self.wheel_base_radius
        return self.pinion_roll_length(path) * omega * 1e-3, ratio * omega * self.wheel_roll_length(path) * 1e-3

    def sliding_speed(self, path: Given, speed: Given) -> Real:
        """Pinion surface speed minus wheel surface speed [m/s] at a pinion speed [rpm]; zero at the pitch point."""
        pinion, wheel = self.rolling_speeds(path, speed)
        return pinion - wheel

    def reduced_radius(self, path: Given) -> Real:
        """Reduced radius of curvature [mm], 1 / (1 / rho_pinion + 1 / rho_wheel)."""
        return reduced_radius(self.pinion_roll_length(path), self.wheel_roll_length(path))


def reduced_radius(first: Real, second: Real) -> Real:
    """Reduced radius of curvature of two cylinders, 1 / (1 / r_1 + 1 / r_2) [mm]."""
    return first * second / (first + second)


@program
def working_pressure_angle(pinion: Gear, wheel: Gear, center_distance: Real | None) -> Real:
    """Operating pressure angle [rad] at a centre distance [mm], or without backlash (None)."""
    if center_distance is not None:
        ratio = wheel.signed(pinion.base_radius + wheel.base_radius) / center_distance
        # the clip keeps a traced, impossible centre distance finite; a concrete one has been refused
        return jnp.arccos(jnp.minimum(ratio, 1.0 - 1e-6))
    return pressure_angle_of(backlash_free_involute(pinion, wheel))


def pressure_angle_of(target: Real) -> Real:
    """Pressure angle [rad] whose involute function is given [rad]."""
    low, high = jnp.full_like(target, 1e-3), jnp.full_like(target, jnp.tan(_WIDEST_ANGLE))
    return jnp.arctan(bracketed_root(_missing_involute, low, high, target))


def center_distance_at(base_radii: Real, target: Real) -> Real:
    """Centre distance (r_b1 + r_b2) / cos(alpha_w) [mm], positive, at the involute function inv(alpha_w) [rad]."""
    return jnp.abs(base_radii) / jnp.cos(pressure_angle_of(target))


def backlash_free_involute(pinion: Gear, wheel: Gear) -> Real:
    """Involute function of the backlash-free operating pressure angle of two gears [rad]."""
    return free_involute(
        pinion.profile_shift + wheel.profile_shift,
        pinion.teeth + wheel.signed(wheel.teeth),
        jnp.deg2rad(pinion.pressure_angle),
        pinion.transverse_pressure_angle,
    )


def free_involute(shift: Real, teeth: Real, normal: Real, transverse: Real) -> Real:
    """inv(alpha_wt) = inv(alpha_t) + 2 tan(alpha_n) (x1 + x2) / (z1 + z2) [rad] (ISO 21771)."""
    return involute(jnp.tan(transverse)) + 2 * jnp.tan(normal) * shift / teeth


def _missing_involute(tangent: Real, wanted: Real) -> Real:
    return involute(tangent) - wanted


@program
def path_between(
    pinion: Gear, wheel: Gear, center_distance: Scalar | None, forms: tuple[Scalar, Scalar] | None = None
) -> PathOfContact:
    """Path of contact at a centre distance [mm], or without backlash (None), limited by tip and form circles.

    Args:
        pinion, wheel: gears.
        center_distance: [mm].
        forms: roll lengths at the form circles of both, where they are known [mm].
    """
    tangent = jnp.tan(working_pressure_angle(pinion, wheel, center_distance))
    pinion_pitch, wheel_pitch = pinion.base_radius * tangent, wheel.base_radius * tangent
    start = wheel_pitch - wheel.tip_roll_length
    end = pinion.tip_roll_length - pinion_pitch
    pinion_form, wheel_form = on_both(_form_roll_length, pinion, wheel) if forms is None else forms
    start_shortened = jnp.maximum(pinion_form - pinion_pitch - start, 0.0)
    end_shortened = jnp.maximum(end - (wheel_pitch - wheel_form), 0.0)
    start, end = start + start_shortened, end - end_shortened
    return PathOfContact(
        start=start,
        inner_single=jnp.maximum(end - pinion.base_pitch, start),
        outer_single=jnp.minimum(start + pinion.base_pitch, end),
        end=end,
        base_pitch=pinion.base_pitch,
        pinion_pitch_roll_length=pinion_pitch,
        wheel_pitch_roll_length=wheel_pitch,
        pinion_base_radius=pinion.base_radius,
        wheel_base_radius=wheel.base_radius,
        start_shortened=start_shortened,
        end_shortened=end_shortened,
    )


def _form_roll_length(gear: Gear) -> Scalar:
    return outline(gear).form_roll_length
