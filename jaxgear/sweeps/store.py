"""The folder of a sweep: Parquet files and nothing else, so that whatever reads a folder of Parquet reads it.

The manifest is a file without rows: its schema holds the columns with their units, the title and everything that
determines the rows. A resumed sweep goes on with the same ones or is refused. A part is written under a temporary name,
flushed to the disk and renamed: whatever ends the process, no part is ever half there. Its name ends with a digest of
the sweep, of its place in it and of its bytes, so that a part which is damaged, displaced or of another sweep is known
as such, and its variants are evaluated again.
"""

import hashlib
import json
import logging
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..contact.status import Status
from ..numerics.durable import digest, write_durably
from .columns import CONVERGED, STATUS, VARIANT, Column, described

MANIFEST = "_sweep.parquet"  # Arrow and Spark pass over such names, others find no row in it
_PART = re.compile(r"part-(\d+)-[0-9a-f]+\.parquet")
_LEFTOVER = re.compile(r"\.part-(\d+)-.*\.tmp")

# numbers of a column by what its notes call them
_NUMBERS = {"torque_Nm": "torque", "speed_rpm": "speed", "low": "low", "high": "high"}

_STATUSES = [status.name.lower() for status in Status]  # by their numbers

_log = logging.getLogger("jaxgear")


class Manifest(NamedTuple):
    """Description of a sweep.

    Attributes:
        title: free text.
        columns: columns of the table.
        settings: everything that determines the rows, as plain data; `variants` and `part_rows` among it.
    """

    title: str
    columns: tuple[Column, ...]
    settings: Mapping[str, Any]


