"""Load line of a contact on a tooth: the quantities that every compliance model needs."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry.outline import Outline
from ..numerics import Checked, result, safe_sqrt

Real = Float[Array, "..."]


class ToothLoad(Checked):
    """Load normal to the involute at given points of one gear's flank. The other arrays share one shape.

    Attributes:
        outline: the tooth.
        roll_length: roll length of the loaded point [mm].
        angle: angle between the load line and the normal to the tooth centreline [rad].
        height: y of the crossing of load line and centreline [mm].
        depth: distance from the loaded point to that crossing along the load line [mm].
        normal: load on the tooth of the virtual gear at the same height of the tooth; None for a spur gear.
    """

    outline: Outline
    roll_length: Real = result("mm")
    angle: Real = result("rad")
    height: Real = result("mm")
    depth: Real = result("mm")
    normal: "ToothLoad | None" = eqx.field(default=None, repr=False)


def tooth_load(outline: Outline, roll_length: Real) -> ToothLoad:
    """The load line of every point, which is the normal to the involute there.

    Args:
        outline: the tooth.
        roll_length: roll lengths of the loaded points [mm].
    """
    drawn = outline.curves.over(roll_length.shape)
    angle = jnp.arctan(roll_length / drawn.base_radius) - drawn.half_angle(roll_length)  # as `load_angle`
    x, _ = drawn.involute(roll_length)
    normal = None
    if outline.normal is not None:
        gear = outline.normal.gear
        above = jnp.sqrt(drawn.base_radius**2 + roll_length**2) - drawn.pitch_radius
        normal = tooth_load(outline.normal, safe_sqrt((gear.pitch_radius + above) ** 2 - gear.base_radius**2))
    return ToothLoad(outline, roll_length, angle, drawn.base_radius / jnp.cos(angle), x / jnp.cos(angle), normal)
