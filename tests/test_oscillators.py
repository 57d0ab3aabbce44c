"""Oscillators of a gear pair: inertias, damping, signs of what excites them, one model as the limit of another."""

import dataclasses
from functools import cache

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxgear import Gear, GearPair
from jaxgear.dynamics import (
    Excitation,
    RectangularStiffness,
    equivalent_mass,
    inertia_of,
    motion,
    on_bearings,
    speed_sweep,
    torsional,
    two_gears,
)
from jaxgear.dynamics.integrate import one_cycle, steps_of

CONSTANT = RectangularStiffness(250.0, 250.0, 0.5)
RECTANGULAR = RectangularStiffness(300.0, 200.0, 0.37)
TORQUE = 200.0
CYCLE = jnp.asarray(np.linspace(0.0, 1.0, 1025))


@cache
def kahraman_blankenship():
    gear = Gear(teeth=50, module=3.0, face_width=20.0, tip_diameter=154.5709)
    return GearPair(gear, gear)


def made(kind=torsional, force=RECTANGULAR, **options):
    given = {"pair": kahraman_blankenship(), "torque": TORQUE, "damping_ratio": 0.05}
    return kind(force, **(given | options))


def test_inertia_of_a_disc_and_of_a_ring():
    gear = kahraman_blankenship().pinion
    assert float(inertia_of(gear)) == pytest.approx(7.80e-3, rel=1e-3)
    assert float(equivalent_mass(kahraman_blankenship())) == pytest.approx(0.785, rel=1e-3)
    ring = dataclasses.replace(gear, bore_diameter=jnp.asarray(75.0))
    assert float(inertia_of(ring) / inertia_of(gear)) == pytest.approx(1 - 0.5**4, rel=1e-12)


def test_equivalent_mass_is_that_of_the_lighter_gear_beside_a_heavy_one():
    pair = kahraman_blankenship()
    radius = float(pair.pinion.base_radius) * 1e-3
    assert float(equivalent_mass(pair, (0.01, 1e9))) == pytest.approx(0.01 / radius**2, rel=1e-9)


def test_damping_is_that_of_the_decay():
    """A free vibration in contact shrinks by exp(-2 pi zeta / sqrt(1 - zeta^2)) per period of its own."""
    oscillator, ratio = made(force=CONSTANT), 0.05
    mass, rest = float(oscillator.mass[0]), float(oscillator.load[0]) / 250.0
    frequency = np.sqrt(250.0e6 / mass * (1 - ratio**2)) / (2 * np.pi)
    steps = steps_of(oscillator, CYCLE)
    (x, _), _ = one_cycle(oscillator, (jnp.array([rest + 1.0]), jnp.zeros(1)), steps, jnp.asarray(frequency))
    assert float(x[0]) - rest == pytest.approx(np.exp(-2 * np.pi * ratio / np.sqrt(1 - ratio**2)), rel=1e-6)


def test_energy_stays_without_damping():
    """Kinetic energy, half the mass times speed squared, plus k q^2 / 2 - F0 q stays where contact does."""
    oscillator = made(force=CONSTANT, damping_ratio=None, damping=0.0)
    load, mass = float(oscillator.load[0]), float(oscillator.mass[0])
    steps = steps_of(oscillator, CYCLE)
    begin = (jnp.array([0.5 * load / 250.0]), jnp.zeros(1))
    x, v = map(np.asarray, one_cycle(oscillator, begin, steps, jnp.asarray(1000.0))[1])
    # um to m: 1e-6 in the work of forces, 1e-12 in squares of speeds
    energy = 0.5 * mass * 1e-12 * v**2 + 1e-6 * (0.5 * 250.0 * x**2 - load * x)
    assert float(x.min()) > 0
    assert np.ptp(energy) < 1e-8 * np.abs(energy).max()


def excitation(**given):
    nothing = {"load": [0.0], "load_angle": [0.0], "displacement": [0.0], "displacement_angle": [0.0], "orders": [1.0]}
    return Excitation(**(nothing | given))


@pytest.mark.parametrize(
    ("given", "amplitude"),
    [
        # slow: q = F0 (1 + a cos) / k
        ({"load": [0.1]}, lambda load, ratio: 0.1 * load / 250.0),
        # a displacement is taken off the DTE, whose inertia then drives it: (m w^2 / k) e / (1 - (w / w_n)^2)
        ({"displacement": [2.0]}, lambda load, ratio: 2.0 * ratio**2 / (1 - ratio**2)),
    ],
)
def test_excitations_have_the_amplitudes_of_a_linear_oscillator(given, amplitude):
    oscillator = made(force=CONSTANT, damping_ratio=0.02, excitation=excitation(**given))
    natural = np.sqrt(250.0e6 / float(oscillator.mass[0])) / (2 * np.pi)
    ratio = 0.1
    found = speed_sweep(oscillator, [ratio * natural], steps=1024)
    exact = amplitude(float(oscillator.load[0]), ratio)
    if "load" in given:
        exact /= 1 - ratio**2
    assert float(found.converged[0]) and float(found.dte_rms[0]) * np.sqrt(2) == pytest.approx(exact, rel=2e-3)
    # velocity is the DTE times its circular frequency
    assert float(found.velocity_harmonics[0, 1]) == pytest.approx(
        2 * np.pi * ratio * natural * np.sqrt(2) * float(found.dte_rms[0]), rel=1e-6
    )


