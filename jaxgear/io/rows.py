"""Rows of a table, CSV or Parquet, each a text by the name of its column."""

import csv
from pathlib import Path

from .errors import DesignFileError, check_file

Rows = list[dict[str, str]]

PARQUET = ".parquet"  # what the name of such a file ends with


def read_rows(path: Path) -> Rows:
    """Rows of a file whose name ends in .parquet, or of CSV in UTF-8 with a line of headings.

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
            reader = csv.DictReader(file)
            names = [name.strip() for name in reader.fieldnames or ()]
            reader.fieldnames = names
            rows = list(reader)
    except UnicodeDecodeError:
        raise DesignFileError("", "is not text in UTF-8") from None
    except OSError as error:
        raise DesignFileError("", error.strerror or str(error)) from None
    except csv.Error as error:
        raise DesignFileError("", f"is no CSV file: {error}") from None
    if not rows:
        raise DesignFileError("", "holds no points")
    _check_table(names, rows)
    return rows


def _check_table(names: list[str], rows: Rows) -> None:
    """Refuses what the headings do not fit: decimal commas would be columns of their own."""
    if len(names) == 1 and ";" in names[0]:
        raise DesignFileError("", "separates its columns by semicolons, must have commas, and points in its numbers")
    twice = [name for name in dict.fromkeys(names) if name and names.count(name) > 1]
    if twice:
        raise DesignFileError("", f"has several columns {twice[0]}, must have one")
    for number, row in enumerate(rows, 1):
        further = row.get(None)  # type: ignore[call-overload]
        if further and any(map(str.strip, further)):
            fields = len(names) + len(further)
            problem = f"point {number} has {fields} fields, the headings {len(names)}: numbers must have no commas"
            raise DesignFileError("", problem)
