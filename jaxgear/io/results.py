"""Result files: summary, flanks, fronts and measuring charts.

Columns end in their unit; `design_um` and `measured_um` have the sign of the machines, positive for excess material.
"""

import csv
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
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
from ..sweeps.columns import as_text
from ..tolerance import Trace
from .folder import writing
from .table_keys import family, snake

_PLACE = {
    "face_coordinate_mm": "face_coordinate",
    "roll_angle_deg": "roll_angle",
    "roll_length_mm": "roll_length",
    "diameter_mm": "diameter",
    "design_um": "design",
    "upper_um": "upper",
    "lower_um": "lower",
}
MEASURED = "measured_um"
_SAME_PLACE = 1e-3  # mm, of a measured and a designed point
_CHART_DIGITS = 9  # behind the decimal point: what is read and written again does not drift


def write_traces(path: str | Path, traces: Sequence[Trace], measured: Sequence[Trace] | None = None) -> Path:
    """Write traces of a flank as CSV in the form of gear measuring machines, one row per point.

    Columns: trace, face_coordinate_mm, roll_angle_deg, roll_length_mm, diameter_mm, design_um, upper_um, lower_um and,
    with `measured`, measured_um. Limits are empty outside the evaluation range.

    Args:
        path: file to write.
        traces: traces of one flank, of `profile_trace` and `helix_trace`.
        measured: measured of the same places, trace by trace; None for the design alone.

    Returns:
        the path.

    Raises:
        ValueError: when the file cannot be written, or measured traces have other places.
    """
    columns = {name: [np.asarray(getattr(trace, field)) for trace in traces] for name, field in _PLACE.items()}
    if measured is not None:
        shapes = [[np.shape(trace.design) for trace in many] for many in (traces, measured)]
        if shapes[0] != shapes[1]:
            raise ValueError(f"write_traces: measured has traces of {shapes[1]} points, must be {shapes[0]}")
        for number, (one, other) in enumerate(zip(traces, measured)):
            for field in ("roll_length", "face_coordinate"):
                if not np.allclose(getattr(one, field), getattr(other, field), rtol=0, atol=_SAME_PLACE):
                    raise ValueError(f"write_traces: {field} of measured trace {number} is not that of the design")
        columns[MEASURED] = [np.asarray(trace.design) for trace in measured]
    rows = (
        (trace.kind, *map(_text, row))
        for number, trace in enumerate(traces)
        for row in zip(*(values[number] for values in columns.values()))
    )
    with writing(path):
        write_csv(Path(path), ["trace", *columns], rows)
    return Path(path)


def _text(value: float) -> str:
    """Shortest text of a number; "" for NaN."""
    return "" if np.isnan(value) else repr(round(float(value), _CHART_DIGITS) + 0.0)


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


def write_csv(path: Path, header: Iterable[str], rows: Iterable[Iterable[Any]], form: str = ".7g") -> None:
    """Writes rows of texts and numbers as CSV; a number that is not whole in a format."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows([_cell(value, form) for value in row] for row in rows)


def _cell(value: Any, form: str) -> Any:
    if isinstance(value, float | np.floating):
        return f"{value:{form}}"
    return int(value) if isinstance(value, np.bool_) else value


def write_flanks(path: Path, mesh: Mesh | Kinematics, designs: Designs) -> None:
    """Writes `flank_rows` as CSV, values to a nanometre or better."""
    write_csv(path, _COLUMNS, flank_rows(mesh, designs), ".6f")


def write_front(path: Path, front: Front) -> None:
    """Writes a Pareto front as CSV: objectives and parameters of every design."""
    names = [f"{name}_{unit}" if unit else name for name, unit in zip(front.objectives, front.units)]
    columns = [*front.values.T, *front.parameters.values()]
    write_csv(path, map(as_text, [*names, *front.parameters]), zip(*columns), ".9g")


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
