"""A result folder that appears complete or not at all."""

import json
import os
import platform
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# key of summary.json: names of all files of the result. A folder that holds any other is never replaced.
CONTENTS = "contents"


@contextmanager
def result_folder(target: str | Path) -> Iterator[Path]:
    """A temporary folder beside `target` that takes its place when the block ends without an exception.

    An earlier result in `target` is replaced. After an exception or an interruption nothing is left behind and an
    earlier result is untouched. What a killed process left of the same target is removed by the next one.

    Args:
        target: folder of the results.

    Raises:
        ValueError: when the target is a file, a folder with other content or the one the caller is in, or cannot be
            written.
    """
    target = Path(target)
    _check_target(target)
    parent = target.absolute().parent
    missing = [folder for folder in (parent, *parent.parents) if not folder.exists()]
    temporary = None
    try:
        with writing(target):
            parent.mkdir(parents=True, exist_ok=True)
            _remove_leftovers(parent, target)
            mine = f".{target.name}.{_host()}-{os.getpid()}."
            temporary = Path(tempfile.mkdtemp(prefix=mine, suffix=".tmp", dir=parent))
            yield temporary
            _replace(temporary, target)
    except BaseException:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)
        _remove_empty(missing)
        raise


def earlier(target: str | Path) -> str:
    """Title, torque and number of figures of the results in a folder, in words; "" without results."""
    try:
        held = json.loads((Path(target) / "summary.json").read_text(encoding="utf-8"))
        torque = held.get("torque_Nm")
        load = f" at {torque:g} N m" if isinstance(torque, int | float) else ""
        figures = len(list(Path(target).glob("*.png")))
        return f"{str(held.get('title', 'no title'))!r}{load}, {figures} figures"
    except (OSError, ValueError, AttributeError):
        return ""


def _remove_leftovers(parent: Path, target: Path) -> None:
    """Removes temporary folders of a target whose process has ended; folders of other machines are left alone."""
    named = re.compile(rf"\.{re.escape(target.name)}\.{re.escape(_host())}-(\d+)\.[^.]+\.tmp(\.earlier)?")
    for path in parent.iterdir():
        match = named.fullmatch(path.name)
        # an earlier result that was being replaced is the only one until there is another
        if match and not _is_alive(int(match[1])) and (match[2] is None or target.exists()):
            shutil.rmtree(path, ignore_errors=True)


def _host() -> str:
    return re.sub(r"[^A-Za-z0-9_]", "_", platform.node())


def _is_alive(process: int) -> bool:
    """True if a process of this machine runs, or if its state is unknown."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):  # somebody else's, or no number of a process
        return True
    return True


@contextmanager
def writing(path: str | Path) -> Iterator[None]:
    """Name the folder or file in the error of a full disk or another failure to write.

    Raises:
        ValueError: in place of an OSError.
    """
    try:
        yield
    except OSError as error:
        raise ValueError(f"{path}: cannot be written: {error.strerror or error}") from None


def _check_target(target: Path) -> None:
    with writing(target):
        if not target.exists() and not target.is_symlink():
            return
        if not target.is_dir():
            raise ValueError(f"{target}: is a file, not a folder")
        names = sorted(entry.name for entry in target.iterdir())
    known = _contents(target)
    other = next((name for name in names if name not in known), None)
    if other is not None:
        raise ValueError(f"{target}: holds other files than results of jaxgear ({other}), choose another folder")
    if Path.cwd().is_relative_to(target.resolve()):
        raise ValueError(f"{target}: is the folder you are in and would be replaced, choose one below it")
    if not os.access(target, os.W_OK):
        raise ValueError(f"{target}: cannot be written: Permission denied")


def _contents(folder: Path) -> list[str]:
    """Names of the files of an earlier result of this program; empty list without one."""
    try:
        held = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        return list(held[CONTENTS]) if "jaxgear" in held["versions"] else []
    except (OSError, ValueError, KeyError, TypeError):
        return []


def _replace(temporary: Path, target: Path) -> None:
    umask = os.umask(0)
    os.umask(umask)
    os.chmod(temporary, 0o777 & ~umask)  # mkdtemp makes private folders, results are ordinary files
    target = target.resolve()  # a link to a folder keeps pointing at it
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


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:
            return
