"""JAX as a command sets it up: processor cores, processes that share a sweep, and a cache of compiled programs."""

import hashlib
import os
import platform
from importlib.metadata import version
from pathlib import Path

import jax

from ..numerics.durable import FileStore, program_folder
from ..numerics.programs import ProgramStore, keep

_DEVICES_FLAG = "xla_force_host_platform_device_count"


def use_all_cores() -> None:
    """Make every usable core a device of JAX, unless the user has set the number of devices.

    One device leaves most cores idle: the arrays of a contact solution are too small to be split among them. Two are
    the least, because a program for several devices rounds differently from one for a single device.
    """
    if os.environ.get("JAX_NUM_CPU_DEVICES") or _DEVICES_FLAG in os.environ.get("XLA_FLAGS", ""):
        return
    try:
        jax.config.update("jax_num_cpu_devices", max(usable_cores(), 2))
    except RuntimeError:  # JAX is running already, with the devices it has
        return


def usable_cores() -> int:
    """Cores that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def join_processes(coordinator: str | None, processes: int | None, process: int | None, *, automatic: bool) -> None:
    """Joins the processes that share a sweep, by the options of the command.

    Raises:
        ValueError: for options that do not go together.
        RuntimeError: when the others cannot be reached.
    """
    given = [coordinator is not None, processes is not None, process is not None]
    if automatic:
        if any(given):
            raise ValueError("--distributed finds --coordinator, --processes and --process itself: leave them out")
        jax.distributed.initialize()
    elif any(given):
        if processes is None or process is None or coordinator is None:
            raise ValueError("--coordinator, --processes and --process go together")
        host, _, port = coordinator.rpartition(":")
        if not host or not port.isdigit():
            raise ValueError(f"--coordinator {coordinator} must be HOST:PORT")
        if process >= processes:
            raise ValueError(f"--process {process} must be less than --processes {processes}")
        jax.distributed.initialize(coordinator, processes, process)


def enable_cache() -> Path | None:
    """Store compiled programs in a private folder of the user's cache directory.

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


class Files(FileStore):
    """Programs as files of a folder, named by a digest of everything that they depend on."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, _surroundings(), executed=True)


def _surroundings() -> bytes:
    """Digest of the inputs of all compiled programs: package code, versions, settings, backend and processor."""
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
