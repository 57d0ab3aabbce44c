"""Columns of the table: their names, their units, and which way is better."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from ..metrics import RESULTS, result_key
from .plan import AbstractPlan

VARIANT, CONVERGED = "variant", "converged"


@dataclass(frozen=True)
class Column:
    """One column of the table.

    Attributes:
        name: with the unit for results, as written by the user for parameters.
        unit: "" for a pure number.
        kind: what it holds.
        better: whether small or large values are the better ones, "" where neither is.
        low, high: range of a parameter.
    """

    name: str
    unit: str
    kind: Literal["number", "parameter", "result", "flag"]
    better: Literal["smaller", "larger", ""] = ""
    low: float | None = None
    high: float | None = None


def parameter_columns(plan: AbstractPlan, units: Mapping[str, str], taken: Sequence[str]) -> list[Column]:
    """One column per parameter of the plan.

    Raises:
        ValueError: when a parameter has the name of another column.
    """
    for name in plan.names:
        if name in taken or name in (VARIANT, CONVERGED):
            raise ValueError(f'sweep: parameter "{name}" has the name of another column of the table')
    limits = zip(plan.names, plan.low, plan.high)
    return [Column(name, units.get(name, ""), "parameter", low=low, high=high) for name, low, high in limits]


def result_columns(results: Sequence[str], torques: Sequence[float], *, scattered: bool) -> list[Column]:
    """The columns of every result, in the order in which the evaluation gives them.

    One torque makes one column, several make their weighted mean, the worst and one each. Random deviations
    split each of these into its mean and its 95 % quantile over the samples.

    Args:
        results: names of results.
        torques: of the load spectrum [N m].
        scattered: whether deviations are sampled.

    Raises:
        ValueError: for no, repeated or unknown results.
    """
    if not results or len(set(results)) != len(results):
        raise ValueError("sweep: results must be different and at least one")
    loads = [""] if len(torques) == 1 else ["_mean", "_worst", *(f"_{torque:.12g}Nm" for torque in torques)]
    scatter = ["_mean", "_q95"] if scattered else [""]
    columns = []
    for result in results:
        key = result_key(result)
        better: Literal["smaller", "larger"] = "smaller" if RESULTS[result].worst == "max" else "larger"
        for name in (f"{key}{load}{statistic}" for load in loads for statistic in scatter):
            columns.append(Column(name, RESULTS[result].unit, "result", better))
    return columns
