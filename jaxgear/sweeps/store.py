"""The folder of a sweep: a manifest, and parts that are complete or absent.

A part is written under a temporary name, flushed to the disk and renamed: whatever ends the process, no part is ever
half there. What determines the rows stands in the manifest, so that a resumed sweep goes on with the same ones or is
refused.
"""

import hashlib
import json
import os
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from .columns import CONVERGED, VARIANT, Column

MANIFEST = "sweep.json"
_TEMPORARY = ".tmp"


class Store:
    """Parts of a sweep in a folder.

    Attributes:
        folder: where they lie.
        manifest: what the sweep is, as plain data.
    """

    def __init__(self, folder: str | Path, manifest: Mapping[str, Any]):
        self.folder, self.manifest = Path(folder), manifest
        self._fingerprint = fingerprint(manifest["settings"])
        self._schema = schema([Column(**column) for column in manifest["columns"]], manifest, self._fingerprint)

    @property
    def parts(self) -> int:
        """Number of parts of the complete sweep."""
        return -(-self.manifest["variants"] // self.manifest["part_rows"])

    def span(self, part: int) -> tuple[int, int]:
        """Variants of a part: the first, and the one after the last."""
        rows = self.manifest["part_rows"]
        return part * rows, min((part + 1) * rows, self.manifest["variants"])

    def path(self, part: int) -> Path:
        """Where a part lies."""
        return self.folder / f"part-{part:07d}.parquet"

    def claim(self, *, leader: bool) -> None:
        """Makes the folder that of this sweep; the leader of several processes writes the manifest.

        Raises:
            ValueError: when the folder cannot be written, holds something else, or a sweep of other settings.
        """
        try:
            _check_folder(self.folder)
            if not (self.folder / MANIFEST).exists():
                if leader:
                    self.folder.mkdir(parents=True, exist_ok=True)
                    text = json.dumps(self.manifest, indent=2, ensure_ascii=False)
                    write_durably(self.folder / MANIFEST, lambda file: file.write(text.encode()))
                return
        except OSError as error:
            raise ValueError(f"{self.folder}: cannot be written: {error.strerror or error}") from None
        earlier, now = load_manifest(self.folder)["settings"], self.manifest["settings"]
        changed = [key for key in sorted({*earlier, *now}) if earlier.get(key) != now.get(key)]
        if changed:
            raise ValueError(f"{self.folder}: holds a sweep of other settings ({', '.join(changed)}), delete it or "
                             "choose another folder")  # fmt: skip

    def is_there(self, part: int) -> bool:
        """Whether a part is complete and belongs to this sweep."""
        import pyarrow
        import pyarrow.parquet as parquet

        try:
            found = parquet.read_metadata(self.path(part))
        except (OSError, pyarrow.ArrowException):  # absent, or torn by something else than this program
            return False
        start, stop = self.span(part)
        return found.num_rows == stop - start and (found.metadata or {}).get(b"fingerprint") == self._fingerprint

    def remove_leftovers(self, parts: range) -> None:
        """Deletes what killed processes left of parts that are this process's to write."""
        for path in self.folder.glob(f".part-*{_TEMPORARY}"):
            number = path.name[len(".part-") :].partition(".")[0]
            if number.isdigit() and int(number) in parts:
                path.unlink(missing_ok=True)

    def write(self, part: int, columns: Mapping[str, np.ndarray]) -> None:
        """Writes a part.

        Raises:
            ValueError: when the disk is full or the folder is gone.
        """
        import pyarrow.parquet as parquet

        table = self.table(part, columns)
        try:
            write_durably(
                self.path(part),
                # these numbers never repeat and hardly compress: a fast codec, no dictionary
                lambda file: parquet.write_table(
                    table, file, compression="zstd", compression_level=1, use_dictionary=False, write_page_checksum=True
                ),
            )
        except OSError as error:
            raise ValueError(f"{self.path(part)}: cannot be written: {error.strerror or error}") from None

    def table(self, part: int, columns: Mapping[str, np.ndarray]):
        """A part as an Arrow table; numbers of failed variants are null."""
        import pyarrow

        values = {VARIANT: np.arange(*self.span(part)), **columns}
        failed = not values[CONVERGED].all()
        arrays = [pyarrow.array(values[field.name], field.type, from_pandas=failed) for field in self._schema]
        return pyarrow.Table.from_arrays(arrays, schema=self._schema)


def make_manifest(
    columns: Sequence[Column], *, title: str, variants: int, part_rows: int, settings: Mapping[str, Any]
) -> dict[str, Any]:
    """Contents of the manifest."""
    return {
        "title": title,
        "variants": variants,
        "part_rows": part_rows,
        "columns": [asdict(column) for column in columns],
        "settings": {**settings, "variants": variants, "part_rows": part_rows},
    }


def load_manifest(folder: Path) -> dict[str, Any]:
    """Reads the manifest of a folder.

    Raises:
        ValueError: when there is none.
    """
    try:
        manifest = json.loads((Path(folder) / MANIFEST).read_text(encoding="utf-8"))
        return {key: manifest[key] for key in ("title", "variants", "part_rows", "columns", "settings")}
    except OSError as error:
        raise ValueError(f"{folder}: is not a sweep: {MANIFEST}: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"{folder}: is not a sweep: {MANIFEST} is not readable") from None


def fingerprint(settings: Mapping[str, Any]) -> bytes:
    """Digest of the settings."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest().encode()


def schema(columns: Sequence[Column], manifest: Mapping[str, Any], digest: bytes):
    """Arrow schema with units and ranges at the columns, and the sweep itself at the table."""
    import pyarrow

    types = {"number": pyarrow.int64(), "flag": pyarrow.bool_()}
    fields = []
    for column in columns:
        notes = {"unit": column.unit, "kind": column.kind, "better": column.better}
        if column.low is not None and column.high is not None:
            notes |= {"low": repr(column.low), "high": repr(column.high)}
        kept = {key: value for key, value in notes.items() if value or key == "unit"}
        fields.append(pyarrow.field(column.name, types.get(column.kind, pyarrow.float64()), metadata=kept))
    settings = manifest["settings"]
    notes = {"title": manifest["title"], "fingerprint": digest.decode(), "sweep": json.dumps(settings)}
    for key in ("jaxgear", "plan", "torques_Nm", "weights"):
        if key in settings:
            value = settings[key]
            notes[key] = value if isinstance(value, str) else json.dumps(value)
    return pyarrow.schema(fields, metadata=notes)


def write_durably(path: Path, write) -> None:
    """Lets `write(file)` fill a temporary file that takes the place of `path` once it is on the disk."""
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex}{_TEMPORARY}")
    try:
        with temporary.open("wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    if os.name == "posix":  # the new name, too, has to reach the disk
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


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
