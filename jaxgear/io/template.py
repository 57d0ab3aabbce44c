"""Modifications with named free parameters: what a design file holds before the parameters have values."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from ..microgeometry import AbstractModification, NoModification
from .errors import DesignFileError, suggestion
from .kinds import ListOf, Real
from .layout import Section
from .parts import CURVES, MODIFICATIONS, UNITS, Tables
from .toml import decode, join


@dataclass(frozen=True)
class Free:
    """A number that the file leaves open, with the key where it stands."""

    name: str
    key: str


@dataclass(frozen=True)
class Part:
    """A modification or a curve: its class, and its fields.

    A field is a number, a `Free` number, a list of both, a curve, or a choice among strings.
    """

    make: Callable[..., eqx.Module]
    fields: Mapping[str, Any]
    key: str

    def build(self, parameters: Mapping[str, Any]) -> Any:
        """The modification with the parameters in place of the open numbers; they may be tracers."""
        return self.make(**{name: _fill(value, parameters) for name, value in self.fields.items()})

    def free(self) -> Iterator[tuple[Free, str]]:
        """Every open number with its unit."""
        for name, value in self.fields.items():
            if isinstance(value, Part):
                yield from value.free()
            for item in value if isinstance(value, list) else [value]:
                if isinstance(item, Free):
                    yield item, UNITS.get(name, "")


def build(parts: list[Part], parameters: Mapping[str, Any]) -> AbstractModification:
    """The sum of the parts."""
    total = None
    for part in parts:
        term = part.build(parameters)
        total = term if total is None else total + term
    return NoModification() if total is None else total


def parse_modification(file: Path, key: str, table: Tables) -> Part:
    """A modification from its table.

    Raises:
        DesignFileError: for an unknown type, unknown or missing keys and wrong types.
    """
    return _parse(file, key, table, MODIFICATIONS)


def _parse(file: Path, key: str, table: Tables, known: Mapping[str, tuple[type, type[Section]]]) -> Part:
    name = table.get("type")
    if name is None:
        raise DesignFileError(file, join(key, "type"), f"missing, must be one of {', '.join(known)}")
    if not isinstance(name, str) or name not in known:
        raise DesignFileError(file, join(key, "type"), f'"{name}" is not known, {suggestion(name, known)}')
    make, struct = known[name]
    section = decode(file, key, {other: value for other, value in table.items() if other != "type"}, struct)
    fields: dict[str, Any] = {}
    for field, value in section.given().items():
        here, kind = join(key, field), struct.kind(field)
        if field == "curve":
            fields[field] = _parse(file, here, value, CURVES)
        elif isinstance(kind, Real):
            fields[field] = _open(value, here)
        elif isinstance(kind, ListOf):
            fields[field] = [_open(item, f"{here}[{i}]") for i, item in enumerate(value)]
        else:
            fields[field] = value
    return Part(make, fields, key)


def _open(value: float | str, key: str) -> float | Free:
    return Free(value, key) if isinstance(value, str) else value


def _fill(value, parameters):
    if isinstance(value, Part):
        return value.build(parameters)
    if isinstance(value, Free):
        return parameters[value.name]
    if isinstance(value, list) and any(isinstance(item, Free) for item in value):
        return jnp.stack([jnp.asarray(_fill(item, parameters)) for item in value])
    return value
