"""Writes design files: a gear pair with its modifications and its load, or one to begin with."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import Gear, GearPair, RingGear
from ..microgeometry import AbstractModification
from ..numerics import check, compile_quickly, fields_of, real
from ..numerics.durable import write_durably
from ..sizing import iso_relief
from .errors import printable
from .folder import writing
from .results import describe, unit_of

_SHORTEST = 0.3  # of a relief that is searched, in modules
_MOST, _LEAST_MOST = 3.0, 20.0  # largest amount that is searched, relative to that of the rule and at least [um]

# basic rack of ISO 53: degrees, and coefficients of the module
_PRESSURE_ANGLE, _ADDENDUM, _DEDENDUM = 20.0, 1.0, 1.25

_STARTER = Path(__file__).with_name("starter.txt")  # with fields to be filled
_HAND = "helix_angle = {angle!r}   # deg, positive for a right hand; the {mate} has the {other}\n"
_SPUR = "# helix_angle = 15.0            # deg, positive for a right hand; the {mate} has the {other}\n"
_RACK = "pressure_angle = {angle!r}         # deg\n"
_FILLET = "root_radius = {radius:.4f}          # x module, c_P / (1 - sin(alpha)) of ISO 53\n"
_SHIFT = "profile_shift = {shift!r}          # x module\n"
_NO_SHIFT = "# profile_shift = 0.0           # x module\n"
_RIM = "# rim_diameter = {rim:.1f}          # mm, where the ring is held; a rim of 3.5 modules where it is not given\n"
_CUTTER = "# cutter_teeth = {teeth:.0f}             # of the pinion-type cutter; 0.4 z where they are not given\n"
_SPEED = "speed = {speed!r}                # rpm of the pinion\n"
_NO_SPEED = "# speed = 1500.0                # rpm of the pinion, for temperatures, film and loss\n"


def write_starter(
    path: str | Path,
    teeth: tuple[int, int],
    *,
    module: float,
    torque: float,
    face_width: float,
    speed: float | None,
    helix_angle: float = 0.0,
    pressure_angle: float = 20.0,
    profile_shift: tuple[float, float] = (0.0, 0.0),
    ring: bool = False,
) -> GearPair:
    """Write a commented design file of a pair, ready for `jaxgear analyze` and `jaxgear optimize`.

    Args:
        path: path of the TOML file, which must not exist.
        teeth: teeth of pinion and wheel.
        module: [mm].
        torque: torque on the pinion [N m].
        face_width: face width of both gears [mm].
        speed: speed of the pinion [rpm]; None for none.
        helix_angle: helix angle of the pinion [deg].
        pressure_angle: pressure angle of the basic rack [deg]; below 20 degrees with the root radius of ISO 53 for its
            clearance.
        profile_shift: profile shift of pinion and wheel [x module].
        ring: True if the wheel is a ring gear.

    Returns:
        the pair.

    Raises:
        ValueError: for gears that are not possible, a torque that is not positive, or a file that exists already or
            cannot be written.
    """
    path = check_new(path, torque, speed)
    compile_quickly()
    pair = starter_pair(teeth, module, face_width, helix_angle, pressure_angle, profile_shift, ring)
    rule = iso_relief(pair, torque)
    amount, length = float(rule.amount), max(float(rule.length), _SHORTEST * module)
    bounds = relief_bounds(amount, length, module)
    rack = "" if pressure_angle == _PRESSURE_ANGLE else _RACK.format(angle=pressure_angle)
    fillet = _FILLET.format(radius=float(pair.pinion.root_radius)) if pressure_angle < _PRESSURE_ANGLE else ""
    shifts = [_SHIFT.format(shift=shift) if shift else _NO_SHIFT for shift in profile_shift]
    mate_shift = shifts[1] if profile_shift[1] else ""
    if ring:
        rim, cutter = -2 * float(pair.wheel.bore_radius), float(np.asarray(pair.wheel.cutter_teeth))
        mate_shift += _RIM.format(rim=rim) + _CUTTER.format(teeth=cutter)
    others = {"mate": "ring", "other": "same"} if ring else {"mate": "wheel", "other": "other"}
    write_filled(
        path,
        _STARTER,
        title=f"{teeth[0]}/{teeth[1]} pair, module {module:g} mm",
        pinion=teeth[0],
        wheel=teeth[1],
        module=module,
        face_width=face_width,
        distance=float(pair.working_center_distance),
        torque=torque,
        mate=others["mate"],
        rack=rack + fillet,
        mate_rack=rack if ring else rack + fillet,
        shift=shifts[0],
        mate_shift=mate_shift,
        hand=_HAND.format(angle=helix_angle, **others) if helix_angle else _SPUR.format(**others),
        speed=speed_line(speed),
        amount=amount,
        most=bounds["amount"][1],
        length=length,
        shortest=bounds["length"][0],
        longest=length + 0.005,  # rounding must not put the value outside
    )
    return pair


def relief_bounds(amount: float, length: float, module: float) -> dict[str, tuple[float, float]]:
    """Bounds of a tip relief that is searched, by the names of its numbers.

    Args:
        amount, length: those of the rule-based relief [um, mm].
        module: [mm].
    """
    return {
        "amount": (0.0, max(_MOST * amount, _LEAST_MOST)),
        "length": (min(_SHORTEST * module, 0.5 * length), length),
    }


def check_new(path: str | Path, torque: float, speed: float | None) -> Path:
    """Path of a design file to begin with.

    Args:
        path: path of the TOML file, which must not exist.
        torque: torque of the file [N m].
        speed: speed of the file [rpm]; None for none.

    Raises:
        ValueError: for a torque or speed that is not positive, another ending, or a file that exists already.
    """
    path = Path(path)
    if path.suffix != ".toml":
        raise ValueError(f"{path}: the name of a design file must end in .toml")
    if path.exists() or path.is_symlink():
        raise ValueError(f"{path}: exists already, choose another name")
    check("torque", torque, "N m", low=0.0, open_low=True)
    if speed is not None:
        check("speed", speed, "rpm", low=0.0, open_low=True)
    return path


def speed_line(speed: float | None, of: str = "the pinion") -> str:
    """Line of a design file with a speed [rpm], or a comment in its place."""
    return (_NO_SPEED if speed is None else _SPEED.format(speed=speed)).replace("the pinion", of)


def write_filled(path: Path, template: Path, **fields: object) -> None:
    """Write a design file from a text with fields, comments of numbers in line.

    Raises:
        ValueError: if it cannot be written.
    """
    text = template.read_text(encoding="utf-8").format(name=path.name, **fields)
    lined = re.sub(r"^(\S[^#\n]*?|# \S+ = \S+) +# ", lambda found: f"{found[1]:<31} # ", text, flags=re.MULTILINE)
    with writing(path):
        write_durably(path, lambda file: file.write(lined.encode("utf-8")))


def starter_pair(
    teeth: tuple[int, int],
    module: float,
    face_width: float,
    helix_angle: float = 0.0,
    pressure_angle: float = _PRESSURE_ANGLE,
    profile_shift: tuple[float, float] = (0.0, 0.0),
    ring: bool = False,
) -> GearPair:
    """The pair of `write_starter`, with its arguments.

    Raises:
        ValueError: for gears that are not possible.
    """
    fillet: Any = None
    kinds: Any = Gear, RingGear if ring else Gear
    if pressure_angle < _PRESSURE_ANGLE:
        # of ISO 53: c_P / (1 - sin(alpha)), so that the rack is straight down to the addendum of the mate
        radius = (_DEDENDUM - _ADDENDUM) / (1 - np.sin(np.deg2rad(pressure_angle)))
        fillet = real(np.floor(1e4 * radius) / 1e4)
    pinion, wheel = (
        make(
            real(count),
            real(module),
            real(pressure_angle),
            real(shift),
            face_width=real(face_width),
            helix_angle=real(hand),
            root_radius=None if make is RingGear else fillet,
        )
        for make, count, shift, hand in zip(
            kinds, teeth, profile_shift, (helix_angle, helix_angle if ring else -helix_angle)
        )
    )
    return GearPair(pinion, wheel)


def write_design(
    path: str | Path,
    pair: GearPair,
    *,
    torque: float,
    pinion: AbstractModification,
    wheel: AbstractModification,
    speed: float | None = None,
    quality_classes: tuple[int, int] | None = None,
    title: str = "",
) -> None:
    """Write a design file as a whole or not at all, in place of an earlier one.

    Args:
        path: path of the TOML file.
        pair: gear pair of concrete numbers.
        torque: torque on the pinion [N m].
        pinion, wheel: modifications of the flanks, of the library's classes and their sums.
        speed: speed of the pinion [rpm].
        quality_classes: flank tolerance classes of pinion and wheel (ISO 1328-1:2013).
        title: free text.

    Raises:
        ValueError: for a torque that is not positive, a ring gear with a support, or where the file cannot be written.
    """
    check_rim(pair, "write_design")
    names = "pinion", "ring" if pair.wheel.is_internal else "wheel"
    mounting = {} if pair.center_distance is None else {"center_distance": pair.center_distance}
    mounting |= {"axial_offset": pair.axial_offset} if float(pair.axial_offset) != 0 else {}
    _write(
        path,
        title,
        dict(zip(names, pair.gears)),
        _classes(names, quality_classes),
        {"pair": [_line(name, value, "mm") for name, value in mounting.items()]},
        (torque, speed, "the pinion"),
        {f"{name}.modification": flank for name, flank in zip(names, (pinion, wheel))},
    )


def write_stage_design(
    path: str | Path,
    sun_planet: GearPair,
    planet_ring: GearPair,
    *,
    stage: Mapping[str, Any],
    units: Mapping[str, str],
    torque: float,
    flanks: Mapping[str, AbstractModification],
    speed: float | None = None,
    quality_classes: tuple[int, int, int] | None = None,
    title: str = "",
) -> None:
    """Write a design file of a planetary stage as a whole or not at all, in place of an earlier one.

    Args:
        path: path of the TOML file.
        sun_planet, planet_ring: the pairs, of concrete numbers.
        stage: values of the table [stage] by their keys.
        units: units of its numbers by their keys.
        torque: torque on the driving member [N m].
        flanks: modifications of the flanks by the names sun, planet_to_sun, planet_to_ring and ring.
        speed: speed of the driving member [rpm].
        quality_classes: flank tolerance classes of sun, planet and ring (ISO 1328-1:2013).
        title: free text.

    Raises:
        ValueError: for a torque that is not positive, a ring gear with a support, or where the file cannot be written.
    """
    check_rim(planet_ring, "write_stage_design")
    names = "sun", "planet", "ring"
    headings = "sun.modification", "planet.modification", "planet.ring_modification", "ring.modification"
    keys = _classes(names, quality_classes)
    if describe(flanks["planet_to_sun"]) and not describe(flanks["planet_to_ring"]):
        keys["planet"] = [*keys.get("planet", []), "ring_modification = []  # without it that of both flanks"]
    _write(
        path,
        title,
        dict(zip(names, (*sun_planet.gears, planet_ring.wheel))),
        keys,
        {
            "pair": [_line("center_distance", sun_planet.working_center_distance, "mm")],
            "stage": [_line(name, value, units.get(name, "")) for name, value in stage.items()],
        },
        (torque, speed, "the driving member"),
        dict(zip(headings, (flanks[name] for name in ("sun", "planet_to_sun", "planet_to_ring", "ring")))),
    )


def _write(
    path: str | Path,
    title: str,
    gears: Mapping[str, Gear],
    keys: Mapping[str, list[str]],
    tables: Mapping[str, list[str]],
    load: tuple[float, float | None, str],
    flanks: Mapping[str, AbstractModification],
) -> None:
    """Write gears with further keys, further tables, load of a member, and modifications by their headings."""
    torque, speed, member = load
    check("torque", torque, "N m", low=0.0, open_low=True)
    lines = [f"title = {_text(printable(title))}", ""] if title else []
    for name, gear in gears.items():
        lines += [f"[{name}]", *_gear(gear), *keys.get(name, []), ""]
    for name, of_table in tables.items():
        lines += [f"[{name}]", *of_table, ""] if of_table else []
    lines += ["[load]", f"torque = {_value(torque)}  # N m, on {member}"]
    lines += [f"speed = {_value(speed)}  # rpm, of {member}"] if speed is not None else []
    for heading, modification in flanks.items():
        for term in describe(modification):
            lines += ["", f"[[{heading}]]", *_term(term)]
    text = "\n".join(lines) + "\n"
    with writing(path):
        write_durably(Path(path), lambda file: file.write(text.encode("utf-8")))


def _classes(names: Iterable[str], quality_classes: Iterable[int] | None) -> dict[str, list[str]]:
    return {name: [f"quality_class = {each}  # ISO 1328-1"] for name, each in zip(names, quality_classes or ())}


def check_rim(pair: GearPair, owner: str) -> None:
    """Raise for a ring gear with a support, which files are not written with; `owner` is the function in the message.

    Raises:
        ValueError: for such a ring gear.
    """
    if getattr(pair.wheel, "support", None) is not None:
        raise ValueError(f"{owner}: wheel support must be None: supports of a rim are not written yet")


def _gear(gear: Gear) -> Iterator[str]:
    numbers = fields_of(type(gear))
    for name, number in numbers.items():
        value = getattr(gear, name)
        if value is not None:
            yield _line(name, int(value) if number.whole else value, number.unit)
    material = {name: getattr(gear.material, name) for name in fields_of(type(gear.material))}
    yield _line("material", material, "")


def _term(term: Mapping[str, Any]) -> Iterable[str]:
    return (_line(name, value, unit_of(term["type"], name)) for name, value in term.items())


def _line(name: str, value: Any, unit: str) -> str:
    comment = f"  # {unit}" if unit else ""
    return f"{name} = {_value(value)}{comment}"


def _value(value: Any) -> str:
    """A value in TOML; numbers by the shortest digits that read back as the same number."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{name} = {_value(item)}" for name, item in value.items()) + " }"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _text(value)
    array = np.asarray(value)
    return "[" + ", ".join(_value(item) for item in array) + "]" if array.ndim else str(array[()])


def _text(text: str) -> str:
    """Text as a basic string of TOML, with the escapes of JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
