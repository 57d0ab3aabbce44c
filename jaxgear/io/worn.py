"""Worn flanks as CSV or Parquet, and as modifications again."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import roll_angle
from ..microgeometry import AbstractModification, TabulatedFlank, TabulatedProfile
from ..numerics import real
from ..wear import WearHistory
from .errors import DesignFileError
from .folder import writing
from .rows import PARQUET, read_rows

_GEARS = "pinion", "wheel"

Worn = tuple[AbstractModification, AbstractModification]


def write_worn(path: str | Path, lives: Mapping[str, WearHistory]) -> None:
    """Writes the worn flanks of all designs at every time step, one row per point of a flank, to all digits.

    `read_worn` gives the same flanks of all, `read_flank` one of them.

    Args:
        path: file to write: Parquet where its name ends in .parquet, otherwise CSV.
        lives: wear histories by the name of the design.

    Raises:
        ValueError: for no wear history, and when the file cannot be written.
    """
    path = Path(path)
    if not lives:
        raise ValueError("write_worn: lives must not be empty")
    tables = [_columns(design, life) for design, life in lives.items()]
    columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    with writing(path):
        if path.suffix == PARQUET:
            _write_parquet(path, columns)
            return
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            # Python's numbers, whose text has all digits
            writer.writerows(zip(*(values.tolist() for values in columns.values())))


def _write_parquet(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    import pyarrow
    from pyarrow import parquet

    parquet.write_table(pyarrow.table({name: pyarrow.array(values.tolist()) for name, values in columns.items()}), path)


def _columns(design: str, life: WearHistory) -> dict[str, np.ndarray]:
    """Points of both flanks at every life, of shape (lives, gears, slices, points) before they stand in one row."""
    depth = np.asarray(life.depth, float)
    total, corner = depth.sum(axis=2), depth[:, :, 1]
    lengths = np.asarray(life.roll_length, float)
    angles = np.stack([np.asarray(roll_angle(gear, of), float) for gear, of in zip(life.gears, life.roll_length)])

    def all_over(values: Any, *axes: int) -> np.ndarray:
        return np.broadcast_to(np.expand_dims(np.asarray(values), axes), total.shape).ravel()

    return {
        "design": all_over(design, 0, 1, 2, 3),
        "revolutions": all_over(np.asarray(life.revolutions, float), 1, 2, 3),
        "gear": all_over(_GEARS, 0, 2, 3),
        "face_coordinate_mm": all_over(np.asarray(life.face_coordinate, float), 0, 3),
        "roll_angle_deg": all_over(angles, 0, 2),
        "roll_length_mm": all_over(lengths, 0, 2),
        "wear_depth_um": total.ravel(),
        "by_tip_corners_um": corner.ravel(),
    }


def read_worn(path: str | Path) -> dict[tuple[str, float], Worn]:
    """Worn flanks (pinion, wheel) by design and revolutions of the pinion, as `write_worn` has written them.

    Raises:
        ValueError: for a file that cannot be read, or without the columns and rows of worn flanks.
    """
    path = Path(path)
    try:
        rows: dict[tuple[str, float, str], list[tuple[float, float, float]]] = {}
        for row in read_rows(path):
            key = row["design"], float(row["revolutions"]), row["gear"]
            numbers = [float(row[name]) for name in ("face_coordinate_mm", "roll_length_mm", "wear_depth_um")]
            rows.setdefault(key, []).append((numbers[0], numbers[1], numbers[2]))
        keys = dict.fromkeys((design, done) for design, done, _ in rows)
        return {key: (_flank(rows[*key, _GEARS[0]]), _flank(rows[*key, _GEARS[1]])) for key in keys}
    except DesignFileError as error:
        raise ValueError(f"{path}: {error.problem}") from None
    except (KeyError, ValueError, TypeError) as error:
        raise ValueError(f"{path}: holds no worn flanks as jaxgear writes them: {error}") from None


def _flank(rows: list[tuple[float, float, float]]) -> AbstractModification:
    face, length, depth = np.array(rows).T
    lines = np.unique(face)
    if len(lines) == 1:
        return TabulatedProfile(real(length), real(depth))
    points = len(length) // len(lines)
    return TabulatedFlank(real(length[:points]), real(lines), real(depth.reshape(len(lines), points).T))
