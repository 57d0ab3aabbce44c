"""Functions of one thing, used on many, and what several functions of one thing have in common."""

from collections.abc import Callable
from functools import wraps
from typing import TypeVar, cast

import equinox as eqx
import jax
import jax.numpy as jnp

T = TypeVar("T")
Function = TypeVar("Function", bound=Callable[..., object])
Result = TypeVar("Result")


def over_batch(function: Function) -> Function:
    """Maps a function over the leading batch axes of its first argument, which tells their number as `batch_ndim`.

    A Module made by `jax.vmap` has the batch axes in front of every array; the function sees arrays without them, and
    what it returns has them in front again. Other arguments are the same for all.
    """

    @wraps(function)
    def mapped(first, *args, **options):
        def of_one(one):
            return function(one, *args, **options)

        for _ in range(first.batch_ndim):
            of_one = eqx.filter_vmap(of_one)
        return of_one(first)

    return cast(Function, mapped)


def on_both(function: Callable[[T], Result], first: T, second: T) -> tuple[Result, Result]:
    """Apply a function to two inputs of the same structure in one batch, which halves the program.

    Things that differ in their structure, or in the shape or type of an array, are evaluated one after the other.
    """
    if _kinds(first) != _kinds(second):
        return function(first), function(second)
    leaves, structure = jax.tree.flatten(jax.vmap(function)(jax.tree.map(lambda *pair: jnp.stack(pair), first, second)))
    halves = zip(*(jax.lax.split(leaf, (1, 1)) for leaf in leaves))
    one, other = (jax.tree.unflatten(structure, [leaf[0] for leaf in half]) for half in halves)
    return one, other


def _kinds(tree) -> tuple:
    leaves, structure = jax.tree.flatten(tree)
    return structure, [(jnp.shape(leaf), jnp.result_type(leaf)) for leaf in leaves]
