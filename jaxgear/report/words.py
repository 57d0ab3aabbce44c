"""Names of numbers as they stand in `summary.json`, as an engineer writes them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..metrics import quantities

# ending of a name -> unit; the first that fits counts
_UNITS = {
    "N_per_(ms^0.5K)": "N/(m s^0.5 K)",
    "kg_per_m^3": "kg/m^3",
    "N_per_mm": "N/mm",
    "N_per_um": "N/um",
    "mm2_per_s": "mm2/s",
    "m2_per_N": "m2/N",
    "percent": "%",
    "mm3": "mm3",
    "mm2": "mm2",
    "mm": "mm",
    "um": "um",
    "degC": "degC",
    "deg": "deg",
    "sqrt_MPa": "MPa^0.5",
    "MPa": "MPa",
    "Nm": "N m",
    "rpm": "rpm",
    "Hz": "Hz",
    "kg": "kg",
    "N": "N",
    "W": "W",
    "K": "K",
    "h": "h",
    "s": "s",
}
_DIGITS = 6  # of a number
_MOST = 12  # numbers of a list that are written out
_BETWEEN = " / "  # names of a number inside of another


def heading(name: str) -> str:
    """A name of `summary.json` in words: "max_flank_pressure_MPa" becomes "max flank pressure [MPa]"."""
    if name in quantities:
        return quantities[name].heading
    for ending, unit in _UNITS.items():
        if name.endswith(f"_{ending}"):
            return f"{name.removesuffix(f'_{ending}').replace('_', ' ')} [{unit}]"
    return name.replace("_", " ")


def text(value: Any) -> str:
    """A value in six digits, as the whole report writes it; "-" where there is none."""
    if isinstance(value, Mapping):
        return ", ".join(f"{heading(str(key))} {text(item)}" for key, item in value.items()) or "-"
    if isinstance(value, list | tuple) or np.ndim(value):
        items = list(value)
        shown = ", ".join(text(item) for item in items[:_MOST])
        return f"{shown}, ... ({len(items)} values)" if len(items) > _MOST else shown or "-"
    if isinstance(value, str) or value is None:
        return value or "-"
    number = np.asarray(value)[()]
    if isinstance(number, bool | np.bool_):
        return "yes" if number else "no"
    if isinstance(number, float | np.floating) and not np.isfinite(number):
        return "-"
    return f"{number:.{_DIGITS}g}" if isinstance(number, float | np.floating) else str(number)


def numbers(data: Mapping[str, Any], within: Sequence[str] = ()) -> Iterator[tuple[str, str]]:
    """Name and text of everything that nested data hold, in their order."""
    for name, value in data.items():
        names = (*within, heading(str(name)))
        if isinstance(value, Mapping) and value:
            yield from numbers(value, names)
        elif isinstance(value, list | tuple) and value and all(isinstance(item, Mapping) for item in value):
            for place, item in enumerate(value, 1):
                yield from numbers(item, (*names, str(place)))
        else:
            yield _BETWEEN.join(names), text(value)
