"""What does designing the flanks in the stage buy over designing each mesh by itself, nominal and with pin errors?

A planetary stage 26/19/64 with five planets under 650 N m, whose sun floats (of three planets, errors of the pins would
change nothing: a floating sun shares the load equally whatever they are). Tip reliefs of the four flank sides are
searched three times: for the transmission error of each mesh alone, for that of the whole stage, and for that of stages
whose pins are displaced within 20 um. Run it: `python examples/what_does_stage_design_buy.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import jax.numpy as jnp  # noqa: E402
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

TORQUE, PLANETS, MODULE, WIDTH, PIN = 650.0, 5, 3.0, 20.0, 400.0  # N m on the sun, mm, N/um
POSITIONS, FINE = 40, 160  # of the search, of the table
TOLERANCE, SAMPLES, MANY = 20.0, 6, 128  # um of the pins' places; stages of the search, of the table
QUANTITIES = "stage_ppte", "stage_ppte_with_pin_errors", "load_sharing_factor_with_pin_errors"
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


def study(fast=False):
    """The designs, their stages on a finer grid with many pin errors, and the PPTE of their meshes."""
    grids = (20, 20, 3, 8) if fast else (POSITIONS, FINE, SAMPLES, MANY)
    sun, ring, own = settings(grids[0], grids[2])
    of_planet = TORQUE / PLANETS * 19 / 26
    designs = {
        "unmodified": dict.fromkeys(BOUNDS, 0.0) | {name: 1.0 for name in BOUNDS if name.endswith("length")},
        "each mesh by itself": {**of_mesh(sun, TORQUE / PLANETS, FLANKS[:2]), **of_mesh(ring, of_planet, FLANKS[2:])},
        "in the stage": in_stage(sun, own, "stage_ppte"),
    }
    if not fast:
        designs["in stages with pin errors"] = in_stage(sun, own, "stage_ppte_with_pin_errors")
    sun, ring, own = settings(grids[1], grids[3])
    found = {}
    for name, values in designs.items():
        pinion, planet = design({key: jnp.asarray(float(value)) for key, value in values.items()})
        cycle = jg.solve(sun, TORQUE / PLANETS, pinion=pinion, wheel=planet)
        outer = jg.solve(ring, of_planet, pinion=planet.to_ring, wheel=planet.ring)
        analysis = Analysis(cycle)
        numbers = {each: float(own.quantity(each)(analysis)) for each in QUANTITIES}
        numbers |= {"sun_mesh_ppte": float(jg.peak_to_peak(cycle.transmission_error))}
        numbers |= {"ring_mesh_ppte": float(jg.peak_to_peak(outer.transmission_error))}
        found[name] = {"numbers": numbers, "stage": own.solve(analysis)}
    return {"designs": designs, "found": found}


def numbers(found):
    """What the example answers with."""
    answer = {}
    for name, of in found["found"].items():
        answer |= {f"{name.replace(' ', '_')}_{key}": value for key, value in of["numbers"].items()}
    for key, value in found["designs"]["in the stage"].items():
        answer[f"best_{key}"] = float(value)
    return answer


def draw(found, folder="results"):
    """Transmission error of the stage with every design."""
    import matplotlib.pyplot as plt

    from jaxgear import plot
    from jaxgear.planetary import figures

    panel = figures.transmission_error({name: of["stage"] for name, of in found["found"].items()})
    plot.save(panel.figure, f"{folder}/what_does_stage_design_buy.png")
    plt.close(panel.figure)


def main(fast=False) -> dict:
    found = study(fast)
    draw(found)
    return numbers(found)


if __name__ == "__main__":
    answer = main(fast="--fast" in sys.argv)
    print(f"{'PPTE [um]':27} {'mesh of sun':>12} {'of ring':>9} {'stage':>8} {'with pin errors':>16} {'K_gamma':>8}")
    for name in ("unmodified", "each mesh by itself", "in the stage", "in stages with pin errors"):
        keys = "sun_mesh_ppte", "ring_mesh_ppte", *QUANTITIES
        if f"{name.replace(' ', '_')}_{keys[0]}" not in answer:
            continue
        one, two, stage, errors, share = (answer[f"{name.replace(' ', '_')}_{key}"] for key in keys)
        print(f"{name:27} {one:12.2f} {two:9.2f} {stage:8.3f} {errors:16.3f} {share:8.3f}")
    reliefs = (
        f"{flank} {answer[f'best_{flank}_amount']:.1f} um x {answer[f'best_{flank}_length']:.2f} mm" for flank in FLANKS
    )
    print("in the stage: " + ", ".join(reliefs))
