"""Housing between the bearing seats: a matrix condensed from a finite-element model, and its files.

CSV: the first cell of the first row names kind and unit, "stiffness N/um" for instance, the others the columns; every
further row begins with its name. Names are SEAT.DIRECTION, with the name of a bearing and x, y, z, rx or ry; rows and
columns in the same order. Lines that begin with # are comments.

    stiffness N/um, A.x, A.y
    A.x, 812.4, -31.0
    A.y, -31.0, 655.2

npz: an array `stiffness` or `compliance`, and `nodes` and `unit` as strings.

Units: N/um is the system um, mrad, N, N mm of this package; N/mm is mm, rad, N, N mm; N/m is m, rad, N, N m. The unit
of a compliance is the inverse: um/N, mm/N, m/N. Directions are the axes of the gearbox; rotations are rotations of the
seat, forces act on the housing. The foundation is fixed.

With K the stiffness matrix of the model, its foundation fixed, and W the nodal forces of a unit force or moment on each
seat direction, the compliance between the seats is

    C = W^T K^-1 W

A seat moves by the mean of its nodes, weighted as W spreads the force (what FE programs call a distributing coupling,
RBE3), so that force times displacement is the work done. Where W picks single degrees of freedom, C is the block of
K^-1 that belongs to them, and its inverse the Schur complement K_rr - K_ri K_ii^-1 K_ir (Guyan's reduction, exact for
static loads on what is retained).

References:
    R. J. Guyan, Reduction of stiffness and mass matrices, AIAA J. 3(2), 1965, p. 380.
"""

import csv
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy  # its packages load when they are used
from jaxtyping import Array, Bool, Float
from threadpoolctl import threadpool_limits

from ..numerics import Checked, Numbers, concrete, number, positive_definite, solve_dense
from .stepped_beam import DIRECTIONS, check_symmetric, semidefinite, symmetric

Matrix = Float[Array, "rows columns"]
Kind = Literal["stiffness", "compliance"]

# Smallest ratio of the extreme eigenvalues of a matrix scaled to a diagonal of 1 that exceeds rounding.
_DEFINITE = 1e-10


class Housing(Checked):
    """Stiffness or compliance of a housing at the seats of the bearings, foundation included.

    Attributes:
        nodes: names of the rows and columns, "SEAT.DIRECTION" with the name of a bearing and x, y, z, rx or ry; a seat
            is rigid in directions that are missing.
        matrix: stiffness [N/um, N/mrad, N mm/mrad] or compliance [um/N, mrad/N, mrad/(N mm)], shape (nodes, nodes).
        kind: "stiffness" or "compliance". A stiffness must be positive definite: the housing must be fixed to its
            foundation. A compliance must be positive semidefinite: it may be rigid in some directions.

    Raises:
        ValueError: for rows that are unknown or named twice, and for a matrix of another size, or that is not symmetric
            or not definite.
    """

    nodes: tuple[str, ...] = eqx.field(static=True, converter=tuple)
    matrix: Matrix = number("N/um or um/N", shape=("nodes", "nodes"))
    kind: Kind = eqx.field(static=True, default="stiffness")

    def check_together(self) -> None:
        _check_nodes(self.nodes)
        size = len(self.nodes)
        if self.matrix.shape != (size, size):
            raise ValueError(f"Housing: matrix has shape {self.matrix.shape}, must be ({size}, {size}) as its nodes")
        known = concrete(self.matrix)
        if known is not None:
            check_symmetric(f"Housing: {self.kind}", known, self.nodes)
            _check_definite(known, self.kind, self.nodes)

    @property
    def seats(self) -> tuple[str, ...]:
        """Names of the seats in the order of their first rows."""
        return tuple(dict.fromkeys(_split(node)[0] for node in self.nodes))

    @property
    def valid(self) -> Bool[Array, ""]:
        """True if the symmetric part of a stiffness is positive definite, of a compliance semidefinite; for tracing."""
        even = symmetric(self.matrix)
        diagonal, unit = jnp.diagonal(even), jnp.eye(len(even), dtype=even.dtype)
        scale = 1 / jnp.sqrt(jnp.where(diagonal > 0, diagonal, 1.0))
        scaled = scale[:, None] * even * scale[None]
        if self.kind == "stiffness":
            return jnp.all(diagonal > 0) & positive_definite(scaled - _DEFINITE * unit)
        return jnp.all(diagonal >= 0) & semidefinite(scaled)

    @property
    def compliance(self) -> Matrix:
        """Compliance matrix in the order of `nodes` [um/N, mrad/N, mrad/(N mm)], shape (nodes, nodes)."""
        even = symmetric(self.matrix)
        return even if self.kind == "compliance" else solve_dense(even, jnp.eye(len(even), dtype=even.dtype))

    def at(self, bearings: tuple[str, ...]) -> Float[Array, "directions directions"]:
        """Compliance matrix in x, y, z, rx, ry of the seats of bearings, in their order [um/N, mrad/N, mrad/(N mm)]."""
        places = {name: index for index, name in enumerate(bearings)}
        rows = np.array(
            [len(DIRECTIONS) * places[seat] + DIRECTIONS.index(way) for seat, way in map(_split, self.nodes)]
        )
        size = len(DIRECTIONS) * len(bearings)
        return jnp.zeros((size, size), self.matrix.dtype).at[rows[:, None], rows].set(self.compliance)


