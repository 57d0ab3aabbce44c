"""The cases in which a design is judged: every load with every manufactured pair."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..contact import Mesh, OperatingPoint
from ..contact.face_coupling import check_torque
from ..contact.operating_point import operating_point_of
from ..numerics import Checked, program, real, result, whole
from ..tolerance import Deviation, Tolerance, sample_deviations
from ..tolerance.deviation import deviation_field, flank_basis
from .load import LoadSpectrum

SAMPLES = 64  # manufactured pairs, where nothing is said


class Conditions(Checked):
    """Under what designs are judged, whatever their mesh: loads, and the gears that run under every one of them.

    All designs meet the same gears, and so do all loads (common random numbers): what is compared differs by the design
    and the load alone.

    Attributes:
        load: torques and their weights.
        deviations: of the manufactured gears, with a leading axis (samples,); None for nominal gears.
    """

    load: LoadSpectrum
    deviations: Deviation | None = None

    @property
    def samples(self) -> int:
        """Number of manufactured pairs; 1 for nominal gears."""
        return 1 if self.deviations is None else len(self.deviations.misalignment)

    @property
    def count(self) -> int:
        """Contact analyses per design."""
        return len(self.load.torques) * self.samples

    def on(self, mesh: Mesh) -> "Cases":
        """The cases on a mesh; traceable, where every design has a mesh of its own."""
        check_torque("load", mesh.support_torque, self.load.torques)
        load = jax.tree.map(lambda numbers: numbers.astype(mesh.slice_width.dtype), self.load)
        removed = None if self.deviations is None else _removed(mesh, load.torques, self.deviations)
        return Cases(load.torques, load.speeds, load.friction, load.weights, removed)


class Cases(Checked):
    """Conditions on a mesh.

    What a deviation removes depends on the mesh and the torque, not on the flanks' design: it is worked out once.

    Attributes:
        torque: on the pinion [N m], shape (torques,).
        speed: of the pinion at every torque [rpm], shape (torques,); None where nothing asks for it.
        friction: mean coefficient of friction; None for the default of whatever needs it.
        weight: of every torque, sum 1, shape (torques,).
        removed: material that deviations remove [um], shape (torques, samples, pairs, slices, positions); None for
            nominal gears.
    """

    torque: Float[Array, " torques"] = result("N m")
    speed: Float[Array, " torques"] | None = result("rpm")
    friction: Float[Array, ""] | None = result()
    weight: Float[Array, " torques"] = result()
    removed: Float[Array, "torques samples pairs slices positions"] | None = result("um")

    @property
    def samples(self) -> int:
        """Number of manufactured pairs; 1 for nominal gears."""
        return 1 if self.removed is None else self.removed.shape[1]

    @property
    def count(self) -> int:
        """Contact analyses per design."""
        return len(self.torque) * self.samples

    @property
    def first(self) -> OperatingPoint:
        """The first load."""
        return OperatingPoint(self.torque[0], None if self.speed is None else self.speed[0], self.friction)

    @property
    def weights(self) -> Float[Array, " cases"]:
        """Weight of every case, torques first; sum 1."""
        return _repeated(self.weight, self.samples)

    def each(self, function):
        """function(operating_point, removed) in every case, with a leading axis (cases,); the torques run slowest.

        A single case is not mapped, so that it costs no more than a plain call.
        """

        def at(load, removed):
            torque, speed = load
            return function(OperatingPoint(torque, speed, self.friction), removed)

        loads = self.torque, self.speed
        if self.removed is not None:
            found = jax.vmap(jax.vmap(at, (None, 0)))(loads, self.removed)
            return jax.tree.map(lambda part: part.reshape(self.count, *part.shape[2:]), found)
        nothing = jnp.zeros((), self.torque.dtype)
        if self.count == 1:
            return jax.tree.map(lambda part: part[None], at(jax.tree.map(lambda part: part[0], loads), nothing))
        return jax.vmap(at, (0, None))(loads, nothing)


def conditions(
    owner: str, mesh: Mesh, torque, *, tolerance: Tolerance | None = None, samples: int | None = None, seed: int = 0
) -> Conditions:
    """Conditions of a torque or a load spectrum, with manufactured gears where there is a tolerance.

    Args:
        owner: the function that is asked, for messages.
        mesh: prepared mesh; its number of pairs and its floating-point type count, nothing else.
        torque: on the pinion [N m], an `OperatingPoint`, or a `LoadSpectrum`.
        tolerance: of manufactured gears; None for nominal ones.
        samples: manufactured pairs, which run under every torque; None for 64. Sample i depends on the seed and on i
            alone, see `sample_deviations`.
        seed: of their deviations.

    Raises:
        ValueError: for a negative torque, samples without a tolerance, and for lead deviations on a mesh of one slice.
    """
    load = torque
    if not isinstance(torque, LoadSpectrum):
        load = LoadSpectrum.of(operating_point_of(owner, torque, real(0.0).dtype))
    if tolerance is None:
        if samples is not None:
            raise ValueError(f"{owner}: samples = {samples!r} has no effect without a tolerance")
        return Conditions(load)
    count = SAMPLES if samples is None else whole(owner, "samples", samples)
    return Conditions(load, sample_deviations(tolerance, mesh, count, seed))


@program
def _repeated(weight, samples: int):
    return jnp.repeat(weight / samples, samples)


@program
def _removed(mesh: Mesh, torques, deviations: Deviation):
    def at(torque):
        basis = flank_basis(mesh, torque)
        return jax.vmap(lambda one: deviation_field(one, basis))(deviations)

    return jax.vmap(at)(torques)
