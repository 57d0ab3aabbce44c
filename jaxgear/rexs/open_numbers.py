"""Numbers that a REXS file leaves open: given beside it, or completed.

One rule holds for files of all versions. A number given under its key of a design file, `pinion.tip_diameter`, takes
the place of the file's. Missing numbers are completed: the dedendum by the root diameter, all others by the defaults
of `Gear`, the basic rack of ISO 53 and steel.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..geometry import Gear
from ..io.errors import DesignFileError, not_known
from .model import CUSTOM, Attribute, Component

# Keys of a design file: attribute of REXS and its unit there, by the component that says it.
GEAR = {
    "teeth": ("number_of_teeth", "none"),
    "module": ("normal_module", "mm"),
    "helix_angle": ("helix_angle_reference_diameter", "deg"),
    "face_width": ("face_width", "mm"),
    "tip_diameter": ("tip_diameter", "mm"),
    "tip_form_diameter": ("tip_form_diameter", "mm"),
    "bore_diameter": ("inner_diameter", "mm"),
}
FLANK = {
    "pressure_angle": ("normal_pressure_angle", "deg"),
    "profile_shift": ("addendum_modification_coefficient", "none"),
    "addendum": ("addendum_coefficient_basic_profile", "none"),
}
TOOL = {
    "dedendum": ("addendum_coefficient_reference_profile", "none"),
    "root_radius": ("tip_corner_radius_factor_reference_profile", "none"),
}
# Of a ring gear, beside the numbers of its flanks; the addendum of its cutter follows from the root circle.
RING = {name: at for name, at in GEAR.items() if name != "bore_diameter"}
RING |= {"rim_diameter": (f"{CUSTOM}rim_diameter", "mm")}
CUTTER = {
    "cutter_teeth": ("number_of_teeth", "none"),
    "cutter_profile_shift": ("addendum_modification_coefficient", "none"),
    "root_radius": ("tip_corner_radius_factor_reference_profile", "none"),
}
STAGE = {"center_distance": ("center_distance", "mm")}
OFFSET = "pair.axial_offset"  # for which REXS has no place
PAIR = "pinion", "wheel"


def attributes(keys: Mapping[str, tuple[str, str]], gear: Gear, **others: object) -> dict[str, tuple[Any, str]]:
    """(value, unit) of the attributes of a component, from fields of a gear or from others in place of these."""
    return {name: (others.get(field, getattr(gear, field)), unit) for field, (name, unit) in keys.items()}


def rack_by_hand(owner: str) -> str:
    """The options that give the rack of a gear, for messages."""
    return "or give the rack: " + " ".join(f"--set {owner}.{name}=VALUE" for name in TOOL)


@dataclass
class Completed:
    """Numbers that the user adds to those of the file.

    Attributes:
        given: by their keys, in the units of a design file.
        gears: names of the gears that the keys may begin with.
        further: further keys, beside the centre distance of the gears.
        numbers: given and completed ones in words, by their keys.
    """

    given: Mapping[str, float]
    gears: tuple[str, ...] = PAIR
    further: tuple[str, ...] = (OFFSET,)
    numbers: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known = [f"{gear}.{name}" for gear in self.gears for name in (GEAR | FLANK | TOOL)]
        known += ["pair.center_distance", *self.further]
        for key in self.given:
            if key not in known:
                raise DesignFileError("", not_known(key, known))

    def of(self, owner: str, part: Component, keys: Mapping[str, tuple[str, str]]) -> Component:
        """Component with the given numbers of its owner (pinion, wheel or pair) in place of its own."""
        attributes = dict(part.attributes)
        for name, (attribute, unit) in keys.items():
            if (key := f"{owner}.{name}") in self.given:
                value = self.given[key]
                held = part.number(attribute, unit)
                replaced = "" if held is None or held == value else f" in place of {held:g}"
                self.numbers[key] = f"{value:g} (given{replaced})"
                attributes[attribute] = Attribute(repr(float(value)), unit)
        options = {attribute: f"{owner}.{name}" for name, (attribute, _) in keys.items()}
        return replace(part, attributes=attributes, keys=options)

    def say(self, key: str, value: object, why: str) -> None:
        """Note a completed number and its source."""
        shown = f"{value:.6g}" if isinstance(value, float) else value
        self.numbers[key] = f"{shown} ({why})"
