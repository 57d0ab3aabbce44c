"""Where the load line crosses a tooth: the quantities that every compliance model needs."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry.involute import half_tooth_angle
from ..geometry.outline import Outline

Real = Float[Array, "..."]


class ToothLoad(eqx.Module):
    """Load normal to the involute at given points of one gear's flank. All arrays share one shape.

    Attributes:
        outline: the tooth.
        roll_length: of the loaded point [mm].
        angle: between the load line and the normal to the tooth centreline [rad].
        height: y of the crossing of load line and centreline [mm].
        depth: distance from the loaded point to that crossing along the load line [mm].
    """

    outline: Outline
    roll_length: Real
    angle: Real
    height: Real
    depth: Real


def tooth_load(outline: Outline, roll_length: Real) -> ToothLoad:
    """The load line is tangent to the base circle: it crosses the centreline at r_b / cos(angle)."""
    gear = outline.gear
    half_angle = half_tooth_angle(gear, roll_length)
    angle = jnp.arctan(roll_length / gear.base_radius) - half_angle
    radius = jnp.sqrt(gear.base_radius**2 + roll_length**2)
    return ToothLoad(
        outline, roll_length, angle, gear.base_radius / jnp.cos(angle), radius * jnp.sin(half_angle) / jnp.cos(angle)
    )
