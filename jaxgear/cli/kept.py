"""Results of long computations, kept until all of them are there: after Ctrl-C the same command goes on from them."""

import dataclasses
import hashlib
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import jax
import jax.numpy as jnp
import numpy as np

from ..dynamics import SpeedResponse
from ..io import writing
from . import interrupt
from .version import version

_PAIR = "state"  # a field of two arrays


class Kept:
    """Speed responses on the disk, by the digest of what they were made of.

    Args:
        folder: where they lie, beside the results; it goes when these are complete.
        total: how many there will be.
    """

    def __init__(self, folder: Path, total: int):
        self._folder, self._total, self._done = folder, total, 0

    def __call__(self, made_of: Any, make: Callable[[], SpeedResponse]) -> SpeedResponse:
        """The response that is there, or that is made and then kept.

        Args:
            made_of: a pytree of all that it depends on.
            make: makes it.
        """
        path = self._folder / f"{_digest(made_of)}.npz"
        found = _read(path)
        if found is None:
            found = jax.block_until_ready(make())
            with writing(path):
                self._folder.mkdir(parents=True, exist_ok=True)
                _write(path, found)
        self._done += 1
        there = f"{self._done} of {self._total} runs are kept in {self._folder}{os.sep}"
        interrupt.note(f"{there}, go on with the same command")
        return found

    def remove(self) -> None:
        """All is in the results now."""
        shutil.rmtree(self._folder, ignore_errors=True)


def _digest(tree: Any) -> str:
    leaves, structure = jax.tree.flatten(tree)
    digest = hashlib.sha256(f"{version()} {jax.__version__} {structure}".encode())
    for leaf in leaves:
        array = np.asarray(leaf)
        digest.update(f"{array.dtype}{array.shape}".encode() + array.tobytes())
    return digest.hexdigest()


def _write(path: Path, response: SpeedResponse) -> None:
    fields = {field.name: getattr(response, field.name) for field in dataclasses.fields(response)}
    displacement, velocity = fields.pop(_PAIR)
    arrays: dict[str, Any] = {name: np.asarray(value) for name, value in fields.items()}
    temporary = path.with_suffix(".part")
    with temporary.open("wb") as file:
        np.savez(file, displacement=np.asarray(displacement), velocity=np.asarray(velocity), **arrays)
    temporary.replace(path)


def _read(path: Path) -> SpeedResponse | None:
    try:
        with np.load(path) as file:
            data: dict[str, Any] = dict(file)
        orders = tuple(data.pop("orders").tolist())
        direction: Any = str(data.pop("direction"))
        arrays: dict[str, Any] = {name: jnp.asarray(value) for name, value in data.items()}
        arrays[_PAIR] = arrays.pop("displacement"), arrays.pop("velocity")
        return SpeedResponse(**arrays, orders=orders, direction=direction)
    except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile):  # not there, or torn
        return None
