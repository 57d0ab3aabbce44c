"""Flash temperature of the contact (Blok)."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..compliance.plane import combined_modulus
from ..contact import MeshCycle
from ..geometry import reduced_radius
from ..numerics import check, over_batch, real, safe_divide, safe_sqrt

Load = Float[Array, "pairs slices positions"]

_BLOK_FACTOR = 1.13  # 2 / sqrt(pi), semi-elliptic heat flux (ISO/TS 6336-20, where Blok's own 1.11 is rounded)


def flash_temperature(cycle: MeshCycle, speed, *, friction=0.06) -> Float[Array, "*cycles pairs slices positions"]:
    """Rise of the flank temperature in the contact [K], at the line loads of this cycle.

        T_fl = 1.13 mu w |v1 - v2| / [(B1 sqrt(v1) + B2 sqrt(v2)) sqrt(2 b_H)]

    Zero where the pair is apart, in corner contact (no flank curvature there), and at the pitch point.

    Args:
        cycle: solved mesh cycle.
        speed: of the pinion [rpm], scalar.
        friction: mean coefficient of friction; 0.06 is the leading constant of ISO/TR 13989-1 at unit load and speed
            terms.

    Raises:
        ValueError: for a negative speed or friction.

    References:
        ISO/TS 6336-20 (ISO/TR 13989-1); H. Blok 1937.
    """
    check("flash_temperature", "speed", speed, "rpm", low=0.0)
    check("flash_temperature", "friction", friction, "", low=0.0)
    return _flash(cycle, real(speed), real(friction))


@over_batch
def _flash(cycle: MeshCycle, speed, friction) -> Load:
    kinematics, (pinion, wheel) = cycle.kinematics, cycle.sides
    pair = kinematics.pair
    pinion_speed, wheel_speed = kinematics.path_of_contact.rolling_speeds(kinematics.path, speed)
    reduced = reduced_radius(pinion.contact_roll_length, wheel.contact_roll_length)
    modulus = combined_modulus(pair.pinion.material, pair.wheel.material, kinematics.plane)
    half_width = safe_sqrt(4 * cycle.line_load * reduced[:, None] / modulus / jnp.pi) * 1e-3  # [m]
    heat = friction * cycle.line_load * 1e3 * jnp.abs(pinion_speed - wheel_speed)[:, None]
    sink = pair.pinion.material.thermal_contact_coefficient * safe_sqrt(
        pinion_speed
    ) + pair.wheel.material.thermal_contact_coefficient * safe_sqrt(wheel_speed)
    # no heat makes no rise, also where it is not conducted; heat that is not finite stays so
    rise = _BLOK_FACTOR * safe_divide(heat, sink[:, None] * safe_sqrt(2 * half_width), default=0.0 * heat)
    return jnp.where((kinematics.outside <= 0)[:, None], rise, 0.0)
