"""Flanks that are thrown apart: how hard they meet again, and which orbits that finds."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair
from jaxtyping import Array, Float

import jaxgear as jg
from jaxgear.dynamics import KICKED, AbstractMeshForce, Dynamics, Oscillator, natural_frequencies, speed_sweep
from jaxgear.dynamics.settings import KICKS
from jaxgear.numerics import number

OMEGAS = np.linspace(1.62, 1.8, 4)
STEPS = 128
NONE = (1.0,) * len(KICKS)  # in the same program


class Wave(AbstractMeshForce):
    """Stiffness 1 + variation cos(2 pi (phase - stiffest)), zero out of contact."""

    jumps: ClassVar[bool] = False

    variation: Float[Array, ""] = number("")
    stiffest: Float[Array, ""] = number("base pitches")

    def at(self, phase):
        return 1 + self.variation * jnp.cos(2 * jnp.pi * (phase - self.stiffest))

    def force(self, place, dte):
        return place * jnp.maximum(dte, 0.0)


def swept(variation, stiffest, zeta, kicks, cycles=500):
    """Every speed with kicks of its own."""
    moving = Oscillator(
        Wave(variation, stiffest), mass=[1.0], direction=[1.0], load=[1.0], mesh_damping=2 * zeta, newton=1.0
    )
    speeds = OMEGAS / (2 * np.pi)
    options = {"kick": kicks} if isinstance(kicks, float) else {"kicks": kicks}
    return speed_sweep(moving, speeds, carry=False, steps=STEPS, most_cycles=cycles, **options)


@pytest.mark.parametrize("factor", [1.4, 2.0, 3.0, 4.5])
def test_flanks_of_constant_stiffness_meet_with_the_given_dynamic_factor(factor):
    """Without damping, by the energy of the gap."""
    found = swept(0.0, 0.0, 0.0, factor, cycles=1)
    np.testing.assert_allclose(found.dynamic_factor, factor, rtol=2e-3)


@pytest.mark.parametrize(("variation", "zeta"), [(0.343, 0.05), (0.343, 0.07), (0.22, 0.045), (0.16, 0.03)])
def test_kicks_of_usual_sizes_find_two_cycles_wherever_the_cycle_begins(variation, zeta):
    """Which the same oscillators do not come to from rest, until their one cycle is unstable."""
    factors = []
    for stiffest in (0.0, 0.2, 0.4, 0.6, 0.8):
        found = swept(variation, stiffest, zeta, KICKS)
        assert (np.asarray(found.period) == 2).all()
        factors.append(np.asarray(found.dynamic_factor))
    np.testing.assert_allclose(factors, np.broadcast_to(factors[0], np.shape(factors)), rtol=1e-3)
    assert np.min(factors) > 2.5
    assert (np.asarray(swept(variation, 0.0, zeta, NONE).period) == 1).all()


DISCS = {"pinion_inertia": 7.8e-3, "wheel_inertia": 7.8e-3}
STRAIGHT = {"face_width": 20.0, "tips": (154.5709, 154.5709), "bores": (71.25, 71.25)}
PAIR_50_50 = gear_pair((50, 50), **STRAIGHT, tooth_thickness_allowance=-72.0)
PAIR_23_37 = gear_pair((23, 37), 2.5, face_width=20.0, bores=(25.0, 25.0), tooth_thickness_allowance=-50.0)


def on_map(pair, relief, torque, speeds, damping_ratio, missed_by=3.1, **inertias):
    """With the usual kicks, which find what a single one misses, and the natural frequency."""
    mesh = jg.prepare(
        pair, compliance=jg.default_compliance(plane="stress"), resolution=jg.Resolution(positions=64, pairs=2)
    )
    settings = Dynamics(speeds, damping_ratio=damping_ratio, **inertias)
    moving = settings.oscillator(mesh, torque, pinion=relief, wheel=relief)
    one_size = speed_sweep(moving, speeds, direction="down", kick=missed_by, steps=256)
    assert (np.asarray(one_size.period) == 1).all()
    return settings.run(moving, KICKED, steps=256), float(natural_frequencies(moving).mesh)


@pytest.mark.slow
def test_two_cycles_that_one_size_of_kick_misses():
    """On maps of relieved and unmodified gears."""
    # the orbit of two cycles ends at 1.7 times the natural frequency
    relief = jg.TipRelief(6.0, 3.27, jg.Parabolic())
    found, _ = on_map(PAIR_50_50, relief, 200.0, [5300.0, 5606.0, 5803.0], 0.0425, **DISCS)
    assert [int(period) for period in found.period] == [1, 2, 2]
    assert float(found.dynamic_factor[1]) == pytest.approx(3.0, abs=0.01)
    # at 1.35 to 1.44 times of it
    none = jg.TipRelief(0.0, 3.27, jg.Parabolic())
    found, natural = on_map(PAIR_50_50, none, 200.0, [4377.0, 4485.0, 4675.0], 0.0425, missed_by=2.6, **DISCS)
    assert natural == pytest.approx(3250.0, rel=0.002)
    assert (np.asarray(found.period) == 2).all() and float(found.dynamic_factor.min()) > 4.2
    relief = jg.TipRelief(7.5, 3.5, jg.Parabolic())
    found, natural = on_map(PAIR_23_37, relief, 50.0, [11_800.0, 12_000.0, 12_250.0], 0.04)
    assert (np.asarray(found.period) == 2).all()
    np.testing.assert_allclose(found.dynamic_factor, 2.7, atol=0.15)
