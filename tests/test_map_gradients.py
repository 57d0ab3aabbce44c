"""Derivatives through the whole chain, from flanks over the map of the mesh force to orbits."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg
from jaxgear.dynamics import find_orbit, mesh_force, settle, torsional

# compiles the derivatives of the contact analysis, once for all tests
pytestmark = pytest.mark.slow

POSITIONS, LEVELS, STEPS = 32, 16, 64
NAMES = ("amount", "length", "torque", "inertia", "damping ratio")
POINT = np.array([1.0, 3.2, 200.0, 7.8e-3, 0.045])  # um, mm, N m, kg m2
STEP = 1e-4  # of central differences, relative


@pytest.fixture(scope="module")
def mesh():
    gear = jg.Gear(
        teeth=50,
        module=3.0,
        face_width=20.0,
        tip_diameter=154.5709,
        bore_diameter=40.0,
        tooth_thickness_allowance=-60.0,
    )
    return jg.prepare(jg.GearPair(gear, gear), resolution=jg.Resolution(positions=POSITIONS, pairs=3))


@pytest.fixture(scope="module")
def oscillator(mesh):
    """The oscillator of numbers in the order of `NAMES`."""

    def made(numbers):
        amount, length, torque, inertia, ratio = numbers
        relief = jg.TipRelief(amount, length)
        force = mesh_force(mesh, torque=torque, pinion=relief, wheel=relief, positions=POSITIONS, levels=LEVELS)
        return torsional(force, pair=mesh.pair, torque=torque, damping_ratio=ratio, inertias=(inertia, inertia))

    return made


@pytest.fixture(scope="module")
def cases(oscillator):
    """At `POINT`, and for every number: how the oscillator changes with it, and those of a little more and less."""
    point = jnp.asarray(POINT)
    changes = [jax.jvp(oscillator, (point,), (along,))[1] for along in jnp.eye(len(POINT))]
    beside = [[oscillator(point + side * STEP * point * along) for side in (1, -1)] for along in jnp.eye(len(POINT))]
    return oscillator(point), changes, beside


@eqx.filter_jit
def numbers_of(oscillator, frequency, start):
    orbit = find_orbit(oscillator, frequency, start, steps=STEPS)
    return jnp.stack([orbit.dynamic_factor, orbit.dte_rms]), orbit.contact_loss_share, orbit.converged & orbit.stable


@eqx.filter_jit
def slopes_of(oscillator, change, frequency, start):
    return jax.jvp(lambda oscillator: numbers_of(oscillator, frequency, start)[0], (oscillator,), (change,))[1]


@pytest.mark.parametrize("frequency, apart", [(1800.0, False), (2600.0, False), (2900.0, True)])
def test_dynamic_factor_and_rms(cases, frequency, apart):
    """Below the resonance, on its flank, and where contact is lost."""
    moving, changes, beside = cases
    start = settle(moving, frequency, ([12.0], [0.0]), cycles=150, steps=STEPS)
    _, contact_loss_share, fine = numbers_of(moving, frequency, start)
    assert bool(fine) and (float(contact_loss_share) > 0.1) == apart
    for name, value, change, (above, below) in zip(NAMES, POINT, changes, beside):
        found = slopes_of(moving, change, frequency, start)
        ends = [numbers_of(each, frequency, start)[0] for each in (above, below)]
        difference = (ends[0] - ends[1]) / (2 * STEP * value)
        np.testing.assert_allclose(found, difference, rtol=1e-4, err_msg=name)
