"""Two coordinates that vibrate together: a pair of multipliers leaves the unit circle, against exact multipliers."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from oscillators import SHARE, frequency, rectangular
from scipy.linalg import block_diag, expm
from scipy.optimize import brentq

from jaxgear.dynamics import Oscillator, bifurcation_of, find_orbit, follow_orbits
from jaxgear.dynamics.bifurcation import tests_of as numbers_of
from jaxgear.dynamics.poincare import Corrected

STEPS = 200
TWO_PI = 2 * np.pi
SPRING = 2.0  # that holds the second coordinate; natural frequencies 0.765 and 1.848, whose sum is 2.613
POINT = jnp.array([0.02, 1.75])  # damping ratio, stiffness ratio


def held(numbers):
    """A mesh between two masses of one, of which a spring holds the second."""
    zeta, ratio = numbers
    grounded = jnp.diag(jnp.array([0.0, 1.0]))
    return Oscillator(
        rectangular(zeta, ratio).mesh_force,
        mass=[1.0, 1.0],
        direction=[1.0, 1.0],
        load=[1.0, 0.0],
        mesh_damping=2 * zeta,
        stiffness=SPRING * grounded,
        damping=2 * zeta * grounded,
        newton=1.0,
    )


def exact_multipliers(omega, zeta, ratio):
    """While contact is kept the equation is linear with constant coefficients in two pieces."""
    single = 1 / (SHARE * ratio + 1 - SHARE)

    def flow(stiffness, time):
        ground = np.diag([0.0, SPRING])
        damping = 2 * zeta * (np.ones((2, 2)) + np.diag([0.0, 1.0]))
        matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-ground - stiffness * np.ones((2, 2)), -damping]])
        return expm(time * matrix)

    cycle = TWO_PI / omega
    return np.linalg.eigvals(flow(single, (1 - SHARE) * cycle) @ flow(ratio * single, SHARE * cycle))


def exact_limit(bracket, numbers):
    return brentq(lambda omega: np.abs(exact_multipliers(omega, *numbers)).max() - 1, *bracket, xtol=1e-13)


@pytest.fixture(scope="module")
def branch():
    start = find_orbit(held(POINT), frequency(2.3), ([1.5, -0.5], [0.0, 0.0]), steps=STEPS)
    return follow_orbits(held(POINT), start, within=(frequency(2.3), frequency(2.9)), step=0.05, steps=STEPS)


@pytest.mark.slow
def test_a_pair_of_multipliers_leaves_and_enters_the_circle_about_the_sum_of_both_frequencies(branch):
    assert branch.ended == "range" and (np.asarray(branch.orbits.contact_loss_share) == 0).all()
    assert [found.kind for found in branch.bifurcations] == ["Neimark-Sacker"] * 2
    limits = [exact_limit(bracket, POINT) for bracket in ((2.4, 2.55), (2.65, 2.85))]
    np.testing.assert_allclose([TWO_PI * found.parameter for found in branch.bifurcations], limits, rtol=1e-7)
    assert limits[0] < np.sqrt(0.5858) + np.sqrt(3.4142) < limits[1]
    stable = np.asarray(branch.stable)
    first, second = branch.before
    assert stable[:first].all() and not stable[first:second].any() and stable[second:].all()
    for found in branch.bifurcations:
        wanted = exact_multipliers(TWO_PI * float(found.parameter), *POINT)
        np.testing.assert_allclose(np.sort_complex(found.orbit.multipliers), np.sort_complex(wanted), atol=1e-6)
        # the direction lies in the plane of the pair, which the orbit turns without stretching it
        pair = wanted[np.argmax(wanted.imag)]
        once, twice = (np.linalg.matrix_power(found.orbit.monodromy, n) @ found.direction for n in (1, 2))
        np.testing.assert_allclose(twice - 2 * pair.real * once + abs(pair) ** 2 * found.direction, 0, atol=1e-6)


@pytest.mark.slow
def test_the_gradient_of_a_neimark_sacker_point(branch):
    found = branch.bifurcations[0]

    @eqx.filter_jit
    def speed(numbers):
        there = bifurcation_of(held(numbers), found, steps=STEPS)
        return TWO_PI * there.parameter, there.converged

    gradient, converged = jax.grad(speed, has_aux=True)(POINT)
    assert bool(converged)
    for i, by in enumerate(np.eye(2) * 1e-5):
        above, below = (exact_limit((2.4, 2.55), np.asarray(POINT) + side * by) for side in (1, -1))
        np.testing.assert_allclose(gradient[i], (above - below) / 2e-5, rtol=1e-4)


def point_of(*blocks):
    """A point of a branch whose multipliers are those of some blocks."""
    matrix = block_diag(*blocks)
    place = jnp.ones(len(matrix) + 1)
    return Corrected(place, place, jnp.asarray(matrix), jnp.asarray(1.0), jnp.asarray(True))


def pair(size, angle):
    return size * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@pytest.mark.parametrize(
    ("before", "behind", "kinds"),
    [
        ((pair(0.9, 1.0),), (pair(1.1, 1.0),), ["Neimark-Sacker"]),
        # the second pair while the first is outside already
        ((pair(1.3, 2.0), pair(0.9, 1.0)), (pair(1.3, 2.0), pair(1.1, 1.0)), ["Neimark-Sacker"]),
        # a pair outside that becomes two real ones, while another stays inside
        ((pair(1.1, 0.1), pair(0.9, 1.0)), ([1.2], [1.05], pair(0.9, 1.0)), []),
        ((pair(0.9, 3.1), pair(0.5, 1.0)), ([-1.1], [-0.7], pair(0.5, 1.0)), ["flip"]),
        # both together within one step
        ((pair(0.9, 1.0), [-0.9]), (pair(1.1, 1.0), [-1.1]), ["flip", "Neimark-Sacker"]),
    ],
)
def test_only_what_crosses_the_circle_counts(before, behind, kinds):
    here, there = (numbers_of(point_of(*blocks)) for blocks in (before, behind))
    crossed = here.crossed(there)
    assert list(crossed) == kinds and list(there.crossed(here)) == kinds
    assert all(test(here) * test(there) < 0 for test in crossed.values())
