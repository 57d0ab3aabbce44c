"""Writes a gear pair with its modifications and its load as a design file."""

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import Gear, GearPair
from ..microgeometry import AbstractModification
from ..numerics import check, fields_of
from ..numerics.durable import write_durably
from .errors import printable
from .folder import writing
from .results import describe, unit_of


def write_design(
    path: str | Path,
    pair: GearPair,
    *,
    torque: float,
    pinion: AbstractModification,
    wheel: AbstractModification,
    speed: float | None = None,
    quality_classes: tuple[int, int] | None = None,
    title: str = "",
) -> None:
    """Writes a design file. It appears as a whole or not at all, in place of an earlier one.

    Args:
        path: of the TOML file.
        pair: gear pair of concrete numbers.
        torque: on the pinion [N m].
        pinion, wheel: modifications of the flanks, of the library's classes and their sums.
        speed: of the pinion [rpm].
        quality_classes: flank tolerance classes of pinion and wheel (ISO 1328-1:2013).
        title: free text.

    Raises:
        ValueError: for a torque that is not positive, or where the file cannot be written.
    """
    check("write_design", "torque", torque, "N m", low=0.0, open_low=True)
    lines = [f"title = {_text(printable(title))}", ""] if title else []
    for name, quality in zip(("pinion", "wheel"), quality_classes or (None, None)):
        classes = [] if quality is None else [f"quality_class = {quality}  # ISO 1328-1"]
        lines += [f"[{name}]", *_gear(getattr(pair, name)), *classes, ""]
    mounting = []
    if pair.center_distance is not None:
        mounting.append(f"center_distance = {_value(pair.center_distance)}  # mm")
    if float(pair.axial_offset) != 0:
        mounting.append(f"axial_offset = {_value(pair.axial_offset)}  # mm")
    lines += ["[pair]", *mounting, ""] if mounting else []
    lines += ["[load]", f"torque = {_value(torque)}  # N m, on the pinion"]
    lines += [f"speed = {_value(speed)}  # rpm, of the pinion"] if speed is not None else []
    for name, modification in (("pinion", pinion), ("wheel", wheel)):
        for term in describe(modification):
            lines += ["", f"[[{name}.modification]]", *_term(term)]
    text = "\n".join(lines) + "\n"
    with writing(path):
        write_durably(Path(path), lambda file: file.write(text.encode("utf-8")))


def _gear(gear: Gear) -> Iterator[str]:
    numbers = fields_of(Gear)
    for name, number in numbers.items():
        value = getattr(gear, name)
        if value is not None:
            yield _line(name, int(value) if number.whole else value, number.unit)
    material = {name: getattr(gear.material, name) for name in fields_of(type(gear.material))}
    yield _line("material", material, "")


def _term(term: Mapping[str, Any]) -> Iterable[str]:
    return (_line(name, value, unit_of(term["type"], name)) for name, value in term.items())


def _line(name: str, value: Any, unit: str) -> str:
    comment = f"  # {unit}" if unit else ""
    return f"{name} = {_value(value)}{comment}"


def _value(value: Any) -> str:
    """A value in TOML; numbers by the shortest digits that read back as the same number."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{name} = {_value(item)}" for name, item in value.items()) + " }"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _text(value)
    array = np.asarray(value)
    return "[" + ", ".join(_value(item) for item in array) + "]" if array.ndim else str(array[()])


def _text(text: str) -> str:
    """A basic string of TOML, whose escapes are those of JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
