"""Periodic orbits against exact ones, closed forms and central differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from oscillators import DEAD_ZONE, MORE_DAMPED, RECTANGULAR, dead_zone, frequency, rectangular
from scipy.interpolate import CubicHermiteSpline

from jaxgear.dynamics import Oscillator, find_orbit, settle, steady_orbit, steady_orbits
from jaxgear.numerics.reductions import Max

STEPS = 4000
FEW = 400

NEAR = ([2.0], [1.6])  # the orbit of the first benchmark at Omega 0.9


def at(omega, start, *, zeta=0.05, ratio=1.75, periods=1, steps=STEPS):
    return find_orbit(rectangular(zeta, ratio), frequency(omega), start, periods=periods, steps=steps)


def moduli(orbit):
    return sorted(np.abs(orbit.multipliers), reverse=True)


@pytest.mark.parametrize("known", RECTANGULAR, ids=lambda known: f"{known.name} {known.factor:.2f}")
def test_orbits_of_a_rectangular_stiffness(known):
    orbit = at(known.omega, ([known.x0 + 0.01], [known.v0 - 0.01]), periods=known.periods)
    found = [orbit.displacement[0], orbit.velocity[0], orbit.dte_mean, orbit.dte_rms]
    found += [orbit.dte_max, orbit.dte_min, orbit.dynamic_factor]
    exact = [known.x0, known.v0, known.mean, known.rms, known.most, known.least, known.factor]
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-6)
    np.testing.assert_allclose(moduli(orbit), known.moduli, rtol=0, atol=1e-4)
    assert bool(orbit.converged) and bool(orbit.stable) == known.stable
    # Liouville: the damping shrinks every volume of the state space, in contact and out of it
    expected = np.exp(-4 * np.pi * known.periods * 0.05 / known.omega)
    np.testing.assert_allclose(np.linalg.det(orbit.monodromy), expected, rtol=1e-9)


@pytest.mark.parametrize("known", MORE_DAMPED, ids=lambda known: known.name)
def test_orbits_with_more_damping(known):
    x, v = known.near
    orbit = at(known.omega, ([x], [v]), zeta=known.zeta, periods=known.periods)
    assert bool(orbit.converged) and bool(orbit.stable) == known.stable
    if known.rms is not None:
        found = [orbit.dte_rms, orbit.dynamic_factor]
        np.testing.assert_allclose(found, [known.rms, known.factor], rtol=0, atol=1e-6)
    np.testing.assert_allclose(moduli(orbit)[: len(known.moduli)], known.moduli, rtol=0, atol=1e-4)


@pytest.mark.parametrize("known", DEAD_ZONE, ids=lambda known: f"{known.name} {known.rms}")
def test_orbits_in_a_dead_zone(known):
    moving, speed = dead_zone(jnp.asarray(frequency(known.omega)))
    orbit = find_orbit(moving, speed, ([known.x0 + 0.002], [known.v0]), steps=2 * STEPS)
    assert bool(orbit.converged) and bool(orbit.stable)
    np.testing.assert_allclose([orbit.displacement[0], orbit.velocity[0]], [known.x0, known.v0], rtol=0, atol=1e-8)
    found = [orbit.dte_mean, orbit.dte_rms, orbit.dte_max, orbit.dte_min]
    np.testing.assert_allclose(found, [known.mean, known.rms, known.most, known.least], rtol=0, atol=1e-6)


def test_contact_is_lost_for_the_share_of_time_that_the_approach_is_negative():
    orbit = at(0.9, NEAR)
    below = np.diff(np.append(orbit.phase, 1.0)) @ (np.asarray(orbit.dte) < 0)
    assert abs(orbit.contact_loss_share - below) < 1e-3 and orbit.back_side_contact == 0
    assert at(1.2, ([1.3], [0.9])).contact_loss_share == 0


@pytest.mark.slow
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
        values = np.append(orbit.dte, orbit.dte[0])
        rates = np.append(orbit.dte_rate, orbit.dte_rate[0]) / float(orbit.mesh_frequency)
        zeros = CubicHermiteSpline(ends, values, rates).roots(extrapolate=False)
        assert len(zeros) == 2
        nodes = np.sort(np.concatenate([even, zeros - width, zeros + width]))
    return jnp.asarray(nodes)


@jax.jit
def quantities(numbers, nodes, start):
    omega, zeta, ratio = numbers
    orbit = at(omega, start, zeta=zeta, ratio=ratio, steps=nodes)
    return jnp.stack([orbit.dte_rms, orbit.dynamic_factor])


POINT = jnp.array([0.9, 0.05, 1.75])  # Omega, zeta, stiffness ratio


@jax.jit
def _sloped(numbers, nodes, start):
    def of(numbers, start):
        found = quantities(numbers, nodes, start)
        return found, found

    return jax.jacfwd(of, argnums=(0, 1), has_aux=True)(numbers, start)


def sloped(numbers, nodes, start):
    """Derivatives of the quantities by the numbers and by the start, and the quantities."""
    return jax.tree.map(np.asarray, _sloped(jnp.asarray(numbers), nodes, start))


@pytest.mark.slow
def test_gradients_of_an_orbit():
    """Against central differences of the exact flow, and against our own. None passes through the start.

    The derivative of a Runge-Kutta step with a kink inside is of first order only: 4000 equal steps leave 2e-3.
    """
    nodes, start = refined(POINT), tuple(map(jnp.asarray, NEAR))
    exact = [[-4.07312, -0.92154, 0.18082], [-5.76547, 4.04593, 0.78466]]
    (forward, by_start), _ = sloped(POINT, nodes, start)
    np.testing.assert_allclose(forward, exact, rtol=1e-3)
    assert not np.any(by_start)
    for i, by in enumerate(np.eye(3) * 1e-3):
        ahead, behind = (sloped(at, refined(at), start)[1] for at in (np.asarray(POINT) + by, np.asarray(POINT) - by))
        np.testing.assert_allclose(forward[:, i], (ahead - behind) / 2e-3, rtol=1e-4)


@pytest.mark.slow
def test_gradients_of_an_orbit_backwards():
    nodes, start = refined(POINT), tuple(map(jnp.asarray, NEAR))
    gradient = jax.jit(jax.grad(lambda numbers, start: quantities(numbers, nodes, start)[1], argnums=(0, 1)))
    reverse, by_start = gradient(POINT, start)
    np.testing.assert_allclose(reverse, sloped(POINT, nodes, start)[0][0][1], rtol=1e-9)
    assert by_start == (0, 0)


@pytest.mark.slow
def test_the_share_of_two_pairs_moves_the_orbit():
    """The jump of the stiffness moves with its node."""

    @jax.jit
    def rms(share):
        moving = eqx.tree_at(lambda o: o.mesh_force.share, rectangular(), share)
        return find_orbit(moving, frequency(1.2), ([1.3], [0.9]), steps=FEW).dte_rms

    slope = jax.grad(rms)(0.37)
    np.testing.assert_allclose(slope, (rms(0.371) - rms(0.369)) / 2e-3, rtol=1e-4)


def two_gears(mass=2.0):
    """The first benchmark as two gears that turn freely: the same DTE, and a rotation of both together."""
    one = rectangular()
    masses = [mass, 1 / (1 - 1 / mass)]  # whose equivalent mass is one
    return Oscillator(
        one.mesh_force, mass=masses, direction=[1.0, -1.0], load=[1.0, -1.0], mesh_damping=0.1, newton=1.0
    )


@pytest.mark.slow
def test_gears_that_turn_freely_have_the_orbit_of_their_equivalent_mass():
    """Momentum is conserved: two more multipliers of one, and nothing that Newton's method could solve for."""
    both = find_orbit(two_gears(), frequency(0.9), ([1.3, -0.7], [1.0, -0.6]), steps=FEW)
    one = at(0.9, NEAR, steps=FEW)
    assert bool(both.converged) and bool(both.stable)
    for name in ("dynamic_factor", "dte_rms", "dte_mean", "dte_min", "contact_loss_share"):
        np.testing.assert_allclose(getattr(both, name), getattr(one, name), rtol=1e-9)
    np.testing.assert_allclose(moduli(both), [1.0, 1.0, *moduli(one)], rtol=0, atol=1e-5)


