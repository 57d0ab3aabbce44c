"""Quantities that need more than a cycle: settings, as plain data, so that compiled programs know them again."""

import dataclasses
from collections.abc import Callable
from typing import Any

from ..contact import MeshCycle
from ..numerics import Checked, concrete


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
        return self.make(**dict(self.fields))

    def __call__(self, cycle: MeshCycle) -> Any:
        return self.of(self, cycle)


def settled(name: str, settings: Checked, of: Callable[[WithSettings, MeshCycle], Any]) -> WithSettings:
    """What computes a quantity with settings of concrete numbers.

    Raises:
        ValueError: for settings that are being traced.
    """
    owner = type(settings).__name__
    names = [field.name for field in dataclasses.fields(settings)]
    fields = tuple((field, _hashable(owner, field, getattr(settings, field))) for field in names)
    return WithSettings(name, of, type(settings), fields)


@dataclasses.dataclass(frozen=True)
class WithoutSettings:
    """Stands in the vocabulary, where names are looked up.

    Attributes:
        name: of the quantity.
        settings: class that gives it, as it is written.
        table: of a design file that holds them.
    """

    name: str
    settings: str
    table: str

    def __call__(self, cycle: MeshCycle) -> Any:
        raise ValueError(
            f'{self.name}: needs settings, give {self.settings}(...).quantity("{self.name}"), or a design '
            f"file with the table [{self.table}]"
        )


def _hashable(owner: str, name: str, value: Any) -> Any:
    if value is None or isinstance(value, str | int):
        return value
    known = concrete(value)
    if known is None:
        raise ValueError(f"{owner}: {name} is being traced, a quantity needs numbers")
    return tuple(known.tolist()) if known.ndim else known.item()
