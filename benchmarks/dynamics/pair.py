"""The gear pair of the sections on gears: 50/50 teeth, contact ratio 1.37, 200 N m, which loses contact unmodified."""

from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import jaxgear as jg
from jaxgear.dynamics import Dynamics, Oscillator

TORQUE = 200.0  # N m
DAMPING_RATIO = 0.045
SPEEDS = np.linspace(500.0, 5000.0, 91)  # mesh frequency [Hz]
LENGTH = 3.2  # of the tip reliefs [mm]
POSITIONS = 128  # of the force map, as `Dynamics` has them
QUICK_POSITIONS = 32
_INERTIA = 7.80e-3  # kg m2, a solid disc
_TIP, _BORE, _WIDTH = 154.5709, 40.0, 20.0  # mm
_ALLOWANCE = -72.4  # of either gear [um]
_SIDE_BY_SIDE = 4  # designs whose contacts are analysed at once


@cache
def mesh() -> jg.Mesh:
    gear = jg.Gear(
        50, 3.0, face_width=_WIDTH, tip_diameter=_TIP, bore_diameter=_BORE, tooth_thickness_allowance=_ALLOWANCE
    )
    return jg.prepare(jg.GearPair(gear, gear), resolution=jg.Resolution(positions=16, pairs=4))


def oscillator(amount=0.0, length=LENGTH, *, torque=TORQUE, damping_ratio=DAMPING_RATIO, positions=POSITIONS):
    """With a linear tip relief on both gears [um], [mm], on its force map."""
    relief = jg.TipRelief(amount, length)
    settings = Dynamics(
        mesh_frequencies=SPEEDS,
        damping_ratio=damping_ratio,
        pinion_inertia=_INERTIA,
        wheel_inertia=_INERTIA,
        positions=positions,
    )
    return settings.oscillator(mesh(), torque, pinion=relief, wheel=relief)


@eqx.filter_jit
def relieved(amounts, lengths, positions: int = POSITIONS) -> Oscillator:
    """Pairs with tip reliefs [um], [mm], one for each of two arrays: one axis in front of every array."""
    return jax.lax.map(
        lambda row: oscillator(*row, positions=positions),
        (jnp.asarray(amounts), jnp.asarray(lengths)),
        batch_size=_SIDE_BY_SIDE,
    )


def random_reliefs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Amounts [um] and lengths [mm] of so many designs."""
    random = np.random.default_rng(0)
    return random.uniform(0.0, 10.0, count), random.uniform(1.0, LENGTH, count)
