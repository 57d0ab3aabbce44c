"""The keys of a table that describes an object of the library, derived from the fields of its class.

Names, units, ranges, choices and defaults stand in the class alone. A class derived from one of the library's abstract
ones is known to design files by its name in snake case (`TipRelief`: `type = "tip_relief"`), a user's own too.
"""

import dataclasses
import difflib
import functools
import inspect
import operator
import re
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, ClassVar, Self, TypeVar

import equinox as eqx

from ..numerics import Number, fields_of
from ..numerics import real as real_number
from . import imperial
from .errors import DesignFileError, check_known, join, not_known
from .template import Free, Template
from .trade_words import unknown_key
from .value_types import ValueType, choice, either, list_of, not_of_kind, real, rows_of, switch, table, text


def entry(kind: ValueType, default: Any = None) -> Any:
    """Declares a key of a table as an attribute of its class; a default of `...` makes it a required key."""
    return dataclasses.replace(kind, default=default)


class FileTable:
    """Table of a design file: attributes declared by `entry` are the allowed keys.

    Attributes:
        keys: value types of the keys by name.
        source: class of the library, or function, whose fields they are in part; None for none.
        table: name of a top-level table; "" for other tables.
        key: dotted key of the table in the file, "" for the top level.
        fields: values of the keys that the file sets, in the order of the class.
        written: imperial keys that the file has in place of those of the table, by these.
    """

    keys: ClassVar[dict[str, ValueType]] = {}
    source: ClassVar[Any] = None
    table: ClassVar[str] = ""
    key: str = ""
    fields: Mapping[str, Any] = {}
    written: Mapping[str, str] = {}

    def __init_subclass__(cls) -> None:
        own = {name: value for name, value in vars(cls).items() if isinstance(value, ValueType)}
        inherited = [vars(base).get("keys", {}) for base in reversed(cls.__mro__[1:])]
        cls.keys = functools.reduce(operator.or_, [*inherited, own])

    def __init__(self, key: str, /, **given: object) -> None:
        keys = self.every_key()
        self.key, self.fields = key, {name: given[name] for name in keys if name in given}
        for name, allowed in keys.items():
            if not hasattr(FileTable, name):
                setattr(self, name, given.get(name, None if allowed.default is ... else allowed.default))

    @classmethod
    def every_key(cls) -> dict[str, ValueType]:
        """Keys by their names, by default those of the attributes."""
        return cls.keys

    def changed(self, **values: object) -> Self:
        """Copy of the table with other values of some keys, as if the file set them."""
        return type(self)(self.key, **{**self.fields, **values})

    def refuse(self, keys: Iterable[str], why: str) -> None:
        """Raises a `DesignFileError` where the file sets any of the keys, which have no effect."""
        for name in keys:
            if getattr(self, name) not in (None, []):
                raise DesignFileError(join(self.key, name), f"has no effect{why}")


S = TypeVar("S", bound=FileTable)


def decode(key: str, data: object, section: type[S]) -> S:
    """A table with the keys of a class; the table's own key is "" at the top level.

    Raises:
        DesignFileError: for unknown or missing keys, values of a wrong type and numbers out of range.
    """
    if not isinstance(data, dict):
        raise DesignFileError(key, not_of_kind("a table", data))
    keys = section.every_key()
    numbers = {name: allowed.number for name, allowed in keys.items()}
    data, written = imperial.metric(key, data, numbers)
    unknown = next((name for name in data if name not in keys), None)
    values = {}
    for name, allowed in keys.items():
        if name in data:
            values[name] = allowed.read(join(key, written.get(name, name)), data[name])
        elif allowed.default is ... and unknown is None:
            raise DesignFileError(join(key, name), "missing, this key is required")
        elif allowed.default is ...:  # often it is there, misspelt
            break
    if unknown is not None:
        known = imperial.names(numbers, like=unknown) or keys  # a key without the unit is another number
        raise DesignFileError(join(key, unknown), unknown_key(unknown, known.keys()))
    made = section(key, **values)
    made.written = written
    return made


def nested(cls: type[Any], *, open: bool = True) -> ValueType:
    """Value type of a table within another table, with the keys of a class.

    For an abstract class the key `type` names the derived class; the name alone is a table without further keys.

    Args:
        cls: subclass of `FileTable`, read as an object of it, or class of the library, read as a `Template`.
        open: the names of variables may stand for numbers of a class of the library.
    """
    if issubclass(cls, FileTable):
        return ValueType("a table", lambda key, value: decode(key, value, cls), container=dict)
    if not inspect.isabstract(cls):
        section: type[FileTable] = section_of(cls, open=open)  # type: ignore[arg-type]
        return ValueType("a table", lambda key, value: template_of(decode(key, value, section), cls), container=dict)
    kind = either(text(empty=True), table(), "the name of a type, or a table")
    return dataclasses.replace(kind, read=lambda key, value: _of_family(key, kind.read(key, value), cls))


def _of_family(key: str, given: dict[str, Any] | str, base: type[eqx.Module]) -> Template:
    known = family(base)
    if isinstance(given, str):
        check_known(key, given, known)
        given = {"type": given}
    name = given.get("type")
    misspelt = difflib.get_close_matches("type", given, n=1)
    if name is None and misspelt:
        raise DesignFileError(join(key, misspelt[0]), 'unknown key, did you mean "type"?')
    if name is None:
        raise DesignFileError(join(key, "type"), f"missing, must be one of {', '.join(known)}")
    if not isinstance(name, str) or name not in known:
        raise DesignFileError(join(key, "type"), not_known(name, known))
    return nested(known[name]).read(key, {other: value for other, value in given.items() if other != "type"})


