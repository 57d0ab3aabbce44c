"""What of a published study on reliefs from the static transmission error of a 50/50 pair can be reproduced?

The study takes the transmission error that is missing in double contact, from finite elements at 200 N m, as the relief
of both tips, and repeats that until the error is even: from the involute (its type 1) and from a parabola that goes on
straight, designed for low pressure (its type 2). The height at the tip follows from the largest pressure, which may be
2 GPa. Its gear table is not public; the pair here is the well-known test pair of 50 teeth and module 3 with the tip
diameter that gives the study's contact ratio of 1.37, solid discs, and the damping ratio at which the largest dynamic
factor K_v of the unmodified gears is that of the study. What then explains K_v of the relieved gears is looked for by
other reliefs and by half the inertia, in one figure. Run it: `python examples/reproduce_50_50_study.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import dynamics, manufacture  # noqa: E402

TORQUES = tuple(float(torque) for torque in range(20, 401, 20))  # N m
NOMINAL = 200.0  # N m
ALLOWED = 2000.0  # MPa, of the study against scuffing
STRENGTH = jg.metrics.Strength(pressure=ALLOWED)
HIGHEST = 12.0  # um, which no relief here comes to
AMOUNT = 6.0  # um at the tip in the study
DAMPING_RATIO = 0.0425  # fitted to K_v of the unmodified gears
EDGE = 0.1  # mm, radius of the tip edges, on which the pressure of tip corners depends; the study does not give one
INERTIAS = {"solid discs": 7.80e-3, "half of it": 3.90e-3}  # kg m2, of either gear
POINTS = 201  # of a relief over the active profile
MIXED = (0.25, 0.5, 0.75)  # shares of the parabola in reliefs between it and type 1
ALIKE = 10.0  # %: as near as numbers of another model of another pair are called alike

# key of the result, text, published value, unit
LINES = [
    ("contact_ratio", "contact ratio", 1.37, ""),
    ("unmodified_ppte", "PPTE unmodified", 3.72, "um"),
    ("unmodified_K_v", "largest K_v unmodified (fitted)", 4.25, ""),
    ("unmodified_q_rms", "largest q_rms unmodified", 22.5, "um"),
    ("type 1_ppte", "PPTE, type 1", 0.70, "um"),
    ("type 2_ppte", "PPTE, type 2", 0.62, "um"),
    ("type 1_height", "relief at the tip, type 1", AMOUNT, "um"),
    ("type 2_height", "relief at the tip, type 2", AMOUNT, "um"),
    ("type 1_pressure", "largest pressure, type 1", 1630.0, "MPa"),
    ("type 2_pressure", "largest pressure, type 2", ALLOWED / 1.74, "MPa"),
    ("type 1_safety", "safety against 2 GPa, type 1", 1.25, ""),
    ("type 2_safety", "safety against 2 GPa, type 2", 1.74, ""),
    ("quietest_torque", "torque of the least PPTE, type 1", NOMINAL, "N m"),
    ("type 1_crossing", "torque below which the relief does harm, type 1", 90.0, "N m"),
    ("type 2_crossing", "torque below which the relief does harm, type 2", 90.0, "N m"),
    ("type 1_K_v", "largest K_v, type 1", 2.75, ""),
    ("type 2_K_v", "largest K_v, type 2", 3.0, ""),
    ("type 1_q_rms", "largest q_rms, type 1", 22.5 * (1 - 0.445), "um"),
    ("type 2_q_rms", "largest q_rms, type 2", 22.5 * (1 - 0.333), "um"),
    ("type 1_volume", "volume ground off one gear, type 1", 5.0, "mm3"),
    ("type 2_volume", "volume ground off one gear, type 2", 5.0, "mm3"),
    ("type 1_wheel_fit", "involute and parabola on the wheel, type 1: less than", 1.0, "um"),
    ("type 2_wheel_fit", "involute and parabola on the wheel, type 2: less than", 1.0, "um"),
]


def prepare(fast=False) -> jg.Mesh:
    gear = jg.Gear(
        teeth=50,
        module=3.0,
        face_width=20.0,
        tip_diameter=154.5709,
        tip_edge_radius=EDGE,
        tooth_thickness_allowance=-72.0,
        material=jg.Material(elastic_modulus=207_000.0),
    )
    # two-dimensional, as the study's finite elements
    return jg.prepare(
        jg.GearPair(gear, gear, center_distance=150.0),
        compliance=jg.default_compliance("stress"),
        resolution=jg.Resolution(positions=64 if fast else 256),
    )


def optima(mesh: jg.Mesh, fast=False) -> dict:
    """The study's iteration: as its equation alone says, and its types 1 and 2, whose height the pressure decides."""
    iteration = jg.optimize.TransmissionErrorIteration
    plateau = jg.minimize(jg.Problem(mesh, NOMINAL), iteration(max_relief=HIGHEST))
    type_1 = jg.minimize(jg.Problem(mesh, NOMINAL), iteration(max_relief=HIGHEST, max_pressure=ALLOWED))
    height = type_1.constraints["max_relief"].value  # the study has one for both

    def spline(x):
        relief = jg.TipRelief(x["amount"], x["length"], jg.ParabolicLinear(x["node"]))
        return relief, relief

    bounds = {"amount": (1.0, height), "length": (1.0, 3.27), "node": (0.05, 1.0)}
    search = jg.optimize.SLP(starts=1 if fast else 4, rounds=1)
    method = iteration("low_pressure", max_relief=height, max_pressure=ALLOWED, search=search)
    type_2 = jg.minimize(jg.Problem(mesh, NOMINAL, spline, bounds), method)
    return {"equation alone": plateau, "type 1": type_1, "type 2": type_2}


