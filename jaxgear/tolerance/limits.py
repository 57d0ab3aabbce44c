"""Tolerance limits of a gear pair, for instance by ISO 1328-1:2013, and distributions of deviations between them."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from ..contact import Mesh
from ..geometry import Gear, GearPair
from ..numerics import Checked, Given, check, concrete, number, real

Draws = Float[Array, "..."]


class AbstractDistribution(Checked):
    """A symmetric distribution between -1 and 1; a deviation is its tolerance limit times a draw."""

    @abstractmethod
    def __call__(self, key: PRNGKeyArray, shape: tuple[int, ...], dtype: np.dtype) -> Draws:
        """Independent draws between -1 and 1."""


class TruncatedNormal(AbstractDistribution):
    """Normal distribution truncated at the limits, which lie at `sigmas` standard deviations: inspected parts.

    Three standard deviations are usual for a capable process (0.27 % of the parts are rejected).
    """

    sigmas: Float[Array, ""] = number("", low=0.0, open_low=True, default=3.0)

    def __call__(self, key: PRNGKeyArray, shape: tuple[int, ...], dtype: np.dtype) -> Draws:
        sigmas = self.sigmas.astype(dtype)
        return jax.random.truncated_normal(key, -sigmas, sigmas, shape, dtype) / sigmas


class Uniform(AbstractDistribution):
    """Uniform distribution between the limits, if nothing but the tolerance is known."""

    def __call__(self, key: PRNGKeyArray, shape: tuple[int, ...], dtype: np.dtype) -> Draws:
        return jax.random.uniform(key, shape, dtype, -1.0, 1.0)


Scalar = Float[Array, ""]


class ToleranceClass(Checked):
    """Tolerances of one gear in a flank tolerance class (ISO 1328-1:2013, 5.3), unrounded and differentiable.

    All follow `(terms in d, m_n, b) * sqrt(2)^(class - 5)`; slopes and pitch are limits of either sign, form and total
    deviations are widths of a band. `iso_rounded` gives the rounded numbers of a drawing.

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
    def of(cls, gear: Gear, quality_class: Given) -> "ToleranceClass":
        """Tolerances of a gear of 5 to 1000 teeth."""
        check("ToleranceClass: teeth", gear.teeth, "", low=5.0, high=1000.0)
        return cls(
            2 * gear.signed(gear.pitch_radius),
            gear.module,
            gear.face_width,
            real(quality_class, "ToleranceClass: quality_class"),
        )

    @property
    def single_pitch(self) -> Scalar:
        """Single pitch tolerance f_pT, between neighbouring teeth [um]."""
        return self._step * (0.001 * self.diameter + 0.4 * self.module + 5)

    @property
    def total_pitch(self) -> Scalar:
        """Total cumulative pitch tolerance F_pT, between any two teeth of the gear [um]."""
        linear = 0.002 * self.diameter + 0.7 * self.module + 12
        return self._step * (linear + 0.55 * jnp.sqrt(self.diameter))

    @property
    def profile_slope(self) -> Scalar:
        """Profile slope tolerance f_HalphaT: rise of the mean profile line over the evaluated profile [um]."""
        return self._step * (0.4 * self.module + 0.001 * self.diameter + 4)

    @property
    def profile_form(self) -> Scalar:
        """Profile form tolerance f_falphaT: width of the band around the mean profile line [um]."""
        return self._step * (0.55 * self.module + 5)

    @property
    def profile_total(self) -> Scalar:
        """Total profile tolerance F_alphaT [um]."""
        return jnp.hypot(self.profile_slope, self.profile_form)

    @property
    def helix_slope(self) -> Scalar:
        """Helix slope tolerance f_HbetaT: rise of the mean helix line over the face width [um]."""
        return self._step * (0.05 * jnp.sqrt(self.diameter) + 0.35 * jnp.sqrt(self.face_width) + 4)

    @property
    def helix_form(self) -> Scalar:
        """Helix form tolerance f_fbetaT: width of the band around the mean helix line [um]."""
        return self._step * (0.07 * jnp.sqrt(self.diameter) + 0.45 * jnp.sqrt(self.face_width) + 4)

    @property
    def helix_total(self) -> Scalar:
        """Total helix tolerance F_betaT [um]."""
        return jnp.hypot(self.helix_slope, self.helix_form)

    @property
    def _step(self) -> Scalar:
        return 2 ** (0.5 * (self.quality_class - 5))


def iso_rounded(tolerance: Given) -> Float[Array, "..."]:
    """Tolerance rounded by the standard [um]: above 10 um to 1, from 5 to 10 um to 0.5, below 5 um to 0.1.

    Totals are formed before rounding. The steps have no gradient.
    """
    tolerance = real(tolerance)
    per_unit = jnp.where(tolerance > 10, 1.0, jnp.where(tolerance >= 5, 2.0, 10.0)).astype(tolerance.dtype)
    return jnp.floor(tolerance * per_unit + 0.5) / per_unit


