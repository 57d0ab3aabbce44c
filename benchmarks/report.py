"""Tables of the accuracy benchmark."""

import textwrap
from collections.abc import Mapping, Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from .cases import Case, reference
from .goals import Goal
from .quantities import PRESSURE_NOTE, QUANTITIES, Quantity

Errors = dict[str, dict[Case, dict[str, float]]]
Goals = Mapping[str, Sequence[Goal]]
_WIDTH = 160
_QUANTITIES = {quantity.key: quantity for quantity in QUANTITIES}


def print_summary(results: Errors, goals: Goals) -> None:
    """Worst and mean absolute error over all cases, per quantity and model; then the goals of every model that has
    some: how many cycles meet each, which cycles miss one, and why.
    """
    console = Console(width=_WIDTH)
    count = len(next(iter(results.values())))
    console.print(f"Errors against finite elements, worst / mean of {count} mesh cycles", highlight=False)
    table = Table()
    table.add_column("quantity")
    for name in results:
        table.add_column(name, justify="right")
    for quantity in QUANTITIES:
        cells = []
        for cases in results.values():
            values = np.array([*_absolute(cases, quantity.key).values()])
            # a model that misses the contact of a pair has no such stiffness; the goals and the bounds count it
            cells.append(f"{_number(np.nanmax(values), quantity)} / {_number(np.nanmean(values), quantity)}")
        unit = f" [{quantity.unit}]" if quantity.unit else ""
        table.add_row(quantity.title + unit.replace("[", r"\["), *cells)
    console.print(table)
    for name, cases in results.items():
        if goals[name]:
            _print_goals(console, name, cases, goals[name])
            _print_misses(console, name, cases, goals[name])
    _print_text(console, f"Note on the flank pressures: {PRESSURE_NOTE}")


def print_detail(results: Errors) -> None:
    """One table per quantity: signed error of every model in every case."""
    console = Console(width=_WIDTH)
    for quantity in QUANTITIES:
        unit = f" [{quantity.unit}]" if quantity.unit else ""
        console.print(f"Error of {quantity.title}{unit}", markup=False, highlight=False)
        table = Table()
        table.add_column("case")
        for name in results:
            table.add_column(name, justify="right")
        for case in next(iter(results.values())):
            values = (cases[case].get(quantity.key) for cases in results.values())
            table.add_row(str(case), *("-" if value is None else _number(value, quantity) for value in values))
        console.print(table)


def _print_goals(console: Console, name: str, cases, goals: Sequence[Goal]) -> None:
    """How many cycles meet each goal, and what the rest of those that too many miss comes from."""
    console.print(f"Goals of the {name} model", highlight=False)
    table = Table("goal")
    for title in ("met by", "of cycles", "needed", "worst"):
        table.add_column(title, justify="right")
    table.add_column("in")
    missed: dict[str, list[str]] = {}
    for goal in goals:
        quantity = _QUANTITIES[goal.key]
        judged = _absolute(cases, goal.key)
        met = sum(goal.met(cases[case]) for case in judged)
        # nan is the worst
        case = max(judged, key=lambda case: np.nan_to_num(judged[case], nan=np.inf))
        needed = "every one" if goal.part == 1.0 else f"{goal.part:.0%}"
        table.add_row(str(goal), str(met), str(len(judged)), needed, _number(judged[case], quantity), str(case))
        if met < goal.part * len(judged):
            missed.setdefault(goal.why, []).append(str(goal))
    console.print(table)
    for why, titles in missed.items():
        _print_text(console, f"MISSED by the {name} model: {'; '.join(titles)}. {why}")


def _print_misses(console: Console, name: str, cases, goals: Sequence[Goal]) -> None:
    """Every cycle that misses a goal: PPTE of both sides, the errors of the curve, and the goals missed."""
    missed = {case: [goal.key for goal in goals if not goal.met(error)] for case, error in cases.items()}
    missed = {case: keys for case, keys in missed.items() if keys}
    console.print(f"{len(missed)} of {len(cases)} cycles miss a goal of the {name} model", highlight=False)
    if not missed:
        return
    table = Table("case")
    for title in ("finite elements: PPTE \\[um]", f"{name}: PPTE \\[um]", "PPTE \\[%]", "mean TE \\[%]", "rms \\[%]"):
        table.add_column(title, justify="right")
    table.add_column("misses")
    for case, keys in missed.items():
        error = cases[case]
        ppte = np.ptp(reference(case).transmission_error)
        percent = (f"{error[key]:.2f}" for key in ("ppte", "mean", "rms"))
        table.add_row(str(case), f"{ppte:.3f}", f"{ppte + error['ppte_um']:.3f}", *percent, ", ".join(keys))
    console.print(table)


def _print_text(console: Console, text: str) -> None:
    lines = textwrap.fill(" ".join(text.split()), _WIDTH - 4, subsequent_indent="    ")
    console.print(lines, markup=False, highlight=False)


def _absolute(cases: dict[Case, dict[str, float]], key: str) -> dict[Case, float]:
    """Absolute error of the cases that have this quantity."""
    return {case: abs(error[key]) for case, error in cases.items() if key in error}


def _number(value: float, quantity: Quantity) -> str:
    return f"{value:.{2 if quantity.unit == '%' else 3}f}"
