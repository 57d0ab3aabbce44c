"""Step 1 of a layout: helix slope and crowning that level the load over the face.

References:
    U. Kissling's three-step layout of modifications: the flank line is always designed for the most even
    load over the face, at one torque, by the one-dimensional analysis of ISO 6336-1 Annex E.
"""

from typing import Literal

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import GearPair
from ..microgeometry import AbstractModification, LeadCrowning, LeadSlope
from ..numerics import Checked, implicit_root, number, program
from ..numerics.fits import fit
from ..shafts import AbstractSupport, annex_e
from ..shafts.mesh_support import even_coordinates
from .stations import Stations, at_stations

Scalar = Float[Array, ""]
GearName = Literal["pinion", "wheel"]


class FlankLine(Checked):
    """Helix slope and crowning of one gear over its own face, or of the gap over the common face of a pair.

    Attributes:
        slope: C_H_beta, from end to end, removing material at positive face coordinates.
        crowning: C_beta, at both ends.
    """

    slope: Scalar = number("um", default=0.0)
    crowning: Scalar = number("um", default=0.0)

    @property
    def modification(self) -> AbstractModification:
        """As a modification of the flank."""
        return LeadSlope(self.slope) + LeadCrowning(self.crowning)

    def on(self, pair: GearPair, gear: GearName) -> "FlankLine":
        """A flank line of the gap, over the common face, as that of a gear over its own face.

        Both open the common face alike, up to what they take off all of it.
        """
        own, common = getattr(pair, gear).face_width, pair.face_width
        middle = pair.face_middles[gear == "wheel"]
        slope = self.slope - 8 * self.crowning * middle / common
        return FlankLine(slope * own / common, self.crowning * (own / common) ** 2)

    def crowned(self, further) -> "FlankLine":
        """With so much crowning on top [um]."""
        return FlankLine(self.slope, self.crowning + further)


def level_load(
    support: AbstractSupport,
    torque=None,
    *,
    negative_crowning: bool = False,
    stiffness=None,
    stations: int | None = None,
) -> FlankLine:
    """The flank line with the most even load over the face at a torque, by least squares of the line load.

    Minimizes the sum of (w / mean w - 1)^2 over the stations of `annex_e`. It starts from the flank line that closes
    the gap which an even load would leave; where the whole face carries, the line load is linear in both amounts and
    Newton's method ends after one step. Differentiable in everything that the support is made of. The gaps of both
    flanks add up: the line is over the common face and may be ground on either gear (`FlankLine.on`), or shared.

    Args:
        support: shafts at the mesh, `support` of a gearbox or `RigidSupport`.
        torque: on the pinion [N m]; None for that of the couplings, which are scaled for another one.
        negative_crowning: whether the crowning may be negative; otherwise it is 0 where that would be best, and the
            slope is the best without it.
        stiffness: c_gamma [N/(mm um)]; None for that of ISO 6336-1, see `mesh_stiffness`.
        stations: over the face; None for 41, or those that `Stations` have.

    Returns:
        the flank line; NaN where the load over the face has not been found.

    Raises:
        ValueError: for a torque that is missing or out of range.
    """
    return _level(at_stations(support, torque, stations=stations), stiffness, negative_crowning)


def coordinates(face: Stations) -> tuple[Float[Array, " slices"], Float[Array, " slices"]]:
    """What a slope and a crowning of 1 um remove at the stations."""
    share = even_coordinates(1.0, face.count)
    return share, (2 * share) ** 2


@program
def _level(face: Stations, stiffness, negative_crowning: bool) -> FlankLine:
    slope, crowning = coordinates(face)

    def loaded(line):
        return annex_e(
            face,
            torque=face.torque,
            wheel=line.on(face.pair, "wheel").modification,
            stiffness=stiffness,
            stations=face.count,
        )

    def unevenness(amounts):
        load = loaded(FlankLine(amounts[0], amounts[1] if len(amounts) > 1 else jnp.zeros_like(amounts[0]))).line_load
        mean = jnp.mean(load)
        # without any load every flank line is as good as another
        return 0.5 * jnp.sum((load / jnp.where(mean > 0, mean, 1.0) - jnp.where(mean > 0, 1.0, 0.0)) ** 2)

    def best(shapes):
        basis = jnp.stack([jnp.ones_like(slope), *shapes], axis=1)
        return implicit_root(jax.grad(unevenness), -fit(basis, face.bent, "least_squares")[1:])

    both = best((slope, crowning))
    line = FlankLine(both[0], both[1])
    if not negative_crowning:
        alone, concave = best((slope,)), line.crowning < 0
        line = FlankLine(jnp.where(concave, alone[0], line.slope), jnp.where(concave, 0.0, line.crowning))
    found = loaded(line).converged
    return FlankLine(*(jnp.where(found, amount, jnp.nan) for amount in (line.slope, line.crowning)))
