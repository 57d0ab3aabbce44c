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
    """How results become named arrays and results again."""

    def arrays(self, found: R) -> dict[str, Any]:
        """All that a result holds."""

    def result(self, arrays: dict[str, Any]) -> R:
        """The result; raises `KeyError`, `TypeError` or `ValueError` for other arrays."""


class NamedArrays:
    """Results that are arrays by name, as they are."""

    def arrays(self, found: Mapping[str, Any]) -> dict[str, Any]:
        """All of them."""
        return dict(found)

    def result(self, arrays: dict[str, Any]) -> Mapping[str, Any]:
        """The arrays."""
        return arrays


class SpeedResponses:
    """Speed responses as arrays."""

    def arrays(self, found: SpeedResponse) -> dict[str, Any]:
        """All that a response holds."""
        fields = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
        displacement, velocity = fields.pop(_PAIR)
        return {"displacement": displacement, "velocity": velocity, **fields}

    def result(self, arrays: dict[str, Any]) -> SpeedResponse:
        """The response."""
        orders = tuple(arrays.pop("orders").tolist())
        direction: Any = str(arrays.pop("direction"))
        known: dict[str, Any] = {name: jnp.asarray(value) for name, value in arrays.items()}
        known[_PAIR] = known.pop("displacement"), known.pop("velocity")
        return SpeedResponse(**known, orders=orders, direction=direction)


class Marches:
    """Blocks of wear as arrays."""

    def arrays(self, found: March) -> dict[str, Any]:
        """All that they hold."""
        return {"depth": found.depth, "error": found.error, "march_status": found.status, **found.seen}

    def result(self, arrays: dict[str, Any]) -> March:
        """The blocks."""
        known = {name: jnp.asarray(value) for name, value in arrays.items()}
        return March(known.pop("depth"), known.pop("error"), known.pop("march_status"), known)


class Checkpoints:
    """Results of a study in a folder, each under the digest of what it was made of.

    Args:
        folder: folder of the results, made with the first one; None keeps nothing.
        callback: called after every result with the number of results of its kind so far and in all, None if unknown.
    """

    def __init__(
        self, folder: str | Path | None = None, callback: Callable[[int, int | None], None] | None = None
    ) -> None:
        self.folder = None if folder is None else Path(folder)
        self._callback, self._used = callback, False

    def of(self, codec: Codec[R], total: int | None = None) -> "CheckpointsOfKind[R]":
        """The checkpoints of one kind of result.

        Args:
            codec: of the results; `NamedArrays()` for arrays by name.
            total: how many there will be; None where it is not known.
        """
        return CheckpointsOfKind(self, codec, total)

    def count(self) -> int:
        """How many results an interrupted study has left.

        Raises:
            ValueError: when the folder cannot be read.
        """
        if self.folder is None:
            return 0
        with writing(self.folder):
            there = self.folder.iterdir() if self.folder.is_dir() else ()
            return sum(not path.name.startswith(".") for path in there)

    def told(self, done: int, total: int | None) -> None:
        """Tells the callback."""
        self._used = True
        if self._callback is not None and self.folder is not None:
            self._callback(done, total)

    def remove(self) -> None:
        """Removes what this study has kept: all of it is in its results now."""
        if self._used and self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


class CheckpointsOfKind(Generic[R]):
    """Results of one kind; made by `Checkpoints.of`."""

    def __init__(self, checkpoints: Checkpoints, codec: Codec[R], total: int | None) -> None:
        self._checkpoints, self._codec, self._total, self._done = checkpoints, codec, total, 0

    def __call__(self, made_of: object, make: Callable[[], R]) -> R:
        """The result that is there, or that is made and then kept.

        Args:
            made_of: a pytree of all that it depends on.
            make: makes it.

        Raises:
            ValueError: when it cannot be written.
        """
        folder = self._checkpoints.folder
        path = None if folder is None else folder / _digest(made_of)
        found = None if path is None else self._read(path)
        if found is None:
            found = jax.block_until_ready(make())
            if path is not None:
                self._write(path, found)
        self._done += 1
        self._checkpoints.told(self._done, self._total)
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
        except OSError:  # not there
            return None
        if content is None:  # torn, or no longer what was written
            return None
        with np.load(io.BytesIO(content)) as file:
            return self._codec.result(dict(file))


def _digest(tree: Any) -> str:
    leaves, structure = jax.tree.flatten(tree)
    return digest(f"{version()} {jax.__version__} {structure}", leaves)
