"""Approach of two flanks in line contact: laws of the deflection over the line load.

A law is prepared once per mesh from the local geometry (`AbstractContact.prepare`) and then evaluated inside the
contact solution (`deflection`). All prepared leaves have the shape (pairs, 1, positions).

Notation: q line load [N/mm], R reduced radius, a half width of the contact, E' plane modulus, nu' plane Poisson's
    ratio,
h_k depth from the contact to the tooth centreline along the load line. In plane strain E' = E/(1 - nu^2) and
nu' = nu/(1 - nu), which gives the usual forms; plane stress has E and nu in their place.
"""

from abc import abstractmethod
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import reduced_radius
from ..numerics import Checked, Given, result
from .laws import AbstractLaw, LogarithmicLaw
from .plane import Plane, plane_modulus, plane_poisson
from .tooth import ToothLoad

Field = Float[Array, "pairs 1 positions"]
Real = Float[Array, "..."]

# Terms of the depth-referenced law up to a half width of the depth itself: 3e-10 of the deflection.
_DEPTH_TERMS = 10


class ContactSide(Checked):
    """One flank at the contact; arrays of shape (pairs, 1, positions).

    Flanks touch in the section normal to the line of contact. Of helical gears, whose base helix angle is beta_b, the
    depth is that of this section; moduli are cos(beta_b) times those of the material, so that deflections count along
    the transverse line of action; with the transverse radius the half width is again that of the normal section.

    Attributes:
        radius: radius of curvature in the transverse section [mm].
        depth: distance from the contact to the tooth centreline along the load line [mm].
        young: Young's modulus [MPa].
        modulus: modulus of the plane problem, E' [MPa].
        poisson: Poisson's ratio of the plane problem, nu'.
        strain_modulus: E / (1 - nu^2) [MPa], whatever the plane.
    """

    radius: Field = result("mm")
    depth: Field = result("mm")
    young: Field = result("MPa")
    modulus: Field = result("MPa")
    poisson: Field = result()
    strain_modulus: Field = result("MPa")


class ContactGeometry(Checked):
    """Both flanks at the contact and the face width [mm], shape (pairs, 1, positions)."""

    pinion: ContactSide
    wheel: ContactSide
    face_width: Field = result("mm")

    @property
    def sides(self) -> tuple[ContactSide, ContactSide]:
        """Pinion and wheel."""
        return self.pinion, self.wheel

    @property
    def compliance(self) -> Field:
        """1 / E* = 1 / E'_1 + 1 / E'_2 [1/MPa]."""
        return 1 / self.pinion.modulus + 1 / self.wheel.modulus

    @property
    def width_factor(self) -> Field:
        """a^2 / q = 4 R / (pi E*) [mm^2 per N/mm]."""
        return 4 * reduced_radius(self.pinion.radius, self.wheel.radius) / jnp.pi * self.compliance


def contact_geometry(pinion: ToothLoad, wheel: ToothLoad, plane: Plane, face_width: Given) -> ContactGeometry:
    """Collects the local geometry of both flanks, arrays (pairs, positions), on a common shape."""
    shape = pinion.roll_length.shape

    def field(value: Given) -> Array:
        return jnp.broadcast_to(value, shape)[:, None]

    def side(load: ToothLoad) -> ContactSide:
        gear, material = load.outline.gear, load.outline.gear.material
        inclined = 1.0 if gear.helix_angle is None else jnp.cos(gear.base_helix_angle)
        return ContactSide(
            radius=field(load.roll_length),
            depth=field(load.depth * inclined),
            young=field(material.elastic_modulus * inclined),
            modulus=field(plane_modulus(material, plane) * inclined),
            poisson=field(plane_poisson(material, plane)),
            strain_modulus=field(plane_modulus(material, "strain") * inclined),
        )

    return ContactGeometry(side(pinion), side(wheel), field(face_width))


class AbstractContact(Checked):
    """A choice of contact law."""

    @abstractmethod
    def prepare(self, geometry: ContactGeometry) -> AbstractLaw:
        """The law for a given local geometry."""


class DepthReferenced(AbstractContact):
    """Approach of the surfaces against the tooth centrelines (default).

        delta = sum_k 2 q / (pi E'_k) [ asinh(h_k / a) - nu'_k h_k / (sqrt(h_k^2 + a^2) + h_k) ]

    The integral of the strain below a Hertzian pressure down to the depth h_k, exact for any h/a; it contains no bulk
    compression beyond the centreline, which the tooth and body models carry.

    References:
        C. Weber, K. Banaschek 1953; E. McEwen, Phil. Mag. 40 (1949) 454-459 for the stress field it integrates.
    """

    def prepare(self, geometry: ContactGeometry) -> LogarithmicLaw:
        def brackets(squared: Array) -> list[Array]:
            reaches = [jnp.sqrt(side.depth**2 + squared) + side.depth for side in geometry.sides]
            # asinh(h / a) = ln((h + sqrt(h^2 + a^2)) / a)
            return [jnp.log(reach) - side.poisson * side.depth / reach for side, reach in zip(geometry.sides, reaches)]

        span = jnp.minimum(geometry.pinion.depth, geometry.wheel.depth) ** 2
        return logarithmic_law(geometry, brackets, span, terms=_DEPTH_TERMS)


def logarithmic_law(
    geometry: ContactGeometry,
    brackets: Callable[[Array], Sequence[Array]],
    span: Real | float = 1.0,
    terms: int = 1,
) -> LogarithmicLaw:
    """The law sum_k 2 q / (pi E'_k) [ bracket_k(a^2) - ln a ] with a = sqrt(width_factor q).

    The brackets become a polynomial through Chebyshev nodes in 0 <= a^2 <= span: the contact solution evaluates the
    law far more often than anything else.
    """
    weights = [2e3 / (jnp.pi * side.modulus) for side in geometry.sides]
    span = jnp.broadcast_to(span, geometry.width_factor.shape)
    nodes = np.cos(np.pi * (np.arange(terms) + 0.5) / terms)
    squared = span * jnp.asarray(0.5 * (nodes + 1), span.dtype)[None, :, None]
    values = sum(weight * bracket for weight, bracket in zip(weights, brackets(squared)))
    powers = jnp.asarray(np.linalg.inv(np.vander(nodes, increasing=True)), span.dtype)
    series = jnp.einsum("kn,pns->kps", powers, jnp.broadcast_to(values, squared.shape), precision="highest")
    return LogarithmicLaw(weights[0] + weights[1], geometry.width_factor, span, tuple(series[:, :, None]))