@functools.cache
def section_of(
    cls: type[eqx.Module],
    without: tuple[str, ...] = (),
    *,
    most: tuple[tuple[str, int], ...] = (),
    open: bool = True,
) -> type[FileTable]:
    """The keys of a class: its fields that can be written in a file.

    Args:
        cls: the class.
        without: fields that stand elsewhere.
        most: (field, upper limit) where a file may ask for less than a program.
        open: the names of variables may stand for numbers.

    Raises:
        TypeError: where a field without default cannot be written.
    """
    keys: dict[str, Any] = {}
    for field in dataclasses.fields(cls):
        if not field.init or field.name in without:
            continue
        kind = _kind(cls, field, dict(most).get(field.name), open)
        needed = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        if kind is not None:
            keys[field.name] = entry(kind, ... if needed else None)
        elif needed:
            raise TypeError(f"{cls.__name__}: {field.name} cannot be written in a design file")
    said = {"source": cls, "table": getattr(cls, "table", ""), "__doc__": cls.__doc__}
    return type(cls.__name__, (FileTable,), {**keys, **said})


def template_of(section: FileTable, cls: type[eqx.Module], *, without: tuple[str, ...] = ()) -> Template:
    """An object of a class from those keys of a table that are its fields, `without` some of them."""
    numbers, names = fields_of(cls), {field.name for field in dataclasses.fields(cls)} - set(without)
    given = {name: value for name, value in section.fields.items() if name in names}
    return Template(cls, {name: as_field(value, numbers.get(name)) for name, value in given.items()}, section.key)


def as_field(value: Any, number: Number | None) -> Any:
    """Value as a field of a `Template`: numbers become arrays."""
    if isinstance(value, list):
        return [as_field(item, number) for item in value]
    if number is None or number.static:
        return value
    if isinstance(value, Free):
        return dataclasses.replace(value, number=number)
    return real_number(value) if value else value  # an amount of zero is known to do nothing only if it is not traced


def family(base: type[eqx.Module], *, users: bool = True) -> dict[str, type[eqx.Module]]:
    """The classes derived from an abstract one, by the name that design files call them.

    A user's class cannot take the place of one of the library; of two of his own with one name the later is meant.

    Args:
        base: the abstract class.
        users: users with those that are defined outside the library.
    """
    classes = [cls for cls in descendants(base) if _writable(cls)]
    layer = base.__module__.rpartition(".")[0]  # what another layer derives is a part of it, no choice of the user
    library = {snake(cls.__name__): cls for cls in classes if cls.__module__.startswith(layer)}
    own = {snake(cls.__name__): cls for cls in classes if not cls.__module__.startswith("jaxgear.")}
    return {**library, **own, **library} if users else library  # the library's first, and where names are the same


def snake(name: str) -> str:
    """`TipRelief` -> `tip_relief`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def meanings(of: Callable[..., object]) -> dict[str, str]:
    """Meanings of fields by name, from the docstrings of a class and its bases, or of a function."""
    found: dict[str, str] = {}
    for owner in reversed(of.__mro__) if isinstance(of, type) else [of]:
        block = re.search(r"\n\s*(Attributes|Args):\n(?P<list>.*?)(\n\s*\n|\Z)", owner.__doc__ or "", re.DOTALL)
        if block is None:
            continue
        for entry in re.split(r"\n(?=\S)", inspect.cleandoc("\n" + block["list"])):
            names, _, text = entry.partition(": ")
            found.update(dict.fromkeys(names.split(", "), " ".join(text.split())))
    return found


def summary(of: object) -> str:
    """The first paragraph of a docstring."""
    return inspect.cleandoc(of.__doc__ or "").partition("\n\n")[0].replace("\n", " ")


def _kind(cls, field: dataclasses.Field[Any], most: int | None, open: bool) -> ValueType | None:
    """Value type of the key of a field; None for a field without a key."""
    number = fields_of(cls).get(field.name)
    if number is not None:
        return _number(number if most is None else dataclasses.replace(number, high=most), open)
    hint = _hint(cls, field)
    module = _module(hint)
    if module is not None:
        # what contains another of its family is made by the lists of the file
        return None if inspect.isabstract(module) and issubclass(cls, module) else nested(module)
    if typing.get_origin(hint) is typing.Literal:
        return choice(*typing.get_args(hint))
    plain = {bool: switch(), str: text(), int: real(Number(whole=True)), float: real()}
    return plain.get(hint) if isinstance(hint, type) else None


def _number(number: Number, open: bool) -> ValueType | None:
    if not number.checked:
        return None
    kind = real(number, open=open and not (number.static or number.whole))
    if number.limits:
        return either(kind, list_of(kind, length=2), f"{kind.words}, or a list of both limits")
    if len(number.shape) == 2:
        return rows_of(kind)
    return list_of(kind) if number.shape else kind


def _hint(cls, field: dataclasses.Field[Any]) -> Any:
    """The annotation, without None."""
    hint = field.type
    if isinstance(hint, str):
        try:
            hint = typing.get_type_hints(cls)[field.name]
        except (NameError, TypeError):  # a shape of an array
            return None
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        parts = [part for part in typing.get_args(hint) if part is not type(None)]
        return parts[0] if len(parts) == 1 else None
    return hint


def _module(hint) -> type[eqx.Module] | None:
    return hint if isinstance(hint, type) and issubclass(hint, eqx.Module) else None


def descendants(base: type) -> Iterator[Any]:
    """All classes that are derived from one."""
    cls: type
    for cls in base.__subclasses__():
        yield cls
        yield from descendants(cls)


def _writable(cls) -> bool:
    """Whether a file can describe an object of the class."""
    if cls.__name__.startswith("_") or inspect.isabstract(cls):
        return False
    try:
        section_of(cls)
    except TypeError:
        return False
    return True
