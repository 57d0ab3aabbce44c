"""The text of a design file for a pair of which teeth, module, face width and torque are known."""

import re
from pathlib import Path

from ..geometry import Gear, GearPair
from ..numerics import check, compile_quickly, real
from ..numerics.durable import write_durably
from ..sizing import iso_relief
from .folder import writing

_SHORTEST = 0.3  # of a relief that is searched, in modules
_MOST, _LEAST_MOST = 3.0, 20.0  # largest amount that is searched, relative to that of the rule and at least [um]

_TEXT = """# {title}
#
# jaxgear analyze {name}     shows the pair without modification and with the tip reliefs of the values below
# jaxgear optimize {name}    finds the best values between low and high
#
# python -m jaxgear.io prints every table and key; a misspelt one is refused by name.
title = "{title}"

[pinion]                        # drives
teeth = {pinion}
module = {module!r}
face_width = {face_width!r}             # mm
# profile_shift = 0.0           # x module
# bore_diameter = 20.0          # mm; half the root diameter where it is not given
# quality_class = 6             # ISO 1328-1, for the band in the charts

[wheel]
teeth = {wheel}
module = {module!r}
face_width = {face_width!r}

# [pair]
# center_distance = {distance:.3f}     # mm; without backlash where it is not given
# backlash = 50.0               # um on the line of action

[load]
torque = {torque!r}                 # N m on the pinion
{speed}
# Numbers that are left open: `value` is what analyze takes, here the rule of ISO 6336-1.
[variables]
pinion_amount = {{ low = 0.0, high = {most:.0f}.0, value = {amount:.1f}, unit = "um" }}
pinion_length = {{ low = {shortest:.2f}, high = {longest:.2f}, value = {length:.2f}, unit = "mm" }}
wheel_amount = {{ low = 0.0, high = {most:.0f}.0, value = {amount:.1f}, unit = "um" }}
wheel_length = {{ low = {shortest:.2f}, high = {longest:.2f}, value = {length:.2f}, unit = "mm" }}

[[pinion.modification]]
type = "tip_relief"
amount = "pinion_amount"
length = "pinion_length"        # of roll length, from the tip
curve = "parabolic"             # or "linear", {{ type = "power", exponent = 1.5 }} ...

[[wheel.modification]]
type = "tip_relief"
amount = "wheel_amount"
length = "wheel_length"
curve = "parabolic"

# [optimize]
# objective = "ppte"            # or another quantity, such as "max_flank_pressure"; better small or large by its nature
# constraint = [{{ of = "max_flank_pressure", high = 1200.0 }}]
"""
_SPEED = "speed = {speed!r}                # rpm of the pinion\n"
_NO_SPEED = "# speed = 1500.0                # rpm of the pinion, for temperatures, film and loss\n"


def write_starter(
    path: str | Path, teeth: tuple[int, int], *, module: float, torque: float, face_width: float, speed: float | None
) -> GearPair:
    """Writes a commented design file of a pair, which `jaxgear analyze` and `jaxgear optimize` take as it is.

    Args:
        path: of the TOML file, which must not exist.
        teeth: of pinion and wheel.
        module: [mm].
        torque: on the pinion [N m].
        face_width: of both gears [mm].
        speed: of the pinion [rpm]; None for none.

    Returns:
        the pair.

    Raises:
        ValueError: for gears that are not possible, a torque that is not positive, or a file that exists already or
            cannot be written.
    """
    path = Path(path)
    if path.suffix != ".toml":
        raise ValueError(f"{path}: the name of a design file must end in .toml")
    if path.exists() or path.is_symlink():
        raise ValueError(f"{path}: exists already, choose another name")
    check("new", "torque", torque, "N m", low=0.0, open_low=True)
    if speed is not None:
        check("new", "speed", speed, "rpm", low=0.0, open_low=True)
    compile_quickly()
    pinion, wheel = (Gear(real(count), real(module), face_width=real(face_width)) for count in teeth)
    pair = GearPair(pinion, wheel)
    rule = iso_relief(pair, torque)
    amount, length = float(rule.amount), float(rule.length)
    text = _TEXT.format(
        name=path.name,
        title=f"{teeth[0]}/{teeth[1]} pair, module {module:g} mm",
        pinion=teeth[0],
        wheel=teeth[1],
        module=module,
        face_width=face_width,
        distance=float(pair.working_center_distance),
        torque=torque,
        speed=_NO_SPEED if speed is None else _SPEED.format(speed=speed),
        amount=amount,
        most=max(_MOST * amount, _LEAST_MOST),
        length=length,
        shortest=min(_SHORTEST * module, 0.5 * length),
        longest=length + 0.005,  # rounding must not put the value outside
    )
    lined = re.sub(r"^(\S[^#\n]*?|# \S+ = \S+) +# ", lambda found: f"{found[1]:<31} # ", text, flags=re.MULTILINE)
    with writing(path):
        write_durably(path, lambda file: file.write(lined.encode("utf-8")))
    return pair
