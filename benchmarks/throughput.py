"""Variants per second of the loaded tooth contact analysis: `python -m benchmarks.throughput`.

The 19/48 pair of `examples/spur_19_48.toml` under 50 N m, with random parabolic tip reliefs on both gears; the
result of a variant is its peak-to-peak transmission error (PPTE). The same physics runs in jaxgear, in NumPy, in SciPy
and in hand-written C. All take turns, so that a busy machine slows all alike. Exit code 1 when their results disagree.
"""

import argparse
import json
import os
import sys
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from .baselines.c_kernel import find_compiler
from .baselines.problem import random_variants
from .contenders import Contender, Process
from .rates import machine, print_rates

# Variants per batch of jaxgear with one slice, fewer with more slices: the working set stays in the second-level cache.
BATCH = 64
_SLICES = 11
_HELIX_ANGLE = 15.0  # [deg]
# largest difference in PPTE from jaxgear in float64 [um]
_TOLERANCE = {"float64": 1e-6, "float32": 1e-3}


@dataclass
class Row:
    """What is known about a contender.

    Attributes:
        contender: which one.
        cold_start: from the start of its process to the first result [s].
        compilation: part of it for the first call of the analysis [s].
        difference: largest difference in PPTE from jaxgear in float64 [um].
        gradient_difference: the same of the gradient [um per um or mm]; None without.
        rates: variants per second, one per repetition.
        core_rates: variants per second of processor time, one per repetition.
        memory: peak resident memory [MiB].
    """

    contender: Contender
    cold_start: float
    compilation: float
    difference: float = 0.0
    gradient_difference: float | None = None
    rates: list[float] = field(default_factory=list)
    core_rates: list[float] = field(default_factory=list)
    memory: float = 0.0

    @property
    def rate(self) -> float:
        """Best variants per second: what disturbs a measurement only makes it slower."""
        return max(self.rates)

    @property
    def agrees(self) -> bool:
        """Whether PPTE is that of jaxgear in float64; nan is not."""
        return self.difference <= _TOLERANCE[self.contender.precision]


def contenders(cores: int, batch: int, *, quick: bool) -> list[Contender]:
    """Everyone who takes part; jaxgear in float64 comes first of its physics, since it is the reference."""
    chunk = {1: 4096 if quick else 16384, _SLICES: 2048}

    def jaxgear(slices, precision="float64", gradient=False, coupled=False, helix_angle=0.0):
        size = max(batch // slices, 1)
        return Contender("jaxgear", chunk[slices], slices, cores, precision, gradient, size, coupled, helix_angle)

    def numpy(slices):
        size = 64 if slices == 1 else 6
        return Contender("NumPy", 4 * size, slices, batch=size)

    many = [cores] if cores > 1 else []
    chosen = [jaxgear(1), jaxgear(1, gradient=True)]
    if not quick:
        chosen += [jaxgear(1, "float32"), jaxgear(1, "float32", gradient=True)]
    if find_compiler():
        chosen += [Contender("C", 20_000, threads=threads) for threads in [1, *many]]
        chosen += [Contender("C", 20_000, threads=cores, gradient=True)]
    chosen += [numpy(1), Contender("SciPy", 2)]
    if not quick:
        chosen += [jaxgear(_SLICES, precision, gradient) for precision in _TOLERANCE for gradient in (False, True)]
        chosen += [
            jaxgear(_SLICES, gradient=gradient, coupled=True, helix_angle=angle)
            for angle in (0.0, _HELIX_ANGLE)
            for gradient in (False, True)
        ]
        if find_compiler():
            chosen += [Contender("C", 1000, _SLICES, threads=cores)]
        chosen += [numpy(_SLICES)]
    return chosen


def compare(
    chosen: list[Contender], *, positions: int = 64, checked: int = 100, repetitions: int = 5, seconds: float = 0.5
) -> tuple[list[Row], dict[str, str]]:
    """Starts all contenders one after the other, checks their results, then measures them in turns.

    Args:
        chosen: contenders; jaxgear in float64 first of its physics, with gradient second.
        positions: mesh positions.
        checked: random variants on which all have to agree; SciPy answers for the first tenth of them.
        repetitions: measurements per contender.
        seconds: duration of one.

    Returns:
        a row per contender, and the versions of the software.
    """
    rows: list[Row] = []
    versions: dict[str, str] = {}
    variants = random_variants(checked)
    references: dict[tuple[int, bool, float], Process] = {}
    gradients: dict[tuple[int, bool, float], np.ndarray] = {}
    with ExitStack() as stack:
        processes = []
        for contender in chosen:
            print(f"  starting {contender.name}, slices: {contender.slices}", file=sys.stderr, flush=True)
            reference = references.get(contender.physics)
            problem = reference.start.problem if reference and contender.kind != "jaxgear" else None
            process = stack.enter_context(Process(contender, positions, problem))
            processes.append(process)
            references.setdefault(contender.physics, process)
            versions |= process.start.versions
            row = Row(contender, process.start.cold, process.start.compiled)
            count = max(checked // 10, 1) if contender.kind == "SciPy" else checked
            ppte, gradient = process.results(variants[:count])
            expected, _ = references[contender.physics].results(variants[:count])
            row.difference = float(np.abs(ppte - expected).max())
            if gradient is not None:
                difference = np.abs(gradient - gradients.setdefault(contender.physics, gradient))
                row.gradient_difference = float(difference.max())
            rows.append(row)
        for repetition in range(repetitions):
            print(f"  repetition {repetition + 1} of {repetitions}", file=sys.stderr, flush=True)
            for row, process in zip(rows, processes):
                rate, core_rate = process.rate(seconds)
                row.rates.append(rate)
                row.core_rates.append(core_rate)
        for row, process in zip(rows, processes):
            row.memory = process.peak_memory()
    return rows, versions


def _arguments(argv) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.throughput", description=__doc__.split("\n\n")[0])
    parser.add_argument("--quick", action="store_true", help="one slice, float64, short measurements; below a minute")
    parser.add_argument(
        "--batch",
        type=int,
        default=BATCH,
        help=f"variants per batch of jaxgear, over the number of slices (default: {BATCH})",
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures to this file")
    arguments = parser.parse_args(argv)
    if arguments.batch < 1:
        parser.error(f"--batch {arguments.batch} must be at least 1")
    return arguments


def main(argv=None) -> int:
    """Runs the benchmark; returns the exit code."""
    arguments = _arguments(argv)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    chosen = contenders(cores, arguments.batch, quick=arguments.quick)
    effort = {"checked": 20, "repetitions": 3, "seconds": 0.2} if arguments.quick else {}
    rows, versions = compare(chosen, **effort)
    host = machine(cores) | versions
    print_rates(rows, host, has_compiler=find_compiler() is not None)
    if arguments.json:
        found = {"machine": host, "rows": [asdict(row) | {"rate": row.rate} for row in rows]}
        arguments.json.write_text(json.dumps(found, indent=2) + "\n")
    wrong = [row for row in rows if not row.agrees]
    for row in wrong:
        print(f"{row.contender.name}: PPTE differs by {row.difference:.3g} um", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
