"""Which tip relief is the quietest at one speed, and what does the dimensionless model know of it?

The five steps of a published procedure of dynamic profile modification, from the design file of the 50/50 test pair to
a flank over roll angle, at two mesh frequencies and under a torque that fluctuates with the mesh:

1. identification: natural frequency, damping, clearance b and the coefficients of its polynomial,
2. excitation: mean load F_m, its fluctuation F_aT, displacement F_ah, stiffness harmonics B_j,
3. frequency factor Omega and the resonance that it belongs to,
4. the relief C(delta) with the least amplitude of x, among those up to the largest deflection C_max, by gradients
   (Adam) and by a genetic algorithm,
5. the flank: amount over roll angle.

The contact analysis and the integration of its own mesh force judge what the model promises: near the natural
frequency the gears keep it, at half of it they do not. The model knows one C for the whole mesh, the mean of two pairs
in contact, and five harmonics of the stiffness; where little of the first harmonic is left to cancel, what it leaves
out is larger than what it promises. Run it: `python examples/which_relief_for_one_speed.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402
from pathlib import Path  # noqa: E402

import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import dimensionless, dynamics, tolerance  # noqa: E402
from jaxgear.io import load_design  # noqa: E402

FILE = Path(__file__).parent / "dynamics_50_50.toml"
MESH_FREQUENCIES = {"half": 1600.0, "primary": 2850.0}  # Hz
FLUCTUATION = 0.05  # F_aT over F_m, at the mesh frequency
KICKS = (1.0, 3.1)  # dynamic factor of the first impact; 1 for a start at rest
METHODS = ("adam", "genetic")
RELIEFS = ("none", "static", "dynamic")


def identified(file, mesh):
    """Steps 1 and 2: the dimensionless model of the unmodified pair under the torque of the file."""
    given = file.tables["dynamics"]
    mass = dynamics.equivalent_mass(mesh.pair, (given.pinion_inertia, given.wheel_inertia))
    cycle = jg.solve(mesh, file.torque)
    return dimensionless.from_mesh(
        cycle, mass=mass, damping_ratio=given.damping_ratio, torque_fluctuation=FLUCTUATION, torque_order=1.0
    )


def largest_relief(model) -> float:
    """C_max = (F_m + F_ah + F_aT) / K_min; beyond about that a relief parts one of two pairs."""
    stiffness = jax.vmap(lambda phase: model.mesh_force.at(phase)[1])(jnp.linspace(0.0, 1.0, 256))
    forces = model.load, jnp.sum(model.torque), jnp.sum(model.displacement)
    return dimensionless.largest_relief(*forces, jnp.min(stiffness))


def condition(omega) -> str:
    """Step 3: the resonance that is nearest to a frequency factor."""
    rows = dimensionless.operating_conditions()
    return min(rows, key=lambda row: abs(np.log(omega / row.frequency))).name


def optima(found, mesh, omega, fast) -> dict:
    """Step 4, by method."""
    pair, clearance = mesh.pair, found.half_clearance
    usual = jg.TipRelief(8.0, jg.long_relief_length(pair), jg.Power(1.2))
    return {
        method: dimensionless.dynamic_profile_modification(
            found.model,
            omega,
            dimensionless.cycle_relief(usual, pair, clearance),
            free=("amount", "length", "curve"),
            bounds={"amount": (0.0, largest_relief(found.model))},
            iterations=30 if fast else 100,
            method=method,
        )
        for method in METHODS
    }


def judged(file, mesh, found, relief, frequencies, fast) -> dict:
    """What the contact analysis says of a flank, and the responses that its own mesh force settles to, one per kick."""
    given, torque = file.tables["dynamics"], file.torque
    force = dynamics.mesh_force(mesh, torque=torque, pinion=relief, wheel=relief, positions=128 if fast else 512)
    fluctuation = dynamics.Excitation([FLUCTUATION], [0.0], [0.0], [0.0], [1.0])
    oscillator = dynamics.torsional(
        force,
        pair=mesh.pair,
        torque=torque,
        damping=2 * found.model.damping_ratio * jnp.sqrt(found.mass * 1e-6 * found.mean_stiffness),
        inertias=(given.pinion_inertia, given.wheel_inertia),
        excitation=fluctuation,
    )
    responses = [
        dynamics.speed_sweep(oscillator, frequencies, kick=kick, carry=False, steps=128 if fast else 256)
        for kick in KICKS
    ]
    cycle = jg.solve(mesh, torque, pinion=relief, wheel=relief)
    return {"ppte": float(jg.peak_to_peak(cycle.transmission_error)), "responses": responses}


def study(fast=False) -> dict:
    """The model, and of every speed: frequency factor, optima by method, and judged flanks by their names."""
    file = load_design(FILE)
    mesh = file.mesh()
    found = identified(file, mesh)
    between = np.linspace(1200.0, 3600.0, 5 if fast else 97)
    frequencies = np.union1d(between, list(MESH_FREQUENCIES.values()))
    speeds = {}
    for name, frequency in MESH_FREQUENCIES.items():
        omega = frequency / float(found.natural_frequency)
        by_method = optima(found, mesh, omega, fast)
        best = min(by_method.values(), key=lambda each: float(each.amplitude[2]))
        flanks = {
            "none": jg.TipRelief(0.0, 1.0, jg.Power(1.2)),
            "static": dimensionless.tip_relief(best.static, mesh.pair, found.half_clearance),
            "dynamic": dimensionless.tip_relief(best.dynamic, mesh.pair, found.half_clearance),
        }
        results = {key: judged(file, mesh, found, flank, frequencies, fast) for key, flank in flanks.items()}
        speeds[name] = {"omega": omega, "optima": by_method, "best": best, "flanks": flanks, "judged": results}
    return {"file": file, "mesh": mesh, "model": found, "frequencies": frequencies, "speeds": speeds}


def trace(results, name):
    """Step 5: the flank of the dynamic optimum, material removed [um] over roll angle [deg]."""
    side, flank = results["mesh"].sides[0], results["speeds"][name]["flanks"]["dynamic"]
    drawn = tolerance.profile_trace(side, flank, points=12)
    return np.asarray(drawn.roll_angle), -np.asarray(drawn.design)


def numbers(results) -> dict:
    found, model = results["model"], results["model"].model
    clearance = float(found.half_clearance)
    polynomial = dimensionless.PolynomialClearance.fit()
    answer = {
        "natural_frequency_Hz": float(found.natural_frequency),
        "half_clearance_um": clearance,
        "load": float(model.load),
        "largest_relief_um": clearance * float(largest_relief(model)),
        # of the polynomial of order 7 over that of the dead zone, at the mean load
        "polynomial_stiffness": float(polynomial.slope(polynomial.loaded(model.load))),
    }
    answer |= {f"a_{2 * k + 1}": float(each) for k, each in enumerate(polynomial.coefficients)}
    answer |= {f"B_{j + 1}": float(each) for j, each in enumerate(model.stiffness_harmonics)}
    for name, speed in results["speeds"].items():
        at = int(np.searchsorted(results["frequencies"], MESH_FREQUENCIES[name]))
        answer[f"{name}_omega"] = speed["omega"]
        for method, each in speed["optima"].items():
            answer[f"{name}_{method}_um"] = clearance * float(each.amplitude[2])
        for place, key in enumerate(RELIEFS):
            relief, said = speed["flanks"][key], speed["judged"][key]
            ranges = [response.dte_max[at] - response.dte_min[at] for response in said["responses"]]
            answer |= {
                f"{name}_{key}_model_um": clearance * float(speed["best"].amplitude[place]),
                f"{name}_{key}_integrated_um": 0.5 * float(max(ranges)),
                f"{name}_{key}_dynamic_factor": float(max(each.dynamic_factor[at] for each in said["responses"])),
                f"{name}_{key}_ppte_um": said["ppte"],
                f"{name}_{key}_amount_um": float(relief.amount),
                f"{name}_{key}_length_mm": float(relief.length),
                f"{name}_{key}_exponent": float(relief.curve.exponent),
            }
        answer[f"{name}_settled_share"] = float(
            np.mean([response.converged[at] for said in speed["judged"].values() for response in said["responses"]])
        )
    return answer


def main(fast=False) -> dict:
    return numbers(study(fast))


def show(results):
    """The five steps in print."""
    found = numbers(results)
    print(f"1. f_n {found['natural_frequency_Hz']:.0f} Hz, b {found['half_clearance_um']:.1f} um, polynomial "
          + ", ".join(f"a_{order} {found[f'a_{order}']:.4f}" for order in (1, 3, 5, 7)))  # fmt: skip
    print(f"   The polynomial has {found['polynomial_stiffness']:.2f} of the stiffness of the dead zone at this load; "
          "the dead zone itself is used.")  # fmt: skip
    print(f"2. F_m {found['load']:.4f}, F_aT {FLUCTUATION * found['load']:.4f}, "
          + ", ".join(f"B_{j} {found[f'B_{j}']:.3f}" for j in range(1, 6)))  # fmt: skip
    for name, frequency in MESH_FREQUENCIES.items():
        omega = found[f"{name}_omega"]
        print(f"3. {frequency:.0f} Hz: Omega {omega:.3f}, nearest to: {condition(omega)}")
        print("4. least amplitude of x, in um: " + ", ".join(f"{m} {found[f'{name}_{m}_um']:.3f}" for m in METHODS))
        print(f"   {'relief':9}{'amount um':>11}{'length mm':>11}{'exponent':>10}{'model um':>10}{'integrated':>11}"
              f"{'K_v':>7}{'PPTE um':>9}")  # fmt: skip
        for key in RELIEFS:
            amount, length, exponent, model, whole, factor, ppte = (
                found[f"{name}_{key}_{what}"]
                for what in ("amount_um", "length_mm", "exponent", "model_um", "integrated_um", "dynamic_factor",
                             "ppte_um")
            )  # fmt: skip
            print(f"   {key:9}{amount:11.2f}{length:11.2f}{exponent:10.2f}{model:10.3f}{whole:11.3f}{factor:7.2f}"
                  f"{ppte:9.3f}")  # fmt: skip
        angles, amounts = trace(results, name)
        print("5. roll angle deg" + "".join(f"{angle:7.2f}" for angle in angles))
        print("   amount um     " + "".join(f"{amount:7.2f}" for amount in amounts))


def draw(results):
    from jaxgear import plot

    speeds = results["speeds"]
    with plot.figure.report_axes(None, columns=len(speeds), width=92.0 * len(speeds), height=84.0) as panels:
        for number, (panel, (name, speed)) in enumerate(zip(panels, speeds.items())):
            curves = {key: speed["judged"][key]["responses"] for key in RELIEFS}
            plot.speed_response(curves, ax=panel, title=f"relief for {MESH_FREQUENCIES[name]:g} Hz")
            panel.set_ylabel(panel.get_ylabel() if number == 0 else "")
    plot.save(panels[0].figure, "results/which_relief_for_one_speed.png")


if __name__ == "__main__":
    results = study(fast="--fast" in sys.argv)
    show(results)
    draw(results)
