"""Persistent cache of compiled programs: a second run starts in a fraction of the time."""

import hashlib
import os
import platform
from importlib.metadata import version
from pathlib import Path

import jax

from ..numerics.durable import KeptFiles, program_folder
from ..numerics.programs import ProgramStore, keep


def enable_cache() -> Path | None:
    """Keeps compiled programs in a private folder of the user's cache directory.

    Returns:
        the folder, or None where there is none: it cannot be made, is not private, or JAX keeps programs itself.
    """
    # by its variable or its configuration; a program that JAX has loaded lacks half of itself when it is written again
    if jax.config.jax_compilation_cache_dir:  # type: ignore[attr-defined]
        return None
    folder = program_folder("programs")
    if folder is not None:
        keep(ProgramStore(Files(folder)))
    return folder


class Files(KeptFiles):
    """Programs as files of a folder, named by all that they depend on."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, _surroundings(), executed=True)


def _surroundings() -> bytes:
    """Digest of what every compiled program depends on: package code, versions, settings, backend and processor."""
    found = hashlib.sha256()
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
