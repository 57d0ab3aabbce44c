"""What does a tip relief do at speed? The loaded contact inside a simulation of vibrations, differentiated through.

Two gears on stiff shafts vibrate against each other on the line of action (one degree of freedom, the usual model with
time-varying stiffness and transmission error): m x'' + c x' + k(phase) (x - e(phase)) = F. Stiffness k and unloaded
transmission error e come from one contact analysis of a `jaxgear.ModifiedMesh`; `diffrax` integrates from rest, and
`jax.grad` follows the rms of the vibration back to the amount of relief. Run it: `python
examples/inside_a_simulation.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import diffrax  # noqa: E402
import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402

import jaxgear as jg  # noqa: E402

TORQUE = 50.0  # N m
DAMPING_RATIO = 0.05  # usual for gear meshes: 0.03 to 0.1
CYCLES, KEPT, PER_CYCLE = 60, 10, 32  # mesh cycles simulated, those after the transient, points of each


class Oscillator(eqx.Module):
    """Relative vibration of two gears on the line of action; lengths in um, forces in N, time in s.

    Attributes:
        force: static mesh force [N].
        stiffness: over one mesh cycle [N/um], shape (positions,).
        error: unloaded transmission error over one mesh cycle [um], shape (positions,).
        mass: reduced to the line of action [N s^2 / um].
    """

    force: jax.Array
    stiffness: jax.Array
    error: jax.Array
    mass: jax.Array

    def natural_frequency(self):
        """[Hz]"""
        return jnp.sqrt(jnp.mean(self.stiffness) / self.mass) / (2 * jnp.pi)

    def __call__(self, time, state, mesh_frequency):
        """Vector field of displacement [um] and velocity [um/s]."""
        x, v = state
        phase = time * mesh_frequency
        k, e = self._at(self.stiffness, phase), self._at(self.error, phase)
        damping = 2 * DAMPING_RATIO * jnp.sqrt(jnp.mean(self.stiffness) * self.mass)
        return v, (self.force - k * (x - e) - damping * v) / self.mass

    @staticmethod
    def _at(curve, phase):
        positions = curve.shape[0]
        return jnp.interp(phase % 1.0, jnp.arange(positions + 1) / positions, jnp.append(curve, curve[0]))


def oscillator(model: jg.ModifiedMesh) -> Oscillator:
    """The oscillator of one mesh: solid discs, from the bore to the pitch circle."""
    cycle = model(TORQUE)
    masses = []
    for gear in (model.mesh.pair.pinion, model.mesh.pair.wheel):
        ring = gear.pitch_radius**4 - gear.bore_radius**4
        inertia = 0.5e-15 * jnp.pi * gear.material.density * gear.face_width * ring  # kg m^2, from mm
        masses.append(inertia / (1e-3 * gear.base_radius) ** 2)  # kg
    reduced = masses[0] * masses[1] / (masses[0] + masses[1])
    return Oscillator(cycle.force, jg.secant_stiffness(cycle), cycle.unloaded_transmission_error, 1e-6 * reduced)


def vibration(model: jg.ModifiedMesh, share):
    """Rms of the displacement about its mean [um], at a share of the natural frequency."""
    system = oscillator(model)
    frequency = share * system.natural_frequency()
    times = jnp.linspace(CYCLES - KEPT, CYCLES, KEPT * PER_CYCLE, endpoint=False) / frequency
    rest = (jnp.mean(model(TORQUE).transmission_error), jnp.zeros_like(frequency))
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(system),
        diffrax.Tsit5(),
        t0=0.0,
        t1=times[-1],
        dt0=1 / (PER_CYCLE * frequency),
        y0=rest,
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

    def model(amount):
        relief = jg.TipRelief(amount, rule.length)
        return jg.ModifiedMesh(mesh, pinion=relief, wheel=relief)

    def rms(amount, share):
        return vibration(model(amount), share)

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
