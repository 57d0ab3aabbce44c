"""Flank tolerances of ISO 1328-1:2013, which differ from the 1995 edition: never mix the two."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Gear
from ..numerics import Checked, check, number, real

Scalar = Float[Array, ""]


class ToleranceClass(Checked):
    """Tolerances of one gear in a flank tolerance class (ISO 1328-1:2013, 5.3), unrounded and differentiable.

    All follow `(terms in d, m_n, b) * sqrt(2)^(class - 5)`; slopes and pitch are limits of either sign, form and total
    deviations are widths of a band. `iso_rounded` gives the numbers that stand on a drawing.

    Attributes:
        diameter: reference diameter d.
        module: normal module m_n.
        face_width: b.
        quality_class: 1 is the finest.

    Raises:
        ValueError: for a number outside the range of the standard.
    """

    diameter: Scalar = number("mm", low=5.0, high=15_000.0)
    module: Scalar = number("mm", low=0.5, high=70.0)
    face_width: Scalar = number("mm", low=4.0, high=1200.0)
    quality_class: Scalar = number("", low=1.0, high=11.0, whole=True)

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
