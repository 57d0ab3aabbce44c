"""Files that are written as a whole or not at all, private folders for data that outlives a process."""

import hashlib
import os
import stat
import sys
import uuid
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, BinaryIO

import jax
import numpy as np
from jax.experimental.compilation_cache import compilation_cache

TEMPORARY = ".tmp"  # end of the names of files that are being written
_sum = hashlib.sha256


def write_durably(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a temporary file by `write(file)` and move it to `path` once it is on the disk."""
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex}{TEMPORARY}")
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


def sealed(content: bytes) -> bytes:
    """Content followed by its checksum."""
    return content + _sum(content).digest()


def unsealed(kept: bytes) -> bytes | None:
    """Content without its checksum; None if it is damaged."""
    content = kept[: -_sum().digest_size]
    return content if kept == sealed(content) else None


def digest(text: str, arrays: Iterable[Any] = ()) -> str:
    """Digest of a text and of the type, shape and content of arrays."""
    found = _sum(text.encode())
    for array in map(np.asarray, arrays):
        found.update(f"{array.dtype}{array.shape}".encode() + array.tobytes())
    return found.hexdigest()


class FileStore:
    """Contents kept as files of a folder, named by a checksum of everything that they depend on.

    Args:
        folder: folder of the files.
        surroundings: bytes that describe what all contents depend on.
        executed: True if contents may be executed: only files that other users cannot have written are read then.
    """

    def __init__(self, folder: Path, surroundings: bytes = b"", *, executed: bool = False) -> None:
        self._folder, self._here, self._executed = folder, surroundings, executed and os.name == "posix"

    def read(self, made_of: bytes) -> bytes | None:
        """Content written for `made_of`; None if it is missing or damaged, or if others can have written it."""
        file = self._file(made_of)
        try:
            if self._executed:
                return unsealed(_read_own(file))
            kept = file.read_bytes()
            os.utime(file)  # the oldest are forgotten
        except OSError:
            return None
        return unsealed(kept)

    def write(self, made_of: bytes, content: bytes) -> None:
        """Write a content; do nothing if the disk does not allow it."""

        def write(file):
            if self._executed:
                os.fchmod(file.fileno(), 0o600)  # whatever the umask
            file.write(sealed(content))

        try:
            write_durably(self._file(made_of), write)
        except OSError:  # a full disk: the next process makes it again
            return

    def _file(self, made_of: bytes) -> Path:
        return self._folder / _sum(self._here + made_of).hexdigest()


def _read_own(path: Path) -> bytes:
    """Bytes of a regular file that only this user can have placed or written, on a POSIX system.

    Folder and file are judged once they are open: what a path leads to can change between a look and a use.

    Raises:
        OSError: for every other file.
    """
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK  # a pipe would wait for its writer
        with open(os.open(path.name, flags, dir_fd=folder), "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode) or not all(map(_is_own, (status, os.fstat(folder)))):
                raise PermissionError(f"{path}: can be written by others")
            os.utime(file.fileno())  # the oldest are forgotten
            return file.read()
    finally:
        os.close(folder)


def _is_own(status: os.stat_result) -> bool:
    """True if this user owns a file or folder and no other user can write it."""
    return status.st_uid == os.getuid() and not status.st_mode & 0o022


def forget_the_oldest(folder: Path, most: int) -> None:
    """Removes the files of a folder that have not been used for the longest time, where there are more bytes."""
    files = sorted(
        ((file.stat(), file) for file in folder.iterdir() if file.is_file()), key=lambda each: -each[0].st_mtime
    )
    total = 0
    for status, file in files:
        total += status.st_size
        if total > most:
            file.unlink(missing_ok=True)


def user_folder(*names: str) -> Path | None:
    """Folder in the user's cache directory that only this user can write; None if it cannot be made."""
    try:
        folder = _user_cache().absolute().joinpath(*names)
        for part in (*reversed(folder.parents), folder):  # `parents=True` would make those above by the umask
            part.mkdir(mode=0o700, exist_ok=True)
        return folder if _is_private(folder) else None
    except (OSError, RuntimeError):  # RuntimeError: no home directory
        return None


_MOST = 256 << 20  # bytes of all programs of one kind that are kept


def program_folder(name: str) -> Path | None:
    """Private folder of limited size for compiled programs; None if it cannot be made."""
    folder = user_folder(__name__.partition(".")[0], name)
    if folder is None:
        return None
    try:
        forget_the_oldest(folder, _MOST)
    except OSError:
        return None
    return folder


def _user_cache() -> Path:
    if os.environ.get("XDG_CACHE_HOME"):
        return Path(os.environ["XDG_CACHE_HOME"])
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    if sys.platform == "win32" and os.environ.get("LOCALAPPDATA"):
        return Path(os.environ["LOCALAPPDATA"])
    return Path.home() / ".cache"


def _is_private(folder: Path) -> bool:
    """True if only this user can place files in a folder and in its parents: the files may be executed."""
    if not os.access(folder, os.W_OK):
        return False
    if sys.platform == "win32":
        return True
    return _is_own(folder.stat()) and all(map(_is_out_of_reach, {*folder.parents, *folder.resolve().parents}))


def _is_out_of_reach(folder: Path) -> bool:
    """True if only this user and the system can replace the content of a folder or the target of a link."""
    link, status = folder.lstat(), folder.stat()
    if {link.st_uid, status.st_uid} - {0, os.getuid()}:
        return False
    if status.st_mode & stat.S_ISVTX:  # everybody writes there, and replaces what is theirs
        return True
    private = status.st_gid == status.st_uid  # the group of one user, which many systems make
    return not status.st_mode & (0o002 if private else 0o022)


def enable_cache() -> Path | None:
    """Keep compiled programs for the next start of a script: it then traces them, and compiles nothing.

    JAX's persistent compilation cache, in a private folder of the user's cache folder and of at most 256 MB, for every
    program that this process compiles from now on. Call it before the first computation. The commands have a cache of
    their own.

    Returns:
        the folder; JAX's present one where its cache is already enabled; None where the folder cannot be made or where
        others can write to it.
    """
    if jax.config.jax_compilation_cache_dir:  # type: ignore[attr-defined]
        return Path(jax.config.jax_compilation_cache_dir)  # type: ignore[attr-defined]
    folder = program_folder("jax")
    if folder is None:
        return None
    jax.config.update("jax_compilation_cache_dir", str(folder))
    # the many small programs of an analysis take as long as the few large ones
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    compilation_cache.reset_cache()  # JAX asks once per process
    return folder
