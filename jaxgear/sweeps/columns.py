"""Columns of the table of a sweep: quantity, and cases of a variant.

A text that begins like a formula is written with a leading apostrophe, which marks text in spreadsheets; reading
removes it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NoReturn

from ..conditions import Better, Conditions, label, solve_case
from ..contact import Mesh, MeshCycle
from ..metrics import Quantity
from ..microgeometry import AbstractModification
from ..numerics import AbstractMeasure
from .plan import AbstractPlan

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_TEXT = "'"


def as_text(heading: str) -> str:
    """Heading with a leading apostrophe if a spreadsheet would take it for a formula."""
    return f"{_TEXT}{heading}" if heading.startswith(_FORMULA) else heading


def from_text(heading: str) -> str:
    """Heading without the mark of `as_text`."""
    plain = heading.removeprefix(_TEXT)
    return plain if plain.startswith(_FORMULA) else heading


VARIANT, CONVERGED, STATUS = "variant", "converged", "status"


Kind = Literal["number", "parameter", "result", "flag", "status"]


def described(
    name: str,
    unit: str = "",
    *,
    label: str = "",
    meaning: str = "",
    better: Better = "smaller",
    form: str = ".4g",
) -> Quantity:
    """Quantity with a description only, for parameters and for columns read from a file.

    Calling it with a cycle raises a `ValueError`.

    Args:
        name, unit, label, meaning, better, form: as for `Quantity`.
    """
    return Quantity(name, _not_computed, unit, meaning, better=better, label=label, form=form)


def _not_computed(cycle: MeshCycle) -> NoReturn:
    raise ValueError("Quantity: has its description only and no function, it cannot be computed")


@dataclass(frozen=True)
class Column:
    """One column of the table: a quantity of every variant in one or several cases.

    Attributes:
        quantity: quantity of the column.
        kind: kind of the column: "number", "parameter", "result", "flag" or "status".
        torque: torque on the pinion of a result [N m]; None for all torques.
        speed: speed of the pinion at this torque [rpm]; None for loads without speeds.
        statistic: measure over several cases, such as "mean" or "q95"; "" for a single case. The cases are all torques
            and manufactured gears, or the manufactured gears at one torque.
        low, high: range of a parameter.
    """

    quantity: Quantity
    kind: Kind = "result"
    torque: float | None = None
    speed: float | None = None
    statistic: str = ""
    low: float | None = None
    high: float | None = None

    @property
    def name(self) -> str:
        """Name in files: with the unit for results, `ppte_um_25Nm_q95`; as given by the user for parameters."""
        return f"{self.quantity.key if self.kind == 'result' else self.quantity.name}{self._case}"

    @property
    def name_without_unit(self) -> str:
        """The name without the unit of a result, `ppte_25Nm_q95`."""
        return f"{self.quantity.name}{self._case}"

    @property
    def named(self) -> str:
        """Name with the unit, once: `height [um]` of a parameter, `ppte_um` of a result."""
        return self.name if self.kind == "result" else self.quantity.named

    @property
    def words(self) -> str:
        """Name in words without the unit: "PPTE at 25 N m, q95 over gears"."""
        if self.torque is None:
            return f"{self.quantity.words} {self.statistic}" if self.statistic else self.quantity.words
        speed = "" if self.speed is None else f" and {self.speed:.12g} rpm"
        over = f", {self.statistic} over gears" if self.statistic else ""
        return f"{self.quantity.words} at {self.torque:.12g} N m{speed}{over}"

    @property
    def heading(self) -> str:
        """Name in words with the unit: `PPTE mean [um]`."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    @property
    def unit(self) -> str:
        """Unit of the quantity, "" for a pure number."""
        return self.quantity.unit

    @property
    def better(self) -> Better | Literal[""]:
        """Direction of improvement of a result, "smaller" or "larger"; "" for other columns."""
        return self.quantity.better if self.kind == "result" else ""

    @property
    def sign(self) -> int:
        """Sign of the quantity in a minimization: -1 if larger values are better, else 1."""
        return self.quantity.sign

    @property
    def _case(self) -> str:
        torque = "" if self.torque is None else f"_{self.torque:.12g}Nm"
        speed = "" if self.speed is None else f"_{self.speed:.12g}rpm"
        return f"{torque}{speed}" + (f"_{self.statistic}" if self.statistic else "")


NUMBER = Column(described(VARIANT), "number")  # first of a table
FLAG, CAUSE = Column(described(CONVERGED), "flag"), Column(described(STATUS), "status")  # last of a table


def axis_label(of: Quantity | Column) -> str:
    """Label of an axis, name in words with printed unit: "PPTE [µm]", "contact ratio [-]"."""
    return f"{of.words} [{printed_unit(of.unit) or '-'}]"


def printed_unit(unit: str) -> str:
    """Unit in print, with µ, superscripts and degree signs."""
    return unit.replace("um", "µm").replace("mm3", "mm³").replace("degC", "°C")


def parameter_columns(plan: AbstractPlan, units: Mapping[str, str], taken: Sequence[str]) -> list[Column]:
    """One column per parameter of the plan.

    Raises:
        ValueError: if a parameter has the name of another column.
    """
    for name in plan.names:
        if name in taken or name in (VARIANT, CONVERGED, STATUS):
            raise ValueError(f'parameter "{name}" has the name of another column of the table')
    limits = zip(plan.names, plan.low, plan.high)
    return [Column(described(name, units.get(name, "")), "parameter", low=low, high=high) for name, low, high in limits]


def result_columns(
    results: Sequence[Quantity], conditions: Conditions, measures: Sequence[AbstractMeasure]
) -> list[Column]:
    """Columns of all results, in the order of the evaluation.

    A single case gives one column, `ppte_um`. Several cases give one column per measure over all cases, `ppte_um_mean`.
    Several torques add columns for each torque, `ppte_um_25Nm`, and with manufactured gears `ppte_um_25Nm_q95`.

    Args:
        results: quantities to evaluate.
        conditions: loads and manufactured gears.
        measures: measures over the cases; empty for a single case.

    Raises:
        ValueError: for no or repeated results.
    """
    if not results or len({of.key for of in results}) != len(results):
        raise ValueError("results must be different and at least one")
    joins = [label(measure) for measure in measures] or [""]
    gears = joins if conditions.samples > 1 else [""]
    load = conditions.load
    torques = load.torques.tolist() if len(load.torques) > 1 else []
    speeds = [None] * len(torques) if load.speeds is None else load.speeds.tolist()
    columns = []
    for result in results:
        columns += [Column(result, statistic=join) for join in joins]
        columns += [
            Column(result, torque=torque, speed=speed, statistic=join)
            for torque, speed in zip(torques, speeds)
            for join in gears
        ]
    return columns


def over_torques(
    mesh: Mesh,
    torques: Iterable[float],
    *,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
) -> tuple[MeshCycle, ...]:
    """Mesh cycles of one design under several torques, by one compiled program for all kinds of modifications.

    Use it for figures and reports of a few designs; `jax.vmap` of `solve` is faster for many, and differentiable.

    Args:
        mesh: prepared mesh.
        torques: torques on the pinion [N m], in any order.
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
