"""Equilibrium, mirror symmetry, invariance to hub wind-up, and convergence of the mesh cycle."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxgear as jg


def mesh_of(hub=True, positions=32, slices=1):
    gear = jg.Gear(30, 2.0, face_width=20.0, bore_diameter=12.6)
    sizes = jg.Resolution(positions=positions, slices=slices)
    return jg.prepare(jg.GearPair(gear, gear), compliance=jg.default_compliance(hub_windup=hub), resolution=sizes)


@pytest.fixture(scope="module")
def cycle():
    return jg.solve(mesh_of(), 150.0)


def test_forces_are_in_equilibrium(cycle):
    assert bool(cycle.converged.all())
    np.testing.assert_allclose(cycle.pair_force.sum(axis=0), float(cycle.force), rtol=1e-12)


def test_equal_gears_are_symmetric_about_the_pitch_point(cycle):
    te, share = np.asarray(cycle.transmission_error), np.asarray(jg.load_sharing(cycle))
    np.testing.assert_allclose(te[1:], te[1:][::-1], rtol=1e-10)
    # psi -> 1 - psi exchanges the pairs that run at psi + k and psi - 1 - k base pitches
    np.testing.assert_allclose(share[:, 1:], share[::-1, 1:][:, ::-1], atol=1e-9)


def test_hub_windup_shifts_the_mean_only(cycle):
    rigid = jg.solve(mesh_of(hub=False), 150.0)
    shift = np.asarray(cycle.transmission_error - rigid.transmission_error)
    mesh = mesh_of()
    windup = float(mesh.hub * cycle.force / mesh.pair.face_width)
    np.testing.assert_allclose(shift, windup, rtol=1e-10)
    np.testing.assert_allclose(cycle.pair_force, rigid.pair_force, rtol=1e-10, atol=1e-8)
    assert windup > 5.0


@pytest.mark.slow
def test_results_converge_with_slices():
    crowning = jg.LeadCrowning(8.0)
    mean = [
        float(jnp.mean(jg.solve(mesh_of(positions=8, slices=n), 150.0, pinion=crowning).transmission_error))
        for n in (4, 8, 16)
    ]
    # midpoint rule: each halving of the slices quarters the error
    assert abs(mean[2] - mean[1]) < 0.4 * abs(mean[1] - mean[0])
    assert abs(mean[2] - mean[1]) < 0.005 * mean[2]


@pytest.mark.slow
def test_results_converge_with_positions(cycle):
    fine = jg.solve(mesh_of(positions=128), 150.0)
    coarse = float(jg.peak_to_peak(cycle.transmission_error))
    assert coarse == pytest.approx(float(jg.peak_to_peak(fine.transmission_error)), rel=0.01)
    assert float(cycle.transmission_error.mean()) == pytest.approx(float(fine.transmission_error.mean()), rel=1e-3)