@pytest.mark.slow
def test_the_dynamic_factor_of_gears_that_turn_freely_does_not_depend_on_the_load():
    def factor(oscillator, start):
        return find_orbit(oscillator, frequency(0.9), start, steps=FEW).dynamic_factor

    def of_load(f):
        return factor(_loaded(two_gears(), jnp.stack([f, -f])), ([1.3, -0.7], [1.0, -0.6]))

    load = jax.jit(jax.grad(of_load))(1.0)
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
    alone = steady_orbit(rectangular(), frequency(1.9), ([0.0], [0.0]), settle=60, steps=FEW)
    assert not bool(alone.converged)


@pytest.mark.slow
def test_a_motion_settles_on_an_orbit_of_two_cycles():
    doubled = [steady_orbit(rectangular(), frequency(1.9), ([0.0], [0.0]), periods=n, steps=FEW) for n in (1, 2)]
    assert [bool(orbit.converged) for orbit in doubled] == [False, True]
    assert abs(doubled[1].dynamic_factor - 3.658612) < 1e-3


@pytest.mark.slow
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
        ({"mesh_frequency": 0.0}, "mesh_frequency = 0 Hz must be greater than 0 Hz"),
        ({"mesh_frequency": [1.0, 2.0]}, "mesh_frequency has shape"),
        ({"start": ([1.0, 2.0], [0.0])}, "displacements of start have shape"),
        ({"start": 1.0}, "start must be displacements and velocities"),
        ({"periods": 0}, "periods = 0 must be a whole number of at least 1"),
        ({"steps": 1}, "steps = 1 must be a whole number of at least 2"),
        ({"steps": jnp.array([0.0, 0.5, 0.9])}, "nodes of steps must increase from 0 to 1"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(given, message):
    arguments = {"mesh_frequency": 0.1, "start": NEAR, **given}
    with pytest.raises(ValueError, match=message) as refused:
        find_orbit(rectangular(), arguments.pop("mesh_frequency"), arguments.pop("start"), **arguments)
    assert "\n" not in str(refused.value)


def test_something_else_than_an_oscillator_is_refused():
    with pytest.raises(TypeError, match="oscillator is of type int"):
        find_orbit(3, 0.1, NEAR)
