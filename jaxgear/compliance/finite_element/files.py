"""Tables of gears as CSV files, which other finite-element programs can write: thin rims, webs, anything."""

import csv
from pathlib import Path

import numpy as np

from ...numerics.durable import write_durably
from .build import GearNumbers
from .compliance_table import GearTable, gear_table
from .shape import Shape

COLUMNS = ("kind", "neighbour", "loaded_mm", "displaced_mm", "um_mm_per_N")
_SINGLE = ("module", "modulus", "hub")  # kinds with one value
_CURVES = ("center", "local")  # kinds with a value for each roll length
_RECIPROCITY = 0.01  # by which neighbours k and -k may differ, of the largest coupling of that neighbour
_FEWEST = 4  # points of a cubic spline

Row = tuple[int, str, int, float, float, float]


def write_table(path: str | Path, table: GearTable) -> None:
    """Writes the table of a gear as CSV; read again it is the same, bit by bit.

    Columns: `kind, neighbour, loaded_mm, displaced_mm, um_mm_per_N`, all loads 1 N per mm of face width, normal to the
    flank at a roll length, all displacements along the load line, positive with the load, the bore held, of a ring gear
    the rim circle:

        kind        neighbour   loaded_mm   displaced_mm   um_mm_per_N
        module                                             module that the roll lengths are for [mm]; optional
        modulus                                            plane modulus, E or E / (1 - nu^2) [MPa]; optional
        hub                                                common rotation inside the values below; optional
        center                  rho                        the point where the load line crosses the centreline
        local                   rho                        flank minus that point minus the contact law; optional
        neighbour   k           rho         rho'           flank of tooth k at roll length rho'

    k counts the teeth counter-clockwise of the loaded one in the view in which the load pushes it counter-clockwise; it
    needs all k = 1 ... n, and k = -1 ... -n may be there too: table k over (rho, rho') is table -k over (rho', rho).
    All parts have the same increasing roll lengths; those of a ring gear are negative. Without module and modulus they
    are those of the gear, without hub it is the torsion of the solid ring. `local` is the mean over the contact of what
    a flank under a Hertzian pressure deflects beyond 2 q / (pi E') [asinh(h / a) - nu' h / (sqrt(h^2 + a^2) + h)], h
    the depth to the centreline.

    Args:
        path: of the file.
        table: of one gear and plane: `finite_element_compliance(pair, plane).pinion[0]`.
    """
    rho = [float(value) for value in np.asarray(table.roll_length)]
    rows: list[tuple[str | int, ...]] = [(kind, "", "", "", repr(float(getattr(table, kind)))) for kind in _SINGLE]
    for kind in _CURVES:
        rows += [(kind, "", repr(x), "", repr(float(y))) for x, y in zip(rho, np.asarray(getattr(table, kind)))]
    for k, matrix in enumerate(np.asarray(table.neighbours), 1):
        for x, line in zip(rho, matrix):
            rows += [("neighbour", k, repr(x), repr(other), repr(float(y))) for other, y in zip(rho, line)]
    text = "".join(",".join(map(str, row)) + "\n" for row in (COLUMNS, *rows))
    write_durably(Path(path), lambda file: file.write(text.encode()))


def read_table(path: Path, shape: Shape, module: float, modulus: float, hub: float) -> GearTable:
    """The table of a file, for a gear.

    Args:
        path: of the file.
        shape, module, modulus, hub: of the gear, in the places of what the file does not tell.

    Raises:
        ValueError: for a file that cannot be right, naming the file, the line and the column.
    """
    rows = _rows(path)
    single = dict(zip(_SINGLE, (module, modulus, hub)))
    for line, kind, _, _, _, value in rows:
        if kind in single:
            if not value > 0 and kind != "hub":
                raise ValueError(f"{path}: line {line}: {kind} = {value:g} must be greater than 0")
            single[kind] = value
    curves = {kind: [row for row in rows if row[1] == kind] for kind in _CURVES}
    rho = _increasing(path, "center", curves["center"], shape)
    center = np.array([row[5] for row in curves["center"]])
    local = np.zeros_like(rho)
    if curves["local"]:
        if not np.array_equal(_increasing(path, "local", curves["local"], shape), rho):
            raise ValueError(f"{path}: line {curves['local'][0][0]}: loaded_mm of local must be that of center")
        local = np.array([row[5] for row in curves["local"]])
    numbers = GearNumbers(rho, center, local, _neighbours(path, rows, rho))
    _check_definite(path, numbers, single["hub"])
    return gear_table(shape, single["module"], single["modulus"], numbers, single["hub"])


def _rows(path: Path) -> list[Row]:
    try:
        lines = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if not lines or tuple(cell.strip() for cell in lines[0]) != COLUMNS:
        raise ValueError(f"{path}: line 1: columns must be {', '.join(COLUMNS)}")
    return [_row(path, line, cells) for line, cells in enumerate(lines[1:], 2) if any(cells)]


