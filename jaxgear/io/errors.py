"""What can be wrong with a design file, always in one line."""

import difflib
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")


class DesignFileError(ValueError):
    """A design file that cannot be used; the message is one line and names the file and the dotted key."""

    def __init__(self, key: str, problem: object, file: object = ""):
        self.key, self.problem, self.file = key, str(problem), str(file)
        parts = [self.file, key, self.problem]
        super().__init__(" ".join(": ".join(part for part in parts if part).split()))


@contextmanager
def naming(file: object) -> Iterator[None]:
    """Says of which file the keys are that are refused in a block."""
    try:
        yield
    except DesignFileError as error:
        raise DesignFileError(error.key, error.problem, error.file or file) from None


def refused(key: str, make: Callable[..., T], *args, **kwargs) -> T:
    """What `make` returns; what it refuses is wrong with the key of the design file."""
    try:
        return make(*args, **kwargs)
    except (ValueError, OverflowError) as error:
        raise DesignFileError(key, problem(error)) from None


def refuse_given(table: str, section: object, keys: Iterable[str], why: str) -> None:
    """Refuses the keys of a table that have no effect."""
    for key in keys:
        if getattr(section, key) not in (None, []):
            raise DesignFileError(f"{table}.{key}" if table else key, f"has no effect{why}")


def check_known(key: str, name: str, names: Collection[str]) -> None:
    """Refuses a name that is none of several."""
    if name not in names:
        raise DesignFileError(key, not_known(name, names))


def problem(error: Exception) -> str:
    """What the library refuses, without the class that refuses it: a design file has keys."""
    return re.sub(r"\A[A-Z]\w*: ", "", str(error))


def not_known(name: object, names: Iterable[str]) -> str:
    """`"x" is not known`, and what to write instead."""
    return f'"{name}" is not known, {suggestion(name, names)}'


def suggestion(name: object, valid: Iterable[str]) -> str:
    """What to write instead of a name: the nearest valid one, or all of them where none is near."""
    names = sorted(valid)
    near = difflib.get_close_matches(str(name), names, n=1, cutoff=0.5)
    if near:
        return f'did you mean "{near[0]}"?'
    return f"must be one of {', '.join(names)}" if names else "nothing is allowed here"
