"""JAX's own cache of compiled programs in a private folder, for scripts."""

from pathlib import Path

import jax
from jax.experimental.compilation_cache import compilation_cache

from .durable import program_folder


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
