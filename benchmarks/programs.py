"""How large programs are, which decides how long a first answer takes: `python -m benchmarks.programs`.

Counted are operations in the jaxpr (those inside of loops once), lines of StableHLO and lines of the optimized program,
none of which depends on the machine; tracing, compiling and running take what they take here. Exit code 1 when the
operations of a program have grown by more than 3 % past `programs_bounds.json`.
"""

import argparse
import functools
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from rich.console import Console
from rich.table import Table

import jaxgear as jg

from .rates import machine

BOUNDS = Path(__file__).parent / "programs_bounds.json"
MARGIN = 0.03
_REPETITIONS = 20
TORQUE = 50.0
_RELIEFS = [8.0, 3.0, 8.0, 3.0]  # amount [um] and length [mm], of the pinion and of the wheel
_SPUR = jg.Resolution(positions=64, pairs=2)
_COUPLED = jg.Resolution(positions=64, pairs=2, slices=11)
_HELICAL = jg.Resolution(positions=64, slices=22)


@dataclass(frozen=True)
class Size:
    """A program.

    Attributes:
        operations: in its jaxpr.
        lines, optimized: of StableHLO and of the optimized program; zero where it was not compiled.
        trace, compile: processor time [s].
        run: the fastest of several runs [s].
    """

    operations: int
    lines: int = 0
    optimized: int = 0
    trace: float = 0.0
    compile: float = 0.0
    run: float = 0.0


def _pair(helix_angle: float = 0.0) -> jg.GearPair:
    def gear(teeth, bore, hand):
        return jg.Gear(teeth, 3.0, face_width=18.0, bore_diameter=bore, helix_angle=hand * helix_angle)

    return jg.GearPair(gear(19, 24.0, 1.0), gear(48, 70.0, -1.0))


def _reliefs(x):
    return jg.TipRelief(x[0], x[1]), jg.TipRelief(x[2], x[3])


def _ppte(mesh: jg.Mesh, x):
    pinion, wheel = _reliefs(x)
    return jg.peak_to_peak(jg.solve(mesh, TORQUE, pinion=pinion, wheel=wheel).transmission_error)


def _evaluated(mesh: jg.Mesh, x):
    pinion, wheel = _reliefs(x)
    return jg.optimize.evaluate(mesh, TORQUE, "ppte", pinion=pinion, wheel=wheel)


def _dynamic_factor(mesh: jg.Mesh, x):
    pinion, wheel = _reliefs(x)
    dynamics = jg.dynamics.Dynamics(mesh_frequencies=[1500.0])
    point = jg.OperatingPoint(TORQUE)
    return jg.optimize.evaluate(mesh, point, dynamics.quantity("worst_dynamic_factor"), pinion=pinion, wheel=wheel)


def _gradient(of: Callable[[jg.Mesh, Any], Any]) -> Callable[[jg.Mesh, Any], Any]:
    return lambda mesh, x: jax.value_and_grad(lambda x: of(mesh, x))(x)


# of every program: its function, the sizes of the mesh, and the helix angle [deg]
PROGRAMS: dict[str, tuple[Callable[[jg.Mesh, Any], Any], jg.Resolution, float]] = {
    "PPTE": (_ppte, _SPUR, 0.0),
    "PPTE and gradient, solve": (_gradient(_ppte), _SPUR, 0.0),
    "PPTE and gradient, evaluate": (_gradient(_evaluated), _SPUR, 0.0),
    "PPTE, 11 coupled slices": (_ppte, _COUPLED, 0.0),
    "PPTE and gradient, 11 coupled slices": (_gradient(_ppte), _COUPLED, 0.0),
    "PPTE, helical": (_ppte, _HELICAL, 15.0),
    "PPTE and gradient, helical": (_gradient(_ppte), _HELICAL, 15.0),
    "dynamic factor and gradient": (_gradient(_dynamic_factor), _SPUR, 0.0),
}


def operations(jaxpr: jax.extend.core.Jaxpr) -> int:
    """Number of operations, those of inner programs in place of the calls."""
    return sum(sum(map(operations, inner)) if (inner := list(_inner(each))) else 1 for each in jaxpr.eqns)


