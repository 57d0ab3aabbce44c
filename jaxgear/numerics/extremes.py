"""Largest and smallest entries of an array, with derivatives that do not compare floating-point numbers for equality.

The derivative of `jax.numpy.max` counts the entries that equal the maximum. A compiler may evaluate the array a second
time, with other rounding, for that comparison: then no entry equals the maximum and the derivative is 0/0, which
reverse mode spreads to everything that shares the function. Here the place of the extreme entry is found first and the
derivative is that of this entry.
"""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

_MOST_PLACES = 1 << 16  # leaves 36 bits of the mantissa, ten digits

Axes = int | tuple[int, ...] | None


@partial(jax.jit, static_argnames="axis", inline=True)
def maximum(x: Float[Array, "..."], axis: Axes = None) -> Float[Array, "..."]:
    """Largest entry along axes; its derivative is that of the first of several equal entries.

    NaN anywhere along the axes gives NaN, also where the reductions of the backend drop it.

    Args:
        x: any array that is not empty.
        axis: axis or axes; None for all of them.
    """
    return _largest(*_together(x, axis))


@partial(jax.jit, static_argnames="axis", inline=True)
def minimum(x: Float[Array, "..."], axis: Axes = None) -> Float[Array, "..."]:
    """Smallest entry along axes, otherwise as `maximum`."""
    return -maximum(-x, axis)


@partial(jax.jit, static_argnames="axis", inline=True)
def spread(x: Float[Array, "..."], axis: Axes = None) -> Float[Array, "..."]:
    """Largest minus smallest entry along axes, otherwise as `maximum`; zero derivative where all entries are equal."""
    return maximum(x, axis) - minimum(x, axis)


def _together(x, axis: Axes):
    """An axis and the array with all given axes merged into that one."""
    given = range(x.ndim) if axis is None else axis if isinstance(axis, tuple) else (axis,)
    axes = sorted(a % x.ndim for a in given)
    if not axes:
        return 0, x[None]
    first = axes[0]
    together = jnp.moveaxis(x, axes, [first + i for i in range(len(axes))])
    rest = together.shape[first + len(axes) :]
    return first, together.reshape((*together.shape[:first], -1, *rest))


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _largest(axis: int, x):
    return jnp.where(jnp.any(jnp.isnan(x), axis), jnp.nan, jnp.max(x, axis))


@_largest.defjvp
def _largest_jvp(axis, primals, tangents):
    (x,), (x_dot,) = primals, tangents
    return _largest(axis, x), jnp.sum(jnp.where(_place(axis, x), x_dot, 0.0), axis)


def _place(axis: int, x):
    """Where the first largest entry is; a mask, since its transpose is a selection and no scatter.

    In double precision the last bits of the mantissa make way for the place: the largest integer along an axis is found
    faster than an argmax (3 % of a gradient of the PPTE), at the price that entries equal to ten digits count as equal.
    """
    size = x.shape[axis]
    if x.dtype != jnp.float64 or size > _MOST_PLACES:
        place = jnp.argmax(x, axis, keepdims=True)
        return jax.lax.broadcasted_iota(place.dtype, x.shape, axis) == place
    ordered = jax.lax.bitcast_convert_type(x, jnp.int64)
    ordered = jnp.where(ordered < 0, ordered ^ jnp.iinfo(jnp.int64).max, ordered)
    behind = size - 1 - jax.lax.broadcasted_iota(jnp.int64, x.shape, axis)
    last = (1 << (size - 1).bit_length()) - 1
    largest = jnp.max((ordered & ~last) | behind, axis, keepdims=True)
    return behind == (largest & last)
