"""Numbers of gears on the disk: by shape and version, whole or not there, a damaged file made again."""

import io
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...numerics.durable import FileStore, user_folder
from .build import VERSION, GearNumbers
from .shape import Shape


def default_folder() -> Path | None:
    """Folder of the user's cache; None where there is none."""
    return user_folder("jaxgear", "compliance")


def cached(folder: Path | None, shape: Shape, build: Callable[[Shape], GearNumbers]) -> GearNumbers:
    """The numbers of a gear from the disk, or made and kept there; without a folder made.

    Raises:
        ValueError: for a folder that cannot be made.
    """
    if folder is None:
        return build(shape)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"cache = {str(folder)!r}: {error.strerror}") from error
    files = FileStore(folder, f"finite elements {VERSION}".encode())
    made_of = json.dumps(shape.numbers).encode()
    content = files.read(made_of)
    if content is not None:
        with np.load(io.BytesIO(content)) as arrays:
            return GearNumbers(*(arrays[name] for name in GearNumbers._fields))
    numbers = build(shape)
    written = io.BytesIO()
    np.savez(written, **numbers._asdict())
    files.write(made_of, written.getvalue())
    return numbers
