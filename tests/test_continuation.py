"""Branches of periodic orbits through folds and flips, against exact orbits, closed forms and each other."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from oscillators import SHARE, dead_zone, frequency, rectangular

from jaxgear.dynamics import bifurcation_of, find_orbit, follow_orbits

STEPS = 1000
TWO_PI = 2 * np.pi


def followed(start, *, steps=STEPS, **options):
    return follow_orbits(rectangular(), start, step=0.05, steps=steps, **options)


@pytest.fixture(scope="module")
def resonance():
    """The branch of the primary resonance, from high speed down through both folds."""
    start = find_orbit(rectangular(), frequency(1.2), ([1.3], [0.9]), steps=STEPS)
    return followed(start, within=(frequency(0.5), frequency(1.3)), direction="down")


@pytest.fixture(scope="module")
def parametric():
    """The branch of one cycle through the principal parametric resonance."""
    start = find_orbit(rectangular(), frequency(1.7), ([1.04], [0.35]), steps=STEPS)
    return followed(start, within=(frequency(1.6), frequency(2.3)))


@pytest.fixture(scope="module")
def doubled(parametric):
    """The branch of two cycles that begins at the lower end of that resonance."""
    return followed(parametric.bifurcations[0], within=(frequency(0.8), frequency(2.3)))


def near(branch, omega, stable):
    """The orbits of a branch next to a speed."""
    speed = TWO_PI * np.asarray(branch.parameter)
    passes = np.flatnonzero((speed[:-1] - omega) * (speed[1:] - omega) <= 0)
    return [jax.tree.map(lambda part, i=i: part[i], branch.orbits) for i in passes if branch.stable[i] == stable]


@pytest.mark.slow
def test_the_primary_resonance_folds_twice(resonance):
    assert resonance.ended == "range"
    assert [found.kind for found in resonance.bifurcations] == ["fold", "fold"]
    lower, upper = (TWO_PI * found.parameter for found in resonance.bifurcations)
    assert abs(lower - 0.5581) < 1e-3 and abs(upper - 0.8562) < 1e-3
    first, second = resonance.before
    stable = np.asarray(resonance.stable)
    assert stable[:first].all() and not stable[first + 1 : second].any() and stable[second + 1 :].all()
    tip = resonance.bifurcations[0].orbit
    assert abs(tip.dynamic_factor - 6.56) < 0.05 and abs(tip.dte_rms - 4.12) < 0.02


def test_orbits_of_the_resonance_are_the_exact_ones(resonance):
    """Behind both folds the branch ends at Omega 0.5, where the orbit is known."""
    last = jax.tree.map(lambda part: part[-1], resonance.orbits)
    found = [last.displacement[0], last.velocity[0], last.dte_rms, last.dynamic_factor]
    np.testing.assert_allclose(found, [1.390083, 0.574387, 0.622171, 2.119300], rtol=0, atol=2e-5)
    # high and low orbit at the same speed, and between them an unstable one
    for omega, factors in ((0.70, (5.039343, 1.425710)), (0.80, (4.225453, 1.618880))):
        polished = [
            find_orbit(rectangular(), frequency(omega), orbit.start, steps=4000)
            for orbit in near(resonance, omega, True)
        ]
        np.testing.assert_allclose([orbit.dynamic_factor for orbit in polished], factors, rtol=0, atol=2e-6)
        (between,) = near(resonance, omega, False)
        unstable = find_orbit(rectangular(), frequency(omega), between.start, steps=4000)
        assert bool(unstable.converged) and not bool(unstable.stable)
        assert factors[1] < unstable.dynamic_factor < factors[0]


def test_one_multiplier_is_one_at_a_smooth_fold(resonance):
    fold = resonance.bifurcations[1].orbit
    assert np.abs(fold.multipliers - 1).min() < 3e-3
    # volumes of the state space shrink along the whole branch as damping says
    omega = TWO_PI * np.asarray(resonance.parameter)
    np.testing.assert_allclose(np.linalg.det(resonance.orbits.monodromy), np.exp(-4 * np.pi * 0.05 / omega), rtol=1e-8)


def test_the_parametric_resonance_lies_between_two_flips(parametric):
    assert [found.kind for found in parametric.bifurcations] == ["flip", "flip"]
    found = [TWO_PI * float(flip.parameter) for flip in parametric.bifurcations]
    # to first order in the stiffness variation
    first = 2 * (1.75 - 1) / (SHARE * 1.75 + 1 - SHARE) * np.sin(SHARE * np.pi) / np.pi
    half = np.sqrt(first**2 / 4 - 4 * 0.05**2)
    np.testing.assert_allclose(found, [2 - half, 2 + half], rtol=0, atol=0.012)
    for flip in parametric.bifurcations:
        assert np.abs(flip.orbit.multipliers + 1).min() < 1e-6
        back = flip.orbit.monodromy @ flip.direction
        np.testing.assert_allclose(back, -flip.direction, rtol=0, atol=1e-6)
    # contact is kept: the equation is linear, and the flips are those of its own monodromy at every amplitude
    assert (np.asarray(parametric.orbits.contact_loss_share) == 0).all()


@pytest.mark.slow
def test_orbits_of_two_cycles_join_both_flips(parametric, doubled):
    assert doubled.ended == "joined"
    upper = parametric.bifurcations[1].parameter
    np.testing.assert_allclose(doubled.parameter[-1], upper, rtol=1e-4)
    assert all(near(doubled, omega, True) for omega in (1.70, 1.90))


@pytest.mark.slow
def test_orbits_of_two_cycles_are_the_exact_ones(doubled):
    for omega, factor in ((1.70, 4.168459), (1.90, 3.658612)):
        (orbit,) = near(doubled, omega, True)
        polished = find_orbit(rectangular(), frequency(omega), orbit.start, periods=2, steps=4000)
        np.testing.assert_allclose(polished.dynamic_factor, factor, rtol=0, atol=2e-6)


def test_the_end_of_the_doubled_branch_is_the_twin_of_the_resonance(resonance, doubled):
    """One impact in two cycles at twice the speed is the same motion as one impact in a cycle."""
    one = resonance.bifurcations[0]
    (two,) = (found for found in doubled.bifurcations if found.kind == "fold")
    np.testing.assert_allclose(two.parameter, 2 * one.parameter, rtol=1e-3)
    np.testing.assert_allclose(two.orbit.dynamic_factor, one.orbit.dynamic_factor, rtol=5e-3)
    np.testing.assert_allclose(two.orbit.dte_rms, one.orbit.dte_rms, rtol=2e-3)


@pytest.mark.slow
def test_a_family_over_any_parameter():
    """The load of the dead zone changes with the speed; an unstable orbit lies where one harmonic puts it."""
    moving, speed = dead_zone(jnp.asarray(frequency(0.9)))
    start = find_orbit(moving, speed, ([0.863], [0.08]), steps=STEPS)
    within = frequency(0.6), frequency(1.0)
    branch = follow_orbits(dead_zone, start, parameter=speed, within=within, direction="down", step=0.02, steps=STEPS)
    assert branch.ended == "range" and [found.kind for found in branch.bifurcations] == ["fold", "fold"]
    (orbit,) = near(branch, 0.80, False)
    orbit = find_orbit(*dead_zone(jnp.asarray(frequency(0.80))), orbit.start, steps=STEPS)
    turn = np.exp(-1j * TWO_PI * np.asarray(orbit.phase))
    amplitude = 2 * abs(np.mean(np.asarray(orbit.dte) * turn))
    assert bool(orbit.converged) and not bool(orbit.stable)
    # one harmonic is 3 % off on the stable branch, and more where the flanks only just part
    assert abs(orbit.dte_mean - 1.085105) < 0.01 and abs(amplitude - 0.156748) < 0.02


@pytest.mark.slow
def test_a_fold_of_a_family_is_found_again():
    moving, speed = dead_zone(jnp.asarray(frequency(0.9)))
    start = find_orbit(moving, speed, ([0.863], [0.08]), steps=STEPS)
    within = frequency(0.6), frequency(1.0)
    branch = follow_orbits(dead_zone, start, parameter=speed, within=within, direction="down", step=0.02, steps=STEPS)
    again = bifurcation_of(dead_zone, branch.bifurcations[0], steps=STEPS)
    np.testing.assert_allclose(again.parameter, branch.bifurcations[0].parameter, rtol=1e-5)


def finer(orbit, changes):
    """Nodes of a cycle with short steps where contact begins and ends.

    A kink inside of a step costs the derivative its accuracy.
    """
    phase, dte = np.asarray(orbit.phase), np.asarray(orbit.dte)
    (turns,) = np.nonzero(dte * np.roll(dte, -1) < 0)
    assert len(turns) == changes
    short = [np.linspace(phase[i] - 0.003, phase[i] + 0.004, 501) for i in turns]
    return jnp.asarray(np.unique(np.concatenate([phase, [1.0], *short])))


def check_gradient(bifurcation, changes):
    """Its speed by damping and stiffness ratio, against those of changed oscillators."""
    nodes = finer(bifurcation.orbit, changes)

    @jax.jit
    def speed(numbers):
        def of(numbers):
            found = bifurcation_of(rectangular(*numbers), bifurcation, steps=nodes)
            return TWO_PI * found.parameter, found.converged

        return jax.value_and_grad(of, has_aux=True)(numbers)

    point = np.array([0.05, 1.75])
    (_, converged), gradient = speed(point)
    assert bool(converged)
    for i, by in enumerate(np.eye(2) * 5e-4):
        difference = (speed(point + by)[0][0] - speed(point - by)[0][0]) / 1e-3
        np.testing.assert_allclose(gradient[i], difference, rtol=1e-3)


def test_the_gradient_of_a_fold(resonance):
    """Where the low branch ends, of an orbit that loses contact."""
    check_gradient(resonance.bifurcations[1], changes=2)


@pytest.mark.slow
def test_the_gradient_of_a_flip(parametric):
    """Where the period doubles, of an orbit that keeps contact."""
    check_gradient(parametric.bifurcations[0], changes=0)


def test_what_is_no_fold_or_flip_is_refused(resonance, parametric):
    with pytest.raises(TypeError, match="near is of type Orbit, must be a Bifurcation"):
        bifurcation_of(rectangular(), parametric.bifurcations[0].orbit)
    with pytest.raises(ValueError, match='start is a bifurcation of kind "fold", must be a flip'):
        followed(resonance.bifurcations[0], within=(0.05, 0.2))
    with pytest.raises(ValueError, match="direction = 'left' must be"):
        followed(resonance.bifurcations[0], within=(0.05, 0.2), direction="left")
    start = find_orbit(rectangular(), frequency(1.2), ([1.3], [0.9]), steps=STEPS)
    with pytest.raises(ValueError, match="parameter of the start = .* must be at least"):
        followed(start, within=(1.0, 2.0))
    with pytest.raises(ValueError, match="parameter belongs to a function of it"):
        followed(start, within=(0.05, 0.3), parameter=0.2)
