"""Rows of a table, CSV or Parquet, and variants listed in one."""

import csv
import csv as text
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np

from ..sweeps import VariantList
from ..sweeps.columns import from_text
from .errors import DesignFileError, check_file, naming
from .headings import with_units

Rows = list[dict[str, str]]

PARQUET = ".parquet"  # what the name of such a file ends with


def read_rows(path: Path) -> Rows:
    """Rows of a file whose name ends in .parquet, or of text in UTF-8 with a line of headings.

    Columns are apart by commas, or by semicolons or tabs, and numbers may then have decimal commas. Lines that begin
    with # before the headings are passed over; a line of units below them is taken into them.

    Raises:
        DesignFileError: when the file cannot be read, is no table or has no rows.
    """
    check_file(path)
    return _read_parquet(path) if path.suffix == PARQUET else _read_csv(path)


def _read_parquet(path: Path) -> Rows:
    import pyarrow
    from pyarrow import parquet

    try:
        with path.open("rb") as file:
            table = parquet.ParquetFile(file).read()
    except OSError as error:
        raise DesignFileError("", error.strerror or str(error).splitlines()[0]) from None
    except pyarrow.ArrowException as error:
        raise DesignFileError("", f"is not a valid Parquet file: {str(error).splitlines()[0]}") from None
    names = [name.strip() for name in table.column_names]
    if not table.num_rows:
        raise DesignFileError("", "holds no points")
    _check_table(names, [])
    columns = [["" if value is None else str(value) for value in column.to_pylist()] for column in table.columns]
    return [dict(zip(names, row)) for row in zip(*columns)]


def _read_csv(path: Path) -> Rows:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = file.read().splitlines(keepends=True)
        while lines and (not lines[0].strip() or lines[0].startswith("#")):
            del lines[0]
        delimiter = max((",", ";", "\t"), key=lines[0].count) if lines else ","
        found = [row for row in csv.reader(lines, delimiter=delimiter) if any(map(str.strip, row))]
    except UnicodeDecodeError:
        raise DesignFileError("", "is not text in UTF-8") from None
    except OSError as error:
        raise DesignFileError("", error.strerror or str(error)) from None
    except csv.Error as error:
        raise DesignFileError("", f"is not a valid CSV file: {error}") from None
    names, *points = [[name.strip() for name in found[0]], *found[1:]] if found else [[]]
    if points and (units := with_units(names, points[0])) is not None:
        names, points = units, points[1:]
    if not points:
        raise DesignFileError("", "holds no points")
    _check_table(names, points)
    if delimiter != ",":
        points = _with_points(points)
    return [dict(zip_longest(names, row[: len(names)])) for row in points]


def _with_points(rows: list[list[str]]) -> list[list[str]]:
    """Cells with decimal points in place of decimal commas, which columns apart by semicolons or tabs may have."""
    cells = [cell for row in rows for cell in row]
    comma = next((cell for cell in cells if _COMMA.fullmatch(cell)), None)
    point = next((cell for cell in cells if _POINT.fullmatch(cell)), None)
    if comma and point:
        raise DesignFileError("", f'has "{comma.strip()}" and "{point.strip()}", must have one decimal mark')
    return [[cell.replace(",", ".") if _COMMA.fullmatch(cell) else cell for cell in row] for row in rows]


_COMMA, _POINT = (re.compile(rf"\s*[+-]?\d*{mark}\d+([eE][+-]?\d+)?\s*") for mark in (",", r"\."))


def _check_table(names: list[str], rows: list[list[str]]) -> None:
    """Raise if a row has more columns than headings (decimal commas do that)."""
    twice = [name for name in dict.fromkeys(names) if name and names.count(name) > 1]
    if twice:
        raise DesignFileError("", f"has several columns {twice[0]}, must have one")
    for number, row in enumerate(rows, 1):
        if any(map(str.strip, row[len(names) :])):
            problem = f"point {number} has {len(row)} fields, the headings {len(names)}: numbers must have no commas"
            raise DesignFileError("", f"{problem}, or columns be separated by semicolons")


_HEADING = re.compile(r"(?P<name>.*?)(?: \[(?P<unit>[^]]*)\])?")  # as tables of sweeps are exported
_LENGTHS = {"nm": 1e-9, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "mm": 1e-3, "m": 1.0}  # with micro sign and with mu


