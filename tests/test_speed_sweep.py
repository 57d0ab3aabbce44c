"""Steady vibration over speed: exact orbits, jumps, detached branches, limits, independence of the steps."""

import dataclasses
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxgear.dynamics import (
    DeadZone,
    Dynamics,
    Excitation,
    Oscillator,
    RectangularStiffness,
    run_up,
    speed_sweep,
    speed_sweeps,
    steps_for,
)
from jaxgear.dynamics.runs import Run, speed_runs

SINGLE = 0.7827788650  # stiffness ratio 1.75, mean 1 over a share of 0.37
STEPS = 512  # of every sweep here, so that there is one program; exact values are printed to six digits
# closed form of the pieces between jumps of stiffness and losses of contact, matched over the cycle:
# Omega, x0, v0, mean, rms, x_max, x_min, K_v, cycles of the orbit
UP = (
    (0.35, 1.648687, 0.276777, 1.038569, 0.543260, 1.962546, -0.105576, 2.298924, 1),
    (0.45, 1.397338, 0.036080, 1.079562, 0.387123, 1.457924, 0.145926, 1.915133, 1),
    (0.50, 1.390083, 0.574387, 1.080967, 0.622171, 2.157169, 0.015619, 2.119300, 1),
    (0.70, 0.936449, -0.274675, 1.108917, 0.471900, 1.821345, 0.452400, 1.425710, 1),
    (0.80, 1.028996, -0.572884, 1.150150, 0.644710, 2.068119, 0.215482, 1.618880, 1),
    (0.90, 2.031854, 1.638302, 0.332164, 1.427648, 2.616350, -1.444173, 3.584040, 1),
    (1.00, 1.664274, 1.458325, 0.585805, 1.080237, 2.258973, -0.791533, 3.094483, 1),
    (1.20, 1.311115, 0.922941, 0.866159, 0.553646, 1.691276, 0.128918, 2.316816, 1),
    (1.70, 1.045985, 0.352461, 0.967610, 0.129608, 1.161816, 0.799680, 1.591529, 1),
    (1.90, -0.778739, -0.198446, 0.736545, 1.212573, 2.670787, -0.798173, 3.658612, 2),
)
# where the way down differs
DOWN = {
    0.70: (3.332644, 1.645712, -0.731543, 2.588885, 3.678720, -3.835178, 5.039343, 1),
    0.80: (2.590742, 1.722510, -0.069470, 1.907104, 3.084581, -2.392970, 4.225453, 1),
    1.70: (-1.636469, -0.189108, 0.363866, 1.636903, 3.042975, -1.654128, 4.168459, 2),
}
OMEGA = np.array([row[0] for row in UP])
USUAL = float(Dynamics([1.0]).kick)
SPEEDS = OMEGA / (2 * np.pi)


def rectangular(damping_ratio=0.05, load=1.0):
    """Benchmark of two stiffnesses in turn, without dimensions."""
    return Oscillator(
        mesh_force=RectangularStiffness(1.75 * SINGLE, SINGLE, 0.37),
        mass=[1.0],
        direction=[1.0],
        load=jnp.reshape(load, (1,)),
        mesh_damping=2 * damping_ratio,
        newton=1.0,
    )


@cache
def swept(direction="up", kick=None, carry=True):
    return speed_sweep(rectangular(), SPEEDS, direction=direction, kick=kick, carry=carry, steps=STEPS)


def row(response, i):
    names = "approach_mean", "approach_rms", "approach_max", "approach_min", "dynamic_factor"
    return [float(getattr(response, name)[i]) for name in names]


@pytest.mark.parametrize("direction", ["up", "down"])
def test_orbits_are_the_exact_ones(direction):
    found = swept(direction)
    assert found.settled.all() and found.direction == direction
    for i, (omega, *exact) in enumerate(UP):
        x0, v0, *numbers, cycles = DOWN.get(omega, exact) if direction == "down" else exact
        assert int(found.period[i]) == cycles
        np.testing.assert_allclose(row(found, i), numbers, rtol=0, atol=1e-5)
        # an orbit of two cycles is at one of two states
        starts = np.stack([found.poincare_approach[i], found.poincare_velocity[i]], axis=1)
        assert np.abs(starts[:2] - [x0, v0]).max(axis=1).min() < 4e-5


