"""Measured transmission errors from CSV or Parquet files."""

from collections.abc import Collection
from pathlib import Path

import numpy as np

from ..geometry import GearPair
from ..numerics import optional_real, real
from ..optimize import Measurement
from .errors import DesignFileError, naming, problem
from .flanks import numbers_of
from .rows import read_rows

_PHASE, _ANGLE, _TORQUE, _ERROR = "phase", "angle_deg", "torque_Nm", "te_um"
_TURN = "revolution"
_ALLOWED = _PHASE, _ANGLE, _TORQUE, _ERROR, _TURN, "repeat"
_MOST_ERROR = 2000.0  # [um]; beyond it the column is in another unit
_LEAST_ERROR = 1e-3
_MOST_STRESS = 500.0  # tangential force over face width and module [MPa]: several times what case-hardened gears carry


def read_measurement(path: str | Path, pair: GearPair, *, noise: float | None = None) -> Measurement:
    """Reads a measured transmission error.

    Columns are `torque_Nm`, `te_um`, and `phase` in base pitches or `angle_deg` of the pinion; `revolution` of the
    pinion, which counts where these begin anew with each, and `repeat` may be there too. Whatever was read at one
    torque and mesh position is joined, its scatter is the noise.

    Args:
        path: CSV file in UTF-8, or Parquet.
        pair: gear pair, whose tooth number turns angles into phases.
        noise: standard deviation of a reading [um]; None for that of repeats.

    Raises:
        DesignFileError: for anything that is wrong with it, in one line that names the file and the column.
    """
    path = Path(path)
    with naming(path):
        rows = read_rows(path)
        column = _place(rows[0])
        place, torque, error = (numbers_of(rows, name) for name in (column, _TORQUE, _ERROR))
        teeth = float(pair.pinion.teeth)
        phase = place * teeth / 360 if column == _ANGLE else place
        if _TURN in rows[0]:
            turn = numbers_of(rows, _TURN)
            if (turn % 1).any():
                raise DesignFileError(_TURN, "must be whole numbers, of revolutions of the pinion")
            # without effect where teeth are equal
            phase = phase + teeth * (turn - turn.min()) * (np.ptp(phase) <= teeth)
        _check_units(pair, torque, error)
        try:
            return Measurement(real(phase), real(torque), real(error), optional_real(noise))
        except ValueError as refused:
            says = problem(refused)
            for name, heading in (("phase", column), ("torque", _TORQUE), ("transmission_error", _ERROR)):
                if says.startswith(name):
                    raise DesignFileError(heading, says.removeprefix(name).strip()) from None
            raise DesignFileError("", says) from None


def _place(columns: Collection[str]) -> str:
    """The column of the mesh position, of two; all columns are known and none is missing."""
    for name in columns:
        if name not in _ALLOWED:
            raise DesignFileError(str(name), f"unknown column, must be one of {', '.join(_ALLOWED)}")
    for name in (_TORQUE, _ERROR):
        if name not in columns:
            raise DesignFileError(name, "missing, this column is required")
    places = [name for name in (_PHASE, _ANGLE) if name in columns]
    if len(places) != 1:
        raise DesignFileError(_PHASE, f"there must be one of the columns {_PHASE} and {_ANGLE}")
    return places[0]


def _check_units(pair: GearPair, torque: np.ndarray, error: np.ndarray) -> None:
    """Refuses what another unit alone explains."""
    pinion = pair.pinion
    most = 1e-3 * _MOST_STRESS * float(pair.face_width * pinion.module * pinion.pitch_radius)
    if np.max(torque) > most:
        raise DesignFileError(_TORQUE, f"{np.max(torque):g} N m is more than the teeth carry: give it in N m")
    variation = np.ptp(error)
    if variation > _MOST_ERROR:
        raise DesignFileError(_ERROR, f"varies by {variation:g} um: give it in um on the line of action")
    if variation < _LEAST_ERROR:
        raise DesignFileError(_ERROR, f"varies by {variation:.2g} um only: give it in um on the line of action")