def table(mesh: jg.Mesh, pinion, wheel) -> np.ndarray:
    """Relief [um] of the pinion at `POINTS` of its active profile; that of the wheel is the same by symmetry."""
    return np.asarray(jg.metrics.profile_relief(mesh, pinion, wheel, points=POINTS)[0])


@eqx.filter_jit
def flank(mesh: jg.Mesh, amounts) -> jg.TabulatedProfile:
    side = mesh.sides[0]
    return jg.TabulatedProfile(jnp.linspace(side.start_roll_length, side.tip_roll_length, POINTS), amounts)


@eqx.filter_jit
def over_torque(mesh: jg.Mesh, amounts, torques):
    """Mesh cycles at every torque with a relief of `table` on both gears."""
    relief = flank(mesh, amounts)
    return jax.vmap(lambda torque: jg.solve(mesh, torque, pinion=relief, wheel=relief))(torques)


def crossing(first, second) -> float:
    """Largest torque [N m] at which the two curves over `TORQUES` cross, interpolated; nan without one."""
    difference = np.asarray(first) - np.asarray(second)
    signs = np.nonzero(np.diff(np.sign(difference)))[0]
    if not signs.size:
        return float("nan")
    i = signs[-1]
    step = TORQUES[i + 1] - TORQUES[i]
    return float(TORQUES[i] + step * difference[i] / (difference[i] - difference[i + 1]))


