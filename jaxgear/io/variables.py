"""The table [variables]: numbers of the file that are left open."""

import re
from collections.abc import Iterable, Sequence

from . import schema, template
from .errors import DesignFileError, suggestion
from .ranges import outside
from .toml import decode

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
