"""Step 1 of a layout: helix slope and crowning that level the load over the face, at stations worked out once.

References:
    U. Kissling's three-step layout of modifications: the flank line is always designed for the most even
    load over the face, at one torque, by the one-dimensional analysis of ISO 6336-1 Annex E.
"""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact.status import Statuses
from ..geometry import GearPair
from ..microgeometry import AbstractModification, EndRelief, LeadCrowning, LeadSlope
from ..numerics import (
    Checked,
    Given,
    check,
    concrete,
    implicit_root,
    number,
    optional_real,
    program,
    real,
    result,
    whole,
)
from ..numerics.fits import fit
from ..shafts import AbstractSupport, ShaftSupport, TabulatedSupport, annex_e
from ..shafts.mesh_support import even_coordinates

Slices = Float[Array, " slices"]
Scalar = Float[Array, ""]

_SIDES: tuple[Literal["negative", "positive"], ...] = "negative", "positive"
STATIONS = 41  # over the face, as many as `annex_e` has
_SAME_TORQUE = 1e-6  # relative; single precision


class Stations(AbstractSupport):
    """A support as numbers at evenly spaced stations, under one torque; made by `at_stations`.

    With as many stations as slices, all of one width, it stands for the support in `prepare`, and programs compiled for
    one gearbox serve every other.

    Attributes:
        table: what it does over the face.
        load: torque on the pinion under which it does that.
        of_support: status of the support that it was worked out from.
    """

    table: TabulatedSupport
    load: Scalar = result("N m")
    of_support: Statuses = result()

    @property
    def status(self) -> Statuses:
        """`of_support`."""
        return self.of_support

    @property
    def pair(self) -> GearPair:
        """The gears of the mesh."""
        return self.table.gears

    @property
    def torque(self) -> Scalar:
        """`load`."""
        return self.load

    @property
    def needs_even_slices(self) -> bool:
        return True

    @property
    def count(self) -> int:
        """Number of stations."""
        return self.table.matrix.shape[-1]

    def influence(self, y: Slices) -> Float[Array, "slices slices"]:
        """Influence matrix of the table [um/N]; the face coordinates must be those of the stations."""
        return self.table.influence(y)

    def gap(self, y: Slices) -> Slices:
        """Gap of the table [um]; the face coordinates must be those of the stations."""
        return self.table.gap(y)

    @property
    def bent(self) -> Slices:
        """Gap that an even load of the torque would leave [um]."""
        force = 1e3 * self.torque / self.pair.pinion.base_radius / self.count
        influence, gap = self.table.matrix, self.table.opening
        return jnp.sum(influence, axis=-1) * force + (0.0 if gap is None else gap)


def at_torque(support: ShaftSupport, torque: Given) -> ShaftSupport:
    """The gearbox with the torques of all couplings in proportion, so that the pinion of the mesh carries a torque.

    Loads from outside stay as they are.

    Args:
        support: shafts at the mesh.
        torque: on its pinion [N m].

    Raises:
        ValueError: for a negative torque, and for a gearbox whose mesh carries none, which nothing can be in proportion
            to.
    """
    check("torque", torque, "N m", low=0.0)
    now = support.torque
    known = concrete(now)
    if known is not None and known <= 0:
        raise ValueError("the couplings transmit no torque to the mesh, which could be scaled")
    factor = real(torque) / now
    given = [
        (i, j)
        for i, shaft in enumerate(support.gearbox.shafts)
        for j, item in enumerate(shaft.couplings)
        if item.torque is not None
    ]

    def torques(of: ShaftSupport):
        return [of.gearbox.shafts[i].couplings[j].torque for i, j in given]

    return eqx.tree_at(torques, support, [factor * each for each in torques(support)])


