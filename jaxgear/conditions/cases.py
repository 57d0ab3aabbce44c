"""Loads and manufactured gears for the evaluation of designs."""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import Mesh, OperatingPoint
from ..contact.face_coupling import check_torque
from ..contact.operating_point import Torque, operating_point_of
from ..numerics import Checked, Given, Numbers, check, concrete, number, optional_real, program, real, result
from ..tolerance import Deviation, ManufacturedGears
from ..tolerance.deviation import deviation_field, flank_basis


class LoadSpectrum(Checked):
    """Load spectrum: several torques, each with its share of time or revolutions.

    Attributes:
        torques: torques on the pinion, shape (torques,).
        weights: shares of the torques, which sum to 1, shape (torques,).
        speeds: speeds of the pinion at every torque, shape (torques,); None for no speeds.
        friction: mean coefficient of friction for all torques; None for the default of each quantity.
        duration: total duration of all loads, for a life; None for no duration.
    """

    torques: Float[Array, " torques"] = number("N m", low=0.0, shape=("torques",))
    weights: Float[Array, " torques"] = number("", low=0.0, shape=("torques",))
    speeds: Float[Array, " torques"] | None = number("rpm", low=0.0, shape=("torques",), optional=True)
    friction: Float[Array, ""] | None = number("", low=0.0, optional=True)
    duration: Float[Array, ""] | None = number("h", low=0.0, open_low=True, optional=True)

    def __init__(
        self,
        torques: Numbers,
        weights: Numbers | None = None,
        speeds: Numbers | None = None,
        friction: Given | None = None,
        duration: Given | None = None,
    ) -> None:
        """Makes the spectrum.

        Args:
            torques: torques on the pinion [N m], all different unless they have speeds.
            weights: shares of the torques, of any sum; None for equal shares.
            speeds: speeds of the pinion [rpm], one per torque or one for all; None for none.
            friction: mean coefficient of friction; None for the default of each quantity.
            duration: total duration of all loads [h], of which the weights are shares; None for none.

        Raises:
            ValueError: for torques, weights or speeds that are negative, not finite or of different number, loads that
                are repeated, or weights that are all zero.
        """
        self.torques = real(torques)
        if self.torques.ndim != 1 or not len(self.torques):
            raise ValueError("LoadSpectrum: torques must be a list of at least one torque")
        self.speeds = None if speeds is None else self._as_many("speeds", real(speeds))
        self.friction, self.duration = optional_real(friction), optional_real(duration)
        self._check_different()
        shares = real(np.ones(self.torques.shape, self.torques.dtype)) if weights is None else real(weights)
        check("LoadSpectrum: weights", shares, "", low=0.0)
        if shares.ndim != 1:
            raise ValueError(f"LoadSpectrum: weights must be a list of {len(self.torques)}, one per torque")
        shares = self._as_many("weights", shares)
        known = concrete(shares)
        total = jnp.sum(shares) if known is None else known.sum()
        check("LoadSpectrum: sum of the weights", total, "", low=0.0, open_low=True)
        self.weights = shares / total if known is None else real(known / total)

    def _as_many(self, name: str, values: Array) -> Array:
        if values.ndim == 0:
            values = jnp.full_like(self.torques, values)
        if values.shape != self.torques.shape:
            raise ValueError(f"LoadSpectrum: {values.size} {name} must be as many as the {len(self.torques)} torques")
        return values

    def _check_different(self) -> None:
        given = [self.torques] if self.speeds is None else [self.torques, self.speeds]
        known = [values for values in map(concrete, given) if values is not None]
        if len(known) < len(given):
            return
        if len(np.unique(np.stack(known, axis=1), axis=0)) != len(self.torques):
            raise ValueError("LoadSpectrum: torques must be different" + ", or their speeds" * (len(given) > 1))

    @staticmethod
    def from_hours(
        torques: Numbers, hours: Numbers, speeds: Numbers | None = None, friction: Given | None = None
    ) -> "LoadSpectrum":
        """Duty cycle from the operating hours at every torque.

        Args:
            torques, speeds, friction: as for the class.
            hours: hours at every torque [h].

        Raises:
            ValueError: as the class does, and for hours that are all zero.
        """
        spent = real(hours)
        check("LoadSpectrum: hours", spent, "h", low=0.0)
        if spent.ndim != 1:
            raise ValueError("LoadSpectrum: hours must be a list, one entry per torque")
        check("LoadSpectrum: sum of the hours", jnp.sum(spent), "h", low=0.0, open_low=True)
        return LoadSpectrum(torques, spent, speeds, friction, jnp.sum(spent))

    @property
    def hours(self) -> Float[Array, " torques"] | None:
        """Hours at every torque [h]; None without a duration."""
        return None if self.duration is None else self.weights * self.duration

    def turns(self) -> Float[Array, " torques"]:
        """Revolutions of the pinion at every torque, shape (torques,); the weights if there is no duration.

        Raises:
            ValueError: for a duration without speeds.
        """
        if self.duration is None:
            return self.weights
        if self.speeds is None:
            raise ValueError("a load spectrum with a duration needs speeds, for the number of revolutions")
        return _MINUTES * self.weights * self.duration * self.speeds

    @staticmethod
    def of(operating_point: OperatingPoint) -> "LoadSpectrum":
        """Load spectrum of a single load."""
        torque, speed = operating_point.torque, operating_point.speed
        return LoadSpectrum(_alone(torque), None, None if speed is None else _alone(speed), operating_point.friction)


