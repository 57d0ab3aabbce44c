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
   apex it deflects by q / E' K ln(r), K = sin^2 b / (b + sin(2b)/2) + cos^2 b / (b - sin(2b)/2), against 2 / pi for
   the half plane (Flamant). The excess acts between the distance of the load from the corner and the size of the tooth
   tip. Its mean is taken over a semi-ellipse on the patch: the square-root singularity of the truncated half planes
   does not exist at the corner of a wedge, and would overstate the excess. Where the tip is chamfered, the wedge is the
   blunt one between flank and chamfer up to the chamfer's length, and that of the tip beyond.

References:
    K. L. Johnson, Contact Mechanics, 1985, sections 2.7 and 5.1 (wedge, integral equations of plane contact).
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import AbstractSpring, log, on_both
from .hertz import ContactGeometry, ContactSide
from .laws import AbstractLaw, Cut, Patch, cut_off
from .tooth import ToothLoad

Field = Float[Array, "pairs #slices positions"]
Real = Float[Array, "..."]

# Distance from the corner, relative to the depth of the centreline below it, at which the wedge's excess compliance
# ends. Found once from finite-element compliances of single teeth of 17 to 75 mm radius loaded close to their tips:
# 0.24 ... 0.28.
WEDGE_REACH = 0.25
# Point load at unit distance from the apex of a wedge: its apex solution holds from 1.82 times that distance on (Mellin
# transform of the wedge, interior angles of 110 to 130 degrees: 1.77 ... 1.88).
APEX_DISTANCE = 1.82
# between the chamfer of a tip and its top land, as drawings give chamfers without another angle; a rounding begins
# blunter still
_CHAMFER_ANGLE = np.pi / 4


class Edge(eqx.Module):
    """Nearest tip corner of every contact; fields of shape (pairs, 1, positions).

    Attributes:
        distance: distance of the contact's centre from the corner along the tip's flank [mm], negative beyond the
            corner; with an axis of slices where the contacts have moved.
        side: +1 where the corner is that of the pinion, -1 where it is that of the wheel.
        wedge: excess apex compliance of the tip wedge over the half plane, (K - 2 / pi) / E' [um per N/mm].
        reach: distance from the corner at which that excess ends [mm].
        chamfer: wedge between flank and chamfer; None where neither tip has a chamfer.
    """

    distance: Float[Array, "pairs anyslices positions"]
    side: Field
    wedge: Field
    reach: Field
    chamfer: "Chamfer | None" = None


class Chamfer(NamedTuple):
    """The wedge between flank and chamfer, which is blunter than that of the tip; up to the chamfer's length.

    Attributes:
        wedge: its excess apex compliance over that of the tip wedge [um per N/mm], negative.
        share: length of the chamfer over the reach of the tip wedge, at most 1.
    """

    wedge: Field
    share: Field


def edge(
    pinion: ToothLoad, wheel: ToothLoad, outside: Float[Array, "pairs positions"], geometry: ContactGeometry
) -> Edge:
    """The corner next to every contact.

    Args:
        pinion, wheel: load lines at the contact points; beyond the path one of them is at its tip.
        outside: distance beyond the path of contact along the line of action [mm], zero on it.
        geometry: local geometry of both flanks.
    """

    first, second = on_both(lambda given: _corner(*given, outside), (pinion, geometry.pinion), (wheel, geometry.wheel))
    pinion_near = first.inside < second.inside
    chamfered = any(load.outline.gear.tip_form_diameter is not None for load in (pinion, wheel))
    near = jax.tree.map(lambda *fields: jnp.where(pinion_near, *fields), first, second)
    return Edge(
        distance=(near.inside + near.beyond)[:, None],
        side=jnp.where(pinion_near, 1.0, -1.0).astype(near.inside.dtype)[:, None],
        wedge=near.wedge[:, None],
        reach=near.reach[:, None],
        chamfer=Chamfer(near.chamfer_wedge[:, None], near.chamfer_share[:, None]) if chamfered else None,
    )


class _Corner(NamedTuple):
    """A gear's tip corner next to its contacts, fields of shape (pairs, positions).

    Attributes:
        inside: distance of the contact on the path from the corner along the flank [mm].
        beyond: what being outside the path adds to it [mm], negative.
        wedge, reach: as in `Edge`.
        chamfer_wedge, chamfer_share: as in `Chamfer`.
    """

    inside: Real
    beyond: Real
    wedge: Real
    reach: Real
    chamfer_wedge: Real
    chamfer_share: Real


