"""Measured transmission error: its files, averaged readings, their noise, and the error of the fitted model."""

from collections.abc import Callable, Collection
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..contact import Mesh, Resolution
from ..geometry import GearPair
from ..io.errors import DesignFileError, naming, problem
from ..io.flanks import numbers_of
from ..io.headings import ANGLES, Column, converted, parts
from ..io.rows import read_rows
from ..numerics import Checked, concrete, number, optional_real, pivots, real, solve_dense

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
    """Bins of the readings by torque and mesh position; positions that differ by the period are one."""
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
    """Readings joined per torque and mesh position, the input of the compiled fit.

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
        noise: noise of the readings.
        shapes: shapes of readings in noises, orthonormal columns.
        variance: variance of the error of the model in every one, where its shapes have unit size.
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


_PHASE, _ANGLE, _TORQUE, _ERROR = "phase", "angle_deg", "torque_Nm", "te_um"
_TURN, _TE = "revolution", "transmission_error"
_SHAFTS = {"te_pinion_deg": "pinion", "te_wheel_deg": "wheel"}  # transmission errors as angles of a shaft
_COLUMNS = [Column(_ERROR, (_TE,)), Column(_ANGLE), Column(_TORQUE), *map(Column, _SHAFTS)]
_ALLOWED = _PHASE, _ANGLE, _TORQUE, _ERROR, *_SHAFTS, _TURN, "repeat"
_MOST_ERROR = 2000.0  # [um]; beyond it the column is in another unit
_LEAST_ERROR = 1e-3
_MOST_STRESS = 500.0  # tangential force over face width and module [MPa]: several times what case-hardened gears carry


def read_measurement(path: str | Path, pair: GearPair, *, noise: float | None = None) -> Measurement:
    """Read a measured transmission error from a file.

    Required columns are `torque_Nm`, `te_um`, and `phase` in base pitches or `angle_deg` of the pinion. Optional
    columns are `repeat`, and `revolution` of the pinion for phases or angles that restart with every revolution.
    Readings at one torque and mesh position are averaged; their scatter is the noise.

    Other units are given at the end of a heading, `te_mm` or `TE [mm]`. A transmission error given as an angle names
    its shaft: `te_wheel_arcsec`, `te_pinion_deg` or `te_wheel [urad]` is the angle that is multiplied by the base
    radius of that gear, positive like `te_um` when the wheel lags.

    Args:
        path: file, text in UTF-8 with columns separated by commas, semicolons or tabs, or Parquet.
        pair: gear pair; the number of teeth converts angles to phases, the base radii convert angles to lengths.
        noise: standard deviation of a reading [um]; None for the scatter of repeated readings.

    Raises:
        DesignFileError: for errors in the file, in one line that names the file and the column.
    """
    path = Path(path)
    with naming(path):
        rows = read_rows(path)
        _check_shaft(rows[0], pair)
        rows = converted(rows, _COLUMNS)
        column, of_error = _place(rows[0])
        place, torque, error = (numbers_of(rows, name) for name in (column, _TORQUE, of_error))
        if of_error in _SHAFTS:
            error = error * _um_per_degree(pair, _SHAFTS[of_error])
        teeth = float(pair.pinion.teeth)
        phase = place * teeth / 360 if column == _ANGLE else place
        if _TURN in rows[0]:
            turn = numbers_of(rows, _TURN)
            if (turn % 1).any():
                raise DesignFileError(_TURN, "must be whole numbers, of revolutions of the pinion")
            # without effect where teeth are equal
            phase = phase + teeth * (turn - turn.min()) * (np.ptp(phase) <= teeth)
        _check_units(pair, torque, error, of_error)
        try:
            return Measurement(real(phase), real(torque), real(error), optional_real(noise))
        except ValueError as refused:
            says = problem(refused)
            for name, heading in (("phase", column), ("torque", _TORQUE), ("transmission_error", of_error)):
                if says.startswith(name):
                    raise DesignFileError(heading, says.removeprefix(name).strip()) from None
            raise DesignFileError("", says) from None


def _check_shaft(headings: Collection[str], pair: GearPair) -> None:
    """Raise if the heading of an angular transmission error names neither pinion nor wheel."""
    for heading in headings:
        quantity, unit = parts(heading or "")
        if quantity in ("te", _TE) and unit in ANGLES:
            sizes = [
                f"{_um_per_degree(pair, shaft) * ANGLES[unit]:.4g} um on the {shaft}" for shaft in _SHAFTS.values()
            ]
            problem = f"is an angle of one shaft: name it te_wheel_{unit} or te_pinion_{unit} (1 {unit} is "
            raise DesignFileError(heading, f"{problem}{' and '.join(sizes)})")


def _um_per_degree(pair: GearPair, shaft: str) -> float:
    """Way on the line of action of one degree of a shaft [um], by the base radius of its gear."""
    return 1e3 * float(np.deg2rad(1.0)) * float(getattr(pair, shaft).base_radius)


def _place(columns: Collection[str]) -> tuple[str, str]:
    """The columns of mesh position and error, of several; all columns are known and none is missing."""
    for name in columns:
        if name not in _ALLOWED:
            raise DesignFileError(str(name), f"unknown column, must be one of {', '.join(_ALLOWED)}")
    if _TORQUE not in columns:
        raise DesignFileError(_TORQUE, "missing, this column is required")
    errors = [name for name in (_ERROR, *_SHAFTS) if name in columns]
    if not errors:
        raise DesignFileError(_ERROR, f"missing, this column is required, or {' or '.join(_SHAFTS)}")
    if len(errors) > 1:
        raise DesignFileError(errors[1], f"has no effect beside {errors[0]}, leave one out")
    places = [name for name in (_PHASE, _ANGLE) if name in columns]
    if len(places) != 1:
        raise DesignFileError(_PHASE, f"there must be one of the columns {_PHASE} and {_ANGLE}")
    return places[0], errors[0]


def _check_units(pair: GearPair, torque: np.ndarray, error: np.ndarray, heading: str) -> None:
    """Raise for torques or errors of an implausible size, which are probably in another unit."""
    pinion = pair.pinion
    most = 1e-3 * _MOST_STRESS * float(pair.face_width * pinion.module * pinion.pitch_radius)
    if np.max(torque) > most:
        raise DesignFileError(_TORQUE, f"{np.max(torque):g} N m is more than the teeth carry: give it in N m")
    variation = np.ptp(error)
    if variation > _MOST_ERROR:
        raise DesignFileError(heading, f"varies by {variation:g} um on the line of action: is its unit right?")
    if variation < _LEAST_ERROR:
        raise DesignFileError(heading, f"varies by {variation:.2g} um only on the line of action: is its unit right?")
