"""A gear pair whose best reliefs are known: all tooth pairs have one constant stiffness, without corner contact.

Where the gaps h1 and h2 of two tooth pairs are relative to the deflection of one pair under the load, the transmission
error is min((1 + h1 + h2) / 2, 1 + h1, 1 + h2), and 1 in single contact.
"""

import jax.numpy as jnp
import numpy as np
from catalogue import constant_stiffness_mesh, gear_pair

import jaxgear as jg

STIFFNESS, DELTA0 = 300.0, 10.0  # stiffness of a pair [N/um], its deflection [um]
DOUBLE = 12  # steps from position to position in double contact, both ends of which are positions
BOX = {"pinion": (0.0, 40.0), "wheel": (0.0, 40.0)}  # amounts [um]


POSED = "torque", "objective", "measure", "constraints", "manufactured"  # arguments of a problem


class Known:
    """The mesh, the torque [N m] that deflects a single pair by DELTA0, and the length of double contact [mm]."""

    def __init__(self):
        resolution = jg.Resolution(positions=32, pairs=2, contact_nodes=1)
        double = DOUBLE / resolution.positions
        gear = gear_pair((50, 50)).pinion
        rho = gear.base_radius * jnp.tan(jnp.deg2rad(20.0)) + 0.5 * (1 + double) * gear.base_pitch
        tip = float(2 * jnp.sqrt(gear.base_radius**2 + rho**2))
        self.mesh = constant_stiffness_mesh(gear_pair((50, 50), tips=(tip, tip)), STIFFNESS, resolution)
        self.torque = 1e-3 * STIFFNESS * DELTA0 * float(gear.base_radius)
        self.length = float(gear.base_pitch) * double

    def parabolas(self, x):
        """A parabolic relief over double contact on either gear."""
        curve = jg.Quadratic(0.0, 0.0, 1.0)
        return jg.TipRelief(x["pinion"], self.length, curve), jg.TipRelief(x["wheel"], self.length, curve)

    def quadratics(self, x):
        """The same quadratic relief on both."""
        relief = jg.TipRelief(DELTA0, self.length, jg.Quadratic(0.0, x["b1"], x["b2"]))
        return relief, relief

    def lines(self, x):
        """The same linear relief on both."""
        relief = jg.TipRelief(x["amount"], self.length, jg.Linear())
        return relief, relief

    def pareto(self, design, box, **options):
        """`jaxgear.pareto`."""
        # the front is known at the positions of the mesh
        return jg.optimize.pareto(*self.posed(design, box, options), **{"positions": None} | options)

    def minimize(self, design, box, **options):
        """`jaxgear.minimize`, of eight start points unless a method is given."""
        # the optimum is known at the positions of the mesh
        options = {"method": jg.optimize.SLP(starts=8), "positions": None} | options
        return jg.minimize(*self.posed(design, box, options), **options)

    def posed(self, design, box, options):
        """The problem of those options that belong to one, which are taken out."""
        own = {name: options.pop(name) for name in POSED if name in options}
        return (jg.Problem(self.mesh, own.pop("torque", self.torque), design, box, **own),)


def depth():
    """Positions over double contact, from 0 to 1."""
    return np.arange(DOUBLE + 1) / DOUBLE


def ppte_of(pinion, wheel):
    """PPTE [um] of reliefs [um] over `depth`; the last axis is that of the positions."""
    h1, h2 = pinion / DELTA0, wheel[..., ::-1] / DELTA0
    error = np.minimum(np.minimum((1 + h1 + h2) / 2, 1 + h1), 1 + h2)
    return DELTA0 * (np.maximum(error.max(axis=-1), 1.0) - np.minimum(error.min(axis=-1), 1.0))


def ppte_of_parabolas(pinion, wheel):
    """PPTE [um] of the amounts of `Known.parabolas`, of any shape."""
    pinion, wheel = np.broadcast_arrays(pinion, wheel)
    return ppte_of(pinion[..., None] * depth() ** 2, wheel[..., None] * depth() ** 2)


def grid(count=801):
    """Amounts of pinion and wheel all over `BOX`."""
    amounts = np.linspace(0.0, 40.0, count)
    return np.meshgrid(amounts, amounts)
