"""Helical gears at speed: the force of their mesh, coast flanks, inclined lines of action on bearings."""

from dataclasses import replace
from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helical_pairs import SIZES, TORQUE, flanks, pair_of

import jaxgear as jg
from jaxgear import dynamics
from jaxgear.contact import removed_material, solve_removed
from jaxgear.contact.mesh import half_way, prepare_from
from jaxgear.dynamics.force_map import _coast_phase, coast_flanks
from jaxgear.dynamics.from_contact import interpolated
from jaxgear.dynamics.integrate import one_cycle, steps_of
from jaxgear.dynamics.oscillator import at_rest
from jaxgear.geometry.involute import half_tooth_angle

SLOPE = flanks(16.0)
MAP = {"torque": TORQUE, "positions": 8, "reach": 3.5}


def prepared(beta=15.0) -> jg.Mesh:
    return jg.prepare(pair_of(beta, tooth_thickness_allowance=-40.0), resolution=SIZES)


mesh_of = cache(prepared)


@cache
def mapped(beta=15.0) -> tuple[jg.Mesh, dynamics.ForceMap]:
    mesh = mesh_of(beta)
    return mesh, dynamics.mesh_force(mesh, **MAP, **SLOPE)


resting = eqx.filter_jit(at_rest)


def static_force(mesh, share=1.0):
    return 1e3 * share * TORQUE / mesh.pair.pinion.base_radius


@pytest.mark.slow
def test_a_load_has_the_transmission_error_of_the_contact_analysis():
    mesh, force = mapped()
    removed = removed_material(mesh, TORQUE, **SLOPE)
    assert bool(force.converged)
    for share in (0.3, 1.0, 3.0):
        cycle = solve_removed(mesh, share * TORQUE, removed)
        found = jax.vmap(force.static_te, (0, None))(mesh.phase, static_force(mesh, share))
        np.testing.assert_allclose(found, cycle.transmission_error, rtol=5e-3)


@pytest.mark.slow
def test_a_small_angle_has_the_springs_of_spur_gears():
    """Of both flanks."""
    spur, nearly, small = (
        dynamics.mesh_force(mesh_of(beta), **MAP, **SLOPE, model="varying stiffness") for beta in (None, 1e-6, 0.05)
    )
    for name in ("start", "spring_stiffness"):
        wanted, found, near = (np.asarray(getattr(each, name)) for each in (spur, nearly, small))
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-5)
        assert np.abs(near - wanted).max() > 1e-4
        np.testing.assert_allclose(near, wanted, rtol=0.01, atol=0.2)


@pytest.mark.slow
def test_a_small_angle_has_the_map_of_spur_gears():
    (_, spur), (_, nearly), (_, small) = map(mapped, (None, 1e-6, 0.05))
    np.testing.assert_allclose(nearly.node_force, spur.node_force, rtol=1e-5, atol=1e-2)
    away = np.abs(np.asarray(small.node_force - spur.node_force)).max()
    assert 1e-2 < away < 0.02 * float(spur.node_force.max())


def test_coast_flanks_touch_where_both_gears_turned_back_put_them():
    """From the flanks' own angles, in every slice of the face: both sides are those of one tooth."""
    mesh = mesh_of()
    pair, contact = mesh.pair, mesh.path_of_contact
    coast = coast_flanks(mesh, jnp.asarray(TORQUE), (None, None))
    angle, play = pair.working_pressure_angle, 1e-3 * pair.backlash

    def centreline(gear, sign, rho):  # beyond the line of centres
        return sign * (jnp.arctan(rho / gear.base_radius) - angle - half_tooth_angle(gear, rho))

    lengths = contact.pinion_roll_length, contact.wheel_roll_length
    for gear, length, sign in zip(pair.gears, lengths, (1, -1)):
        paths = mesh.kinematics.path[1], coast.mesh.kinematics.path[1][:, coast.order]
        there, behind = (centreline(gear, sign, length(path)) for path in paths)
        turned = there - sign * 0.5 * play / gear.base_radius + behind
        pitches = np.asarray(turned * gear.teeth / (2 * jnp.pi))
        np.testing.assert_allclose(pitches, np.round(pitches), atol=1e-9)


