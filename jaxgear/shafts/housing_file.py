"""Housing matrices in files: CSV and npz.

CSV: the first cell of the first row names kind and unit, "stiffness N/um" for instance, the others the columns; every
further row begins with its name. Names are SEAT.DIRECTION, with the name of a bearing and x, y, z, rx or ry; rows and
columns in the same order. Lines that begin with # are comments.

    stiffness N/um, A.x, A.y
    A.x, 812.4, -31.0
    A.y, -31.0, 655.2

npz: an array `stiffness` or `compliance`, and `nodes` and `unit` as strings.

Units: N/um is the system um, mrad, N, N mm of this package; N/mm is mm, rad, N, N mm; N/m is m, rad, N, N m. Of a
compliance the unit is the inverse: um/N, mm/N, m/N. Directions are the axes of the gearbox; rotations are rotations of
the seat, forces act on the housing. The foundation is held.
"""

import csv
import zipfile
import zlib
from pathlib import Path

import numpy as np

from .housing import Housing, Kind

# what one unit of force, moment, displacement and rotation is in N, N mm, um and mrad
_SYSTEMS = {"um": (1.0, 1.0, 1.0, 1.0), "mm": (1.0, 1.0, 1e3, 1e3), "m": (1.0, 1e3, 1e6, 1e3)}
_UNITS = {
    **{("stiffness", f"N/{length}"): length for length in _SYSTEMS},
    **{("compliance", f"{length}/N"): length for length in _SYSTEMS},
}


def read_housing(path: str | Path) -> Housing:
    """The housing of a CSV or npz file.

    Raises:
        ValueError: in one line that names the file and what is wrong with it: no such file, another ending, an unknown
            kind, unit or node, rows and columns that differ, something else than a number, a matrix that is not square,
            symmetric or positive definite.
    """
    path = Path(path)
    readers = {".csv": _from_csv, ".npz": _from_npz}
    if path.suffix.lower() not in readers:
        raise ValueError(f"{path}: a housing is read from a .csv or .npz file")
    if not path.is_file():
        raise ValueError(f"{path}: no such file")
    try:
        return _made(*readers[path.suffix.lower()](path))
    except (ValueError, OSError, csv.Error, zipfile.BadZipFile, zlib.error) as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None


def write_housing(path: str | Path, housing: Housing) -> None:
    """Writes a housing as CSV or npz, in the units of this package.

    Raises:
        ValueError: for another ending.
    """
    path = Path(path)
    unit = "N/um" if housing.kind == "stiffness" else "um/N"
    matrix = np.asarray(housing.matrix)
    if path.suffix.lower() == ".csv":
        rows = [[f"{housing.kind} {unit}", *housing.nodes]]
        rows += [[node, *map(repr, row)] for node, row in zip(housing.nodes, matrix.tolist())]
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)
    elif path.suffix.lower() == ".npz":
        given = {housing.kind: matrix, "nodes": np.array(housing.nodes), "unit": np.array(unit)}
        np.savez(path, **given)  # type: ignore[arg-type]
    else:
        raise ValueError(f"{path}: a housing is written to a .csv or .npz file")


def _made(kind: str, unit: str, nodes: list[str], matrix: np.ndarray) -> Housing:
    if (kind, unit) not in _UNITS:
        known = ", ".join(" ".join(pair) for pair in _UNITS)
        raise ValueError(f'"{kind} {unit}" is no kind and unit of a housing, must be one of {known}')
    size = len(nodes)
    if matrix.shape != (size, size):
        raise ValueError(f"{kind} has shape {matrix.shape}, must be ({size}, {size}) as its nodes")
    if not np.isfinite(matrix).all():
        row, column = np.argwhere(~np.isfinite(matrix))[0]
        raise ValueError(f"{kind} ({nodes[row]}, {nodes[column]}) = {matrix[row, column]} must be finite")
    force, moment, displacement, rotation = _SYSTEMS[_UNITS[kind, unit]]
    turns = np.array([node.rpartition(".")[2].startswith("r") for node in nodes])
    forces, ways = np.where(turns, moment, force), np.where(turns, rotation, displacement)
    if kind == "stiffness":
        return Housing(tuple(nodes), forces[:, None] * matrix / ways, "stiffness")
    return Housing(tuple(nodes), ways[:, None] * matrix / forces, "compliance")


def _from_csv(path: Path) -> tuple[str, str, list[str], np.ndarray]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError("must be text in UTF-8") from None
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if not lines:
        raise ValueError("is empty")
    separator = ";" if ";" in lines[0] else ","
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=separator)]
    kind, _, unit = rows[0][0].partition(" ")
    nodes = rows[0][1:]
    if [row[0] for row in rows[1:]] != nodes:
        raise ValueError("rows must have the names of the columns, in the same order")
    numbers = np.empty((len(nodes), len(nodes)))
    for index, row in enumerate(rows[1:]):
        if len(row) != len(nodes) + 1:
            raise ValueError(f"row {row[0]} has {len(row) - 1} numbers, must have {len(nodes)}")
        for column, cell in enumerate(row[1:]):
            numbers[index, column] = _number(cell, row[0], nodes[column])
    return kind, unit.strip(), nodes, numbers


def _number(cell: str, row: str, column: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise ValueError(f"({row}, {column}) = {cell!r} must be a number") from None


def _from_npz(path: Path) -> tuple[str, str, list[str], np.ndarray]:
    if not zipfile.is_zipfile(path):
        raise ValueError("is no npz archive")
    with np.load(path, allow_pickle=False) as given:
        kinds = [kind for kind in ("stiffness", "compliance") if kind in given]
        missing = [name for name in ("nodes", "unit") if name not in given]
        if len(kinds) != 1 or missing:
            wanted = "one of stiffness and compliance" if len(kinds) != 1 else missing[0]
            raise ValueError(f"must hold {wanted}, holds {', '.join(given.files) or 'nothing'}")
        kind: Kind = "stiffness" if kinds[0] == "stiffness" else "compliance"
        matrix = np.asarray(given[kind])
        if matrix.dtype.kind not in "fiu":
            raise ValueError(f"{kind} must hold real numbers, holds {matrix.dtype}")
        return kind, str(given["unit"]), [str(node) for node in np.ravel(given["nodes"])], matrix.astype(float)
