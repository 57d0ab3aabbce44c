"""What the tests check of the annotations of jaxgear wherever a function is called: shapes and dtypes of arrays.

The rest of an annotation is for mypy: an object of a wrong class has to meet the package's own message here.
"""

import functools
import inspect
from typing import Any, get_args

import jaxtyping
from beartype import BeartypeConf, beartype

_check = beartype(conf=BeartypeConf(is_pep484_tower=True))  # an int may stand for a float, as for mypy


def install():
    """Checks what is imported of jaxgear from now on, but for the functions and classes that no array is named of.

    jaxtyping would wrap them too, which takes a sixth of the time of the tests and most of an import.
    """
    wrapped = jaxtyping.jaxtyped

    def jaxtyped(decorated=None, **options):
        if decorated is None:
            return functools.partial(jaxtyped, **options)
        own = decorated.__init__ if inspect.isclass(decorated) else decorated
        own = own.fget if isinstance(own, property) else getattr(own, "__func__", own)
        speaks = any(map(_speaks_of_arrays, getattr(own, "__annotations__", {}).values()))
        return wrapped(decorated, **options) if speaks else decorated

    jaxtyping.jaxtyped = jaxtyped
    jaxtyping.install_import_hook("jaxgear", "typechecker.arrays")


def arrays(function):
    """The function with a check of its arguments and of its result, as far as their annotations speak of arrays."""
    hints = {name: hint for name, hint in function.__annotations__.items() if _speaks_of_arrays(hint)}
    if not hints:  # beartype's own code would cost as much as a check
        return function
    function.__annotations__ = {name: hints.get(name, Any) for name in function.__annotations__}
    checked = functools.cache(lambda: _check(function))  # made when called: no test calls all of them

    @functools.wraps(function)
    def run(*args, **options):
        return checked()(*args, **options)

    return run


def _speaks_of_arrays(hint) -> bool:
    return (
        inspect.isclass(hint)
        and issubclass(hint, jaxtyping.AbstractArray)
        or any(map(_speaks_of_arrays, get_args(hint)))
    )
