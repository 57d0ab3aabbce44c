"""Can a neural network learn the relief of a whole range of torques, trained through the loaded contact itself?

A small network maps the torque to amount and length of one tip relief on both gears. It never sees a designed relief:
its loss is the peak-to-peak transmission error (PPTE) of the mesh that it asks for, at random torques. The mesh is a
`jaxgear.ModifiedMesh` beside the network's layers in one `equinox` model, so that the optimizer trains the layers and
leaves the gears alone. Run it: `python examples/inside_a_network.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
import optax  # noqa: E402

import jaxgear as jg  # noqa: E402

TORQUES = (20.0, 80.0)  # N m
MOST_RELIEF, LENGTHS = 25.0, (2.0, 5.7)  # um, mm


class Designer(eqx.Module):
    """Network from the torque to the flanks, and the mesh that judges them."""

    layers: eqx.nn.MLP
    mesh: jg.ModifiedMesh

    def relief(self, torque) -> jg.TipRelief:
        """The relief that the network gives both gears for a torque [N m]."""
        low, high = TORQUES
        amount, length = jax.nn.sigmoid(self.layers(jnp.asarray([(torque - low) / (high - low)])))
        return jg.TipRelief(MOST_RELIEF * amount, LENGTHS[0] + (LENGTHS[1] - LENGTHS[0]) * length)

    def __call__(self, torque) -> jg.MeshCycle:
        """Mesh cycle of the relief that belongs to a torque [N m]."""
        relief = self.relief(torque)
        return eqx.tree_at(lambda m: (m.pinion, m.wheel), self.mesh, (relief, relief))(torque)


def loss(model, torques):
    """Mean over the torques of PPTE relative to the torque [um / (50 N m)]; soft extremes, which have slopes."""
    curves = jax.vmap(lambda torque: model(torque).transmission_error)(torques)
    return jnp.mean(jg.metrics.smooth_peak_to_peak(curves, 0.05) * 50.0 / torques)


def train(model, steps, batch):
    """The model after so many steps of Adam."""
    optimizer = optax.adam(optax.cosine_decay_schedule(0.02, steps))

    @eqx.filter_jit
    def step(model, state, key):
        torques = jax.random.uniform(key, (batch,), minval=TORQUES[0], maxval=TORQUES[1])
        slope = eqx.filter_grad(loss)(model, torques)
        updates, state = optimizer.update(slope, state)
        return eqx.apply_updates(model, updates), state

    state = optimizer.init(eqx.filter(model, eqx.is_inexact_array))
    for key in jax.random.split(jax.random.key(1), steps):
        model, state = step(model, state, key)
    return model


@eqx.filter_jit
def ppte(model, torques):
    """PPTE [um] at every torque, of the network's flanks."""
    return jax.vmap(lambda torque: jg.peak_to_peak(model(torque).transmission_error))(torques)


@eqx.filter_jit
def fixed_ppte(mesh, torques, relief):
    """PPTE [um] at every torque, of one relief."""
    return jax.vmap(
        lambda torque: jg.peak_to_peak(jg.solve(mesh, torque, pinion=relief, wheel=relief).transmission_error)
    )(torques)


def study(fast=False):
    """PPTE over the torque: unmodified, the rule's relief for the middle torque, and the network's."""
    pinion = jg.Gear(teeth=19, module=3.0, face_width=20.0, bore_diameter=24.0)
    wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0)
    pair = jg.GearPair(pinion, wheel)
    mesh = jg.prepare(pair, resolution=jg.Resolution(positions=16 if fast else 64, pairs=2))
    layers = eqx.nn.MLP(1, 2, width_size=8, depth=2, activation=jnp.tanh, key=jax.random.key(0))
    model = train(Designer(layers, jg.ModifiedMesh(mesh)), steps=150 if fast else 600, batch=8)
    torques = jnp.linspace(*TORQUES, 13)
    rule = jg.sizing.iso_relief(pair, 50.0)
    none = jg.TipRelief(0.0, rule.length)
    return {
        "torques": torques,
        "unmodified": fixed_ppte(mesh, torques, none),
        "rule": fixed_ppte(mesh, torques, rule),
        "network": ppte(model, torques),
        "amounts": jax.vmap(lambda torque: model.relief(torque).amount)(torques),
        "mesh_unchanged": all(
            np.array_equal(ours, theirs)
            for ours, theirs in zip(jax.tree.leaves(model.mesh.mesh), jax.tree.leaves(mesh))
        ),
    }


def numbers(found):
    """What the example answers with."""
    share = {name: found[name] / found["unmodified"] for name in ("rule", "network")}
    return {
        "mean_share_rule": float(jnp.mean(share["rule"])),
        "mean_share_network": float(jnp.mean(share["network"])),
        "worst_share_network": float(jnp.max(share["network"])),
        "amount_at_20_Nm_um": float(found["amounts"][0]),
        "amount_at_80_Nm_um": float(found["amounts"][-1]),
        "mesh_unchanged": float(found["mesh_unchanged"]),
    }


def main(fast=False) -> dict:
    return numbers(study(fast))


def draw(found):
    import matplotlib.pyplot as plt

    from jaxgear import plot
    from jaxgear.plot.figure import line_style

    figure, axis = plt.subplots(figsize=(4.7, 3.0), layout="constrained")
    for index, name in enumerate(("unmodified", "rule", "network")):
        label = "ISO 6336 rule for 50 N m" if name == "rule" else name
        axis.plot(found["torques"], found[name], label=label, **line_style(index))
    axis.set(xlabel="torque on the pinion [N m]", ylabel="peak-to-peak TE [µm]", ylim=(0.0, None))
    axis.legend(frameon=False)
    plot.save(figure, "results/inside_a_network.png")


if __name__ == "__main__":
    found = study(fast="--fast" in sys.argv)
    answer = numbers(found)
    print(f"PPTE from {TORQUES[0]:g} to {TORQUES[1]:g} N m, mean share of the unmodified pair:")
    print(f"  one relief by the ISO 6336 rule for 50 N m  {100 * answer['mean_share_rule']:5.1f} %")
    print(f"  the network's relief for every torque       {100 * answer['mean_share_network']:5.1f} %")
    print(f"  its amount grows from {answer['amount_at_20_Nm_um']:.1f} to {answer['amount_at_80_Nm_um']:.1f} um")
    draw(found)
