"""Quantities that need more than a cycle: settings, as plain data, so that compiled programs know them again."""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax

from ..contact import MeshCycle
from ..numerics import Checked, concrete
from .quantity import Quantity, quantities


@dataclasses.dataclass(frozen=True)
class WithSettings:
    """Computes a quantity from a cycle and settings; equal settings make equal ones.

    Attributes:
        name: of the quantity.
        of: a function of this object and the cycle.
        make: class of the settings.
        fields: their values.
    """

    name: str
    of: Callable[["WithSettings", MeshCycle], Any]
    make: type[Any]
    fields: tuple[tuple[str, Any], ...]

    @property
    def settings(self) -> Any:
        """The settings."""
        return _made(self.make, self.fields)

    def __call__(self, cycle: MeshCycle) -> Any:
        return self.of(self, cycle)


class _Within(NamedTuple):
    """Settings that are a field of others."""

    make: type[Any]
    fields: tuple[tuple[str, Any], ...]


def _made(make: type[Any], fields: tuple[tuple[str, Any], ...]) -> Any:
    return make(**{name: _made(*value) if isinstance(value, _Within) else value for name, value in fields})


def settled(name: str, settings: Checked, of: Callable[[WithSettings, MeshCycle], Any]) -> WithSettings:
    """What computes a quantity with settings of concrete numbers.

    Raises:
        ValueError: for settings that are being traced.
    """
    return WithSettings(name, of, *_plain(settings))


def _plain(settings: Checked) -> _Within:
    owner = type(settings).__name__
    names = [field.name for field in dataclasses.fields(settings)]
    return _Within(type(settings), tuple((field, _hashable(owner, field, getattr(settings, field))) for field in names))


@dataclasses.dataclass(frozen=True)
class WithoutSettings:
    """Stands in the vocabulary, where names are looked up.

    Attributes:
        name: of the quantity.
        settings: class that gives it, as it is written.
        table: of a design file that holds them.
        of: computes it from a cycle and the settings; None where the class does it by itself.
        needs: field of the settings that must be given.
        otherwise: computes it from a cycle alone; None where nothing can.
        operating_point: what the load must say for that: fields of an `OperatingPoint`.
        given: computes it from the settings as plain data and a cycle, where that takes more than `of`; None for `of`.
    """

    name: str
    settings: str
    table: str
    of: Callable[[MeshCycle, Any], Any] | None = None
    needs: str | None = None
    otherwise: Callable[[MeshCycle], Any] | None = None
    operating_point: tuple[str, ...] = ()
    given: Callable[[WithSettings, MeshCycle], Any] | None = None

    def __call__(self, cycle: MeshCycle) -> Any:
        if self.otherwise is not None:
            return self.otherwise(cycle)
        raise ValueError(
            f'{self.name}: needs settings, give {self.settings}(...).quantity("{self.name}"), or a design '
            f"file with the table [{self.table}]"
        )


def with_settings(name: str, settings: Checked) -> Quantity:
    """A quantity of the vocabulary with the settings that it needs; equal settings make equal quantities.

    Args:
        name: of a quantity that the class of the settings gives.
        settings: of concrete numbers.

    Raises:
        ValueError: for another name, settings that are being traced, or a field that must be given and is not.
    """
    owner = type(settings).__name__
    stands = _given_by(owner, quantities.get(name))
    if stands is None or stands.name != name:
        known = ", ".join(each.name for each in quantities.values() if _given_by(owner, each))
        raise ValueError(f'{owner}: quantity "{name}" is not known, must be one of {known}')
    if stands.needs is not None and getattr(settings, stands.needs) is None:
        raise ValueError(f'{owner}: quantity "{name}" needs {stands.needs}')
    return dataclasses.replace(quantities[name], of=settled(name, settings, stands.given or _by_settings))


def of_tables(name: str, tables: Mapping[str, Any], cycle: MeshCycle) -> Any:
    """A quantity of a cycle with settings that may be traced: one program for all their numbers.

    Args:
        name: of a quantity that the class of the settings gives.
        tables: settings by the table of a design file that holds them; None for what the quantity is without.
        cycle: solved.
    """
    quantity = quantities[name]
    stands = without_settings(quantity)
    assert stands is not None and stands.of is not None  # or it were no quantity of a table
    settings = tables[stands.table]
    if settings is None:
        return quantity(cycle)
    of = functools.partial(_with, stands.of, settings)
    return dataclasses.replace(quantity, of=of)(cycle)


def without_settings(quantity: Quantity) -> WithoutSettings | None:
    """What stands in the vocabulary for a quantity of settings; None for any other one."""
    return quantity.of if isinstance(quantity.of, WithoutSettings) else None


def _given_by(owner: str, quantity: Quantity | None) -> WithoutSettings | None:
    """What stands for a quantity that `with_settings` gives for a class of settings; None for any other one."""
    stands = None if quantity is None else without_settings(quantity)
    return stands if stands and stands.settings.rpartition(".")[2] == owner else None


def _by_settings(given: WithSettings, cycle: MeshCycle) -> Any:
    stands = without_settings(quantities[given.name])
    assert stands is not None and stands.of is not None  # `with_settings` has looked
    return _with(stands.of, given.settings, cycle)


def _with(of: Callable[[MeshCycle, Any], Any], settings: Any, cycle: MeshCycle) -> Any:
    dtype = cycle.transmission_error.dtype
    return of(cycle, jax.tree.map(lambda number: number.astype(dtype), settings))


def _hashable(owner: str, name: str, value: Any) -> Any:
    if value is None or isinstance(value, str | int):
        return value
    if isinstance(value, Checked):
        return _plain(value)
    known = concrete(value)
    if known is None:
        raise ValueError(f"{owner}: {name} is being traced, a quantity needs numbers")
    return tuple(known.tolist()) if known.ndim else known.item()
