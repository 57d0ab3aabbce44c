"""Contact at a tip corner: a Hertzian contact cut off by the edge of one flank.

Near the end of the path of contact, and beyond it, the contact would reach past the tip corner of one gear. Two effects
soften it:

1. Truncation. Half planes pressed together by a parabola that ends at the corner carry the pressure
   p ~ sqrt((1 - xi) / (1 + xi)) (c0 + c1 xi) on a patch of length L from the corner, with

       L = 2/3 (t + sqrt(t^2 + 3 a^2)),     delta - delta_Hertz = a^2 / R Phi(t / a),
       Phi = (l/2 - tau)^2 / 2 + l^2 / 16 + ln(2 / l) / 2 - 1/4,    l = L / a,  tau = t / a < 1,

   t the distance of the virtual centre of contact from the corner (negative beyond it), a the half width and
   delta_Hertz the approach of the full contact. It is the closed-form solution of the singular integral equation of the
   plane contact with one singular end; at tau = 1 the patch just reaches the corner and Phi = 0.
2. The missing material. Behind the corner there is a wedge of interior angle 2 beta, not a half plane. Loaded at its
   apex it gives way by q / E' K ln(r), K = sin^2 b / (b + sin(2b)/2) + cos^2 b / (b - sin(2b)/2), against 2 / pi for
   the half plane (Flamant). The excess acts between the distance of the load from the corner and the size of the tooth
   tip. Its mean is taken over a semi-ellipse on the patch: the square-root singularity of the truncated half planes
   does not exist at the corner of a wedge, and would overstate the excess.

References:
    K. L. Johnson, Contact Mechanics, 1985, sections 2.7 and 5.1 (wedge, integral equations of plane contact).
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import safe_sqrt
from .hertz import LOAD_FLOOR, AbstractLaw, ContactGeometry
from .toothload import ToothLoad

Field = Float[Array, "pairs 1 positions"]
Real = Float[Array, "..."]

# Distance from the corner, relative to the depth of the centreline below it, at which the wedge's excess compliance
# ends. Found once from finite-element compliances of single teeth of 17 to 75 mm radius loaded close to their tips:
# 0.24 ... 0.28.
_WEDGE_REACH = 0.25
# Point load at unit distance from the apex of a wedge: its apex solution holds from 1.82 times that distance on (Mellin
# transform of the wedge, interior angles of 110 to 130 degrees: 1.77 ... 1.88).
_APEX_DISTANCE = 1.82


class Edge(eqx.Module):
    """Where the nearest tip corner is; fields of shape (pairs, 1, positions).

    Attributes:
        distance: of the contact's centre from the corner along the tip's flank [mm], negative beyond the corner.
        wedge: excess apex compliance of the tip wedge over the half plane, K - 2 / pi, over its modulus [1/MPa].
        reach: distance from the corner at which that excess ends [mm].
    """

    distance: Field
    wedge: Field
    reach: Field


def edge(
    pinion: ToothLoad, wheel: ToothLoad, outside: Float[Array, "pairs positions"], geometry: ContactGeometry
) -> Edge:
    """The corner next to every contact.

    Args:
        pinion, wheel: load lines at the contact points; beyond the path one of them is at its tip.
        outside: distance beyond the path of contact along the line of action [mm], zero on it.
        geometry: local geometry of both flanks.
    """

    def inside(load):
        gear = load.outline.gear
        return (gear.tip_roll_length**2 - load.roll_length**2) / (2 * gear.base_radius)

    def beyond(load):
        gear = load.outline.gear
        return -(2 * gear.tip_roll_length + outside) * outside / (2 * gear.base_radius)

    pinion_near = inside(pinion) < inside(wheel)
    near = jnp.where(pinion_near, inside(pinion) + beyond(pinion), inside(wheel) + beyond(wheel))

    def choose(first, second):
        return jnp.where(pinion_near[:, None], first, second)

    return Edge(
        distance=near[:, None],
        wedge=choose(
            _wedge_excess(pinion) / geometry.pinion.modulus,
            _wedge_excess(wheel) / geometry.wheel.modulus,
        ),
        reach=_WEDGE_REACH * choose(geometry.pinion.depth, geometry.wheel.depth),
    )


def _wedge_excess(load: ToothLoad) -> Float[Array, ""]:
    """K - 2 / pi of the wedge between flank and top land, loaded normal to the flank."""
    gear = load.outline.gear
    b = 0.5 * (jnp.pi / 2 + jnp.arctan(gear.tip_roll_length / gear.base_radius))
    twin = 0.5 * jnp.sin(2 * b)
    return jnp.sin(b) ** 2 / (b + twin) + jnp.cos(b) ** 2 / (b - twin) - 2 / jnp.pi


class EdgeLaw(AbstractLaw):
    """A contact law with the softening of the nearest tip corner added.

    Attributes:
        flank: law of the uninterrupted flank.
        width_factor: a^2 / q [mm^2 per N/mm].
        truncation: a^2 / R per q, 4 / (pi E*) [mm per N/mm].
        edge: the corner.
    """

    flank: AbstractLaw
    width_factor: Field
    truncation: Field
    edge: Edge

    def deflection(self, line_load: Real) -> Real:
        width = jnp.sqrt(self.width_factor * (line_load + LOAD_FLOOR))
        position = self.edge.distance / width
        cut, mean_log = _truncated(position)
        # ln(span) where it is positive, with a smooth onset: ln(1 + span^4) / 4
        wedge = 0.25 * jax.nn.softplus(4 * (jnp.log(self.edge.reach / (_APEX_DISTANCE * width)) - mean_log))
        return self.flank.deflection(line_load) + 1e3 * line_load * (self.truncation * cut + self.edge.wedge * wedge)


def _truncated(position: Real) -> tuple[Real, Real]:
    """Phi without the gap of the corner, and the mean of ln(distance from the corner / a) over a semi-ellipse.

    The semi-ellipse spans the patch: the Hertzian pressure of a full contact, and its bounded counterpart on [0, L].
    """
    cut_off = position < 1
    tau = jnp.where(cut_off, position, 0.0)
    root = jnp.sqrt(tau**2 + 3)
    # the second form avoids the cancellation beyond the corner
    length = jnp.where(tau > 0, 2 / 3 * (jnp.maximum(tau, 0.0) + root), 2 / (root - jnp.minimum(tau, 0.0)))
    # (l/2 - tau)^2 minus tau^2 beyond the corner, where the corner gap accounts for it
    sagitta = jnp.where(tau > 0, (0.5 * length - tau) ** 2, length * (0.25 * length - tau))
    phi = 0.5 * sagitta + length**2 / 16 + 0.5 * jnp.log(2 / length) - 0.25
    cut_log = jnp.log(0.25 * length) + 0.5
    full = jnp.where(cut_off, 2.0, position)
    growth = full + safe_sqrt(full**2 - 1)
    full_log = jnp.log(0.5 * growth) + 0.5 / growth**2
    return jnp.where(cut_off, phi, 0.0), jnp.where(cut_off, cut_log, full_log)
