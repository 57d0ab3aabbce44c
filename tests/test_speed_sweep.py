"""Steady vibration over speed: exact orbits, jumps, detached branches, limits, independence of the steps."""

import dataclasses
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from oscillators import DEAD_ZONE, MORE_DAMPED, RECTANGULAR, dead_zone_on_a_moving_base, rectangular

from jaxgear.dynamics import DeadZone, run_up, speed_sweep, speed_sweeps, steps_for
from jaxgear.dynamics.runs import Run, speed_runs
from jaxgear.dynamics.settings import KICKS

STEPS = 512  # of every sweep here but those that reach the printed digits, so that there is one program
SHARPER = 4096  # for six digits: contact is lost within a step, which leaves an error of the square of its length
OMEGA = np.array(sorted({known.omega for known in RECTANGULAR} - {2.0}))  # where a way up or down ends on one of them
SPEEDS = OMEGA / (2 * np.pi)


@cache
def swept(direction="up", kick=None, carry=True, steps=STEPS, kicks=()):
    options = {"direction": direction, "kick": kick, "carry": carry, "steps": steps, "kicks": kicks}
    return jax.tree.map(np.asarray, speed_sweep(rectangular(), SPEEDS, **options))


def loaded(load):
    return dataclasses.replace(rectangular(), load=jnp.reshape(load, (1,)))


def row(response, i):
    names = "dte_mean", "dte_rms", "dte_max", "dte_min", "dynamic_factor"
    return [float(getattr(response, name)[i]) for name in names]


def the_one(knowns, omega, direction):
    """The orbit on which a way over the speeds ends: downwards the strongest of the stable ones, upwards the weakest,
    but at the highest speed, where that of one cycle is unstable.
    """
    stable = [known for known in knowns if known.omega == omega and known.stable]
    return (max if direction == "down" else min)(stable, key=lambda known: known.rms)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_orbits_are_the_exact_ones(direction):
    """To the printed digits."""
    found = swept(direction, steps=SHARPER)
    assert found.converged.all() and found.direction == direction
    for i, omega in enumerate(OMEGA):
        known = the_one(RECTANGULAR, omega, direction)
        assert int(found.period[i]) == known.periods
        numbers = [known.mean, known.rms, known.most, known.least, known.factor]
        np.testing.assert_allclose(row(found, i), numbers, rtol=0, atol=1e-6)
        # an orbit of two cycles is at one of two states
        starts = np.stack([found.poincare_dte[i], found.poincare_velocity[i]], axis=1)
        assert np.abs(starts[:2] - [known.x0, known.v0]).max(axis=1).min() < 1e-6


def test_the_way_down_stays_on_the_upper_branch_until_its_fold():
    up, down = swept("up"), swept("down")
    higher = np.isin(OMEGA, [0.7, 0.8, 1.7])
    assert (down.dynamic_factor > 2 * up.dynamic_factor)[higher].all()
    # where the orbit is unique both ways end on it
    for name in ("dynamic_factor", "dte_rms", "dte_mean"):
        np.testing.assert_allclose(getattr(up, name)[~higher], getattr(down, name)[~higher], rtol=1e-6)


def test_a_kick_finds_the_orbit_of_two_cycles():
    at_rest, kicked = (swept("up", carry=False, kicks=kicks) for kicks in ((1.0,) * len(KICKS), KICKS))
    i = list(OMEGA).index(1.7)
    assert (int(at_rest.period[i]), int(kicked.period[i])) == (1, 2)
    assert float(kicked.dynamic_factor[i]) == pytest.approx(4.168459, abs=1e-5)
    # its cycles alternate: half the mesh frequency is in the force, and in the other orbit it is not
    assert kicked.orders[0] == 0.5
    assert float(kicked.force_harmonics[i, 0]) > 1.0 and float(at_rest.force_harmonics[i, 0]) == 0.0


@pytest.mark.slow
def test_runs_in_one_program_are_those_of_one_each():
    runs = {"up": Run("up"), "down": Run("down"), "kicked": Run("down", 4.5), "kicks": Run("down", None, KICKS)}
    found = speed_runs(rectangular(), SPEEDS, runs, steps=STEPS)
    kicks = swept("down", kicks=KICKS)
    for name, alone in (("up", swept("up")), ("down", swept("down")), ("kicked", swept("down", 4.5)), ("kicks", kicks)):
        assert found[name].direction == alone.direction
        assert jax.tree.all(jax.tree.map(lambda a, b: np.allclose(a, b, rtol=1e-9), found[name], alone))
    assert found["up"].dynamic_factor[3] < found["down"].dynamic_factor[3]


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_of_steps():
    chosen = speed_sweep(rectangular(), SPEEDS, steps=steps_for(rectangular(), SPEEDS))
    for name in ("dynamic_factor", "dte_rms", "force_harmonics", "velocity_harmonics"):
        fine, coarse = (np.asarray(getattr(found, name)) for found in (swept(), chosen))
        assert np.abs(coarse - fine).max() < 1e-3 * np.abs(fine).max()
        if fine.ndim == 1:
            np.testing.assert_allclose(coarse, fine, rtol=1e-3)