def static(mesh: jg.Mesh, tables: dict) -> dict:
    """Numbers at the nominal torque, and PPTE over `TORQUES`, of every relief."""
    found, ppte = {}, {}
    for name, amounts in tables.items():
        cycles = over_torque(mesh, jnp.asarray(amounts), jnp.asarray(TORQUES))
        ppte[name] = np.asarray(jg.peak_to_peak(cycles.transmission_error))
        nominal = jax.tree.map(lambda leaf: leaf[TORQUES.index(NOMINAL)], cycles)
        loaded = np.asarray(nominal.pair_force) > 0
        pressure = np.asarray(nominal.contact_pressure)[:, 0].max(axis=0)
        # off the start of the relief, whose kink bends the flank under the contact
        bend = np.where(loaded, np.abs(np.asarray(nominal.relative_curvature)[:, 0]), 0.0).max(axis=0)
        single = (loaded.sum(axis=0) == 1) & (bend < 0.01)
        found |= {
            f"{name}_ppte": float(ppte[name][TORQUES.index(NOMINAL)]),
            f"{name}_ppte_over_torque": ppte[name].tolist(),
            f"{name}_unloaded_ppte": float(jg.peak_to_peak(nominal.unloaded_transmission_error)),
            f"{name}_first_harmonic": float(jg.harmonics(nominal.transmission_error, 1).amplitude[0]),
            f"{name}_flank_pressure": float(pressure.max()),
            f"{name}_corner_pressure": float(nominal.corner_pressure.max()),
            f"{name}_pressure": float(jg.quantities["max_contact_pressure"](nominal)),
            f"{name}_safety": float(STRENGTH.quantity("pressure_safety")(nominal)),
            f"{name}_single_pressure": float(pressure[single].mean()),
            f"{name}_single_pressure_spread": float(np.ptp(pressure[single])),
            f"{name}_height": float(np.max(amounts)),
            f"{name}_crossing": crossing(ppte[name], ppte["unmodified"]),
            f"{name}_volume": float(manufacture.ground_volume(mesh.sides[0], flank(mesh, jnp.asarray(amounts)))),
        }
    return found | {"quietest_torque": TORQUES[int(np.argmin(ppte["type 1"]))]}


def vibration(mesh: jg.Mesh, tables: dict, inertias: dict, fast=False) -> dict:
    """Largest K_v and q_rms [um] of every relief with every inertia: speed rising, falling, and falling after a kick.

    Also the mesh frequency [Hz] of the largest K_v, and after how many mesh cycles that motion repeats.
    """
    found = {}
    for (inertia, value), (name, amounts) in ((i, t) for i in inertias.items() for t in tables.items()):
        settings = dynamics.Dynamics(
            mesh_frequencies=np.arange(500.0, 5001.0, 100.0 if fast else 25.0),
            damping_ratio=DAMPING_RATIO,
            pinion_inertia=value,
            wheel_inertia=value,
            steps=128,
        )
        relief = flank(mesh, jnp.asarray(amounts))
        runs = settings.runs(settings.oscillator(mesh, NOMINAL, pinion=relief, wheel=relief))
        factor, period = (np.asarray([getattr(r, of) for r in runs.values()]) for of in ("dynamic_factor", "period"))
        run, speed = np.unravel_index(np.argmax(factor), factor.shape)
        key = name if inertia == next(iter(INERTIAS)) else f"{name}, {inertia}"
        found |= {
            f"{key}_K_v": float(factor.max()),
            f"{key}_K_v_at": float(settings.mesh_frequencies[speed]),
            f"{key}_K_v_without_kick": float(np.asarray(runs[dynamics.DOWN].dynamic_factor).max()),
            f"{key}_period": int(period[run, speed]),
            f"{key}_q_rms": max(float(r.dte_rms.max()) for r in runs.values()),
        }
    return found


def main(fast=False) -> dict:
    """Numbers of the study as jaxgear sees them."""
    mesh = prepare(fast)
    best = optima(mesh, fast)
    parabola = jg.TipRelief(AMOUNT, 3.27, jg.Power(2.0))  # from the highest point of single contact
    tables = {"unmodified": np.zeros(POINTS)}
    tables |= {name: table(mesh, of.pinion, of.wheel) for name, of in best.items()}
    tables["parabola of 6 um"] = table(mesh, parabola, parabola)
    for share in MIXED[1:2] if fast else MIXED:
        mixed = (1 - share) * tables["type 1"] + share * tables["parabola of 6 um"]
        tables[f"{100 * share:.0f} % parabola"] = mixed
    found = {"contact_ratio": float(mesh.path_of_contact.contact_ratio), "designs": list(tables)}
    found |= static(mesh, tables)
    for name in ("type 1", "type 2"):
        found[f"{name}_wheel_fit"] = float(manufacture.best_wheel_spline(mesh.sides[0], best[name].pinion).largest)
        found[f"{name}_ppte_over_steps"] = [state.ppte for state in best[name].iterations]
        found[f"{name}_pressure_over_steps"] = [
            float(max(state.max_flank_pressure, state.max_corner_pressure)) for state in best[name].iterations
        ]
        found[f"{name}_relief"] = tables[name].tolist()
    found |= vibration(mesh, tables, INERTIAS, fast)
    cycle = jg.solve(mesh, NOMINAL)
    mass = next(iter(INERTIAS.values())) / (2 * (1e-3 * float(mesh.pair.pinion.base_radius)) ** 2)  # kg
    found["natural_frequency"] = float(np.sqrt(1e6 * cycle.tangent_stiffness.mean() / mass) / (2 * np.pi))
    volumes = manufacture.reference_volumes(mesh.sides[0], AMOUNT)
    found["volume_from_linear"] = float(volumes.linear_from_pitch) / 2.5
    found["volume_from_parabolic"] = float(volumes.parabolic_from_pitch) / 1.73
    return found


