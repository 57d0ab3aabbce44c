"""What does the quietest flank cost in safety, and what does the best macro geometry with all safeties kept gain?

A 19/48 pair of 15 degrees under 200 N m, rated after ISO 6336 and ISO/TS 6336-20 and -22. Gears of other profile
shifts, helix angles and tip heights on the same centre distance, each with its reliefs, are sampled by a Sobol
sequence; the best that keeps every safety starts a search with the exact gradients of transmission error and safeties,
and so does the pair as it is with its reliefs alone. Run it: `python examples/how_quiet_within_safety.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402
from functools import partial  # noqa: E402

import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
from scipy.optimize import minimize  # noqa: E402
from scipy.stats import qmc  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear.metrics import Analysis, Lubricant, smooth_peak_to_peak  # noqa: E402
from jaxgear.numerics import quick_jit  # noqa: E402
from jaxgear.rating import GearRating, Rating  # noqa: E402

TORQUE, SPEED = 200.0, 1500.0  # N m, rpm
ANGLE, MODULE, WIDTH, BORES = 15.0, 3.0, 20.0, (20.0, 100.0)  # deg, mm
# relief amount [um] and its length over that of double contact, pinion shift, helix angle [deg], tip height [x module];
# the wheel has the opposite shift, which keeps the centre distance
NAMES = "relief_um", "relief_length", "pinion_shift", "helix_angle_deg", "addendum"
BOUNDS = np.array([(2.0, 50.0), (0.2, 1.2), (-0.1, 0.5), (8.0, 22.0), (0.90, 1.20)])
START = np.array([2.0, 0.5, 0.0, ANGLE, 1.0])
FLANKS = slice(0, 2)  # numbers of the flanks, the rest is macro geometry
REQUIRED = {"S_H": 1.0, "S_F": 1.4, "S_B": 1.5, "S_lambda": 1.2}
# quantities of a safety, of which the smallest counts
SAFETIES = {
    "S_H": ("pinion_pitting_safety", "wheel_pitting_safety"),
    "S_F": ("pinion_root_safety", "wheel_root_safety"),
    "S_B": ("rated_scuffing_safety",),
    "S_lambda": ("rated_micropitting_safety",),
}
# margins of the gears: tip land [mm], 0.2 modules, and roll length of the flank that the mate does not reach [mm]
KEPT = {"pinion_tip_land": 0.6, "wheel_tip_land": 0.6, "pinion_form_clearance": 0.05, "wheel_form_clearance": 0.05}
SOFTENED = 0.02  # of the extremes of the transmission error in a search [um]
STEP = 1e-4  # of the central differences, in parts of the bounds


def settings():
    """Case-hardened, ground gears of class 5 in ISO VG 220."""
    gear = GearRating("case_hardened", flank_roughness_ra=0.3, root_roughness_rz=16.0, quality_class=5)
    oil = Lubricant(220.0, 19.0, 70.0, 0.3, fzg_stage=12.0, run_in=1.0, micropitting_test=265.1)
    return Rating(pinion=gear, wheel=gear, lubricant=oil, face_load_factor=1.15, service_life=20_000.0)


def gear_pair(x):
    """The gears of a point, on the pitch circles of 15 degrees."""
    module = MODULE * jnp.cos(jnp.deg2rad(x[3])) / np.cos(np.deg2rad(ANGLE))
    both = zip((19, 48), (x[2], -x[2]), (x[3], -x[3]), BORES, strict=True)
    common = {"addendum": x[4], "face_width": WIDTH}
    return jg.GearPair(
        *(
            jg.Gear(teeth, module, profile_shift=shift, helix_angle=hand, bore_diameter=bore, **common)
            for teeth, shift, hand, bore in both
        )
    )


def outcome(x, sizes):
    """PPTE and its smooth form [um], the safeties, the margins over those to be kept, and whether all of it holds."""
    pair, rating = gear_pair(x), settings()
    margins, path = jg.margins(pair), jg.path_of_contact(pair)
    relief = jg.TipRelief(x[0], x[1] * (path.end - path.outer_single))
    cycle = jg.solve(jg.prepare(pair, resolution=sizes), jg.OperatingPoint(TORQUE, SPEED), pinion=relief, wheel=relief)
    analysis = Analysis(cycle)
    safety = [jnp.min(jnp.stack([rating.quantity(of)(analysis) for of in names])) for names in SAFETIES.values()]
    curve = cycle.transmission_error
    numbers = {
        "ppte": jg.peak_to_peak(curve),
        "smooth": smooth_peak_to_peak(curve, SOFTENED),
        "safety": jnp.stack(safety),
        "kept": jnp.stack([getattr(margins, name) / least for name, least in KEPT.items()]),
    }
    return numbers, margins.valid & cycle.converged.all()


def search(both, start, free):
    """The quietest point from a start on that keeps every safety and margin; `free` numbers of it move."""
    known = {}

    def at(moved):
        key = moved.tobytes()
        if key not in known:
            x = start.copy()
            x[free] = moved
            known[key] = jax.tree.map(np.asarray, both(jnp.asarray(x)))
        slopes, (numbers, _) = known[key]
        return numbers, jax.tree.map(lambda slope: slope[..., free], slopes)

    def kept(numbers):
        return np.append(numbers["safety"] / LEAST, numbers["kept"]) - 1

    def slopes_kept(slopes):
        return np.vstack([slopes["safety"] / LEAST[:, None], slopes["kept"]])

    limits = {"type": "ineq", "fun": lambda x: kept(at(x)[0]), "jac": lambda x: slopes_kept(at(x)[1])}
    found = minimize(
        lambda x: (float(at(x)[0]["smooth"]), at(x)[1]["smooth"]),
        start[free],
        jac=True,
        bounds=BOUNDS[free],
        constraints=[limits],
        method="SLSQP",
        options={"maxiter": 30, "ftol": 1e-4},
    )
    point = start.copy()
    point[free] = found.x
    return point


LEAST = np.array([*REQUIRED.values()])


def study(fast=False):
    """Samples, the pair as it is with the quietest reliefs, the best gears, and evidence for them."""
    sizes = jg.Resolution(positions=16 if fast else 32, slices=7 if fast else 13, pairs=4)
    finer = jg.Resolution(positions=2 * sizes.positions, slices=2 * sizes.slices + 1, pairs=4)
    points = qmc.Sobol(len(START), rng=np.random.default_rng(1)).random_base2(4 if fast else 7)
    points = np.vstack([START, BOUNDS[:, 0] + points * np.ptp(BOUNDS, axis=1)])
    of = partial(outcome, sizes=sizes)
    sampled, holds = quick_jit(lambda every: jax.lax.map(of, every, batch_size=8))(jnp.asarray(points))
    sampled = jax.tree.map(np.asarray, sampled)
    holds = np.asarray(holds) & (sampled["kept"] >= 1).all(axis=1)
    reserve = np.where(holds, np.min(sampled["safety"] / LEAST, axis=1), -np.inf)
    best = int(np.argmin(np.where(reserve >= 1, sampled["ppte"], np.inf)))
    both = quick_jit(jax.jacfwd(lambda x: ((found := of(x))[0], found), has_aux=True))
    flank = search(both, START, np.arange(len(START))[FLANKS])
    gears = search(both, points[best], np.arange(len(START)))
    designs = {"start": START, "quietest flank": flank, "best gears": gears}
    again = quick_jit(partial(outcome, sizes=finer))
    return {
        "points": points,
        "sampled": sampled,
        "reserve": reserve,
        "designs": designs,
        "found": {name: jax.tree.map(np.asarray, both(jnp.asarray(x))) for name, x in designs.items()},
        "finer": {name: float(again(jnp.asarray(x))[0]["ppte"]) for name, x in designs.items()},
        "differences": _differences(both, gears),
    }


def _differences(both, x):
    """PPTE and safeties over every number by central differences, shape (numbers, 1 + safeties)."""
    found = []
    for axis, step in enumerate(STEP * np.ptp(BOUNDS, axis=1)):
        high, low = (both(jnp.asarray(x + sign * step * np.eye(len(x))[axis]))[1][0] for sign in (1, -1))
        ends = (np.append(each["ppte"], each["safety"]) for each in (high, low))
        found.append(np.subtract(*ends) / (2 * step))
    return np.array(found)


def numbers(found):
    """What the example answers with."""
    answer = {}
    for name, (_, (of, valid)) in found["found"].items():
        key = name.replace(" ", "_")
        answer |= {f"{key}_ppte_um": float(of["ppte"]), f"{key}_holds": float(valid)}
        answer |= {f"{key}_{symbol}": float(number) for symbol, number in zip(REQUIRED, of["safety"], strict=True)}
        answer[f"{key}_ppte_finer_um"] = found["finer"][name]
    slopes, _ = found["found"]["best gears"]
    exact = np.column_stack([slopes["ppte"], slopes["safety"].T])
    scale = np.abs(found["differences"]).max(axis=0)
    answer["slopes_error"] = float(np.abs((exact - found["differences"]) / scale).max())
    answer["kept_share"] = float((found["reserve"] >= 1).mean())
    return answer | {f"best_{name}": float(number) for name, number in zip(NAMES, found["designs"]["best gears"])}


def draw(found, folder="results"):
    """PPTE over the smallest safety in parts of the required one, with the front of the samples."""
    import matplotlib.pyplot as plt

    from jaxgear import plot
    from jaxgear.plot.figure import GREY, legend_above, point_style, report_axes

    reserve, ppte = found["reserve"], found["sampled"]["ppte"]
    holds = np.isfinite(reserve)
    order = np.argsort(ppte)
    front = [
        at for place, at in enumerate(order) if holds[at] and reserve[at] > max(reserve[order[:place]], default=-np.inf)
    ]
    with report_axes(None) as panel:
        panel.plot(reserve[holds], ppte[holds], ".", color="#8C8C8C", markersize=3, label="samples")
        panel.step(reserve[front], ppte[front], where="pre", color=GREY, linewidth=1.0, label="front of the samples")
        for number, (name, (_, (of, _))) in enumerate(found["found"].items()):
            panel.plot(np.min(of["safety"] / LEAST), of["ppte"], **point_style(number), label=name)
        panel.axvline(1.0, color="black", linewidth=0.8, linestyle="--")
        panel.set(xlabel="smallest safety over the required one [-]", ylabel="PPTE [um]", ylim=(0.0, None))
        legend_above(panel)
    plot.save(panel.figure, f"{folder}/how_quiet_within_safety.png")
    plt.close(panel.figure)


def main(fast=False) -> dict:
    found = study(fast)
    draw(found)
    return numbers(found)


if __name__ == "__main__":
    answer = main(fast="--fast" in sys.argv)
    for name in ("start", "quietest_flank", "best_gears"):
        shown = ", ".join(f"{of} {answer[f'{name}_{of}']:.2f}" for of in REQUIRED)
        ppte, finer = answer[f"{name}_ppte_um"], answer[f"{name}_ppte_finer_um"]
        print(f"{name.replace('_', ' ')}: PPTE {ppte:.3f} um, on a finer grid {finer:.3f} um, {shown}")
    print(f"required: {', '.join(f'{of} {number:g}' for of, number in REQUIRED.items())}")
    print("best gears: " + ", ".join(f"{name} {answer[f'best_{name}']:.3g}" for name in NAMES))
    print(f"derivatives there miss central differences by {answer['slopes_error']:.1e} of the largest")
