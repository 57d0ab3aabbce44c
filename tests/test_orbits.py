"""Periodic orbits against exact ones, closed forms and central differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from oscillators import dead_zone, frequency, rectangular
from scipy.interpolate import CubicHermiteSpline

from jaxgear.dynamics import Oscillator, find_orbit, settle, steady_orbit, steady_orbits
from jaxgear.dynamics.orbit import _found
from jaxgear.numerics.reductions import Max

STEPS = 4000
FEW = 400

# Rectangular stiffness of ratio 1.75, zeta 0.05, exact by segments: Omega, periods, x0, v0, mean, rms, max, min, K_v,
# moduli of the multipliers, stable
RECTANGULAR = [
    (0.35, 1, 1.648687, 0.276777, 1.038569, 0.543260, 1.962546, -0.105576, 2.298924, (0.4075, 0.4075), True),
    (0.45, 1, 1.397338, 0.036080, 1.079562, 0.387123, 1.457924, 0.145926, 1.915133, (0.4975, 0.4975), True),
    (0.50, 1, 1.390083, 0.574387, 1.080967, 0.622171, 2.157169, 0.015619, 2.119300, (0.6147, 0.4630), True),
    (0.70, 1, 0.936449, -0.274675, 1.108917, 0.471900, 1.821345, 0.452400, 1.425710, (0.6384, 0.6384), True),
    (0.70, 1, 3.332644, 1.645712, -0.731543, 2.588885, 3.678720, -3.835178, 5.039343, (0.6384, 0.6384), True),
    (0.80, 1, 1.028996, -0.572884, 1.150150, 0.644710, 2.068119, 0.215482, 1.618880, (0.6752, 0.6752), True),
    (0.80, 1, 2.590742, 1.722510, -0.069470, 1.907104, 3.084581, -2.392970, 4.225453, (0.6752, 0.6752), True),
    (0.90, 1, 2.031854, 1.638302, 0.332164, 1.427648, 2.616350, -1.444173, 3.584040, (0.7053, 0.7053), True),
    (1.00, 1, 1.664274, 1.458325, 0.585805, 1.080237, 2.258973, -0.791533, 3.094483, (0.7304, 0.7304), True),
    (1.20, 1, 1.311115, 0.922941, 0.866159, 0.553646, 1.691276, 0.128918, 2.316816, (0.7697, 0.7697), True),
    (1.70, 1, 1.045985, 0.352461, 0.967610, 0.129608, 1.161816, 0.799680, 1.591529, (0.8313, 0.8313), True),
    (1.70, 2, -1.636469, -0.189108, 0.363866, 1.636903, 3.042975, -1.654128, 4.168459, (0.6910, 0.6910), True),
    (1.90, 1, 1.031065, 0.290763, 0.976502, 0.093761, 1.117137, 0.855626, 1.530325, (1.0797, 0.6654), False),
    (1.90, 2, -0.778739, -0.198446, 0.736544, 1.212573, 2.670787, -0.798173, 3.658612, (0.7184, 0.7184), True),
    (2.00, 1, 1.026317, 0.268197, 0.979545, 0.081540, 1.101895, 0.874627, 1.509445, (1.1230, 0.6504), False),
]

# the same with zeta 0.08: Omega, periods, start, rms, K_v (None where none is printed), moduli or None
MORE_DAMPED = [
    (0.80, 1, (2.5, 1.7), 1.793530, 4.267209, None),
    (0.90, 1, (2.0, 1.6), 1.373012, 3.656888, None),
    (1.00, 1, (1.65, 1.45), 1.044662, 3.125866, None),
    (1.70, 2, (-1.45, -0.19), 1.528408, 4.017806, None),
    (1.90, 1, (1.03, 0.29), None, None, (0.9823, 0.5997)),
    (1.90, 2, (-0.7, -0.2), 1.131640, 3.521593, None),
    (2.00, 1, (1.03, 0.27), None, None, (1.0223, None)),
]

# dead zone of half width 1, load 0.1 + 0.05 Omega^2 cos, zeta 0.05: Omega, x0, v0, mean, rms, max, min
DEAD_ZONE = [
    (0.70, 1.14715094, 0.00453019, 1.1, 0.033653, 1.147593, 1.052407),
    (0.75, 0.83384301, 0.16407875, 0.998125, 0.224724, 1.353042, 0.716349),
    (0.80, 1.18470588, 0.01505882, 1.1, 0.061357, 1.186772, 1.013228),
    (0.80, 0.82523679, 0.12460593, 1.019012, 0.202258, 1.333009, 0.761570),
    (0.85, 0.84127443, 0.09870540, 1.037179, 0.181301, 1.314362, 0.803296),
    (0.90, 0.86319781, 0.08016883, 1.051981, 0.162860, 1.297581, 0.839249),
    (1.00, 0.90596537, 0.05577444, 1.073115, 0.133083, 1.269255, 0.895288),
    (1.20, 0.96623122, 0.03143497, 1.093828, 0.094212, 1.228617, 0.963318),
    (1.50, 1.01127760, 0.01597003, 1.1, 0.063186, 1.189359, 1.010641),
]

NEAR = ([2.0], [1.6])  # the orbit of the first benchmark at Omega 0.9


def at(omega, start, *, zeta=0.05, ratio=1.75, periods=1, steps=STEPS):
    return find_orbit(rectangular(zeta, ratio), frequency(omega), start, periods=periods, steps=steps)


def moduli(orbit):
    return sorted(np.abs(orbit.multipliers), reverse=True)


@pytest.mark.parametrize("row", RECTANGULAR, ids=lambda row: f"{row[0]} T{row[1]} {row[8]:.2f}")
def test_orbits_of_a_rectangular_stiffness(row):
    omega, periods, x, v, mean, rms, most, least, factor, sizes, stable = row
    orbit = at(omega, ([x + 0.01], [v - 0.01]), periods=periods)
    found = [orbit.displacement[0], orbit.velocity[0], orbit.approach_mean, orbit.approach_rms]
    found += [orbit.approach_max, orbit.approach_min, orbit.dynamic_factor]
    np.testing.assert_allclose(found, [x, v, mean, rms, most, least, factor], rtol=0, atol=2e-6)
    np.testing.assert_allclose(moduli(orbit), sizes, rtol=0, atol=3e-4)
    assert bool(orbit.converged) and bool(orbit.stable) == stable
    # Liouville: the damping shrinks every volume of the state space, in contact and out of it
    expected = np.exp(-4 * np.pi * periods * 0.05 / omega)
    np.testing.assert_allclose(np.linalg.det(orbit.monodromy), expected, rtol=1e-9)


@pytest.mark.parametrize("row", MORE_DAMPED, ids=lambda row: f"{row[0]} T{row[1]}")
def test_orbits_with_more_damping(row):
    omega, periods, (x, v), rms, factor, sizes = row
    orbit = at(omega, ([x], [v]), zeta=0.08, periods=periods)
    assert bool(orbit.converged)
    if rms is not None:
        np.testing.assert_allclose([orbit.approach_rms, orbit.dynamic_factor], [rms, factor], rtol=0, atol=2e-6)
    for size, expected in zip(moduli(orbit), sizes or (None, None)):
        assert expected is None or abs(size - expected) < 1e-4


@pytest.mark.parametrize("row", DEAD_ZONE, ids=lambda row: f"{row[0]} {row[4]}")
def test_orbits_in_a_dead_zone(row):
    omega, x, v, *rest = row
    moving, speed = dead_zone(jnp.asarray(frequency(omega)))
    orbit = find_orbit(moving, speed, ([x + 0.002], [v]), steps=2 * STEPS)
    assert bool(orbit.converged) and bool(orbit.stable)
    np.testing.assert_allclose([orbit.displacement[0], orbit.velocity[0]], [x, v], rtol=0, atol=1e-8)
    found = [orbit.approach_mean, orbit.approach_rms, orbit.approach_max, orbit.approach_min]
    np.testing.assert_allclose(found, rest, rtol=0, atol=1e-6)


def test_contact_is_lost_for_the_share_of_time_that_the_approach_is_negative():
    orbit = at(0.9, NEAR)
    below = np.diff(np.append(orbit.phase, 1.0)) @ (np.asarray(orbit.approach) < 0)
    assert abs(orbit.no_contact - below) < 1e-3 and orbit.coast_contact == 0
    assert at(1.2, ([1.3], [0.9])).no_contact == 0


def test_peaks_do_not_depend_on_the_steps():
    """The largest force lies between samples: parabolas find it, and its derivative does not jump with the samples."""
    coarse = [at(0.9 + 1e-4 * i, NEAR, steps=FEW).dynamic_factor for i in range(3)]
    assert abs(coarse[0] - 3.584040) < 2e-4
    assert abs(coarse[2] - 2 * coarse[1] + coarse[0]) < 2e-6


def refined(numbers):
    """Nodes of a cycle with tiny steps around the places where contact begins and ends: no kink in the others."""
    even = np.linspace(0.0, 1.0, 1001)
    nodes = np.sort(np.append(even, [0.1001, 0.1002, 0.1003, 0.1004]))
    for width in (1e-5, 1e-7):
        orbit = at(numbers[0], NEAR, zeta=numbers[1], ratio=numbers[2], steps=jnp.asarray(nodes))
        ends = np.append(orbit.phase, 1.0)
        values = np.append(orbit.approach, orbit.approach[0])
        rates = np.append(orbit.approach_rate, orbit.approach_rate[0]) / float(orbit.mesh_frequency)
        zeros = CubicHermiteSpline(ends, values, rates).roots(extrapolate=False)
        assert len(zeros) == 2
        nodes = np.sort(np.concatenate([even, zeros - width, zeros + width]))
    return jnp.asarray(nodes)


@jax.jit
def quantities(numbers, nodes):
    omega, zeta, ratio = numbers
    orbit = at(omega, NEAR, zeta=zeta, ratio=ratio, steps=nodes)
    return jnp.stack([orbit.approach_rms, orbit.dynamic_factor])


POINT = jnp.array([0.9, 0.05, 1.75])  # Omega, zeta, stiffness ratio


def test_gradients_of_an_orbit():
    """Against central differences of the exact flow, and against our own.

    The derivative of a Runge-Kutta step with a kink inside is of first order only: 4000 equal steps leave 2e-3.
    """
    nodes = refined(POINT)
    exact = [[-4.07312, -0.92154, 0.18082], [-5.76547, 4.04593, 0.78466]]
    forward = jax.jit(jax.jacfwd(quantities))(POINT, nodes)
    np.testing.assert_allclose(forward, exact, rtol=1e-3)
    reverse = jax.jit(jax.grad(lambda numbers: quantities(numbers, nodes)[1]))(POINT)
    np.testing.assert_allclose(reverse, forward[1], rtol=1e-9)
    for i, by in enumerate(jnp.eye(3) * 1e-3):
        ahead, behind = POINT + by, POINT - by
        difference = (quantities(ahead, refined(ahead)) - quantities(behind, refined(behind))) / 2e-3
        np.testing.assert_allclose(forward[:, i], difference, rtol=1e-4)


def test_the_share_of_two_pairs_moves_the_orbit():
    """The jump of the stiffness moves with its node."""

    @jax.jit
    def rms(share):
        moving = eqx.tree_at(lambda o: o.mesh_force.share, rectangular(), share)
        return find_orbit(moving, frequency(1.2), ([1.3], [0.9]), steps=FEW).approach_rms

    slope = jax.grad(rms)(0.37)
    np.testing.assert_allclose(slope, (rms(0.371) - rms(0.369)) / 2e-3, rtol=1e-4)


def test_no_derivative_passes_through_the_start():
    def of_start(x):
        return _found(rectangular(), jnp.asarray(frequency(0.9)), (x, jnp.array([1.6])), jnp.linspace(0, 1, FEW + 1), 1)

    slope = jax.grad(lambda x: of_start(x).dynamic_factor)(jnp.array([2.0]))
    assert slope == 0


def two_gears(mass=2.0):
    """The first benchmark as two gears that turn freely: the same approach, and a rotation of both together."""
    one = rectangular()
    masses = [mass, 1 / (1 - 1 / mass)]  # whose equivalent mass is one
    return Oscillator(
        one.mesh_force, mass=masses, direction=[1.0, -1.0], load=[1.0, -1.0], mesh_damping=0.1, newton=1.0
    )


def test_gears_that_turn_freely_have_the_orbit_of_their_equivalent_mass():
    """Momentum is conserved: two more multipliers of one, and nothing that Newton's method could solve for."""
    both = find_orbit(two_gears(), frequency(0.9), ([1.3, -0.7], [1.0, -0.6]), steps=FEW)
    one = at(0.9, NEAR, steps=FEW)
    assert bool(both.converged) and bool(both.stable)
    for name in ("dynamic_factor", "approach_rms", "approach_mean", "approach_min", "no_contact"):
        np.testing.assert_allclose(getattr(both, name), getattr(one, name), rtol=1e-9)
    np.testing.assert_allclose(moduli(both), [1.0, 1.0, *moduli(one)], rtol=0, atol=1e-5)

    def factor(oscillator, start):
        return find_orbit(oscillator, frequency(0.9), start, steps=FEW).dynamic_factor

    load = jax.grad(lambda f: factor(_loaded(two_gears(), jnp.stack([f, -f])), ([1.3, -0.7], [1.0, -0.6])))(1.0)
    # the force is piecewise linear: everything is proportional to the load
    assert abs(load) < 1e-9


