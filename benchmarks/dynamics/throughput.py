"""How long whole tasks take, once they are compiled: one design and many, over speed, up and down."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

from jaxgear.dynamics import speed_sweep, speed_sweeps

from .pair import POSITIONS, QUICK_SPEEDS, SPEEDS, imagined, one_of, random_reliefs, relieved
from .timing import best_of

DESIGNS, FULL_DESIGNS = 64, 1000
_TORQUES = 100.0, 200.0, 400.0  # N m
_DIRECTIONS = "up", "down"
_SPEEDS, _SPEEDS_OF_MANY = 200, 100
_QUICK_DESIGNS = 4


def throughput_section(console: Console, *, quick: bool, designs: int) -> list[str]:
    """Seconds of the best call; quick: few speeds and designs, all of one imagined pair."""
    count = min(designs, _QUICK_DESIGNS) if quick else designs

    def speeds(number):
        return QUICK_SPEEDS if quick else np.linspace(SPEEDS[0], SPEEDS[-1], number)

    of_one, of_many = speeds(_SPEEDS), speeds(_SPEEDS_OF_MANY)
    pairs = [one_of(quick=quick, torque=torque) for torque in _TORQUES]
    reliefs = random_reliefs(count)
    many = jax.tree.map(lambda part: jnp.stack([part] * count), imagined()) if quick else relieved(*reliefs)
    calls: dict[str, Callable[[], object]] = {
        f"one design, {len(of_one)} speeds up and down, {len(_TORQUES)} torques": lambda: [
            speed_sweep(pair, of_one, direction=way).dynamic_factor for pair in pairs for way in _DIRECTIONS
        ],
        f"{count} designs, {len(of_many)} speeds up and down": lambda: [
            speed_sweeps(many, of_many, direction=way).dynamic_factor for way in _DIRECTIONS
        ],
    }
    if not quick:
        calls[f"force maps of {count} designs, {POSITIONS} mesh positions"] = lambda: relieved(*reliefs).mass
    table = Table("once compiled")
    for title in (r"wall \[s]", r"processor \[s]"):
        table.add_column(title, justify="right")
    for name, times in best_of(calls, 1 if quick or count > DESIGNS else 2).items():
        table.add_row(name, f"{times.wall:.2f}", f"{times.processor:.2f}")
    console.print(table)
    return []