def _split(node: str) -> tuple[str, str]:
    seat, _, direction = node.rpartition(".")
    return seat, direction


def _check_nodes(nodes: tuple[str, ...]) -> None:
    if not nodes:
        raise ValueError("Housing: nodes must not be empty")
    for index, node in enumerate(nodes):
        seat, direction = _split(node) if isinstance(node, str) else ("", "")
        if not seat or direction not in DIRECTIONS:
            raise ValueError(
                f"Housing: node {node!r} must be SEAT.DIRECTION with a direction of {', '.join(DIRECTIONS)}"
            )
        if node in nodes[:index]:
            raise ValueError(f'Housing: node "{node}" is given twice')


def _check_definite(matrix: np.ndarray, kind: Kind, nodes: tuple[str, ...]) -> None:
    diagonal = np.diag(matrix)
    least = np.argmin(diagonal)
    if diagonal[least] < 0 or (kind == "stiffness" and diagonal[least] == 0):
        sign = "greater than 0" if kind == "stiffness" else "at least 0"
        raise ValueError(f"Housing: {kind} of {nodes[least]} is {diagonal[least]:.6g}, must be {sign}")
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    lowest = np.linalg.eigvalsh(scale[:, None] * (0.5 * (matrix + matrix.T)) * scale)[0]
    if kind == "stiffness" and lowest <= _DEFINITE:
        raise ValueError(
            f"Housing: stiffness must be positive definite, but its smallest eigenvalue is {lowest:.3g} of its "
            "diagonal: is the housing fixed to its foundation?"
        )
    if lowest < -max(_DEFINITE, 10 * len(matrix) * np.finfo(matrix.dtype).eps):
        raise ValueError(
            f"Housing: {kind} must be positive semidefinite, but its smallest eigenvalue is {lowest:.3g} of its "
            "diagonal"
        )


# one unit of force, moment, displacement and rotation of each system in N, N mm, um and mrad
_SYSTEMS = {"um": (1.0, 1.0, 1.0, 1.0), "mm": (1.0, 1.0, 1e3, 1e3), "m": (1.0, 1e3, 1e6, 1e3)}
_UNITS = {
    **{("stiffness", f"N/{length}"): length for length in _SYSTEMS},
    **{("compliance", f"{length}/N"): length for length in _SYSTEMS},
}


def read_housing(path: str | Path) -> Housing:
    """Read a housing from a CSV or npz file.

    Raises:
        ValueError: in one line with the file name and the reason: missing file, another file extension, an unknown
            kind, unit or node, rows and columns that differ, an entry that is not a number, a matrix that is not
            square, symmetric or positive definite.
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
    """Write a housing as CSV or npz, in the units of this package.

    Raises:
        ValueError: for another file extension.
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
        raise ValueError(f'"{kind} {unit}" is not a kind and unit of a housing, must be one of {known}')
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
        raise ValueError("is not a valid npz archive")
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


_ASYMMETRY = 1e-6  # of a stiffness matrix, relative to its largest entry
_MISSED = 1e-6  # of unit loads, where the solution is one


