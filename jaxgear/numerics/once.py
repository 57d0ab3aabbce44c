"""What several functions of one thing have in common, worked out once."""

import weakref
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from jax.extend.core import get_opaque_trace_state

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
