"""From the text of a design file to typed tables, every problem in one line with its key."""

import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from .errors import DesignFileError, check_file, obeyed, suggestion
from .value_types import TAGS, not_of_kind

S = TypeVar("S", bound=BaseModel)

# pydantic's own errors about the containers of values; what is wrong with a value, its kind says itself
_CONTAINERS = {"list_type": "a list", "dict_type": "a table", "model_type": "a table"}

# Parts of a dotted key: a design file nests its tables three deep, and time and memory of the parser grow with the
# square of this number.
_MOST_PARTS = 32
_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{{_MOST_PARTS}}}")


def content(path: Path) -> bytes:
    """What a file holds.

    Raises:
        DesignFileError: when it cannot be read.
    """
    check_file(path)
    try:
        return path.read_bytes()
    except OSError as error:
        raise DesignFileError("", error.strerror or error) from None


def read(path: Path) -> dict[str, Any]:
    """Reads a TOML file.

    Raises:
        DesignFileError: when it cannot be read or is not TOML.
    """
    held = content(path)
    try:
        text = held.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = held.count(b"\n", 0, error.start) + 1
        raise DesignFileError("", f"line {line}: not UTF-8 text") from None
    if long_key := _LONG_KEY.search(text):
        line = text.count("\n", 0, long_key.start()) + 1
        raise DesignFileError("", f"line {line}: a key has more than {_MOST_PARTS} parts between dots")
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise DesignFileError("", _syntax(str(error), text)) from None
    except ValueError:  # of int()
        raise DesignFileError("", "a whole number has more than 4300 digits") from None
    except RecursionError:
        raise DesignFileError("", "tables or lists are nested too deeply") from None
    _check_texts("", data)
    return data


def decode(key: str, data: Any, section: type[S]) -> S:
    """A table as its section; the table's own key is "" at the top level.

    Raises:
        DesignFileError: for unknown or missing keys, values of a wrong type and numbers out of range.
    """
    try:
        return section.model_validate(data)
    except ValidationError as error:
        problems = error.errors(include_url=False)
    first = problems[0]
    if first["type"] == "missing":  # often it is there, misspelt
        first = next((problem for problem in problems if problem["type"] == "extra_forbidden"), first)
    raise DesignFileError(join(key, _dotted(first["loc"])), _worded(first, section))


def _check_texts(key: str, value: Any) -> None:
    """Refuses names and texts that would do something to a terminal, or to a page, when they are printed there."""
    if isinstance(value, dict):
        for name, item in value.items():
            _check_texts(join(key, name), name)
            _check_texts(join(key, name), item)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            _check_texts(f"{key}[{index}]", item)
    elif isinstance(value, str) and (found := obeyed(value)):
        raise DesignFileError(key, f"contains the control character {found}, leave it out")


def join(key: str, name: str) -> str:
    """Dotted key."""
    return f"{key}.{name}" if key and name else key or name


def _dotted(loc: tuple[int | str, ...]) -> str:
    """`("modification", 1, "amount")` -> `modification[1].amount`."""
    key = ""
    for part in loc:
        if part not in TAGS:
            key = f"{key}[{part}]" if isinstance(part, int) else join(key, part)
    return key


def _worded(problem, section: type[BaseModel]) -> str:
    kind, context = problem["type"], problem.get("ctx", {})
    if kind == "value_error":
        return str(context["error"])
    if kind == "extra_forbidden":
        return f"unknown key, {suggestion(problem['loc'][-1], section.model_fields)}"
    if kind == "missing":
        return "missing, this key is required"
    if kind in _CONTAINERS:
        return not_of_kind(_CONTAINERS[kind], problem["input"])
    if kind in ("too_short", "too_long"):
        length, wanted = context["actual_length"], context.get("min_length", context.get("max_length"))
        return f"must be a list of length {wanted}, not {length}" if length else f"{problem['input']} is empty"
    return problem["msg"]


def _syntax(message: str, text: str) -> str:
    """`message (at line 3, column 7)` -> `line 3, column 7: message`."""
    message = message.replace("at end of document", f"at line {text.count(chr(10)) + 1}")
    found = re.fullmatch(r"(?P<what>.*) \(at (?P<where>line [^)]*)\)", message, re.DOTALL)
    return f"{found['where']}: {found['what']}" if found else message
