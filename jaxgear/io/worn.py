"""Worn flanks as CSV, and as modifications again."""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..geometry import roll_angle
from ..microgeometry import AbstractModification, TabulatedFlank, TabulatedProfile
from ..numerics import real
from ..wear import WearLife
from .folder import writing

_COLUMNS = (
    "design",
    "revolutions",
    "gear",
    "face_coordinate_mm",
    "roll_angle_deg",
    "roll_length_mm",
    "wear_depth_um",
    "by_tip_corners_um",
)
_GEARS = "pinion", "wheel"

Worn = tuple[AbstractModification, AbstractModification]


def write_worn(path: Path, lives: Mapping[str, WearLife]) -> None:
    """Writes the worn flanks of all designs at every life, to all digits, so that `read_worn` gives the same flanks."""
    with writing(path), path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS)
        for design, life in lives.items():
            depth = np.asarray(life.depth)
            lengths, face = np.asarray(life.roll_length), np.asarray(life.face_coordinate)
            pair = life.gears
            for number, done in enumerate(np.asarray(life.revolutions)):
                for gear, name in enumerate(_GEARS):
                    angles = np.asarray(roll_angle(pair[gear], life.roll_length[gear]))
                    for line, at in enumerate(face[gear]):
                        corner = depth[number, gear, 1, line]
                        total = depth[number, gear].sum(axis=0)[line]
                        for values in zip(angles, lengths[gear], total, corner):
                            numbers = (float(value) for value in values)
                            writer.writerow([design, repr(float(done)), name, repr(float(at)), *map(repr, numbers)])


def read_worn(path: str | Path) -> dict[tuple[str, float], Worn]:
    """Worn flanks (pinion, wheel) by design and revolutions of the pinion, as `write_worn` has written them.

    Raises:
        ValueError: for a file that cannot be read, or without the columns and rows of worn flanks.
    """
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8") as file:
            table = list(csv.DictReader(file))
        rows: dict[tuple[str, float, str], list[tuple[float, float, float]]] = {}
        for row in table:
            key = row["design"], float(row["revolutions"]), row["gear"]
            numbers = [float(row[name]) for name in ("face_coordinate_mm", "roll_length_mm", "wear_depth_um")]
            rows.setdefault(key, []).append((numbers[0], numbers[1], numbers[2]))
        keys = dict.fromkeys((design, done) for design, done, _ in rows)
        return {key: (_flank(rows[*key, _GEARS[0]]), _flank(rows[*key, _GEARS[1]])) for key in keys}
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (KeyError, ValueError, TypeError) as error:
        raise ValueError(f"{path}: holds no worn flanks as jaxgear writes them: {error}") from None


def _flank(rows: list[tuple[float, float, float]]) -> AbstractModification:
    face, length, depth = np.array(rows).T
    lines = np.unique(face)
    if len(lines) == 1:
        return TabulatedProfile(real(length), real(depth))
    points = len(length) // len(lines)
    return TabulatedFlank(real(length[:points]), real(lines), real(depth.reshape(len(lines), points).T))
