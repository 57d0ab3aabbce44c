"""A first look at the keys of a design file, without JAX: a misspelt key is reported in a fraction of a second.

`keys.json` holds the keys of the library's tables. It is generated from the classes that read them:

    python -m jaxgear.io keys > keys.json && mv keys.json jaxgear/io/
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..provided import provided
from .errors import DesignFileError, join, naming
from .toml import read
from .trade_words import unknown_key

MODIFICATION, MATERIAL, VARIABLE = "modification of type {}", "material", "variable"
GEARS = "pinion", "wheel", "sun"
METHODS = "optimize.method"
KEYS = Path(__file__).with_name("keys.json")


def check_keys(path: Path) -> None:
    """Check the keys of the tables that no other package can extend; everything else is left to `load_design`.

    Raises:
        DesignFileError: for a file that is not TOML, and for an unknown key.
    """
    known = {name: set(keys) for name, keys in json.loads(KEYS.read_text(encoding="utf-8")).items()}
    with naming(path):
        says = read(path)
        for key, table, kind in _tables(says):
            unknown = [name for name in table if name not in known.get(kind, table)]
            if unknown and not key:
                known[key] |= {*provided("tables")}
                unknown = [name for name in unknown if name not in known[key]]
            if unknown:
                raise DesignFileError(join(key, unknown[0]), unknown_key(unknown[0], known[kind]))


def known_methods() -> list[str]:
    """Names of the methods of a search."""
    return json.loads(KEYS.read_text(encoding="utf-8"))[METHODS]


def _tables(says: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any], str]]:
    """Dotted key, content and kind of the tables of a file."""
    yield "", says, ""
    for name, table in says.items():
        if not isinstance(table, dict):
            continue
        several = {"materials": MATERIAL, "variables": VARIABLE}.get(name)
        if several is None:
            yield name, table, name
        else:
            yield from ((join(name, own), each, several) for own, each in table.items() if isinstance(each, dict))
        given = table.get("modification") if name in (*GEARS, "ring", "planet") else None
        for number, each in enumerate(given if isinstance(given, list) else []):
            if isinstance(each, dict):
                own = {key: value for key, value in each.items() if key != "type"}
                yield f"{name}.modification[{number}]", own, MODIFICATION.format(each.get("type"))