def spread_forces(
    nodes: np.ndarray, center: Numbers, degrees_of_freedom: np.ndarray, size: int, *, tilting: bool = False
) -> np.ndarray:
    """Nodal forces of unit forces (and moments) on a seat in the directions x, y, z (, rx, ry).

    They are the nodal forces of least norm with the given resultant; a force is shared equally by nodes that lie evenly
    around the centre.

    Args:
        nodes: coordinates of the nodes of the bore [mm], shape (nodes, 3).
        center: centre of the seat [mm], shape (3,).
        degrees_of_freedom: rows of every node's x, y and z in the stiffness matrix, shape (nodes, 3).
        size: number of rows of the stiffness matrix.
        tilting: True if the seat carries moments.

    Returns:
        nodal forces, shape (size, 3 or 5).

    Raises:
        ValueError: for nodes on one line, which cannot carry the moments, or for rows outside the matrix.
    """
    arms = np.asarray(nodes, float) - np.asarray(center, float)
    count = len(arms)
    rows = np.asarray(degrees_of_freedom)
    if rows.shape != (count, 3) or rows.min() < 0 or rows.max() >= size:
        raise ValueError(
            f"degrees_of_freedom of shape {rows.shape} must be {count} times 3 rows from 0 to "
            f"{size - 1}: the nodes of a seat must be free"
        )
    # resultant of nodal forces: x, y, z and moments about the centre
    zero, (x, y, z) = np.zeros(count), arms.T
    one = np.ones(count)
    resultant = np.stack(
        [
            np.stack([one, zero, zero], 1),
            np.stack([zero, one, zero], 1),
            np.stack([zero, zero, one], 1),
            np.stack([zero, -z, y], 1),
            np.stack([z, zero, -x], 1),
            np.stack([-y, x, zero], 1),
        ]
    ).reshape(6, -1)
    gram = resultant @ resultant.T
    scale = 1 / np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    if np.linalg.matrix_rank(scale[:, None] * gram * scale) < 6:
        raise ValueError(f"{count} nodes cannot carry forces and moments: they lie on one line")
    spread = resultant.T @ np.linalg.inv(gram)
    ways = 5 if tilting else 3
    forces = np.zeros((size, ways))
    np.add.at(forces, rows.ravel(), spread[:, :ways])
    return forces


def condense(
    stiffness: "scipy.sparse.sparray | scipy.sparse.spmatrix | np.ndarray", seats: Mapping[str, np.ndarray]
) -> Housing:
    """Condense a finite-element model of a housing in mm, N and rad to the compliance between its bearing seats.

    Args:
        stiffness: sparse symmetric matrix [N/mm], without the rows and columns of fixed degrees of freedom.
        seats: by the name of the bearing, the nodal forces of unit loads in x, y, z (, rx, ry), for instance from
            `spread_forces`, shape (rows, 3 or 5).

    Raises:
        ValueError: for seats whose size differs from the matrix, a matrix that is not symmetric, or a model that is not
            fixed to its foundation.
    """
    matrix = scipy.sparse.csc_matrix(stiffness)
    if matrix.shape[0] != matrix.shape[1] or abs(matrix - matrix.T).max() > _ASYMMETRY * abs(matrix).max():
        raise ValueError(f"stiffness of shape {matrix.shape} must be square and symmetric, both of its triangles given")
    nodes: list[str] = []
    for name, forces in seats.items():
        if forces.ndim != 2 or forces.shape[0] != matrix.shape[0] or forces.shape[1] not in (3, 5):
            raise ValueError(
                f'seat "{name}" has nodal forces of shape {forces.shape}, must be ({matrix.shape[0]}, 3 or 5)'
            )
        nodes += [f"{name}.{way}" for way in DIRECTIONS[: forces.shape[1]]]
    if not nodes:
        raise ValueError("seats must not be empty")
    loads = np.concatenate(list(seats.values()), axis=1)
    try:
        with threadpool_limits(limits=1):  # many small blocks: more threads are slower
            factors = scipy.sparse.linalg.splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
            moved = factors.solve(loads)
    except RuntimeError:  # exactly singular
        raise ValueError("stiffness is singular: is the housing fixed to its foundation?") from None
    missed = np.abs(matrix @ moved - loads).max() / np.abs(loads).max()
    if not missed < _MISSED:  # a model that floats is singular but for rounding
        raise ValueError(
            f"stiffness is singular, residual forces are {missed:.2g} of the given ones: is the housing "
            "fixed to its foundation?"
        )
    compliance = loads.T @ moved  # mm and rad per N and N mm
    return Housing(tuple(nodes), 1e3 * 0.5 * (compliance + compliance.T), "compliance")
