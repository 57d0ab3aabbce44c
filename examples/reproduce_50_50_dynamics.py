"""What of the same published 50/50 study can be reproduced at speed: resonances, jumps and what its reliefs do to them?

The study gives dynamic factor K_v and rms of the relative displacement q over mesh frequencies up to 5 kHz, rising and
falling, at 100, 200 and 400 N m, of the unmodified gears and of two reliefs that level the transmission error. It
prints neither its gears nor inertias nor damping. Here they are the test pair of 50 teeth and module 3 with 0.135 mm
of backlash on the line of action, solid discs, and the damping ratio at which the largest K_v at 200 N m is that of the
study. Run it: `python examples/reproduce_50_50_dynamics.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402
import textwrap  # noqa: E402

import numpy as np  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import dynamics  # noqa: E402

TORQUES = (100.0, 200.0, 400.0)  # N m
NOMINAL = 200.0
DAMPING_RATIO = 0.0425  # the only number that was fitted
INERTIA = 7.80e-3  # kg m2, a solid disc of the pitch diameter
THINNER = -72.0  # um, tooth thickness 4.64 mm in place of 4.712 mm at the reference circle
ALLOWED = 2000.0  # MPa, the study's limit against scuffing, to which the height at the tip is found
HIGHEST = 12.0  # um, which no relief here comes to
POINTS = {1: (900.0, 1300.0), 2: (1900.0, 2900.0), 3: (3800.0, 4900.0)}  # Hz, around the study's three peaks

SMOOTH = (
    "The study's mesh stiffness is not known; that of jaxgear changes gradually between one and two pairs, because "
    "contact goes on beyond the path."
)
DETACHED = (
    "The orbit of two mesh cycles at point 3 hangs together with no other below 5 kHz: only flanks that are thrown "
    "apart come to it."
)
# key of the result, text, published value, unit, where the difference comes from
LINES = [
    ("200 unmodified f1", "200 N m, point 1", 1100.0, "Hz", ""),
    ("200 unmodified f2", "200 N m, point 2", 2250.0, "Hz", SMOOTH),
    ("200 unmodified f3", "200 N m, point 3", 4500.0, "Hz", DETACHED),
    ("200 unmodified K_v", "200 N m, largest K_v, unmodified", 4.25, "", "The damping ratio was chosen for it."),
    ("200 unmodified q_rms", "200 N m, largest q_rms, unmodified", 22.5, "um", ""),
    ("200 type 1 K_v", "200 N m, largest K_v, type 1", 2.75, "", ""),
    ("200 type 2 K_v", "200 N m, largest K_v, type 2", 3.0, "", ""),
    ("200 type 1 less q_rms", "200 N m, q_rms of type 1 lower by", 44.5, "%", ""),
    ("200 type 2 less q_rms", "200 N m, q_rms of type 2 lower by", 33.3, "%", ""),
    ("100 unmodified f1", "100 N m, point 1", 1000.0, "Hz", ""),
    ("100 unmodified f2", "100 N m, point 2", 2000.0, "Hz", SMOOTH),
    ("100 unmodified f3", "100 N m, point 3", 4250.0, "Hz", DETACHED),
    ("100 unmodified K_v", "100 N m, largest K_v, unmodified", 4.5, "", ""),
    (
        "100 unmodified q_rms",
        "100 N m, largest q_rms, unmodified",
        13.5,
        "um",
        "The study has it at point 1, and a jump there.",
    ),
    ("100 type 1 less K_v", "100 N m, largest K_v of type 1 lower by", 28.0, "%", ""),
    ("100 type 2 less K_v", "100 N m, largest K_v of type 2 lower by", 34.0, "%", ""),
    ("100 type 1 less K_v 3", "100 N m, K_v of type 1 at point 3 lower by", 53.0, "%", ""),
    ("100 type 2 less K_v 3", "100 N m, K_v of type 2 at point 3 lower by", 60.0, "%", ""),
    ("100 type 1 less q_rms", "100 N m, largest q_rms of type 1 lower by", 22.0, "%", ""),
    ("100 type 2 less q_rms", "100 N m, largest q_rms of type 2 lower by", 33.0, "%", ""),
    ("100 type 1 less q_rms 1", "100 N m, q_rms of type 1 at point 1 lower by", 60.0, "%", ""),
    ("100 type 2 less q_rms 1", "100 N m, q_rms of type 2 at point 1 lower by", 60.0, "%", ""),
    ("400 unmodified f1", "400 N m, point 1", 1200.0, "Hz", ""),
    ("400 unmodified f2", "400 N m, point 2", 2400.0, "Hz", SMOOTH),
    ("400 unmodified f3", "400 N m, point 3", 4500.0, "Hz", DETACHED),
    (
        "400 unmodified K_v",
        "400 N m, largest K_v, unmodified",
        3.5,
        "",
        "The study's third peak changes its shape at this torque.",
    ),
    ("400 unmodified q_rms", "400 N m, largest q_rms, unmodified", 32.5, "um", "The study has it at point 2."),
    ("400 type 1 less q_rms", "400 N m, largest q_rms of type 1 lower by", 14.0, "%", ""),
    ("400 type 2 less q_rms", "400 N m, largest q_rms of type 2 lower by", 14.0, "%", ""),
]
# largest K_v and q_rms [um] over all speeds, None where the study has no number; those of reliefs are mostly its
# percentages of the unmodified gears
PUBLISHED = {
    "100 unmodified": (4.5, 13.5),
    "100 type 1": (4.5 * (1 - 0.28), 13.5 * (1 - 0.22)),
    "100 type 2": (4.5 * (1 - 0.34), 13.5 * (1 - 0.33)),
    "200 unmodified": (4.25, 22.5),
    "200 type 1": (2.75, 22.5 * (1 - 0.445)),
    "200 type 2": (3.0, 22.5 * (1 - 0.333)),
    "400 unmodified": (3.5, 32.5),
    "400 type 1": (None, 32.5 * (1 - 0.14)),
    "400 type 2": (None, 32.5 * (1 - 0.14)),
}


def prepare() -> jg.Mesh:
    material = jg.Material(elastic_modulus=207_000.0)
    gear = jg.Gear(
        teeth=50,
        module=3.0,
        face_width=20.0,
        tip_diameter=154.5709,
        tooth_thickness_allowance=THINNER,
        material=material,
    )
    # two-dimensional, as the study's finite elements
    return jg.prepare(jg.GearPair(gear, gear, center_distance=150.0), compliance=jg.default_compliance("stress"))


def reliefs(mesh: jg.Mesh, fast=False) -> dict:
    """Modifications of both gears: none, the study's type 1, and its type 2 (not when fast)."""
    iteration = jg.optimize.TransmissionErrorIteration
    type_1 = jg.minimize(jg.Problem(mesh, NOMINAL), iteration(max_relief=HIGHEST, max_pressure=ALLOWED))
    found = {"unmodified": (None, None), "type 1": (type_1.pinion, type_1.wheel)}
    if fast:
        return found
    height = type_1.constraints["max_relief"].value  # the study has one for both

    def low_pressure(x):
        relief = jg.TipRelief(x["amount"], x["length"], jg.ParabolicLinear(x["node"]))
        return relief, relief

    bounds = {"amount": (1.0, height), "length": (1.0, 3.27), "node": (0.05, 1.0)}
    search = jg.optimize.SLP(starts=4, rounds=1)
    method = iteration("low_pressure", max_relief=height, max_pressure=ALLOWED, search=search)
    type_2 = jg.minimize(jg.Problem(mesh, NOMINAL, low_pressure, bounds), method)
    return found | {"type 2": (type_2.pinion, type_2.wheel)}


