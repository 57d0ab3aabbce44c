"""A relief is sized for one torque: is it still good at the others?

PPTE of a 19/48 pair from 5 to 100 N m: unmodified, with the short and the long relief of the ISO 6336 rule at 50 N m,
and with the relief whose worst PPTE between 25 and 100 N m is least. All designs at all torques are one vmapped call.
Run it: `python examples/is_it_robust_over_torque.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import jaxgear as jg  # noqa: E402

TORQUE = 50.0  # N m, the design torque
TORQUES = np.array([5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0])  # N m
SERVICE = TORQUES >= 25.0


def gear_pair():
    pinion = jg.Gear(teeth=19, module=3.0, face_width=18.0, bore_diameter=24.0)
    wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0)
    return jg.GearPair(pinion, wheel)


@eqx.filter_jit
def transmission_errors(mesh, designs, torques):
    """Curves [um] of shape (designs, torques, positions); a design is (amount [um], length [mm]) on both gears."""

    def curve(design, torque):
        relief = jg.TipRelief(design[0], design[1])
        return jg.solve(mesh, torque, pinion=relief, wheel=relief).transmission_error

    return jax.vmap(jax.vmap(curve, (None, 0)), (0, None))(designs, torques)


def study(fast=False):
    """The mesh, and by name the design and its transmission error over the torques [um], (torques, positions)."""
    pair, resolution = gear_pair(), jg.Resolution(positions=32 if fast else 64)
    mesh = eqx.filter_jit(jg.prepare)(pair, resolution=resolution)
    amount, full = jg.sizing.relief_amount(pair, TORQUE), jg.long_relief_length(pair)
    short = jnp.stack([amount, jg.sizing.short_relief_length(pair)])
    named = jnp.stack([jnp.zeros(2), short, jnp.stack([amount, full])])
    amounts, lengths = jnp.linspace(4.0, 20.0, 17 if fast else 33), jnp.linspace(3.0, 7.0, 9 if fast else 17)
    grid = jnp.stack(jnp.meshgrid(amounts, lengths, indexing="ij"), axis=-1).reshape(-1, 2)
    designs = jnp.concatenate([named, grid])
    curves = transmission_errors(mesh, designs, jnp.asarray(TORQUES))
    worst = jnp.max(jg.peak_to_peak(curves)[:, SERVICE], axis=1)
    chosen = {"unmodified": 0, "short": 1, "long": 2, "robust": int(jnp.argmin(worst))}
    return mesh, {name: (designs[index], curves[index]) for name, index in chosen.items()}


def numbers(results):
    found = {}
    for name, (design, curves) in results[1].items():
        ppte = np.asarray(jg.peak_to_peak(curves))
        found[f"{name}_amount_um"], found[f"{name}_length_mm"] = map(float, design)
        found[f"{name}_ppte_at_light_load_um"] = float(ppte[0])
        found[f"{name}_ppte_at_design_torque_um"] = float(ppte[TORQUES == TORQUE][0])
        found[f"{name}_worst_ppte_in_service_um"] = float(ppte[SERVICE].max())
        found[f"{name}_quietest_torque_Nm"] = float(TORQUES[ppte.argmin()])
    return found


def main(fast=False) -> dict:
    return numbers(study(fast))


def draw(results):
    from jaxgear import plot

    mesh, designs = results
    curves = {name: jg.peak_to_peak(te) for name, (_, te) in designs.items()}
    ax = plot.ppte_over_torque(TORQUES, curves, design_torque=TORQUE)
    plot.save(ax.figure, "results/is_it_robust_over_torque.png")
    shown = np.isin(TORQUES, [5.0, 15.0, 25.0, 40.0, 50.0, 60.0, 80.0, 100.0])
    ax = plot.harris_map(mesh.phase, TORQUES[shown], designs["long"][1][shown])
    plot.save(ax.figure, "results/is_it_robust_over_torque_long_relief.png")


if __name__ == "__main__":
    results = study(fast="--fast" in sys.argv)
    for name, value in numbers(results).items():
        print(f"{name:36} {value:8.3f}")
    draw(results)
