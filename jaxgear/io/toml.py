"""From a TOML file to its tables and values, every problem in one line."""

import re
import tomllib
from pathlib import Path
from typing import Any

from .errors import DesignFileError, check_file, join, obeyed

# Parts of a dotted key: a design file nests its tables three deep, and time and memory of the parser grow with the
# square of this number.
_MOST_PARTS = 32
_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{{_MOST_PARTS}}}")
_DECIMAL_COMMA = re.compile(r"=\s*([+-]?\d+),(\d+)\s*(?:[#,}]|$)")


def content(path: Path) -> bytes:
    """Bytes of a file.

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


def _syntax(message: str, text: str) -> str:
    """`message (at line 3, column 7)` -> `line 3, column 7: message`."""
    message = message.replace("at end of document", f"at line {text.count(chr(10)) + 1}")
    found = re.fullmatch(r"(?P<what>.*) \(at (?P<where>line (?P<line>\d+)[^)]*)\)", message, re.DOTALL)
    if found is None:
        return message
    comma = _DECIMAL_COMMA.search(text.split("\n")[int(found["line"]) - 1])
    remark = f"; if {comma[1]},{comma[2]} has a decimal comma, write {comma[1]}.{comma[2]}" if comma else ""
    return f"{found['where']}: {found['what']}{remark}"