def test_the_way_down_stays_on_the_upper_branch_until_its_fold():
    up, down = swept("up"), swept("down")
    higher = np.isin(OMEGA, [0.7, 0.8, 1.7])
    assert (down.dynamic_factor > 2 * up.dynamic_factor)[higher].all()
    # where the orbit is unique both ways end on it
    for name in ("dynamic_factor", "approach_rms", "approach_mean"):
        np.testing.assert_allclose(getattr(up, name)[~higher], getattr(down, name)[~higher], rtol=1e-6)


def test_a_kick_finds_the_orbit_of_two_cycles():
    at_rest, kicked = (swept("up", kick, carry=False) for kick in (None, USUAL))
    i = list(OMEGA).index(1.7)
    assert (int(at_rest.period[i]), int(kicked.period[i])) == (1, 2)
    assert float(kicked.dynamic_factor[i]) == pytest.approx(4.168459, abs=1e-5)
    # its cycles alternate: half the mesh frequency is in the force, and in the other orbit it is not
    assert kicked.orders[0] == 0.5
    assert float(kicked.force_harmonics[i, 0]) > 1.0 and float(at_rest.force_harmonics[i, 0]) == 0.0


def test_runs_in_one_program_are_those_of_one_each():
    runs = {"up": Run("up"), "down": Run("down"), "kicked": Run("down", 4.5)}
    found = speed_runs(rectangular(), SPEEDS, runs, steps=STEPS)
    for name, alone in (("up", swept("up")), ("down", swept("down")), ("kicked", swept("down", 4.5))):
        assert found[name].direction == alone.direction
        assert jax.tree.all(jax.tree.map(lambda a, b: jnp.allclose(a, b, rtol=1e-9), found[name], alone))
    assert found["up"].dynamic_factor[3] < found["down"].dynamic_factor[3]


def test_results_do_not_depend_on_the_number_of_steps():
    chosen = speed_sweep(rectangular(), SPEEDS, steps=steps_for(rectangular(), SPEEDS))
    for name in ("dynamic_factor", "approach_rms", "force_harmonics", "velocity_harmonics"):
        fine, coarse = (np.asarray(getattr(found, name)) for found in (swept(), chosen))
        assert np.abs(coarse - fine).max() < 1e-3 * np.abs(fine).max()
        if fine.ndim == 1:
            np.testing.assert_allclose(coarse, fine, rtol=1e-3)


def test_the_orbit_is_foreseen_before_the_motion_has_settled():
    """Deviations fade by exp(-2 pi zeta / Omega) per cycle: from one to the tolerance takes 18 Omega / (2 pi zeta)."""
    zeta, cycles, unique = 0.01, 60, (OMEGA >= 0.45) & (OMEGA <= 1.0)
    assert (18 * OMEGA / (2 * np.pi * zeta) > 2 * cycles)[unique].all()
    options = {"carry": False, "steps": STEPS}
    few = speed_sweep(rectangular(zeta), SPEEDS, most_cycles=cycles, **options)
    assert few.settled[unique].all()
    many = speed_sweep(rectangular(zeta), SPEEDS, most_cycles=5000, tolerance=1e-11, **options)
    for name in ("dynamic_factor", "approach_rms", "period"):
        np.testing.assert_allclose(getattr(few, name)[unique], getattr(many, name)[unique], rtol=1e-6)


