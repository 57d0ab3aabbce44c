"""Number fields of Modules: declared once with unit and range, then converted, checked and printed from that.

A bare Python float in a Module is static to JAX: it retraces per value and gets no gradient. Every number field
therefore goes through `real`. Ranges are checked on concrete values only, tracers pass; shapes are always checked.
"""

import dataclasses
import logging
from collections.abc import Iterator
from dataclasses import MISSING
from typing import Any, Literal, NamedTuple, Self, TypedDict, TypeVar, Unpack, dataclass_transform, get_args, get_origin

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, PyTree

from .conversion import Given, Numbers, concrete, no_number, real_or_given, shown

_Module = TypeVar("_Module", bound=eqx.Module)

_MOST = 2**53  # whole numbers up to here are exact as floating-point numbers too, in every reader of a table
_KEY = "number"  # of a `Number` in the metadata of its field
_LOG = logging.getLogger(f"{__name__.partition('.')[0]}.unusual")
_warned: set[tuple[str, str]] = set()  # classes and fields that were warned of: a search makes thousands of objects


class Usual(NamedTuple):
    """Usual range of a number; for a number field, the range of its magnitude, where zero is usual too.

    Attributes:
        low, high: the range.
        unit: unit of the range; of a number field, the unit of the field.
        remark: probable cause or meaning of a number out of the range, with its source.
    """

    low: float
    high: float
    unit: str
    remark: str

    def holds(self, value: float) -> bool:
        """True if a number is in the range; False for NaN."""
        return self.low <= value <= self.high

    def missed_by(self, value: float) -> str:
        """Message on a number out of the range, with its probable cause."""
        low = value < self.low
        return f"{'less' if low else 'more'} than {self.text(self.low if low else self.high)} ({self.remark})"

    def text(self, value: float) -> str:
        """A number to four digits with the unit."""
        return f"{float(f'{value:.4g}'):g} {self.unit}".rstrip()


class UnitKey(str):
    """Name of a number with its unit, for keys of files (`ppte_um`), and its heading (`PPTE [um]`).

    Attributes:
        name: without the unit.
        unit: "" for a pure number.
        heading: heading in words with the unit in brackets.
    """

    name: str
    unit: str
    heading: str

    def __new__(cls, name: str, unit: str = "", words: str = "") -> Self:
        """The key of a name; `words` stand in the heading in place of it."""
        suffix = _IN_NAMES.get(unit) or unit.replace(" ", "").replace("/", "_per_")
        made = super().__new__(cls, f"{name}_{suffix}" if unit else name)
        words = words or name.replace("_", " ")
        made.name, made.unit, made.heading = name, unit, f"{words} [{unit}]" if unit else words
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return UnitKey, (self.name, self.unit), vars(self)


_IN_NAMES = {"%": "percent", "MPa^0.5": "sqrt_MPa"}  # units that files spell


@dataclasses.dataclass(frozen=True)
class Number:
    """Unit, range and shape of the values that a number field accepts.

    Attributes:
        unit: unit of the value, "" for a pure number.
        low, high: allowed range, None without a limit.
        open_low, open_high: True if the limit itself is not allowed.
        whole: True for whole numbers only.
        optional: True if None is allowed.
        shape: names of the axes, () for a single number.
        fewest: smallest length of an axis.
        limits: True if lower and upper limit, shape (2,), are allowed in place of a single number.
        static: True for a Python number that is part of the structure, not a leaf; with a shape, a tuple of whole
            numbers.
        checked: False for a result, which may hold anything, NaN included.
        usual: usual range; beyond it the logger of the package, ".unusual", warns once per field.
    """

    unit: str = ""
    low: float | None = None
    high: float | None = None
    open_low: bool = False
    open_high: bool = False
    whole: bool = False
    optional: bool = False
    shape: tuple[str, ...] = ()
    fewest: int = 1
    limits: bool = False
    static: bool = False
    checked: bool = True
    usual: Usual | None = None


class Limits(TypedDict, total=False):
    """Keyword arguments of `number`: the fields of `Number` that a declaration may set."""

    low: float | None
    high: float | None
    open_low: bool
    open_high: bool
    whole: bool
    optional: bool
    shape: tuple[str, ...]
    fewest: int
    limits: bool
    static: bool
    usual: Usual | None


def number(unit: str, *, default: object = MISSING, kw_only: bool = False, **limits: Unpack[Limits]) -> Any:
    """Field for a number or an array, a leaf that JAX can trace and differentiate.

    Args:
        unit: "" for a pure number.
        default: value where none is given.
        kw_only: as in dataclasses.
        limits: the other fields of `Number`.
    """
    kind = Number(unit, **limits)
    converter = _plain if kind.static else real_or_given
    given = {} if default is MISSING else {"default": default}
    return eqx.field(metadata={_KEY: kind}, kw_only=kw_only, converter=converter, static=kind.static, **given)


def count(
    *, low: int = 1, high: int | None = None, optional: bool = False, default: object = MISSING, kw_only: bool = False
) -> Any:
    """Static field for a whole number, such as a size or a number of repetitions."""
    most = _MOST if high is None else high
    return number("", default=default, kw_only=kw_only, low=low, high=most, optional=optional, whole=True, static=True)


