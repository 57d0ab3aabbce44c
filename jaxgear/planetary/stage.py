"""A planetary stage: gears, places and errors of the planets, supports of the members."""

from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Checked, concrete, count, number
from .gears import StageGears

Scalar = Float[Array, ""]
Planets = Float[Array, " planets"]

Member = Literal["sun", "ring", "carrier"]

_OF_PLANETS = (
    "angles",
    "radial_pin_error",
    "tangential_pin_error",
    "radial_pin_tilt",
    "tangential_pin_tilt",
    "sun_gap",
    "ring_gap",
)

_MOST_PLANETS = 12
# Angles that are rounded to 0.001 deg miss a pitch of (z_s + z_r) teeth by less than this share.
_MISSED_PITCH = 2e-3


def _planets(unit: str) -> Any:
    return number(unit, shape=("planets",), optional=True, default=None, kw_only=True)


class PlanetaryStage(Checked):
    """Sun, equal planets, ring and carrier, in the plane.

    The torque on the sun gives the sense: angles, tangential errors and displacements count positive the way that
    torque acts, in which it pushes the carrier too. A driving sun turns that way against the carrier, and mesh
    positions rise with time; where the sun is driven they fall. The flanks that carry are the same.

    Attributes:
        gears: tooth numbers and working pressure angles.
        planets: number of planets.
        radial_pin_stiffness, tangential_pin_stiffness: stiffness of planet bearing and pin [N/um], with what the rim of
            the planet adds.
        angles: places of the planets [deg], shape (planets,), increasing from the x axis; None for equal spacing.
        fixed: member that does not turn.
        driving: member on which the torque of `solve_stage` acts.
        sun_support, ring_support, carrier_support: radial stiffness of the support of a member [N/um]; 0 for a floating
            member, None for a rigid support.
        radial_pin_error, tangential_pin_error: displacement of every pin from its place [um], shape (planets,); None
            for none. A negative tangential one lags: this planet carries more.
        radial_pin_tilt, tangential_pin_tilt: slope of every pin over the face [um/mm], shape (planets,), positive where
            it lies farther out, or farther the way the carrier is pushed, at positive face coordinates; None for none.
            It takes meshes with slices, whose face coordinates count the same way along the axis. Planets do not tilt
            on their pins.
        pin_tilt_compliance: tangential tilt of all pins by the wind-up of the carrier, over the mean tangential force
            on a pin [um/(mm N)], positive where pins give way more at positive face coordinates; None for a stiff
            carrier.
        sun_gap, ring_gap: gap of every planet's mesh with sun and ring on the line of action [um], shape (planets,), as
            thinner teeth make it; None for none.

    Raises:
        ValueError: for planets that cannot be assembled, or whose tips meet; for a driving member that is fixed.
    """

    gears: StageGears
    planets: int = count(low=2, high=_MOST_PLANETS)
    radial_pin_stiffness: Scalar = number("N/um", low=0.0, open_low=True, kw_only=True)
    tangential_pin_stiffness: Scalar = number("N/um", low=0.0, open_low=True, kw_only=True)
    angles: Planets | None = _planets("deg")
    fixed: Member = eqx.field(static=True, default="ring", kw_only=True)
    driving: Member = eqx.field(static=True, default="sun", kw_only=True)
    sun_support: Scalar | None = number("N/um", low=0.0, optional=True, default=None, kw_only=True)
    ring_support: Scalar | None = number("N/um", low=0.0, optional=True, default=None, kw_only=True)
    carrier_support: Scalar | None = number("N/um", low=0.0, optional=True, default=None, kw_only=True)
    radial_pin_error: Planets | None = _planets("um")
    tangential_pin_error: Planets | None = _planets("um")
    radial_pin_tilt: Planets | None = _planets("um/mm")
    tangential_pin_tilt: Planets | None = _planets("um/mm")
    pin_tilt_compliance: Scalar | None = number("um/(mm N)", optional=True, default=None, kw_only=True)
    sun_gap: Planets | None = _planets("um")
    ring_gap: Planets | None = _planets("um")

    def check_together(self) -> None:
        if self.fixed == self.driving:
            raise ValueError(f'PlanetaryStage: driving = "{self.driving}" must not be the fixed member')
        for name in _OF_PLANETS:
            value = getattr(self, name)
            if value is not None and value.shape != (self.planets,):
                raise ValueError(
                    f"PlanetaryStage: {name} has {value.shape[0]} numbers, must have one for each of the "
                    f"{self.planets} planets"
                )
        self._check_assembly()
        self._check_clearance()

    def _check_assembly(self) -> None:
        angles = None if self.angles is None else concrete(self.angles)
        teeth = [concrete(each) for each in (self.gears.sun_teeth, self.gears.ring_teeth)]
        if angles is not None and not (np.diff(angles) > 0).all():
            raise ValueError(f"PlanetaryStage: angles = {angles.tolist()} deg must increase")
        if teeth[0] is None or teeth[1] is None or (angles is None and self.angles is not None):
            return
        total = float(teeth[0] + teeth[1])
        if angles is None:
            if total % self.planets:
                raise ValueError(
                    f"PlanetaryStage: {total:g} teeth of sun and ring are no multiple of {self.planets} planets: these "
                    f"cannot be assembled at equal angles; give angles that are multiples of 360/{total:g} deg"
                )
            return
        pitches = total * (angles - angles[0]) / 360
        missed = np.abs(pitches - np.round(pitches))
        if missed.max() > _MISSED_PITCH:
            worst = int(missed.argmax())
            nearest = angles[0] + 360 / total * np.round(pitches[worst])
            raise ValueError(
                f"PlanetaryStage: angles[{worst}] = {angles[worst]:g} deg cannot be assembled, must be a multiple of "
                f"360/{total:g} deg from the first planet: {nearest:.6g} deg is the nearest"
            )

    def _check_clearance(self) -> None:
        known = [concrete(self.least_planet_distance), concrete(self.gears.tip_diameter_of_planet)]
        if known[0] is not None and known[1] is not None and not known[0] > known[1]:
            raise ValueError(
                f"PlanetaryStage: neighbouring planets are {float(known[0]):.6g} mm apart, must be more than their tip "
                f"diameter of {float(known[1]):.6g} mm: take fewer than {self.planets} planets or fewer teeth"
            )

    @property
    def planet_angles(self) -> Planets:
        """Places of the planets [rad], shape (planets,)."""
        if self.angles is not None:
            return jnp.deg2rad(self.angles)
        return 2 * jnp.pi / self.planets * jnp.arange(self.planets, dtype=self.gears.module.dtype)

    def gap_slopes(self, force: Scalar) -> tuple[Planets | None, Planets | None]:
        """Slopes of the gaps of every planet's meshes with sun and ring over the face, by the tilt of the pins [um/mm].

            zeta' sin(alpha_w,s) + eta' cos(alpha_w,s)   and   -zeta' sin(alpha_w,r) + eta' cos(alpha_w,r)

        of a radial tilt zeta' and a tangential one eta', shape (planets,) each; None where no pin tilts.

        Args:
            force: mean force of a planet's mesh on the line of action [N].
        """
        radial, tangential, compliance = self.radial_pin_tilt, self.tangential_pin_tilt, self.pin_tilt_compliance
        if radial is None and tangential is None and compliance is None:
            return None, None
        angles = self.gears.working_pressure_angles
        zeta, eta = (jnp.zeros_like(self.planet_angles) if each is None else each for each in (radial, tangential))
        if compliance is not None:
            eta = eta + compliance * force * sum(jnp.cos(angle) for angle in angles)
        sun, ring = (sign * zeta * jnp.sin(angle) + eta * jnp.cos(angle) for sign, angle in zip((1, -1), angles))
        return sun, ring

    @property
    def least_planet_distance(self) -> Scalar:
        """Least distance of the centres of neighbouring planets [mm]."""
        angles = self.planet_angles
        apart = jnp.diff(angles, append=angles[:1] + 2 * jnp.pi)
        return 2 * self.gears.working_center_distance * jnp.min(jnp.abs(jnp.sin(0.5 * apart)))
