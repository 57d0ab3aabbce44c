"""Result files: `summary.json`, `flanks.csv` and `front.csv`."""

import csv
import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..contact import Kinematics, Mesh
from ..metrics import flank_surface
from ..microgeometry import AbstractModification, NoModification, Sum
from ..numerics import fields_of
from ..optimize import Front
from ..sweeps.headings import as_text
from .layout import family, snake

Designs = Mapping[str, tuple[AbstractModification, AbstractModification]]

_STEP = 2  # every so many of the points of a flank are written
_COLUMNS = (
    "design",
    "gear",
    "face_coordinate_mm",
    "roll_angle_deg",
    "roll_length_mm",
    "diameter_mm",
    "modification_um",
)


def describe(modification: AbstractModification) -> list[dict[str, Any]]:
    """A concrete modification as plain data, in the words of a design file."""
    if isinstance(modification, NoModification):
        return []
    terms = modification.terms if isinstance(modification, Sum) else (modification,)
    return [_plain(term) for term in terms]


def unit_of(kind: str, name: str) -> str:
    """Unit of a number of a modification, both in the words of a design file; "" for a pure number."""
    cls = family(AbstractModification).get(kind)
    number = None if cls is None else fields_of(cls).get(name)
    return number.unit if number else ""


def flank_rows(
    mesh: Mesh | Kinematics, designs: Designs
) -> Iterator[tuple[str, str, float, float, float, float, float]]:
    """Rows of `flanks.csv`: both gears of every design from the start of the active profile to the tip.

    Rows are in the middle of the face, and on further lines across it where the modification varies along the face. Of
    a mesh its kinematics suffice.
    """
    for design, flanks in designs.items():
        for gear, side, modification in zip(("pinion", "wheel"), mesh.sides, flanks):
            surface = jax.tree.map(np.asarray, flank_surface(side, modification))
            face, removed = surface.face_coordinate, surface.removed[:, ::_STEP]
            along = [of[::_STEP] for of in (surface.roll_angle, surface.roll_length, surface.diameter)]
            lines = range(len(face)) if np.ptp(removed, axis=0).any() else [len(face) // 2]
            for line in lines:
                for angle, length, size, amount in zip(*along, removed[line]):
                    yield design, gear, float(face[line]), float(angle), float(length), float(size), float(amount)


def write_flanks(path: Path, mesh: Mesh | Kinematics, designs: Designs) -> None:
    """Writes `flank_rows` as CSV, values to a nanometre or better."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS)
        for design, gear, *values in flank_rows(mesh, designs):
            writer.writerow([design, gear, *(f"{value:.6f}" for value in values)])


def write_front(path: Path, front: Front) -> None:
    """Writes a Pareto front as CSV: objectives and parameters of every design."""
    names = [f"{name}_{unit}" if unit else name for name, unit in zip(front.objectives, front.units)]
    columns = [*front.values.T, *front.parameters.values()]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(map(as_text, [*names, *front.parameters]))
        writer.writerows([f"{value:.9g}" for value in row] for row in zip(*columns))


def write_summary(path: Path, data: Mapping[str, Any]) -> None:
    """Writes plain data, arrays and scalars as JSON; numbers that are not finite become null."""
    path.write_text(json.dumps(_jsonable(data), indent=2, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8")


def _plain(part: eqx.Module) -> dict[str, Any]:
    data: dict[str, Any] = {"type": snake(type(part).__name__)}
    for field, value in vars(part).items():
        if isinstance(value, eqx.Module):
            data[field] = _plain(value)
        elif isinstance(value, tuple) and all(isinstance(item, eqx.Module) for item in value):
            data[field] = [_plain(item) for item in value]
        elif isinstance(value, str | bool) or value is None:
            data[field] = value
        else:
            data[field] = np.asarray(value).tolist()
    return data


def _jsonable(value):
    if isinstance(value, Mapping):
        return {str(key): _jsonable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_jsonable(item) for item in value]
    if isinstance(value, np.ndarray | np.generic | jax.Array):
        return _jsonable(np.asarray(value).tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
