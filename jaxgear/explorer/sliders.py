"""Numbers of a design file that the page moves, and the design files of their values.

Every slider is a variable of a design file. A file with variables has its own; one without gets those of its tip
reliefs, crownings and slopes. Torque, speed and, with several slices, misalignment are sliders of every file.
"""

import copy
import re
from collections.abc import Iterator, Mapping, MutableMapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from ..io import DesignFile, DesignFileError, load_design
from ..io.design_file import checked
from ..io.results import unit_of
from ..io.toml import read
from ..io.write_design import relief_bounds
from ..studies.comparison import rule_based

# numbers of the modifications that are sliders where the file has no variables
_ALONG = {"tip_relief": ("amount", "length"), "profile_crowning": ("amount",), "profile_slope": ("amount",)}
_ACROSS = {"lead_crowning": ("amount",), "lead_slope": ("amount",)}
_MOST_AMOUNT = 10.0  # of crownings and slopes, to either side [um]
_MOST_MISALIGNMENT = 20.0  # over the face, to either side [um]
_SPEEDS = 0.1, 2.0  # relative to the speed of the file
_ROOM = 2.0  # of a number of the file within its bounds: up to so many times its amount


@dataclass(frozen=True)
class Slider:
    """A number that the page moves.

    Attributes:
        name: name of the variable.
        label: name in words.
        unit: "" for a pure number.
        low, high: bounds.
        value: value at the start.
        keys: dotted keys of the numbers of the file that it stands for; empty for a variable of the file.
        group: "pinion", "wheel", "both flanks" or "load".
    """

    name: str
    label: str
    unit: str
    low: float
    high: float
    value: float
    keys: tuple[str, ...]
    group: str


class Opened:
    """A design file whose sliders are variables.

    Attributes:
        path: the file.
        design: the design file with all sliders as variables.
        sliders: sliders by their names.
    """

    def __init__(self, path: str | Path) -> None:
        """Open a design file.

        Raises:
            DesignFileError: for errors in the file, and for one of a stage, in one line.
        """
        self.path = Path(path)
        given = load_design(self.path)
        for name in given.part_of:
            raise DesignFileError(name, "is more than a pair, and the page shows one: give a file of one mesh", path)
        self._content = read(self.path)
        try:
            self._text = self.path.read_text(encoding="utf-8-sig")
            tomlkit.parse(self._text)
        except (OSError, TOMLKitError) as error:
            raise DesignFileError("", str(error), self.path) from None
        every = [*_own(given), *_of_flanks(given, self._content), *_of_load(given)]
        self.sliders = {slider.name: slider for slider in every}
        self._content["load"].setdefault("torque_range", list(given.torque_range))  # that of a slider is another one
        self.design = checked(self.path, self._with_variables(self._content, {}))

    @property
    def values(self) -> dict[str, float]:
        """Values of all sliders at the start."""
        return {name: slider.value for name, slider in self.sliders.items()}

    def check(self, values: Mapping[str, Any]) -> dict[str, float]:
        """Values of all sliders, those of the start for missing ones.

        Raises:
            ValueError: for an unknown slider, something else than a number, and a number beyond the bounds.
        """
        found = self.values
        for name, value in values.items():
            slider = self.sliders.get(name)
            if slider is None:
                raise ValueError(f"{name}: unknown slider, must be one of {', '.join(self.sliders)}")
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ValueError(f"{name}: must be a number")
            if not slider.low <= value <= slider.high:
                unit = f" {slider.unit}".rstrip()
                limits = f"at least {slider.low:g}{unit} and at most {slider.high:g}{unit}"
                raise ValueError(f"{name} = {value:g}{unit} must be {limits}")
            found[name] = float(value)
        return found

    def text(self, values: Mapping[str, float]) -> str:
        """Design file with these values, with the comments of the file; its own variables keep their bounds."""
        content = tomlkit.parse(self._text)
        for name, slider in self.sliders.items():
            if not slider.keys:
                _put(content, f"variables.{name}.value", values[name])
        self._put_numbers(content, values, list(self.sliders))
        return tomlkit.dumps(content)

    def searched(self, values: Mapping[str, float]) -> DesignFile:
        """Design file for a search of the flanks from these values: all else stays as it is now.

        Raises:
            DesignFileError: for a design without sliders of flanks.
        """
        held = {free.name: free.key for free in self.design.open_case}
        return checked(self.path, self._with_variables(self._content, {name: values[name] for name in held}, values))

    def _with_variables(
        self, given: Mapping[str, Any], numbers: Mapping[str, float], values: Mapping[str, float] | None = None
    ) -> dict[str, Any]:
        """Content with the sliders as variables, except for those with numbers."""
        content = copy.deepcopy(dict(given))
        variables = content.setdefault("variables", {})
        now = self.values if values is None else values
        for name, slider in self.sliders.items():
            if name in numbers:
                variables.pop(name, None)
                continue
            bounds = {"low": slider.low, "high": slider.high}
            variables[name] = {**variables.get(name, bounds), "value": now[name]}
            for key in slider.keys:
                _put(content, key, name)
        self._put_numbers(content, numbers, list(numbers))
        for free in self.design.open_case if numbers else ():
            if free.name in numbers and not self.sliders[free.name].keys:
                _put(content, free.key, -numbers[free.name] if free.opposite else numbers[free.name])
        if not variables:
            del content["variables"]
        return content

    def _put_numbers(self, content: MutableMapping[str, Any], numbers: Mapping[str, float], names: list[str]) -> None:
        """Put numbers in their places; modifications that the file lacks only where they remove something."""
        for name in names:
            for key in self.sliders[name].keys:
                amount = next((each for each in self.sliders.values() if each.keys == (_sibling(key),)), None)
                if amount is None or numbers[amount.name] or _at(self._content, key) is not None:
                    _put(content, key, numbers[name])


