"""A result folder that appears complete or not at all."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# A folder that holds anything else is not an earlier result and is never replaced.
RESULT_FILES = frozenset(
    {
        "summary.json",
        "flanks.csv",
        "front.csv",
        "front.png",
        "convergence.png",
        "iterations_relief.png",
        "iterations_transmission_error.png",
        "response_surface.png",
        "transmission_error.png",
        "load_sharing.png",
        "pressure.png",
        "ppte_over_torque.png",
        "harris_map.png",
        "k_chart.png",
    }
)


@contextmanager
def result_folder(target: str | Path) -> Iterator[Path]:
    """A temporary folder beside `target` that takes its place when the block ends without an exception.

    An earlier result in `target` is replaced. After an exception or an interruption nothing is left behind and an
    earlier result is untouched.

    Args:
        target: folder of the results.

    Raises:
        ValueError: when the target is a file or a folder with other content, or cannot be written.
    """
    target = Path(target)
    _check_target(target)
    parent = target.absolute().parent
    missing = [folder for folder in (parent, *parent.parents) if not folder.exists()]
    try:
        parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".tmp", dir=parent))
    except OSError as error:
        _remove_empty(missing)
        raise ValueError(f"{target}: cannot be written: {error.strerror or error}") from None
    try:
        yield temporary
        _replace(temporary, target)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        _remove_empty(missing)
        raise


def _check_target(target: Path) -> None:
    try:
        if not target.exists() and not target.is_symlink():
            return
        if not target.is_dir():
            raise ValueError(f"{target}: is a file, not a folder")
        others = sorted(entry.name for entry in target.iterdir() if entry.name not in RESULT_FILES)
    except OSError as error:
        raise ValueError(f"{target}: cannot be written: {error.strerror or error}") from None
    if others:
        raise ValueError(f"{target}: holds other files than results ({others[0]}), choose another folder")
    if not os.access(target, os.W_OK):
        raise ValueError(f"{target}: cannot be written: Permission denied")


def _replace(temporary: Path, target: Path) -> None:
    os.chmod(temporary, 0o777 & ~_umask())  # mkdtemp makes private folders, results are ordinary files
    target = target.resolve()  # a link to a folder keeps pointing at it
    try:
        if not target.exists():
            temporary.rename(target)
            return
        earlier = Path(f"{temporary}.earlier")
        target.rename(earlier)
        try:
            temporary.rename(target)
        except BaseException:
            earlier.rename(target)
            raise
        shutil.rmtree(earlier, ignore_errors=True)
    except OSError as error:
        raise ValueError(f"{target}: cannot be written: {error.strerror or error}") from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:
            return
