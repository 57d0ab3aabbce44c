"""Orbits that are known exactly, by speed sweep, by shooting and by continuation, to the digits that are printed."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

from jaxgear.dynamics import Orbit, SpeedResponse, find_orbit, speed_sweep

from .branches import dead_zone_branches, rectangular_branches
from .known import (
    DEAD_ZONE,
    MORE_DAMPED,
    MORE_ZETA,
    RECTANGULAR,
    ZETA,
    Known,
    dead_zone,
    dead_zone_on_a_moving_base,
    frequency,
    rectangular,
)

# A kink of the force inside of a step costs an error of its square: so many reach six digits, and eight.
STEPS, SHARPER_STEPS = 4096, 16384
MOST = 1.0  # largest difference in units of the last printed digit; the printed numbers are rounded or cut off
_AWAY = (0.01, -0.01)  # of the state from which shooting starts, in the wide clearance a fifth of it
_SAME = 0.01  # largest distance of an orbit from the printed numbers that it is compared with
_KICK = 4.5  # dynamic factor that leads to orbits of two cycles
_UNSTABLE, _ONLY_MODULI, _NOT_MET = "a sweep leaves it", "a sweep has no multipliers", "not met"


@dataclass(frozen=True)
class Column:
    """A printed quantity: name, title, and digits behind the point."""

    name: str
    title: str
    digits: int


@dataclass(frozen=True)
class Compared:
    """An orbit found in one way beside its printed numbers.

    Attributes:
        known: what is printed.
        way: "sweep", "shooting" or "continuation".
        values: what was found, by name; empty where this way does not lead there.
        why: it does not.
        needed: whether it should.
    """

    known: Known
    way: str
    values: dict[str, float]
    why: str = ""
    needed: bool = True


def columns(digits_of_state: int) -> tuple[Column, ...]:
    names = ("mean", "mean"), ("rms", "rms"), ("most", "x_max"), ("least", "x_min"), ("factor", "K_v")
    more = [Column("harmonic", "X_1", 6), Column("modulus", "|mu|_1", 4), Column("modulus_2", "|mu|_2", 4)]
    state = [Column(name, name, digits_of_state) for name in ("x0", "v0")]
    return (*state, *(Column(name, title, 6) for name, title in names), *more)


def printed(known: Known) -> dict[str, float]:
    """The printed numbers by name."""
    moduli = dict(zip(("modulus", "modulus_2"), known.moduli))
    names = "x0", "v0", "mean", "rms", "most", "least", "factor", "harmonic"
    return {name: getattr(known, name) for name in names if getattr(known, name) is not None} | moduli


def off(row: Compared, column: Column) -> float | None:
    """Difference in units of the last printed digit; None where there is nothing to compare."""
    number = printed(row.known).get(column.name)
    if number is None or column.name not in row.values:
        return None
    return (row.values[column.name] - number) * 10**column.digits


def of_orbit(orbit: Orbit) -> dict[str, float]:
    """Numbers of an orbit of shooting or continuation; the samples of a cycle are evenly spaced where it has X_1."""
    moduli = sorted(np.abs(np.linalg.eigvals(np.asarray(orbit.monodromy))), reverse=True)
    turn = np.exp(-2j * np.pi * np.asarray(orbit.phase))
    first = 2 * abs(np.mean(np.asarray(orbit.dte) * turn))
    numbers = [orbit.displacement[0], orbit.velocity[0], orbit.dte_mean, orbit.dte_rms]
    numbers += [orbit.dte_max, orbit.dte_min, orbit.dynamic_factor, first, *moduli]
    names = "x0", "v0", "mean", "rms", "most", "least", "factor", "harmonic", "modulus", "modulus_2"
    return {name: float(number) for name, number in zip(names, numbers)}


def of_sweep(found: SpeedResponse, i: int, cycle: int) -> dict[str, float]:
    """Numbers of one speed of a sweep, from the state before a cycle of the orbit."""
    first = found.velocity_harmonics[i, found.orders.index(1.0)] / (2 * np.pi * found.mesh_frequency[i])
    numbers = [found.poincare_dte[i, cycle], found.poincare_velocity[i, cycle], found.dte_mean[i]]
    numbers += [found.dte_rms[i], found.dte_max[i], found.dte_min[i], found.dynamic_factor[i], first]
    names = "x0", "v0", "mean", "rms", "most", "least", "factor", "harmonic"
    return {name: float(number) for name, number in zip(names, numbers)}


def by_sweep(knowns: Sequence[Known], oscillator, steps: int) -> Iterator[Compared]:
    """The nearest of the orbits up, down, and down from a kick."""
    speeds = np.array(sorted({known.omega for known in knowns}))
    runs = [
        speed_sweep(oscillator, frequency(speeds), direction=direction, kick=kick, steps=steps)
        for direction, kick in (("up", None), ("down", None), ("down", _KICK))
    ]
    for known in knowns:
        i = int(np.searchsorted(speeds, known.omega))
        found = [
            of_sweep(run, i, cycle)
            for run in runs
            for cycle in range(known.periods)
            if bool(run.converged[i]) and int(run.period[i]) == known.periods
        ]
        why = _UNSTABLE if not known.stable else _ONLY_MODULI if known.rms is None else _NOT_MET
        yield Compared(known, "sweep", _nearest(known, found), why, needed=why == _NOT_MET)


def by_shooting(knowns: Sequence[Known], family, steps: int, *, away=_AWAY) -> Iterator[Compared]:
    """From a state a little beside the printed one."""
    for known in knowns:
        x, v = known.near or (known.x0, known.v0)
        orbit = find_orbit(*family(known), ([x + away[0]], [v + away[1]]), periods=known.periods, steps=steps)
        values = of_orbit(orbit) if bool(orbit.converged) and bool(orbit.stable) == known.stable else {}
        yield Compared(known, "shooting", values, _NOT_MET)


def by_continuation(knowns: Sequence[Known], orbits: Sequence[Orbit]) -> Iterator[Compared]:
    """What `rectangular_branches` or `dead_zone_branches` met."""
    for known in knowns:
        there = [of_orbit(orbit) for orbit in orbits if _is_at(orbit, known)]
        yield Compared(known, "continuation", _nearest(known, there), _NOT_MET)


def _is_at(orbit: Orbit, known: Known) -> bool:
    return orbit.periods == known.periods and abs(2 * np.pi * float(orbit.mesh_frequency) - known.omega) < 1e-6


def _nearest(known: Known, found: Sequence[dict[str, float]]) -> dict[str, float]:
    wanted = printed(known)

    def distance(values):
        return max(abs(values[name] - number) for name, number in wanted.items() if name in values)

    comparable = [values for values in found if any(name in values for name in wanted)]
    best = min(comparable, key=distance, default={})
    return best if best and distance(best) < _SAME else {}


def exact_section(console: Console, *, quick: bool) -> list[str]:
    """Prints all tables; what is farther from the printed numbers than their last digit. Quick: of the first
    oscillator, without continuation.
    """
    branches = [] if quick else list(rectangular_branches(STEPS))

    def rectangular_at(known):
        return rectangular(known.zeta), frequency(known.omega)

    def dead_zone_at(known):
        return dead_zone(jnp.asarray(frequency(known.omega)))

    tables = []
    for knowns, zeta in ((RECTANGULAR, ZETA), (MORE_DAMPED, MORE_ZETA)):
        rows = [*by_sweep(knowns, rectangular(zeta), STEPS), *by_shooting(knowns, rectangular_at, STEPS)]
        rows += [] if quick else by_continuation(knowns, branches)
        tables.append((f"Rectangular stiffness, contact loss, zeta {zeta:.2f}, {STEPS} steps per cycle", rows, 6))
    if not quick:
        rows = [*by_sweep(DEAD_ZONE, dead_zone_on_a_moving_base(), SHARPER_STEPS)]
        rows += by_shooting(DEAD_ZONE, dead_zone_at, SHARPER_STEPS, away=(0.002, 0.0))
        rows += by_continuation(DEAD_ZONE, list(dead_zone_branches(SHARPER_STEPS)))
        tables.append((f"Dead zone, zeta {ZETA:.2f}, {SHARPER_STEPS} steps per cycle", rows, 8))
    missed = []
    for title, rows, digits in tables:
        print_compared(console, title, rows, columns(digits))
        missed += beyond(rows, columns(digits))
    _print_summary(console, tables)
    return missed


def beyond(rows: Sequence[Compared], of: Sequence[Column]) -> list[str]:
    """Numbers off by more than the last printed digit, and orbits that were not met."""
    lines = [f"{row.known.name} by {row.way}: {row.why}" for row in rows if row.needed and not row.values]
    for row in rows:
        worst = [(column, value) for column in of if (value := off(row, column)) is not None and not abs(value) <= MOST]
        lines += [f"{row.known.name} by {row.way}: {column.title} off by {value:.1f} digits" for column, value in worst]
    return lines


def print_compared(console: Console, title: str, rows: Sequence[Compared], of: Sequence[Column]) -> None:
    """Each printed number, and below it what every way found with its difference in units of the last digit."""
    console.print(title, highlight=False)
    shown = [column for column in of if any(column.name in printed(row.known) for row in rows)]
    table = Table()
    for column in "Omega, orbit", "":
        table.add_column(column, no_wrap=True)
    for column in shown:
        table.add_column(column.title, justify="right", no_wrap=True)
    for known in dict.fromkeys(row.known for row in rows):
        numbers = printed(known)
        table.add_row(
            known.name,
            "printed",
            *(f"{numbers[column.name]:.{column.digits}f}     " if column.name in numbers else "" for column in shown),
        )
        for row in rows:
            if row.known is not known:
                continue
            cells = [_cell(row, column) for column in shown]
            table.add_row(row.why if not row.values else "", row.way, *cells)
        table.add_section()
    console.print(table)


def _cell(row: Compared, column: Column) -> str:
    difference = off(row, column)
    return "" if difference is None else f"{row.values[column.name]:.{column.digits}f} {difference:+.1f}"


def _print_summary(console: Console, tables) -> None:
    table = Table("", "way", "orbits met", "largest difference, in the last printed digit")
    for title, rows, digits in tables:
        for way in dict.fromkeys(row.way for row in rows):
            own = [row for row in rows if row.way == way]
            differences = [abs(value) for row in own for c in columns(digits) if (value := off(row, c)) is not None]
            met = sum(bool(row.values) for row in own)
            table.add_row(title, way, f"{met} of {len(own)}", f"{max(differences, default=np.nan):.2f}")
    console.print(table)