def main(fast=False) -> dict:
    """The study's numbers as jaxgear sees them, and K_v and q_rms [um] of every design, torque and run over speed."""
    mesh = prepare()
    settings = dynamics.Dynamics(
        mesh_frequencies=np.arange(500.0, 5001.0, 100.0 if fast else 25.0),
        damping_ratio=DAMPING_RATIO,
        pinion_inertia=INERTIA,
        wheel_inertia=INERTIA,
    )
    designs = reliefs(mesh, fast)
    found, curves = {}, {}
    for torque in (NOMINAL,) if fast else TORQUES:
        for name, (pinion, wheel) in designs.items():
            runs = settings.runs(settings.oscillator(mesh, torque, pinion=pinion, wheel=wheel))
            key = f"{torque:g} {name}"
            curves[key] = {run: (np.asarray(r.dynamic_factor), np.asarray(r.dte_rms)) for run, r in runs.items()}
            found |= _numbers(key, np.asarray(settings.mesh_frequencies), curves[key])
            found[f"{key} settled"] = all(bool(np.all(r.converged)) for r in runs.values())
        found |= _lower(torque, found, [name for name in designs if name != "unmodified"])
    return found | {"frequency": np.asarray(settings.mesh_frequencies), "curves": curves}


def _numbers(key: str, frequency, runs) -> dict:
    """Peaks of one design at one torque, over all runs."""
    factor, rms = (np.max([of[index] for of in runs.values()], axis=0) for index in (0, 1))
    found = {f"{key} K_v": float(factor.max()), f"{key} q_rms": float(rms.max())}
    for point, (low, high) in POINTS.items():
        at = np.flatnonzero((frequency >= low) & (frequency <= high))
        highest = at[np.argmax(factor[at])]
        found |= {f"{key} f{point}": float(frequency[highest]), f"{key} K_v {point}": float(factor[highest])}
        found[f"{key} q_rms {point}"] = float(rms[at].max())
    up, down = runs[dynamics.UP][0], runs[dynamics.DOWN][0]
    return found | {f"{key} down over up": float(np.max(down / up)), f"{key} median K_v": float(np.median(up))}


