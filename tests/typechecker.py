"""What the tests check of the annotations of jaxgear wherever a function is called: shapes and dtypes of arrays.

The rest of an annotation is for mypy: an object of a wrong class has to meet the package's own message here.
"""

import functools
import inspect
from typing import Any, get_args

from beartype import BeartypeConf, beartype
from jaxtyping import AbstractArray

_check = beartype(conf=BeartypeConf(is_pep484_tower=True))  # an int may stand for a float, as for mypy


def arrays(function):
    """The function with a check of its arguments and of its result, as far as their annotations speak of arrays."""
    hints = {name: hint for name, hint in function.__annotations__.items() if _speaks_of_arrays(hint)}
    if not hints:  # most functions: beartype's own code for each would be what the checks cost
        return function
    function.__annotations__ = {name: hints.get(name, Any) for name in function.__annotations__}
    checked = functools.cache(lambda: _check(function))  # made when called: no test calls all of them

    @functools.wraps(function)
    def run(*args, **options):
        return checked()(*args, **options)

    return run


def _speaks_of_arrays(hint) -> bool:
    return inspect.isclass(hint) and issubclass(hint, AbstractArray) or any(map(_speaks_of_arrays, get_args(hint)))