def test_runs_in_diffrax_and_agrees_with_the_steps():
    oscillator = made(force=CONSTANT, excitation=excitation(load=[0.3], displacement=[1.0], orders=[1.0]))
    frequency = jnp.asarray(1500.0)
    rest = float(oscillator.load[0]) / 250.0
    begin = (jnp.array([rest]), jnp.zeros(1))
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(oscillator),
        diffrax.Dopri8(),
        0.0,
        1 / 1500.0,
        1e-6,
        begin,
        args=frequency,
        stepsize_controller=diffrax.PIDController(rtol=1e-10, atol=1e-10),
    )
    end, _ = one_cycle(oscillator, begin, steps_of(oscillator, CYCLE), frequency)
    assert float(jnp.abs(end[0] - begin[0])[0]) > 0.1
    np.testing.assert_allclose(end[0], solution.ys[0][-1], rtol=1e-8)
    np.testing.assert_allclose(end[1], solution.ys[1][-1], rtol=1e-7)


def test_two_gears_vibrate_as_the_torsional_model_and_stiff_bearings_do_not_change_it():
    speeds, steps = [1200.0, 2600.0], 1024
    alone = speed_sweep(made(), speeds, steps=steps)
    both = speed_sweep(made(two_gears, inertias=(7.8030535e-3, 7.8030535e-3)), speeds, steps=steps)
    stiff = np.array([np.eye(2) * 1e5] * 2)
    held = speed_sweep(made(on_bearings, bearing_stiffness=stiff), speeds, steps=steps)
    assert alone.converged.all() and both.converged.all() and held.converged.all()
    for name in ("dynamic_factor", "dte_rms", "contact_loss_share"):
        np.testing.assert_allclose(getattr(both, name), getattr(alone, name), rtol=1e-6)
        np.testing.assert_allclose(getattr(held, name), getattr(alone, name), rtol=0.03)


def test_bearings_carry_the_mesh_force():
    """At rest the centres give way by F / k along the line of action, the pinion backwards, and not across it."""
    stiffness = np.array([np.diag([500.0, 100.0]), np.diag([250.0, 100.0])])
    oscillator = made(
        on_bearings, force=CONSTANT, bearing_stiffness=stiffness, bearing_damping=1e-2 * stiffness / 250.0
    )
    found = speed_sweep(oscillator, [100.0, 200.0], steps=1024)
    load = float(oscillator.load[0])
    expected = [load / 250.0 + load / 500.0 + load / 250.0, -load / 500.0, 0.0, load / 250.0, 0.0]
    np.testing.assert_allclose(found.state[0][0], expected, atol=1e-6)


@pytest.mark.slow
def test_a_bearing_force_is_what_the_centre_of_a_gear_does_not_take_to_accelerate():
    """Newton's law over the cycle, m dv = integral of (mesh force - bearing force) dt, and their means are equal."""
    stiffness = np.array([np.diag([500.0, 100.0]), np.diag([250.0, 100.0])])
    oscillator = made(on_bearings, bearing_stiffness=stiffness, bearing_damping=1e-1 * stiffness / 250.0)
    found = speed_sweep(oscillator, [900.0], steps=512)
    assert found.converged.all() and found.period[0] == 1
    start = tuple(part[0] for part in found.state)
    moved = motion(oscillator, 900.0, start, steps=512)
    held, load = np.asarray(moved.support_force), float(oscillator.load[0])
    assert held.shape == (512, 5) and (held[:, 0] == 0).all()
    nodes = np.append(moved.phase, 1.0)
    once_more = np.vstack([held, held[:1]])
    mean = np.trapezoid(once_more, nodes, axis=0)
    np.testing.assert_allclose(mean, [0.0, -load, 0.0, load, 0.0], atol=1e-3 * load)
    assert np.ptp(held[:, 3]) > 0.05 * load and np.abs(held[:, [2, 4]]).max() < 1e-6 * load
    _, (_, speed) = one_cycle(oscillator, start, steps_of(oscillator, jnp.asarray(nodes)), jnp.asarray(900.0))
    inner = np.asarray(moved.force + oscillator.mesh_damping * moved.dte_rate) - held[:, 3]
    each = 0.5 * (inner[1:] + inner[:-1]) * np.diff(moved.phase) / 900.0
    impulse = np.concatenate([[0.0], np.cumsum(each)])
    gained = float(oscillator.mass[3]) * np.asarray(speed[:, 3] - speed[0, 3]) / oscillator.newton
    jump = int(np.searchsorted(nodes, 0.37))  # where the stiffness of the mesh does
    np.testing.assert_allclose(gained[:jump], impulse[:jump], atol=1e-3 * np.ptp(impulse))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"damping": 1.0}, "give either"),
        ({"damping_ratio": None}, "give either"),
        ({"damping_ratio": -0.1}, "damping_ratio = -0.1 must be"),
        ({"torque": -1.0}, "torque = -1 N m must be greater than 0"),
        ({"torque": [1.0, 2.0]}, "make many with jax.vmap"),
        ({"inertias": (1.0,)}, "must be two numbers"),
        ({"inertias": (1.0, -1.0)}, "inertias = -1 kg m2"),
        ({"mean_stiffness": 0.0}, "mean_stiffness = 0 N/um"),
        ({"kind": on_bearings, "bearing_stiffness": [1.0]}, "bearing_stiffness has shape"),
        ({"kind": on_bearings, "bearing_stiffness": np.zeros((2, 2, 2))}, "must be greater than 0"),
        ({"kind": on_bearings, "bearing_stiffness": [[[1.0, 0.5], [0.0, 1.0]]] * 2}, "must be symmetric"),
    ],
)
def test_nonsense_is_refused_in_one_line(options, message):
    with pytest.raises(ValueError, match=message) as caught:
        made(**options)
    assert "\n" not in str(caught.value)


def test_many_torques_are_made_by_vmap():
    many = jax.vmap(lambda torque: made(torque=torque))(jnp.array([100.0, 200.0]))
    assert many.load.shape == (2, 1)
    np.testing.assert_allclose(many.load[1], made().load, rtol=1e-12)
