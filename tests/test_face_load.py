"""Load over the face: closed forms, published benchmark, exact derivatives, refusals."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from gearboxes import PINION, WHEEL, gearbox

import jaxgear as jg
from jaxgear.numerics import press
from jaxgear.shafts import (
    Misalignment,
    RigidSupport,
    annex_e,
    axis_tolerance,
    face_load_factor,
    iso_shaft_deflection,
    mesh_stiffness,
    method_c,
    root_face_load_factor,
    support,
)

PAIR = jg.GearPair(PINION, WHEEL)
TORQUE, STIFFNESS, STATIONS = 150.0, 16.0, 41
WIDTH = 18.0
MEAN = 1e3 * TORQUE / (19 * 3.0 * np.cos(np.deg2rad(20.0)) / 2) / WIDTH  # over the base radius of the pinion
pressed = jax.jit(press)


def rigid(misalignment=0.0, *, slope=0.0, torque=TORQUE, stiffness=STIFFNESS):
    """With a flank line of the wheel, so that one program serves them all."""
    given = RigidSupport(PAIR, Misalignment(direct=misalignment))
    return annex_e(given, torque=torque, stiffness=stiffness, stations=STATIONS, wheel=jg.LeadSlope(slope))


@pytest.mark.parametrize("misalignment", [0.0, 10.0, -25.0, 90.0])
def test_load_of_a_skewed_rigid_pair_is_a_straight_line(misalignment):
    """w = c (approach - f y / b) where that is positive, with the mean line load prescribed."""
    found = rigid(misalignment)
    assert found.converged
    y = np.asarray(found.face_coordinate)
    np.testing.assert_allclose(np.mean(found.line_load), MEAN, rtol=1e-12)
    straight = STIFFNESS * np.maximum(float(found.approach) - misalignment * y / WIDTH, 0.0)
    np.testing.assert_allclose(found.line_load, straight, rtol=1e-12, atol=1e-12 * MEAN)
    end = np.abs(misalignment) * (1 - 1 / STATIONS) * STIFFNESS / (2 * MEAN)
    if end < 1:
        np.testing.assert_allclose(found.face_load_factor, 1 + end, rtol=1e-12)
    else:  # part of the face: a triangle, up to the width of a station
        factor = np.sqrt(2 * np.abs(misalignment) * STIFFNESS / MEAN)
        np.testing.assert_allclose(found.face_load_factor, factor, rtol=1.0 / STATIONS)


def test_slope_of_the_flank_line_levels_its_misalignment():
    np.testing.assert_allclose(rigid(20.0, slope=-20.0).face_load_factor, 1.0, rtol=1e-12)
    np.testing.assert_allclose(rigid(20.0).line_load, np.asarray(rigid(-20.0).line_load)[::-1], rtol=1e-12)


def test_misalignment_turns_into_the_plane_of_action():
    """f_ma = (f_Sigma_beta cos + f_Sigma_delta sin) b / L."""
    given = Misalignment(skew=30.0, inclination=20.0, bearing_span=120.0, direct=2.0)
    angle = np.deg2rad(20.0)
    expected = 2.0 + (30.0 * np.cos(angle) + 20.0 * np.sin(angle)) * WIDTH / 120.0
    np.testing.assert_allclose(given.over_face(PAIR), expected, rtol=1e-12)
    largest = axis_tolerance(12.0, WIDTH, 120.0)
    np.testing.assert_allclose(largest.over_face(PAIR), 12.0 * (0.5 * np.cos(angle) + np.sin(angle)), rtol=1e-12)


def test_wind_up_of_the_benchmark():
    """FVA benchmark: mean 1319.34 N/mm, c_gamma 16.70, 41.8 um over the face, K_Hbeta 1.36, K_Fbeta 1.30.

    Its shaft is not published. A gap of that size in the shape of a wind-up, a parabola that is level at the free end,
    gives its factor within 1 %, and a straight one as little as 1.26.
    """
    n = 100
    x = (np.arange(n) + 0.5) / n
    flank = jnp.asarray(np.eye(n) * n / 16.70)

    def factor_of(gap):
        return face_load_factor(pressed(flank, jnp.asarray(41.8 * gap), jnp.asarray(1319.34)).force)

    np.testing.assert_allclose(factor_of(2 * x - x**2), 1.36, rtol=0.01)
    np.testing.assert_allclose(factor_of(x), 1 + 41.8 * 16.70 / (2 * 1319.34), rtol=0.01)
    # a face 6.6 times as wide as the teeth are high
    np.testing.assert_allclose(root_face_load_factor(1.36, 6.6, 1.0), 1.30, atol=0.005)


def test_points_that_all_feel_each_other_meet_every_condition():
    """Random compliances far from diagonal: forces and openings are not negative, and one of them is zero."""
    random = np.random.default_rng(0)
    touching = []
    for softness in (0.01, 0.1, 1.0) * 8:
        part = random.normal(size=(21, 21))
        matrix, gap = part @ part.T / 21 + softness * np.eye(21), 3 * random.normal(size=21)
        load = 10.0 ** random.uniform(-1.0, 2.0)
        found = pressed(jnp.asarray(matrix), jnp.asarray(gap), jnp.asarray(load))
        assert found.converged
        force = np.asarray(found.force)
        opening = matrix @ force + gap - float(found.approach)
        assert force.min() >= -1e-10 and opening.min() >= -1e-10
        np.testing.assert_allclose(force.sum(), load, rtol=1e-10)
        np.testing.assert_allclose(force * opening, 0.0, atol=1e-8)
        touching.append(int(found.in_contact.sum()))
    assert min(touching) < 5 and max(touching) > 12
    idle = pressed(jnp.eye(3), jnp.array([1.0, -2.0, 0.5]), jnp.asarray(0.0))
    np.testing.assert_array_equal(idle.force, 0.0)
    np.testing.assert_allclose([idle.approach, *idle.opening], [-2.0, 3.0, 0.0, 2.5])


def test_root_factor_keeps_to_wide_teeth():
    np.testing.assert_allclose(root_face_load_factor(2.0, 1.0, 1.0), 2.0 ** (9 / 13))
    assert float(root_face_load_factor(1.0, 20.0, 5.0)) == float(root_face_load_factor(1 - 1e-12, 20.0, 5.0)) == 1.0


def test_factor_of_given_line_loads():
    np.testing.assert_allclose(face_load_factor(jnp.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])), [1.5, 1.0])
    np.testing.assert_allclose(face_load_factor(jnp.array([4.0, 1.0]), jnp.array([1.0, 2.0])), 2.0)
    assert np.isnan(face_load_factor(jnp.array([jnp.nan, 1.0])))  # not found is not level
    idle = rigid(10.0, torque=0.0, stiffness=None)
    assert float(idle.face_load_factor) == 1.0 and bool(idle.converged)


def test_method_c_of_a_stiff_pair_meets_the_one_dimensional_analysis():
    """Without running in and shafts both are 1 + f c / (2 w); beyond 2 they are sqrt(2 f c / w)."""
    for f in (8.0, 120.0):
        effective = f / 0.85 if f < 40 else f + 6.0  # what running in leaves of it
        factor = method_c(MEAN, STIFFNESS, 0.0, effective)
        np.testing.assert_allclose(factor, rigid(f).face_load_factor, rtol=1.5 / STATIONS)
    by_hand = 300.0 * 0.023 * (abs(1 + 0.8 * 200 * 10 / 60**2 * (60 / 55) ** 4 - 0.3) + 0.3) * (40 / 60) ** 2
    given = {"arrangement": "a", "span": 200.0, "offset": 10.0}
    np.testing.assert_allclose(iso_shaft_deflection(300.0, 40.0, 60.0, 55.0, **given), by_hand, rtol=1e-12)


def test_default_stiffness_is_that_of_the_standard():
    expected = 0.85 * 19.0448
    np.testing.assert_allclose(mesh_stiffness(PAIR, 200.0), expected, rtol=1e-4)
    found = rigid(10.0, stiffness=None)
    np.testing.assert_allclose(found.face_load_factor, rigid(10.0 * expected / STIFFNESS).face_load_factor, rtol=1e-4)


BOX = gearbox()


def perturbed(values):
    """The stage with another bearing A, wheel shaft, and skew of its mesh."""
    radial, diameter, skew = values
    return eqx.tree_at(
        lambda box: (
            box.shafts[0].bearings[0].radial,
            box.shafts[1].sections[0].diameter,
            box.meshes[0].misalignment.direct,
        ),
        BOX,
        (radial, diameter, skew),
    )


@jax.jit
@jax.value_and_grad
def factor(values):
    box = perturbed(values[:3])
    pinion = jg.LeadSlope(values[3]) + jg.LeadCrowning(values[4])
    return annex_e(support(box, 0), pinion=pinion, stations=11).face_load_factor


@pytest.mark.slow
def test_derivatives_are_central_differences():
    at = np.array([150.0, 40.0, 6.0, 4.0, 5.0])
    there, found = factor(at)
    assert float(there) > 1.05
    for index, value in enumerate(at):
        step = 1e-4 * value * np.eye(5)[index]
        slope = (factor(at + step)[0] - factor(at - step)[0]) / (2e-4 * value)
        np.testing.assert_allclose(found[index], slope, rtol=1e-5, err_msg=str(index))


def test_refusals():
    with pytest.raises(ValueError, match=r"^torque must be given: no coupling has one$"):
        annex_e(RigidSupport(PAIR))
    with pytest.raises(ValueError, match=r"^torque has no effect: that of the couplings counts$"):
        annex_e(support(BOX), torque=20.0)
    with pytest.raises(ValueError, match="^Misalignment: skew = 3 um needs bearing_span"):
        Misalignment(skew=3.0)
    with pytest.raises(ValueError, match="^flank_line = 'round' must be one of none, "):
        method_c(100.0, 16.0, 1.0, 1.0, flank_line="round")
    with pytest.raises(ValueError, match="^through-hardened flanks need endurance_limit"):
        method_c(100.0, 16.0, 1.0, 1.0, hardening="through_hardened")
    with pytest.raises(ValueError, match='^endurance_limit has no effect on hardening = "cast_iron"$'):
        method_c(100.0, 16.0, 1.0, 1.0, hardening="cast_iron", endurance_limit=900.0)
