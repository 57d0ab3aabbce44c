"""Arrays that no optimizer takes for parameters."""

from typing import Any, Generic, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

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

    def __init__(self, tree: T):
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
