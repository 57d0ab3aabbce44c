"""What a support does at the stations of the one-dimensional analysis, worked out once for many flank lines."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..geometry import GearPair
from ..numerics import check, concrete, optional_real, program, real, result, whole
from ..shafts import AbstractSupport, ShaftSupport, TabulatedSupport
from ..shafts.mesh_support import even_coordinates

Slices = Float[Array, " slices"]
Scalar = Float[Array, ""]

STATIONS = 41  # over the face, as many as `annex_e` has
_SAME_TORQUE = 1e-6  # relative; single precision


class Stations(AbstractSupport):
    """A support as numbers at evenly spaced stations, under one torque; made by `at_stations`.

    With as many stations as slices, all of one width, it stands for the support in `prepare`, and programs compiled for
    one gearbox serve every other.

    Attributes:
        table: what it does over the face.
        load: torque on the pinion under which it does that.
        held: whether the support that it was worked out from can be.
    """

    table: TabulatedSupport
    load: Scalar = result("N m")
    held: Bool[Array, ""] = eqx.field()

    @property
    def valid(self) -> Bool[Array, ""]:
        """`held`."""
        return self.held

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
        """That of the table; the face coordinates must be those of the stations."""
        return self.table.influence(y)

    def gap(self, y: Slices) -> Slices:
        """That of the table; the face coordinates must be those of the stations."""
        return self.table.gap(y)

    @property
    def bent(self) -> Slices:
        """Gap that an even load of the torque would leave [um]."""
        force = 1e3 * self.torque / self.pair.pinion.base_radius / self.count
        influence, gap = self.table.matrix, self.table.opening
        return jnp.sum(influence, axis=-1) * force + (0.0 if gap is None else gap)


def at_torque(support: ShaftSupport, torque) -> ShaftSupport:
    """The gearbox with the torques of all couplings in proportion, so that the pinion of the mesh carries a torque.

    Loads from outside stay as they are.

    Args:
        support: shafts at the mesh.
        torque: on its pinion [N m].

    Raises:
        ValueError: for a negative torque, and for a gearbox whose mesh carries none, which nothing can be in proportion
            to.
    """
    check("at_torque", "torque", torque, "N m", low=0.0)
    now = support.torque
    known = concrete(now)
    if known is not None and known <= 0:
        raise ValueError("at_torque: the couplings bring no torque to the mesh, there is nothing to be scaled")
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


def at_stations(support: AbstractSupport, torque=None, *, stations: int | None = None) -> Stations:
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
                f"at_stations: stations = {stations} must be {support.count}, which were worked out; give the support "
                "itself for others"
            )
        return support
    if not isinstance(support, ShaftSupport) and torque is None:
        raise ValueError("at_stations: torque must be given: no coupling tells it")
    check("at_stations", "torque", torque, "N m", low=0.0)
    count = whole("at_stations", "stations", STATIONS if stations is None else stations, 2, 1001)
    return _at_stations(support, optional_real(torque), count)


def _check_load(face: Stations, torque) -> None:
    if torque is None:
        return
    given, known = concrete(real(torque)), concrete(face.load)
    if given is None or known is None or not np.isclose(given, known, rtol=_SAME_TORQUE):
        raise ValueError(
            "at_stations: torque must be that under which the stations were worked out: other meshes and loads open "
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
    return Stations(TabulatedSupport(support.pair, support.influence(y), gap), torque, support.valid)
