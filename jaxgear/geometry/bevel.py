"""Bevel pairs by their virtual cylindrical gears at the middle of the face.

The virtual gears roll in the plane that touches the back cones at the mean point: their contact stands for that of the
bevel gears in the middle of the face. They cannot say what varies along it: the crowning that the machine makes, the
contact pattern and the load over the face, the taper of the teeth; and their bodies are cylinders, not cones.

References:
    ISO 10300-1:2014, annex A (virtual cylindrical gears, method B1), for bevel gears without offset; ISO 23509 for
    pitch cones and mean dimensions. The formulas are written from knowledge of the method; the standards were not at
    hand.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Checked, Given, check, concrete, number, real
from .gear import Gear
from .material import Material
from .pair import GearPair

Scalar = Float[Array, ""]

_FEWEST_TEETH, _MOST_TEETH = 5.0, 1000.0
_WIDEST = np.deg2rad(85.0)  # pitch cone of a wheel: the virtual gear of a crown gear is a rack
_LONGEST_FACE = 0.5  # of the outer cone distance; usual faces have 0.3 of it


class VirtualGear(Gear):
    """A cylindrical gear whose number of teeth need not be whole, otherwise as `Gear`."""

    teeth: Scalar = number("", low=_FEWEST_TEETH)


class BevelPair(Checked):
    """Straight or spiral bevel pair without offset.

    Attributes:
        pinion_teeth, wheel_teeth: numbers of teeth.
        module: outer transverse module m_et [mm].
        face_width: face width b along the pitch cone [mm].
        shaft_angle: angle between the shafts [deg].
        spiral_angle: spiral angle beta_m at the mean point [deg], positive for a right hand of the pinion; 0 for
            straight teeth.
        pressure_angle: normal pressure angle of the basic rack [deg].
        profile_shift: profile shift coefficient x_hm of the pinion at the mean point; the wheel has the opposite one.
        addendum, dedendum, root_radius: coefficients of the basic rack, in mean normal modules.
        pinion_bore_diameter, wheel_bore_diameter: diameters at which the virtual bodies are fixed [mm]; None for half
            their root diameters.
        pinion_material, wheel_material: elastic constants.

    Raises:
        ValueError: for a face that reaches more than half the outer cone distance, and a wheel whose pitch cone is
            wider than a crown gear's.
    """

    pinion_teeth: Scalar = number("", low=_FEWEST_TEETH, high=_MOST_TEETH, whole=True)
    wheel_teeth: Scalar = number("", low=_FEWEST_TEETH, high=_MOST_TEETH, whole=True)
    module: Scalar = number("mm", low=0.0, open_low=True)
    face_width: Scalar = number("mm", low=0.0, open_low=True, kw_only=True)
    shaft_angle: Scalar = number("deg", low=0.0, high=170.0, open_low=True, default=90.0, kw_only=True)
    spiral_angle: Scalar = number("deg", low=-45.0, high=45.0, default=0.0, kw_only=True)
    pressure_angle: Scalar = number("deg", low=10.0, high=35.0, default=20.0, kw_only=True)
    profile_shift: Scalar = number("x module", low=-1.0, high=1.0, default=0.0, kw_only=True)
    addendum: Scalar = number("x module", low=0.5, high=2.0, default=1.0, kw_only=True)
    dedendum: Scalar = number("x module", low=0.5, high=2.0, default=1.25, kw_only=True)
    root_radius: Scalar = number("x module", low=0.0, optional=True, default=None, kw_only=True)
    pinion_bore_diameter: Scalar | None = number(
        "mm", low=0.0, open_low=True, optional=True, default=None, kw_only=True
    )
    wheel_bore_diameter: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None, kw_only=True)
    pinion_material: Material = eqx.field(default_factory=Material, kw_only=True)
    wheel_material: Material = eqx.field(default_factory=Material, kw_only=True)

    def check_together(self) -> None:
        cone, distance = concrete(self.wheel_pitch_angle), concrete(self.outer_cone_distance)
        if cone is not None and not cone <= _WIDEST:
            raise ValueError(
                f"BevelPair: shaft_angle: the pitch cone of the wheel has {np.rad2deg(float(cone)):.4g} deg, must be "
                f"at most {np.rad2deg(_WIDEST):g} deg: a crown gear has no virtual cylindrical gear"
            )
        if distance is not None:
            check("BevelPair: face_width", self.face_width, "mm", high=_LONGEST_FACE * float(distance))

    @property
    def pinion_pitch_angle(self) -> Scalar:
        """Pitch cone angle delta_1 [rad]: tan(delta_1) = sin(Sigma) / (z_2 / z_1 + cos(Sigma))."""
        shafts = jnp.deg2rad(self.shaft_angle)
        return jnp.arctan2(jnp.sin(shafts), self.wheel_teeth / self.pinion_teeth + jnp.cos(shafts))

    @property
    def wheel_pitch_angle(self) -> Scalar:
        """Pitch cone angle delta_2 = Sigma - delta_1 [rad]."""
        return jnp.deg2rad(self.shaft_angle) - self.pinion_pitch_angle

    @property
    def outer_cone_distance(self) -> Scalar:
        """Outer cone distance R_e [mm]."""
        return 0.5 * self.module * self.pinion_teeth / jnp.sin(self.pinion_pitch_angle)

    @property
    def mean_cone_distance(self) -> Scalar:
        """Mean cone distance R_m = R_e - b / 2 [mm]."""
        return self.outer_cone_distance - 0.5 * self.face_width

    @property
    def mean_normal_module(self) -> Scalar:
        """Mean normal module m_mn = m_et R_m / R_e cos(beta_m) [mm]."""
        share = self.mean_cone_distance / self.outer_cone_distance
        return self.module * share * jnp.cos(jnp.deg2rad(self.spiral_angle))


def virtual_pair(bevel: BevelPair) -> GearPair:
    """The virtual cylindrical gears of a bevel pair, at the mean point of its face.

    z_v = z / cos(delta), module m_mn, helix angle beta_m, face width b. Contact analysis, flank modifications and
    metrics of the pair are those of the middle of the face; see the module for what they cannot say. Its torque and
    speed are `virtual_load` of those of the bevel pinion.

    Args:
        bevel: the bevel pair.

    Raises:
        ValueError: for gears that are not possible, such as a pointed tooth.
    """

    def gear(sign: float, teeth: Scalar, cone: Scalar, bore: Scalar | None, material: Material) -> VirtualGear:
        return VirtualGear(
            teeth / jnp.cos(cone),
            bevel.mean_normal_module,
            bevel.pressure_angle,
            sign * bevel.profile_shift,
            face_width=bevel.face_width,
            helix_angle=sign * bevel.spiral_angle,
            addendum=bevel.addendum,
            dedendum=bevel.dedendum,
            root_radius=bevel.root_radius,
            bore_diameter=bore,
            material=material,
        )

    return GearPair(
        gear(1.0, bevel.pinion_teeth, bevel.pinion_pitch_angle, bevel.pinion_bore_diameter, bevel.pinion_material),
        gear(-1.0, bevel.wheel_teeth, bevel.wheel_pitch_angle, bevel.wheel_bore_diameter, bevel.wheel_material),
    )


def virtual_load(bevel: BevelPair, torque: Given, speed: Given | None = None) -> tuple[Scalar, Scalar | None]:
    """Torque [N m] and speed [rpm] of the virtual pinion: of equal tooth force and pitch line velocity.

    T_v = T_1 / cos(delta_1), n_v = n_1 cos(delta_1).

    Args:
        bevel: the bevel pair.
        torque: torque on the bevel pinion [N m].
        speed: speed of the bevel pinion [rpm]; None for none.
    """
    share = jnp.cos(bevel.pinion_pitch_angle)
    return real(torque) / share, None if speed is None else real(speed) * share
