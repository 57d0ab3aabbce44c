"""The table [tolerance] of a design file in a study: how many manufactured pairs, and what is said of them."""

from typing import Any

from ..io import DesignFile

_QUICK_PAIRS = 16


def pairs_of(design: DesignFile, *, quick: bool) -> int:
    """How many manufactured pairs a design is judged by."""
    assert design.tolerance is not None
    return min(design.tolerance.samples, _QUICK_PAIRS) if quick else design.tolerance.samples


def left_out(design: DesignFile, why: str = "") -> str:
    """That an analysis is of nominal gears though the file has tolerances; "" where it has none."""
    if design.tolerance is None:
        return ""
    return "[tolerance] is not part of this analysis, the gears are nominal" + f" ({why})" * bool(why)


def tolerances(design: DesignFile) -> dict[str, Any]:
    """What the table [tolerance] says, as plain data."""
    return {} if design.tolerance is None else {"tolerances": design.tolerance.given()}


def pairs_in_words(design: DesignFile, count: int) -> str:
    """How many manufactured pairs of which class."""
    assert design.tolerance is not None
    classes = design.tolerance.quality_class
    named = "/".join(map(str, classes)) if isinstance(classes, list) else str(classes)
    return f"{count} manufactured pairs of quality class {named}"
