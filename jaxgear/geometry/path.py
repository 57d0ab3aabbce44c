"""The path of contact: points A to E, contact ratio, sliding and rolling."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .pair import GearPair

Real = Float[Array, "..."]
Scalar = Float[Array, ""]


class PathOfContact(eqx.Module):
    """Points on the line of action, as `path` positions from the pitch point C [mm] (ISO 21771).

    Attributes:
        start: A, tip of the wheel meets the root of the pinion.
        inner_single: B, a preceding pair leaves contact at E.
        outer_single: D, the following pair enters contact at A.
        end: E, tip of the pinion leaves.
        base_pitch: [mm].
        pinion_pitch_roll_length, wheel_pitch_roll_length: roll lengths of the two gears at C [mm].
        pinion_base_radius, wheel_base_radius: [mm].
    """

    start: Scalar
    inner_single: Scalar
    outer_single: Scalar
    end: Scalar
    base_pitch: Scalar
    pinion_pitch_roll_length: Scalar
    wheel_pitch_roll_length: Scalar
    pinion_base_radius: Scalar
    wheel_base_radius: Scalar

    @property
    def contact_ratio(self) -> Scalar:
        """Transverse contact ratio."""
        return (self.end - self.start) / self.base_pitch

    def pinion_roll_length(self, path: Real) -> Real:
        """Roll length of the pinion [mm], also its radius of curvature, at a path position [mm]."""
        return self.pinion_pitch_roll_length + path

    def wheel_roll_length(self, path: Real) -> Real:
        """Roll length of the wheel [mm], also its radius of curvature, at a path position [mm]."""
        return self.wheel_pitch_roll_length - path

    def rolling_speeds(self, path: Real, speed: Real) -> tuple[Real, Real]:
        """Speeds of the two surfaces through the contact [m/s] at a pinion speed [rpm]."""
        omega = speed * jnp.pi / 30
        ratio = self.pinion_base_radius / self.wheel_base_radius
        return omega * self.pinion_roll_length(path) * 1e-3, omega * ratio * self.wheel_roll_length(path) * 1e-3

    def sliding_speed(self, path: Real, speed: Real) -> Real:
        """Pinion surface speed minus wheel surface speed [m/s] at a pinion speed [rpm]; zero at the pitch point."""
        pinion, wheel = self.rolling_speeds(path, speed)
        return pinion - wheel

    def reduced_radius(self, path: Real) -> Real:
        """Reduced radius of curvature [mm], 1 / (1 / rho_pinion + 1 / rho_wheel)."""
        pinion, wheel = self.pinion_roll_length(path), self.wheel_roll_length(path)
        return pinion * wheel / (pinion + wheel)


def path_of_contact(pair: GearPair) -> PathOfContact:
    """Path of contact of a pair, limited by the two tip circles."""
    tangent = jnp.tan(pair.working_pressure_angle)
    pinion, wheel = pair.pinion, pair.wheel
    pinion_pitch, wheel_pitch = pinion.base_radius * tangent, wheel.base_radius * tangent
    start = wheel_pitch - wheel.tip_roll_length
    end = pinion.tip_roll_length - pinion_pitch
    return PathOfContact(
        start=start,
        inner_single=end - pair.base_pitch,
        outer_single=start + pair.base_pitch,
        end=end,
        base_pitch=pair.base_pitch,
        pinion_pitch_roll_length=pinion_pitch,
        wheel_pitch_roll_length=wheel_pitch,
        pinion_base_radius=pinion.base_radius,
        wheel_base_radius=wheel.base_radius,
    )