class GearTolerance(Checked):
    """Limits of the flank deviations of one gear.

    Attributes:
        profile_slope: f_Halpha, of either sign; all teeth share the deviation, as it comes from tool and machine.
        profile_form: f_falpha, largest height of the waviness from peak to valley; shared by all teeth.
        pitch: f_p, largest difference between the positions of two neighbouring teeth. Every tooth is displaced on its
            own by at most half of it, so that no two neighbours can differ by more.
        helix_slope: f_Hbeta, of either sign, shared by all teeth; None without. Needs a mesh of several slices.

    Raises:
        ValueError: for a negative or non-finite limit.
    """

    profile_slope: Scalar = number("um", low=0.0, default=0.0)
    profile_form: Scalar = number("um", low=0.0, default=0.0)
    pitch: Scalar = number("um", low=0.0, default=0.0)
    helix_slope: Scalar | None = number("um", low=0.0, optional=True, default=None)

    @classmethod
    def from_class(cls, gear: Gear, quality_class: Given, *, rounded: bool = True) -> "GearTolerance":
        """Limits of a gear in a flank tolerance class of ISO 1328-1:2013, 1 to 11.

        Args:
            gear: its reference diameter, module and face width decide.
            quality_class: whole number from 1 (finest) to 11.
            rounded: to the steps of the standard; False keeps the limits differentiable with respect to the gear.
        """
        limits = ToleranceClass.of(gear, quality_class)
        stated = iso_rounded if rounded else real
        return cls(
            profile_slope=stated(limits.profile_slope),
            profile_form=stated(limits.profile_form),
            pitch=stated(limits.single_pitch),
            helix_slope=stated(limits.helix_slope),
        )


class Tolerance(Checked):
    """Limits of the deviations of manufactured gears, and the distribution between them.

    All deviations are independent of each other. Two deviations are not modelled: the helix form, which uncoupled
    slices cannot represent, and the long-wave part of the cumulative pitch deviation, which is constant over the few
    teeth in mesh and shifts the transmission error without changing its variation.

    Attributes:
        pinion, wheel: limits of the two gears.
        misalignment: limit of the misalignment in the plane of action, over the face width, of either sign; None for
            none. It needs a mesh of several slices.
        distribution: distribution of every deviation between its limits.

    Raises:
        ValueError: for a negative or non-finite limit.
    """

    table = "tolerance"

    pinion: GearTolerance = eqx.field(default_factory=GearTolerance)
    wheel: GearTolerance = eqx.field(default_factory=GearTolerance)
    misalignment: Scalar | None = number("um", low=0.0, optional=True, default=None)
    distribution: AbstractDistribution = eqx.field(default_factory=TruncatedNormal)

    @classmethod
    def from_class(
        cls,
        pair: GearPair,
        quality_class: Given | Sequence[Given] = 5,
        *,
        misalignment: Given | None = None,
        distribution: AbstractDistribution | None = None,
        rounded: bool = True,
    ) -> "Tolerance":
        """Limits of both gears in a flank tolerance class of ISO 1328-1:2013.

        Args:
            pair: gear pair.
            quality_class: quality class of both gears, 1 (finest) to 11, or one for the pinion and one for the wheel.
            misalignment: [um over the face width]; None without.
            distribution: between the limits; None for `TruncatedNormal()`, the limits at three standard deviations.
            rounded: to the steps of the standard; False keeps the limits differentiable with respect to the gears.

        Raises:
            ValueError: for a class or a gear outside the range of the standard.
        """
        classes = quality_class if isinstance(quality_class, Sequence) else (quality_class, quality_class)
        pinion_class, wheel_class = classes
        return cls(
            pinion=GearTolerance.from_class(pair.pinion, pinion_class, rounded=rounded),
            wheel=GearTolerance.from_class(pair.wheel, wheel_class, rounded=rounded),
            misalignment=None if misalignment is None else real(misalignment, "Tolerance: misalignment"),
            distribution=TruncatedNormal() if distribution is None else distribution,
        )

    def without_lead(self) -> "Tolerance":
        """Copy of the tolerance without helix slopes and misalignment, for a mesh of one slice."""
        return replace(
            self,
            pinion=replace(self.pinion, helix_slope=None),
            wheel=replace(self.wheel, helix_slope=None),
            misalignment=None,
        )


def check_slices(tolerance: Tolerance, mesh: Mesh) -> None:
    """Raise a `ValueError` if the tolerance has lead deviations and the mesh has only one slice.

    A traced limit counts as a lead deviation: its derivative would be zero.
    """
    if mesh.resolution.slices > 1:
        return
    for name, limit in (
        ("pinion helix_slope", tolerance.pinion.helix_slope),
        ("wheel helix_slope", tolerance.wheel.helix_slope),
        ("misalignment", tolerance.misalignment),
    ):
        known = None if limit is None else concrete(limit)
        if limit is None or (known is not None and not known.any()):
            continue
        shown = "a traced limit" if known is None else f"{float(known.max()):g} um"
        raise ValueError(
            f"{name} = {shown} must be None or 0 um on a mesh of 1 slice, which cannot show it: prepare "
            "with Resolution(slices=5), or take tolerance.without_lead()"
        )
