"""Checkpoints: results of a study on disk until it is complete, from which an interrupted study resumes."""

import dataclasses
import io
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from ..dynamics import SpeedResponse
from ..io import writing
from ..numerics.durable import digest, sealed, unsealed, write_durably
from ..version import version
from ..wear import March

R = TypeVar("R")

_PAIR = "state"  # a field of two arrays


class Codec(Protocol[R]):
    """Conversion of a kind of result to named arrays and back."""

    def arrays(self, found: R) -> dict[str, Any]:
        """Arrays with the complete content of a result, by name."""

    def result(self, arrays: dict[str, Any]) -> R:
        """Result from its arrays; raises `KeyError`, `TypeError` or `ValueError` for arrays that do not fit."""


class NamedArrays:
    """Codec of results that are named arrays already."""

    def arrays(self, found: Mapping[str, Any]) -> dict[str, Any]:
        """Copy of the named arrays."""
        return dict(found)

    def result(self, arrays: dict[str, Any]) -> Mapping[str, Any]:
        """The named arrays, unchanged."""
        return arrays


class SpeedResponses:
    """Codec of speed responses."""

    def arrays(self, found: SpeedResponse) -> dict[str, Any]:
        """Arrays of all fields of a speed response, by name."""
        fields = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
        displacement, velocity = fields.pop(_PAIR)
        return {"displacement": displacement, "velocity": velocity, **fields}

    def result(self, arrays: dict[str, Any]) -> SpeedResponse:
        """Speed response from its arrays."""
        orders = tuple(arrays.pop("orders").tolist())
        direction: Any = str(arrays.pop("direction"))
        known: dict[str, Any] = {name: jnp.asarray(value) for name, value in arrays.items()}
        known[_PAIR] = known.pop("displacement"), known.pop("velocity")
        return SpeedResponse(**known, orders=orders, direction=direction)


class Marches:
    """Codec of blocks of wear."""

    def arrays(self, found: March) -> dict[str, Any]:
        """Arrays of wear depths, errors, status and contact results, by name."""
        return {"depth": found.depth, "error": found.error, "march_status": found.status, **found.seen}

    def result(self, arrays: dict[str, Any]) -> March:
        """Blocks of wear from their arrays."""
        known = {name: jnp.asarray(value) for name, value in arrays.items()}
        return March(known.pop("depth"), known.pop("error"), known.pop("march_status"), known)


class Checkpoints:
    """Intermediate results of a study in a folder, one file each, named by the digest of its inputs.

    Args:
        folder: folder of the files, made with the first one; None to store nothing.
        callback: called after every result with the number of results of its kind so far and the total, None if
            unknown.
    """

    def __init__(
        self, folder: str | Path | None = None, callback: Callable[[int, int | None], None] | None = None
    ) -> None:
        self.folder = None if folder is None else Path(folder)
        self._callback, self._used = callback, False

    def of(self, codec: Codec[R], total: int | None = None) -> "CheckpointsOfKind[R]":
        """Checkpoints of one kind of result.

        Args:
            codec: codec of the results; `NamedArrays()` for named arrays.
            total: number of results expected; None if unknown.
        """
        return CheckpointsOfKind(self, codec, total)

    def count(self) -> int:
        """Number of results stored by an interrupted study.

        Raises:
            ValueError: if the folder cannot be read.
        """
        if self.folder is None:
            return 0
        with writing(self.folder):
            there = self.folder.iterdir() if self.folder.is_dir() else ()
            return sum(not path.name.startswith(".") for path in there)

    def report(self, done: int, total: int | None) -> None:
        """Call the callback with the number of results so far and the total."""
        self._used = True
        if self._callback is not None and self.folder is not None:
            self._callback(done, total)

    def remove(self) -> None:
        """Remove the folder if this study has used it: the final results contain everything."""
        if self._used and self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


class CheckpointsOfKind(Generic[R]):
    """Checkpoints of one kind of result; made by `Checkpoints.of`."""

    def __init__(self, checkpoints: Checkpoints, codec: Codec[R], total: int | None) -> None:
        self._checkpoints, self._codec, self._total, self._done = checkpoints, codec, total, 0

    def __call__(self, made_of: object, make: Callable[[], R]) -> R:
        """Load a stored result, or compute and store it.

        Args:
            made_of: pytree of all inputs of the result.
            make: function that computes the result.

        Raises:
            ValueError: if the file cannot be written.
        """
        folder = self._checkpoints.folder
        path = None if folder is None else folder / _digest(made_of)
        found = None if path is None else self._read(path)
        if found is None:
            found = jax.block_until_ready(make())
            if path is not None:
                self._write(path, found)
        self._done += 1
        self._checkpoints.report(self._done, self._total)
        return found

    def _write(self, path: Path, found: R) -> None:
        arrays: dict[str, Any] = {name: np.asarray(value) for name, value in self._codec.arrays(found).items()}
        content = io.BytesIO()
        np.savez(content, **arrays)
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            write_durably(path, lambda file: file.write(sealed(content.getvalue())))

    def _read(self, path: Path) -> R | None:
        try:
            content = unsealed(path.read_bytes())
        except OSError:  # no such file
            return None
        if content is None:  # incomplete or changed file
            return None
        with np.load(io.BytesIO(content)) as file:
            return self._codec.result(dict(file))


def _digest(tree: Any) -> str:
    leaves, structure = jax.tree.flatten(tree)
    return digest(f"{version()} {jax.__version__} {structure}", leaves)