def show(found: dict) -> None:
    """Prints every published number, jaxgear's, and what their difference is called."""
    print(f"{'at 200 N m':60}{'published':>10}{'jaxgear':>10}")
    for key, text, published, unit in LINES:
        difference = 100 * (found[key] / published - 1)
        word = "alike" if abs(difference) <= ALIKE else "higher" if difference > 0 else "lower"
        if text.endswith("less than"):
            word = "kept" if found[key] < published else "not kept"
        print((f"{text} [{unit}]" if unit else text).ljust(60) + f"{published:10.4g}{found[key]:10.4g}  {word}")
    columns = {"ppte": ".2f", "unloaded_ppte": ".2f", "first_harmonic": ".3f", "flank_pressure": ".0f"}
    columns |= {"corner_pressure": ".0f", "safety": ".2f", "volume": ".1f", "K_v": ".2f"}
    print("\n" + "".ljust(18) + "".join(f"{name.replace('_', ' '):>17}" for name in columns) + f"{'half inertia':>17}")
    for name in found["designs"]:
        cells = [format(found[f"{name}_{key}"], form) for key, form in columns.items()]
        cells.append(format(found[f"{name}, half of it_K_v"], ".2f"))
        print(name.ljust(18) + "".join(f"{cell:>17}" for cell in cells))
    print("(PPTE loaded and unloaded and first harmonic of the transmission error in um, pressures in MPa, mm3)")
    for line in (*pressures(found), *attribution(found), *contradictions(found)):
        print(line)


def pressures(found: dict):
    """The study's limit of the pressure and what it leaves of it, beside the pressures here."""
    yield f"\nThe study allows {ALLOWED:.0f} MPa against scuffing, which decides the height of its reliefs at the tip."
    yield (
        f"Tip edges have a radius of {EDGE:g} mm here; with 0.3 mm and the study's 1630 MPa as the limit type 1 "
        "is 6.37 um high, has 1625 MPa and a PPTE of 0.56 um (study: 6 um, 1630 MPa, 0.70 um)."
    )
    for name, safety in (("equation alone", None), ("type 1", 1.25), ("type 2", 1.74)):
        reached = found[f"{name}_pressure"]
        within = "within" if reached <= ALLOWED else "above"
        reserve = ""
        if safety is not None:
            kept = "no less" if found[f"{name}_safety"] >= safety else "less"
            reserve = f"; {kept} than the {safety:g} of the study, which are {ALLOWED / safety:.0f} MPa"
        flank, corner = (found[f"{name}_{where}_pressure"] for where in ("flank", "corner"))
        yield (
            f"{name}: {flank:.0f} MPa on the flank and {corner:.0f} MPa at the tip corners, {within} the limit; a "
            f"safety of {found[f'{name}_safety']:.2f}{reserve}."
        )
    pressures = ", ".join(f"{pressure:.0f}" for pressure in found["type 2_pressure_over_steps"])
    yield (
        f"Type 2 starts from the least pressure that its curve allows, which the iteration does not keep: {pressures} "
        "MPa from step to step. Its equation knows the transmission error alone; the study says that the static "
        "performance of the start is kept, without saying how."
    )


