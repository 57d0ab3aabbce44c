"""Persistent cache of compiled programs: a second run starts in a fraction of the time."""

import hashlib
import os
import platform
import sys
from importlib.metadata import version
from pathlib import Path

import jax

from ..numerics.programs import Store, keep
from ..sweeps.store import write_durably

_MOST = 256 << 20  # bytes of all that is kept
_sum = hashlib.sha256


def enable_cache() -> Path | None:
    """Keeps compiled programs in a private folder of the user's cache directory.

    Returns:
        the folder, or None where there is none: it cannot be made, is not private, or the user set JAX's own variable.
    """
    if os.environ.get("JAX_COMPILATION_CACHE_DIR"):
        return None
    try:
        folder = _user_cache() / "jaxgear" / "programs"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _is_private(folder):
            return None
        _forget_the_oldest(folder)
    except (OSError, RuntimeError):  # RuntimeError: no home directory
        return None
    keep(Store(Files(folder)))
    return folder


class Files:
    """Programs as files of a folder, named by all that they depend on."""

    def __init__(self, folder: Path):
        self._folder, self._here = folder, _surroundings()

    def read(self, made_of: bytes) -> bytes | None:
        file = self._file(made_of)
        try:
            kept = file.read_bytes()
            os.utime(file)  # the oldest are forgotten
        except OSError:
            return None
        program = kept[: -_sum().digest_size]
        return program if kept == program + _sum(program).digest() else None  # a damaged one is compiled again

    def write(self, made_of: bytes, program: bytes) -> None:
        try:
            write_durably(self._file(made_of), lambda file: file.write(program + _sum(program).digest()))
        except OSError:  # a full disk: the next process compiles again
            return

    def _file(self, made_of: bytes) -> Path:
        return self._folder / _sum(self._here + made_of).hexdigest()


def _surroundings() -> bytes:
    """What a program depends on besides what it is made of: code, compiler, its settings, and the processor."""
    found = _sum()
    package = Path(__file__).parent.parent
    for file in sorted(package.rglob("*.py")):
        found.update(f"{file.relative_to(package)} ".encode() + file.read_bytes())
    versions = (version(name) for name in ("jax", "jaxlib", "equinox", "numpy"))
    settings = (f"{name}={os.environ[name]}" for name in sorted(os.environ) if name.startswith(("JAX_", "XLA_")))
    python = platform.python_version(), jax.config.read("jax_enable_x64"), jax.default_backend()
    found.update(repr((*versions, *settings, *python, _processor())).encode())
    return found.digest()


def _processor() -> str:
    """The processor with its instruction sets, where the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    return "".join(sorted({line for line in lines if line.startswith(("model name", "flags", "Features"))}))


def _forget_the_oldest(folder: Path) -> None:
    """Removes what has not been used for the longest time where there is too much."""
    files = sorted(((file.stat(), file) for file in folder.iterdir()), key=lambda each: -each[0].st_mtime)
    total = 0
    for status, file in files:
        total += status.st_size
        if total > _MOST:
            file.unlink(missing_ok=True)


def _user_cache() -> Path:
    if os.environ.get("XDG_CACHE_HOME"):
        return Path(os.environ["XDG_CACHE_HOME"])
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    if sys.platform == "win32" and os.environ.get("LOCALAPPDATA"):
        return Path(os.environ["LOCALAPPDATA"])
    return Path.home() / ".cache"


def _is_private(folder: Path) -> bool:
    """Cached programs are executed: nobody else may be able to place them."""
    if not os.access(folder, os.W_OK):
        return False
    if sys.platform == "win32":
        return True
    status = folder.stat()
    return status.st_uid == os.getuid() and not status.st_mode & 0o022
