"""Values of a REXS file as text."""

import base64
import binascii
import re
from decimal import Decimal

import numpy as np

from ..io.errors import DesignFileError

_TEXTS = ("model_name",)  # the other words are of lists
_CODES = {"float64": "<f8", "float32": "<f4", "int32": "<i4"}


def kind_of(name: str, value: object, unit: str) -> str:
    """The type of a value; text is a word of a list, or a number that `shifted` wrote."""
    if isinstance(value, bool):
        return "boolean"
    if name in _TEXTS:
        return "string"
    array = np.asarray(value)
    kind = "integer" if array.dtype.kind == "i" else "floating_point"
    if array.dtype.kind == "U" and unit == "none":
        kind = "enum"
    return f"{kind}_array" if array.ndim else kind


def checked_version(version: str) -> str:
    """The version of a file, if it is one."""
    if not re.fullmatch(r"\d+(\.\d+){1,2}", version, re.ASCII):
        raise DesignFileError("model: version", f'"{version}" is not a version of REXS')
    return version


def whole(text: object, where: str) -> int:
    """A whole number, as ids are."""
    if not isinstance(text, str) or not re.fullmatch(r"\s*[+-]?\d{1,9}\s*", text, re.ASCII):
        raise DesignFileError(where, f'"{str(text)[:40]}" is not a whole number')
    return int(text)


def written(value: object) -> str | tuple[str, ...]:
    """A value as text: numbers by the shortest digits that read back as the same number."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    array = np.asarray(value)
    return tuple(str(item) for item in array) if array.ndim else str(array[()])


def shifted(value: object, shift: int) -> str | tuple[str, ...]:
    """Numbers times 10^shift as text; the shift is of the decimal digits, so that it is exact."""
    text = written(value)
    if isinstance(text, tuple):
        return tuple(_shift(item, shift) for item in text)
    return _shift(text, shift)


def _shift(text: str, shift: int) -> str:
    number = Decimal(text)
    return str(number.scaleb(shift).normalize()) if number else "0.0"


def decoded(text: str, code: str) -> tuple[str, ...]:
    """The numbers of an array in base64, little-endian (REXS 1.4).

    Raises:
        ValueError: where it is none.
    """
    if code not in _CODES:
        raise ValueError(f'code "{code}" is not known, must be one of {", ".join(_CODES)}')
    try:
        content = base64.b64decode("".join(text.split()), validate=True)
        return tuple(str(item) for item in np.frombuffer(content, _CODES[code]))
    except (binascii.Error, ValueError):
        raise ValueError(f"is not an array of {code} in base64") from None
