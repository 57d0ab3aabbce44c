"""The numbers of a gear pair that the formulas of a rating are written in.

References:
    ISO 21771 for the geometry, ISO/TS 6336-20 for the path parameter.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import GearPair, PathOfContact, path_of_contact
from ..numerics import Checked, Given, real, result

Scalar = Float[Array, ""]
OfGears = Float[Array, " gears"]
Real = Float[Array, "..."]

_MM = 1e-3


class MeshGeometry(Checked):
    """Geometry of a mesh as ISO 6336 needs it; arrays (gears,) hold pinion and wheel, arrays (points,) A to E.

    Teeth and diameters of a ring gear are negative, as in ISO 21771: u and the curvature of its flank are then too.

    Attributes:
        teeth: z.
        module: m_n.
        pressure_angle: alpha_n [rad].
        helix_angle: beta, its size [rad].
        base_helix_angle: beta_b, its size [rad].
        transverse_pressure_angle: alpha_t [rad].
        working_pressure_angle: alpha_wt [rad].
        center_distance: a.
        face_width: b, common to both gears.
        face_widths: of either gear.
        reference_diameter, base_diameter, working_diameter, tip_diameter, root_diameter: d, d_b, d_w, d_Na, d_f; the
            tip diameter is where the active flank ends, and the root is that of the generating profile shift.
        profile_shift: x.
        contact_ratio: eps_alpha.
        tip_contact_ratio: eps_1, eps_2, shares of the path between pitch point and tip of either gear.
        overlap_ratio: eps_beta.
        path: A, B, C, D, E as distances from the pitch point, negative where the root of the pinion is in contact;
            `PathOfContact`.
        elastic_modulus, poisson_ratio, density, thermal_contact_coefficient: of either gear.
    """

    teeth: OfGears = result()
    module: Scalar = result("mm")
    pressure_angle: Scalar = result("rad")
    helix_angle: Scalar = result("rad")
    base_helix_angle: Scalar = result("rad")
    transverse_pressure_angle: Scalar = result("rad")
    working_pressure_angle: Scalar = result("rad")
    center_distance: Scalar = result("mm")
    face_width: Scalar = result("mm")
    face_widths: OfGears = result("mm")
    reference_diameter: OfGears = result("mm")
    base_diameter: OfGears = result("mm")
    working_diameter: OfGears = result("mm")
    tip_diameter: OfGears = result("mm")
    root_diameter: OfGears = result("mm")
    profile_shift: OfGears = result()
    contact_ratio: Scalar = result()
    tip_contact_ratio: OfGears = result()
    overlap_ratio: Scalar = result()
    path: Float[Array, " points"] = result("mm")
    elastic_modulus: OfGears = result("MPa")
    poisson_ratio: OfGears = result()
    density: OfGears = result("kg/m^3")
    thermal_contact_coefficient: OfGears = result("N/(m s^0.5 K)")

    @property
    def gear_ratio(self) -> Scalar:
        """u, teeth of the wheel over teeth of the pinion; negative for an internal pair."""
        return self.teeth[1] / self.teeth[0]

    @property
    def total_contact_ratio(self) -> Scalar:
        """eps_gamma."""
        return self.contact_ratio + self.overlap_ratio

    @property
    def virtual_teeth(self) -> OfGears:
        """z_n = z / (cos(beta_b)^2 cos(beta))."""
        return self.teeth / (jnp.cos(self.base_helix_angle) ** 2 * jnp.cos(self.helix_angle))

    @property
    def tangent_lengths(self) -> OfGears:
        """Radii of curvature of both flanks at the pitch point, transverse [mm]."""
        return 0.5 * self.base_diameter * jnp.tan(self.working_pressure_angle)

    @property
    def path_parameter(self) -> Float[Array, " points"]:
        """Gamma of A, B, C, D, E, 0 at C."""
        return self.path / self.tangent_lengths[0]

    def curvatures(self, path: Given) -> tuple[Real, Real]:
        """Transverse radii of curvature of pinion and wheel [mm] at distances from the pitch point [mm]."""
        return self.tangent_lengths[0] + path, self.tangent_lengths[1] - path

    def reduced_radius(self, path: Given) -> Real:
        """Transverse reduced radius of curvature [mm] at distances from the pitch point [mm]."""
        pinion, wheel = self.curvatures(path)
        return pinion * wheel / (pinion + wheel)

    def surface_speeds(self, path: Given, speed: Given) -> tuple[Real, Real]:
        """Speeds of both surfaces through the contact [m/s] at distances from the pitch point [mm].

        Args:
            path: distances from the pitch point [mm].
            speed: of the pinion [rpm].
        """
        turn = speed * jnp.pi / 30 * _MM
        pinion, wheel = self.curvatures(path)
        return pinion * turn, wheel * turn / self.gear_ratio

    def reference_speed(self, speed: Given) -> Scalar:
        """v at the reference circle [m/s] at a speed of the pinion [rpm]."""
        return jnp.pi / 60 * _MM * self.reference_diameter[0] * speed

    def pitch_line_speed(self, speed: Given) -> Scalar:
        """v_w at the working pitch circle [m/s] at a speed of the pinion [rpm]."""
        return jnp.pi / 60 * _MM * self.working_diameter[0] * speed

    def tangential_force(self, torque: Given) -> Scalar:
        """F_t = 2000 T_1 / d_1 at the reference circle [N], of a torque on the pinion [N m]."""
        return 2e3 * real(torque) / self.reference_diameter[0]

    def base_force(self, torque: Given) -> Scalar:
        """F_bt = F_t / cos(alpha_t) in the transverse section [N], of a torque on the pinion [N m]."""
        return self.tangential_force(torque) / jnp.cos(self.transverse_pressure_angle)


def reduced_modulus(geometry: MeshGeometry) -> Scalar:
    """E_r = 2 / ((1 - nu_1^2) / E_1 + (1 - nu_2^2) / E_2) [MPa]."""
    return 2 / jnp.sum((1 - geometry.poisson_ratio**2) / geometry.elastic_modulus)


def mesh_geometry(pair: GearPair, path: PathOfContact | None = None) -> MeshGeometry:
    """The numbers of a gear pair; differentiable, of one pair, `jax.vmap` makes many.

    Args:
        pair: gear pair.
        path: its path of contact, where it is known.
    """
    path = path_of_contact(pair) if path is None else path
    pinion, gears = pair.pinion, pair.gears
    helix = jnp.zeros_like(pinion.module) if pinion.helix_angle is None else jnp.abs(jnp.deg2rad(pinion.helix_angle))
    working = jnp.arctan(path.pinion_pitch_roll_length / path.pinion_base_radius)

    def both(of) -> OfGears:
        return jnp.stack([of(gear) for gear in gears])

    base = both(lambda gear: 2 * gear.base_radius)
    return MeshGeometry(
        teeth=both(lambda gear: gear.signed(gear.teeth)),
        module=pinion.module,
        pressure_angle=jnp.deg2rad(pinion.pressure_angle),
        helix_angle=helix,
        base_helix_angle=jnp.abs(pinion.base_helix_angle),
        transverse_pressure_angle=pinion.transverse_pressure_angle,
        working_pressure_angle=working,
        center_distance=0.5 * jnp.abs(jnp.sum(base)) / jnp.cos(working),
        face_width=pair.face_width,
        face_widths=both(lambda gear: gear.face_width),
        reference_diameter=both(lambda gear: 2 * gear.pitch_radius),
        base_diameter=base,
        working_diameter=base / jnp.cos(working),
        tip_diameter=both(lambda gear: 2 * gear.tip_form_radius),
        root_diameter=both(lambda gear: 2 * gear.root_circle_radius),
        profile_shift=both(lambda gear: gear.profile_shift),
        contact_ratio=path.contact_ratio,
        tip_contact_ratio=jnp.stack([path.end, -path.start]) / path.base_pitch,
        overlap_ratio=pair.overlap_ratio,
        path=jnp.stack([path.start, path.inner_single, jnp.zeros_like(path.end), path.outer_single, path.end]),
        elastic_modulus=both(lambda gear: gear.material.elastic_modulus),
        poisson_ratio=both(lambda gear: gear.material.poisson_ratio),
        density=both(lambda gear: gear.material.density),
        thermal_contact_coefficient=both(lambda gear: gear.material.thermal_contact_coefficient),
    )
