"""Supports of the rim of a ring gear."""

from abc import abstractmethod

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..numerics import Checked, changed, concrete, count, number

Scalar = Float[Array, ""]

# The reaction of an arc is constant on each of so many segments, or on as many as are this wide on average [deg] ...
_FEWEST_SEGMENTS, _WIDEST = 8, 2.0
# ... which Fourier series have to resolve: their terms times the width of an arc [deg], and those for a traced width
# (8 segments in one of 2 deg).
_RESOLVED, _FEWEST_HARMONICS, _HARMONICS_TRACED = 2400, 400, 1200


class AbstractRimSupport(Checked):
    """Support of a ring gear on its outer circle, in place of one that is rigid all round.

    Attributes:
        stiffness: stiffness of the support; None for a rigid one.
        harmonics: number of Fourier terms of the ring by which the support is resolved.
    """

    stiffness: eqx.AbstractVar[Scalar | None]
    harmonics: eqx.AbstractVar[int]

    @property
    @abstractmethod
    def alike(self) -> bool:
        """True if all teeth of the ring are supported alike, so that its mesh cycles are all the same."""

    @property
    @abstractmethod
    def mirrored(self) -> "AbstractRimSupport":
        """Support in the mirror image of the gear."""


class SupportArcs(AbstractRimSupport):
    """Equal arcs, evenly spaced: lugs, bolts, pins, or a spline that carries on a part of its circumference.

    Teeth between two arcs lie softer than those at an arc. Mesh positions count from the contact of the reference pair
    at the pitch point, and the arcs turn with the ring: `first` says where on the ring the mesh cycle takes place. The
    cycle after that takes place a pitch further on, so that the curves over one cycle do not close.

    Attributes:
        arcs: number of arcs.
        width: width of every arc [deg], at least 0.5; a traced one at least 2.
        first: place of the middle of the first arc [deg]: angle from the middle of the space of the ring in which the
            reference tooth of the planet is, positive towards the teeth that mesh after it; 0 by default, half of
            360 / arcs between two arcs.
        stiffness: stiffness of a single arc in both directions, that of its bolt or pin [N/um]; None for rigid ones.
        radial: True if the arcs hold the rim in radial direction too, False for those that slide, such as the flanks
            of a spline or pins in slots.

    Raises:
        ValueError: for a number out of its range, arcs that overlap, and fewer than three that slide.
    """

    arcs: int = count(low=2, high=360)
    width: Scalar = number("deg", low=0.5, high=180.0)
    first: Scalar = number("deg", low=-360.0, high=360.0, default=0.0, kw_only=True)
    stiffness: Scalar | None = number("N/um", low=0.0, open_low=True, optional=True, default=None, kw_only=True)
    radial: bool = eqx.field(static=True, default=True, kw_only=True)
    segments: int = eqx.field(init=False, repr=False, static=True, default=_FEWEST_SEGMENTS)
    harmonics: int = eqx.field(init=False, repr=False, static=True, default=_HARMONICS_TRACED)

    def check_together(self) -> None:
        if not self.radial and self.arcs < 3:
            raise ValueError(f"SupportArcs: arcs = {self.arcs} must be at least 3 for arcs that slide radially")
        width = concrete(self.width)
        if width is None:
            return
        widest = float(np.max(width))
        if self.arcs * widest > 360.0 * (1 + 1e-6):
            raise ValueError(
                f"SupportArcs: width = {widest:g} deg must be at most {360.0 / self.arcs:.6g} deg, the spacing of "
                f"{self.arcs} arcs"
            )
        object.__setattr__(self, "segments", max(_FEWEST_SEGMENTS, int(np.ceil(widest / _WIDEST))))
        needed = int(np.ceil(_RESOLVED / float(np.min(width)) * (1 - 1e-6)))
        object.__setattr__(self, "harmonics", max(_FEWEST_HARMONICS, needed))

    @property
    def alike(self) -> bool:
        return False

    @property
    def mirrored(self) -> "SupportArcs":
        return changed(self, first=-self.first)


class ElasticFoundation(AbstractRimSupport):
    """Elastic support all round, such as a spline or a press fit: the traction on the rim is -k u.

    Attributes:
        stiffness: traction per displacement k, in radial and in tangential direction [N/mm^3].
    """

    stiffness: Scalar = number("N/mm^3", low=0.0, open_low=True)
    harmonics: int = eqx.field(init=False, repr=False, static=True, default=_FEWEST_HARMONICS)

    @property
    def alike(self) -> bool:
        return True

    @property
    def mirrored(self) -> "ElasticFoundation":
        return self
