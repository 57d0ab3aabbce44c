"""What steady states over speed cost beside SciPy and hand-written C."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import jax
import numpy as np
from rich.console import Console
from rich.table import Table

from jaxgear.dynamics import Oscillator, settle, speed_sweep, speed_sweeps, steps_for

from ..baselines.c_kernel import find_compiler
from ..baselines.c_sweep import CSweep
from ..baselines.scipy_sweep import ScipySweep
from ..baselines.vibration import vibration_of
from .pair import QUICK_SPEEDS, SPEEDS, one_of
from .timing import Times, best_of

_SCIPY = {"RK45": 1e-5, "LSODA": 1e-6, "DOP853": 1e-5}  # relative tolerances
_SETTLED = 1e-6  # relative to its size, within which C waits for the state to repeat
_SCIPY_SETTLED = 1e-4  # the same of SciPy: less is below what its tolerances leave from cycle to cycle
_MOST_CYCLES = 500
_FINER = 8  # times the steps of the reference
_JUMP = 0.05  # relative difference of K_v that means another orbit
_INNER_STEPS, _INNER_CYCLES, _INNER_SPEED = 128, 100, 2500.0
_SIDE_BY_SIDE = 32
_WORST = 0.5  # of K_v [%], to which all have to agree so that their times can be compared
_DIRECTIONS = "up", "down"


@dataclass(frozen=True)
class Entry:
    """A contender.

    Attributes:
        name: of it.
        what: it does in one call.
        call: does it.
        states: steady states of one call.
        factor: K_v of them, None where it has none to compare.
        reference: K_v of the same by many more steps.
        cycles: mesh cycles integrated per steady state; None where that is not known.
    """

    name: str
    what: str
    call: Callable[[], object] = field(repr=False)
    states: int
    factor: np.ndarray | None = None
    reference: np.ndarray | None = None
    cycles: float | None = None

    @property
    def error(self) -> tuple[float, int]:
        """Largest difference of K_v on the same orbit [%], and at how many speeds the orbit is another one."""
        off = np.abs(np.ravel(self.factor) / np.ravel(self.reference) - 1)
        return 100 * off[off < _JUMP].max(initial=0.0), int((off >= _JUMP).sum())


def contenders(*, quick: bool) -> Iterator[Entry]:
    """Steady states of one pair up and down; SciPy at a few of the speeds, each from the state at the one before."""
    speeds = QUICK_SPEEDS if quick else SPEEDS
    moving = one_of(quick=quick)
    chosen = steps_for(moving, speeds)
    fine = [
        speed_sweep(moving, speeds, direction=way, steps=[_FINER * count for count in chosen]) for way in _DIRECTIONS
    ]
    reference = np.array([run.dynamic_factor for run in fine])

    def swept():
        return [speed_sweep(moving, speeds, direction=way, steps=chosen).dynamic_factor for way in _DIRECTIONS]

    both = f"up and down, {len(speeds)} speeds"
    yield Entry("jaxgear, one design", both, swept, reference.size, np.array(swept()), reference)
    if not quick:
        yield _many_entry(moving, speeds, chosen, both, reference)
    plain = vibration_of(moving)
    if find_compiler():
        yield _c_entry(CSweep(plain, max(chosen)), moving, speeds, chosen, both, reference)
    few = np.linspace(1, len(speeds) - 1, 2 if quick else 5).astype(int)
    starts = [np.concatenate([part[i - 1] for part in fine[0].state]) for i in few]
    for method, tolerance in _SCIPY.items():
        solver = ScipySweep(plain, method, tolerance)

        def solved(solver=solver):
            return np.array(
                [
                    solver.speed(speeds[i], start, tolerance=_SCIPY_SETTLED, most_cycles=_MOST_CYCLES)
                    for i, start in zip(few, starts)
                ]
            )

        numbers, what = solved(), f"up, {len(few)} of the speeds, rtol {tolerance:g}"
        cycles = float(np.abs(numbers[:, 2]).mean())
        yield Entry(f"SciPy {method}", what, solved, len(few), numbers[:, 0], reference[0, few], cycles)


def _repeated(moving: Oscillator) -> Oscillator:
    return jax.tree.map(lambda part: np.repeat(np.asarray(part)[None], _SIDE_BY_SIDE, axis=0), moving)


def _many_entry(moving: Oscillator, speeds, chosen, both: str, reference) -> Entry:
    many = _repeated(moving)

    def swept():
        return [speed_sweeps(many, speeds, direction=way, steps=chosen).dynamic_factor for way in _DIRECTIONS]

    found = np.array(swept())
    return Entry(f"jaxgear, {_SIDE_BY_SIDE} designs", both, swept, found.size, found[:, 0], reference)


def _c_entry(kernel: CSweep, moving: Oscillator, speeds, chosen, both: str, reference) -> Entry:
    rest = [float(moving.mesh_force.static_te(0.0, moving.load[0])), 0.0]
    options = {"tolerance": _SETTLED, "most_cycles": _MOST_CYCLES}

    def swept():
        up = kernel.sweep(speeds, chosen, rest, **options)
        return np.array([up, kernel.sweep(speeds[::-1], chosen[::-1], rest, **options)[::-1]])

    numbers = swept()
    cycles = float(np.abs(numbers[..., 2]).mean())
    return Entry("C, one design", both, swept, reference.size, numbers[..., 0], reference, cycles)


def inner_loops(*, quick: bool) -> dict[str, tuple[int, Callable[[], object]]]:
    """Runge-Kutta steps alone: number of them in a call, and the call."""
    moving = one_of(quick=quick)
    start = moving.mesh_force.static_te(0.0, moving.load[0])[None], np.zeros(1)
    steps = _INNER_STEPS * _INNER_CYCLES

    def one(moving):
        return settle(moving, _INNER_SPEED, start, cycles=_INNER_CYCLES, steps=_INNER_STEPS)

    found: dict[str, tuple[int, Callable[[], object]]] = {"jaxgear, one design": (steps, lambda: one(moving))}
    if not quick:
        many, together = _repeated(moving), jax.jit(jax.vmap(one))
        found[f"jaxgear, {_SIDE_BY_SIDE} designs side by side"] = steps * _SIDE_BY_SIDE, lambda: together(many)
    if find_compiler():
        kernel = CSweep(vibration_of(moving), _INNER_STEPS)
        flat = np.concatenate(start)
        found["C, one design"] = steps, lambda: kernel.settle(_INNER_SPEED, flat, _INNER_CYCLES)
    return found


def cost_section(console: Console, *, quick: bool) -> list[str]:
    """Ratios of processor times; a K_v of C that is another one is no comparison, and said."""
    entries = list(contenders(quick=quick))
    times = best_of({entry.name: entry.call for entry in entries}, 1 if quick else 3)
    _print_states(console, entries, times)
    loops = inner_loops(quick=quick)
    taken = best_of({name: call for name, (_, call) in loops.items()}, 3 if quick else 10)
    table = Table("Runge-Kutta steps on a force map", title="The inner loop alone")
    for title in ("ns per step", "/ C"):
        table.add_column(title, justify="right")
    each = {name: 1e9 * taken[name].processor / steps for name, (steps, _) in loops.items()}
    for name, value in each.items():
        table.add_row(name, f"{value:.1f}", f"{value / each['C, one design']:.2f}" if "C, one design" in each else "")
    console.print(table)
    if not find_compiler():
        console.print("No C compiler found (cc, gcc, clang or $CC): the C kernel did not take part.", highlight=False)
    return [
        f"{entry.name}: K_v differs by {entry.error[0]:.2f} % from the reference"
        for entry in entries
        if entry.error[0] > _WORST
    ]


def _print_states(console: Console, entries: list[Entry], times: dict[str, Times]) -> None:
    table = Table("contender", "in one call", title="Steady states, processor time of the best call")
    for title in ("us per state", "/ jaxgear, one design", "cycles per state", r"K_v within \[%]", "other orbits"):
        table.add_column(title, justify="right")
    each = {entry.name: 1e6 * times[entry.name].processor / entry.states for entry in entries}
    first = each[entries[0].name]
    for entry in entries:
        error, others = entry.error
        cycles = "" if entry.cycles is None else f"{entry.cycles:.0f}"
        numbers = f"{each[entry.name]:.0f}", f"{each[entry.name] / first:.3g}", cycles, f"{error:.4f}", str(others)
        table.add_row(entry.name, entry.what, *numbers)
    console.print(table)
