"""Two gears on their operating centre distance."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import bracketed_root, optional_real
from .gear import Gear
from .involute import involute

Scalar = Float[Array, ""]


class GearPair(eqx.Module):
    """Pinion (driving) and wheel (driven).

    Attributes:
        pinion: driving gear.
        wheel: driven gear.
        center_distance: operating centre distance [mm]; None for the backlash-free one of the nominal tooth
            thicknesses.

    Raises:
        ValueError: for gears that do not share module or pressure angle, an impossible centre distance, a contact ratio
            below 1, or a tip that touches the mate's flank below its form circle.
    """

    pinion: Gear
    wheel: Gear
    center_distance: Scalar | None = eqx.field(converter=optional_real, default=None)

    def __check_init__(self):
        from .validity import check_pair

        check_pair(self)

    @property
    def working_pressure_angle(self) -> Scalar:
        """Operating pressure angle [rad]."""
        radii = self.pinion.base_radius + self.wheel.base_radius
        if self.center_distance is not None:
            ratio = radii / self.center_distance
            # the clip keeps a traced, impossible centre distance finite; a concrete one has been refused
            return jnp.arccos(jnp.minimum(ratio, 1.0 - 1e-6))
        return _backlash_free_angle(self)

    @property
    def working_center_distance(self) -> Scalar:
        """[mm]"""
        if self.center_distance is not None:
            return self.center_distance
        return (self.pinion.base_radius + self.wheel.base_radius) / jnp.cos(self.working_pressure_angle)

    @property
    def face_width(self) -> Scalar:
        """Common face width [mm], the smaller of the two."""
        return jnp.minimum(self.pinion.face_width, self.wheel.face_width)

    @property
    def base_pitch(self) -> Scalar:
        """[mm]"""
        return self.pinion.base_pitch

    @property
    def gear_ratio(self) -> Scalar:
        """Teeth of the wheel over teeth of the pinion."""
        return self.wheel.teeth / self.pinion.teeth


_WIDEST_ANGLE = 1.2  # rad; no gear pair works beyond about 45 degrees


def _backlash_free_angle(pair: GearPair) -> Scalar:
    """inv(alpha_w) = inv(alpha) + 2 tan(alpha) (x1 + x2) / (z1 + z2) (ISO 21771)."""
    pinion, wheel = pair.pinion, pair.wheel
    alpha = jnp.deg2rad(pinion.pressure_angle)
    shift = (pinion.profile_shift + wheel.profile_shift) / (pinion.teeth + wheel.teeth)
    target = involute(jnp.tan(alpha)) + 2 * jnp.tan(alpha) * shift
    tangent = bracketed_root(
        lambda t, wanted: involute(t) - wanted,
        jnp.full_like(target, 1e-3),
        jnp.full_like(target, jnp.tan(_WIDEST_ANGLE)),
        target,
    )
    return jnp.arctan(tangent)
