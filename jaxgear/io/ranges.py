"""Ranges of the numbers in a design file, and what is wrong with a number outside."""

import math
from collections.abc import Mapping

from ..numerics import Number

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
    """What is wrong with a number, "" if it is finite and within its range and, if `plausible`, an engineer's."""
    unit = f" {number.unit}" if number.unit else ""
    if isinstance(value, float) and not math.isfinite(value):
        return f"{value} must be finite"
    shown = f"{_shortened(value)}{unit}"
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
