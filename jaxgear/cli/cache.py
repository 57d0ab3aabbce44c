"""Persistent cache of compiled programs: a second run starts in a fraction of the time."""

import os
import sys
from pathlib import Path

import jax


def enable_cache() -> Path | None:
    """Lets JAX keep compiled programs in a private folder of the user's cache directory.

    Returns:
        the folder, or None where there is none: it cannot be made, is not private, or the user set JAX's own variable.
    """
    if os.environ.get("JAX_COMPILATION_CACHE_DIR"):
        return None
    try:
        folder = _user_cache() / "jaxgear" / "xla"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _is_private(folder):
            return None
    except (OSError, RuntimeError):  # RuntimeError: no home directory
        return None
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
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
    """Cached programs are executed: nobody else may be able to place them."""
    if not os.access(folder, os.W_OK):
        return False
    if sys.platform == "win32":
        return True
    status = folder.stat()
    return status.st_uid == os.getuid() and not status.st_mode & 0o022
