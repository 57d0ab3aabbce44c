"""Measured transmission errors from CSV or Parquet files."""

from collections.abc import Collection
from pathlib import Path

import numpy as np

from ..geometry import GearPair
from ..io.errors import DesignFileError, naming, problem
from ..io.flanks import numbers_of
from ..io.headings import ANGLES, Column, converted, parts
from ..io.rows import read_rows
from ..numerics import optional_real, real
from .measurement import Measurement

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
    """Refuses a transmission error that is an angle of neither shaft by name."""
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
    """Refuses what another unit alone explains."""
    pinion = pair.pinion
    most = 1e-3 * _MOST_STRESS * float(pair.face_width * pinion.module * pinion.pitch_radius)
    if np.max(torque) > most:
        raise DesignFileError(_TORQUE, f"{np.max(torque):g} N m is more than the teeth carry: give it in N m")
    variation = np.ptp(error)
    if variation > _MOST_ERROR:
        raise DesignFileError(heading, f"varies by {variation:g} um on the line of action: is its unit right?")
    if variation < _LEAST_ERROR:
        raise DesignFileError(heading, f"varies by {variation:.2g} um only on the line of action: is its unit right?")
