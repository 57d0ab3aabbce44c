"""Objects of the library with named free parameters: what a design file holds before the parameters have values."""

import dataclasses
import re
from collections.abc import Callable, Mapping
from functools import reduce
from operator import add
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from ..microgeometry import AbstractModification, NoModification
from ..numerics import Number
from .errors import DesignFileError, join, problem

# `tip_diameter = 3 mm must be`, `wheel module = 4 mm must be`: what the library says of a field
_FIELD = re.compile(r"((?P<part>\w+) )?(?P<name>\w+)(( =|:) | (?=has shape ))")


@dataclasses.dataclass(frozen=True)
class Free:
    """A number that the file leaves open.

    Attributes:
        name: name of the variable.
        key: key of the number in the file.
        number: unit and range of the number.
        opposite: True if the number is minus the variable.
    """

    name: str
    key: str
    number: Number
    opposite: bool = False


class Template(eqx.Module):
    """An object of the library: its class, and those of its fields that the file gives.

    A field is a number, a `Free` number, a list of both, another template, or a string. Numbers are arrays, so that a
    compiled program serves the same template with other numbers.
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
            if field and isinstance(owner, Template):
                said = text[field.end() :]
                if field["name"] in owner.fields or said.startswith("missing"):
                    raise DesignFileError(join(owner.key, field["name"]), said) from error
            raise DesignFileError(self.key, text) from error

    def having(self, **fields: object) -> "Template":
        """Copy of the template with further fields."""
        return dataclasses.replace(self, fields={**self.fields, **fields})

    def free(self) -> list[Free]:
        """Every open number."""
        return _open([*self.fields.values()])


def build(templates: list[Template], parameters: Mapping[str, Any]) -> AbstractModification:
    """Sum of the modifications of several templates."""
    terms = [template.build(parameters) for template in templates]
    return reduce(add, terms) if terms else NoModification()


def _open(value) -> list[Free]:
    if isinstance(value, Template):
        return value.free()
    if isinstance(value, list):
        return [free for item in value for free in _open(item)]
    return [value] if isinstance(value, Free) else []


def _fill(value, parameters):
    if isinstance(value, Template):
        return value.build(parameters)
    if isinstance(value, Free):
        return -parameters[value.name] if value.opposite else parameters[value.name]
    if isinstance(value, list) and _open(value):
        return jnp.stack([jnp.asarray(_fill(item, parameters), float) for item in value])
    return value
