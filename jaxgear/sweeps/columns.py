"""Columns of the table: their names, their units, and which way is better.

A text that begins like a formula gets an apostrophe in front, which spreadsheets take for "this is text"; who reads the
file again leaves it out.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from ..conditions import Conditions, LoadSpectrum, label, solve_case
from ..contact import Mesh, MeshCycle
from ..metrics import Quantity
from ..microgeometry import AbstractModification
from ..numerics import AbstractMeasure
from .plan import AbstractPlan

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_TEXT = "'"


def as_text(heading: str) -> str:
    """A heading that no spreadsheet takes for a formula."""
    return f"{_TEXT}{heading}" if heading.startswith(_FORMULA) else heading


def from_text(heading: str) -> str:
    """What `as_text` was given."""
    plain = heading.removeprefix(_TEXT)
    return plain if plain.startswith(_FORMULA) else heading


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


def result_columns(
    results: Sequence[Quantity], conditions: Conditions, measures: Sequence[AbstractMeasure]
) -> list[Column]:
    """The columns of every result, in the order in which the evaluation gives them.

    One case makes one column, `ppte_um`. Several make one for each measure over all of them, `ppte_um_mean`; several
    torques besides those of each torque, `ppte_um_25Nm`, over its manufactured gears `ppte_um_25Nm_q95`.

    Args:
        results: the quantities wanted.
        conditions: loads and manufactured gears.
        measures: by which the cases are joined, none for a single one.

    Raises:
        ValueError: for no or repeated results.
    """
    if not results or len({of.key for of in results}) != len(results):
        raise ValueError("sweep: results must be different and at least one")
    loads = _labels(conditions.load) if len(conditions.load.torques) > 1 else []
    joins = [f"_{label(measure)}" for measure in measures]
    gears = joins if conditions.samples > 1 else [""]
    endings = [*(joins or [""]), *(f"{load}{join}" for load in loads for join in gears)]
    columns = []
    for result in results:
        columns += [Column(f"{result.key}{ending}", result.unit, "result", result.better) for ending in endings]
    return columns


def _labels(load: LoadSpectrum) -> list[str]:
    torques = [f"_{torque:.12g}Nm" for torque in load.torques.tolist()]
    if load.speeds is None:
        return torques
    return [f"{torque}_{speed:.12g}rpm" for torque, speed in zip(torques, load.speeds.tolist())]


def over_torques(
    mesh: Mesh,
    torques: Iterable[float],
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> tuple[MeshCycle, ...]:
    """One design under every one of several torques, by one compiled program whatever the kind of its modifications.

    For figures and reports of a few designs; `jax.vmap` of `solve` is faster for many, and differentiable.

    Args:
        mesh: prepared mesh.
        torques: on the pinion [N m], in any order.
        pinion: modification of the pinion flank; None for the nominal involute.
        wheel: modification of the wheel flank; None for the nominal involute.

    Returns:
        the mesh cycle under every torque.

    Raises:
        TypeError: for something else than a prepared mesh or a modification.
        ValueError: for a negative or non-finite torque, or a modification that varies along the face on a mesh of one
            slice.
    """
    return tuple(solve_case(mesh, float(torque), pinion, wheel) for torque in torques)
