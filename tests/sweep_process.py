"""One process of a sweep: python sweep_process.py FOLDER DEVICES [COORDINATOR PROCESSES PROCESS]."""

import sys

import jax

FOLDER, DEVICES, *OTHERS = sys.argv[1:]

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_num_cpu_devices", int(DEVICES))
if OTHERS:
    jax.distributed.initialize(OTHERS[0], int(OTHERS[1]), int(OTHERS[2]))

import jaxgear as jg  # noqa: E402

VARIANTS, PART_ROWS = 4000, 100


def design(x):
    """A tip relief on either gear."""
    return jg.TipRelief(x["pinion"], 4.0), jg.TipRelief(x["wheel"], 4.0)


seen: list[tuple] = []
gears = (jg.Gear(teeth=teeth, module=3.0, face_width=18.0) for teeth in (19, 48))
sizes = jg.Resolution(positions=8, contact_nodes=1, pairs=2, newton_steps=6)
jg.sweep(
    jg.prepare(jg.GearPair(*gears), resolution=sizes),
    50.0,
    design,
    jg.LatinHypercube({"pinion": (0.0, 20.0), "wheel": (0.0, 20.0)}, VARIANTS, seed=2),
    results=("ppte", "mean_te"),
    output=FOLDER,
    part_rows=PART_ROWS,
    callback=lambda *progress: seen.append(progress),
)
share = VARIANTS // (int(OTHERS[1]) if OTHERS else 1)
assert seen[-1] == (share, share, None), seen