def _row(path: Path, line: int, cells: list[str]) -> Row:
    if len(cells) != len(COLUMNS):
        raise ValueError(f"{path}: line {line}: {len(cells)} columns must be {len(COLUMNS)}")
    kind, *texts = (cell.strip() for cell in cells)
    if kind not in (*_SINGLE, *_CURVES, "neighbour"):
        raise ValueError(
            f"{path}: line {line}: kind = {kind!r} must be one of {', '.join((*_SINGLE, *_CURVES))}, neighbour"
        )
    wanted = {"neighbour": (True, True, True)}.get(kind, (False, kind in _CURVES, False))
    found = []
    for name, text, needed in zip(COLUMNS[1:], texts, (*wanted, True)):
        if not needed:
            found.append(0.0)
            continue
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if not np.isfinite(value) or (name == "neighbour" and (value != int(value) or not value)):
            what = "a whole number but 0" if name == "neighbour" else "a finite number"
            raise ValueError(f"{path}: line {line}: {name} = {text!r} must be {what}")
        found.append(value)
    return line, kind, int(found[0]), found[1], found[2], found[3]


def _increasing(path: Path, kind: str, rows: list[Row], shape: Shape) -> np.ndarray:
    """The roll lengths of a curve."""
    if len(rows) < _FEWEST:
        raise ValueError(f"{path}: {len(rows)} rows of kind {kind} must be at least {_FEWEST}")
    for before, row in zip(rows, rows[1:]):
        if not row[3] > before[3]:
            raise ValueError(f"{path}: line {row[0]}: loaded_mm = {row[3]:g} must be greater than {before[3]:g}")
    line, *_, nearest, _, _ = rows[-1] if shape.is_internal else rows[0]  # to the base circle
    if shape.signed(nearest) < 0:
        bound = "at most 0 for a ring gear" if shape.is_internal else "at least 0"
        raise ValueError(f"{path}: line {line}: loaded_mm = {nearest:g} must be {bound}")
    return np.array([row[3] for row in rows])


def _neighbours(path: Path, rows: list[Row], rho: np.ndarray) -> np.ndarray:
    """Couplings k = 1 ... n; where both senses are given, their mean."""
    tables: dict[int, np.ndarray] = {}
    places = {value: place for place, value in enumerate(rho)}
    for line, kind, k, loaded, displaced, value in rows:
        if kind != "neighbour":
            continue
        for name, x in (("loaded_mm", loaded), ("displaced_mm", displaced)):
            if x not in places:
                raise ValueError(f"{path}: line {line}: {name} = {x:g} must be a roll length of center")
        matrix = tables.setdefault(k, np.full((len(rho), len(rho)), np.nan))
        if not np.isnan(matrix[places[loaded], places[displaced]]):
            raise ValueError(f"{path}: line {line}: neighbour {k} is given twice at {loaded:g}, {displaced:g} mm")
        matrix[places[loaded], places[displaced]] = value
    for k, matrix in tables.items():
        gaps = np.argwhere(np.isnan(matrix))
        if len(gaps):
            one, other = rho[gaps[0]]
            raise ValueError(f"{path}: neighbour {k}: no row for loaded_mm = {one:g}, displaced_mm = {other:g}")
    most = max(map(abs, tables), default=0)
    missing = [k for k in range(1, most + 1) if k not in tables]
    if missing:
        raise ValueError(f"{path}: neighbour {missing[0]}: no rows, must have rows up to neighbour {most}")
    for k in range(1, most + 1):
        if -k not in tables:
            continue
        apart = np.max(np.abs(tables[k] - tables[-k].T)) / np.max(np.abs(tables[k]))
        if not apart <= _RECIPROCITY:
            raise ValueError(
                f"{path}: neighbours {k} and {-k} differ by {100 * apart:.3g} %, must be within "
                f"{100 * _RECIPROCITY:g} % as displacements are reciprocal"
            )
        tables[k] = 0.5 * (tables[k] + tables[-k].T)
    return np.stack([tables[k] for k in range(1, most + 1)]) if most else np.zeros((0, len(rho), len(rho)))


def _check_definite(path: Path, numbers: GearNumbers, hub: float) -> None:
    """Loads on all teeth together at any one roll length must do work."""
    teeth = len(numbers.neighbours) + 1
    apart = np.abs(np.arange(teeth)[:, None] - np.arange(teeth)[None])
    for place, rho in enumerate(numbers.roll_length):
        row = np.array([numbers.center[place], *numbers.neighbours[:, place, place]]) - hub
        least = np.linalg.eigvalsh(row[apart])[0]
        if not least > 0:
            raise ValueError(
                f"{path}: loaded_mm = {rho:g}: center and neighbours without hub = {hub:g} are not positive definite: "
                f"least eigenvalue {least:.3g} must be greater than 0 um mm/N"
            )
