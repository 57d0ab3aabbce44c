"""What can be wrong with a design file, always in one line."""

import difflib
import re
from collections.abc import Callable, Iterable
from typing import TypeVar

T = TypeVar("T")


class DesignFileError(ValueError):
    """A design file that cannot be used; the message is one line and names the file and the dotted key."""

    def __init__(self, file, key: str, problem: object):
        parts = [str(file), key, str(problem)]
        super().__init__(" ".join(": ".join(part for part in parts if part).split()))


def refused(file, key: str, make: Callable[..., T], *args, **kwargs) -> T:
    """What `make` returns; what it refuses is wrong with the key of the design file."""
    try:
        return make(*args, **kwargs)
    except (ValueError, OverflowError) as error:
        raise DesignFileError(file, key, problem(error)) from None


def problem(error: Exception) -> str:
    """What the library refuses, without the class that refuses it: a design file has keys."""
    return re.sub(r"\A[A-Z]\w*: ", "", str(error))


def suggestion(name: object, valid: Iterable[str]) -> str:
    """What to write instead of a name: the nearest valid one, or all of them where none is near."""
    names = sorted(valid)
    near = difflib.get_close_matches(str(name), names, n=1, cutoff=0.5)
    if near:
        return f'did you mean "{near[0]}"?'
    return f"must be one of {', '.join(names)}" if names else "nothing is allowed here"