@pytest.mark.slow
def test_more_damping_has_its_exact_orbits_too():
    """To the printed digits, which need finer steps: the stiffness jumps where contact is lost within a step."""
    found = speed_sweep(rectangular(0.08), SPEEDS, direction="down", steps=8 * STEPS)
    for omega, rms, factor in ((0.8, 1.793530, 4.267209), (0.9, 1.373012, 3.656888), (1.0, 1.044662, 3.125866)):
        i = list(OMEGA).index(omega)
        assert float(found.approach_rms[i]) == pytest.approx(rms, abs=1e-6)
        assert float(found.dynamic_factor[i]) == pytest.approx(factor, abs=1e-6)


def test_slow_speeds_take_more_steps():
    steps = steps_for(rectangular(), SPEEDS[0] * np.array([0.25, 0.5, 1.0, 20.0]))
    assert list(steps) == sorted(steps, reverse=True) and steps[0] >= 4 * steps[2] // 2 > steps[3]


def test_load_that_is_multiplied_multiplies_the_approach():
    """Without a clearance the oscillator is linear in its size: K_v stays, the approach grows with the load."""
    loads = jnp.array([1.0, 2.0, 5.0])
    stacked = jax.vmap(lambda load: rectangular(load=load))(loads)
    many = jax.vmap(lambda one: speed_sweep(one, SPEEDS, steps=STEPS))(stacked)
    alone = swept()
    for i, load in enumerate(loads):
        np.testing.assert_allclose(many.dynamic_factor[i], alone.dynamic_factor, rtol=1e-9)
        np.testing.assert_allclose(many.approach_rms[i], load * alone.approach_rms, rtol=1e-9)
    batched = speed_sweeps(stacked, SPEEDS, steps=STEPS, batch=2)
    assert jax.tree.all(jax.tree.map(lambda a, b: jnp.allclose(a, b, rtol=1e-9), batched, many))


# half clearance 1, load 0.1, displacement of the base 0.05: Omega, x0, v0, mean, rms, x_max, x_min
DEAD_ZONE_UP = (
    (0.70, 1.14715094, 0.00453019, 1.1, 0.033653, 1.147593, 1.052407),
    (0.80, 1.18470588, 0.01505882, 1.1, 0.061357, 1.186772, 1.013228),
    (0.85, 0.84127443, 0.09870540, 1.037179, 0.181301, 1.314362, 0.803296),
    (0.90, 0.86319781, 0.08016883, 1.051981, 0.162860, 1.297581, 0.839249),
    (1.00, 0.90596537, 0.05577444, 1.073115, 0.133083, 1.269255, 0.895288),
    (1.20, 0.96623122, 0.03143497, 1.093828, 0.094212, 1.228617, 0.963318),
    (1.50, 1.01127760, 0.01597003, 1.1, 0.063186, 1.189359, 1.010641),
)
DEAD_ZONE_DOWN = {0.80: (0.82523679, 0.12460593, 1.019012, 0.202258, 1.333009, 0.761570)}


def dead_zone(damping_ratio=0.05, force=None):
    """x'' + 2 zeta x' + f(x) = 0.1 + 0.05 Omega^2 cos(Omega t) for the approach x.

    A displacement -0.05 cos is taken off the approach of a mass whose own place does not matter to f.
    """
    excitation = Excitation(load=[0.0], load_angle=[0.0], displacement=[0.05], displacement_angle=[0.0], orders=[1.0])
    return Oscillator(
        mesh_force=DeadZone() if force is None else force,
        mass=[1.0],
        direction=[1.0],
        load=[0.1],
        mesh_damping=2 * damping_ratio,
        excitation=excitation,
        newton=1.0,
    )


def test_dead_zone_orbits_are_the_exact_ones():
    omega = np.array([row[0] for row in DEAD_ZONE_UP])
    for direction in ("up", "down"):
        found = speed_sweep(dead_zone(), omega / (2 * np.pi), direction=direction, steps=4 * STEPS)
        assert found.settled.all()
        for i, (at, *exact) in enumerate(DEAD_ZONE_UP):
            x0, v0, *numbers = DEAD_ZONE_DOWN.get(at, exact) if direction == "down" else exact
            np.testing.assert_allclose(row(found, i)[:4], numbers, rtol=0, atol=1e-6)
            np.testing.assert_allclose(found.poincare_approach[i, 0], x0, atol=1e-6)
            np.testing.assert_allclose(found.poincare_velocity[i, 0], v0, atol=1e-6)


