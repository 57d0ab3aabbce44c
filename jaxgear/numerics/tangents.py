"""Forward derivatives that cost nothing along what does not move."""

import jax
from jax.custom_derivatives import SymbolicZero


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