def _alone(number: Array) -> Array | np.ndarray:
    known = concrete(number)
    return number[None] if known is None else known[None]


_MINUTES = 60.0  # in an hour

Loads = Torque | LoadSpectrum  # one load or several
Result = TypeVar("Result")  # a tree of arrays


class Conditions(Checked):
    """Conditions for the evaluation of designs, independent of the mesh: loads, and manufactured gears for each load.

    All designs and all loads are evaluated with the same gears (common random numbers): results differ only by the
    design and the load.

    Attributes:
        load: torques and their weights.
        deviations: deviations of the manufactured gears, with a leading axis (samples,); None for nominal gears.
    """

    load: LoadSpectrum
    deviations: Deviation | None = None

    @property
    def samples(self) -> int:
        """Number of manufactured pairs; 1 for nominal gears."""
        return 1 if self.deviations is None else len(self.deviations.misalignment)

    @property
    def count(self) -> int:
        """Number of cases, contact analyses per design."""
        return len(self.load.torques) * self.samples

    def on(self, mesh: Mesh) -> "Cases":
        """Cases on a mesh; traceable, for designs with their own mesh."""
        check_torque(mesh.support_torque, self.load.torques)
        load = jax.tree.map(lambda numbers: numbers.astype(mesh.slice_width.dtype), self.load)
        removed = None if self.deviations is None else _removed(mesh, load.torques, self.deviations)
        return Cases(load.torques, load.speeds, load.friction, load.weights, removed)


class Cases(Checked):
    """Conditions on a mesh.

    The material removed by deviations depends on the mesh and the torque, not on the design: it is computed once.

    Attributes:
        torque: torques on the pinion [N m], shape (torques,).
        speed: speeds of the pinion at every torque [rpm], shape (torques,); None for no speeds.
        friction: mean coefficient of friction; None for the default of each quantity.
        weight: weight of every torque, sum 1, shape (torques,).
        removed: material removed by deviations [um], shape (torques, samples, pairs, slices, positions); None for
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
        """Number of cases, contact analyses per design."""
        return len(self.torque) * self.samples

    @property
    def first(self) -> OperatingPoint:
        """Operating point of the first load."""
        return OperatingPoint(self.torque[0], None if self.speed is None else self.speed[0], self.friction)

    @property
    def weights(self) -> Float[Array, " cases"]:
        """Weight of every case, sum 1, shape (cases,); samples vary fastest."""
        return _repeated(self.weight, self.samples)

    def each(self, function: Callable[[OperatingPoint, Float[Array, "..."]], Result]) -> Result:
        """Values of function(operating_point, removed) in every case, leading axis (cases,); torques vary slowest.

        A single case is a plain call without a map.
        """

        def at(load: tuple[Array, Array | None], removed: Array) -> Result:
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


def conditions(mesh: Mesh, torque: Loads, manufactured: ManufacturedGears | None = None) -> Conditions:
    """Conditions of a torque or a load spectrum.

    Args:
        mesh: prepared mesh, of which only the number of pairs and the floating-point type are used.
        torque: torque on the pinion [N m], an `OperatingPoint`, or a `LoadSpectrum`.
        manufactured: manufactured gears, evaluated under every torque; None for nominal gears.

    Raises:
        ValueError: for a negative torque, and for lead deviations on a mesh of one slice.
    """
    if not isinstance(torque, LoadSpectrum):
        torque = LoadSpectrum.of(operating_point_of(torque, real(0.0).dtype))
    return Conditions(torque, None if manufactured is None else manufactured.on(mesh))


@program
def _repeated(weight: Float[Array, " torques"], samples: int) -> Float[Array, " cases"]:
    return jnp.repeat(weight / samples, samples)


@program
def _removed(
    mesh: Mesh, torques: Float[Array, " torques"], deviations: Deviation
) -> Float[Array, "torques samples pairs slices positions"]:
    def at(torque: Array) -> Array:
        basis = flank_basis(mesh, torque)
        return jax.vmap(lambda one: deviation_field(one, basis))(deviations)

    return jax.vmap(at)(torques)
