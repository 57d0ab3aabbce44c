"""How long lives take to wear, once compiled: `python -m benchmarks.wear [--quick]`.

Exit code 1 when the best repetition takes longer than its bound. The bounds are for two cores that do nothing else.
"""

import jax

jax.config.update("jax_enable_x64", True)

import argparse  # noqa: E402
import os  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable, Sequence  # noqa: E402
from dataclasses import dataclass  # noqa: E402

import jax.numpy as jnp  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import wear  # noqa: E402

from .rates import machine  # noqa: E402

TORQUE, REVOLUTIONS, COEFFICIENT = 150.0, 2e7, 1e-18  # N m, of the pinion, m2/N
POSITIONS = 64
_BATCH = 100  # designs side by side
_REPETITIONS = 5


@dataclass(frozen=True)
class Case:
    """Lives that are worn one after the other, batch by batch.

    Attributes:
        designs: amounts of tip relief.
        blocks: of each life.
        bound: of the best repetition [s].
    """

    designs: int
    blocks: int
    bound: float


CASES = Case(1000, 20, 80.0), Case(1, 200, 5.0)
QUICK = Case(100, 20, 8.0), Case(1, 20, 0.5)


def lives(mesh: jg.Mesh, case: Case) -> Callable[[jax.Array], tuple[jax.Array, jax.Array]]:
    """PPTE over the life [um] and deepest wear [um] of every amount of relief [um]."""

    def life(amount):
        relief = jg.TipRelief(amount, 3.0, jg.Parabolic())
        options = {"pinion": relief, "wheel": relief, "coefficient": COEFFICIENT, "blocks": case.blocks}
        life = wear.wear(mesh, TORQUE, REVOLUTIONS, **options)
        return wear.over_life(life, "ppte"), wear.wear_depth(life)[-1]

    return jax.jit(lambda amounts: jax.lax.map(life, amounts, batch_size=_BATCH))


def measured(mesh: jg.Mesh, case: Case) -> tuple[float, list[float]]:
    """Time of the first call, with compilation, and of the later ones [s]."""
    run, amounts = lives(mesh, case), jnp.linspace(0.0, 20.0, case.designs)
    times = []
    for _ in range(1 + _REPETITIONS):
        start = time.perf_counter()
        ppte, depth = jax.block_until_ready(run(amounts))
        times.append(time.perf_counter() - start)
    if not (jnp.isfinite(ppte).all() and (depth > 0).all()):
        raise RuntimeError(f"{case}: contact not converged")
    return times[0], times[1:]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.wear", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a tenth of it")
    quick = parser.parse_args(arguments).quick
    gear = jg.Gear(teeth=30, module=2.0, face_width=20.0, bore_diameter=12.6)
    mesh = jg.prepare(jg.GearPair(gear, gear), resolution=jg.Resolution(positions=POSITIONS))
    table = Table("designs", "blocks", "first call \\[s]", "best \\[s]", "worst \\[s]", "bound \\[s]", "load")
    missed = []
    for case in QUICK if quick else CASES:
        first, times = measured(mesh, case)
        numbers = first, min(times), max(times), case.bound, os.getloadavg()[0]
        table.add_row(str(case.designs), str(case.blocks), *(f"{number:.3g}" for number in numbers))
        if min(times) > case.bound:
            missed.append(f"{case.designs} x {case.blocks} blocks take {min(times):.3g} s, bound {case.bound:g} s")
    console = Console(width=120)
    host = machine(len(os.sched_getaffinity(0)))
    console.print(", ".join(f"{key} {value}" for key, value in host.items()), markup=False, highlight=False)
    console.print(f"Lives of a 30/30 pair, {POSITIONS} positions: five contact analyses in two blocks")
    console.print(table)
    for line in missed:
        console.print(f"MISSED: {line}", markup=False)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
