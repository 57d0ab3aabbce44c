"""Converters and checks for the number fields of Modules.

A bare Python float in a Module is static to JAX: it retraces per value and gets no gradient. Every number field
therefore goes through `real`. Checks run on concrete values only; tracers pass through.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_MOST = 2**53  # whole numbers up to here are exact as floating-point numbers too, in every reader of a table


def real(value) -> Float[Array, "..."]:
    """Converts to an inexact array: arrays of floats keep their dtype, everything else takes JAX's default float."""
    array = jnp.asarray(value)
    dtype = array.dtype if jnp.issubdtype(array.dtype, jnp.inexact) else jnp.result_type(float)
    # the conversion also drops the weak type of Python numbers, which would retrace where an array did not
    return jax.lax.convert_element_type(array, dtype)


def optional_real(value) -> Float[Array, "..."] | None:
    """`real`, with None kept as None."""
    return None if value is None else real(value)


def concrete(value) -> np.ndarray | None:
    """The value as a NumPy array, or None while it is being traced."""
    return None if isinstance(value, jax.core.Tracer) else np.asarray(value)


def check(
    owner: str, name: str, value, unit: str, *, low=None, high=None, open_low: bool = False, open_high: bool = False
) -> None:
    """Raises a one-line `ValueError` when a concrete value is not finite or outside its allowed range.

    Args:
        owner: who the parameter belongs to, for the message.
        name: parameter name, for the message.
        value: number or array; tracers and None pass.
        unit: unit of the value, for the message ("" for a pure number).
        low: lowest allowed value, excluded when `open_low`.
        high: highest allowed value, excluded when `open_high`.
    """
    known = None if value is None else concrete(value)
    if known is None:
        return
    bad = ~np.isfinite(known)
    if low is not None:
        bad |= (known <= low) if open_low else (known < low)
    if high is not None:
        bad |= (known >= high) if open_high else (known > high)
    if not bad.any():
        return
    shown = known[bad].flat[0] if known.ndim else known
    unit_text = f" {unit}" if unit else ""
    raise ValueError(
        f"{owner}: {name} = {float(shown):g}{unit_text} {_range(low, high, open_low, open_high, unit_text)}"
    )


def whole(owner: str, name: str, value, low: int = 1) -> int:
    """The value as an int; raises a one-line `ValueError` unless it is a whole number of at least `low`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < low:
        raise ValueError(f"{owner}: {name} = {value!r} must be a whole number of at least {low}")
    if value > _MOST:
        raise ValueError(f"{owner}: {name} = {value!r} must be at most 2^53")
    return int(value)


def _range(low, high, open_low, open_high, unit_text) -> str:
    if low is None and high is None:
        return "must be finite"
    parts = []
    if low is not None:
        parts.append(f"{'greater than' if open_low else 'at least'} {float(low):g}{unit_text}")
    if high is not None:
        parts.append(f"{'less than' if open_high else 'at most'} {float(high):g}{unit_text}")
    return "must be " + " and ".join(parts)
