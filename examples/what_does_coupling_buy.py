"""What does it buy to couple neighbouring teeth through the gear body?

Takes two pairs of which finite-element results are known and solves each with three models: teeth coupled through the
body (the default), the same without the coupling, and the usual published model (uncoupled, constant Hertz stiffness).
All are in plane stress, as the finite elements are. Every model then chooses the amount of a long tip relief; the
coupled model judges the choice.
Run it: `python examples/what_does_coupling_buy.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402

import jaxgear as jg  # noqa: E402

TORQUES = {"19/48": 50.0, "30/30": 150.0}  # N m
# PPTE [um] and largest stiffness in single and double contact [N/um] of the unmodified pairs, plane stress, full gears
# with a rigidly held bore: `benchmarks/reference`
FINITE_ELEMENTS = {"19/48": (2.838, 192.4, 267.5), "30/30": (6.375, 179.6, 228.5)}


def gear_pair(name):
    if name == "19/48":
        pinion = jg.Gear(teeth=19, module=3.0, face_width=18.0, bore_diameter=20.0)
        wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=40.0)
        return jg.GearPair(pinion, wheel)
    gear = jg.Gear(teeth=30, module=2.0, face_width=20.0, bore_diameter=12.6)
    return jg.GearPair(gear, gear)


@eqx.filter_jit
def prepare(pair, compliance, resolution):
    return jg.prepare(pair, compliance=compliance, resolution=resolution)


def uncouple(mesh):
    """The mesh with every pair deaf to the others."""
    own = jnp.eye(mesh.resolution.pairs)[:, :, None, None]
    return eqx.tree_at(lambda m: m.structure, mesh, mesh.structure * own)


@eqx.filter_jit
def over_amounts(mesh, torque, amounts):
    """Cycles with a long parabolic relief of every amount [um] on both gears."""
    length = jg.long_relief_length(mesh.pair)

    def cycle(amount):
        relief = jg.TipRelief(amount, length)
        return jg.solve(mesh, torque, pinion=relief, wheel=relief)

    return jax.vmap(cycle)(amounts)


def study(fast=False):
    """Amounts of relief relative to the rule's, and the cycles of all of them by pair and model; the first is zero."""
    resolution = jg.Resolution(positions=32 if fast else 64)
    relative = jnp.linspace(0.0, 2.0, 21 if fast else 41)
    cycles = {}
    for name, torque in TORQUES.items():
        pair = gear_pair(name)
        coupled = prepare(pair, jg.default_compliance("stress"), resolution)
        published = prepare(pair, jg.legacy_compliance(), resolution)
        models = {"coupled": coupled, "uncoupled": uncouple(coupled), "published": published}
        amounts = relative * jg.sizing.relief_amount(pair, torque)
        cycles[name] = {model: over_amounts(mesh, jnp.asarray(torque), amounts) for model, mesh in models.items()}
    return relative, cycles


def unmodified(cycles):
    """The first of the vmapped cycles."""
    return jax.tree.map(lambda leaf: leaf[0], cycles)


def stiffness(cycle):
    """Largest secant stiffness in single and in double contact [N/um]."""
    secant, loaded = jg.secant_stiffness(cycle), jnp.sum(cycle.pair_force > 0, axis=0)
    return tuple(float(jnp.max(jnp.where(loaded == pairs, secant, 0.0))) for pairs in (1, 2))


def numbers(results):
    relative, cycles = results
    found = {}
    for pair, models in cycles.items():
        names = "ppte_um", "single_contact_N_per_um", "double_contact_N_per_um"
        found |= {f"{pair} finite elements {name}": value for name, value in zip(names, FINITE_ELEMENTS[pair])}
        ppte = {model: jg.peak_to_peak(cycle.transmission_error) for model, cycle in models.items()}
        for model, cycle in models.items():
            values = float(ppte[model][0]), *stiffness(unmodified(cycle))
            found |= {f"{pair} {model} {name}": value for name, value in zip(names, values)}
            best = int(jnp.argmin(ppte[model]))
            found[f"{pair} {model} chosen_relief_of_rule"] = float(relative[best])
            found[f"{pair} {model} delivered_ppte_um"] = float(ppte["coupled"][best])
    return found


def main(fast=False) -> dict:
    return numbers(study(fast))


def draw(results):
    from jaxgear import plot

    for pair, models in results[1].items():
        bare = {name: unmodified(cycle) for name, cycle in models.items()}
        picture = plot.transmission_error(bare).figure
        plot.save(picture, f"results/what_does_coupling_buy_{pair.replace('/', '_')}.png")


if __name__ == "__main__":
    results = study(fast="--fast" in sys.argv)
    for name, value in numbers(results).items():
        print(f"{name:48} {value:8.3f}")
    draw(results)
