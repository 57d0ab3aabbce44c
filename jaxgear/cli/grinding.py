"""What to grind, as a drawing says it: every part of a modification with its amount, length and curve."""

from collections.abc import Iterator, Mapping
from typing import Any

import jax
import numpy as np

from ..contact import Mesh, Side
from ..io import describe
from ..io.results import unit_of
from ..metrics import flank_surface
from ..microgeometry import AbstractModification

_NOTHING = "nothing, the involute stays"
_DIGITS = {"um": ".2f", "mm": ".3f"}
_MOST = 4  # numbers of a curve that are written out


def to_grind(
    mesh: Mesh, pinion: AbstractModification, wheel: AbstractModification, design: str = ""
) -> Iterator[tuple[str, str]]:
    """Rows of gear and text, one for every part of both modifications.

    Args:
        mesh: prepared mesh.
        pinion, wheel: modifications of concrete numbers.
        design: what they are called, where several designs are listed.
    """
    for gear, side, modification in zip(("pinion", "wheel"), mesh.sides, (pinion, wheel)):
        label = f"{gear}, {design}" if design else gear
        for part in describe(modification) or [{}]:
            yield label, _part(part, side, modification) if part else _NOTHING
            label = ""


def _part(part: Mapping[str, Any], side: Side, modification: AbstractModification) -> str:
    """One part: "tip relief 5.60 um over 5.581 mm of roll length, parabolic, from diameter 59.931 mm to the tip"."""
    rest = dict(part)
    kind = rest.pop("type")
    if isinstance(rest.get("amount"), list):
        values = np.asarray(rest["amount"])
        return (
            f"{kind.replace('_', ' ')} of {values.size} values, {values.min():.2f} to {values.max():.2f} um, flanks.csv"
        )
    text = kind.replace("_", " ")
    if "amount" in rest:
        text += f" {_number(rest.pop('amount'), unit_of(kind, 'amount'))}"
    length = rest.pop("length", None)
    if length is not None:
        text += f" over {_number(length, unit_of(kind, 'length'))}"
        text += " of roll length" * (kind in _ENDS)
    if "curve" in rest:
        text += f", {_curve(rest.pop('curve'))}"
    for name, value in rest.items():
        text += f", {name.replace('_', ' ')} {_number(value, unit_of(kind, name))}"
    return text + (_ENDS[kind](side, modification, length) if kind in _ENDS and length else "")


def _from_tip(side: Side, modification: AbstractModification, length: float) -> str:
    return f", from {_place(side, modification, -1, -length)} to the tip"


def _to_root(side: Side, modification: AbstractModification, length: float) -> str:
    return f", from the start of the active profile to {_place(side, modification, 0, length)}"


_ENDS = {"tip_relief": _from_tip, "root_relief": _to_root}


def _place(side: Side, modification: AbstractModification, end: int, further: float) -> str:
    """Diameter and roll angle of a roll length, counted from an end of the active profile."""
    surface = jax.tree.map(np.asarray, flank_surface(side, modification))
    base = np.sqrt((0.5 * surface.diameter[-1]) ** 2 - surface.roll_length[-1] ** 2)
    roll = max(float(surface.roll_length[end]) + further, 0.0)
    return f"diameter {2 * np.hypot(base, roll):.3f} mm (roll angle {np.rad2deg(roll / base):.2f} deg)"


def _curve(curve: Mapping[str, Any]) -> str:
    given = [np.ravel(value) for name, value in curve.items() if name != "type"]
    numbers = [f"{number:.3g}" for of in given for number in of]
    shown = numbers if len(numbers) <= _MOST else [f"of {len(numbers)} values"]
    return " ".join([curve["type"].replace("_", " "), *shown])


def _number(value: Any, unit: str) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:{_DIGITS.get(unit, '.4g')}} {unit}".rstrip()
    return str(value)
