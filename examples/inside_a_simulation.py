"""What does a tip relief do at speed? The loaded contact inside a simulation of vibrations, differentiated through.

Two gears on stiff shafts vibrate against each other on the line of action (one degree of freedom, the usual model with
time-varying stiffness and transmission error): m q'' + c q' + k(phase) (q - e(phase)) = F while the flanks touch.
Stiffness k and unloaded transmission error e come from one contact analysis, the vector field is that of
`jaxgear.dynamics.torsional`; `diffrax` integrates from rest, and `jax.grad` follows the rms of the vibration back to
the amount of relief. Run it: `python examples/inside_a_simulation.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import diffrax  # noqa: E402
import jax.numpy as jnp  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import dynamics  # noqa: E402

TORQUE = 50.0  # N m
DAMPING_RATIO = 0.05  # usual for gear meshes: 0.03 to 0.1
CYCLES, KEPT, PER_CYCLE = 60, 10, 32  # mesh cycles simulated, those after the transient, points of each


def oscillator(mesh: jg.Mesh, relief: jg.TipRelief) -> dynamics.Oscillator:
    """The relative vibration of two gears with one tip relief: solid rings, from the bore to the pitch circle."""
    force = dynamics.mesh_force(
        mesh,
        torque=TORQUE,
        pinion=relief,
        wheel=relief,
        model="varying stiffness",
        positions=mesh.resolution.positions,
    )
    return dynamics.torsional(force, pair=mesh.pair, torque=TORQUE, damping_ratio=DAMPING_RATIO)


def vibration(mesh: jg.Mesh, relief: jg.TipRelief, share):
    """Rms of the DTE about its mean [um], at a share of the natural frequency."""
    system = oscillator(mesh, relief)
    frequency = share * dynamics.natural_frequencies(system).mesh
    times = jnp.linspace(CYCLES - KEPT, CYCLES, KEPT * PER_CYCLE, endpoint=False) / frequency
    dte = system.mesh_force.static_te(jnp.zeros(()), system.load[0])
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(system),
        diffrax.Tsit5(),
        t0=0.0,
        t1=times[-1],
        dt0=1 / (PER_CYCLE * frequency),
        y0=(dte[None], jnp.zeros(1)),
        args=frequency,
        saveat=diffrax.SaveAt(ts=times),
        max_steps=CYCLES * PER_CYCLE + 16,
    )
    return jnp.std(solution.ys[0])


def study(fast=False):
    """Vibration over speed, without and with relief, and its slope with the relief at one speed."""
    pinion = jg.Gear(teeth=19, module=3.0, face_width=20.0, bore_diameter=24.0)
    wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0)
    pair = jg.GearPair(pinion, wheel)
    mesh = jg.prepare(pair, resolution=jg.Resolution(positions=32 if fast else 64, pairs=2))
    rule = jg.sizing.iso_relief(pair, TORQUE)

    def rms(amount, share):
        return vibration(mesh, jg.TipRelief(amount, rule.length), share)

    shares = jnp.linspace(0.3, 1.5, 7 if fast else 61)
    curves = jax.jit(jax.vmap(jax.vmap(rms, (None, 0)), (0, None)))(jnp.stack([0.0 * rule.amount, rule.amount]), shares)
    half = 0.5 * rule.amount
    slope = jax.jit(jax.grad(rms))(half, 0.5)
    step = 1e-3
    difference = (jax.jit(rms)(half + step, 0.5) - jax.jit(rms)(half - step, 0.5)) / (2 * step)
    return {
        "shares": shares,
        "unmodified": curves[0],
        "relief": curves[1],
        "amount": rule.amount,
        "slope": slope,
        "difference": difference,
    }


def numbers(found):
    """What the example answers with."""
    return {
        "relief_um": float(found["amount"]),
        "worst_rms_unmodified_um": float(jnp.max(found["unmodified"])),
        "worst_rms_relief_um": float(jnp.max(found["relief"])),
        "slope_um_per_um": float(found["slope"]),
        "difference_um_per_um": float(found["difference"]),
    }


def main(fast=False) -> dict:
    return numbers(study(fast))


def draw(found):
    import matplotlib.pyplot as plt

    from jaxgear import plot
    from jaxgear.plot.figure import line_style

    figure, axis = plt.subplots(figsize=(4.7, 3.0), layout="constrained")
    for index, name in enumerate(("unmodified", "relief")):
        label = name if name == "unmodified" else f"tip relief of {float(found['amount']):.1f} µm"
        axis.plot(found["shares"], found[name], label=label, **line_style(index))
    axis.set(xlabel="mesh frequency / natural frequency [-]", ylabel="rms of the vibration [µm]", ylim=(0.0, None))
    axis.legend(frameon=False)
    plot.save(figure, "results/inside_a_simulation.png")


if __name__ == "__main__":
    found = study(fast="--fast" in sys.argv)
    answer = numbers(found)
    print(f"Worst rms of the vibration at 0.3 to 1.5 times the natural frequency, {TORQUE:g} N m:")
    print(f"  unmodified            {answer['worst_rms_unmodified_um']:.3f} um")
    print(f"  {answer['relief_um']:.1f} um of tip relief {answer['worst_rms_relief_um']:.3f} um")
    print(
        f"At half that relief and half the natural frequency it changes by {answer['slope_um_per_um']:.4f} um per um "
        f"of relief (central difference: {answer['difference_um_per_um']:.4f})"
    )
    draw(found)
