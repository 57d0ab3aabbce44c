"""Clearance between the fillet of a gear and the tip of its mate, if the tip runs below the form circle of the gear.

The tip corner of the mate passes every radius of the fillet once on its way into the tooth space, at an angle psi of
the mate from the line of centres. The angles of the corner and of the point of the fillet are closed forms in the roll
lengths at which the flanks touch: neither a root search nor a table is needed.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import safe_sqrt
from .gear import Gear
from .involute import involute
from .outline import Outline

Scalar = Float[Array, ""]

_POINTS = 33  # of the fillet, from the form circle to the root circle


def fillet_clearance(
    drawn: Outline, mate: Gear, pitch_roll_length: Scalar, mate_pitch_roll_length: Scalar, distance: Scalar
) -> Scalar:
    """Least arc between the mate's tip corner and the fillet below the form circle [mm]; negative if it hits the tooth.

    Args:
        drawn: outline of the gear.
        mate: the other gear.
        pitch_roll_length, mate_pitch_roll_length: roll lengths of both gears at the pitch point [mm].
        distance: centre distance [mm].
    """
    base, tip = drawn.gear.base_radius, mate.tip_form_radius
    g = drawn.junction + jnp.linspace(0.0, 1.0, _POINTS, dtype=base.dtype) * (jnp.pi / 2 - drawn.junction)
    x, y = drawn.curves.over(g.shape).trochoid(g)
    squared = x**2 + y**2
    # sin(psi / 2)^2 by the law of cosines; negative for points that the corner does not reach
    reached = (squared - (distance - tip) ** 2) / (4 * distance * tip)
    psi = 2 * jnp.arcsin(safe_sqrt(jnp.minimum(reached, 0.5)))
    working = jnp.arctan(pitch_roll_length / base)
    mate_roll = mate.base_radius * (psi + working + involute(mate.tip_roll_length / mate.base_radius))
    roll = pitch_roll_length + mate_pitch_roll_length - mate_roll
    fillet = roll / base - working - drawn.curves.base_half_angle + jnp.arctan2(x, y)
    corner = jnp.arctan2(-tip * jnp.sin(psi), distance - tip * jnp.cos(psi))
    arc = jnp.sqrt(squared) * (corner - fillet)
    return jnp.min(jnp.where(reached > 0, arc, drawn.gear.module))
