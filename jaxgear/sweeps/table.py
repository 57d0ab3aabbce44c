"""The table of a sweep, read part by part, its best rows and its Pareto front."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..contact.status import Status, explanation
from ..numerics.durable import write_durably
from ..numerics.pareto import pareto_front
from .columns import CONVERGED, STATUS, VARIANT, Column, as_text
from .store import Store, load_manifest

Numbered = tuple[np.ndarray, np.ndarray]  # row numbers, and values that are to be small


def smallest(parts: Iterable[Numbered], count: int) -> np.ndarray:
    """Numbers of the rows with the `count` smallest values, ascending; equal values in the order of their numbers.

    Args:
        parts: row numbers and values, shape (rows,), NaN for rows to be ignored.
        count: number of rows to return.
    """
    numbers, values = np.empty(0, np.int64), np.empty(0)
    for more, new in parts:
        fine = ~np.isnan(new)
        numbers, values = np.concatenate([numbers, more[fine]]), np.concatenate([values, new[fine]])
        if len(values) > count:
            limit = np.partition(values, count - 1)[count - 1]
            numbers, values = numbers[values <= limit], values[values <= limit]
        order = np.lexsort((numbers, values))[:count]
        numbers, values = numbers[order], values[order]
    return numbers


def front(parts: Iterable[Numbered]) -> np.ndarray:
    """Numbers of the non-dominated rows (Pareto front), sorted by the first column.

    Of rows with equal values the first is kept.

    Args:
        parts: row numbers and values, shape (rows, two or three columns), NaN for rows to be ignored.
    """
    numbers, values = np.empty(0, np.int64), None
    for more, new in parts:
        numbers = np.concatenate([numbers, more])
        values = new if values is None else np.concatenate([values, new])
        best = np.flatnonzero(pareto_front(values))
        order = best[np.lexsort((numbers[best], *values[best].T[::-1]))]
        first = np.r_[True, (values[order[1:]] != values[order[:-1]]).any(axis=1)][: len(order)]
        numbers, values = numbers[order[first]], values[order[first]]
    return numbers


_SHOWN = 5  # rows of the printed table


class SweepTable:
    """Result of `sweep`: one row per variant, in the order of the plan.

    Every method but `column` holds one part of the table at a time, whatever its size. Failed variants stay in the
    table: their `converged` is False, their `status` is the reason, and their results are NaN.

    A method takes the name of a column with or without its unit: "ppte_um" or "ppte".

    Attributes:
        title: title of the sweep.
        columns: all columns, each with the quantity that it holds and its cases.
    """

    def __init__(
        self,
        title: str,
        columns: Sequence[Column],
        sizes: Sequence[int],
        read: Callable[[int, Sequence[str] | None], Any],
    ) -> None:
        """Made by `sweep` and `open_sweep`.

        Args:
            title: title of the sweep.
            columns: all columns.
            sizes: number of rows of every part.
            read: read(part, names) gives these columns of a part as an Arrow table, all columns for None.
        """
        self.title, self.columns = title, tuple(columns)
        self._sizes, self._read = tuple(sizes), read

    def __len__(self) -> int:
        """Number of variants."""
        return sum(self._sizes)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(column.name for column in self.columns)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the columns that hold the parameters of the variants."""
        return tuple(column.name for column in self.columns if column.kind == "parameter")

    @property
    def results(self) -> tuple[str, ...]:
        """Names of the columns that hold results."""
        return tuple(column.name for column in self.columns if column.kind == "result")

    @property
    def units(self) -> dict[str, str]:
        """Unit of every column, "" for a pure number."""
        return {column.name: column.unit for column in self.columns}

    @property
    def heads(self) -> tuple[Column, ...]:
        """First column of every result; with a load spectrum or a tolerance this is the mean."""
        results = [column for column in self.columns if column.kind == "result"]
        firsts = {column.quantity.name: column for column in reversed(results)}
        return tuple(column for column in results if firsts[column.quantity.name] is column)

    def find(self, name: str) -> Column:
        """Column of a name, with or without its unit; the name of a result alone means its (weighted) mean.

        Raises:
            ValueError: for an unknown column.
        """
        for wanted in (name, f"{name}_mean"):
            for column in self.columns:
                if wanted in (column.name, column.name_without_unit):
                    return column
        raise ValueError(f'SweepTable: "{name}" is not a column, must be one of {", ".join(self.names)}')

    def batches(self, names: Sequence[str] | None = None) -> Iterator[dict[str, np.ndarray]]:
        """Values of columns, one part of the table after the other.

        Args:
            names: names of the columns wanted, None for all.

        Raises:
            ValueError: for an unknown column.
        """
        wanted = {name: self.find(name).name for name in (self.names if names is None else names)}
        for part in range(len(self._sizes)):
            table = self._read(part, [*dict.fromkeys(wanted.values())])
            yield {name: table[column].to_numpy() for name, column in wanted.items()}

    def column(self, name: str) -> np.ndarray:
        """A whole column, shape (variants,).

        Raises:
            ValueError: for an unknown column.
        """
        return np.concatenate([batch[name] for batch in self.batches([name])])

    def values(self, *columns: str | Column) -> dict[Column, np.ndarray]:
        """Values of whole columns by column, for figures, shape (variants,) each.

        Raises:
            ValueError: for an unknown column.
        """
        wanted = [of if isinstance(of, Column) else self.find(of) for of in columns]
        return {column: self.column(column.name) for column in wanted}

    def failures(self) -> int:
        """Number of variants that failed."""
        return sum(int(np.sum(~batch[CONVERGED])) for batch in self.batches([CONVERGED]))

    def causes(self) -> dict[Status, int]:
        """Number of failed variants by reason, most frequent first; empty without failures or without reasons."""
        if STATUS not in self.names:
            return {}
        counts: Counter[str] = Counter()
        for batch in self.batches([STATUS]):
            counts.update(dict(zip(*np.unique(batch[STATUS].astype(str), return_counts=True))))
        by_status = {Status[name.upper()]: int(count) for name, count in counts.most_common()}
        return {status: count for status, count in by_status.items() if status is not Status.CONVERGED}

    def why(self, pairs: int | None = None) -> str:
        """Most frequent reason of failures with its remedy; "" without failures.

        Args:
            pairs: number of tooth pairs of the mesh; None if unknown.
        """
        causes = self.causes()
        return explanation(causes, len(self), "variants", pairs) if causes else ""

    def best(self, count: int = 10, *, by: str | None = None) -> "SweepTable":
        """The best variants, best first, without failed ones.

        Args:
            count: largest number of variants.
            by: column of the ranking; None for the first result. The column defines if larger values are better.

        Raises:
            ValueError: for an unknown column.
        """
        column = self.find(self.results[0] if by is None else by)
        ranked = ((numbers, values[:, 0]) for numbers, values in self._ranked([column]))
        return self.take(smallest(ranked, count))

    def pareto(self, by: Sequence[str]) -> "SweepTable":
        """Pareto front of the variants in several columns, sorted by the first column.

        Args:
            by: two or three columns. Of variants with equal values in all of them the first is kept.

        Raises:
            ValueError: for an unknown column, or another number of them.
        """
        columns = [self.find(name) for name in by]
        if len(set(columns)) != len(columns) or not 2 <= len(columns) <= 3:
            raise ValueError("SweepTable.pareto: needs two or three different columns")
        return self.take(front(self._ranked(columns)))

    def take(self, numbers: Sequence[int] | np.ndarray) -> "SweepTable":
        """Table in memory of the rows with given numbers, in this order."""
        import pyarrow

        numbers = np.asarray(numbers, np.int64)
        pieces, first = [], 0
        for part, count in enumerate(self._sizes):
            inside = np.sort(numbers[(numbers >= first) & (numbers < first + count)])
            if len(inside) or part == 0:
                pieces.append(self._read(part, None).take(inside - first))
            first += count
        table = pyarrow.concat_tables(pieces).take(np.argsort(np.argsort(numbers)))
        return in_memory(self.title, self.columns, [table])

    def designs(self) -> list[dict[str, float]]:
        """Parameters of every row, ready for the `design` of the sweep."""
        rows = zip(*(self.column(name).tolist() for name in self.parameters))
        return [dict(zip(self.parameters, row)) for row in rows]

    def to_arrow(self) -> Any:
        """The whole table as a `pyarrow.Table`; the metadata of its fields hold unit, kind and range."""
        import pyarrow

        return pyarrow.Table.from_batches(self._stream(), self._schema)

    def to_pandas(self) -> Any:
        """The whole table as a `pandas.DataFrame`; `attrs` hold the title and the units of the columns."""
        frame = self.to_arrow().to_pandas()
        frame.attrs = {"title": self.title, "units": self.units}
        return frame

    def to_xarray(self) -> Any:
        """The whole table as an `xarray.Dataset` over the variants; attributes hold title, units and ranges."""
        import xarray

        variables = {}
        for column in self.columns:
            notes = {"units": column.unit, "low": column.low, "high": column.high}
            kept = {key: value for key, value in notes.items() if value is not None}
            variables[column.name] = ((VARIANT,), self.column(column.name), kept)
        return xarray.Dataset(variables, attrs={"title": self.title})

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """The table as an Arrow stream, for `polars.DataFrame(table)` or `pyarrow.table(table)`."""
        import pyarrow

        reader = pyarrow.RecordBatchReader.from_batches(self._schema, self._stream())
        return reader.__arrow_c_stream__(requested_schema)

    def to_csv(self, path: str | Path) -> None:
        """Write all rows as CSV with the units in the header; cells of failed results are empty."""
        from pyarrow import csv

        quoted = (as_text(column.named).replace('"', '""') for column in self.columns)
        header = ",".join(f'"{heading}"' for heading in quoted)

        def write(file):
            file.write(f"{header}\n".encode())
            for part in range(len(self._sizes)):
                csv.write_csv(self._read(part, None), file, csv.WriteOptions(include_header=False))

        write_durably(Path(path), write)

    def __str__(self) -> str:
        count = len(self)
        lines = [f"SweepTable {self.title}: {count} variants, {self.failures()} failed", *filter(None, [self.why()])]
        head = next(self.batches(), {}) if count else {}
        cells = [[c.named, *(_text(value) for value in head[c.name][:_SHOWN])] for c in self.columns if head]
        widths = [max(map(len, column)) for column in cells]
        lines += ["  ".join(cell.rjust(width) for cell, width in zip(row, widths)) for row in zip(*cells)]
        return "\n".join([*lines, "..."] if count > _SHOWN else lines)

    @property
    def _schema(self):
        return self._read(0, None).schema

    def _stream(self) -> Iterator[Any]:
        """The rows as Arrow batches, one part after the other in memory."""
        for part in range(len(self._sizes)):
            yield from self._read(part, None).to_batches()

    def _ranked(self, columns: Sequence[Column]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Row numbers and values of the columns, turned so that small is better, NaN where the variant failed."""
        signs = np.array([column.sign for column in columns], float)
        first = 0
        for batch in self.batches([*dict.fromkeys([*(column.name for column in columns), CONVERGED])]):
            values = np.stack([batch[column.name].astype(float) for column in columns], axis=1) * signs
            values[~batch[CONVERGED]] = math.nan
            yield first + np.arange(len(values)), values
            first += len(values)


def in_memory(title: str, columns: Sequence[Column], tables: Sequence[Any]) -> SweepTable:
    """Sweep table from Arrow tables in memory."""
    sizes = [len(table) for table in tables]
    return SweepTable(
        title, columns, sizes, lambda part, names: tables[part] if names is None else tables[part].select(names)
    )


def open_sweep(folder: str | Path) -> SweepTable:
    """Open the table of a finished sweep and read it once to check that it is undamaged.

    Args:
        folder: the output of a sweep.

    Raises:
        ValueError: when the folder holds no sweep, or one that is not complete.
    """
    folder = Path(folder)
    manifest = load_manifest(folder)
    store = Store(folder, manifest)
    paths = store.found()
    unsound = store.unsound(paths.values())
    missing = store.parts - len(set(range(store.parts)) & set(paths))
    problems = [f"{missing} of {store.parts} parts are missing"] if missing else []
    problems += [f"{path.name} is damaged or displaced" for path in unsound[:1]]
    if problems:
        raise ValueError(f"{folder}: is not complete, {' and '.join(problems)}: repeat the sweep to complete it")
    sizes = [stop - start for start, stop in map(store.span, range(store.parts))]
    return SweepTable(manifest.title, manifest.columns, sizes, lambda part, names: _stored(paths[part], names))


def _stored(path: Path, names: Sequence[str] | None):
    import pyarrow
    import pyarrow.parquet as parquet

    try:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            return file.read(names)
    except (OSError, pyarrow.ArrowException):
        raise ValueError(f"{path}: is damaged or missing: repeat the sweep to complete it") from None


def _text(value) -> str:
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)
