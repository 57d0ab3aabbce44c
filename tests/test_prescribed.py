"""Contact at a prescribed transmission error."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import SLIDING, gear_pair

import jaxgear as jg
from jaxgear.contact import removed_material
from jaxgear.contact.prescribed import solve_at_material

TORQUE = 50.0


@pytest.fixture(scope="module")
def mesh():
    """Of contacts that slide: a prescribed error finds them where the cycle does."""
    return jg.prepare(gear_pair(), resolution=SLIDING)


@pytest.fixture(scope="module")
def cycle(mesh):
    return jg.solve(mesh, TORQUE, pinion=jg.TipRelief(6.9, 3.4))


@pytest.fixture(scope="module")
def error_of_teeth(mesh, cycle):
    return cycle.transmission_error - mesh.hub * cycle.force / mesh.pair.face_width


def contact(mesh, error):
    return jg.solve_at(mesh, error, torque=TORQUE, pinion=jg.TipRelief(6.9, 3.4))


def test_error_of_a_torque_takes_its_force(mesh, cycle, error_of_teeth):
    """There and back: the loads of the cycle, at every position."""
    found = contact(mesh, error_of_teeth)
    assert np.abs(cycle.shift).max() > 0.01
    assert bool(found.converged.all())
    np.testing.assert_allclose(found.force, float(cycle.force), rtol=1e-9)
    np.testing.assert_allclose(found.pair_force, cycle.pair_force, rtol=1e-9, atol=1e-7)


def test_pairs_share_the_force_at_the_approach_of_teeth_and_bodies_together(mesh, cycle):
    """The error of the cycle itself, with the wind-up of the bodies as a compliance that couples the pairs."""
    removed = removed_material(mesh, TORQUE, pinion=jg.TipRelief(6.9, 3.4))
    found = solve_at_material(mesh, cycle.transmission_error, removed, mesh.hub / mesh.pair.face_width)
    np.testing.assert_allclose(found.pair_force, cycle.pair_force, rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(np.sum(found.pair_force, axis=0), found.force, rtol=1e-12)
    np.testing.assert_allclose(found.tangent_stiffness, cycle.tangent_stiffness, rtol=1e-9)
    assert np.any((found.pair_force > 0).sum(axis=0) > 1)


@pytest.mark.slow
def test_slope_of_the_force_is_the_tangent_stiffness(mesh, cycle, error_of_teeth):
    """That of the teeth; in series with the bodies it is the cycle's."""
    slope = jax.jit(jax.grad(lambda error: jnp.sum(contact(mesh, error).force)))(error_of_teeth)
    np.testing.assert_allclose(slope, contact(mesh, error_of_teeth).tangent_stiffness, rtol=1e-9)
    bodies = mesh.pair.face_width / mesh.hub
    np.testing.assert_allclose(1 / (1 / slope + 1 / bodies), cycle.tangent_stiffness, rtol=1e-9)


def test_teeth_that_are_apart_carry_exactly_nothing(mesh):
    apart = contact(mesh, -5.0)
    assert bool(apart.converged.all())
    assert not np.any(apart.force) and not np.any(apart.line_load)


def test_wrong_errors_are_named(mesh):
    with pytest.raises(ValueError, match=r"transmission_error has shape \(3,\), must be a single number or"):
        contact(mesh, jnp.zeros(3))
    with pytest.raises(ValueError, match="transmission_error = nan um must be finite"):
        contact(mesh, jnp.nan)
