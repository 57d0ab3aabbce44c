"""The table [variables]."""

import re
from collections.abc import Iterable, Mapping, Sequence

from .errors import DesignFileError, suggestion
from .table_keys import FileTable, entry
from .template import Free
from .trade_words import remark_on
from .value_types import outside, real, text

_BOUND = real(plausible=False)
_QUANTITY = re.compile(r"\s*[-+]?[.,]?\d")


class VariableSection(FileTable):
    """A number of the file that is left open: it is named in place of a number.

    Attributes:
        low, high: least and greatest value, in the unit of the number that it stands for.
        value: between both, for `jaxgear analyze`, which needs numbers.
        unit: checked against its use.
    """

    low: float = entry(_BOUND, ...)
    high: float = entry(_BOUND, ...)
    value: float | None = entry(_BOUND)
    unit: str | None = entry(text(empty=True))


def read_variables(
    variables: Mapping[str, VariableSection], open_numbers: Iterable[Free], empty: Sequence[str] = ()
) -> tuple[dict[str, tuple[float, float]], dict[str, str], dict[str, float]]:
    """Bounds, units and, where they are given, values of the free parameters, each declared once and used.

    Args:
        variables: the tables, by their names.
        open_numbers: the places in the file where their names stand.
        empty: keys of lists without an entry, in which a name could have been.
    """
    units: dict[str, str] = {}
    for variable in variables.values():
        increasing(f"{variable.key}.high", variable.low, variable.high)
        if variable.value is not None and not variable.low <= variable.value <= variable.high:
            problem = f"{variable.value:g} must be at least {variable.low:g} and at most {variable.high:g}"
            raise DesignFileError(f"{variable.key}.value", problem)
    bounds = {name: (variable.low, variable.high) for name, variable in variables.items()}
    values = {name: variable.value for name, variable in variables.items() if variable.value is not None}
    for free in open_numbers:
        unit = free.number.unit
        if free.name not in bounds:
            if _QUANTITY.match(free.name):  # "250 Nm", or 2,5
                problem = f'"{free.name}" must be a number{f" in {unit}" if unit else ""} alone'
                raise DesignFileError(free.key, problem + remark_on(free.key, free.name))
            known = suggestion(free.name, bounds) if bounds else "there is no [variables] table"
            raise DesignFileError(free.key, f'"{free.name}" is not a variable, {known}')
        other = units.setdefault(free.name, unit)
        if other != unit:
            problem = f"{free.name} stands for {_quantity(unit)} here and for {_quantity(other)} elsewhere"
            raise DesignFileError(free.key, problem)
        for end, bound in zip(("low", "high"), bounds[free.name]):
            if problem := outside(free.number, bound):
                raise DesignFileError(f"variables.{free.name}.{end}", f"{problem} as {free.key}")
    for name, variable in variables.items():
        if name not in units:
            where = f"{' and '.join(empty)} = [] has no modification" if empty else "no number of the file has its name"
            problem = f'is declared but used nowhere: {where}, write "{name}" in place of the number that it stands for'
            raise DesignFileError(variable.key, problem)
        if variable.unit is not None and variable.unit != units[name]:
            raise DesignFileError(f"{variable.key}.unit", f'"{variable.unit}" must be "{units[name]}" as it is used')
    return bounds, {name: units[name] for name in bounds}, values


def _quantity(unit: str) -> str:
    return f"a quantity in {unit}" if unit else "a pure number"


def increasing(key: str, low: float, high: float, unit: str = "") -> None:
    """Refuses an upper limit that is not above the lower one."""
    if high <= low:
        raise DesignFileError(key, f"{high:g}{unit} must be greater than {low:g}{unit}")
