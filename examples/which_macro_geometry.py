"""Which profile shifts, tip heights and centre distance give a 19/48 pair the smoothest mesh without any modification?

A gradient search over the macro geometry itself: every step prepares other gears. What keeps it from gears that cannot
run are the margins of the pair (tip land, form circles, tip clearance, backlash ...), which `scipy.optimize` takes as
constraints with exact gradients. Run it: `python examples/which_macro_geometry.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
from scipy.optimize import minimize  # noqa: E402

import jaxgear as jg  # noqa: E402

TORQUE = 50.0  # N m
START = np.array([0.0, 0.0, 1.0, 1.0, 100.55])  # shifts, addenda [x module], centre distance [mm]
BOUNDS = [(-0.5, 1.0), (-0.5, 1.0), (0.8, 1.3), (0.8, 1.3), (99.0, 103.0)]
WIDTH = 0.05  # of the soft extremes [um]
# what the search has to keep, and how much of it: numbers of `jaxgear.Margins`
KEPT = {
    "pinion_tip_land": 0.6,  # mm, 0.2 modules
    "wheel_tip_land": 0.6,
    "pinion_form_clearance": 0.05,  # mm of roll length
    "wheel_form_clearance": 0.05,
    "pinion_tip_clearance": 0.3,  # mm, 0.1 modules
    "wheel_tip_clearance": 0.3,
    "contact_ratio_margin": 0.2,
    "backlash": 50.0,  # um on the line of action
}


def gear_pair(x) -> jg.GearPair:
    """The pair of a point of the search."""
    pinion = jg.Gear(teeth=19, module=3.0, face_width=18.0, bore_diameter=24.0, profile_shift=x[0], addendum=x[2])
    wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0, profile_shift=x[1], addendum=x[3])
    return jg.GearPair(pinion, wheel, center_distance=x[4])


def curve(x, resolution):
    """Transmission error of the unmodified pair over one base pitch [um]."""
    return jg.solve(jg.prepare(gear_pair(x), resolution=resolution), TORQUE).transmission_error


def kept(x):
    """What the search has to keep, relative to its limits, minus 1: not negative where it does."""
    margins = jg.margins(gear_pair(x))
    return jnp.stack([getattr(margins, name) / least - 1 for name, least in KEPT.items()])


def study(fast=False):
    """The optimum with and without its margins."""
    resolution = jg.Resolution(positions=16 if fast else 64, pairs=4)
    objective = jax.jit(jax.value_and_grad(lambda x: jg.metrics.smooth_peak_to_peak(curve(x, resolution), WIDTH)))
    ppte = jax.jit(lambda x: jg.peak_to_peak(curve(x, resolution)))
    constraint, slopes = jax.jit(kept), jax.jit(jax.jacrev(kept))
    valid = jax.jit(lambda x: jg.margins(gear_pair(x)).valid)
    limits = {"type": "ineq", "fun": lambda x: np.asarray(constraint(x)), "jac": lambda x: np.asarray(slopes(x))}

    def search(constraints):
        found = minimize(
            lambda x: tuple(np.asarray(part, float) for part in objective(x)),
            START,
            jac=True,
            bounds=BOUNDS,
            constraints=constraints,
            method="SLSQP",
            options={"maxiter": 15 if fast else 60},
        )
        return {"x": found.x, "ppte": ppte(found.x), "kept": constraint(found.x), "valid": valid(found.x)}

    return {"start": {"x": START, "ppte": ppte(START)}, "held": search([limits]), "free": search([])}


def numbers(found):
    """What the example answers with."""
    held, free = found["held"], found["free"]
    names = ("pinion_shift", "wheel_shift", "pinion_addendum", "wheel_addendum", "center_distance_mm")
    return {
        "start_ppte_um": float(found["start"]["ppte"]),
        "held_ppte_um": float(held["ppte"]),
        "held_least_kept": float(jnp.min(held["kept"])),
        "held_valid": float(held["valid"]),
        "free_valid": float(free["valid"]),
        "free_least_kept": float(jnp.min(free["kept"])),
        **{name: float(value) for name, value in zip(names, held["x"])},
    }


def main(fast=False) -> dict:
    return numbers(study(fast))


if __name__ == "__main__":
    answer = main(fast="--fast" in sys.argv)
    print(f"PPTE of the unmodified pair at {TORQUE:g} N m: {answer['start_ppte_um']:.3f} um with standard gears,")
    print(f"  {answer['held_ppte_um']:.3f} um with the best ones that keep their margins:")
    print(f"  profile shifts {answer['pinion_shift']:.3f} and {answer['wheel_shift']:.3f}, addenda ", end="")
    print(f"{answer['pinion_addendum']:.3f} and {answer['wheel_addendum']:.3f}, ", end="")
    print(f"centre distance {answer['center_distance_mm']:.3f} mm")
    verdict = "can run all the same" if answer["free_valid"] else "cannot run"
    print(f"Without the margins as constraints the search ends at gears that {verdict}.")
