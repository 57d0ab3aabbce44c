"""How long whole tasks take, once they are compiled: one design and many, over speed, up and down."""

from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table

from jaxgear.dynamics import Dynamics, speed_sweep, steps_for

from .pair import SPEEDS, mesh, oscillator, random_reliefs
from .timing import best_of

DESIGNS, FULL_DESIGNS = 64, 1000
_TORQUES = 100.0, 200.0, 400.0  # N m
_DIRECTIONS = "up", "down"
_SPEEDS, _SPEEDS_OF_MANY = 200, 100


def throughput_section(console: Console, *, designs: int) -> list[str]:
    """Seconds of the best call."""
    of_one, of_many = (np.linspace(SPEEDS[0], SPEEDS[-1], count) for count in (_SPEEDS, _SPEEDS_OF_MANY))
    pairs = [oscillator(mesh(), torque=torque) for torque in _TORQUES]
    reliefs = random_reliefs(designs)
    settings = Dynamics(of_many, kick=1.0)  # rising and falling
    steps = steps_for(oscillator(mesh()), of_many)
    calls: dict[str, Callable[[], object]] = {
        f"one design, {len(of_one)} speeds up and down, {len(_TORQUES)} torques": lambda: [
            speed_sweep(pair, of_one, direction=way).dynamic_factor for pair in pairs for way in _DIRECTIONS
        ],
        f"{designs} designs, {len(of_many)} speeds up and down, force maps included": lambda: settings.runs_of(
            _made, reliefs, steps=steps, keep=_factors
        ),
    }
    table = Table("once compiled")
    for title in (r"wall \[s]", r"processor \[s]"):
        table.add_column(title, justify="right")
    for name, times in best_of(calls, 1 if designs > DESIGNS else 2).items():
        table.add_row(name, f"{times.wall:.2f}", f"{times.processor:.2f}")
    console.print(table)
    return []


def _made(relief):
    return oscillator(mesh(), *relief)


def _factors(runs):
    return {name: of.dynamic_factor for name, of in runs.items()}