class Store:
    """Parts of a sweep in a folder.

    Attributes:
        folder: folder of the sweep.
        manifest: description of the sweep.
    """

    def __init__(self, folder: str | Path, manifest: Manifest) -> None:
        self.folder, self.manifest = Path(folder), manifest
        self._variants, self._part_rows = (int(manifest.settings[key]) for key in ("variants", "part_rows"))
        self._schema = _schema(manifest)
        self._fingerprint = digest(json.dumps(manifest.settings, sort_keys=True))

    @property
    def parts(self) -> int:
        """Number of parts of the complete sweep."""
        return -(-self._variants // self._part_rows)

    def span(self, part: int) -> tuple[int, int]:
        """Range of the variants of a part: first variant, and end (exclusive)."""
        return part * self._part_rows, min((part + 1) * self._part_rows, self._variants)

    def claim(self, *, leader: bool) -> None:
        """Take the folder for this sweep; the leader of several processes writes the manifest.

        Raises:
            ValueError: if the folder cannot be written, has other contents, or a sweep of other settings.
        """
        try:
            _check_folder(self.folder)
            if not (self.folder / MANIFEST).exists():
                if leader:
                    self.folder.mkdir(parents=True, exist_ok=True)
                    data = _parquet(self._schema.empty_table())
                    write_durably(self.folder / MANIFEST, lambda file: file.write(data))
                return
        except OSError as error:
            raise ValueError(f"{self.folder}: cannot be written: {error.strerror or error}") from None
        there = load_manifest(self.folder)
        earlier, now = there.settings, self.manifest.settings
        changed = [key for key in sorted({*earlier, *now}) if earlier.get(key) != now.get(key)]
        if changed:
            raise ValueError(f"{self.folder}: holds a sweep of other settings ({', '.join(changed)}), delete it or "
                             "choose another folder")  # fmt: skip
        self.manifest, self._schema = there, _schema(there)  # all parts have one title and one set of units

    def found(self) -> dict[int, Path]:
        """Paths of the parts in the folder by part number, without a check, see `unsound`."""
        matches = ((_PART.fullmatch(path.name), path) for path in sorted(self.folder.iterdir()))
        return {int(match[1]): path for match, path in matches if match}

    def unsound(self, paths: Iterable[Path]) -> list[Path]:
        """Paths of parts that are damaged, displaced or of another sweep."""
        return [path for path in paths if not self._is_sound(path)]

    def clean(self, parts: range) -> None:
        """Delete temporary files of killed processes and damaged files, for the parts of this process."""
        for path in sorted(self.folder.iterdir()):
            leftover, part = _LEFTOVER.fullmatch(path.name), _PART.fullmatch(path.name)
            if leftover and int(leftover[1]) in parts:
                path.unlink(missing_ok=True)
            if part and int(part[1]) in parts and not self._is_sound(path):
                _log.warning("%s: is damaged or displaced, its variants are evaluated again", path)
                path.unlink(missing_ok=True)

    def write(self, part: int, columns: Mapping[str, np.ndarray]) -> None:
        """Write a part.

        Raises:
            ValueError: when the disk is full or the folder is gone.
        """
        data = _parquet(self.table(part, columns))
        path = self._path(part, data)
        try:
            write_durably(path, lambda file: file.write(data))
        except OSError as error:
            raise ValueError(f"{path}: cannot be written: {error.strerror or error}") from None

    def table(self, part: int, columns: Mapping[str, np.ndarray]) -> Any:
        """A part as an Arrow table; numbers of failed variants are null."""
        import pyarrow

        values = {VARIANT: np.arange(*self.span(part)), **columns}
        failed = not values[CONVERGED].all()
        if STATUS in values:
            numbers = pyarrow.array(values[STATUS], pyarrow.int8())
            values[STATUS] = pyarrow.DictionaryArray.from_arrays(numbers, _STATUSES)
        arrays = [pyarrow.array(values[field.name], field.type, from_pandas=failed) for field in self._schema]
        return pyarrow.Table.from_arrays(arrays, schema=self._schema)

    def _path(self, part: int, data) -> Path:
        found = hashlib.sha256(f"{self._fingerprint} {part} ".encode())
        found.update(data)
        return self.folder / f"part-{part:07d}-{found.hexdigest()[:16]}.parquet"

    def _is_sound(self, path: Path) -> bool:
        part = _PART.fullmatch(path.name)
        try:
            return part is not None and path == self._path(int(part[1]), path.read_bytes())
        except OSError:  # it cannot be read
            return False


def load_manifest(folder: Path) -> Manifest:
    """Reads the manifest of a folder.

    Raises:
        ValueError: when there is none, or none that can be trusted.
    """
    import pyarrow
    import pyarrow.parquet as parquet

    path = Path(folder) / MANIFEST
    try:
        with path.open("rb") as file:  # what the system says of a missing file, not what Arrow says
            schema = parquet.read_schema(file)
    except OSError as error:
        raise ValueError(f"{folder}: is not a sweep: {MANIFEST}: {error.strerror or 'is damaged'}") from None
    except pyarrow.ArrowException:
        raise ValueError(f"{folder}: is not a sweep: {MANIFEST}: is damaged") from None
    try:
        notes = {key.decode(): value.decode() for key, value in schema.metadata.items()}
        manifest = Manifest(notes["title"], tuple(map(_column, schema)), json.loads(notes["sweep"]))
        if not _schema(manifest).equals(schema, check_metadata=True):
            raise ValueError
        Store(folder, manifest)
    except (ValueError, KeyError, TypeError, AttributeError):
        raise ValueError(f"{folder}: is not a sweep: {MANIFEST}: is damaged, or of another version") from None
    return manifest


def _schema(manifest: Manifest):
    """Arrow schema with the quantities and ranges at the columns, and the sweep itself at the table."""
    import pyarrow

    words = pyarrow.dictionary(pyarrow.int8(), pyarrow.string())
    types = {"number": pyarrow.int64(), "flag": pyarrow.bool_(), "status": words}
    fields = []
    for column in manifest.columns:
        of = column.quantity
        notes = {"unit": of.unit, "kind": column.kind, "better": column.better, "statistic": column.statistic}
        notes |= {"quantity": of.name, "label": of.label, "meaning": of.meaning, "form": of.form}
        numbers = {note: getattr(column, name) for note, name in _NUMBERS.items()}
        notes |= {note: repr(number) for note, number in numbers.items() if number is not None}
        kept = {key: value for key, value in notes.items() if value or key == "unit"}
        fields.append(pyarrow.field(column.name, types.get(column.kind, pyarrow.float64()), metadata=kept))
    settings = manifest.settings
    notes = {"title": manifest.title, "sweep": json.dumps(settings, sort_keys=True)}
    for key in ("jaxgear", "plan", "torques_Nm", "weights"):
        if key in settings:
            value = settings[key]
            notes[key] = value if isinstance(value, str) else json.dumps(value, sort_keys=True)
    plain = [[column.name, *sorted(field.metadata.items())] for column, field in zip(manifest.columns, fields)]
    everything = json.dumps([notes, str(plain)], sort_keys=True)
    return pyarrow.schema(fields, metadata={**notes, "fingerprint": digest(everything)})


def _column(field) -> Column:
    """A column of the table from the field that `_schema` makes of it."""
    notes = {key.decode(): value.decode() for key, value in field.metadata.items()}
    texts = {name: notes.get(name, "") for name in ("label", "meaning", "form")}
    quantity = described(notes["quantity"], notes["unit"], better=notes.get("better", "smaller"), **texts)
    numbers = {name: float(notes[note]) for note, name in _NUMBERS.items() if note in notes}
    return Column(quantity, notes["kind"], statistic=notes.get("statistic", ""), **numbers)


def _parquet(table) -> memoryview:
    """A table as the bytes of a file."""
    import pyarrow
    import pyarrow.parquet as parquet

    file = pyarrow.BufferOutputStream()
    # these numbers never repeat and do not compress well: a fast codec, no dictionary
    options = {"compression": "zstd", "compression_level": 1, "use_dictionary": False, "write_page_checksum": True}
    parquet.write_table(table, file, **options)
    return memoryview(file.getvalue())


def _check_folder(folder: Path) -> None:
    if not folder.exists() and not folder.is_symlink():
        return
    if not folder.is_dir():
        raise ValueError(f"{folder}: is a file, not a folder")
    others = sorted(entry.name for entry in folder.iterdir() if not entry.name.startswith(f".{MANIFEST}."))
    if others and MANIFEST not in others:
        raise ValueError(f"{folder}: holds other files than a sweep ({others[0]}), choose another folder")
    if not os.access(folder, os.W_OK):
        raise ValueError(f"{folder}: cannot be written: Permission denied")