def test_slow_speed_is_the_static_limit():
    """The approach follows load over stiffness, its harmonic of a linear force that of the displacement, which is 0."""
    linear = dataclasses.replace(dead_zone(), mesh_force=DeadZone(half_clearance=0.0))
    found = speed_sweep(linear, [1e-3 / (2 * np.pi)], steps=4096 * 4)
    assert float(found.approach_mean[0]) == pytest.approx(0.1, rel=1e-6)
    assert float(found.dynamic_factor[0]) == pytest.approx(1.0, abs=2e-6)
    assert float(found.no_contact[0]) == 0.0


def test_shares_of_contact():
    """A light load within a clearance: the flanks are apart for a while, and without coast flanks never on those."""
    found = swept("down")
    assert ((found.no_contact > 0) == (found.approach_min < 0)).all()
    assert not found.coast_contact.any()


def test_an_undamped_start_never_settles():
    found = speed_sweep(rectangular(0.0), SPEEDS[:1], kick=2.0, steps=STEPS, most_cycles=10)
    assert not found.settled.any() and int(found.period[0]) == 0 and np.isfinite(found.dynamic_factor).all()


def test_slow_run_up_follows_the_steady_states():
    found = run_up(rectangular(), first=0.8 * SPEEDS[-3], last=SPEEDS[-3], duration=3e4, samples=200, steps=128)
    assert float(found.time[-1]) == pytest.approx(3e4, rel=0.05)
    steady = float(swept().dynamic_factor[-3])
    assert float(found.dynamic_factor[-1]) == pytest.approx(steady, rel=5e-3)
    np.testing.assert_allclose(np.diff(found.mesh_frequency**2), np.diff(found.mesh_frequency**2)[0], rtol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"mesh_frequencies": []}, "mesh_frequencies has shape"),
        ({"mesh_frequencies": [-1.0]}, "mesh_frequencies = -1 Hz must be greater than 0 Hz"),
        ({"mesh_frequencies": [2.0, 1.0]}, "must increase"),
        ({"direction": "sideways"}, "direction = 'sideways' must be"),
        ({"kick": 0.5}, "kick = 0.5 must be at least 1"),
        ({"steps": 9}, "steps = 9 must be even"),
        ({"steps": [8, 8]}, "must have one for each of 1 speeds"),
        ({"tolerance": 1.0}, "tolerance = 1 must be"),
        ({"most_cycles": 0}, "most_cycles = 0 must be"),
        ({"points": 2}, "points = 2 must be at least most_periods"),
        ({"orders": [-1.0]}, "orders = -1"),
        ({"start": (jnp.ones(2), jnp.ones(2)), "steps": 8}, "start must be coordinates"),
    ],
)
def test_nonsense_is_refused_in_one_line(options, message):
    given = {"oscillator": rectangular(), "mesh_frequencies": [1.0]} | options
    with pytest.raises(ValueError, match=message) as caught:
        speed_sweep(**given)
    assert "\n" not in str(caught.value)


def test_many_oscillators_belong_to_the_other_function():
    stacked = jax.vmap(lambda load: rectangular(load=load))(jnp.ones(2))
    with pytest.raises(ValueError, match="must be one; make many"):
        speed_sweep(stacked, SPEEDS)
    with pytest.raises(ValueError, match="must be \\(oscillators, coordinates\\)"):
        speed_sweeps(rectangular(), SPEEDS)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"first": -1.0}, "first = -1 Hz"), ({"duration": 0.1}, "must be at least one for each"), ({"steps": 9}, "even")],
)
def test_a_run_up_refuses_nonsense(options, message):
    with pytest.raises(ValueError, match=message):
        run_up(rectangular(), **({"first": 1.0, "last": 2.0, "duration": 1e4} | options))
