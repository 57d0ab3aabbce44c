"""Can a contact analysis be shipped without jaxgear? Exported to StableHLO, saved, and called again.

The function of a design (amount and length of one tip relief) and the torque is lowered once with `jax.export`, for any
number of designs at a time, and written to a file that JAX alone can load, on another machine or from another language
that reads StableHLO. Needs `pip install '.[export]'` (flatbuffers, the format of the file). Run it: `python
examples/export_and_reload.py`.
"""

import jax

jax.config.update("jax_enable_x64", True)

import sys  # noqa: E402
import tempfile  # noqa: E402
from pathlib import Path  # noqa: E402

import equinox as eqx  # noqa: E402
import jax.numpy as jnp  # noqa: E402
from jax import export  # noqa: E402

import jaxgear as jg  # noqa: E402


def main(fast=False) -> dict:
    pinion = jg.Gear(teeth=19, module=3.0, face_width=20.0, bore_diameter=24.0)
    wheel = jg.Gear(teeth=48, module=3.0, face_width=18.0, bore_diameter=70.0)
    resolution = jg.Resolution(positions=16 if fast else 64, pairs=2)
    relief = jg.TipRelief(0.0, 1.0)
    model = jg.ModifiedMesh(jg.prepare(jg.GearPair(pinion, wheel), resolution=resolution), pinion=relief, wheel=relief)

    def ppte(amount, length, torque):
        """PPTE [um] of one design."""
        modified = jg.TipRelief(amount, length)
        return jg.peak_to_peak(eqx.tree_at(lambda m: (m.pinion, m.wheel), model, (modified, modified))(torque)
                               .transmission_error)  # fmt: skip

    many = jax.jit(jax.vmap(ppte, (0, 0, None)))
    designs = jax.ShapeDtypeStruct(export.symbolic_shape("designs"), jnp.float64)
    exported = export.export(many)(designs, designs, jax.ShapeDtypeStruct((), jnp.float64))

    amounts, lengths = jnp.linspace(0.0, 10.0, 5), jnp.full(5, 4.0)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ppte.stablehlo"
        file.write_bytes(exported.serialize())
        size = file.stat().st_size
        reloaded = export.deserialize(file.read_bytes())
    again = jax.jit(reloaded.call)(amounts, lengths, 50.0)
    return {
        "designs": float(len(again)),
        "file_kB": size / 1e3,
        "unmodified_ppte_um": float(again[0]),
        "least_ppte_um": float(jnp.min(again)),
        "largest_difference_um": float(jnp.max(jnp.abs(again - many(amounts, lengths, 50.0)))),
    }


if __name__ == "__main__":
    found = main(fast="--fast" in sys.argv)
    print(f"A file of {found['file_kB']:.0f} kB evaluates any number of designs, here {found['designs']:.0f}:")
    print(f"  PPTE {found['unmodified_ppte_um']:.3f} um without relief, {found['least_ppte_um']:.3f} um at best")
    print(f"  largest difference from the library {found['largest_difference_um']:.1e} um")