def _inner(equation: jax.extend.core.JaxprEqn) -> Iterator[jax.extend.core.Jaxpr]:
    for leaf in jax.tree.leaves(list(equation.params.values()), is_leaf=_is_jaxpr):
        if isinstance(leaf, jax.extend.core.ClosedJaxpr):
            yield leaf.jaxpr
        elif isinstance(leaf, jax.extend.core.Jaxpr):
            yield leaf


def _is_jaxpr(leaf: object) -> bool:
    return isinstance(leaf, jax.extend.core.ClosedJaxpr | jax.extend.core.Jaxpr)


@functools.cache
def _mesh(sizes: jg.Resolution, helix_angle: float) -> tuple[Any, Any]:
    """Arrays of a prepared mesh, and what is left of it without them."""
    return eqx.partition(jax.block_until_ready(jg.prepare(_pair(helix_angle), resolution=sizes)), eqx.is_array)


def traced(name: str) -> Any:
    """A program after tracing, before anything of it is compiled."""
    function, sizes, helix_angle = PROGRAMS[name]
    arrays, rest = _mesh(sizes, helix_angle)
    return jax.jit(lambda arrays, x: function(eqx.combine(arrays, rest), x)).trace(arrays, jnp.asarray(_RELIEFS))


def count(name: str) -> Size:
    """The operations of a program alone."""
    return Size(operations(traced(name).jaxpr.jaxpr))


def measure(name: str) -> Size:
    """A program with its compilation."""
    _, sizes, helix_angle = PROGRAMS[name]
    arrays, x = _mesh(sizes, helix_angle)[0], jnp.asarray(_RELIEFS)
    start = time.process_time()
    trace = traced(name)
    lowered = trace.lower()
    middle = time.process_time()
    compiled = lowered.compile()
    end = time.process_time()
    times = []
    for _ in range(_REPETITIONS):
        began = time.perf_counter()
        jax.block_until_ready(compiled(arrays, x))
        times.append(time.perf_counter() - began)
    return Size(
        operations(trace.jaxpr.jaxpr),
        lowered.as_text().count("\n"),
        compiled.as_text().count("\n"),
        middle - start,
        end - middle,
        min(times),
    )


def grown(sizes: dict[str, Size], bounds: dict[str, int]) -> list[str]:
    """Programs with more operations than recorded, in words."""
    return [
        f"{name}: {size.operations} operations, at most {bounds[name]} and {MARGIN:.0%} more"
        for name, size in sizes.items()
        if size.operations > (1 + MARGIN) * bounds[name]
    ]


def recorded() -> dict[str, int]:
    """Operations by program."""
    return json.loads(BOUNDS.read_text(encoding="utf-8"))


def print_sizes(sizes: dict[str, Size]) -> None:
    """One line per program."""
    console, table = Console(width=130), Table()
    host = machine(os.cpu_count() or 1) | {"jax": jax.__version__}
    console.print(", ".join(f"{key} {value}" for key, value in host.items()), highlight=False)
    table.add_column("program")
    for title in ("operations", "StableHLO", "optimized", "trace [CPU s]", "compile [CPU s]", "run [ms]"):
        table.add_column(title, justify="right")
    for name, size in sizes.items():
        further = [
            f"{size.lines}",
            f"{size.optimized}",
            f"{size.trace:.1f}",
            f"{size.compile:.1f}",
            f"{1e3 * size.run:.2f}",
        ]
        table.add_row(name, f"{size.operations}", *(further if size.lines else [""] * len(further)))
    console.print(table)


def main(arguments: Sequence[str] | None = None) -> int:
    """Counts or measures, prints and compares with what is recorded."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.programs", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="count the operations alone, compile nothing")
    parser.add_argument("--record", action="store_true", help="record the operations as the new bounds")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the sizes to this file")
    options = parser.parse_args(arguments)
    jax.config.update("jax_enable_x64", True)
    sizes = {}
    for name in PROGRAMS:
        print(f"  {name}", file=sys.stderr, flush=True)
        sizes[name] = (count if options.quick else measure)(name)
    print_sizes(sizes)
    if options.json:
        options.json.write_text(json.dumps({k: asdict(v) for k, v in sizes.items()}, indent=2) + "\n", encoding="utf-8")
    if options.record:
        counted = {name: size.operations for name, size in sizes.items()}
        BOUNDS.write_text(json.dumps(counted, indent=2) + "\n", encoding="utf-8")
        return 0
    lines = grown(sizes, recorded())
    for line in lines:
        print(f"More than recorded: {line}")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
