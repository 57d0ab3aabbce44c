"""What does designing the flanks in the stage buy over designing each mesh by itself, nominal and with pin errors?

A planetary stage 26/19/64 with three planets under 400 N m, whose sun floats. Tip reliefs of the four flank sides are
searched three times: for the transmission error of each mesh alone, for that of the whole stage, and for that of stages
whose pins are displaced within 20 um. Run it: `python examples/what_does_stage_design_buy.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import numpy as np  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear.metrics import Analysis  # noqa: E402
from jaxgear.planetary import (  # noqa: E402
    PlanetaryStage,
    PlanetFlanks,
    StageGears,
    StageSettings,
    prepare_stage,
)

TORQUE, PLANETS, MODULE, WIDTH, PIN = 400.0, 3, 3.0, 20.0, 400.0  # N m on the sun, mm, N/um
POSITIONS, FINE = 48, 192  # of the search, of the table
TOLERANCE, SAMPLES, MANY = 20.0, 8, 256  # um of the pins' places; stages of the search, of the table
FLANKS = "sun", "planet_to_sun", "planet_to_ring", "ring"
BOUNDS = {
    f"{flank}_{name}": ends for flank in FLANKS for name, ends in (("amount", (0.0, 40.0)), ("length", (1.0, 6.0)))
}


def gears():
    """Both pairs."""
    sun, planet = (jg.Gear(teeth, MODULE, face_width=WIDTH) for teeth in (26, 19))
    ring = jg.RingGear(64, MODULE, face_width=WIDTH, addendum=0.8)
    return jg.GearPair(sun, planet), jg.GearPair(planet, ring)


def settings(positions, samples):
    """The stage with meshes at so many positions, and so many stages with displaced pins."""
    pairs = gears()
    sun, ring = (jg.prepare(pair, resolution=jg.Resolution(positions=positions)) for pair in pairs)
    pins = {"radial_pin_stiffness": PIN, "tangential_pin_stiffness": PIN}
    stage = PlanetaryStage(StageGears.of_pairs(*pairs), PLANETS, sun_support=0.0, **pins)
    errors = np.random.default_rng(0).uniform(-TOLERANCE, TOLERANCE, (samples, PLANETS))
    return sun, ring, StageSettings(prepare_stage(stage, sun=sun, ring=ring), pin_errors=errors)


def relief(flank, values):
    """Tip relief of a flank side."""
    return jg.TipRelief(values[f"{flank}_amount"], values[f"{flank}_length"], jg.Parabolic())


def design(values):
    """Modifications of the sun, and of planets and ring."""
    sun, *others = (relief(flank, values) for flank in FLANKS)
    return sun, PlanetFlanks(*others)


def of_mesh(mesh, torque, flanks):
    """The best reliefs of one mesh by itself."""
    bounds = {name: ends for name, ends in BOUNDS.items() if name.rpartition("_")[0] in flanks}
    problem = jg.Problem(mesh, torque, lambda values: tuple(relief(flank, values) for flank in flanks), bounds)
    return jg.minimize(problem).parameters


def in_stage(sun, own, objective):
    """The best reliefs for a quantity of the whole stage."""
    problem = jg.Problem(sun, TORQUE / PLANETS, design, BOUNDS, objective=own.quantity(objective))
    return jg.minimize(problem, positions=None).parameters


def main(positions=POSITIONS, fine=FINE, samples=SAMPLES, many=MANY):
    """Search the designs and print their numbers."""
    sun, ring, own = settings(positions, samples)
    of_planet = TORQUE / PLANETS * 19 / 26
    designs = {
        "unmodified": None,
        "each mesh by itself": {**of_mesh(sun, TORQUE / PLANETS, FLANKS[:2]), **of_mesh(ring, of_planet, FLANKS[2:])},
        "in the stage": in_stage(sun, own, "stage_ppte"),
        "in stages with pin errors": in_stage(sun, own, "stage_ppte_with_pin_errors"),
    }
    sun, ring, own = settings(fine, many)
    print(f"{'':26} {'PPTE of the meshes':>19} {'of the stage':>14} {'with pin errors':>16} {'flank pressure':>15}")
    for name, values in designs.items():
        pinion, planet = (None, None) if values is None else design(values)
        cycle = jg.solve(sun, TORQUE / PLANETS, pinion=pinion, wheel=planet)
        outer = jg.solve(
            ring, of_planet, **({} if planet is None else {"pinion": planet.to_ring, "wheel": planet.ring})
        )
        meshes = " / ".join(f"{float(jg.peak_to_peak(each.transmission_error)):.2f}" for each in (cycle, outer))
        names = "stage_ppte", "stage_ppte_with_pin_errors", "max_stage_flank_pressure"
        stage, errors, pressure = (float(own.quantity(each)(Analysis(cycle))) for each in names)
        print(f"{name:26} {meshes:>16} um {stage:11.3f} um {errors:13.3f} um {pressure:11.0f} MPa")
    for name, values in designs.items():
        if values is not None:
            numbers = (
                f"{float(values[f'{flank}_amount']):.1f} um x {float(values[f'{flank}_length']):.2f} mm"
                for flank in FLANKS
            )
            print(f"{name}: " + ", ".join(f"{flank} {each}" for flank, each in zip(FLANKS, numbers, strict=True)))


if __name__ == "__main__":
    main(*((24, 24, 3, 8) if "--quick" in sys.argv else ()))
