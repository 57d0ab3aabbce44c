"""Types of values in a design file: what may stand after a key, how it is checked and how it is described.

What is wrong with a value is said in one line, with its full key.
"""

import dataclasses
import datetime
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ..numerics import Number, fields_of
from ..tolerance import ToleranceClass
from .errors import DesignFileError, join, not_known
from .template import Free
from .trade_words import remark_on

# Magnitudes that an engineer can mean, by unit: (least of a number that must be positive, most). Beyond them the number
# or its unit is a slip, and arithmetic on it overflows or loses all digits.
PLAUSIBLE: Mapping[str, tuple[float, float]] = {
    "mm": (1e-3, 1e5),
    "um": (1e-6, 1e5),
    "N m": (1e-6, 1e9),
    "rpm": (1e-3, 1e7),
    "revolutions": (1e-3, 1e15),
    "MPa": (1.0, 1e7),
    "kg/m^3": (50.0, 5e4),
    "N/(m s^0.5 K)": (1.0, 1e6),
}
_PURE = (1e-9, 1e9)


def outside(number: Number, value: float, *, plausible: bool = True) -> str:
    """Message on a number that is not finite, out of its range or, if `plausible`, of an unusual size, else ""."""
    unit = f" {number.unit}" if number.unit else ""
    if isinstance(value, float) and not math.isfinite(value):
        return f"{value} must be finite"
    shown = f"{_shortened(value)}{unit}"
    if abs(value) > sys.float_info.max:  # a whole number, which no calculation can take
        return f"{shown} must be at most {sys.float_info.max:g}"
    low, high = number.low, number.high
    if low is not None and (value <= low if number.open_low else value < low):
        return f"{shown} must be {allowed(number)}"
    if high is not None and (value >= high if number.open_high else value > high):
        return f"{shown} must be {allowed(number)}"
    least, most = PLAUSIBLE.get(number.unit, _PURE)
    positive = low is not None and low >= 0 and number.open_low
    limited = low is not None and high is not None  # the class itself says what can be meant
    if plausible and not limited and (abs(value) > most or (positive and value < least)):
        floor = least if positive else -most if low is None else low
        return f"{shown} must be at least {floor:g}{unit} and at most {most:g}{unit}"
    return ""


def _shortened(value: float) -> str:
    """A number as text, of any size."""
    if isinstance(value, float):
        return f"{value:g}"
    if abs(value) < 10**12:
        return str(value)
    digits = int(abs(value).bit_length() * math.log10(2)) + 1
    return f"a whole number of about {digits} digits"


def allowed(number: Number) -> str:
    """The range as text, "" without limits."""
    unit = f" {number.unit}" if number.unit else ""
    parts = []
    if number.low is not None:
        parts.append(f"{'greater than' if number.open_low else 'at least'} {number.low:g}{unit}")
    if number.high is not None:
        high = str(int(number.high)) if number.whole else f"{number.high:g}"
        parts.append(f"{'less than' if number.open_high else 'at most'} {high}{unit}")
    return " and ".join(parts)


@dataclass(frozen=True, eq=False)
class ValueType:
    """Type of the value of a key.

    Attributes:
        words: allowed values in words, for messages and the reference.
        read: function of the key and the raw value that returns the value; raises `DesignFileError` if not allowed.
        number: unit and range of the number or numbers; None for other values.
        container: list or dict; None for a plain value.
        default: value of a key that the file does not have; `...` for a required key.
        meaning: meaning of the key for the reference; "" for that in the docstring of its table.
    """

    words: str
    read: Callable[[str, Any], Any]
    number: Number | None = None
    container: type | None = None
    default: Any = None
    meaning: str = ""


def real(limits: Number = Number(), *, open: bool = False, plausible: bool = True) -> ValueType:
    """A number.

    Args:
        limits: unit and range.
        open: the name of a variable may stand for it, which is read as `Free`.
        plausible: True if the magnitude must be plausible; False if that is checked later, when the unit is known.
    """
    words = "a whole number" if limits.whole else "a number"
    words += " or the name of a variable" if open else ""

    def read(key: str, value: Any) -> Any:
        if open and isinstance(value, str) and value:
            if _is_number(value):
                raise DesignFileError(key, not_of_kind("a number", value))
            return Free(value, key, limits)
        if isinstance(value, bool) or not isinstance(value, int if limits.whole else int | float):
            raise DesignFileError(key, not_of_kind(words, value) + remark_on(key, value))
        if problem := outside(limits, value, plausible=plausible):
            raise DesignFileError(key, problem + remark_on(key, value))
        return value if limits.whole else float(value)

    return ValueType(words, read, limits)


