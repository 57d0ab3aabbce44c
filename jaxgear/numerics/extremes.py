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

Axes = int | tuple[int, ...] | None


def maximum(x: Float[Array, "..."], axis: Axes = None) -> Float[Array, "..."]:
    """Largest entry along axes; its derivative is that of the first of several equal entries.

    NaN anywhere along the axes gives NaN, also where the reductions of the backend drop it.

    Args:
        x: any array that is not empty.
        axis: axis or axes; None for all of them.
    """
    given = range(x.ndim) if axis is None else axis if isinstance(axis, tuple) else (axis,)
    axes = sorted(a % x.ndim for a in given)
    if not axes:
        return x
    first = axes[0]
    together = jnp.moveaxis(x, axes, [first + i for i in range(len(axes))])
    rest = together.shape[first + len(axes) :]
    return _largest(first, together.reshape((*together.shape[:first], -1, *rest)))


def minimum(x: Float[Array, "..."], axis: Axes = None) -> Float[Array, "..."]:
    """Smallest entry along axes, otherwise as `maximum`."""
    return -maximum(-x, axis)


def spread(x: Float[Array, "..."], axis: Axes = None) -> Float[Array, "..."]:
    """Largest minus smallest entry along axes, otherwise as `maximum`; zero derivative where all entries are equal."""
    return maximum(x, axis) - minimum(x, axis)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _largest(axis: int, x):
    return jnp.where(jnp.any(jnp.isnan(x), axis), jnp.nan, jnp.max(x, axis))


@_largest.defjvp
def _largest_jvp(axis, primals, tangents):
    (x,), (x_dot,) = primals, tangents
    place = jnp.argmax(x, axis, keepdims=True)
    # a mask and not an index: its transpose is a selection, which fuses with what follows, and no scatter
    chosen = jax.lax.broadcasted_iota(place.dtype, x.shape, axis) == place
    return _largest(axis, x), jnp.sum(jnp.where(chosen, x_dot, 0.0), axis)