def attribution(found: dict):
    """What the study says of its resonances and reliefs, and what these numbers say."""
    natural, at = found["natural_frequency"], found["unmodified_K_v_at"]
    yield "\nThe study attributes its peaks at 4.5, 2.25 and 1.1 kHz to the main harmonic and super-harmonics."
    yield (
        f"Here small vibrations have a natural frequency of {natural:.0f} Hz; the largest K_v stands at {at:.0f} Hz, "
        f"{at / natural:.2f} times that, in a motion that repeats after {found['unmodified_period']} mesh cycles."
    )
    half = "unmodified, half of it"
    yield (
        f"Falling speeds without a kick find K_v {found['unmodified_K_v_without_kick']:.2f}; with half the inertia "
        f"{found[f'{half}_K_v_without_kick']:.2f}, and the largest of all runs, with q_rms "
        f"{found[f'{half}_q_rms']:.1f} um, stands at {found[f'{half}_K_v_at']:.0f} Hz."
    )
    for name, published, ppte in (("type 1", 2.75, 0.70), ("type 2", 3.0, 0.62)):
        needed, most = harmonic_of(found, published), 2 / np.pi * ppte
        yield (
            f"K_v {published:g} of {name} takes a first harmonic of the transmission error of {needed:.2f} um here; no "
            f"curve of {ppte:g} um peak to peak has more than {most:.2f} um: its PPTE and its K_v "
            f"{'agree' if needed <= most else 'do not agree'} in this model."
        )


def harmonic_of(found: dict, factor: float) -> float:
    """First harmonic of the transmission error [um] at which gears reach a K_v, interpolated over the designs."""
    points = sorted((found[f"{n}_K_v"], found[f"{n}_first_harmonic"]) for n in found["designs"])
    return float(np.interp(factor, *np.transpose(points)))


def contradictions(found: dict):
    """Where the document contradicts itself, from its own numbers."""
    yield "\nThe document's own numbers:"
    yield f"  2 GPa over 1630 MPa is {ALLOWED / 1630:.2f}, printed as a safety of 1.25"
    yield (
        f"  5 mm3 of volume, with 150 % more for a linear and 73 % more for a parabolic relief of 6 um from the pitch "
        f"point: on this pair these make it {found['volume_from_linear']:.1f} and "
        f"{found['volume_from_parabolic']:.1f} mm3"
    )
    yield (
        f"  here they are {found['type 1_volume']:.1f} and {found['type 2_volume']:.1f} mm3 of both flanks of all "
        "teeth: half of that, one flank of every tooth, is near the study's 5 mm3"
    )
    yield "  the wheel is an involute and a second-order polynomial in section 5, of third degree in the conclusions"
    yield "  peaks of the main harmonic and its super-harmonics at 1 : 2 : 4, without one at a third of the main one"


def draw(found: dict) -> None:
    """Largest K_v over the first harmonic of the static transmission error: reliefs by colour, inertias by marker."""
    import matplotlib.pyplot as plt

    from jaxgear import plot

    figure, ax = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
    for index, name in enumerate(found["designs"]):
        at, style = found[f"{name}_first_harmonic"], {"linestyle": "", "color": f"C{index}"}
        ax.plot(at, found[f"{name}_K_v"], marker="o", label=name, **style)
        ax.plot(at, found[f"{name}, half of it_K_v"], marker="s", markersize=9, markerfacecolor="none", **style)
    for name, published, ppte in (("type 1", 2.75, 0.70), ("type 2", 3.0, 0.62)):
        most = 2 / np.pi * ppte  # of a square wave
        ax.hlines(published, 0.0, most, color="grey", linewidth=1.0)
        ax.annotate(
            f" study, {name}: its K_v, up to the most its PPTE allows", (most, published), fontsize=6, va="center"
        )
    ax.set(xlabel="first harmonic of the transmission error [µm]", ylabel="largest dynamic factor $K_v$ [-]")
    ax.set(xlim=(0.0, None), ylim=(1.0, None), title="circles: solid discs, squares: half the inertia")
    ax.legend(fontsize=7, frameon=False)
    plot.save(figure, "results/reproduce_50_50_study_dynamic_factor.png")


if __name__ == "__main__":
    found = main(fast="--fast" in sys.argv)
    show(found)
    draw(found)