@pytest.mark.slow
def test_about_its_middle_a_grid_has_both_flanks_at_the_same_places():
    """In the mirror the face is turned round, and a slope on the coast flanks with it."""
    mesh = jg.prepare(mesh_of().pair, resolution=replace(SIZES, pairs=4))  # wherever the grid begins
    first, shift, play = _coast_phase(mesh)
    middle = 0.5 * (first + shift / 8)
    steps = jnp.floor(8 * middle)
    centred = prepare_from(middle - steps / 8, mesh.pair, mesh.compliance, mesh.resolution, None, mesh.even)
    made = dynamics.mesh_force(centred, **MAP, **SLOPE, coast=(jg.LeadSlope(-16.0), None))
    mirrored = (2 * int(steps) - np.arange(8)) % 8
    np.testing.assert_allclose(made.start[1], made.start[0][mirrored] + play, rtol=0, atol=1e-8)
    np.testing.assert_allclose(made.node_force[1], made.node_force[0][mirrored], rtol=1e-8, atol=1e-6)
    same = dynamics.mesh_force(centred, **MAP, **SLOPE)
    assert np.abs(same.node_force[1] - made.node_force[1]).max() > 0.01 * float(made.node_force.max())


def test_deviations_keep_their_place_on_the_flank():
    """What is linear along the path of every slice is found again between the positions."""
    mesh = mesh_of()
    finer = half_way(mesh)
    rates = jnp.arange(1.0, 6.0)[None, :, None]
    given = rates * mesh.kinematics.path + rates**2
    wanted = rates * finer.kinematics.path + rates**2
    found = np.asarray(interpolated(given, mesh, finer))
    inside = np.asarray(finer.kinematics.path < mesh.kinematics.path.max(axis=(0, 2), keepdims=True))
    assert (~inside).sum() <= 5
    np.testing.assert_allclose(found[inside], np.asarray(wanted)[inside], rtol=1e-12)


@pytest.mark.slow
def test_loaded_errors_excite_as_harmonics_do():
    """Of a mean stiffness: m q'' + c q' + k (q - q_0(phase)) = 0 about the mean, harmonic by harmonic."""
    mesh, _ = mapped()
    force = dynamics.mesh_force(mesh, **MAP | {"positions": 64}, **SLOPE, model="loaded error")
    load, stiffness = static_force(mesh), float(force.spring_stiffness[0])
    oscillator = dynamics.torsional(force, mesh.pair, TORQUE, damping=2e-3, mean_stiffness=None)
    error = jax.vmap(lambda phase: force.static_te(phase, load))(jnp.arange(4096) / 4096)
    order, natural = np.arange(1, 200), float(dynamics.natural_frequencies(oscillator).mesh)
    frequencies = np.array([0.3, 0.7]) * natural
    found = dynamics.speed_sweep(oscillator, frequencies, steps=1024)
    turn = 2 * np.pi * np.outer(frequencies, order)
    answer = stiffness / (stiffness - float(oscillator.mass[0]) / 1e6 * turn**2 + 2e-3j * turn)
    harmonics = np.abs(answer * np.fft.rfft(np.asarray(error))[order] / 4096)
    assert found.converged.all() and not found.contact_loss_share.any()
    np.testing.assert_allclose(found.dte_rms, np.sqrt(2 * np.sum(harmonics**2, axis=1)), rtol=1e-3)


@pytest.mark.slow
def test_contact_lines_that_overlap_excite_less():
    """At 15 degrees, half of a base pitch over the face, the largest dynamic factor is 1.9, that of spur gears 2.8."""
    loudest = {}
    for beta in (None, 15.0):
        mesh, force = mapped(beta)
        oscillator = dynamics.torsional(force, mesh.pair, TORQUE, damping_ratio=0.05)
        natural = float(dynamics.natural_frequencies(oscillator).mesh)
        found = dynamics.speed_sweep(oscillator, natural * np.linspace(0.3, 1.2, 10), steps=256)
        assert found.converged.all()
        loudest[beta] = float(found.dynamic_factor.max()) - 1
    assert loudest[15.0] < 0.6 * loudest[None]


@pytest.mark.slow
def test_derivatives_by_the_helix_angle_are_central_differences():
    def at(beta):
        force = dynamics.mesh_force(prepared(beta), **MAP, **SLOPE, model="varying stiffness")
        both = jnp.asarray([20.0, -110.0])  # on drive and coast flanks
        return jax.vmap(lambda dte: force(jnp.asarray(0.3), dte))(both)

    value, step = jnp.asarray(15.0), 1e-4
    _, found = jax.jvp(at, (value,), (jnp.ones_like(value),))
    wanted = (at(value + step) - at(value - step)) / (2 * step)
    assert np.abs(wanted).min() > 1.0
    np.testing.assert_allclose(found, wanted, rtol=1e-5)


BEARINGS = np.array([np.diag([500.0, 300.0, 80.0]), np.diag([700.0, 400.0, 120.0])])
SPRING = dynamics.RectangularStiffness(250.0, 250.0, 0.5)


def held(stiffness=BEARINGS, beta=15.0, force=SPRING, **options):
    damped = options if "damping" in options else {"damping_ratio": 0.05} | options
    return dynamics.on_bearings(force, pair_of(beta), TORQUE, bearing_stiffness=stiffness, **damped)


