"""What does tip relief do to a drivetrain that runs up? A mesh of jaxgear inside a diffrax model, with its gradients.

A motor with a falling torque curve turns, through an elastic shaft, the pinion of a gear pair; the wheel turns a load
whose torque grows with the square of the speed. Motor, pinion and wheel are inertias of one vector field: the gear
pair is a `two_gears` oscillator, what is joined to it adds torques, and the rotation of the gears itself is the mesh
position, so that the mesh frequency changes as the drivetrain runs up. `jax.grad` follows the vibration of the mesh
back to the amount of relief. Run it: `python examples/drivetrain.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import diffrax  # noqa: E402
import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402

import jaxgear as jg  # noqa: E402
from jaxgear import dynamics  # noqa: E402

TORQUE = 50.0  # N m of the load, on the pinion, at the speed of the load point
LOAD_SPEED = 7000.0  # rpm of the pinion there
START_TORQUE, IDLE_SPEED = 110.0, 15_000.0  # N m and rpm of the motor, whose torque falls linearly with the speed
MOTOR_INERTIA, GEAR_INERTIA, LOAD_INERTIA = 2e-3, (3e-4, 4e-3), 3e-3  # kg m2; gears: pinion and wheel with its load
SHAFT_STIFFNESS, SHAFT_DAMPING = 4e3, 0.4  # N m/rad, N m s/rad
DAMPING_RATIO = 0.05  # usual for gear meshes: 0.03 to 0.1
FIRST_SPEED = 2000.0  # rpm at which the simulation begins
PER_SECOND = 60_000  # steps of the integrator: 30 of the mesh's natural vibration
RPM = 2 * jnp.pi / 60


class Drivetrain(eqx.Module):
    """Vector field of motor, pinion and wheel; the state is (angle of the motor [rad], its speed [rad/s], gears).

    Attributes:
        gears: `two_gears`: coordinates r_b theta [um], without the torques of what is joined to them.
        radius: base radius of the pinion [m].
        base_pitch: [um].
    """

    gears: dynamics.Oscillator
    radius: jax.Array
    base_pitch: jax.Array

    def torques(self, y):
        """Of the motor, the shaft and the load, the last on the line of action [N m, N m, N]."""
        angle, speed, (x, v) = y
        turned, turning = 1e-6 * x[0] / self.radius, 1e-6 * v[0] / self.radius
        motor = START_TORQUE * (1 - speed / (IDLE_SPEED * RPM))
        shaft = SHAFT_STIFFNESS * (angle - turned) + SHAFT_DAMPING * (speed - turning)
        load = TORQUE / self.radius * (1e-6 * v[1] / self.radius / (LOAD_SPEED * RPM)) ** 2
        return motor, shaft, load

    def __call__(self, time, y, args):
        angle, speed, (x, v) = y
        motor, shaft, load = self.torques(y)
        joined = eqx.tree_at(lambda gears: gears.load, self.gears, jnp.stack([shaft / self.radius, -load]))
        # the mesh position is where the wheel stands
        moved = joined(time, (x, v), lambda _: (x[1] / self.base_pitch, v[1] / self.base_pitch))
        return speed, (motor - shaft) / MOTOR_INERTIA, moved

    def start(self):
        """Turning together at the first speed, shaft and teeth wound up."""
        speed = FIRST_SPEED * RPM
        v = jnp.full(2, 1e6 * self.radius * speed)
        *_, load = self.torques((0.0, speed, (jnp.zeros(2), v)))
        dte = self.gears.mesh_force.static_te(0.0, load)
        return load * self.radius / SHAFT_STIFFNESS, speed, (jnp.stack([dte, 0.0 * dte]), v)


def drivetrain(mesh, amount, length) -> Drivetrain:
    """With gears of one tip relief."""
    relief = jg.TipRelief(amount, length)
    flanks = {"pinion": relief, "wheel": relief}
    force = dynamics.mesh_force(mesh, torque=TORQUE, **flanks, model="varying stiffness", positions=64)
    wheel = GEAR_INERTIA[1] + LOAD_INERTIA
    gears = dynamics.two_gears(
        force, pair=mesh.pair, torque=TORQUE, inertias=(GEAR_INERTIA[0], wheel), damping_ratio=DAMPING_RATIO
    )
    pinion = mesh.pair.pinion
    base_pitch = 2 * jnp.pi * pinion.base_radius / pinion.teeth
    return Drivetrain(gears, 1e-3 * pinion.base_radius, 1e3 * base_pitch)


def run_up(model: Drivetrain, times):
    """Speed of the pinion [rpm] and force of the mesh [N] at times that begin with 0."""
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(model),
        diffrax.Tsit5(),
        t0=0.0,
        t1=times[-1],
        dt0=1 / PER_SECOND,
        y0=model.start(),
        saveat=diffrax.SaveAt(ts=times),
        max_steps=int(2.1 * len(times)) + 16,
    )
    x, v = solution.ys[2]
    force = jax.vmap(model.gears.mesh_force)(x[:, 1] / model.base_pitch, x[:, 0] - x[:, 1])
    return 1e-6 * v[:, 0] / model.radius / RPM, force


def vibration(force):
    """Rms of the force about its mean [N]."""
    return jnp.std(force)


def study(fast=False):
    """Run-ups without and with relief, and the slope of the vibration with the relief."""
    pinion = jg.Gear(teeth=19, module=3.0, face_width=20.0, bore_diameter=24.0)
    wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0)
    mesh = jg.prepare(jg.GearPair(pinion, wheel), resolution=jg.Resolution(positions=32 if fast else 64, pairs=2))
    rule = jg.sizing.iso_relief(mesh.pair, TORQUE)
    duration = 0.02 if fast else 0.1  # s
    times = jnp.linspace(0.0, duration, int(duration * PER_SECOND / 2))

    def ran(amount):
        speed, force = run_up(drivetrain(mesh, amount, rule.length), times)
        return vibration(force), (speed, force)

    # one program: without and with relief, and half of it with its neighbours for the central difference
    step, none = 1e-3, 0.0 * rule.amount
    half = 0.5 * rule.amount
    amounts = jnp.stack([none, rule.amount, half - step, half, half + step])
    (values, (speeds, forces)), slopes = jax.jit(jax.vmap(jax.value_and_grad(ran, has_aux=True)))(amounts)
    return {
        "speeds": speeds[:2],
        "forces": forces[:2],
        "rms": values[:2],
        "amount": rule.amount,
        "slope": slopes[3],
        "difference": (values[4] - values[2]) / (2 * step),
    }


def numbers(found):
    """What the example answers with."""
    unmodified, relief = found["rms"]
    return {
        "relief_um": float(found["amount"]),
        "last_speed_rpm": float(found["speeds"][1, -1]),
        "force_rms_unmodified_N": float(unmodified),
        "force_rms_relief_N": float(relief),
        "slope_N_per_um": float(found["slope"]),
        "difference_N_per_um": float(found["difference"]),
    }


def main(fast=False) -> dict:
    return numbers(study(fast))


def draw(found):
    import matplotlib.pyplot as plt

    from jaxgear import plot
    from jaxgear.plot.figure import line_style

    figure, axis = plt.subplots(figsize=(4.7, 3.0), layout="constrained")
    for index, name in enumerate(("unmodified", f"tip relief of {float(found['amount']):.1f} µm")):
        style = {**line_style(index), "linewidth": 0.6, "linestyle": "-"}
        axis.plot(found["speeds"][index], 1e-3 * found["forces"][index], label=name, **style)
    axis.set(xlabel="speed of the pinion [rpm]", ylabel="mesh force [kN]")
    axis.legend(frameon=False)
    plot.save(figure, "results/drivetrain.png")


if __name__ == "__main__":
    found = study(fast="--fast" in sys.argv)
    answer = numbers(found)
    print(f"Run-up from {FIRST_SPEED:g} to {answer['last_speed_rpm']:.0f} rpm, rms of the mesh force about its mean:")
    print(f"  unmodified            {answer['force_rms_unmodified_N']:.1f} N")
    print(f"  {answer['relief_um']:.1f} um of tip relief {answer['force_rms_relief_N']:.1f} N")
    print(
        f"At half that relief it changes by {answer['slope_N_per_um']:.3f} N per um of relief "
        f"(central difference: {answer['difference_N_per_um']:.3f})"
    )
    draw(found)
