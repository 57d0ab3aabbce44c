"""Flanks that are thrown apart: how hard they meet again, and which orbits that finds."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from jaxgear.dynamics import AbstractMeshForce, Dynamics, Oscillator, speed_sweep
from jaxgear.numerics import number

OMEGAS = np.linspace(1.62, 1.8, 4)
STEPS = 128
USUAL = float(Dynamics([1.0]).kick)


class Wave(AbstractMeshForce):
    """Stiffness 1 + variation cos(2 pi (phase - stiffest)), zero out of contact."""

    jumps: ClassVar[bool] = False

    variation: Float[Array, ""] = number("")
    stiffest: Float[Array, ""] = number("base pitches")

    def at(self, phase):
        return 1 + self.variation * jnp.cos(2 * jnp.pi * (phase - self.stiffest))

    def force(self, place, approach):
        return place * jnp.maximum(approach, 0.0)


def swept(variation, stiffest, zeta, kick, cycles=500):
    """Every speed with a kick of its own."""
    moving = Oscillator(
        Wave(variation, stiffest), mass=[1.0], direction=[1.0], load=[1.0], mesh_damping=2 * zeta, newton=1.0
    )
    speeds = OMEGAS / (2 * np.pi)
    return speed_sweep(moving, speeds, kick=kick, carry=False, steps=STEPS, most_cycles=cycles)


@pytest.mark.parametrize("factor", [1.4, 2.0, 3.0, 4.5])
def test_flanks_of_constant_stiffness_meet_with_the_given_dynamic_factor(factor):
    """Without damping, by the energy of the gap."""
    found = swept(0.0, 0.0, 0.0, factor, cycles=1)
    np.testing.assert_allclose(found.dynamic_factor, factor, rtol=2e-3)


@pytest.mark.parametrize(("variation", "zeta"), [(0.343, 0.05), (0.343, 0.07), (0.22, 0.045), (0.16, 0.03)])
def test_a_kick_of_usual_size_finds_two_cycles_wherever_the_cycle_begins(variation, zeta):
    """Which the same oscillators do not come to from rest, until their one cycle is unstable."""
    factors = []
    for stiffest in (0.0, 0.2, 0.4, 0.6, 0.8):
        found = swept(variation, stiffest, zeta, USUAL)
        assert (np.asarray(found.period) == 2).all()
        factors.append(np.asarray(found.dynamic_factor))
    np.testing.assert_allclose(factors, np.broadcast_to(factors[0], np.shape(factors)), rtol=1e-3)
    assert np.min(factors) > 2.5
    assert (np.asarray(swept(variation, 0.0, zeta, None).period) == 1).all()
