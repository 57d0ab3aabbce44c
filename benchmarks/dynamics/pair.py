"""The gear pair of the sections on gears: 50/50 teeth, contact ratio 1.37, 200 N m, which loses contact unmodified.

And one that needs no contact analysis and so no compilation of it, for what has to be quick.
"""

from functools import cache

import jax.numpy as jnp
import numpy as np

import jaxgear as jg
from jaxgear.contact.status import Status
from jaxgear.dynamics import Dynamics, ForceMap, Oscillator, torsional

TORQUE = 200.0  # N m
DAMPING_RATIO = 0.045
SPEEDS = np.linspace(500.0, 5000.0, 91)  # mesh frequency [Hz]
LENGTH = 3.2  # of the tip reliefs [mm]
POSITIONS = 128  # of the force map, as `Dynamics` has them
QUICK_SPEEDS = SPEEDS[5::14]
_INERTIA = 7.80e-3  # kg m2, a solid disc
_TIP, _BORE, _WIDTH = 154.5709, 40.0, 20.0  # mm
_ALLOWANCE = -72.4  # of either gear [um]
# of the imagined pair: mean stiffness and its amplitude [N/um], growth over the deflection [1/um], clearance [um]
_STIFFNESS, _VARIATION, _STIFFENING, _CLEARANCE = 230.0, 45.0, 0.004, 130.0
_REACH, _LEVELS = 60.0, 48


@cache
def gears() -> jg.GearPair:
    gear = jg.Gear(
        50, 3.0, face_width=_WIDTH, tip_diameter=_TIP, bore_diameter=_BORE, tooth_thickness_allowance=_ALLOWANCE
    )
    return jg.GearPair(gear, gear)


@cache
def mesh() -> jg.Mesh:
    return jg.prepare(gears(), resolution=jg.Resolution(positions=16, pairs=4))


def imagined(torque=TORQUE, positions=POSITIONS) -> Oscillator:
    """A smooth stiffness that varies by as much as that of the pair, and grows with the load."""
    share = np.linspace(0.0, 1.0, _LEVELS)
    deflection = _REACH * share * (0.3 + 0.7 * share)  # at the levels of the map
    turn = 2 * np.pi * np.arange(positions) / positions
    stiffness = (_STIFFNESS + _VARIATION * np.cos(turn))[:, None]
    force = stiffness * deflection * (1 + _STIFFENING * deflection)
    slope = stiffness * (1 + 2 * _STIFFENING * deflection)
    touching = np.stack([np.sin(turn), _CLEARANCE + np.sin(turn)])
    tables = 0.0, touching, _REACH, np.stack([force, force]), np.stack([slope, slope])
    made = ForceMap(*(jnp.asarray(part) for part in tables), jnp.asarray(Status.CONVERGED.value, jnp.int8))
    return torsional(made, pair=gears(), torque=torque, inertias=(_INERTIA, _INERTIA), damping_ratio=DAMPING_RATIO)


def one_of(*, quick: bool, torque=TORQUE) -> Oscillator:
    """The unmodified pair, or the imagined one."""
    return imagined(torque) if quick else oscillator(mesh(), torque=torque)


def oscillator(of: jg.Mesh, amount=0.0, length=LENGTH, *, torque=TORQUE, damping_ratio=DAMPING_RATIO) -> Oscillator:
    """With a linear tip relief on both gears [um], [mm], on its force map."""
    relief = jg.TipRelief(amount, length)
    settings = Dynamics(
        mesh_frequencies=SPEEDS,
        damping_ratio=damping_ratio,
        pinion_inertia=_INERTIA,
        wheel_inertia=_INERTIA,
        positions=POSITIONS,
    )
    return settings.oscillator(of, torque, pinion=relief, wheel=relief)


def random_reliefs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Amounts [um] and lengths [mm] of so many designs."""
    random = np.random.default_rng(0)
    return random.uniform(0.0, 10.0, count), random.uniform(1.0, LENGTH, count)
