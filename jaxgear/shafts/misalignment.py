"""Misalignment of the axes, as a deviation over the face width in the plane of action."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import GearPair
from ..microgeometry.base import acts
from ..numerics import Checked, Given, check, concrete, number, real

Scalar = Float[Array, ""]

# ISO/TR 10064-3, as quoted in secondary sources: largest deviations over the bearing span
_SKEW = 0.5  # f_Sigma_beta over (L / b) F_beta
_INCLINATION = 2.0  # f_Sigma_delta over f_Sigma_beta


class Misalignment(Checked):
    """Deviation from parallelism of the axes of a pair.

    Attributes:
        skew: f_Sigma_beta, out of the plane of the axes, over the bearing span [um].
        inclination: f_Sigma_delta, in the plane of the axes, over the bearing span [um].
        bearing_span: L, length over which skew and inclination are measured [mm]; None without them.
        direct: f_ma over the face width in the plane of action, in addition to skew and inclination [um].

    Positive values open the gap at positive face coordinates, as a positive lead slope does.

    Raises:
        ValueError: for skew or inclination without the bearing span.
    """

    skew: Scalar = number("um", default=0.0)
    inclination: Scalar = number("um", default=0.0)
    bearing_span: Scalar | None = number("mm", low=0.0, open_low=True, optional=True, default=None)
    direct: Scalar = number("um", default=0.0)

    def check_together(self) -> None:
        if self.bearing_span is not None:
            return
        for name, value in (("skew", self.skew), ("inclination", self.inclination)):
            known = concrete(value)
            if known is None or known != 0:
                given = "" if known is None else f" = {float(known):g} um"
                raise ValueError(f"Misalignment: {name}{given} needs bearing_span [mm], over which it is measured")

    @property
    def varies_along_face(self) -> bool:
        """True if the misalignment is not known to be zero; a mesh of one slice cannot represent it."""
        return any(acts(value) for value in (self.skew, self.inclination, self.direct))

    def over_face(self, pair: GearPair) -> Scalar:
        """f_ma over the face width [um]: direct + (skew cos(alpha_wt) + inclination sin(alpha_wt)) b / L."""
        if self.bearing_span is None:
            return self.direct
        angle = pair.working_pressure_angle
        over_span = self.skew * jnp.cos(angle) + self.inclination * jnp.sin(angle)
        return self.direct + over_span * pair.face_width / self.bearing_span


def axis_tolerance(helix_deviation: Given, face_width: Given, bearing_span: Given) -> Misalignment:
    """Largest permissible deviations of the axes by ISO/TR 10064-3, both with the sign that adds up.

    f_Sigma_beta = 0.5 (L / b) F_beta and f_Sigma_delta = 2 f_Sigma_beta, quoted from secondary sources.

    Args:
        helix_deviation: F_beta, total helix deviation [um].
        face_width: b [mm].
        bearing_span: L [mm].
    """
    check("helix_deviation", helix_deviation, "um", low=0.0)
    check("face_width", face_width, "mm", low=0.0, open_low=True)
    bearings = real(bearing_span, "Misalignment: bearing_span")
    skew = _SKEW * bearings / real(face_width) * real(helix_deviation)
    return Misalignment(skew, _INCLINATION * skew, bearings)