def read_variants(
    path: Path, bounds: Mapping[str, tuple[float, float]], units: Mapping[str, str] | None = None
) -> VariantList:
    """Reads a list of variants; other columns of the file are passed over, so the table of a sweep can be read again.

    The numbers go through a temporary file on the disk: a list may be longer than fits the memory.

    Args:
        path: a .parquet file, or a CSV file in UTF-8 whose headings are the names, with or without a unit in brackets.
        bounds: (low, high) of every parameter.
        units: units of the parameters; lengths in another unit are converted, anything else in another unit is refused.

    Raises:
        DesignFileError: when the file cannot be read, lacks a parameter or has it twice, or holds something else than
            numbers within the bounds.
    """
    import pyarrow

    names, rows = list(bounds), 0
    with naming(path), tempfile.TemporaryFile() as scratch:  # the array on it outlives it
        check_file(path)
        try:
            for piece in (_parquet if path.suffix.lower() == ".parquet" else _csv)(path, names, units or {}):
                _check_bounds(piece, bounds, rows)
                scratch.write(np.ascontiguousarray(piece, np.float64).tobytes())
                rows += len(piece)
        except UnicodeDecodeError:
            raise DesignFileError("", "is not text in UTF-8: save it so, or as Parquet") from None
        except (OSError, pyarrow.ArrowException) as error:
            raise DesignFileError("", getattr(error, "strerror", None) or str(error).partition("\n")[0]) from None
        if not rows:
            raise DesignFileError("", "holds no variants")
        scratch.flush()
        return VariantList(names, np.memmap(scratch, np.float64, "r", shape=(rows, len(names))))


def _csv(path: Path, names: Sequence[str], units: Mapping[str, str]) -> Iterator[np.ndarray]:
    import pyarrow
    from pyarrow import csv

    with path.open(encoding="utf-8-sig", newline="") as file:
        headings = [from_text(heading.strip()) for heading in next(text.reader(file), [])]
    places, factors = _columns([_parts(heading) for heading in headings], names, units)
    numbered = [str(place) for place in range(len(headings))]  # headings of columns that are not read may occur twice
    wanted = [numbered[place] for place in places]
    options = csv.ConvertOptions(column_types=dict.fromkeys(wanted, pyarrow.float64()), include_columns=wanted)
    read = csv.ReadOptions(column_names=numbered, skip_rows=1)
    for batch in csv.open_csv(path, read_options=read, convert_options=options):
        yield _numbers(batch) * factors


def _parquet(path: Path, names: Sequence[str], units: Mapping[str, str]) -> Iterator[np.ndarray]:
    import pyarrow
    from pyarrow import parquet

    with parquet.ParquetFile(path) as file:
        fields = list(file.schema_arrow)
        known = [(_parts(field.name)[0], _unit(field) or _parts(field.name)[1]) for field in fields]
        places, factors = _columns(known, names, units)
        wanted = [fields[place].name for place in places]
        types = pyarrow.schema([(name, pyarrow.float64()) for name in wanted])
        for batch in file.iter_batches(columns=wanted):
            yield _numbers(batch.select(wanted).cast(types)) * factors


def _columns(known: Sequence[tuple[str, str | None]], names: Sequence[str], units: Mapping[str, str]):
    """Positions of the parameters among the columns of the file, and factors that convert their units."""
    places = {name: [i for i, (other, _) in enumerate(known) if other == name] for name in names}
    missing = [name for name in names if not places[name]]
    if missing:
        raise DesignFileError("", f"has no column {', '.join(missing)}")
    for name in names:
        if len(places[name]) > 1:
            raise DesignFileError("", f"has {len(places[name])} columns {name}, must have one")
    chosen = [places[name][0] for name in names]
    return chosen, np.array([_factor(name, known[i][1], units.get(name)) for name, i in zip(names, chosen)])


def _factor(name: str, given: str | None, wanted: str | None) -> float:
    if given is None or wanted is None or given == wanted:
        return 1.0
    if given in _LENGTHS and wanted in _LENGTHS:
        return float(f"{_LENGTHS[given] / _LENGTHS[wanted]:.1e}")  # a power of ten to the last bit
    raise DesignFileError("", f"column {name} is in [{given}], must be in [{wanted or '-'}]")


def _check_bounds(rows: np.ndarray, bounds: Mapping[str, tuple[float, float]], before: int) -> None:
    for column, (name, (low, high)) in zip(rows.T, bounds.items()):
        outside = np.flatnonzero((column < low) | (column > high))
        if outside.size:
            value, number = column[outside[0]], before + outside[0]
            raise DesignFileError("", f"{name} = {value:g} of variant {number} must be from {low:g} to {high:g}")


def _parts(heading: str) -> tuple[str, str | None]:
    """Name and unit of a heading; None for a heading without unit."""
    match = _HEADING.fullmatch(heading)
    return (heading, None) if match is None else (match["name"], match["unit"])


def _unit(field) -> str | None:
    unit = (field.metadata or {}).get(b"unit")
    return unit.decode() if unit else None


def _numbers(batch) -> np.ndarray:
    return np.stack([column.to_numpy(zero_copy_only=False) for column in batch.columns], axis=1)