def _own(design: DesignFile) -> Iterator[Slider]:
    """Variables of the file."""
    of = {
        gear: {free.name for part in getattr(design.design, gear) for free in part.free()}
        for gear in ("pinion", "wheel")
    }
    for name, (low, high) in design.bounds.items():
        value = design.values.get(name, 0.5 * (low + high))
        gears = [gear for gear, names in of.items() if name in names]
        group = "load" if not gears else gears[0] if len(gears) == 1 else "both flanks"
        yield Slider(name, name.replace("_", " "), design.units[name], low, high, value, (), group)


def _of_flanks(design: DesignFile, content: Mapping[str, Any]) -> Iterator[Slider]:
    """Tip reliefs, crownings and slopes of a file without variables."""
    if design.bounds:
        return
    kinds = _ALONG | (_ACROSS if design.resolution().slices > 1 else {})
    rule = rule_based(design)
    relief: Any = relief_bounds(float(rule.amount), float(rule.length), float(design.pair().pinion.module))  # type: ignore[attr-defined]
    for gear, table in (("pinion", "pinion"), ("wheel", "ring" if "ring" in content else "wheel")):
        key = "coast_modification" if design.coast else "modification"
        given = content[table].get(key, [])
        for kind, fields in kinds.items():
            found = next((each for each in given if each.get("type") == kind), None)
            for name in fields:
                low, high = relief[name] if kind == "tip_relief" else (-_MOST_AMOUNT, _MOST_AMOUNT)
                value = high if name == "length" else 0.0
                value = value if found is None else float(found[name])
                if found is not None:
                    low, high = min(low, _ROOM * value), max(high, _ROOM * value)
                place = f"{table}.{key}.{kind}.{name}"
                label = f"{kind.replace('_', ' ')}, {name}"
                yield Slider(f"{gear}_{kind}_{name}", label, unit_of(kind, name), low, high, value, (place,), gear)


def _of_load(design: DesignFile) -> Iterator[Slider]:
    """Torque, speed and misalignment where they are numbers of the file."""
    free = {each.key for each in design.open_case}
    if "load.torque" not in free and not design.coast:
        low, high = min(design.torque_range[0], design.torque), max(design.torque_range[1], design.torque)
        yield Slider(_unused("torque", design), "torque", "N m", low, high, design.torque, ("load.torque",), "load")
    if design.speed is not None and "load.speed" not in free:
        low, high = (share * design.speed for share in _SPEEDS)
        yield Slider(_unused("speed", design), "speed", "rpm", low, high, design.speed, ("load.speed",), "load")
    if design.support is None and design.resolution().slices > 1 and "misalignment.direct" not in free:
        value = float(design.misalignment.fields.get("direct", 0.0))
        most = max(_MOST_MISALIGNMENT, _ROOM * abs(value))
        name = _unused("misalignment", design)
        yield Slider(name, "misalignment over the face", "um", -most, most, value, ("misalignment.direct",), "load")


def _unused(name: str, design: DesignFile) -> str:
    """Name that no variable of the file has."""
    while name in design.bounds:
        name += "_"
    return name


_PART = re.compile(r"[^.\[\]]+")


def _sibling(key: str) -> str:
    """Key of the amount of the modification that a number belongs to."""
    return re.sub(r"\w+$", "amount", key)


def _at(content: Any, key: str) -> Any:
    """Value of a dotted key; None where there is none."""
    for part in _PART.findall(key):
        found = _item(content, part)
        if found is None:
            return None
        content = found
    return content


def _item(held: Any, part: str) -> Any:
    """Item of a table, or of a list by its index or, of modifications, by their type; None for a missing one."""
    if isinstance(held, Mapping):
        return held.get(part)
    if part.isdigit():
        return held[int(part)]
    return next((each for each in held if each.get("type") == part), None)


def _put(content: MutableMapping[str, Any], key: str, value: float | str) -> None:
    """Put a value at a dotted key; missing tables and modifications are made."""
    *way, last = _PART.findall(key)
    held: Any = content
    for part in way:
        found = _item(held, part)
        if found is None and isinstance(held, MutableMapping):
            held[part] = [] if part.endswith("modification") else {}
        elif found is None:
            held.append({"type": part})
        held = _item(held, part)
    if held.get(last) != value:  # numbers that stay keep their spelling
        held[last] = value
