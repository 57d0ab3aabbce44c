"""Objects of the library with named free parameters: what a design file holds before the parameters have values."""

import difflib
import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from ..contact import Mesh, Resolution, prepare
from ..microgeometry import AbstractModification, NoModification
from ..numerics import Number, fields_of, real
from ..shafts import RigidSupport
from .errors import DesignFileError, check_known, join, not_known, problem
from .table_keys import FileTable, decode, family, modules_of, section_of

# `tip_diameter = 3 mm must be`, `wheel module = 4 mm must be`: what the library says of a field
_FIELD = re.compile(r"((?P<part>\w+) )?(?P<name>\w+)(( =|:) | (?=has shape ))")


@dataclass(frozen=True)
class Free:
    """A number that the file leaves open.

    Attributes:
        name: of the variable.
        key: where it stands.
        number: what may stand there.
    """

    name: str
    key: str
    number: Number


class Part(eqx.Module):
    """An object of the library: its class, and those of its fields that the file gives.

    A field is a number, a `Free` number, a list of both, another part, or a choice among strings. Numbers are arrays:
    a program that is compiled for a part serves the same part with other numbers.
    """

    make: Callable[..., eqx.Module] = eqx.field(static=True)
    fields: dict[str, Any]
    key: str = eqx.field(static=True)

    def build(self, parameters: Mapping[str, Any]) -> Any:
        """The object with the parameters in place of the open numbers; they may be tracers.

        Raises:
            DesignFileError: for what the class refuses, with the key of the field where the file gives it.
        """
        given = {name: _fill(value, parameters) for name, value in self.fields.items()}
        try:
            return self.make(**given)
        except (ValueError, OverflowError) as error:
            text = problem(error)
            field = _FIELD.match(text)
            owner = self.fields.get(field["part"]) if field and field["part"] else self
            if field and isinstance(owner, Part):
                said = text[field.end() :]
                if field["name"] in owner.fields or said.startswith("missing"):
                    raise DesignFileError(join(owner.key, field["name"]), said) from error
            raise DesignFileError(self.key, text) from error

    def free(self) -> list[Free]:
        """Every open number."""
        return _open([*self.fields.values()])


def build(parts: list[Part], parameters: Mapping[str, Any]) -> AbstractModification:
    """The sum of the parts."""
    terms = [part.build(parameters) for part in parts]
    return reduce(add, terms) if terms else NoModification()


def parse(key: str, table: Mapping[str, Any] | str, cls: type[eqx.Module]) -> Part:
    """An object from its table, or from the name of its type where that says all.

    Its `type` says which class derived from an abstract one it is of.
    """
    if inspect.isabstract(cls):
        known = family(cls)
        if isinstance(table, str):
            check_known(key, table, known)
            table = {"type": table}
        name = table.get("type")
        misspelt = difflib.get_close_matches("type", table, n=1)
        if name is None and misspelt:
            raise DesignFileError(join(key, misspelt[0]), 'unknown key, did you mean "type"?')
        if name is None:
            raise DesignFileError(join(key, "type"), f"missing, must be one of {', '.join(known)}")
        if not isinstance(name, str) or name not in known:
            raise DesignFileError(join(key, "type"), not_known(name, known))
        cls, table = known[name], {other: value for other, value in table.items() if other != "type"}
    return part_of(key, decode(key, table, section_of(cls)), cls)


def part_of(key: str, section: FileTable, cls: type[eqx.Module], *, without: tuple[str, ...] = ()) -> Part:
    """An object from its decoded table, `without` some of its keys."""
    numbers, modules = fields_of(cls), modules_of(cls)
    fields: dict[str, Any] = {}
    for name, value in section.given().items():
        here = join(key, name)
        if name in without:
            continue
        if name in modules:
            fields[name] = parse(here, value, modules[name])
        elif name in numbers:
            fields[name] = opened(value, here, numbers[name])
        elif name in section_of(cls).keys:
            fields[name] = value
    return Part(cls, fields, key)


def opened(value, key: str, number: Number):
    """A value of a file, with `Free` in place of the names of variables."""
    if isinstance(value, list):
        return [opened(item, f"{key}[{i}]", number) for i, item in enumerate(value)]
    if isinstance(value, str):
        return Free(value, key, number)
    # an amount of zero is known to do nothing only as long as nobody traces it
    return real(value) if value and not number.static else value


def _open(value) -> list[Free]:
    if isinstance(value, Part):
        return value.free()
    if isinstance(value, list):
        return [free for item in value for free in _open(item)]
    return [value] if isinstance(value, Free) else []


def _fill(value, parameters):
    if isinstance(value, Part):
        return value.build(parameters)
    if isinstance(value, Free):
        return parameters[value.name]
    if isinstance(value, list) and _open(value):
        return jnp.stack([jnp.asarray(_fill(item, parameters), float) for item in value])
    return value


class FileDesign(eqx.Module):
    """The flanks of a design file as a function of its free parameters; pure and traceable.

    Attributes:
        names: of the parameters.
        pinion, wheel: the modifications, which are added up.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    pinion: list[Part]
    wheel: list[Part]

    def __call__(self, parameters: Mapping[str, Any]) -> tuple[AbstractModification, AbstractModification]:
        """Modifications of pinion and wheel.

        Args:
            parameters: value of every free parameter, scalar.
        """
        if set(parameters) != set(self.names):
            raise ValueError(
                f"design: parameters {', '.join(sorted(parameters)) or '(none)'} must be those of the file: "
                f"{', '.join(sorted(self.names)) or '(none)'}"
            )
        return build(self.pinion, parameters), build(self.wheel, parameters)


class FileMesh(eqx.Module):
    """The prepared mesh of a design file as a function of its free parameters; pure and traceable."""

    pair: Part
    model: Part
    misalignment: Part
    resolution: Resolution

    def __call__(self, parameters: Mapping[str, Any]) -> Mesh:
        """The mesh."""
        pair, compliance = self.pair.build(parameters), self.model.build(parameters)
        axes = RigidSupport(pair, self.misalignment.build(parameters)) if self.misalignment.fields else None
        return prepare(pair, compliance=compliance, resolution=self.resolution, support=axes)
