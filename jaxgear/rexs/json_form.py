"""REXS files in JSON (REXS 1.5 and later).

Numbers are read as text, so that their digits are those of the file.
"""

import json
from collections.abc import Callable
from typing import Any

from ..io.errors import DesignFileError
from .model import checked_object

_MAKE: dict[str, Callable[[str], Any]] = {"floating_point": float, "integer": int, "boolean": "true".__eq__}


def parse_json(content: bytes) -> dict[str, Any]:
    """The data of a file, see `model`.

    Raises:
        DesignFileError: for what is not valid JSON, or no REXS model.
    """
    try:
        data = json.loads(content.decode("utf-8-sig"), parse_float=str, parse_int=str, parse_constant=str)
    except json.JSONDecodeError as error:
        raise DesignFileError("", f"line {error.lineno}, column {error.colno}: not valid JSON: {error.msg}") from None
    except UnicodeDecodeError:
        raise DesignFileError("", "not valid JSON: not UTF-8 text") from None
    except RecursionError:
        raise DesignFileError("", "not valid JSON: nested too deeply") from None
    return checked_object(checked_object(data, "file").get("model"), "model")


def to_json(data: dict[str, Any]) -> bytes:
    """The file: UTF-8 with a byte order mark, as REXS has it."""
    cases = data.get("load_spectrum", {}).get("load_cases", [])
    for component in sum((case["components"] for case in cases), data["components"]):
        component["attributes"] = [_typed(*attribute.items()) for attribute in component["attributes"]]
    return b"\xef\xbb\xbf" + json.dumps({"model": data}, ensure_ascii=False, indent=1).encode("utf-8") + b"\n"


def _typed(*items: tuple[str, Any]) -> dict[str, Any]:
    """An attribute with numbers and booleans in place of texts."""
    *named, (kind, value) = items
    make = _MAKE.get(kind.removesuffix("_array"), str)
    return {**dict(named), kind: make(value) if isinstance(value, str) else [make(each) for each in value]}
