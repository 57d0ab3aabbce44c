"""From the text of a design file to typed tables, every problem in one line with its key."""

import re
import tomllib
import typing
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from .errors import DesignFileError, suggestion

S = TypeVar("S", bound=msgspec.Struct)

_AT = re.compile(r" - at `\$\.?(?P<path>[^`]*)`$")
_UNKNOWN = re.compile(r"Object contains unknown field `(?P<name>.*)`", re.DOTALL)
_INVALID = re.compile(r"Invalid enum value '(?P<value>.*)'", re.DOTALL)
_MISSING = re.compile(r"Object missing required field `(?P<name>.*)`")
# the words of TOML for the types in msgspec's messages
_WORDS = {
    "float | str": "a number or the name of a variable",
    "int | object": "a whole number, or a table with one entry per variable",
    "int | array": "a whole number or a list",
    "float": "a number",
    "int": "a whole number",
    "str": "a string",
    "object": "a table",
    "array": "a list",
    "bool": "true or false",
}


def read(path: Path) -> dict[str, Any]:
    """Reads a TOML file.

    Raises:
        DesignFileError: when it cannot be read or is not TOML.
    """
    try:
        if path.exists() and not path.is_file():
            raise DesignFileError(path, "", "is a folder, not a file" if path.is_dir() else "is not a regular file")
        content = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a path with a null byte
        if isinstance(error, DesignFileError):
            raise
        raise DesignFileError(path, "", getattr(error, "strerror", None) or error) from None
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise DesignFileError(path, "", f"line {line}: not UTF-8 text") from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise DesignFileError(path, "", _syntax(str(error), text)) from None
    except RecursionError:
        raise DesignFileError(path, "", "tables or lists are nested too deeply") from None


def decode(file: Path, key: str, data: Any, section: type[S]) -> S:
    """Decodes one table into its struct.

    Args:
        file: for the message.
        key: dotted key of the table, "" at the top level.
        data: the table.
        section: the struct.

    Raises:
        DesignFileError: for unknown or missing keys and wrong types.
    """
    try:
        return msgspec.convert(data, section)
    except msgspec.ValidationError as error:
        problem = str(error)
    at = _AT.search(problem)
    name = at["path"] if at else ""
    if at:
        problem, key = problem[: at.start()], join(key, name)
    if invalid := _INVALID.fullmatch(problem):
        choices = _choices(section, name)
        raise DesignFileError(file, key, f'"{invalid["value"]}" is not known, {suggestion(invalid["value"], choices)}')
    if unknown := _UNKNOWN.fullmatch(problem):
        names = [field.encode_name for field in msgspec.structs.fields(section)]
        raise DesignFileError(file, join(key, unknown["name"]), f"unknown key, {suggestion(unknown['name'], names)}")
    if missing := _MISSING.fullmatch(problem):
        raise DesignFileError(file, join(key, missing["name"]), "missing, this key is required")
    raise DesignFileError(file, key, _translate(problem))


def join(key: str, name: str) -> str:
    """Dotted key."""
    return f"{key}.{name}" if key and name else key or name


def _syntax(message: str, text: str) -> str:
    """`message (at line 3, column 7)` -> `line 3, column 7: message`."""
    message = message.replace("at end of document", f"at line {text.count(chr(10)) + 1}")
    found = re.fullmatch(r"(?P<what>.*) \(at (?P<where>line [^)]*)\)", message, re.DOTALL)
    return f"{found['where']}: {found['what']}" if found else message


def _translate(problem: str) -> str:
    problem = problem.replace(" | null", "")
    for name, words in _WORDS.items():
        problem = problem.replace(f"`{name}`", words)
    return problem.replace("Expected", "must be").replace(", got", ", not").replace("`", "")


def _choices(section: type[msgspec.Struct], name: str) -> list[str]:
    """The strings that a Literal field allows."""
    hint = typing.get_type_hints(section).get(name)
    parts = typing.get_args(hint)
    return [value for part in (hint, *parts) for value in typing.get_args(part) if isinstance(value, str)]
