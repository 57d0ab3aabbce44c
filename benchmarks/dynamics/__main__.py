"""How accurate the dynamics are and what they cost: `python -m benchmarks.dynamics [section ...]`.

Exit code 1 when an orbit that is known exactly is missed by more than the last of its printed digits, the integrator
loses its order, a derivative is off, the force map leaves the contact analysis, or contenders disagree.
"""

import argparse
import os
import sys
from collections.abc import Callable, Sequence

import jax
from rich.console import Console

from ..rates import machine
from .convergence import convergence_section
from .cost import cost_section
from .exact import exact_section
from .force_map import map_section
from .gradients import gradient_section
from .throughput import DESIGNS, FULL_DESIGNS, throughput_section

_WIDTH = 200
_MAP, _THROUGHPUT = "map", "throughput"
_SLOW = _MAP, _THROUGHPUT  # sections that are about contact analyses, and about much of something


def sections(options: argparse.Namespace) -> dict[str, Callable[[Console], list[str]]]:
    """What prints its tables and returns the bounds that are missed, in words."""
    quick = options.quick
    return {
        "exact": lambda console: exact_section(console, quick=quick),
        "convergence": lambda console: convergence_section(console, quick=quick),
        _MAP: map_section,
        "gradients": lambda console: gradient_section(console, quick=quick),
        "cost": lambda console: cost_section(console, quick=quick),
        _THROUGHPUT: lambda console: throughput_section(console, designs=options.designs),
    }


NAMES = tuple(sections(argparse.Namespace(quick=True, designs=DESIGNS)))


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.dynamics", description=__doc__.splitlines()[0])
    parser.add_argument("sections", nargs="*", metavar="section", help=f"one of {', '.join(NAMES)}; all if none")
    parser.add_argument("--quick", action="store_true", help="what takes no contact analysis, in a minute")
    parser.add_argument("--full", action="store_true", help=f"{FULL_DESIGNS} designs in the section on throughput")
    parser.add_argument("--designs", type=int, help=f"so many, {DESIGNS} if not given")
    options = parser.parse_args(arguments)
    for name in options.sections:
        if name not in NAMES:
            parser.error(f"no section {name!r}: choose from {', '.join(NAMES)}")
    for name in set(_SLOW) & set(options.sections if options.quick else ()):
        parser.error(f"section {name!r} is not quick")
    if options.quick + options.full + (options.designs is not None) > 1:
        parser.error("--quick, --full and --designs exclude each other")
    if options.designs is None:
        options.designs = FULL_DESIGNS if options.full else DESIGNS
    if options.designs < 1:
        parser.error(f"--designs {options.designs}: must be at least 1")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_num_cpu_devices", cores)
    console = Console(width=_WIDTH)
    console.print(", ".join(f"{key} {value}" for key, value in machine(cores).items()), markup=False, highlight=False)
    missed = []
    for name in options.sections or [name for name in NAMES if name not in _SLOW or not options.quick]:
        missed += sections(options)[name](console)
    for line in missed:
        console.print(f"MISSED: {line}", markup=False, highlight=False)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
