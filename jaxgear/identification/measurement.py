"""Measured transmission error: averaged readings, their noise, and the error of the fitted model."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import Mesh, Resolution
from ..numerics import Checked, concrete, number, pivots, solve_dense

Scalar = Float[Array, ""]
Rows = Float[Array, " rows"]

LEAST_ROWS = 12  # of a measurement
ORDERS = 8  # mesh orders of the error of the model
_LARGEST_GAP = 0.25  # between neighbouring phases of one torque [base pitches]: the first three mesh orders are seen


class Measurement(Checked):
    """Measured transmission error, one row per reading.

    Attributes:
        phase: mesh position; at 0 the teeth 0 of both gears touch at the pitch point. Readings of several base pitches
            are folded into one, except for gears with unknown pitch deviations.
        torque: torque on the pinion.
        transmission_error: transmission error along the line of action, positive when the wheel lags.
        noise: standard deviation of a reading; None for the scatter of readings at one torque and mesh position.

    Raises:
        ValueError: for fewer than 12 readings, columns of different lengths, numbers that are not finite, or a gap of
            more than a quarter of the base pitch between the phases of a torque.
    """

    phase: Rows = number("base pitches", shape=("rows",))
    torque: Rows = number("N m", low=0.0, open_low=True, shape=("rows",))
    transmission_error: Rows = number("um", shape=("rows",))
    noise: Scalar | None = number("um", low=0.0, open_low=True, optional=True, default=None)

    def __check_init__(self) -> None:
        counts = {name: len(getattr(self, name)) for name in ("phase", "torque", "transmission_error")}
        if min(counts.values()) < LEAST_ROWS:
            raise ValueError(f"Measurement: phase has {counts['phase']} rows, must have {LEAST_ROWS} at least")
        if len(set(counts.values())) > 1:
            raise ValueError(f"Measurement: torque has {counts['torque']} rows, phase {counts['phase']}")
        phase, torque = np.asarray(self.phase) % 1, np.asarray(self.torque)
        for level in np.unique(torque):
            places = np.sort(phase[torque == level])
            gap = float(np.diff(places, append=places[0] + 1).max())
            if gap > _LARGEST_GAP:
                raise ValueError(
                    f"Measurement: phase does not cover a base pitch at {level:g} N m: {gap:.2g} of it are without a "
                    f"reading, must be {_LARGEST_GAP:g} at most"
                )

    def noise_on(self, resolution: Resolution, period: int = 1) -> Scalar:
        """Standard deviation of a reading [um], as given or from readings at one torque and mesh position.

        Args:
            resolution: array sizes of the mesh.
            period: number of base pitches after which the same teeth meet; 1 for equal teeth.

        Raises:
            ValueError: if no noise is given and repeated readings are too few or all equal.
        """
        return _noise_of(self, _bins_of(self, resolution.positions, float(np.asarray(resolution.first_phase)), period))


class Bins(NamedTuple):
    """Readings by torque and position of the mesh.

    Attributes:
        torques: ascending, shape (torques,).
        level: number of the torque of every bin that has readings.
        place: mean mesh position of the readings of every bin, in positions of the mesh from the first.
        row: bin of every reading.
        readings: number of readings of every bin.
    """

    torques: np.ndarray
    level: np.ndarray
    place: np.ndarray
    row: np.ndarray
    readings: np.ndarray

    def mean(self, of: Array) -> Array:
        """Mean over the readings of every bin."""
        return jnp.zeros(len(self.level), of.dtype).at[self.row].add(of) / self.readings.astype(of.dtype)


def _bins_of(measurement: Measurement, positions: int, first: float, period: int = 1) -> Bins:
    """Readings joined; those as many base pitches apart as the period count as one position."""
    phase, torque = np.asarray(measurement.phase, float), np.asarray(measurement.torque, float)
    torques, level = np.unique(torque, return_inverse=True)
    count = period * positions
    # around the positions of the mesh: readings at these are not split by rounding
    place = (((phase - first) * positions + 0.5) % count) - 0.5
    bins = level * count + np.minimum((place + 0.5).astype(int), count - 1)
    kept, row, readings = np.unique(bins, return_inverse=True, return_counts=True)
    return Bins(torques, kept // count, np.bincount(row, place) / readings, row, readings)


def _noise_of(measurement: Measurement, bins: Bins) -> Scalar:
    """Standard deviation of a reading [um], see `Measurement.noise_on`."""
    if measurement.noise is not None:
        return measurement.noise
    value, free = measurement.transmission_error, len(bins.row) - len(bins.level)
    if free < LEAST_ROWS:
        raise ValueError(f"noise = None needs {LEAST_ROWS} repeated readings or more, are {free}")
    noise = jnp.sqrt(jnp.sum((value - bins.mean(value)[bins.row]) ** 2) / free)
    known = concrete(noise)
    if known is not None and not known > 0:
        raise ValueError("repeated readings are all alike, noise must be given [um]")
    return noise


class Data(eqx.Module):
    """Readings joined per torque and position of the mesh: what a compiled fit takes.

    Attributes:
        torques: ascending.
        level: number of the torque of every row.
        before, after: places of the windows between which a row lies.
        share: how far it is from the first to the second.
        phase, value, noise: of the row.
    """

    torques: Float[Array, " torques"]
    level: Array
    before: Array
    after: Array
    share: Rows
    phase: Rows
    value: Rows
    noise: Rows

    def at(self, of: Float[Array, "torques places *columns"]) -> Float[Array, "rows *columns"]:
        """Values at the readings, linearly interpolated between positions of the mesh."""
        first, second = of[self.level, self.before], of[self.level, self.after]
        return first + self.share.reshape(-1, *[1] * (first.ndim - 1)) * (second - first)


def joined(measurement: Measurement, mesh: Mesh, period: int) -> tuple[Data, np.ndarray]:
    """Means of the readings of one torque within one position of the mesh, and the windows that they need."""
    positions, first = mesh.resolution.positions, float(np.asarray(mesh.phase)[0])
    bins = _bins_of(measurement, positions, first, period)
    before = np.floor(bins.place).astype(int)
    places = np.stack([before, before + 1]) % (period * positions)
    windows, number = np.unique(places // positions, return_inverse=True)
    places = number.reshape(places.shape) * positions + places % positions
    dtype = mesh.slice_width.dtype
    noise = _noise_of(measurement, bins).astype(dtype)
    data = Data(
        torques=jnp.asarray(bins.torques, dtype),
        level=jnp.asarray(bins.level),
        before=jnp.asarray(places[0]),
        after=jnp.asarray(places[1]),
        share=jnp.asarray(bins.place - before, dtype),
        phase=jnp.asarray(first + bins.place / positions, dtype),
        value=bins.mean(measurement.transmission_error).astype(dtype),
        noise=noise / jnp.asarray(np.sqrt(bins.readings), dtype),
    )
    return data, windows


def _error_shapes(data: Data) -> Float[Array, "rows shapes"]:
    """Curves of unit size that a stiffness in error adds: alike at all torques, and each torque its own.

    Proportional to the torque; the amplitude of a mesh order falls with its number.
    """
    order = jnp.arange(1, ORDERS + 1, dtype=data.phase.dtype)
    angle = 2 * jnp.pi * data.phase[:, None] * order[None]
    waves = jnp.concatenate([jnp.cos(angle) / order[None], jnp.sin(angle) / order[None]], axis=1)
    load = (data.torques / jnp.max(data.torques))[data.level]
    alike = load[:, None] * jnp.concatenate([jnp.ones_like(waves[:, :1]), waves], axis=1)
    own = jax.nn.one_hot(data.level, data.torques.shape[0], dtype=alike.dtype)
    return jnp.concatenate([alike, (own[:, :, None] * alike[:, None, :]).reshape(alike.shape[0], -1)], axis=1)


class Errors(NamedTuple):
    """Noise and error of the model, as independent shapes and what is outside of them.

    Attributes:
        noise: of the readings.
        shapes: of readings in noises, orthonormal columns.
        variance: of the error of the model in every one, where its shapes have unit size.
    """

    noise: Rows
    shapes: Float[Array, "rows shapes"]
    variance: Float[Array, " shapes"]

    def split(self, of: Float[Array, "rows columns"]) -> tuple[Array, Array]:
        """Columns of readings, in noises: outside of the shapes, and along them."""
        of = of / self.noise[:, None]
        along = self.shapes.T @ of
        return of - self.shapes @ along, along

    def whitened(self, size: Scalar, of: Float[Array, "rows columns"]) -> Float[Array, "sums columns"]:
        """Columns of readings as independent sums, in standard deviations."""
        outside, along = self.split(of)
        return jnp.concatenate([outside, along / self._deviation(size)])

    def products(self, of: Float[Array, "rows columns"]) -> Callable[[Scalar], Float[Array, "columns columns"]]:
        """Products of all columns of `whitened` with each other, as a function of the size of the model error."""
        outside, along = self.split(of)
        square = outside.T @ outside

        def at(size: Scalar) -> Array:
            inside = along / self._deviation(size)
            return square + inside.T @ inside

        return at

    def _deviation(self, size: Scalar) -> Array:
        return jnp.sqrt(1 + size**2 * self.variance)[:, None]

    def evidence(self, size: Scalar, product: Array, z: Array) -> Scalar:
        """Logarithm of the probability of the data under an error of this size, the unknowns integrated.

        Of the products of the slopes at z and of what is left there; where that is more than the unknowns.
        """
        count = len(z)
        square, b, left = product[:count, :count], product[:count, count], product[count, count]
        left, b = left + 2 * z @ b + z @ square @ z, b + square @ z  # from there to the prior means
        normal = square + jnp.eye(count, dtype=z.dtype)
        determinant = jnp.sum(jnp.log1p(size**2 * self.variance)) + jnp.sum(jnp.log(pivots(normal)))
        return -0.5 * (left - b @ solve_dense(normal, b) + determinant)


def errors_of(data: Data) -> Errors:
    shapes, size, _ = jnp.linalg.svd(_error_shapes(data) / data.noise[:, None], full_matrices=False)
    return Errors(data.noise, shapes, size**2)
