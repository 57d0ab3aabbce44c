"""Tolerance limits of a gear pair."""

from dataclasses import replace

import equinox as eqx
from jaxtyping import Array, Float

from ..contact import Mesh
from ..geometry import Gear, GearPair
from ..numerics import Checked, concrete, number, real
from .distribution import AbstractDistribution, TruncatedNormal
from .iso_1328 import ToleranceClass, iso_rounded

Scalar = Float[Array, ""]


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
    def from_class(cls, gear: Gear, quality_class, *, rounded: bool = True) -> "GearTolerance":
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
    """Limits of everything that a sample of manufactured gears may deviate by, and the distribution in between.

    All deviations are independent of each other. Left out are the helix form, which slices without mutual support
    cannot show, and the slow part of the cumulative pitch deviation: over the few teeth in mesh at a time it is a
    constant, which shifts the transmission error and leaves its variation alone.

    Attributes:
        pinion, wheel: limits of the two gears.
        misalignment: of the shafts in the plane of action, over the face width, of either sign; None without.
            Needs a mesh of several slices.
        distribution: of every deviation between its limits.

    Raises:
        ValueError: for a negative or non-finite limit.
    """

    pinion: GearTolerance = eqx.field(default_factory=GearTolerance)
    wheel: GearTolerance = eqx.field(default_factory=GearTolerance)
    misalignment: Scalar | None = number("um", low=0.0, optional=True, default=None)
    distribution: AbstractDistribution = eqx.field(default_factory=TruncatedNormal)

    @classmethod
    def from_class(
        cls,
        pair: GearPair,
        quality_class=5,
        *,
        misalignment=None,
        distribution: AbstractDistribution | None = None,
        rounded: bool = True,
    ) -> "Tolerance":
        """Limits of both gears in a flank tolerance class of ISO 1328-1:2013.

        Args:
            pair: gear pair.
            quality_class: of both gears, 1 (finest) to 11, or one for the pinion and one for the wheel.
            misalignment: [um over the face width]; None without.
            distribution: between the limits; None for `TruncatedNormal()`, the limits at three standard deviations.
            rounded: to the steps of the standard; False keeps the limits differentiable with respect to the gears.

        Raises:
            ValueError: for a class or a gear outside the range of the standard.
        """
        both = isinstance(quality_class, (tuple, list))
        pinion_class, wheel_class = quality_class if both else (quality_class, quality_class)
        return cls(
            pinion=GearTolerance.from_class(pair.pinion, pinion_class, rounded=rounded),
            wheel=GearTolerance.from_class(pair.wheel, wheel_class, rounded=rounded),
            misalignment=misalignment,
            distribution=TruncatedNormal() if distribution is None else distribution,
        )

    def without_lead(self) -> "Tolerance":
        """The same tolerance without helix slopes and misalignment, for a mesh of one slice."""
        return replace(
            self,
            pinion=replace(self.pinion, helix_slope=None),
            wheel=replace(self.wheel, helix_slope=None),
            misalignment=None,
        )


def check_slices(owner: str, tolerance: Tolerance, mesh: Mesh) -> None:
    """Raises a `ValueError` when the tolerance has lead deviations and the mesh has one slice, which cannot show them.

    A traced limit counts as one: its influence would be zero without a word.
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
            f"{owner}: {name} = {shown} must be None or 0 um on a mesh of 1 slice, which cannot show it: prepare "
            "with Resolution(slices=5), or take tolerance.without_lead()"
        )
