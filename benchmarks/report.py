"""Tables of the accuracy benchmark."""

import textwrap

import numpy as np
from rich.console import Console
from rich.table import Table

from .cases import Case
from .quantities import QUANTITIES, Quantity

Errors = dict[str, dict[Case, dict[str, float]]]
_WIDTH = 160


def print_summary(results: Errors) -> None:
    """Worst and mean absolute error over all cases, per quantity and model; then what misses its goal, and why."""
    console = Console(width=_WIDTH)
    count = len(next(iter(results.values())))
    console.print(f"Errors against finite elements, worst / mean of {count} mesh cycles", highlight=False)
    table = Table()
    table.add_column("quantity")
    table.add_column("goal", justify="right")
    for name in results:
        table.add_column(name, justify="right")
    for quantity in QUANTITIES:
        cells = []
        for cases in results.values():
            values = _absolute(cases, quantity)
            cells.append(f"{_number(values.max(), quantity)} / {_number(values.mean(), quantity)}")
        unit = f" [{quantity.unit}]" if quantity.unit else ""
        goal = "" if quantity.goal is None else f"{quantity.goal:g}"
        table.add_row(quantity.title + unit.replace("[", r"\["), goal, *cells)
    console.print(table)
    name, cases = next(iter(results.items()))
    for quantity in QUANTITIES:
        _print_goal(console, name, cases, quantity)


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
            values = (cases[case][quantity.key] for cases in results.values())
            table.add_row(str(case), *(_number(value, quantity) for value in values))
        console.print(table)


def _print_goal(console: Console, name: str, cases, quantity: Quantity) -> None:
    if quantity.goal is None:
        if quantity.why:
            _print_text(console, f"Note on {quantity.title}: {quantity.why}")
        return
    values = _absolute(cases, quantity)
    missed = int((values > quantity.goal).sum())
    if not missed:
        return
    at = list(cases)[int(values.argmax())]
    head = f"MISSED by the {name} model in {missed} of {len(values)}: {quantity.title} within {quantity.goal:g} "
    text = f"{head}{quantity.unit} (worst {_number(values.max(), quantity)} {quantity.unit} in {at}). {quantity.why}"
    _print_text(console, text)


def _print_text(console: Console, text: str) -> None:
    lines = textwrap.fill(" ".join(text.split()), _WIDTH - 4, subsequent_indent="    ")
    console.print(lines, markup=False, highlight=False)


def _absolute(cases: dict[Case, dict[str, float]], quantity: Quantity) -> np.ndarray:
    return np.array([abs(error[quantity.key]) for error in cases.values()])


def _number(value: float, quantity: Quantity) -> str:
    return f"{value:.{2 if quantity.unit == '%' else 3}f}"
