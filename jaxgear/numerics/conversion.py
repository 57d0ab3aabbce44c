"""Conversion of given values: numbers to JAX arrays and to text; arrays that no optimizer takes for parameters."""

from collections.abc import Sequence
from typing import Any, Generic, Protocol, TypeVar, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# `Given`: one number or an array of numbers, as callers have them; `Numbers`: everything that `real` converts
Given = float | np.floating | np.integer | np.ndarray | jax.Array
Numbers = Given | Sequence[Given] | Sequence[Sequence[Given]]


class Callback(Protocol):
    """Function called with the progress of a sweep, search or wear history; an exception in it ends the work."""

    def __call__(self, done: int, total: int, best: float | None, /) -> None:
        """Receive the variants, steps or revolutions done, their total and the best objective (None without one)."""


_SHOWN = 6  # numbers of an array that are printed; of a longer one its range is


def real(value: Numbers, what: str = "") -> Float[Array, "..."]:
    """Convert to an inexact array: float arrays keep their dtype, other inputs take the default float of JAX.

    Numbers stay concrete inside traced functions, so that they are checked there too.

    Args:
        value: number, or array or nested list of numbers.
        what: name of the value, for the message.

    Raises:
        ValueError: for anything else: a truth value or a text is not a number, and half of a complex one would be lost.
    """
    try:
        if any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(value)):
            return _inexact(value)
        given = np.asarray(value)
        with jax.ensure_compile_time_eval():
            if given.dtype.kind not in "iuf":
                return _inexact(value)
            # neither NumPy's conversion nor the transfer compiles anything
            return jax.device_put(given if given.dtype.kind == "f" else given.astype(jnp.result_type(float)))
    except (TypeError, ValueError):  # lists of unequal length are none either
        raise ValueError(no_number(what, value)) from None


def _inexact(value) -> Float[Array, "..."]:
    array = jnp.asarray(value)
    if array.dtype.kind in "bc":
        raise TypeError
    dtype = array.dtype if jnp.issubdtype(array.dtype, jnp.inexact) else jnp.result_type(float)
    # the conversion also drops the weak type of Python numbers, which would retrace where an array did not
    return jax.lax.convert_element_type(array, dtype)


def real_or_given(value: object) -> object:
    """Value of a number field as an array; other values unchanged, for the check that names the field."""
    try:
        return optional_real(cast(Numbers | None, value))
    except ValueError:
        return value


def no_number(what: str, value: object) -> str:
    """The message that a value is not a number."""
    wanted = "a real number" if getattr(value, "dtype", np.dtype(type(value))).kind == "c" else "a number"
    comma = ", with a decimal point" if isinstance(value, str) and "," in value else ""
    return f"{what}{' = ' if what else ''}{shown(value)} must be {wanted}{comma}"


def optional_real(value: Numbers | None) -> Float[Array, "..."] | None:
    """`real`, with None kept as None."""
    return None if value is None else real(value)


def concrete(value: Numbers) -> np.ndarray | None:
    """Value as a NumPy array; None if it is traced."""
    return None if isinstance(value, jax.core.Tracer) else np.asarray(value)


def shown(value: object, unit: str = "") -> str:
    """A value as text: numbers with their unit, of many numbers the range, of a tracer its type."""
    if isinstance(value, jax.core.Tracer):
        return eqx.tree_pformat(value)
    if isinstance(value, tuple | list):
        return f"({', '.join(shown(item, unit) for item in value)})"
    if not isinstance(value, jax.Array | np.ndarray | np.generic | float):
        return repr(value)
    value = np.asarray(value)
    if value.dtype == bool:
        return str(value) if value.ndim == 0 else f"{value.sum()} of {value.size} true"
    if value.ndim == 0:
        text = f"{value:.6g}"
    elif value.ndim == 1 and value.size <= _SHOWN:
        text = f"[{', '.join(f'{item:.6g}' for item in value)}]"
    elif value.size:
        size = " x ".join(str(length) for length in value.shape)
        text = f"[{size} numbers from {value.min():.6g} to {value.max():.6g}]"
    else:
        return "[]"
    return f"{text} {unit}" if unit else text


T = TypeVar("T")

_BITS = {2: jnp.int16, 4: jnp.int32, 8: jnp.int64}


class Frozen(eqx.Module, Generic[T]):
    """A pytree whose floating-point arrays are kept as the whole numbers of the same bits.

    Filters for trainable arrays (`equinox.is_inexact_array`) pass them by, so that neither gradients nor weight decay
    nor averaging of parameters reach them, while they stay ordinary arrays to `jit`, `vmap`, devices and files. That is
    more than `stop_gradient` does, which leaves them among the parameters.
    """

    _bits: Any
    _dtypes: tuple[str, ...] = eqx.field(static=True)

    def __init__(self, tree: T) -> None:
        leaves, structure = jax.tree.flatten(tree)
        self._dtypes = tuple(_float_dtype(leaf) for leaf in leaves)
        self._bits = jax.tree.unflatten(structure, [_to_bits(*pair) for pair in zip(leaves, self._dtypes)])

    def __call__(self) -> T:
        """The pytree; its derivatives with respect to anything are zero."""
        leaves, structure = jax.tree.flatten(self._bits)
        return jax.tree.unflatten(structure, [_from_bits(*pair) for pair in zip(leaves, self._dtypes)])


def _float_dtype(leaf) -> str:
    """Name of the type of a floating-point array, "" for everything else."""
    return str(leaf.dtype) if eqx.is_array(leaf) and jnp.issubdtype(leaf.dtype, jnp.floating) else ""


def _to_bits(leaf, dtype: str) -> Array:
    return jax.lax.bitcast_convert_type(leaf, _BITS[leaf.dtype.itemsize]) if dtype else leaf


def _from_bits(leaf, dtype: str) -> Array:
    return jax.lax.bitcast_convert_type(leaf, jnp.dtype(dtype)) if dtype else leaf