def result(unit: str = "") -> Any:
    """A field of a result: printed with its unit, neither converted nor checked."""
    return eqx.field(metadata={_KEY: Number(unit, checked=False)})


def fields_of(cls: type) -> dict[str, Number]:
    """Number fields of a class, with their units and ranges."""
    return {field.name: field.metadata[_KEY] for field in dataclasses.fields(cls) if _KEY in field.metadata}


@dataclass_transform(field_specifiers=(eqx.field, number, count, result))  # type checkers know their defaults
class Checked(eqx.Module):
    """Module whose fields are checked on construction, and which prints its numbers with their units.

    Besides its number fields, choices (`Literal`), switches (`bool`) and Modules within it are checked against their
    annotation.

    Raises:
        ValueError: in one line that names class, field, value, unit and what is allowed.
        TypeError: for something else than the Module that a field wants.
    """

    def __check_init__(self) -> None:
        try:
            for field in dataclasses.fields(self):
                _check_field(field, getattr(self, field.name))
        except (TypeError, ValueError) as error:
            error.args = (f"{type(self).__name__}: {error}",)
            raise
        _warn_of_unusual(self)
        self.check_together()

    def check_together(self) -> None:
        """Raises a `ValueError` where fields that are allowed one by one do not go together."""

    def __repr__(self) -> str:
        fields = [(field, getattr(self, field.name)) for field in dataclasses.fields(self) if field.repr]
        parts = [f"{field.name}={shown(value, field.metadata.get(_KEY, Number()).unit)}" for field, value in fields]
        return f"{type(self).__name__}({', '.join(parts)})"


def changed(module: _Module, /, **fields: object) -> _Module:
    """Copy of a Module with other fields, without conversion and checks."""
    made = object.__new__(type(module))
    for field in dataclasses.fields(module):
        object.__setattr__(made, field.name, fields.get(field.name, getattr(module, field.name)))
    return made


def check(
    name: str,
    value: Numbers | None,
    unit: str,
    *,
    low: Given | None = None,
    high: Given | None = None,
    open_low: bool = False,
    open_high: bool = False,
) -> None:
    """Raises a one-line `ValueError` when a concrete value is not finite or outside its allowed range.

    Args:
        name: parameter name, for the message.
        value: number or array; tracers and None pass.
        unit: unit of the value, for the message ("" for a pure number).
        low: lowest allowed value, excluded when `open_low`.
        high: highest allowed value, excluded when `open_high`.
    """
    known = None if value is None else concrete(value)
    if known is None:
        return
    if known.dtype.kind not in "biuf":
        raise ValueError(no_number(name, value))
    bad = ~np.isfinite(known)
    if low is not None:
        bad |= (known <= low) if open_low else (known < low)
    if high is not None:
        bad |= (known >= high) if open_high else (known > high)
    if not bad.any():
        return
    shown = known[bad].flat[0] if known.ndim else known
    unit_text = f" {unit}" if unit else ""
    raise ValueError(f"{name} = {float(shown):g}{unit_text} {_range(low, high, open_low, open_high, unit_text)}")


