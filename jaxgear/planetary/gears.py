"""Sun, planet and ring of a planetary stage: tooth numbers, working pressure angles, phase between both meshes."""

from typing import Self

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import GearPair
from ..geometry.involute import involute
from ..geometry.path import center_distance_at, free_involute
from ..numerics import Checked, Given, concrete, number

Scalar = Float[Array, ""]

_FEWEST_TEETH, _MOST_TEETH = 5.0, 1000.0
# Difference of centre distances by the rounding of profile shifts and centre distances that drawings give [modules]
_ROUNDED = 1e-3


class StageGears(Checked):
    """Gears of a planetary stage, spur or helical, as far as its kinematics need them.

    All numbers are positive but profile shifts. That of the ring has the sign of ISO 21771: positive thickens the tooth
    and moves its tip inwards.

    Attributes:
        sun_teeth, planet_teeth, ring_teeth: numbers of teeth.
        module: normal module [mm].
        pressure_angle: normal pressure angle of the basic rack [deg].
        sun_profile_shift, planet_profile_shift, ring_profile_shift: profile shift coefficients.
        center_distance: operating centre distance of both meshes [mm]; None for the backlash-free one of sun and
            planet, which has to be that of planet and ring too.
        planet_tip_diameter: tip diameter of the planet [mm], for the clearance of neighbouring planets; None for
            m (z / cos(beta) + 2 x + 2).
        planet_thickness_allowance: tooth thickness allowance of the planet on the reference circle, normal to the tooth
            [um], negative for a thinner tooth.
        helix_angle: helix angle of the sun [deg], positive for a right hand; planets and ring have the other hand.

    Raises:
        ValueError: for centre distances of the two meshes that differ, or a centre distance at which one has no
            backlash left.
    """

    sun_teeth: Scalar = number("", low=_FEWEST_TEETH, high=_MOST_TEETH, whole=True)
    planet_teeth: Scalar = number("", low=_FEWEST_TEETH, high=_MOST_TEETH, whole=True)
    ring_teeth: Scalar = number("", low=_FEWEST_TEETH, high=_MOST_TEETH, whole=True)
    module: Scalar = number("mm", low=0.0, open_low=True)
    pressure_angle: Scalar = number("deg", low=5.0, high=40.0, default=20.0)
    sun_profile_shift: Scalar = number("", low=-5.0, high=5.0, default=0.0)
    planet_profile_shift: Scalar = number("", low=-5.0, high=5.0, default=0.0)
    ring_profile_shift: Scalar = number("", low=-5.0, high=5.0, default=0.0)
    center_distance: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)
    planet_tip_diameter: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)
    planet_thickness_allowance: Scalar = number("um", default=0.0)
    helix_angle: Scalar = number("deg", low=-45.0, high=45.0, default=0.0)

    def check_together(self) -> None:
        planet, outer = concrete(self.planet_teeth), concrete(self.ring_teeth)
        if planet is not None and outer is not None and not outer > planet:
            raise ValueError(
                f"StageGears: ring_teeth = {float(outer):g} must be greater than planet_teeth = {float(planet):g}"
            )
        known = [concrete(each) for each in (self.module, *self.free_center_distances)]
        given = None if self.center_distance is None else concrete(self.center_distance)
        if any(each is None for each in known):
            return
        module, sun, ring = (float(each) for each in known if each is not None)
        rounded = _ROUNDED * module
        if self.center_distance is None and not abs(sun - ring) <= rounded:
            raise ValueError(
                f"StageGears: sun and planet have a centre distance of {sun:.6g} mm, planet and ring of {ring:.6g} mm, "
                "must be equal: change tooth numbers or profile shifts, or give center_distance between them"
            )
        if given is not None and not sun - rounded <= float(given) <= ring + rounded:
            raise ValueError(
                f"StageGears: center_distance = {float(given):.6g} mm must be at least {sun:.6g} mm, at which sun and "
                f"planet have no backlash, and at most {ring:.6g} mm, at which planet and ring have none"
            )

    @classmethod
    def of_pairs(cls, sun_planet: GearPair, planet_ring: GearPair) -> Self:
        """The gears of two pairs, that of sun and planet and that of planet and ring.

        Raises:
            ValueError: for planets or centre distances of the pairs that differ.
        """
        sun, planet, ring = sun_planet.pinion, sun_planet.wheel, planet_ring.wheel
        for name in ("teeth", "module", "pressure_angle", "profile_shift", "helix_angle"):
            given = (getattr(each, name) for each in (planet, planet_ring.pinion))
            one, two = (concrete(jnp.zeros_like(planet.module) if each is None else each) for each in given)
            if one is not None and two is not None and not one == two:
                raise ValueError(
                    f"StageGears: planet has {name} = {float(one):g} in the mesh with the sun and {float(two):g} in "
                    "that with the ring, must be the same"
                )
        distance = sun_planet.working_center_distance
        one, two = concrete(distance), concrete(planet_ring.working_center_distance)
        if one is not None and two is not None and not abs(one - two) <= _ROUNDED * float(planet.module):
            raise ValueError(
                f"StageGears: sun and planet have a centre distance of {float(one):.6g} mm, planet and ring of "
                f"{float(two):.6g} mm, must be equal"
            )
        return cls(
            sun.teeth,
            planet.teeth,
            ring.teeth,
            planet.module,
            planet.pressure_angle,
            sun.profile_shift,
            planet.profile_shift,
            ring.profile_shift,
            center_distance=distance,
            planet_tip_diameter=2 * planet.tip_radius,
            planet_thickness_allowance=planet.tooth_thickness_allowance,
            helix_angle=jnp.zeros_like(sun.module) if sun.helix_angle is None else sun.helix_angle,
        )

    @property
    def free_center_distances(self) -> tuple[Scalar, Scalar]:
        """Backlash-free centre distances of sun and planet and of planet and ring without allowances [mm]."""
        return (
            self._free_distance(self.sun_teeth + self.planet_teeth, self.sun_profile_shift),
            self._free_distance(self.planet_teeth - self.ring_teeth, self.ring_profile_shift),
        )

    def _free_distance(self, teeth: Scalar, shift: Scalar) -> Scalar:
        """Backlash-free centre distance [mm] of a sum of teeth and one of profile shifts, as of `GearPair`."""
        target = free_involute(shift + self.planet_profile_shift, teeth, self._rack_angle, self._transverse_angle)
        return center_distance_at(self.base_radius(teeth), target)

    @property
    def _rack_angle(self) -> Scalar:
        return jnp.deg2rad(self.pressure_angle)

    @property
    def _helix_cosine(self) -> Scalar:
        return jnp.cos(jnp.deg2rad(self.helix_angle))

    @property
    def _transverse_angle(self) -> Scalar:
        return jnp.arctan(jnp.tan(self._rack_angle) / self._helix_cosine)

    @property
    def base_helix_angle(self) -> Scalar:
        """Base helix angle beta_b of the sun [rad]."""
        return jnp.arcsin(jnp.sin(jnp.deg2rad(self.helix_angle)) * jnp.cos(self._rack_angle))

    @property
    def working_center_distance(self) -> Scalar:
        """Operating centre distance of both meshes [mm]."""
        return self.free_center_distances[0] if self.center_distance is None else self.center_distance

    @property
    def working_pressure_angles(self) -> tuple[Scalar, Scalar]:
        """Operating pressure angles of sun and planet and of planet and ring [rad]."""
        teeth = self.sun_teeth + self.planet_teeth, self.ring_teeth - self.planet_teeth
        distance = self.working_center_distance
        sun, ring = (jnp.arccos(self.base_radius(each) / distance) for each in teeth)
        return sun, ring

    def base_radius(self, teeth: Given) -> Scalar:
        """Base radius of a gear with this number of teeth [mm]."""
        return 0.5 * self.module / self._helix_cosine * teeth * jnp.cos(self._transverse_angle)

    @property
    def tip_diameter_of_planet(self) -> Scalar:
        """Tip diameter of the planet, given or of full depth [mm]."""
        if self.planet_tip_diameter is not None:
            return self.planet_tip_diameter
        return self.module * (self.planet_teeth / self._helix_cosine + 2 * self.planet_profile_shift + 2)

    @property
    def phase_between_meshes(self) -> Scalar:
        """Mesh position of planet and ring where sun and planet touch at the pitch point [base pitches], in [0, 1).

        gamma = z_p (2 psi_b - inv(alpha_w,s) - inv(alpha_w,r)) / (2 pi) - z_p / 2 with the half tooth angle psi_b of
        the planet on the base circle, at the same place of the face: along it both phases rise alike. Both flanks are
        those that carry when the sun drives, or is driven the other way.
        """
        tangent = jnp.tan(self._rack_angle)
        allowance = 1e-3 * self.planet_thickness_allowance / self.module
        half = (jnp.pi / 2 + 2 * self.planet_profile_shift * tangent + allowance) / self.planet_teeth
        working = sum(involute(jnp.tan(angle)) for angle in self.working_pressure_angles)
        angle = 2 * (half + involute(jnp.tan(self._transverse_angle))) - working
        return (self.planet_teeth * (angle / (2 * jnp.pi) - 0.5)) % 1.0
