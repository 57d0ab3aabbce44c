"""The processor cores and processes that a sweep spreads over."""

import os

import jax

_DEVICES_FLAG = "xla_force_host_platform_device_count"


def use_all_cores() -> None:
    """Makes every usable core a device of JAX, unless the user has said how many devices there are.

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
