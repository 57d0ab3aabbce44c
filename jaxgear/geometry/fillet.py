"""Fillet of a ring gear as one circular arc, tangent to the involute and to the root circle."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

# of NumPy or of JAX, as the numbers are that they are made of
Number = Any

_LEAST_SQUARE = 1e-12  # of a tangent: keeps a traced, impossible arc finite
_HALVINGS = 60


class FilletArc(NamedTuple):
    """Arc between involute and root circle; all numbers positive.

    Attributes:
        center_radius: radius r_f - rho_F of its centre [mm].
        angle: angle of its centre from the centreline of the tooth [rad], half the angle of the root arc.
        tangent: tan(alpha) at the centre: the inclination of the common normal where the arc meets the flank.
        form_roll_length: roll length there [mm].
    """

    center_radius: Number
    angle: Number
    tangent: Number
    form_roll_length: Number


def fillet_arc(radius: Number, base_radius: Number, root_radius: Number, half_angle: Number) -> FilletArc:
    """Arc of a given radius in the tooth space of a ring gear.

    Its centre lies on the involute that is parallel to the flank at the distance rho_F, gamma_0 + inv(alpha) +
    rho_F / r_b from the centreline.

    Args:
        radius: radius rho_F of the arc [mm].
        base_radius, root_radius: radii of base and root circle [mm].
        half_angle: half tooth angle gamma_0 where the flank, extended, meets the base circle [rad].
    """
    of: Any = jnp if isinstance(base_radius, jax.Array) else np
    center = root_radius - radius
    tangent = of.sqrt(of.maximum((center / base_radius) ** 2 - 1, _LEAST_SQUARE))
    angle = half_angle + tangent - of.arctan(tangent) + radius / base_radius
    return FilletArc(center, angle, tangent, base_radius * tangent + radius)


def largest_fillet(
    teeth: float, base_radius: float, root_radius: float, half_angle: float, tip_roll_length: float
) -> float:
    """Largest radius of the arc [mm] that fits into half the tooth space and leaves a flank; 0 if none does.

    Args:
        teeth: number of teeth.
        base_radius, root_radius, half_angle: as of `fillet_arc`.
        tip_roll_length: roll length at the tip of the ring gear [mm].
    """
    low, high = 0.0, root_radius - base_radius
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        arc = fillet_arc(middle, base_radius, root_radius, half_angle)
        fits = arc.angle <= np.pi / teeth and arc.form_roll_length >= tip_roll_length
        low, high = (middle, high) if fits else (low, middle)
    return low
