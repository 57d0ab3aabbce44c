"""Bodies and contact laws of published studies, for comparison; no body couples neighbouring teeth.

`ElasticRing` and `DepthReferenced` are more accurate against finite elements.
"""

from abc import abstractmethod

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry.outline import Outline
from .assembly import Compliance
from .body import AbstractBody
from .hertz import AbstractContact, ContactGeometry, ContactSide, logarithmic_law
from .laws import AbstractLaw, LinearLaw, PowerLaw
from .plane import Plane, check_plane
from .tooth import Beam, ToothLoad

Field = Float[Array, "pairs positions"]

_TABLE = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)


def coefficients(half_angle: Float[Array, ""], thickness_ratio: Float[Array, ""]) -> Float[Array, "4"]:
    """L*, M*, P*, Q* for a root half angle [rad] and a ratio of root to bore radius."""
    t, h = half_angle, thickness_ratio
    basis = jnp.stack([t**-2, h**2, h / t, 1 / t, h, jnp.ones_like(h)])
    return jnp.asarray(_TABLE, basis.dtype) @ basis


class _AbstractFoundation(AbstractBody):
    """A body under each tooth on its own: no coupling, and no deflection that all teeth share."""

    def compliance(self, load: ToothLoad, step: int, plane: Plane) -> Float[Array, "pairs pairs positions"]:
        outline, material = load.outline, load.outline.gear.material
        # u_f / S_f: height of the crossing above the root circle over the root chord
        arm = (load.height - outline.gear.root_circle_radius) / outline.root_chord
        values = 1e3 * jnp.cos(load.angle) ** 2 / material.elastic_modulus * self.bracket(load, arm, plane)
        return jnp.eye(values.shape[0], dtype=values.dtype)[:, :, None] * values[None]

    def hub(self, outline: Outline) -> Float[Array, ""]:
        return jnp.zeros_like(outline.root_half_angle)

    @abstractmethod
    def bracket(self, load: ToothLoad, arm: Field, plane: Plane) -> Field:
        """Deflection times E b / (F cos^2 a), from u_f / S_f of a load."""


class Sainsot(_AbstractFoundation):
    """Sainsot's polynomial (legacy): no coupling, hub torsion inside each tooth, plane stress whatever is asked.

        delta = F cos^2 a / (E b) { L (u/S)^2 + M u/S + P (1 + Q tan^2 a) },   X = A/t^2 + B h^2 + C h/t + D/t + E h + F

    It is a fit to plane-stress rings with clamped bore and contains the ring's torsion. Stated validity: 1.4 <= h <= 7,
    0.01 <= t <= 0.12 with t = theta_f; pinions below about 25 teeth lie outside, where the polynomial extrapolates
    smoothly.

    References:
        P. Sainsot, P. Velex, O. Duverger, J. Mech. Des. 126 (2004) 748-752, doi 10.1115/1.1758252, eq. (15) and
        Table 1.
    """

    def bracket(self, load: ToothLoad, arm: Field, plane: Plane) -> Field:
        gear = load.outline.gear
        ratio = gear.root_circle_radius / gear.bore_radius
        bending, mixed, shear, axial = coefficients(load.outline.root_half_angle, ratio)
        return bending * arm**2 + mixed * arm + shear * (1 + axial * jnp.tan(load.angle) ** 2)


class HalfPlane(_AbstractFoundation):
    """Half-plane foundation of Weber and Banaschek with Cornell's coefficients: no bore, no coupling.

    References:
        C. Weber, K. Banaschek, Formaenderung und Profilruecknahme, 1953; R. W. Cornell, J. Mech. Des. 103 (1981)
        447-459.
    """

    def bracket(self, load: ToothLoad, arm: Field, plane: Plane) -> Field:
        check_plane(plane)
        nu = load.outline.gear.material.poisson_ratio
        shear = 1.534 * (1 + 0.4167 * jnp.tan(load.angle) ** 2 / (1 + nu))
        if plane == "strain":
            return (1 - nu**2) * (5.306 * arm**2 + 2 * (1 - nu - 2 * nu**2) / (1 - nu**2) * arm + shear)
        return 5.306 * arm**2 + 2 * (1 - nu) * arm + shear


class ConstantHertz(AbstractContact):
    """Load-independent approach 4 (1 - nu^2) / (pi E) per unit line load, for both gears together (legacy).

    Three to four times too stiff at usual loads. Plane strain in any case, as in the literature.

    References:
        D. C. H. Yang, Z. S. Sun, J. Mech. Trans. Autom. 107 (1985) 529-535.
    """

    def prepare(self, geometry: ContactGeometry) -> AbstractLaw:
        return LinearLaw(2e3 / jnp.pi * (1 / geometry.pinion.strain_modulus + 1 / geometry.wheel.strain_modulus))


class _AbstractLogarithmic(AbstractContact):
    """A law sum_k 2 q / (pi E'_k) [ bracket_k - ln a ] of the half width a."""

    def prepare(self, geometry: ContactGeometry) -> AbstractLaw:
        return logarithmic_law(geometry, lambda _: [self.bracket(side) for side in geometry.sides])

    @abstractmethod
    def bracket(self, side: ContactSide) -> Array:
        """Constant part of one body."""


class Weber(_AbstractLogarithmic):
    """`DepthReferenced` in its limit h >> a: delta = sum_k 2 q / (pi E'_k) [ ln(2 h_k / a) - nu'_k / 2 ].

    References:
        C. Weber, K. Banaschek 1953.
    """

    def bracket(self, side: ContactSide) -> Array:
        return jnp.log(2 * side.depth) - side.poisson / 2


class CenterDistance(_AbstractLogarithmic):
    """Centre-to-centre approach of two cylinders: bracket ln(4 R_k / a) - 1/2 per body. Double counts the tooth bulk.

    References:
        K. L. Johnson, Contact Mechanics, 1985, eq. (4.57).
    """

    def bracket(self, side: ContactSide) -> Array:
        return jnp.log(4 * side.radius) - 0.5


class Kovalskii(_AbstractLogarithmic):
    """Roark's two cylinders: bracket ln(2 R_k / a) + 0.407 per body. Double counts the tooth bulk.

    References:
        Roark's Formulas for Stress and Strain, contact of two cylinders.
    """

    def bracket(self, side: ContactSide) -> Array:
        return jnp.log(2 * side.radius) + 0.407


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


def legacy_compliance() -> Compliance:
    """Beam, Sainsot's uncoupled foundation, constant Hertz stiffness, plane stress: the usual published model.

    It overstates the variation of the transmission error by 20 to 120 % against finite elements.
    """
    return Compliance(tooth=Beam(), body=Sainsot(), contact=ConstantHertz(), plane="stress", edge_softening=False)
