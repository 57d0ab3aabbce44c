"""Errors of design files: one-line messages that name file and key."""

import difflib
import re
import stat
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")

# Control characters, but for tabs and line ends, and those that turn the order of what follows (Unicode TR 36).
_OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


class DesignFileError(ValueError):
    """A design file that cannot be used; the message is one line and names the file and the dotted key."""

    def __init__(self, key: str, problem: object, file: object = "") -> None:
        self.key, self.problem, self.file = key, str(problem), str(file)
        parts = [self.file, key, self.problem]
        super().__init__(printable(" ".join(": ".join(part for part in parts if part).split())))


def printable(text: str) -> str:
    """Text with escape sequences in place of control characters."""
    return _OBEYED.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def obeyed(text: str) -> str:
    """First control character of a text as U+001B; "" without one."""
    found = _OBEYED.search(text)
    return f"U+{ord(found[0]):04X}" if found else ""


@contextmanager
def naming(file: object) -> Iterator[None]:
    """Add the name of the file to every `DesignFileError` of a block."""
    try:
        yield
    except DesignFileError as error:
        raise DesignFileError(error.key, error.problem, error.file or file) from None


@contextmanager
def calling(names: Mapping[str, str]) -> Iterator[None]:
    """Give tables other names in the key of every `DesignFileError` of a block.

    Args:
        names: other names by the names of the tables.
    """
    try:
        yield
    except DesignFileError as error:
        table, rest = re.match(r"(\w*)(.*)", error.key, re.DOTALL).groups()  # type: ignore[union-attr]
        raise DesignFileError(names.get(table, table) + rest, error.problem, error.file) from None


@contextmanager
def referring(key: str, name: str) -> Iterator[None]:
    """Move every `DesignFileError` of a block to the key that names the file."""
    try:
        yield
    except DesignFileError as error:
        parts = name, error.key, error.problem
        raise DesignFileError(key, ": ".join(part for part in parts if part)) from None


def join(key: str, name: str) -> str:
    """Dotted key."""
    return f"{key}.{name}" if key and name else key or name


def check_file(path: Path) -> None:
    """Raise unless a path is a regular file: a pipe or a device may never end.

    Raises:
        DesignFileError: without key, in the words of the system.
    """
    if "\0" in str(path):  # every version of Python has its own words for it
        raise DesignFileError("", "a path cannot hold a null byte")
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise DesignFileError("", error.strerror or error) from None
    if not stat.S_ISREG(mode):
        raise DesignFileError("", "is a folder, not a file" if stat.S_ISDIR(mode) else "is not a regular file")


def refused(key: str, make: Callable[..., T], *args: object, **kwargs: object) -> T:
    """Result of `make`; raises its ValueError or OverflowError as a `DesignFileError` of the key."""
    try:
        return make(*args, **kwargs)
    except (ValueError, OverflowError) as error:
        part = getattr(error, "part", "")
        raise DesignFileError(f"{key}.{part}" if part else key, problem(error)) from None


def check_known(key: str, name: str, names: Collection[str]) -> None:
    """Raise if a name is not one of the known names."""
    if name not in names:
        raise DesignFileError(key, not_known(name, names))


def problem(error: Exception) -> str:
    """Message of an error without the class name at its beginning: a design file has keys."""
    return re.sub(r"\A[A-Z]\w*( \"[^\"]*\")?: ", "", str(error))


def not_known(name: object, names: Iterable[str]) -> str:
    """Message `"x" is not known` with the nearest known name."""
    return f'"{name}" is not known, {suggestion(name, names)}'


def suggestion(name: object, valid: Iterable[str]) -> str:
    """Hint for an unknown name: the nearest valid name, or all of them if none is similar."""
    names = sorted(valid)
    near = difflib.get_close_matches(str(name), names, n=1, cutoff=0.5)
    if near:
        return f'did you mean "{near[0]}"?'
    return f"must be one of {', '.join(names)}" if names else "nothing is allowed here"
