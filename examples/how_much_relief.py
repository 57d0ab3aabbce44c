"""How much tip relief does a 19/48 pair need at 50 N m, and over which length?

Maps the peak-to-peak transmission error over amount and length of one parabolic tip relief on both gears: a thousand
designs in one vmapped call, and the exact gradient at the best of them. Run it: `python examples/how_much_relief.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import jaxgear as jg  # noqa: E402

TORQUE = 50.0  # N m


def gear_pair():
    pinion = jg.Gear(teeth=19, module=3.0, face_width=18.0, bore_diameter=24.0)
    wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0)
    return jg.GearPair(pinion, wheel)


def cycle(mesh, design):
    """Mesh cycle with the same relief on both gears; design = (amount [um], roll length from the tip [mm])."""
    relief = jg.TipRelief(design[0], design[1])
    return jg.solve(mesh, TORQUE, pinion=relief, wheel=relief)


def ppte(mesh, design):
    return jg.peak_to_peak(cycle(mesh, design).transmission_error)


@eqx.filter_jit
def ppte_and_slopes(mesh, designs):
    """PPTE [um] of every design, and its derivatives by amount [um/um] and length [um/mm]."""
    return jax.vmap(jax.value_and_grad(ppte, 1), (None, 0))(mesh, designs)


def study(fast=False):
    """The mesh, the two axes of the map [um, mm], PPTE and slopes on it, and the rule's design with its PPTE."""
    pair, resolution = gear_pair(), jg.Resolution(positions=32 if fast else 64)
    mesh = eqx.filter_jit(jg.prepare)(pair, resolution=resolution)
    # half a micrometre is about what grinding can hold
    amounts = jnp.linspace(0.0, 16.0, 17 if fast else 33)
    lengths = jnp.linspace(1.0, 7.0, 13 if fast else 31)
    rule = jg.iso_relief(pair, TORQUE)
    rule_design = jnp.stack([rule.amount, rule.length])
    grid = jnp.stack(jnp.meshgrid(amounts, lengths, indexing="ij"), axis=-1)
    values, slopes = ppte_and_slopes(mesh, jnp.concatenate([grid.reshape(-1, 2), rule_design[None]]))
    shape = grid.shape[:2]
    return {
        "mesh": mesh,
        "amounts": amounts,
        "lengths": lengths,
        "ppte": values[:-1].reshape(shape),
        "slopes": slopes[:-1].reshape(*shape, 2),
        "rule": rule_design,
        "rule_ppte": values[-1],
    }


def numbers(results):
    values = results["ppte"]
    i, j = np.unravel_index(np.argmin(values), values.shape)
    return {
        "unmodified_ppte_um": float(values[0, 0]),
        "rule_amount_um": float(results["rule"][0]),
        "rule_length_mm": float(results["rule"][1]),
        "rule_ppte_um": float(results["rule_ppte"]),
        "best_amount_um": float(results["amounts"][i]),
        "best_length_mm": float(results["lengths"][j]),
        "best_ppte_um": float(values[i, j]),
        "slope_by_amount_um_per_um": float(results["slopes"][i, j, 0]),
        "slope_by_length_um_per_mm": float(results["slopes"][i, j, 1]),
    }


def main(fast=False) -> dict:
    return numbers(study(fast))


def draw(results):
    import matplotlib.pyplot as plt

    from jaxgear import plot

    found = numbers(results)
    figure, ax = plt.subplots(figsize=(4.7, 3.0), layout="constrained")
    shades = ax.contourf(
        results["lengths"],
        results["amounts"],
        results["ppte"],
        levels=np.arange(0.0, 5.1, 0.5),
        cmap="cividis_r",
        extend="max",
    )
    figure.colorbar(shades, label="peak-to-peak TE [µm]")
    ax.plot(found["best_length_mm"], found["best_amount_um"], "wo", markeredgecolor="k", label="best of the map")
    ax.plot(found["rule_length_mm"], found["rule_amount_um"], "w^", markeredgecolor="k", label="ISO 6336 rule")
    ax.set(xlabel="length of the relief [mm]", ylabel="amount of the relief [µm]")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, borderaxespad=0.2)
    plot.save(figure, "results/how_much_relief_map.png")

    solve = eqx.filter_jit(cycle)
    best = jnp.asarray([found["best_amount_um"], found["best_length_mm"]])
    designs = {"unmodified": jnp.asarray([0.0, 1.0]), "ISO 6336 rule": results["rule"], "best of the map": best}
    cycles = {name: solve(results["mesh"], design) for name, design in designs.items()}
    plot.save(plot.transmission_error(cycles).figure, "results/how_much_relief_te.png")


if __name__ == "__main__":
    results = study(fast="--fast" in sys.argv)
    for name, value in numbers(results).items():
        print(f"{name:28} {value:8.3f}")
    draw(results)
