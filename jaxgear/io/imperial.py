"""Imperial numbers in a design file: keys that end in their unit, and diametral pitches.

`face_width_in = 1.5` is `face_width` of 38.1 mm; every number whose unit has an imperial one can be given so. The key
says the unit, so that no number is taken in another one, and the same key without it beside is refused.
"""

from collections.abc import Callable, Mapping
from typing import Any

from ..numerics import Number
from .errors import DesignFileError, join

_POUND_INCH = 0.45359237 * 9.80665 * 0.0254  # N m
_PSI = 1e-6 * 0.45359237 * 9.80665 / 0.0254**2  # MPa
# Ends of keys, longer ones first: by the unit of the library, what one of the end's is in it.
_ENDS: Mapping[str, Mapping[str, float]] = {
    "_lbf_in": {"N m": _POUND_INCH},
    "_lbf_ft": {"N m": 12 * _POUND_INCH},
    "_in": {"mm": 25.4, "um": 25.4e3},
    "_psi": {"MPa": _PSI},
    "_ksi": {"MPa": 1e3 * _PSI},
}
PITCH, NORMAL_PITCH = "diametral_pitch", "normal_diametral_pitch"  # teeth per inch of the reference diameter
_MODULE = "module"
_DIGITS = 15  # of a converted number: further ones are of the way


def names(units: Mapping[str, Number | None], like: str = "") -> dict[str, str]:
    """Keys of the library by their imperial keys.

    Args:
        units: number of every key of a table; None for what is no number.
        like: keys with the end of this one alone; "" for all.
    """
    ends = [end for end in _ENDS if like.endswith(end)][:1] if like else list(_ENDS)
    found = {
        f"{key}{end}": key
        for key, number in units.items()
        for end in ends
        if number is not None and number.unit in _ENDS[end]
    }
    if _MODULE in units and not like:
        found |= dict.fromkeys((PITCH, NORMAL_PITCH), _MODULE)
    return found


def metric(
    key: str, data: Mapping[str, Any], units: Mapping[str, Number | None]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Table with metric numbers in place of imperial ones, and the imperial key of every converted key.

    Args:
        key: key of the table.
        data: content of the table in the file.
        units: number of every key of the table; None for what is no number.

    Raises:
        DesignFileError: for a number that is given twice, is a variable, or is a pitch that is not positive.
    """
    if all(name in units for name in data):
        return dict(data), {}
    known = names(units)
    found: dict[str, Any] = dict(data)
    written: dict[str, str] = {}
    for name, value in data.items():
        if name in units or name not in known:
            continue
        plain, where = known[name], join(key, name)
        if plain in found:
            raise DesignFileError(where, f"has no effect beside {written.get(plain, plain)}, leave one out")
        del found[name]
        number = units[plain]
        assert number is not None
        found[plain], written[plain] = _converted(where, value, _factor(where, name, plain, number), number.unit), name
    return found, written


def _factor(where: str, name: str, plain: str, number: Number) -> Callable[[float], float]:
    if plain == _MODULE and name in (PITCH, NORMAL_PITCH):

        def of_pitch(pitch: float) -> float:
            if not pitch > 0:
                raise DesignFileError(where, f"{pitch:g} teeth per inch must be greater than 0")
            return 25.4 / pitch

        return of_pitch
    by = _ENDS[name.removeprefix(plain)][number.unit]
    return lambda value: by * value


def _converted(where: str, value: Any, convert: Callable[[float], float], unit: str) -> Any:
    if isinstance(value, list):
        return [_converted(f"{where}[{index}]", item, convert, unit) for index, item in enumerate(value)]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DesignFileError(
            where, f"must be a number: variables and tables are in {unit}, under the key without unit"
        )
    return float(f"{convert(value):.{_DIGITS}g}")
