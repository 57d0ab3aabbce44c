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
from .laws import AbstractLaw, LinearLaw, LogarithmicLaw, PowerLaw
from .plane import Plane, plane_modulus, plane_poisson
from .toothload import ToothLoad

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


class ConstantHertz(AbstractContact):
    """Load-independent approach 4 (1 - nu^2) / (pi E) per unit line load, for both gears together (legacy).

    Three to four times too stiff at usual loads. Plane strain in any case, as in the literature.

    References:
        D. C. H. Yang, Z. S. Sun, J. Mech. Trans. Autom. 107 (1985) 529-535.
    """

    def prepare(self, geometry: ContactGeometry) -> AbstractLaw:
        return LinearLaw(2e3 / jnp.pi * (1 / geometry.pinion.strain_modulus + 1 / geometry.wheel.strain_modulus))


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
        return _logarithmic(geometry, brackets, span, terms=_DEPTH_TERMS)


class Weber(AbstractContact):
    """`DepthReferenced` in its limit h >> a: delta = sum_k 2 q / (pi E'_k) [ ln(2 h_k / a) - nu'_k / 2 ].

    References:
        C. Weber, K. Banaschek 1953.
    """

    def prepare(self, geometry: ContactGeometry) -> AbstractLaw:
        return _logarithmic(geometry, lambda _: [jnp.log(2 * side.depth) - side.poisson / 2 for side in geometry.sides])


class CenterDistance(AbstractContact):
    """Centre-to-centre approach of two cylinders: bracket ln(4 R_k / a) - 1/2 per body. Double counts the tooth bulk.

    References:
        K. L. Johnson, Contact Mechanics, 1985, eq. (4.57).
    """

    def prepare(self, geometry: ContactGeometry) -> AbstractLaw:
        return _logarithmic(geometry, lambda _: [jnp.log(4 * side.radius) - 0.5 for side in geometry.sides])


class Kovalskii(AbstractContact):
    """Roark's two cylinders: bracket ln(2 R_k / a) + 0.407 per body. Double counts the tooth bulk.

    References:
        Roark's Formulas for Stress and Strain, contact of two cylinders.
    """

    def prepare(self, geometry: ContactGeometry) -> AbstractLaw:
        return _logarithmic(geometry, lambda _: [jnp.log(2 * side.radius) + 0.407 for side in geometry.sides])


class Palmgren(AbstractContact):
    """Roller-bearing power law delta = 3.84e-5 F^0.9 / L^0.8 [mm, N, mm], steel on steel; centre to centre.

    The length of the roller is the face width; slices use the law of the full width.
    """

    def prepare(self, geometry: ContactGeometry) -> AbstractLaw:
        factor = 1e3 * 3.84e-5 * geometry.face_width**0.1
        return PowerLaw(factor, jnp.full_like(factor, 0.9))


class NonlinearPower(AbstractContact):
    """Power law k = E^0.9 b^0.8 F^0.1 / 1.275 (secant stiffness), a smooth substitute close to the depth law.

    E is the harmonic mean of the two moduli; slices use the law of the full width.

    References:
        R. W. Cornell, J. Mech. Des. 103 (1981) 447-459; D. C. H. Yang, J. Y. Lin, J. Mech. Trans. Autom. 109 (1987).
    """

    def prepare(self, geometry: ContactGeometry) -> AbstractLaw:
        young = 2 / (1 / geometry.pinion.young + 1 / geometry.wheel.young)
        factor = 1e3 * 1.275 * geometry.face_width**0.1 / young**0.9
        return PowerLaw(factor, jnp.full_like(factor, 0.9))


def _logarithmic(
    geometry: ContactGeometry,
    brackets: Callable[[Array], Sequence[Array]],
    span: Real | float = 1.0,
    terms: int = 1,
) -> LogarithmicLaw:
    """sum_k 2 q / (pi E'_k) [ bracket_k(a^2) - ln a ] with a = sqrt(width_factor q).

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
