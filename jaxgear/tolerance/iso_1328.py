"""Flank tolerances of ISO 1328-1:2013, which differ from the 1995 edition: never mix the two."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Gear
from ..numerics import check, concrete, real

Scalar = Float[Array, ""]


class ToleranceClass(eqx.Module):
    """Tolerances of one gear in a flank tolerance class (ISO 1328-1:2013, 5.3), unrounded and differentiable.

    All follow `(terms in d, m_n, b) * sqrt(2)^(class - 5)`; slopes and pitch are limits of either sign, form and total
    deviations are widths of a band. `iso_rounded` gives the numbers that stand on a drawing.

    Attributes:
        diameter: reference diameter d [mm], 5 to 15 000.
        module: normal module m_n [mm], 0.5 to 70.
        face_width: b [mm], 4 to 1200.
        quality_class: 1 (finest) to 11, a whole number.

    Raises:
        ValueError: for a number outside the range of the standard.
    """

    diameter: Scalar = eqx.field(converter=real)
    module: Scalar = eqx.field(converter=real)
    face_width: Scalar = eqx.field(converter=real)
    quality_class: Scalar = eqx.field(converter=real)

    def __check_init__(self):
        check("ToleranceClass", "diameter", self.diameter, "mm", low=5.0, high=15_000.0)
        check("ToleranceClass", "module", self.module, "mm", low=0.5, high=70.0)
        check("ToleranceClass", "face_width", self.face_width, "mm", low=4.0, high=1200.0)
        check("ToleranceClass", "quality_class", self.quality_class, "", low=1.0, high=11.0)
        quality = concrete(self.quality_class)
        if quality is not None and (quality != quality.round()).any():
            raise ValueError(f"ToleranceClass: quality_class = {float(quality):g} must be a whole number")

    @classmethod
    def of(cls, gear: Gear, quality_class) -> "ToleranceClass":
        """Tolerances of a gear of 5 to 1000 teeth."""
        check("ToleranceClass", "teeth", gear.teeth, "", low=5.0, high=1000.0)
        return cls(2 * gear.pitch_radius, gear.module, gear.face_width, quality_class)

    @property
    def single_pitch(self) -> Scalar:
        """f_pT [um]: between two neighbouring teeth."""
        return self._step * (0.001 * self.diameter + 0.4 * self.module + 5)

    @property
    def total_pitch(self) -> Scalar:
        """F_pT [um]: between any two teeth of the gear."""
        linear = 0.002 * self.diameter + 0.7 * self.module + 12
        return self._step * (linear + 0.55 * jnp.sqrt(self.diameter))

    @property
    def profile_slope(self) -> Scalar:
        """f_HalphaT [um]: rise of the mean profile line over the evaluated profile."""
        return self._step * (0.4 * self.module + 0.001 * self.diameter + 4)

    @property
    def profile_form(self) -> Scalar:
        """f_falphaT [um]: width of the band around the mean profile line."""
        return self._step * (0.55 * self.module + 5)

    @property
    def profile_total(self) -> Scalar:
        """F_alphaT [um]."""
        return jnp.hypot(self.profile_slope, self.profile_form)

    @property
    def helix_slope(self) -> Scalar:
        """f_HbetaT [um]: rise of the mean helix line over the face width."""
        return self._step * (0.05 * jnp.sqrt(self.diameter) + 0.35 * jnp.sqrt(self.face_width) + 4)

    @property
    def helix_form(self) -> Scalar:
        """f_fbetaT [um]: width of the band around the mean helix line."""
        return self._step * (0.07 * jnp.sqrt(self.diameter) + 0.45 * jnp.sqrt(self.face_width) + 4)

    @property
    def helix_total(self) -> Scalar:
        """F_betaT [um]."""
        return jnp.hypot(self.helix_slope, self.helix_form)

    @property
    def _step(self) -> Scalar:
        return 2 ** (0.5 * (self.quality_class - 5))


def iso_rounded(tolerance) -> Float[Array, "..."]:
    """A tolerance [um] as the standard states it: above 10 to 1, from 5 to 10 to 0.5, below 5 to 0.1.

    Totals are formed before rounding. The steps have no gradient.
    """
    tolerance = real(tolerance)
    per_unit = jnp.where(tolerance > 10, 1.0, jnp.where(tolerance >= 5, 2.0, 10.0)).astype(tolerance.dtype)
    return jnp.floor(tolerance * per_unit + 0.5) / per_unit