def _lower(torque: float, found: dict, names) -> dict:
    """By how much the numbers of relieved gears are lower than those of the unmodified ones [%]."""
    base, less = f"{torque:g} unmodified", {}
    for name in names:
        for what in ("K_v", "K_v 3", "q_rms", "q_rms 1"):
            less[f"{torque:g} {name} less {what}"] = 100 * (
                1 - found[f"{torque:g} {name} {what}"] / found[f"{base} {what}"]
            )
    return less


def show(found) -> None:
    """Prints every published number, jaxgear's and the difference; where the difference comes from, once each."""
    print(f"{'':60}{'published':>10}{'jaxgear':>10}")
    said = set()
    for key, text, published, unit, why in LINES:
        if key not in found:
            continue
        difference = (
            f"{found[key] - published:+8.1f} points" if unit == "%" else f"{100 * (found[key] / published - 1):+8.1f} %"
        )
        print((f"{text} [{unit}]" if unit else text).ljust(60) + f"{published:10.4g}{found[key]:10.4g}{difference}")
        if why and why not in said:
            said.add(why)
            print(textwrap.fill(why, 100, initial_indent="    ", subsequent_indent="    "))
    for line in (*over_torque(found), *below_published(found), *above_unmodified(found)):
        print(line)


def over_torque(found):
    """Largest K_v and q_rms of every design at every torque, beside the study's."""
    yield f"\n{'torque [N m], design':24}{'K_v published':>16}{'jaxgear':>10}{'q_rms [um] published':>24}{'here':>10}"
    for key, published in PUBLISHED.items():
        if f"{key} K_v" in found:
            factor, rms = ("-" if value is None else f"{value:.4g}" for value in published)
            yield f"{key:24}{factor:>16}{found[f'{key} K_v']:10.4g}{rms:>24}{found[f'{key} q_rms']:10.4g}"


def below_published(found):
    """How many numbers of the relieved gears are lower here than in the study."""
    pairs = [
        (found[f"{key} {what}"], value)
        for key, published in PUBLISHED.items()
        if f"{key} K_v" in found and not key.endswith("unmodified")
        for what, value in zip(("K_v", "q_rms"), published)
        if value is not None
    ]
    lower = sum(here < value for here, value in pairs)
    yield f"\nOf the {len(pairs)} largest K_v and q_rms of relieved gears {lower} are lower here than in the study."


def above_unmodified(found):
    """Where K_v of a relief at twice the nominal torque is above that of the unmodified gears."""
    published = {"type 1": "at no point", "type 2": "at points 1, 2"}
    for name, said in published.items():
        if f"400 {name} K_v" in found:
            points = [str(at) for at in POINTS if found[f"400 {name} K_v {at}"] > found[f"400 unmodified K_v {at}"]]
            here = f"at points {', '.join(points)}" if points else "at no point"
            yield f"400 N m: the study has K_v of {name} above that of the unmodified gears {said}; here {here}."


if __name__ == "__main__":
    found = main(fast="--fast" in sys.argv)
    show(found)
