"""Which curve should a tip relief have?

Compares power-law reliefs d^n, from linear (n = 1) over Walker's 1.5 to cubic, on a 19/48 pair at 50 N m: first all
with the amount and length of the ISO 6336 rule, then each with the amount and length that suit it best.
Run it: `python examples/which_curve.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402

import jaxgear as jg  # noqa: E402

TORQUE = 50.0  # N m
EXPONENTS = {"linear": 1.0, "walker": 1.5, "quadratic": 2.0, "cubic": 3.0}


def gear_pair():
    pinion = jg.Gear(teeth=19, module=3.0, face_width=20.0, bore_diameter=24.0)
    wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0)
    return jg.GearPair(pinion, wheel)


def relief(design):
    """Tip relief of a design (exponent, amount [um], length [mm])."""
    return jg.TipRelief(design[1], design[2], jg.Power(design[0]))


@eqx.filter_jit
def transmission_errors(mesh, designs):
    """Curves of shape (designs, positions) [um], the same relief on both gears."""

    def curve(design):
        return jg.solve(mesh, TORQUE, pinion=relief(design), wheel=relief(design)).transmission_error

    return jax.vmap(curve)(designs)


def study(fast=False):
    """The mesh and, by curve, the designs and their PPTE [um]; the first of each is the rule's."""
    pair, resolution = gear_pair(), jg.Resolution(positions=32 if fast else 64)
    mesh = eqx.filter_jit(jg.prepare)(pair, resolution=resolution)
    rule = jg.iso_relief(pair, TORQUE)
    # the rule's length covers double contact; steep curves remove little at their start and may reach further down
    amounts = jnp.linspace(4.0, 20.0, 33 if fast else 65)
    lengths = jnp.linspace(0.4, 2.4, 21 if fast else 41) * rule.length
    grid = jnp.stack(jnp.meshgrid(amounts, lengths, indexing="ij"), axis=-1).reshape(-1, 2)
    sizes = jnp.concatenate([jnp.stack([rule.amount, rule.length])[None], grid])
    curves = {}
    for name, exponent in EXPONENTS.items():
        designs = jnp.concatenate([jnp.full((sizes.shape[0], 1), exponent), sizes], axis=1)
        curves[name] = designs, jg.peak_to_peak(transmission_errors(mesh, designs))
    return mesh, curves


def numbers(results):
    found = {}
    for name, (designs, ppte) in results[1].items():
        best = int(jnp.argmin(ppte))
        found[f"{name}_rule_ppte_um"] = float(ppte[0])
        found[f"{name}_best_ppte_um"] = float(ppte[best])
        found[f"{name}_best_amount_um"] = float(designs[best, 1])
        found[f"{name}_best_length_mm"] = float(designs[best, 2])
    return found


def main(fast=False) -> dict:
    return numbers(study(fast))


def draw(results):
    from jaxgear import plot

    mesh, curves = results
    solve = eqx.filter_jit(lambda mesh, flank: jg.solve(mesh, TORQUE, pinion=flank, wheel=flank))
    best = {name: relief(designs[jnp.argmin(ppte)]) for name, (designs, ppte) in curves.items()}
    panels = plot.k_chart(mesh, {name: (flank, flank) for name, flank in best.items()})
    plot.save(panels[0].figure, "results/which_curve_k_chart.png")
    cycles = {name: solve(mesh, flank) for name, flank in best.items()}
    plot.save(plot.transmission_error(cycles).figure, "results/which_curve_te.png")


if __name__ == "__main__":
    results = study(fast="--fast" in sys.argv)
    for name, value in numbers(results).items():
        print(f"{name:28} {value:8.3f}")
    draw(results)
