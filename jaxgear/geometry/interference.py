"""Interference of teeth beyond their line of action: of a tip with a fillet, and of both tips of an internal pair.

Fillet: the tip corner of the mate passes every radius of the fillet once on its way into the tooth space, at an angle
psi of the mate from the line of centres. The angles of the corner and of the point of the fillet are closed forms in
the roll lengths at which the flanks touch: neither a root search nor a table is needed.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import safe_sqrt
from .gear import Gear
from .involute import involute
from .outline import Outline

Scalar = Float[Array, ""]

_POINTS = 33  # of the fillet, from the form circle to the root circle
_LARGEST_SQUARE = 1 - 1e-6  # of a sine: derivatives of the angle stay finite


def fillet_clearance(
    drawn: Outline, mate: Gear, pitch_roll_length: Scalar, mate_pitch_roll_length: Scalar, distance: Scalar
) -> Scalar:
    """Least arc between the mate's tip corner and the fillet below the form circle [mm]; negative if it hits the tooth.

    Args:
        drawn: outline of the gear.
        mate: the other gear.
        pitch_roll_length, mate_pitch_roll_length: roll lengths of both gears at the pitch point [mm].
        distance: centre distance, negative of an internal pair [mm].
    """
    base, tip = drawn.gear.base_radius, mate.tip_form_radius
    g = drawn.junction + jnp.linspace(0.0, 1.0, _POINTS, dtype=base.dtype) * (jnp.pi / 2 - drawn.junction)

    def drawn_at(g: Float[Array, " points"]) -> tuple[Float[Array, " points"], ...]:
        x, y = drawn.curves.over(g.shape).trochoid(g)
        squared = x**2 + y**2
        # sin(psi / 2)^2 by the law of cosines; negative for points that the corner does not reach
        return x, y, squared, (squared - (distance - tip) ** 2) / (4 * distance * tip)

    *points, reached = drawn_at(g)
    # the deepest point that it reaches, on the line of centres: the arc falls steeply towards it
    count = jnp.sum(reached > 0)
    last = jnp.clip(count - 1, 0, _POINTS - 2)
    share = jnp.clip(reached[last] / (reached[last] - reached[last + 1]), 0.0, 1.0)
    *deepest, _ = drawn_at(g[last][None] + share * (g[1] - g[0]))
    x, y, squared = (jnp.concatenate(each) for each in zip(points, deepest))
    met = jnp.append(reached > 0, count > 0)
    # a ring gear's tip lies inside its pitch circle: its corner is behind the line of centres
    at_last = jnp.where(count < _POINTS, 0.0, reached[-1])
    psi = mate.signed(2 * jnp.arcsin(safe_sqrt(jnp.minimum(jnp.append(reached, at_last), 0.5))))
    working = jnp.arctan(pitch_roll_length / base)
    mate_roll = mate.base_radius * (psi + working + involute(mate.tip_roll_length / mate.base_radius))
    roll = pitch_roll_length + mate_pitch_roll_length - mate_roll
    fillet = roll / base - working - drawn.curves.base_half_angle + jnp.arctan(x / y)
    corner = jnp.arctan(-tip * jnp.sin(psi) / (distance - tip * jnp.cos(psi)))
    arc = drawn.gear.signed(jnp.sqrt(squared)) * (corner - fillet)
    return jnp.min(jnp.where(met, arc, drawn.gear.module))


class Tips(NamedTuple):
    """Base and tip radii of the gear inside a ring gear, planet or cutter, and of the ring gear, all positive [mm]."""

    base: Scalar
    tip: Scalar
    ring_base: Scalar
    ring_tip: Scalar

    @property
    def angles(self) -> tuple[Scalar, Scalar]:
        """inv(alpha) at both tips [rad]."""
        inner, outer = (
            involute(safe_sqrt((tip / base) ** 2 - 1)) for tip, base in ((self.tip, self.base), self[2:][::-1])
        )
        return inner, outer


def trochoid_clearance(tips: Tips, distance: Scalar, tangent: Scalar) -> Scalar:
    """Least angle of the ring gear between its tip corners and those of the gear inside [rad]; negative if they hit.

    Both corners are on one radius where the tip circles cross: theta_1 z_1 / z_2 + inv(alpha_w) - inv(alpha_a2) -
    theta_2. It is the secondary, or trochoid, interference of internal gears (SDP/SI D785).

    Args:
        tips: radii of both.
        distance: centre distance, positive [mm].
        tangent: tan(alpha_w).
    """
    inner, outer = tips.angles
    working = involute(tangent)
    # of the corners from the line of centres, by the law of cosines
    at_inner = _angle(((tips.tip + distance) ** 2 - tips.ring_tip**2) / (4 * distance * tips.tip))
    at_outer = _angle((tips.tip**2 - (tips.ring_tip - distance) ** 2) / (4 * distance * tips.ring_tip))
    turned, ring = at_inner + inner - working, at_outer + outer - working
    return turned * tips.base / tips.ring_base - ring


def radial_assembly_clearance(tips: Tips, tangent: Scalar) -> Scalar:
    """Least angle of the gear inside between the tips while it moves into the ring gear along a radius [rad].

    Negative if it must be assembled along the axis (trimming interference, SDP/SI D785).

    Args:
        tips: radii of both.
        tangent: tan(alpha_w) of the pair in place.
    """
    inner, outer = tips.angles
    working, ratio = involute(tangent), tips.ring_base / tips.base
    cosines = (tips.base / tips.tip) / (tips.ring_base / tips.ring_tip)
    first = 0.5 * _angle((1 - cosines**2) / (1 - ratio**-2))
    second = 0.5 * _angle((cosines**-2 - 1) / (ratio**2 - 1))
    return first + inner - working - ratio * (second + outer - working)


def _angle(squared: Scalar) -> Scalar:
    """Angle from the square of the sine of its half [rad]; zero for a negative one, where tip circles do not cross."""
    return 2 * jnp.arcsin(safe_sqrt(jnp.minimum(squared, _LARGEST_SQUARE)))
