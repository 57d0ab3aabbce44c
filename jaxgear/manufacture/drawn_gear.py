"""A gear as its drawing describes it."""

from dataclasses import fields
from typing import Any

import numpy as np

from ..geometry import Gear
from .drawn_profile import REPLACED, ToothProfile, with_profile
from .tooth_thickness import WAYS, ToothThickness, with_thickness


def drawn_gear(**given: Any) -> Gear:
    """A gear with what its drawing says: the arguments of `Gear`, of `ToothThickness` and of `ToothProfile`.

    Raises:
        ValueError: for what any of them refuses, for a `tooth_thickness_tolerance` beside lower and upper limit, and
            for a number of the drawing beside the one that it replaces.
    """
    profile = _taken(given, ToothProfile)
    for name in profile:
        if profile[name] is not False and given.get(REPLACED[name]) is not None:
            raise ValueError(f"ToothProfile: {name}: cannot be given with {REPLACED[name]}: give one of them")
    gear = _thick_gear(given)
    return with_profile(gear, ToothProfile(**profile)) if profile else gear


def _thick_gear(given: dict[str, Any]) -> Gear:
    thickness = _taken(given, ToothThickness)
    if not thickness:
        return Gear(**given)
    says = ToothThickness(**thickness)
    if given.get("tooth_thickness_tolerance") is not None:
        which = next(name for name in WAYS if name in thickness)
        if which != "tooth_thickness_allowance" or np.ndim(thickness[which]):
            raise ValueError(f"Gear: tooth_thickness_tolerance: has no effect, give lower and upper limit of {which}")
        return Gear(**given, **thickness)
    return with_thickness(Gear(**given), says)


def _taken(given: dict[str, Any], cls: type) -> dict[str, Any]:
    """Takes the fields of a class that are not None out of what is given."""
    found = {field.name: given.pop(field.name, None) for field in fields(cls)}
    return {name: value for name, value in found.items() if value is not None}
