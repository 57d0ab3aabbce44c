"""Functions of one thing, used on many, and what several functions of one thing have in common."""

import weakref
from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.extend.core import get_opaque_trace_state

T = TypeVar("T")
Result = TypeVar("Result")


def over_batch(function):
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

    return mapped


def on_both(function: Callable[[T], Result], first: T, second: T) -> tuple[Result, Result]:
    """A function of two things alike: evaluated once on both together, which halves what there is to compile.

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


_Found = TypeVar("_Found")

# by the identity of the thing: one that holds arrays being traced has no hash
_found: dict[int, list[tuple[Any, Hashable, Any]]] = {}


def once(thing: Any, key: Hashable, work: Callable[[], _Found]) -> _Found:
    """work(), or what it gave before for the same thing and key, as long as the thing lives.

    Compilers do not find out that two loops do the same. What was found while one function was being traced is not
    for another one.

    Args:
        thing: an object that has weak references; nothing else that changes may be in the work.
        key: what else the work depends on.
        work: traceable.
    """
    own = _found.get(id(thing))
    if own is None:
        own = _found[id(thing)] = []
        weakref.finalize(thing, _found.pop, id(thing), None)
    now = get_opaque_trace_state()
    for trace, known, found in own:
        if trace == now and known == key:
            return found
    found = work()
    own.append((now, key, found))
    return found