def test_bearings_carry_the_axial_force():
    """F tan(beta_b): a right-hand pinion that drives counterclockwise, seen from the positive end, is pushed there."""
    for beta in (15.0, -15.0):
        oscillator = held(beta=beta)
        found = resting(oscillator, jnp.asarray(0.2))
        load = float(static_force(mesh_of()))
        along = load * np.tan(float(pair_of(beta).pinion.base_helix_angle))
        x = np.asarray(found.coordinates)
        np.testing.assert_allclose(x[1:4], [-load / 500.0, 0.0, along / 80.0], atol=1e-9)
        np.testing.assert_allclose(x[4:7], [load / 700.0, 0.0, -along / 120.0], atol=1e-9)
        assert np.sign(x[3]) == np.sign(beta)
        # virtual work: every bearing gives way by F times its share of the DTE over its stiffness
        tangent = np.tan(float(pair_of(beta).pinion.base_helix_angle))
        given = load * (1 / 250.0 + 1 / 500.0 + 1 / 700.0 + tangent**2 * (1 / 80.0 + 1 / 120.0))
        assert x[0] == pytest.approx(given, rel=1e-9)


def test_natural_frequencies_are_those_of_the_inclined_spring():
    """From the stiffness matrix k d d^T of a spring along the contact normal; without an axis along which it yields it
    is that of the transverse plane."""
    oscillator = held()
    t = np.tan(float(pair_of().pinion.base_helix_angle))
    d = np.array([1.0, 1.0, 0.0, -t, -1.0, 0.0, t])
    stiffness = 250.0 * np.outer(d, d)
    stiffness[1:4, 1:4] += BEARINGS[0]
    stiffness[4:, 4:] += BEARINGS[1]
    root = np.sqrt(np.asarray(oscillator.mass))
    highest = np.sqrt(1e6 * np.linalg.eigvalsh(stiffness / np.outer(root, root))[-1]) / (2 * np.pi)
    assert float(dynamics.natural_frequencies(oscillator).highest) == pytest.approx(highest, rel=1e-9)
    stiff = BEARINGS.copy()
    stiff[:, 2, 2] = 1e7
    plane = held(BEARINGS[:, :2, :2])
    assert plane.direction.shape == (5,)
    rigid, flat = (resting(each, jnp.asarray(0.2)).coordinates for each in (held(stiff), plane))
    np.testing.assert_allclose(np.asarray(rigid)[[0, 1, 2, 4, 5]], flat, atol=1e-4)


def test_settings_with_a_third_direction_are_those_bearings():
    given = {name: np.diag(each) for name, each in zip(("pinion_bearing", "wheel_bearing"), BEARINGS)}
    dampings = {f"{name}_damping": 1e-4 * values for name, values in given.items()}
    made = dynamics.Dynamics([1000.0], **given, **dampings).masses(SPRING, pair_of(), jnp.asarray(TORQUE))
    wanted = held(bearing_damping=1e-4 * BEARINGS)
    for name in ("direction", "mass", "stiffness", "damping", "load"):
        np.testing.assert_allclose(getattr(made, name), getattr(wanted, name), rtol=1e-12)


def test_a_spur_pair_does_not_move_along_its_axis():
    found = at_rest(held(beta=None), jnp.asarray(0.0)).coordinates
    assert not np.asarray(found)[[3, 6]].any()


def test_energy_stays_without_damping():
    """Kinetic energy and that of mesh and bearings, of all seven coordinates."""
    oscillator = held(damping=0.0)
    rest = at_rest(oscillator, jnp.asarray(0.0)).coordinates
    start = rest + jnp.asarray([0.5, 0.3, -0.2, 0.4, 0.1, 0.2, -0.3]), jnp.zeros(7)
    steps = steps_of(oscillator, jnp.linspace(0.0, 1.0, 1025))
    x, v = map(np.asarray, one_cycle(oscillator, start, steps, jnp.asarray(1000.0))[1])
    d, mass, ground = (np.asarray(part) for part in (oscillator.direction, oscillator.mass, oscillator.stiffness))
    elastic = 0.5 * 250.0 * (x @ d) ** 2 + 0.5 * np.sum(x @ ground * x, axis=1) - x @ np.asarray(oscillator.load)
    kinetic = 0.5 * 1e-6 * v**2 @ mass
    assert (x @ d).min() > 0 and np.ptp(kinetic) > 0.2
    assert np.ptp(kinetic + elastic) < 1e-6 * np.ptp(kinetic)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"bearing_damping": np.zeros((2, 2, 2))}, "bearing_damping is of 2 directions, must be of 3 as bearing_stiff"),
        ({"stiffness": np.zeros((2, 4, 4))}, r"must be \(2, 2, 2\) or \(2, 3, 3\)"),
    ],
)
def test_bearings_of_other_directions_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        held(**options)
