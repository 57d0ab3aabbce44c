"""Variants listed in a file, CSV or Parquet."""

import re
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ..sweeps import VariantList
from .errors import DesignFileError

_UNIT = re.compile(r" \[[^]]*\]$")  # of a heading, as tables of sweeps are exported


def read_variants(path: Path, names: Sequence[str]) -> VariantList:
    """Reads a list of variants; other columns of the file are passed over, so the table of a sweep can be read again.

    The numbers go through a temporary file on the disk: a list may be longer than fits the memory.

    Args:
        path: a .parquet file, or a CSV file whose headings are the names, with or without a unit in brackets.
        names: of the parameters.

    Raises:
        DesignFileError: when the file cannot be read, lacks a parameter, or holds something else than numbers.
    """
    import pyarrow

    rows = 0
    with tempfile.TemporaryFile() as scratch:  # the array on it outlives it
        try:
            for piece in (_parquet if path.suffix.lower() == ".parquet" else _csv)(path, names):
                scratch.write(np.ascontiguousarray(piece, np.float64).tobytes())
                rows += len(piece)
        except (OSError, pyarrow.ArrowException) as error:
            problem = getattr(error, "strerror", None) or str(error).partition("\n")[0]
            raise DesignFileError(path, "", problem) from None
        if not rows:
            raise DesignFileError(path, "", "holds no variants")
        scratch.flush()
        return VariantList(names, np.memmap(scratch, np.float64, "r", shape=(rows, len(names))))


def _csv(path: Path, names: Sequence[str]) -> Iterator[np.ndarray]:
    import pyarrow
    from pyarrow import csv

    with path.open(encoding="utf-8-sig") as file:
        headings = [heading.strip().strip('"') for heading in file.readline().strip().split(",")]
    wanted = _columns(path, headings, names)
    options = csv.ConvertOptions(column_types=dict.fromkeys(wanted, pyarrow.float64()), include_columns=wanted)
    read = csv.ReadOptions(column_names=headings, skip_rows=1)
    for batch in csv.open_csv(path, read_options=read, convert_options=options):
        yield _numbers(batch)


def _parquet(path: Path, names: Sequence[str]) -> Iterator[np.ndarray]:
    import pyarrow
    from pyarrow import parquet

    with parquet.ParquetFile(path) as file:
        wanted = _columns(path, file.schema_arrow.names, names)
        types = pyarrow.schema([(name, pyarrow.float64()) for name in wanted])
        for batch in file.iter_batches(columns=wanted):
            yield _numbers(batch.select(wanted).cast(types))


def _columns(path: Path, headings: Sequence[str], names: Sequence[str]) -> list[str]:
    """The file's names of the parameters."""
    known = {_UNIT.sub("", heading): heading for heading in headings}
    missing = [name for name in names if name not in known]
    if missing:
        raise DesignFileError(path, "", f"has no column {', '.join(missing)}")
    return [known[name] for name in names]


def _numbers(batch) -> np.ndarray:
    return np.stack([column.to_numpy(zero_copy_only=False) for column in batch.columns], axis=1)
