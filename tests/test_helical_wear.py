"""Wear of helical flanks: every slice slides at its own phase and loses what its normal force slides."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helical_pairs import SIZES, TORQUE, pair_of, solved

import jaxgear as jg
from jaxgear import wear
from jaxgear.dynamics import Dynamics, natural_frequencies
from jaxgear.wear.worn_volume import deposit, worn

POINTS, COEFFICIENT = 17, 1e-18
INCLINED = np.cos(np.deg2rad(14.0761))  # base helix angle, of the check values of the pair


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(pair_of(), resolution=SIZES)


@pytest.fixture(scope="module")
def place(mesh):
    return deposit(mesh, jnp.asarray(TORQUE), POINTS)


def slid(mesh):
    """Sliding of every position of every slice on the path of contact [mm], in the transverse section."""
    contact = mesh.path_of_contact
    half = 0.5 * float(contact.base_pitch) / mesh.resolution.positions * np.array([-1, 1])
    ends = np.asarray(mesh.kinematics.path)[..., None] + half
    ends = np.clip(ends, float(contact.start), float(contact.end))
    inverse = 1 / float(contact.pinion_base_radius) + 1 / float(contact.wheel_base_radius)
    return np.diff(0.5 * ends * np.abs(ends), axis=-1)[..., 0] * inverse


def test_every_slice_slides_over_the_whole_path_of_contact(mesh, place):
    contact, found = mesh.path_of_contact, np.asarray(place.sliding)[0].sum(axis=-1)
    np.testing.assert_allclose(found, slid(mesh), atol=1e-12)
    inverse = 1 / float(contact.pinion_base_radius) + 1 / float(contact.wheel_base_radius)
    whole = 0.5 * (float(contact.start) ** 2 + float(contact.end) ** 2) * inverse
    np.testing.assert_allclose(found.sum(axis=(0, 2)), whole, rtol=1e-12)


def test_an_even_load_wears_all_slices_by_the_formula(mesh, place):
    """k w |u1 - u2| / u normal to the flank, and as a modification over cos(beta_b), whatever the phase of a slice."""
    load = jnp.full(mesh.kinematics.path.shape, 100.0)
    depth = np.asarray(worn(load, jnp.zeros_like(load), jnp.full((2, 1, 1, 1), COEFFICIENT), place))[:, 0]
    contact, length = mesh.path_of_contact, np.asarray(place.roll_length)
    at = length[0] - float(contact.pinion_pitch_roll_length), float(contact.wheel_pitch_roll_length) - length[1]
    exact = np.stack([wear.specific_sliding(contact, s)[gear] for gear, s in enumerate(at)])
    exact = 1e9 * COEFFICIENT * 100.0 * exact / INCLINED
    inner = np.abs(np.stack(at)) > 1.5  # of the pitch point, where the depth has a kink
    inner[:, [0, 1, -1]] = False  # ends of the flank, where the contact is as wide as the grid
    error = np.abs(depth - exact[:, None]) / exact.max()
    assert error[np.broadcast_to(inner[:, None], error.shape)].max() < 0.012
    between = np.abs(depth - depth[:, :1]) / depth.max()
    assert between[np.broadcast_to(inner[:, None], between.shape)].max() < 0.002
    assert between.max() < 0.03  # at an end of the flank, where the last position of every slice is cut off elsewhere


@cache
def life_of(beta=15.0, slope=0.0, revolutions=2e6):
    given = {"coefficient": (1.3e-18, 0.4e-18), "blocks": 2, "points": POINTS, "pinion": jg.LeadSlope(slope)}
    found = wear.wear(solved(beta, slope)[0], TORQUE, revolutions, **given)
    assert bool(found.converged.all())
    return found


@pytest.mark.slow
def test_worn_volume_is_coefficient_times_normal_force_times_sliding():
    """Of the contact of new flanks, every gear by its own coefficient and revolutions."""
    mesh, cycle = solved()
    normal = np.asarray(cycle.line_load) * np.asarray(mesh.slice_width)[:, None] / INCLINED
    lost = 1e6 * np.array([1.3e-18, 0.4e-18]) * np.array([1.0, 19 / 48]) * np.sum(normal * slid(mesh))
    # so few revolutions that the flanks stay those
    np.testing.assert_allclose(wear.worn_volume(life_of(revolutions=1e-3))[-1, :, 0], 1e-3 * lost, rtol=1e-5)


@pytest.mark.slow
def test_a_small_angle_wears_as_the_spur_gear():
    spur, small = life_of(None), life_of(1e-6)
    assert float(wear.wear_depth(spur)[-1]) > 0.5
    np.testing.assert_allclose(small.depth, spur.depth, atol=1e-5)


@pytest.mark.slow
def test_the_other_hand_wears_as_the_mirrored_face():
    right, left = life_of(15.0, 20.0), life_of(-15.0, -20.0)
    # contacts that slide down the kinks of a table see rounding
    np.testing.assert_allclose(left.depth[..., ::-1, :], right.depth, atol=1e-6)
    assert float(np.ptp(np.asarray(right.pinion_depth)[-1].max(axis=-1))) > 0.1  # the slope gathers wear at one end


@pytest.mark.slow
def test_the_flanks_of_a_life_give_its_mesh_again():
    life = life_of()
    pinion, wheel = life.flanks()
    again = jg.solve(solved()[0], TORQUE, pinion=pinion, wheel=wheel)
    np.testing.assert_allclose(again.transmission_error, life.cycles.transmission_error[-1], atol=1e-3)
    assert np.abs(again.transmission_error - life.cycles.transmission_error[0]).max() > 0.1


@pytest.mark.slow
def test_slow_gears_wear_as_under_the_static_load():
    settings = Dynamics([1.0], damping_ratio=0.1, model="varying stiffness", positions=16, steps=256)
    mesh = jg.prepare(pair_of(tooth_thickness_allowance=-40.0), resolution=SIZES)
    given = {"coefficient": (COEFFICIENT, COEFFICIENT), "blocks": 2, "points": POINTS, "pinion": jg.LeadSlope(0.0)}
    frequency = float(natural_frequencies(settings.oscillator(mesh, TORQUE)).mesh) / 40
    load = jg.OperatingPoint(TORQUE, 60 * frequency / 19)
    slow, static = wear.wear(mesh, load, 2e6, dynamics=settings, **given), wear.wear(mesh, TORQUE, 2e6, **given)
    assert slow.converged.all() and 1.0 < float(slow.dynamic_factor[0]) < 1.1
    np.testing.assert_allclose(slow.depth, static.depth, atol=0.01 * float(wear.wear_depth(static)[-1]))


@pytest.mark.slow
def test_derivatives_by_angle_and_coefficient_are_central_differences():
    def lost(x):
        mesh = jg.prepare(pair_of(x[0]), resolution=SIZES)
        given = {"coefficient": 1e-18 * x[1], "blocks": 2, "points": POINTS, "pinion": jg.LeadCrowning(5.0)}
        return wear.worn_volume(wear.wear(mesh, TORQUE, 1e5, **given))[-1].sum()

    # the contact is solved to 1e-10 of the volume, which depends little on the angle: smaller steps show that
    at, step, ways = jnp.array([15.0, 1.3]), 1e-2, jnp.eye(2)
    along = jax.jit(lambda x, way: jax.jvp(lost, (x,), (way,)))  # one program for the values too
    wanted = [(along(at + step * way, way)[0] - along(at - step * way, way)[0]) / (2 * step) for way in ways]
    np.testing.assert_allclose([along(at, way)[1] for way in ways], wanted, rtol=3e-5)
