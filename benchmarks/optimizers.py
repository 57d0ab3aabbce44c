"""All methods of optimization side by side: `python -m benchmarks.optimizers`.

Two published problems: the 50/50 pair of the transmission-error iteration, and the 19/48 pair of a genetic-algorithm
study with the study's own variables. Every design is judged on a finer mesh than it was sought on, over torque and
over manufactured gears. Exit code 1 when one of the claims that the README makes of them no longer holds.
"""

import jax

jax.config.update("jax_enable_x64", True)

import argparse  # noqa: E402
import json  # noqa: E402
import os  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from collections.abc import Sequence  # noqa: E402
from dataclasses import asdict  # noqa: E402
from pathlib import Path  # noqa: E402

import jaxgear as jg  # noqa: E402

from .optimization.judge import Judge  # noqa: E402
from .optimization.methods import QUICK, Effort, Found, Method, methods, versions  # noqa: E402
from .optimization.report import Row, claims, findings, print_table  # noqa: E402
from .optimization.tasks import Task, tasks  # noqa: E402
from .rates import machine  # noqa: E402

FIGURE = Path(__file__).parents[1] / "examples" / "guides" / "figures" / "optimizers.png"


def compare(task: Task, chosen: Sequence[Method], effort: Effort) -> list[Row]:
    """Runs the methods on a task, each of them cold and warm, and judges what they found."""
    mesh = task.mesh(effort.positions)
    judge = Judge(task, effort.fine, effort.gears)
    found: dict[str, Found] = {}
    rows: dict[str, Row] = {}
    for method in chosen:
        before = found[method.after] if method.after else None
        found[method.name], cold = _timed(method, task, mesh, before)
        warm = _timed(method, task, mesh, before)[1]
        if method.after:
            cold, warm = cold + rows[method.after].cold_s, warm + rows[method.after].warm_s
        row = _row(task, method, found[method.name], judge, cold, warm)
        rows[method.name] = row
        print(
            f"  {task.name} {method.name}: PPTE {row.ppte_um:.3f} um, {row.evaluations} contact analyses, "
            f"{row.cold_s:.1f} s",
            file=sys.stderr,
            flush=True,
        )
    return list(rows.values())


def _timed(method: Method, task: Task, mesh: jg.Mesh, before: Found | None) -> tuple[Found, float]:
    began = time.perf_counter()
    found = method.run(task, mesh, before)
    jax.block_until_ready((found.pinion, found.wheel))
    return found, time.perf_counter() - began


def _row(task: Task, method: Method, found: Found, judge: Judge, cold: float, warm: float) -> Row:
    verdict = judge(found)
    return Row(
        pair=task.name,
        method=method.name,
        ppte_um=verdict.ppte,
        worst_over_torque_um=verdict.worst_over_torque,
        quantile95_um=verdict.quantile95,
        max_pressure_MPa=verdict.max_pressure,
        max_relief_um=verdict.max_relief,
        evaluations=found.evaluations,
        steps=found.steps,
        cold_s=cold,
        warm_s=warm,
    )


def compare_all(effort: Effort, *, quick: bool) -> list[Row]:
    """Rows of both tasks; a quick run takes the first one, without the methods that compile long."""
    chosen = [method for method in methods(effort) if not (quick and method.slow)]
    for method in chosen:
        if method.missing:
            print(
                f"{method.name} does not take part: it needs the library {method.missing} "
                "(pip install 'jaxgear[evolution]')",
                file=sys.stderr,
            )
    chosen = [method for method in chosen if not method.missing]
    rows: list[Row] = []
    for task in tasks()[: 1 if quick else None]:
        rows += compare(task, chosen, effort)
        jax.clear_caches()  # programs of one pair are of no use to the other
    return rows


def _figure(rows: Sequence[Row], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from jaxgear import plot

    from .optimization.figure import optimizer_comparison

    panels = optimizer_comparison([asdict(row) for row in rows])
    print(f"wrote {plot.save(panels[0].figure, path)}")


def _arguments(argv) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.optimizers", description=__doc__.split("\n\n")[0])
    parser.add_argument(
        "--quick", action="store_true", help="one pair, little effort, no method that compiles long, no claims"
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write all rows to this file")
    parser.add_argument(
        "--figure",
        metavar="FILE",
        type=Path,
        nargs="?",
        const=FIGURE,
        help="draw the comparison into this file (default: examples/guides/figures/optimizers.png)",
    )
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the benchmark; returns the exit code."""
    arguments = _arguments(argv)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not arguments.quick:
        jax.config.update("jax_enable_compilation_cache", False)  # a cold start is one that compiles
    rows = compare_all(QUICK if arguments.quick else Effort(), quick=arguments.quick)
    held = [] if arguments.quick else claims(rows)
    host = machine(cores) | versions()
    if arguments.json:
        found = {"machine": host, "quick": arguments.quick, "rows": rows, "claims": held}
        arguments.json.write_text(json.dumps(found, indent=2, default=asdict) + "\n")
    print_table(rows, host)
    print("\n".join(["", *findings(rows)]))
    if arguments.figure:
        _figure(rows, arguments.figure)
    if arguments.quick:
        return 0
    failed = [claim for claim in held if not claim.holds]
    for claim in failed:
        print(f"{'NOT CHECKED' if claim.holds is None else 'FAILED'}: {claim.text}", file=sys.stderr)
    if not failed:
        print("\nAll claims hold:", *(claim.text for claim in held), sep="\n  ")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
