"""The table [variables], and tables that make sense by themselves or beside one other."""

import re
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from . import schema, template
from .errors import DesignFileError, suggestion
from .gears import with_quality
from .model import FINITE_ELEMENTS
from .schema import METHODS_WITHOUT_VARIABLES
from .table_keys import FileTable, decode
from .value_types import outside

_QUANTITY = re.compile(r"\s*[-+]?[.,]?\d")


def read_variables(
    tables: schema.Tables, open_numbers: Iterable[template.Free], empty: Sequence[str] = ()
) -> tuple[dict[str, tuple[float, float]], dict[str, str], dict[str, float]]:
    """Bounds, units and, where they are given, values of the free parameters, each declared once and used.

    Args:
        tables: the variables.
        open_numbers: the places in the file where their names stand.
        empty: keys of lists without an entry, in which a name could have been.
    """
    bounds: dict[str, tuple[float, float]] = {}
    units: dict[str, str] = {}
    values: dict[str, float] = {}
    for name, table in tables.items():
        key = f"variables.{name}"
        variable = decode(key, table, schema.VariableSection)
        increasing(f"{key}.high", variable.low, variable.high)
        bounds[name] = (variable.low, variable.high)
        if variable.value is not None:
            values[name] = variable.value
            if not variable.low <= variable.value <= variable.high:
                problem = f"{variable.value:g} must be at least {variable.low:g} and at most {variable.high:g}"
                raise DesignFileError(f"{key}.value", problem)
    for free in open_numbers:
        unit = free.number.unit
        if free.name not in bounds:
            if _QUANTITY.match(free.name):  # "250 Nm", or 2,5
                raise DesignFileError(free.key, f'"{free.name}" must be a number{f" in {unit}" if unit else ""} alone')
            known = suggestion(free.name, bounds) if bounds else "there is no [variables] table"
            raise DesignFileError(free.key, f'"{free.name}" is not a variable, {known}')
        other = units.setdefault(free.name, unit)
        if other != unit:
            problem = f"{free.name} stands for {_quantity(unit)} here and for {_quantity(other)} elsewhere"
            raise DesignFileError(free.key, problem)
        for end, bound in zip(("low", "high"), bounds[free.name]):
            if problem := outside(free.number, bound):
                raise DesignFileError(f"variables.{free.name}.{end}", f"{problem} as {free.key}")
    for name, table in tables.items():
        if name not in units:
            where = f"{' and '.join(empty)} = [] has no modification" if empty else "no number of the file has its name"
            problem = f'is declared but used nowhere: {where}, write "{name}" in place of the number that it stands for'
            raise DesignFileError(f"variables.{name}", problem)
        unit = table.get("unit")
        if unit is not None and unit != units[name]:
            raise DesignFileError(f"variables.{name}.unit", f'"{unit}" must be "{units[name]}" as it is used')
    return bounds, {name: units[name] for name in bounds}, values


def _quantity(unit: str) -> str:
    return f"a quantity in {unit}" if unit else "a pure number"


def increasing(key: str, low: float, high: float, unit: str = "") -> None:
    """Refuses an upper limit that is not above the lower one."""
    if high <= low:
        raise DesignFileError(key, f"{high:g}{unit} must be greater than {low:g}{unit}")


S = TypeVar("S", bound=FileTable)


def optional(name: str, table: schema.Tables | None, section: type[S]) -> S | None:
    """What a table says; None where the file has none of that name."""
    return None if table is None else decode(name, table, section)


def load_of(table: schema.Tables) -> schema.LoadSection:
    """Of what the gears carry."""
    load = decode("load", table, schema.LoadSection)
    if load.torque_range is not None:
        low, high = load.torque_range
        increasing("load.torque_range[1]", low, high, unit=" N m")
    return load


def optimize_of(top: schema.FileSection, stiffness: schema.ModelSection) -> Any:
    """The search, with its defaults where the file has no such table."""
    optimize = decode("optimize", top.optimize or {}, schema.optimize_section())
    if top.optimize is not None and not top.variables and optimize.method not in METHODS_WITHOUT_VARIABLES:
        raise DesignFileError("optimize", "has no effect without [variables]")
    if optimize.verify and stiffness.structure == FINITE_ELEMENTS:
        raise DesignFileError("optimize.verify", f'has no effect with model.structure = "{FINITE_ELEMENTS}"')
    return optimize


def sweep_of(top: schema.FileSection) -> schema.SweepSection | None:
    """Variants to be evaluated; None without such a table."""
    if top.sweep is not None and not top.variables:
        raise DesignFileError("sweep", "has no effect without [variables]")
    return optional("sweep", top.sweep, schema.SweepSection)


def tolerance_of(top: schema.FileSection, quality: Any) -> schema.ToleranceSection | None:
    """Deviations of manufactured gears, by the quality classes of the gears where it names none; None without it."""
    tolerance = optional("tolerance", top.tolerance, schema.ToleranceSection)
    return None if tolerance is None else with_quality("tolerance", tolerance, quality)