def at_stations(support: AbstractSupport, torque: Given | None = None, *, stations: int | None = None) -> Stations:
    """A support at the stations of the one-dimensional analysis.

    Args:
        support: shafts at the mesh, or `RigidSupport`.
        torque: on the pinion [N m]; None for that of the couplings. For another one they are scaled, see `at_torque`.
        stations: over the face; None for 41, or those that `Stations` have.

    Raises:
        ValueError: for a support without couplings and without a torque, a torque out of range, or another one than
            that under which `Stations` were worked out; for another number of stations than they have.
    """
    if isinstance(support, Stations):
        _check_load(support, torque)
        if stations not in (None, support.count):
            raise ValueError(
                f"stations = {stations} must be {support.count}, which were worked out; give the support "
                "itself for others"
            )
        return support
    if not isinstance(support, ShaftSupport) and torque is None:
        raise ValueError("torque must be given: no coupling has one")
    check("torque", torque, "N m", low=0.0)
    count = whole("stations", STATIONS if stations is None else stations, 2, 1001)
    return _at_stations(support, optional_real(torque), count)


def _check_load(face: Stations, torque) -> None:
    if torque is None:
        return
    given, known = concrete(real(torque)), concrete(face.load)
    if given is None or known is None or not np.isclose(given, known, rtol=_SAME_TORQUE):
        raise ValueError(
            "torque must be that under which the stations were worked out: other meshes and loads open "
            "other gaps at another one, give the support itself"
        )


@program
def _at_stations(support: AbstractSupport, torque: Scalar | None, stations: int) -> Stations:
    y = even_coordinates(support.pair.face_width, stations)
    if isinstance(support, ShaftSupport):
        support = support if torque is None else at_torque(support, torque)
        torque = support.torque
    assert torque is not None
    gap = jnp.broadcast_to(support.gap(y), y.shape)
    return Stations(TabulatedSupport(support.pair, support.influence(y), gap), torque, support.status)


GearName = Literal["pinion", "wheel"]


class FlankLine(Checked):
    """Helix slope, crowning and end reliefs of one gear over its own face, or of the gap over a pair's common face.

    Attributes:
        slope: C_H_beta, from end to end, removing material at positive face coordinates.
        crowning: C_beta, at both ends.
        ends: linear end reliefs C_beta I and II, at the negative and at the positive end; empty for none.
    """

    slope: Scalar = number("um", default=0.0)
    crowning: Scalar = number("um", default=0.0)
    ends: tuple[EndRelief, ...] = ()

    @property
    def modification(self) -> AbstractModification:
        """Modification of the flank: slope, crowning and end reliefs."""
        return sum(self.ends, LeadSlope(self.slope) + LeadCrowning(self.crowning))

    def on(self, pair: GearPair, gear: GearName) -> "FlankLine":
        """A flank line of the gap, over the common face, as that of a gear over its own face.

        Both open the common face alike, up to what they take off all of it. End reliefs run on over the overhangs.
        """
        own, common = getattr(pair, gear).face_width, pair.face_width
        middle = pair.face_middles[gear == "wheel"]
        slope = self.slope - 8 * self.crowning * middle / common
        ends = []
        for end, overhang in zip(self.ends, pair.overhangs[gear == "wheel"]):
            length = end.length + overhang
            ends.append(EndRelief(end.amount * length / end.length, length, end.curve, end.side))
        return FlankLine(slope * own / common, self.crowning * (own / common) ** 2, tuple(ends))

    def further(self, amount: Given, end_relief: Given | None = None) -> "FlankLine":
        """With so much more removed at both ends [um]: by end reliefs of a width [mm], by crowning for None."""
        if end_relief is None:
            return FlankLine(self.slope, self.crowning + amount, self.ends)
        ends = tuple(EndRelief(real(amount), real(end_relief), side=side) for side in _SIDES)
        return FlankLine(self.slope, self.crowning, ends)


def iso_end_relief_width(pair: GearPair) -> Scalar:
    """Width of end reliefs by ISO 6336-1 Annex B [mm]: a tenth of the face, at most a normal module."""
    return jnp.minimum(0.1 * pair.face_width, pair.pinion.module)


def level_load(
    support: AbstractSupport,
    torque: Given | None = None,
    *,
    negative_crowning: bool = False,
    stiffness: Given | None = None,
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
    """Modification by a slope and by a crowning of 1 um at the stations [um]."""
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
    return FlankLine(jnp.where(found, line.slope, jnp.nan), jnp.where(found, line.crowning, jnp.nan))
