"""Involute relations in the roll length rho = sqrt(r^2 - r_b^2) [mm] (ISO 21771).

With t = rho / r_b = tan(alpha_y) the involute function is inv(alpha_y) = t - atan(t): no inverse cosine, so values and
derivatives stay finite at the base circle. Of a ring gear, radii and roll lengths are negative, as in ISO 21771: the
formulas of external gears then hold for it unchanged.
"""

from typing import Protocol, TypeVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Given, safe_sqrt

Real = Float[Array, "..."]
Scalar = Float[Array, ""]
Value = TypeVar("Value")


class Toothed(Protocol):
    """Properties of a gear that the involute relations use; meanings as in `Gear`."""

    @property
    def teeth(self) -> Scalar: ...

    @property
    def pressure_angle(self) -> Scalar: ...

    @property
    def transverse_pressure_angle(self) -> Scalar: ...

    @property
    def profile_shift(self) -> Scalar: ...

    @property
    def base_radius(self) -> Scalar: ...

    @property
    def thickness_angle(self) -> Scalar: ...

    def signed(self, value: Value) -> Value: ...


def involute(tangent: Real) -> Real:
    """Involute function inv(alpha) [rad] from tan(alpha)."""
    return tangent - jnp.arctan(tangent)


def half_tooth_angle(gear: Toothed, rho: Real) -> Real:
    """Angle between the tooth centreline and the involute at a roll length [mm], seen from the gear centre [rad]."""
    alpha, transverse = jnp.deg2rad(gear.pressure_angle), gear.transverse_pressure_angle
    pitch = (jnp.pi / 2 + 2 * gear.profile_shift * jnp.tan(alpha)) / gear.signed(gear.teeth)
    at_base = pitch + involute(jnp.tan(transverse))
    return at_base + gear.thickness_angle - involute(rho / gear.base_radius)


def load_angle(gear: Toothed, rho: Real) -> Real:
    """Angle between the normal to the involute at a roll length [mm] and the normal to the tooth centreline [rad].

    The normal is tangent to the base circle: it crosses the centreline at r_b / cos(angle).
    """
    return jnp.arctan(rho / gear.base_radius) - half_tooth_angle(gear, rho)


def tooth_thickness(gear: Toothed, diameter: Given) -> Real:
    """Thickness of the tooth as an arc [mm] on a diameter [mm] not below the base circle."""
    return half_tooth_angle(gear, roll_length(gear, diameter)) * gear.signed(diameter)


def roll_length(gear: Toothed, diameter: Given) -> Real:
    """Roll length [mm] of the involute point on a diameter [mm]; 0 below the base circle, negative for a ring gear."""
    return gear.signed(safe_sqrt((0.5 * diameter) ** 2 - gear.base_radius**2))


def roll_angle(gear: Toothed, rho: Given) -> Real:
    """Roll angle [deg] from the roll length [mm]."""
    return jnp.rad2deg(rho / gear.base_radius)


def diameter(gear: Toothed, rho: Given) -> Real:
    """Diameter [mm] of the involute point with a roll length [mm]."""
    return 2 * jnp.sqrt(gear.base_radius**2 + rho**2)
