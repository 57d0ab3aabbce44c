"""Forward derivatives that cost nothing along what does not move."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero

from .stored import stored


def jvp_of_given(function, primal, tangent):
    """`jax.jvp` along those leaves of the tangent that are not symbolically zero: the others cost nothing."""
    tangents, structure = jax.tree.flatten(tangent, is_leaf=lambda leaf: isinstance(leaf, SymbolicZero))
    primals = jax.tree.leaves(primal)
    given = [i for i, leaf in enumerate(tangents) if not isinstance(leaf, SymbolicZero)]

    def of_given(leaves):
        everything = list(primals)
        for i, leaf in zip(given, leaves):
            everything[i] = leaf
        return function(jax.tree.unflatten(structure, everything))

    return jax.jvp(of_given, ([primals[i] for i in given],), ([tangents[i] for i in given],))


def by_numbers(function):
    """The function, with its derivative by every single number of its arguments formed in forward mode.

    Reverse mode then keeps one array per number and result, the derivative by it, and none of what led there. That pays
    where an elementwise chain follows from a few numbers. Arrays of several numbers are differentiated as always.
    """
    wrapped = eqx.filter_custom_jvp(function)

    def rule(primals, tangents):
        leaves, structure = jax.tree.flatten(tangents, is_leaf=_nothing)
        values = jax.tree.leaves(primals, is_leaf=_nothing)
        moving = [i for i, leaf in enumerate(leaves) if leaf is not None]
        numbers = [i for i in moving if leaves[i].ndim == 0]
        arrays = [i for i in moving if leaves[i].ndim > 0]

        def along(places, directions):
            def of_moving(moved):
                everything = list(values)
                for i, leaf in zip(places, moved):
                    everything[i] = leaf
                return function(*jax.tree.unflatten(structure, everything))

            return jax.jvp(of_moving, ([values[i] for i in places],), (directions,))[1]

        changes = [jax.tree.map(partial(_times, leaves[i]), along([i], [jnp.ones_like(values[i])])) for i in numbers]
        if arrays:
            changes.append(along(arrays, [leaves[i] for i in arrays]))
        return wrapped(*primals), jax.tree.map(lambda *parts: sum(parts), *changes)

    wrapped.def_jvp(rule)
    return wrapped


def _times(change, derivative):
    return change * stored(derivative)


def _nothing(leaf) -> bool:
    return leaf is None