def count(low: int, high: int) -> ValueType:
    """A whole number; the upper limits keep a slip of the finger from filling the memory or compiling for hours."""
    return real(Number(low=low, high=high, whole=True))


def positive(unit: str) -> ValueType:
    """A number greater than zero."""
    return real(Number(unit, low=0.0, open_low=True))


def text(*, empty: bool = False) -> ValueType:
    """A string; `empty` allows the empty one."""
    return _plain("a string", lambda value: _no_text(value) or ("" if value or empty else '"" is empty'))


def switch() -> ValueType:
    """True or false."""
    words = "true or false"
    return _plain(words, lambda value: "" if isinstance(value, bool) else not_of_kind(words, value))


def choice(*names: str) -> ValueType:
    """One of several names."""
    words = "one of " + ", ".join(f'"{name}"' for name in names)
    return _plain(words, lambda value: _no_text(value) or ("" if value in names else not_known(value, names)))


def list_of(item: ValueType, *, length: int | None = None, empty: bool = False) -> ValueType:
    """A list of a length, None for any; `empty` allows the empty one."""

    def read(key: str, value: Any) -> list[Any]:
        _check_container(key, value, list, empty)
        if length is not None and len(value) != length:
            raise DesignFileError(key, f"must be a list of length {length}, not {len(value)}")
        return [item.read(f"{key}[{index}]", each) for index, each in enumerate(value)]

    return ValueType(f"a list, each {item.words}", read, item.number, list)


def rows_of(item: ValueType) -> ValueType:
    """A list of rows, lists that are as long as the first."""
    rows = list_of(list_of(item))

    def read(key: str, value: Any) -> list[list[Any]]:
        found = rows.read(key, value)
        for number, row in enumerate(found):
            if len(row) != len(found[0]):
                problem = f"row {number} has {len(row)} numbers, must have {len(found[0])} as the first"
                raise DesignFileError(key, problem)
        return found

    return dataclasses.replace(rows, read=read)


def table(item: ValueType | None = None) -> ValueType:
    """A table with keys of its own and values of one kind; None for a table that is looked into later."""

    def read(key: str, value: Any) -> dict[str, Any]:
        _check_container(key, value, dict, empty=item is None)
        return value if item is None else {name: item.read(join(key, name), each) for name, each in value.items()}

    return ValueType("a table", read, None if item is None else item.number, dict)


def either(plain: ValueType, many: ValueType, words: str) -> ValueType:
    """A plain value, or a list or table."""

    def read(key: str, value: Any) -> Any:
        if isinstance(value, list | dict) and not isinstance(value, many.container or ()):
            raise DesignFileError(key, f"must be {words}")
        return (many if isinstance(value, list | dict) else plain).read(key, value)

    return ValueType(words, read, plain.number, many.container)


def not_of_kind(wanted: str, value: object) -> str:
    """`must be a number, not a string`."""
    return f"must be {wanted}, not {_kind(value)}"


def _plain(words: str, problem: Callable[[Any], str]) -> ValueType:
    """A value that is taken as it is, unless there is a problem with it."""

    def read(key: str, value: Any) -> Any:
        if found := problem(value):
            raise DesignFileError(key, found)
        return value

    return ValueType(words, read)


def _no_text(value: Any) -> str:
    return "" if isinstance(value, str) else not_of_kind("a string", value)


def _check_container(key: str, value: Any, of: type, empty: bool) -> None:
    if not isinstance(value, of):
        raise DesignFileError(key, not_of_kind("a list" if of is list else "a table", value))
    if not value and not empty:
        raise DesignFileError(key, f"{value} is empty")


def _is_number(value: str) -> bool:
    """Whether a number was put into quotes."""
    try:
        float(value)
    except ValueError:
        return False
    return True


def _kind(value: Any) -> str:
    if isinstance(value, bool):
        return "true or false"
    if isinstance(value, int | float):
        return "a number"
    if isinstance(value, str):
        return "a string" if value else "an empty string"
    if isinstance(value, datetime.date | datetime.time):
        return "a date or time"
    return "a list" if isinstance(value, list) else "a table"


SEED = count(0, 2**31 - 1)  # what every generator of random numbers takes
LEVEL = count(2, 10_000)
QUALITY_CLASS = real(fields_of(ToleranceClass)["quality_class"])
QUALITY_CLASSES = either(QUALITY_CLASS, list_of(QUALITY_CLASS, length=2), "a whole number, or a list of two")
WEIGHTS = list_of(real(Number(low=0.0)))
