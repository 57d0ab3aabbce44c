"""Equilibrium under a static load: dte, mean stiffness, what bearings and springs carry, the slow limit."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair

from jaxgear.dimensionless import CycleRelief, PolynomialClearance, dimensionless_model
from jaxgear.dimensionless.model import DimensionlessForce
from jaxgear.dynamics import (
    DeadZone,
    Excitation,
    Oscillator,
    RectangularStiffness,
    find_orbit,
    on_bearings,
    settle,
    speed_sweep,
)
from jaxgear.dynamics.oscillator import at_rest, static_force

DOUBLE, SINGLE, SHARE = 300.0, 200.0, 0.37
RECTANGULAR = RectangularStiffness(DOUBLE, SINGLE, SHARE)
BEARINGS = np.array([[[500.0, 60.0], [60.0, 100.0]], [[250.0, 0.0], [0.0, 100.0]]])
HERE, LOAD = jnp.asarray(0.0), jnp.asarray(100.0)
MOVED = Excitation(load=[0.0], load_angle=[0.0], displacement=[2.0], displacement_angle=[0.4], orders=[1.0])

resting, mean_force = jax.jit(at_rest), jax.jit(static_force)


@pytest.fixture(scope="module")
def held():
    """Gears on bearings under 1000 N or so, with a displacement between them."""
    return on_bearings(
        RECTANGULAR,
        pair=gear_pair((30, 30), bores=(None, None)),
        torque=40.0,
        damping_ratio=0.05,
        bearing_stiffness=BEARINGS,
        bearing_damping=2e-5 * BEARINGS,
        excitation=MOVED,
    )


@pytest.fixture(scope="module")
def sprung():
    """A spring to ground takes a share of the load of 1 from a mesh whose stiffness swings about 1, behind a gap."""
    force = DimensionlessForce(DeadZone(), [0.3], [0.0])
    one = [1.0]
    return Oscillator(force, mass=one, direction=one, load=one, mesh_damping=0.2, stiffness=[[0.25]], newton=1.0)


def shared(phase):
    """Approach and mesh force at rest: k (x - 1) + x / 4 = 1."""
    stiffness = 1 + 0.3 * np.cos(2 * np.pi * phase)
    dte = (1 + stiffness) / (stiffness + 0.25)
    return dte, stiffness * (dte - 1)


def test_a_spring_behind_a_clearance_has_its_own_stiffness():
    force = DeadZone(300.0, 20.0)
    for load in jnp.array([700.0, -700.0]):
        assert float(force.static_te(HERE, load)) == pytest.approx(
            float(load / 300.0 + jnp.sign(load) * 20.0), rel=1e-12
        )
        assert float(force.mean_secant_stiffness(load)) == pytest.approx(300.0, rel=1e-9)
        assert float(force.mean_tangent_stiffness(load)) == pytest.approx(300.0, rel=1e-12)


def test_tangents_are_averaged_as_stiffnesses_and_secants_as_compliances():
    assert float(RECTANGULAR.mean_tangent_stiffness(LOAD)) == pytest.approx(
        SHARE * DOUBLE + (1 - SHARE) * SINGLE, rel=1e-12
    )
    assert float(RECTANGULAR.mean_secant_stiffness(LOAD)) == pytest.approx(
        1 / (SHARE / DOUBLE + (1 - SHARE) / SINGLE), rel=1e-9
    )


def test_a_stiffening_contact_is_stiffer_for_small_vibrations_than_for_the_whole_deflection():
    """f = k x^3 has the slope 3 f / x."""
    cubic = PolynomialClearance(jnp.array([0.0, 2.0]), 3.0)
    load = jnp.asarray(2.0 * 1.3**3)
    assert float(cubic.static_te(HERE, load)) == pytest.approx(1.3, rel=1e-12)
    assert float(cubic.mean_tangent_stiffness(load)) == pytest.approx(3 * float(load) / 1.3, rel=1e-9)
    # less the DTE under a millionth of the load, a hundredth of the deflection
    assert float(cubic.mean_secant_stiffness(load)) == pytest.approx(float(load) / 1.3 / 0.99, rel=1e-5)


def test_the_approach_of_a_polynomial_is_found_up_to_the_end_of_its_range():
    clearance = PolynomialClearance.published()
    for x in (1.6, 2.7, 2.99):
        load = clearance.polynomial(jnp.asarray(x))
        assert float(clearance.static_te(HERE, load)) == pytest.approx(x, rel=1e-12)
    assert np.isnan(clearance.static_te(HERE, clearance.polynomial(jnp.asarray(3.01))))


def test_a_force_that_the_flanks_never_have_has_no_approach():
    assert np.isnan(RECTANGULAR.static_te(HERE, jnp.asarray(-1.0)))
    assert np.isnan(DeadZone(300.0, 1.0).static_te(HERE, jnp.asarray(jnp.nan)))


@pytest.mark.parametrize("form", ["exact", "first order", "first order as printed"])
@pytest.mark.parametrize("load", [0.6, -0.6])
def test_the_approach_of_every_form_of_relief_carries_the_load(form, load):
    relief = CycleRelief(0.05, 0.37, 1.37)
    force = dimensionless_model(load=0.6, damping_ratio=0.05, relief=relief, relief_form=form).mesh_force
    for phase in (0.1, 0.6):
        phase = jnp.asarray(phase)
        assert float(force(phase, force.static_te(phase, jnp.asarray(load)))) == pytest.approx(load, rel=1e-10)


def test_bearings_and_mesh_are_in_equilibrium_everywhere(held):
    """K x + d F = load, and the gears, which no bearing holds against turning, leave the mesh the whole torque."""
    for phase in (0.1, 0.6):
        rest = resting(held, jnp.asarray(phase))
        np.testing.assert_allclose(
            held.stiffness @ rest.coordinates + held.direction * rest.force, held.load, rtol=0, atol=1e-8
        )
        assert float(rest.force) == pytest.approx(float(held.load[0]), rel=1e-12)
        wanted = held.mesh_force(jnp.asarray(phase), held.dte(jnp.asarray(phase), rest.coordinates))
        assert float(wanted) == pytest.approx(float(rest.force), rel=1e-10)
    assert float(mean_force(held)) == pytest.approx(float(held.load[0]), rel=1e-12)


def test_a_spring_beside_the_mesh_takes_its_share(sprung):
    for phase in (0.1, 0.6):
        rest = resting(sprung, jnp.asarray(phase))
        np.testing.assert_allclose((rest.coordinates[0], rest.force), shared(phase), rtol=1e-12)
    assert float(mean_force(sprung)) == pytest.approx(shared(np.arange(64) / 64)[1].mean(), rel=1e-12)


def test_the_derivative_of_the_rest_on_bearings_is_that_of_the_equilibrium(held):
    """Of the centre of the pinion by the torque: -1 / k_along of bearings alone, although two of them are alike."""
    round_ = np.array([np.eye(2) * 200.0] * 2)

    def centre(torque):
        oscillator = on_bearings(
            RECTANGULAR, pair=gear_pair((30, 30), bores=(None, None)), torque=torque, damping=1e-3,
            bearing_stiffness=round_,
        )  # fmt: skip
        return at_rest(oscillator, jnp.asarray(0.1)).coordinates[1]

    lever = 1e3 / float(gear_pair((30, 30), bores=(None, None)).pinion.base_radius)
    assert float(jax.jit(jax.grad(centre))(40.0)) == pytest.approx(-lever / 200.0, rel=1e-9)


@pytest.mark.slow
def test_mean_force_of_a_vibration_on_bearings_is_the_static_one(held):
    """Whatever the speed: the torque has to be carried. Beside the two jumps the mean of a step's ends is exact."""
    frequency, rest = jnp.asarray(5800.0), resting(held, HERE).coordinates
    # nine tenths of the natural frequency
    orbit = find_orbit(held, frequency, settle(held, frequency, (rest, 0 * rest), steps=1024), steps=1024)
    phase, force = np.append(orbit.phase, 1.0), np.append(orbit.force, orbit.force[0])
    assert orbit.converged and float(orbit.dynamic_factor) > 1.2
    assert float(orbit.dynamic_factor) == pytest.approx(float(force.max() / held.load[0]), rel=1e-3)
    assert np.trapezoid(force, phase) == pytest.approx(float(held.load[0]), rel=5e-4)


@pytest.mark.slow
def test_slow_motion_passes_through_the_equilibria(sprung):
    """Approach of every mesh position at rest, and K_v is the largest force at rest over the mean one."""
    found = speed_sweep(sprung, [1e-3], steps=4096)
    dte, force = shared(np.arange(4096) / 4096)
    assert found.converged[0]
    np.testing.assert_allclose(found.dte_min[0], dte.min(), rtol=1e-4)
    np.testing.assert_allclose(found.dte_max[0], dte.max(), rtol=1e-4)
    np.testing.assert_allclose(found.dynamic_factor[0], force.max() / force.mean(), rtol=1e-4)
