"""How much quieter is a helix angle of 15 degrees than spur gears of the same size and load, and what does relief do?

Two pairs of 19/48 teeth on one centre distance, 20 mm wide, under 150 N m: a helical one of normal module 3 mm, and the
spur pair of its transverse module. A map of tip reliefs, alike on both gears, is evaluated for each of them in one
vmapped call; so are helix angles from 0 to 25 degrees, without and with relief. Run it:
`python examples/how_quiet_is_helical.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402

import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import jaxgear as jg  # noqa: E402

TORQUE, ANGLE, MODULE, WIDTH = 150.0, 15.0, 3.0, 20.0  # N m, deg, mm, mm
BORES = 20.0, 100.0  # mm
SLICES = 33  # thirty for every base pitch of overlap, which is nearly one at 25 degrees
LIGHT = 8.0, 0.4  # a relief for lower loads: um, share of the longest one
MOST, LONGEST = 40.0, 6.0  # um, mm of roll length


def gear_pair(angle=None):
    """The pair of a helix angle [deg], on the reference diameters of the pair of 15 degrees; None for spur gears."""
    cosine = 1.0 if angle is None else jnp.cos(jnp.deg2rad(angle))
    module = MODULE * cosine / np.cos(np.deg2rad(ANGLE))
    hands = (None, None) if angle is None else (angle, -angle)
    return jg.GearPair(
        *(
            jg.Gear(teeth, module, face_width=WIDTH, helix_angle=hand, bore_diameter=bore)
            for teeth, hand, bore in zip((19, 48), hands, BORES)
        )
    )


def sizes(fast, slices):
    """Array sizes; four pairs hold the contact lines of 25 degrees."""
    return jg.Resolution(positions=16 if fast else 64, slices=slices, pairs=4)


def cycle(mesh, design):
    """Mesh cycle with one relief on both gears: amount [um], roll length from the tip [mm]."""
    relief = jg.TipRelief(design[0], design[1])
    return jg.solve(mesh, TORQUE, pinion=relief, wheel=relief)


def ppte(mesh, design):
    """Peak-to-peak transmission error [um]; NaN where a solution has not converged."""
    found = cycle(mesh, design)
    return jnp.where(found.converged.all(), jg.peak_to_peak(found.transmission_error), jnp.nan)


@eqx.filter_jit
def mapped(mesh, designs):
    return jax.vmap(ppte, (None, 0))(mesh, designs)


@eqx.filter_jit
def over_angles(angles, designs, resolution):
    """PPTE [um] of every design at every helix angle, and the overlap ratio there."""

    def one(angle):
        mesh = jg.prepare(gear_pair(angle), resolution=resolution)
        return jax.vmap(ppte, (None, 0))(mesh, designs), mesh.pair.overlap_ratio

    return jax.lax.map(one, angles)


def study(fast=False):
    """Both maps, the transmission errors of their best designs, and PPTE over the overlap ratio."""
    amounts = jnp.linspace(0.0, MOST, 6 if fast else 21)
    lengths = jnp.linspace(1.0, LONGEST, 4 if fast else 11)
    grid = jnp.stack(jnp.meshgrid(amounts, lengths, indexing="ij"), axis=-1)
    light = jnp.asarray([LIGHT[0], LIGHT[1] * LONGEST])
    found = {"amounts": amounts, "lengths": lengths, "light": light, "meshes": {}, "ppte": {}, "light_ppte": {}}
    for name, angle, slices in (("spur", None, 1), ("helical", ANGLE, 11 if fast else SLICES)):
        mesh = jg.prepare(gear_pair(angle), resolution=sizes(fast, slices))
        values = mapped(mesh, jnp.concatenate([grid.reshape(-1, 2), light[None]]))
        found["meshes"][name], found["ppte"][name] = mesh, values[:-1].reshape(grid.shape[:2])
        found["light_ppte"][name] = values[-1]
    angles = jnp.linspace(0.0, 25.0, 4 if fast else 26)
    best = _best(found, "helical")
    designs = jnp.stack([jnp.asarray([0.0, 1.0]), light, best])
    found["angles"], found["designs"] = angles, designs
    found["over_angles"], found["overlap"] = over_angles(angles, designs, sizes(fast, 11 if fast else SLICES))
    return found


def _best(found, name):
    i, j = np.unravel_index(np.argmin(found["ppte"][name]), found["ppte"][name].shape)
    return jnp.stack([found["amounts"][i], found["lengths"][j]])


def numbers(found):
    result = {}
    for name, values in found["ppte"].items():
        best = _best(found, name)
        result |= {
            f"{name}_unmodified_ppte_um": float(values[0, 0]),
            f"{name}_light_relief_ppte_um": float(found["light_ppte"][name]),
            f"{name}_best_amount_um": float(best[0]),
            f"{name}_best_length_mm": float(best[1]),
            f"{name}_best_ppte_um": float(values.min()),
        }
    return result | {"overlap_ratio": float(found["meshes"]["helical"].pair.overlap_ratio)}


def main(fast=False) -> dict:
    return numbers(study(fast))


def draw(found):
    from jaxgear import plot

    cycles = {}
    for name, mesh in found["meshes"].items():
        best = _best(found, name)
        for kind, design in (("unmodified", jnp.asarray([0.0, 1.0])), ("best relief", best)):
            cycles[f"{name}, {kind}"] = cycle(mesh, design)
    plot.save(plot.transmission_error(cycles).figure, "results/how_quiet_is_helical_te.png")
    plot.save(
        plot.contact_pattern(cycles["helical, best relief"])[0].figure, "results/how_quiet_is_helical_pattern.png"
    )
    names = "unmodified", f"relief of {LIGHT[0]:g} µm", "best relief of 15 degrees"
    ax = plot.ppte_over_overlap(
        found["overlap"], dict(zip(names, found["over_angles"].T)), design=numbers(found)["overlap_ratio"]
    )
    plot.save(ax.figure, "results/how_quiet_is_helical_overlap.png")


if __name__ == "__main__":
    results = study(fast="--fast" in sys.argv)
    for name, value in numbers(results).items():
        print(f"{name:34} {value:8.3f}")
    draw(results)