def _loaded(oscillator, load):
    return eqx.tree_at(lambda o: o.load, oscillator, load)


def test_a_motion_settles_on_the_orbit_that_is_refined():
    state = settle(rectangular(), frequency(1.0), ([0.0], [0.0]), cycles=60, steps=FEW)
    orbit = steady_orbit(rectangular(), frequency(1.0), ([0.0], [0.0]), settle=60, steps=FEW)
    np.testing.assert_allclose(state, orbit.start, rtol=0, atol=1e-6)
    assert bool(orbit.converged) and abs(orbit.dynamic_factor - 3.094483) < 1e-3
    # the settled state repeats after two cycles: an orbit of one cycle is near only by chance, and unstable
    doubled = [steady_orbit(rectangular(), frequency(1.9), ([0.0], [0.0]), periods=n, steps=FEW) for n in (1, 2)]
    assert [bool(orbit.converged) for orbit in doubled] == [False, True]
    assert abs(doubled[1].dynamic_factor - 3.658612) < 1e-3


def test_the_worst_of_a_band_has_the_gradient_of_its_orbits():
    omegas = jnp.linspace(1.0, 1.3, 4)
    starts = [settle(rectangular(), frequency(omega), NEAR, cycles=60, steps=FEW) for omega in omegas]
    states = tuple(jnp.stack(parts) for parts in zip(*starts))

    @jax.jit
    def worst(zeta):
        orbits = steady_orbits(rectangular(zeta), frequency(omegas), states, settle=0, steps=FEW)
        return Max().soft(orbits.dynamic_factor, 0.3), orbits.converged

    slope = jax.jit(jax.grad(lambda zeta: worst(zeta)[0]))(0.05)
    assert worst(0.05)[1].all()
    difference = (worst(0.0505)[0] - worst(0.0495)[0]) / 1e-3
    np.testing.assert_allclose(slope, difference, rtol=3e-2)  # kinks inside of steps


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mesh_frequency": 0.0}, "find_orbit: mesh_frequency = 0 Hz must be greater than 0 Hz"),
        ({"mesh_frequency": [1.0, 2.0]}, "find_orbit: mesh_frequency has shape"),
        ({"start": ([1.0, 2.0], [0.0])}, "find_orbit: displacements of start have shape"),
        ({"start": 1.0}, "find_orbit: start must be displacements and velocities"),
        ({"periods": 0}, "find_orbit: periods = 0 must be a whole number of at least 1"),
        ({"steps": 1}, "find_orbit: steps = 1 must be a whole number of at least 2"),
        ({"steps": jnp.array([0.0, 0.5, 0.9])}, "find_orbit: nodes of steps must increase from 0 to 1"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(given, message):
    arguments = {"mesh_frequency": 0.1, "start": NEAR, **given}
    with pytest.raises(ValueError, match=message) as refused:
        find_orbit(rectangular(), arguments.pop("mesh_frequency"), arguments.pop("start"), **arguments)
    assert "\n" not in str(refused.value)


def test_something_else_than_an_oscillator_is_refused():
    with pytest.raises(TypeError, match="find_orbit: oscillator is of type int"):
        find_orbit(3, 0.1, NEAR)
