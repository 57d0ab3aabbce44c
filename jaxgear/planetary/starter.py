"""A design file of a planetary stage to begin with."""

from pathlib import Path

from ..geometry import Gear, GearPair, RingGear
from ..io.write_design import check_new, speed_line, write_filled
from ..numerics import compile_quickly, real
from ..sizing import iso_relief
from .gears import StageGears
from .stage import PlanetaryStage

_TEXT = Path(__file__).with_name("starter.txt")  # with fields to be filled
_ADDENDUM = 0.8  # of the ring: tips of full depth reach below the form circle of the planets
_PIN = 20.0  # N/(um mm), of bearing and pin per face width: that of a pair of teeth
_LEAST, _MOST = 20.0, 3.0  # largest amount that is searched [um], and relative to that of the rule
_SHARE = 0.5  # of the deflection of a pair of teeth: the stage deflects in two meshes


def write_stage_starter(
    path: str | Path,
    teeth: tuple[int, int],
    planets: int,
    *,
    module: float,
    torque: float,
    face_width: float,
    speed: float | None,
) -> PlanetaryStage:
    """Write a commented design file of a planetary stage, ready for `jaxgear analyze` and `jaxgear optimize`.

    The ring has the teeth that make the stage coaxial without profile shifts, z_s + 2 z_p.

    Args:
        path: path of the TOML file, which must not exist.
        teeth: teeth of sun and planets.
        planets: number of planets.
        module: [mm].
        torque: torque on the sun [N m].
        face_width: face width of all gears [mm].
        speed: speed of the sun [rpm]; None for none.

    Returns:
        the stage.

    Raises:
        ValueError: for gears or a stage that are not possible, a torque or speed that is not positive, or a file that
            exists already or cannot be written.
    """
    path = check_new(path, torque, speed)
    compile_quickly()
    sun, planet = (Gear(real(each), real(module), face_width=real(face_width)) for each in teeth)
    ring = RingGear(real(teeth[0] + 2 * teeth[1]), real(module), face_width=real(face_width), addendum=real(_ADDENDUM))
    pair, outer = GearPair(sun, planet), GearPair(planet, ring)
    pin = _PIN * face_width
    stage = PlanetaryStage(
        StageGears.of_pairs(pair, outer),
        planets,
        radial_pin_stiffness=real(pin),
        tangential_pin_stiffness=real(pin),
    )
    rule = iso_relief(pair, torque / planets)
    amount = _SHARE * float(rule.amount)
    write_filled(
        path,
        _TEXT,
        title=f"{teeth[0]}/{teeth[1]}/{float(ring.teeth):.0f} stage, module {module:g} mm",
        sun=teeth[0],
        planet=teeth[1],
        ring=int(ring.teeth),
        module=module,
        face_width=face_width,
        addendum=_ADDENDUM,
        rim=2 * abs(float(ring.bore_radius)),
        planets=planets,
        pin=pin,
        torque=torque,
        speed=speed_line(speed, "the driving member"),
        amount=amount,
        most=max(_MOST * float(rule.amount), _LEAST),
        length=float(rule.length),
    )
    return stage
