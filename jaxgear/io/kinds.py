"""Kinds of values in a design file: what may stand after a key, how it is checked and how it is described.

Pydantic finds its way through the tables and says where a value is wrong; these classes say what is wrong with it.
"""

import datetime
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

from pydantic_core import CoreSchema, core_schema

from ..numerics import Number
from .errors import not_known
from .ranges import outside

# Tags of alternatives; they are no part of a key.
TAGS = ("<list>", "<table>", "<other>")


class Kind(ABC):
    """What may stand after a key."""

    @property
    @abstractmethod
    def words(self) -> str:
        """What is allowed, for messages and the reference."""

    @abstractmethod
    def schema(self) -> CoreSchema:
        """For pydantic."""

    def __get_pydantic_core_schema__(self, source, handler) -> CoreSchema:
        return self.schema()


class Plain(Kind):
    """One value, neither a list nor a table."""

    @abstractmethod
    def read(self, value: Any) -> Any:
        """The value as it is used; raises a `ValueError` that says what is wrong with it."""

    def schema(self) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)


@dataclass(frozen=True)
class Real(Plain):
    """A number.

    Attributes:
        number: unit and range.
        open: the name of a variable may stand for it.
        plausible: it must be of an engineer's range; otherwise that is checked later, once its unit is known.
    """

    number: Number = Number()
    open: bool = False
    plausible: bool = True

    @property
    def words(self) -> str:
        plain = "a whole number" if self.number.whole else "a number"
        return f"{plain} or the name of a variable" if self.open else plain

    def read(self, value: Any) -> Any:
        if self.open and isinstance(value, str) and value:
            if _is_number(value):
                raise ValueError(not_of_kind("a number", value))
            return value
        if isinstance(value, bool) or not isinstance(value, int if self.number.whole else int | float):
            raise ValueError(not_of_kind(self.words, value))
        if problem := outside(self.number, value, plausible=self.plausible):
            raise ValueError(problem)
        return value if self.number.whole else float(value)


@dataclass(frozen=True)
class Text(Plain):
    """A string.

    Attributes:
        empty: the empty one is allowed.
    """

    empty: bool = False
    words = "a string"

    def read(self, value: Any) -> str:
        if not isinstance(value, str):
            raise ValueError(not_of_kind(self.words, value))
        if not value and not self.empty:
            raise ValueError('"" is empty')
        return value


@dataclass(frozen=True)
class Switch(Plain):
    """True or false."""

    words = "true or false"

    def read(self, value: Any) -> bool:
        if not isinstance(value, bool):
            raise ValueError(not_of_kind(self.words, value))
        return value


@dataclass(frozen=True)
class Choice(Plain):
    """One of several names."""

    names: tuple[str, ...]

    @property
    def words(self) -> str:
        return "one of " + ", ".join(f'"{name}"' for name in self.names)

    def read(self, value: Any) -> str:
        if not isinstance(value, str):
            raise ValueError(not_of_kind("a string", value))
        if value not in self.names:
            raise ValueError(not_known(value, self.names))
        return value


@dataclass(frozen=True)
class ListOf(Kind):
    """A list.

    Attributes:
        item: kind of its items.
        length: number of items, None for any.
        empty: the empty list is allowed.
    """

    item: Kind
    length: int | None = None
    empty: bool = False
    words = "a list"

    def schema(self) -> CoreSchema:
        least = 0 if self.empty else self.length or 1
        return core_schema.list_schema(self.item.schema(), min_length=least, max_length=self.length, strict=True)


@dataclass(frozen=True)
class Table(Kind):
    """A table with keys of its own.

    Attributes:
        item: kind of its values; None for a table that is looked into later.
    """

    item: Kind | None = None
    words = "a table"

    def schema(self) -> CoreSchema:
        if self.item is None:
            return core_schema.dict_schema(core_schema.str_schema(), strict=True)
        return core_schema.dict_schema(core_schema.str_schema(), self.item.schema(), min_length=1, strict=True)


@dataclass(frozen=True)
class Either(Kind):
    """A plain value, a list or a table.

    Attributes:
        plain: kind of a plain value.
        many: `ListOf` or `Table`.
        allowed: in words, for messages.
    """

    plain: Kind
    many: ListOf | Table
    allowed: str

    @property
    def words(self) -> str:
        return self.allowed

    def schema(self) -> CoreSchema:
        kind, tag = (list, TAGS[0]) if isinstance(self.many, ListOf) else (dict, TAGS[1])
        other = dict if kind is list else list

        def choose(value: Any) -> str | None:
            return tag if isinstance(value, kind) else None if isinstance(value, other) else TAGS[2]

        return core_schema.tagged_union_schema(
            {tag: self.many.schema(), TAGS[2]: self.plain.schema()},
            choose,
            custom_error_type="kind",
            custom_error_message=f"must be {self.words}",
        )


def count(low: int, high: int) -> Real:
    """A whole number; the upper limits keep a slip of the finger from filling the memory or compiling for hours."""
    return Real(Number(low=low, high=high, whole=True))


def positive(unit: str) -> Real:
    """A number greater than zero."""
    return Real(Number(unit, low=0.0, open_low=True))


SEED = count(0, 2**31 - 1)  # what every generator of random numbers takes
LEVEL = count(2, 10_000)
WEIGHTS = ListOf(Real(Number(low=0.0)))


def not_of_kind(wanted: str, value: Any) -> str:
    """`must be a number, not a string`."""
    return f"must be {wanted}, not {_kind(value)}"


def _is_number(text: str) -> bool:
    """Whether a number was put into quotes."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _kind(value: Any) -> str:
    if isinstance(value, bool):
        return "true or false"
    if isinstance(value, int | float):
        return "a number"
    if isinstance(value, str):
        return "a string" if value else "an empty string"
    if isinstance(value, datetime.date | datetime.time):
        return "a date or time"
    return "a list" if isinstance(value, list) else "a table"
