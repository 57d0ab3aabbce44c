"""A Pareto front in words and as a table, compared with the unmodified and the rule-based design."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from rich.table import Table

from ..optimize import Front
from . import report
from .gains import words

COMPROMISE = "compromise"  # what the design of a front is called that the run shows
_SHOWN_PARAMETERS = 6  # more columns than these are for a file


def others_of(front: Front, evaluations: report.Evaluations) -> dict[str, np.ndarray]:
    """Values of the objectives of the designs that the front is compared with, by their names."""
    return {
        name: np.asarray(list(found.objectives.values()))
        for name, found in evaluations.items()
        if name != COMPROMISE and len(found.objectives) == len(front.objectives)
    }


def front_table(front: Front, evaluations: report.Evaluations, of_variables: Mapping[str, str]) -> Table:
    """All designs of a front, with the others below; variables with their units."""
    result = Table(title=f"Pareto front, {len(front.values)} designs, all in front.csv", title_justify="left")
    result.add_column("")
    names = list(front.parameters) if len(front.parameters) <= _SHOWN_PARAMETERS else []
    for name, unit in zip(front.objectives, front.units):
        result.add_column(f"{words(name)}\n[{unit}]" if unit else words(name), justify="right")
    for name in names:
        unit = of_variables.get(name, "")
        result.add_column(f"{name}\n[{unit}]" if unit else name, justify="right")
    for row, values in enumerate(front.values):
        cells = [*values, *(front.parameters[name][row] for name in names)]
        label = f"{row + 1}, {COMPROMISE}" if row == front.chosen else f"{row + 1}"
        result.add_row(label, *(f"{value:.4g}" for value in cells))
    result.add_section()
    for name, values in others_of(front, evaluations).items():
        result.add_row(name, *(f"{value:.4g}" for value in values), *("-" for _ in names))
    return result


def front_rows(front: Front, signs: Sequence[int], evaluations: report.Evaluations) -> Iterator[tuple[str, str]]:
    """What the main design of a front is, and how many of the front beat the other designs.

    Args:
        front: the front.
        signs: of the objectives, 1 where small values are the better ones, else -1.
        evaluations: designs by their names.
    """
    yield COMPROMISE, "the design of the front whose worst distance from the best of each objective is least"
    for name, values in others_of(front, evaluations).items():
        better = ((front.values - values) * np.asarray(signs) < 0).all(axis=1)
        found = ", ".join(str(row + 1) for row in np.flatnonzero(better)) or "none"
        rows = "all" if better.all() else found
        yield "front", f"better than {name} in every objective: {rows} of its {len(front.values)} designs"
