"""Whether traced numbers are where concrete ones would be allowed."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from .fields import Number, fields_of


def within_limits(module: Any) -> Bool[Array, ""]:
    """Whether all numbers of a `Checked` Module and of those within it are finite and in the range of their fields.

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
