"""How long a user waits: `python -m benchmarks.latency`.

Every case runs in processes of its own: cold, with an empty cache of compiled programs, and warm, with what the cold
run left there. Counted are the functions that JAX traced and the programs that it compiled or took from its cache;
those that a command has kept are not among them, but the one is by which it asks what options the compiler knows. Cases
called new or own count from where the like of them was solved, the gradient from its call, and so do their times. Exit
code 1 when a count has grown past `latency_bounds.json`, or a time past six times its bound: times depend on what
else the machine does.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from .latency_probe import SCRIPTS
from .rates import machine

BOUNDS = Path(__file__).parent / "latency_bounds.json"
_TIME_MARGIN = 6.0
_LEAST_WALL = 0.5  # [s]; what takes less depends on everything
_EXAMPLES = Path(__file__).parent.parent / "examples"
COMMANDS = {
    "help": ["--help"],
    "analyze": ["analyze", "analyze.toml", "--output", "analysis"],
    "optimize": ["optimize", str(_EXAMPLES / "spur_19_48.toml"), "--output", "optimum"],
    "optimize --quick": ["optimize", str(_EXAMPLES / "spur_19_48.toml"), "--quick", "--output", "quick"],
    "sweep --quick": ["sweep", str(_EXAMPLES / "sweep_19_48.toml"), "--quick", "--output", "sweep"],
}
_ANALYZED = """\
title = "19/48 pair with tip reliefs"
[load]
torque = 50.0
torque_range = [25.0, 100.0]
[pinion]
teeth = 19
module = 3.0
face_width = 20.0
bore_diameter = 24.0
modification = [{ type = "tip_relief", amount = 8.0, length = 5.0 }]
[wheel]
teeth = 48
module = 3.0
face_width = 18.0
bore_diameter = 70.0
modification = [{ type = "tip_relief", amount = 8.0, length = 5.0 }]
"""
QUICK = ("help", "optimize --quick", "new_numbers")


@dataclass(frozen=True)
class Wait:
    """What one process took.

    Attributes:
        wall: from its start to its end, of the cases that count from later from there [s].
        processor: from its start to its end [s].
        traced, programs: functions traced, programs compiled or taken from the cache.
        seconds: that JAX spent, by what on.
    """

    wall: float
    processor: float
    traced: int
    programs: int
    seconds: dict[str, float]


def measured(case: str, folder: Path) -> dict[str, Wait]:
    """Cold and warm run of a case; the imports of both have their compiled bytecode."""
    (folder / "analyze.toml").write_text(_ANALYZED, encoding="utf-8")
    kind = ["script", case] if case in SCRIPTS else ["jaxgear", *COMMANDS[case]]
    return {state: _run(kind, folder) for state in ("cold", "warm")}


def _run(kind: list[str], folder: Path) -> Wait:
    out = folder / "counts.json"
    root = str(Path(__file__).parent.parent)
    path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
    cache = {"XDG_CACHE_HOME": str(folder / "cache"), "JAX_COMPILATION_CACHE_DIR": str(folder / "cache" / "scripts")}
    if kind[0] == "jaxgear":
        del cache["JAX_COMPILATION_CACHE_DIR"]  # the command has its own
    everything = {"JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0", "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1"}
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "benchmarks.latency_probe", str(out), *kind],
        cwd=folder,
        env={**os.environ, **cache, **everything, "PYTHONPATH": path, "MPLBACKEND": "Agg"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=True,
    )
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    found = json.loads(out.read_text(encoding="utf-8"))
    if found["code"]:
        raise RuntimeError(f"{' '.join(kind)} ended with exit code {found['code']}")
    times = found["times"]
    return Wait(found.get("wall", wall), processor, times.get("trace", 0), times.get("compile", 0), found["seconds"])


def exceeded(case: str, waits: dict[str, Wait], bounds: dict[str, dict[str, float]]) -> list[str]:
    """What has grown past its bound, in words."""
    lines = []
    for state, wait in waits.items():
        known = bounds[state]
        if wait.programs > known["programs"]:
            lines.append(f"{case}, {state}: {wait.programs} programs, at most {known['programs']:g}")
        usual = max(known["wall"], _LEAST_WALL)
        if wait.wall > _TIME_MARGIN * usual:
            lines.append(f"{case}, {state}: {wait.wall:.1f} s, at most {_TIME_MARGIN:g} x {usual:.1f} s")
    return lines


def print_waits(waits: dict[str, dict[str, Wait]]) -> None:
    """One line per case and state."""
    console, table = Console(width=120), Table()
    console.print(", ".join(f"{key} {value}" for key, value in machine(os.cpu_count() or 1).items()), highlight=False)
    table.add_column("case")
    columns = ("", "wall [s]", "CPU [s]", "traced", "programs", "trace [s]", "lower [s]", "compile [s]", "cache [s]")
    for title in columns:
        table.add_column(title, justify="right")
    for case, both in waits.items():
        for state, wait in both.items():
            inside = (f"{wait.seconds.get(name, 0.0):.1f}" for name in ("trace", "lower", "compile", "cache"))
            counted = str(wait.traced), str(wait.programs)
            table.add_row(case, state, f"{wait.wall:.1f}", f"{wait.processor:.1f}", *counted, *inside)
        table.add_section()
    console.print(table)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measures, prints and compares with the bounds."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.latency", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help=f"only {', '.join(QUICK)}")
    parser.add_argument("--record", action="store_true", help="record what is measured as the new bounds")
    options = parser.parse_args(arguments)
    if options.record and options.quick:
        parser.error("--record needs all cases")
    waits = {}
    for case in QUICK if options.quick else (*COMMANDS, *SCRIPTS):
        with tempfile.TemporaryDirectory() as folder:
            waits[case] = measured(case, Path(folder))
    print_waits(waits)
    if options.record:
        kept = {
            case: {state: {"programs": wait.programs, "wall": round(wait.wall, 1)} for state, wait in both.items()}
            for case, both in waits.items()
        }
        BOUNDS.write_text(json.dumps(kept, indent=2) + "\n", encoding="utf-8")
        return 0
    bounds = json.loads(BOUNDS.read_text(encoding="utf-8"))
    lines = [line for case, both in waits.items() for line in exceeded(case, both, bounds[case])]
    for line in lines:
        print(f"More than recorded: {line}")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
