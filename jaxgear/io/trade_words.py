"""Words of the trade for the keys of a design file, and what to do where a word stands for another quantity.

Letters alone do not make a key: `root_diameter` is near `bore_diameter`, `transverse_module` ends with `module`, and a
number under the wrong key is wrong in silence. A key is suggested for the same quantity in the same unit (`same`) or
for a misspelling of every part of its name; another quantity (`other`) gets the conversion.
"""

import difflib
import re
import tomllib
from collections.abc import Set
from pathlib import Path

# The words stand in `trade_words.toml`.
_WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
_SAME: dict[str, str] = _WORDS["same"]
_ADVICE: dict[str, str] = {word: advice for words, advice in _WORDS["other"].items() for word in words.split()}
_TABLES = "teeth", "torque", "center_distance", "pinion"  # a key of each of the tables that these words belong to
_COEFFICIENTS = "addendum", "dedendum", "root_radius", "profile_shift", "cutter_profile_shift"
_PART, _WHOLE = 0.7, 0.85  # similarity of a misspelt part, and of a name with its parts run together


def unknown_key(name: str, keys: Set[str]) -> str:
    """Problem with a key that a table does not know: its meaning in the trade, the key that was misspelt, or all keys.

    Args:
        name: unknown key.
        keys: keys of its table.
    """
    plain = _plain(name)
    same = next((key for key, words in _SAME.items() if key in keys and plain in words.split()), "")
    if same:
        return f'unknown key, did you mean "{same}"' + (", in modules?" if same in _COEFFICIENTS else "?")
    if plain in _ADVICE and not keys.isdisjoint(_TABLES):
        return f"unknown key, {_ADVICE[plain]}"
    near = [key for key in difflib.get_close_matches(name, keys, n=3, cutoff=0.5) if _is_misspelt(name, key)]
    if near:
        return f'unknown key, did you mean "{near[0]}"?'
    return f"unknown key, must be one of {', '.join(sorted(keys))}" if keys else "unknown key, nothing is allowed here"


def _is_misspelt(name: str, key: str) -> bool:
    """True if every part of a name is near its counterpart in the key, or the whole is but for underscores."""
    parts, wanted = name.lower().split("_"), key.split("_")
    if len(parts) != len(wanted):
        return _near("".join(parts), "".join(wanted), _WHOLE)
    return all(_near(part, whole, _PART) for part, whole in zip(parts, wanted))


def _near(word: str, wanted: str, least: float) -> bool:
    return difflib.SequenceMatcher(None, word, wanted).ratio() >= least


def _plain(name: str) -> str:
    """A name without underscores, hyphens and the index of the gear."""
    return re.sub("[_-]", "", name).lower().rstrip("12")


def remark_on(key: str, value: object) -> str:
    """Further words on a value that its key refuses: ": " and what to do, "" for nothing.

    Args:
        key: dotted key.
        value: refused number or text.
    """
    name = key.rpartition(".")[2].partition("[")[0]
    if isinstance(value, str):
        comma = re.fullmatch(r"\s*([+-]?\d+),(\d+)\s*", value)
        if comma:
            return f": write {comma[1]}.{comma[2]} without quotes, with a decimal point"
        grade = re.fullmatch(r"\s*(?:ISO|A)?\s*(\d+)\s*", value, re.IGNORECASE)
        if name == "quality_class" and grade:
            return f": write the number of the ISO 1328-1 class alone, {name} = {grade[1]}"
        return f": {_ADVICE['agmaquality']}" if name == "quality_class" else ""
    if name == "teeth" and isinstance(value, int | float) and value < 0:
        return f": a negative number means an internal gear, which {_ADVICE['internal']}"
    return ""