@pytest.mark.slow
def test_the_orbit_is_foreseen_before_the_motion_has_settled():
    """Deviations fade by exp(-2 pi zeta / Omega) per cycle: from one to the tolerance takes 18 Omega / (2 pi zeta)."""
    zeta, cycles, unique = 0.01, 60, (OMEGA >= 0.45) & (OMEGA <= 1.0)
    assert (18 * OMEGA / (2 * np.pi * zeta) > 2 * cycles)[unique].all()
    options = {"carry": False, "steps": STEPS}
    few = jax.tree.map(np.asarray, speed_sweep(rectangular(zeta), SPEEDS, most_cycles=cycles, **options))
    assert few.converged[unique].all()
    many = speed_sweep(rectangular(zeta), SPEEDS, most_cycles=5000, tolerance=1e-11, **options)
    for name in ("dynamic_factor", "dte_rms", "period"):
        np.testing.assert_allclose(getattr(few, name)[unique], np.asarray(getattr(many, name))[unique], rtol=1e-6)


def test_more_damping_has_its_exact_orbits_too():
    found = speed_sweep(rectangular(0.08), SPEEDS, direction="down", steps=SHARPER)
    for known in MORE_DAMPED:
        if known.omega <= 1.0:
            i = list(OMEGA).index(known.omega)
            assert float(found.dte_rms[i]) == pytest.approx(known.rms, abs=1e-6)
            assert float(found.dynamic_factor[i]) == pytest.approx(known.factor, abs=1e-6)


def test_slow_speeds_take_more_steps():
    steps = steps_for(rectangular(), SPEEDS[0] * np.array([0.25, 0.5, 1.0, 20.0]))
    assert list(steps) == sorted(steps, reverse=True) and steps[0] >= 4 * steps[2] // 2 > steps[3]


def test_load_that_is_multiplied_multiplies_the_approach():
    """Without a clearance the oscillator is linear in its size: K_v stays, the DTE grows with the load."""
    loads = jnp.array([1.0, 2.0, 5.0])
    stacked = jax.vmap(loaded)(loads)
    batched = speed_sweeps(stacked, SPEEDS, steps=STEPS, batch=2)
    alone = swept()
    for factor, rms, load in zip(np.asarray(batched.dynamic_factor), np.asarray(batched.dte_rms), loads):
        np.testing.assert_allclose(factor, alone.dynamic_factor, rtol=1e-9)
        np.testing.assert_allclose(rms, load * alone.dte_rms, rtol=1e-9)


@pytest.mark.slow
def test_batches_are_what_vmap_makes():
    stacked = jax.vmap(loaded)(jnp.array([1.0, 2.0, 5.0]))
    many = jax.vmap(lambda one: speed_sweep(one, SPEEDS, steps=STEPS))(stacked)
    batched = speed_sweeps(stacked, SPEEDS, steps=STEPS, batch=2)
    assert jax.tree.all(jax.tree.map(lambda a, b: jnp.allclose(a, b, rtol=1e-9), batched, many))


@pytest.mark.parametrize(
    ("steps", "within"), [(4 * STEPS, 1e-6), pytest.param(4 * SHARPER, 1e-8, marks=pytest.mark.slow)]
)
def test_dead_zone_orbits_are_the_exact_ones(steps, within):
    """To the printed digits; eight of the state need more steps."""
    omega = np.array(sorted({known.omega for known in DEAD_ZONE}))
    for direction in ("up", "down"):
        found = speed_sweep(dead_zone_on_a_moving_base(), omega / (2 * np.pi), direction=direction, steps=steps)
        assert found.converged.all()
        for i, at in enumerate(omega):
            known = the_one(DEAD_ZONE, at, direction)
            if (at, direction) == (0.75, "up"):
                continue  # the weak orbit there is not printed
            numbers = [known.mean, known.rms, known.most, known.least]
            np.testing.assert_allclose(row(found, i)[:4], numbers, rtol=0, atol=1e-6)
            np.testing.assert_allclose(found.poincare_dte[i, 0], known.x0, rtol=0, atol=within)
            np.testing.assert_allclose(found.poincare_velocity[i, 0], known.v0, rtol=0, atol=within)


def test_slow_speed_is_the_static_limit():
    """The DTE follows load over stiffness, its harmonic of a linear force that of the displacement, which is 0."""
    linear = dataclasses.replace(dead_zone_on_a_moving_base(), mesh_force=DeadZone(half_clearance=0.0))
    found = speed_sweep(linear, [1e-3 / (2 * np.pi)], steps=4096 * 4)
    assert float(found.dte_mean[0]) == pytest.approx(0.1, rel=1e-6)
    assert float(found.dynamic_factor[0]) == pytest.approx(1.0, abs=2e-6)
    assert float(found.contact_loss_share[0]) == 0.0


def test_shares_of_contact():
    """A light load within a clearance: the flanks are apart for a while, and without coast flanks never on those."""
    found = swept("down")
    assert ((found.contact_loss_share > 0) == (found.dte_min < 0)).all()
    assert not found.back_side_contact.any()


def test_an_undamped_start_never_settles():
    found = speed_sweep(rectangular(0.0), SPEEDS[:1], kick=2.0, steps=STEPS, most_cycles=10)
    assert not found.converged.any() and int(found.period[0]) == 0 and np.isfinite(found.dynamic_factor).all()


def test_flanks_that_a_cycle_hardly_moves_are_not_settled():
    """Far above any resonance flanks thrown apart do not come back within the cycles: the state repeats, falling."""
    found = speed_sweep(rectangular(), 1e9 * SPEEDS, kick=3.0, steps=STEPS, most_cycles=10)
    assert (np.asarray(found.dynamic_factor) < 0.5).all() and not np.any(found.converged)


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
        ({"kicks": [2.0, 0.5]}, "kicks = .*0.5 must be at least 1"),
        ({"kicks": 3.0}, "kicks has shape"),
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
    stacked = jax.vmap(loaded)(jnp.ones(2))
    with pytest.raises(ValueError, match="must be one; many are for speed_sweeps"):
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