def _corner(load: ToothLoad, side: ContactSide, outside: Real) -> _Corner:
    drawn = load.outline.curves.over(outside.shape)
    tip, base = drawn.tip_roll_length, drawn.base_radius
    sharp, blunt = _wedge_excess(load, 0.0), _wedge_excess(load, _CHAMFER_ANGLE)
    reach = WEDGE_REACH * side.depth[:, 0]
    length = load.outline.gear.tip_chamfer / np.cos(_CHAMFER_ANGLE)
    return _Corner(
        inside=(tip**2 - load.roll_length**2) / (2 * base),
        beyond=-(2 * tip + outside) * outside / (2 * base),
        wedge=1e3 * sharp / side.modulus[:, 0],
        reach=reach,
        chamfer_wedge=1e3 * (blunt - sharp) / side.modulus[:, 0],
        chamfer_share=jnp.clip(length / reach, 0.0, 1.0),
    )


def _wedge_excess(load: ToothLoad, chamfer: float) -> Float[Array, ""]:
    """K - 2 / pi of the wedge between flank and top land or a chamfer [rad against it], loaded normal to the flank.

    From a half plane on nothing is left of it.
    """
    drawn = load.outline.curves
    interior = jnp.pi / 2 + chamfer + jnp.arctan(drawn.tip_roll_length / drawn.base_radius)
    b = 0.5 * jnp.minimum(interior, jnp.pi)
    twin = 0.5 * jnp.sin(2 * b)
    return jnp.sin(b) ** 2 / (b + twin) + jnp.cos(b) ** 2 / (b - twin) - 2 / jnp.pi


class EdgeLaw(AbstractSpring):
    """A contact law with the softening of the nearest tip corner added.

    Attributes:
        flank: law of the uninterrupted flank.
        width_factor: a^2 / q [mm^2 per N/mm].
        truncation: a^2 / R per q, 4 / (pi E*) [um per N/mm].
        edge: the corner.
    """

    flank: AbstractLaw
    width_factor: Field
    truncation: Field
    edge: Edge

    def secant(self, load: Real) -> Real:
        squared = self.width_factor * load
        patch = cut_off(self.edge.distance, squared)
        # Phi's logarithm replaces the half width by half the extent of the patch
        flank = self.flank.cut_secant(load, self._cut(patch))
        # ln(span) where it is positive, with a smooth onset: ln(1 + span^4) / 4
        span, chamfer = self._span(patch), self.edge.chamfer
        softer = self.edge.wedge * 0.25 * log(1 + span**4)
        if chamfer is not None:
            softer = softer + chamfer.wedge * 0.25 * log(1 + (chamfer.share * span) ** 4)
        # the division at the end is what a compiler stores, instead of evaluating all of this wherever it is used
        return ((flank + softer) * squared + self.truncation * patch.bending) / squared

    def slope(self, load: Real, secant: Real) -> Real:
        squared = self.width_factor * load
        patch = cut_off(self.edge.distance, squared)
        change = self.flank.cut_change(load, self._cut(patch))
        span, chamfer = self._span(patch), self.edge.chamfer
        stiffer = self.edge.wedge * _falling(span)
        if chamfer is not None:
            stiffer = stiffer + chamfer.wedge * _falling(chamfer.share * span)
        change = change + stiffer * patch.mean_change
        bending = self.truncation * (patch.bending_slope * squared - patch.bending)
        return ((secant + change) * squared + bending) / squared

    def moved(self, distance: Real) -> "EdgeLaw":
        """The law with the centre of contact moved along the flanks towards the pinion tip [mm]."""
        return eqx.tree_at(lambda law: law.edge.distance, self, self.edge.distance - self.edge.side * distance)

    def _cut(self, patch: Patch) -> Cut:
        return Cut(patch, 0.5 * self.truncation)

    def _span(self, patch: Patch) -> Real:
        return self.edge.reach / APEX_DISTANCE * (1 / patch.mean_distance)


def _falling(span: Real) -> Real:
    """d (ln(1 + span^4) / 4) / d ln(distance), as the span falls with the distance."""
    return 1 / (1 + span**4) - 1