def whole(name: str, value: object, low: float = 1, high: float = _MOST) -> int:
    """Value as an int; raises a one-line `ValueError` unless it is a whole number from `low` to `high`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < low:
        raise ValueError(f"{name} = {value!r} must be a whole number of at least {low}")
    if value > high:
        raise ValueError(f"{name} = {value!r} must be at most {'2^53' if high == _MOST else high}")
    return int(value)


def _plain(value):
    """NumPy's scalars and lists as Python's numbers and tuples, which can be static."""
    if isinstance(value, list | tuple | np.ndarray):
        return tuple(_plain(item) for item in value)
    return value.item() if isinstance(value, np.generic) else value


def _check_field(field: dataclasses.Field[Any], value: object) -> None:
    kind = field.metadata.get(_KEY)
    if kind is not None:
        if kind.checked:
            _check_number(field.name, value, kind)
    elif get_origin(field.type) is Literal:
        options = get_args(field.type)
        if not isinstance(value, str) or value not in options:
            *first, last = [f'"{option}"' for option in options]
            raise ValueError(f"{field.name} = {value!r} must be {', '.join(first)} or {last}")
    elif field.type is bool and not isinstance(value, bool | np.bool_):
        raise ValueError(f"{field.name} = {value!r} must be True or False")
    elif isinstance(field.type, type) and issubclass(field.type, eqx.Module) and not isinstance(value, field.type):
        given = value.__name__ if isinstance(value, type) else type(value).__name__
        # most often the class where an object of it is meant
        made = f": write {given}(...)" if isinstance(value, type) and issubclass(value, field.type) else ""
        raise TypeError(f"{field.name} is {shown(value)}, must be of type {field.type.__name__}{made}")


def _check_number(name: str, value, kind: Number) -> None:
    if value is None and kind.optional:
        return
    if kind.static:
        if kind.shape:
            if not isinstance(value, tuple) or not value:
                raise ValueError(f"{name} = {value!r} must be a list of whole numbers")
            for item in value:
                _check_number(name, item, dataclasses.replace(kind, shape=(), optional=False))
            return
        if kind.whole:
            assert kind.low is not None and kind.high is not None  # `count` gives both
            whole(name, value, kind.low, kind.high)
            return
        if isinstance(value, bool) or not isinstance(value, float | int | np.floating | np.integer):
            raise ValueError(no_number(name, value))
    else:
        if not isinstance(value, jax.Array) or value.dtype.kind in "bc":  # the converter has left it as it was
            raise ValueError(no_number(name, value))
        _check_shape(name, value.shape, kind)
    check(name, value, kind.unit, low=kind.low, high=kind.high, open_low=kind.open_low, open_high=kind.open_high)
    if kind.limits and (known := concrete(value)) is not None and known.ndim and not known[0] <= known[1]:
        unit = f" {kind.unit}" if kind.unit else ""
        limits = f"{float(known[1]):g}{unit} must be at least the lower one, {float(known[0]):g}{unit}"
        raise ValueError(f"{name}: upper limit {limits}")
    known = concrete(value) if kind.whole else None
    if known is not None and (known != known.round()).any():
        shown = float(known[known != known.round()].flat[0])
        raise ValueError(f"{name} = {shown:g} must be a whole number")


def _warn_of_unusual(module: Checked) -> None:
    made = type(module).__name__
    for name, kind in fields_of(type(module)).items():
        if kind.usual is None or (made, name) in _warned or (known := concrete(getattr(module, name))) is None:
            continue
        size = np.abs(known)
        unusual = (size > 0) & ((size < kind.usual.low) | (size > kind.usual.high))
        if unusual.any():
            _warned.add((made, name))
            shown = float(known[unusual].flat[0] if known.ndim else known)
            _LOG.warning("%s: %s = %g %s is %s", made, name, shown, kind.usual.unit, kind.usual.missed_by(abs(shown)))


def _check_shape(name: str, shape: tuple[int, ...], kind: Number) -> None:
    if len(shape) == len(kind.shape) and all(length >= kind.fewest for length in shape):
        return
    if kind.limits:
        if shape == (2,):
            return
        raise ValueError(f"{name} has shape {shape}, must be a single number, or lower and upper limit")
    if not kind.shape:
        raise ValueError(f"{name} has shape {shape}, must be a single number; make many with jax.vmap")
    least = f"at least {kind.fewest} " if kind.fewest > 1 else ""
    wanted = "a list of" if len(kind.shape) == 1 else f"a table ({' x '.join(kind.shape)}) of"
    unit = "numbers" if len(kind.shape) == 1 or not least else "numbers along every axis"
    raise ValueError(f"{name} has shape {shape}, must be {wanted} {least}{unit}")


def _range(low, high, open_low, open_high, unit_text) -> str:
    if low is None and high is None:
        return "must be finite"
    parts = []
    if low is not None:
        parts.append(f"{'greater than' if open_low else 'at least'} {float(low):g}{unit_text}")
    if high is not None:
        parts.append(f"{'less than' if open_high else 'at most'} {float(high):g}{unit_text}")
    return "must be " + " and ".join(parts)


def within_limits(module: PyTree[eqx.Module]) -> Bool[Array, ""]:
    """True if all numbers of a `Checked` Module and its parts are finite and in the ranges of their fields.

    Concrete numbers that are not are refused when the Module is made; traced ones, and numbers put into it later, pass
    there. Whether whole numbers are whole, and what fields have to be together, is not looked at.

    Args:
        module: Modules, also several of them in tuples, lists and dicts.
    """
    found = list(_numbers(module))
    if not found:
        return jnp.ones((), bool)
    dtype = jnp.result_type(float)
    values = jnp.concatenate([jnp.ravel(value).astype(dtype) for value, _ in found])

    def each(of) -> np.ndarray:
        return np.concatenate([np.full(value.size, of(value, kind)) for value, kind in found])

    # limits in the precision of the number, so that one that is given as the limit is there
    low = each(lambda value, kind: np.asarray(-np.inf if kind.low is None else kind.low, value.dtype).item())
    high = each(lambda value, kind: np.asarray(np.inf if kind.high is None else kind.high, value.dtype).item())
    low, high = low.astype(dtype), high.astype(dtype)
    above = (values > low) | ~each(lambda _, kind: kind.open_low) & (values == low)
    below = (values < high) | ~each(lambda _, kind: kind.open_high) & (values == high)
    return jnp.all(jnp.isfinite(values) & above & below)


def _numbers(part: Any) -> Iterator[tuple[Any, Number]]:
    """Every number that is checked, with what it may be."""
    if isinstance(part, tuple | list):
        for item in part:
            yield from _numbers(item)
    elif isinstance(part, dict):
        yield from _numbers(list(part.values()))
    elif isinstance(part, eqx.Module):
        kinds = fields_of(type(part))
        for field in dataclasses.fields(part):
            value, kind = getattr(part, field.name), kinds.get(field.name)
            if kind is None:
                yield from _numbers(value)
            elif kind.checked and isinstance(value, jax.Array | np.ndarray):
                yield jax.lax.stop_gradient(value), kind
