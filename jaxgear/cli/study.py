"""Results on the disk until all of them are there."""

import dataclasses
import hashlib
import io
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from ..dynamics import SpeedResponse
from ..io import writing
from ..numerics.durable import sealed, unsealed, write_durably
from ..studies.evaluation import face_change as face_change
from ..studies.evaluation import grid_lines as grid_lines
from ..wear import March
from . import interrupt
from .version import version

_Found = TypeVar("_Found")

_PAIR = "state"  # a field of two arrays


class Codec(Protocol[_Found]):
    """How results become named arrays and results again."""

    def arrays(self, found: _Found) -> dict[str, Any]:
        """All that a result holds."""

    def result(self, arrays: dict[str, Any]) -> _Found:
        """The result; raises `KeyError`, `TypeError` or `ValueError` for other arrays."""


class Kept(Generic[_Found]):
    """Results on the disk, by the digest of what they were made of.

    Args:
        folder: where they lie, beside the results; it goes when these are complete.
        codec: of the results.
        total: how many there will be; None where it is not known.
    """

    def __init__(self, folder: Path, codec: Codec[_Found], total: int | None = None):
        self._folder, self._codec, self._total, self._done = folder, codec, total, 0

    def __call__(self, made_of: Any, make: Callable[[], _Found]) -> _Found:
        """The result that is there, or that is made and then kept.

        Args:
            made_of: a pytree of all that it depends on.
            make: makes it.
        """
        path = self._folder / _digest(made_of)
        found = self._read(path)
        if found is None:
            found = jax.block_until_ready(make())
            with writing(path):
                self._folder.mkdir(parents=True, exist_ok=True)
                self._write(path, found)
        self._done += 1
        of_all = "" if self._total is None else f" of {self._total}"
        _note(f"{self._done}{of_all}", self._folder)
        return found

    def _write(self, path: Path, found: _Found) -> None:
        arrays: dict[str, Any] = {name: np.asarray(value) for name, value in self._codec.arrays(found).items()}
        content = io.BytesIO()
        np.savez(content, **arrays)
        write_durably(path, lambda file: file.write(sealed(content.getvalue())))

    def _read(self, path: Path) -> _Found | None:
        try:
            content = unsealed(path.read_bytes())
        except OSError:  # not there
            return None
        if content is None:  # torn, or no longer what was written
            return None
        with np.load(io.BytesIO(content)) as file:
            return self._codec.result(dict(file))

    def remove(self) -> None:
        """All is in the results now."""
        shutil.rmtree(self._folder, ignore_errors=True)


def runs_beside(target: Path) -> Path:
    """Where results are kept until those of a folder are there."""
    return target.with_name(f".{target.name}.runs")


def note_runs(target: Path) -> None:
    """Tells of the results that an interrupted command has kept for a folder, where there are any."""
    folder = runs_beside(target)
    with writing(folder):
        there = sum(not path.name.startswith(".") for path in folder.iterdir()) if folder.is_dir() else 0
    if there:
        _note(str(there), folder)


def _note(count: str, folder: Path) -> None:
    interrupt.note(f"{count} runs are kept in {folder}{os.sep}, go on with the same command")


def _digest(tree: Any) -> str:
    leaves, structure = jax.tree.flatten(tree)
    digest = hashlib.sha256(f"{version()} {jax.__version__} {structure}".encode())
    for leaf in leaves:
        array = np.asarray(leaf)
        digest.update(f"{array.dtype}{array.shape}".encode() + array.tobytes())
    return digest.hexdigest()


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
        return {"depth": found.depth, "error": found.error, "known": found.known, **found.seen}

    def result(self, arrays: dict[str, Any]) -> March:
        """The blocks."""
        known = {name: jnp.asarray(value) for name, value in arrays.items()}
        return March(known.pop("depth"), known.pop("error"), known.pop("known"), known)
