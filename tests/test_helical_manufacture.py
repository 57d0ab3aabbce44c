"""Tooth thickness, grinding, charts and tolerances of helical gears: closed forms, limits and geometry in space."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helical_pairs import SIZES, TORQUE, pair_of, solved
from scipy.optimize import minimize

import jaxgear as jg
from jaxgear import geometry, manufacture
from jaxgear.contact import removed_material
from jaxgear.geometry import tooth_thickness
from jaxgear.tolerance import ManufacturedGears, Tolerance, ToleranceClass, deviated_material

GEARS = {
    beta: jg.Gear(
        20, 3.5, 20.0, 0.1809, face_width=23.0, helix_angle=beta, tooth_thickness_allowance=-60.0, addendum=1.1
    )
    for beta in (15.0, -25.0)
}
BALL = 6.0
helical = pytest.mark.parametrize("gear", GEARS.values(), ids=map(str, GEARS))


@helical
def test_a_span_is_normal_base_pitches_and_a_base_tooth_thickness(gear):
    teeth, base = geometry.teeth_spanned(gear), jnp.cos(gear.base_helix_angle)
    wanted = (teeth - 1) * gear.base_pitch * base + tooth_thickness(gear, 2 * gear.base_radius) * base
    found = geometry.span(gear, teeth)
    assert float(found) == pytest.approx(float(wanted), rel=1e-12)
    assert float(geometry.allowance_of_span(gear, teeth, found)) == pytest.approx(-60.0, abs=1e-9)
    # nearest to d + 2 x m, where W_k = d_b tan(alpha_v) / cos(beta_b)
    middle = gear.pitch_radius + gear.profile_shift * gear.module
    nearest = 2 * jnp.sqrt(middle**2 - gear.base_radius**2) / base
    assert abs(float(found - nearest)) <= 0.5 * float(gear.base_pitch * base)


@helical
def test_a_ball_touches_the_helicoids(gear):
    """The flanks of a space in three dimensions, thinned by the allowance, are half a ball away from its centre."""
    radius, tangent = float(gear.base_radius), np.tan(float(gear.base_helix_angle))
    # half the space on the base cylinder; the flank is an involute that turns with the height
    half = np.pi / 20 - 0.5 * float(tooth_thickness(gear, 2 * gear.base_radius)) / radius

    def point(at):
        roll, height = at  # roll angle, height over the section of the centre [mm]
        turn = half + roll + height * tangent / radius
        return np.stack(
            [radius * (np.cos(turn) + roll * np.sin(turn)), radius * (np.sin(turn) - roll * np.cos(turn)), height]
        )

    centre = np.array([0.5 * (float(geometry.over_balls(gear, BALL)) - BALL), 0.0, 0.0])
    found = minimize(lambda at: np.sum((point(at) - centre) ** 2), [0.5, 0.0], method="Nelder-Mead", tol=1e-14)
    assert np.sqrt(found.fun) == pytest.approx(0.5 * BALL, abs=1e-6)
    measured = geometry.over_balls(gear, BALL)
    assert float(geometry.allowance_of_balls(gear, BALL, measured)) == pytest.approx(-60.0, abs=1e-7)


def test_measures_go_to_those_of_spur_gears():
    spur, nearly = ([*geometry.measures(replace(GEARS[15.0], helix_angle=beta))[1:]] for beta in (None, 1e-6))
    np.testing.assert_allclose(nearly, spur, rtol=1e-12)


def test_a_narrow_helical_gear_has_no_span():
    """Both anvils must reach the face: W_k sin(beta_b)."""
    narrow = replace(GEARS[-25.0], face_width=14.0)
    with pytest.raises(ValueError, match=r"teeth = 4 takes 15.03 mm of the face, must take at most 14 mm"):
        geometry.span(narrow, 4)
    assert np.isnan(geometry.measures(narrow).span) and np.isfinite(geometry.measures(GEARS[-25.0]).span)


def test_more_is_ground_where_flanks_are_inclined():
    """The area of a helicoid, summed over triangles between points in space."""
    side = solved()[0].sides[0]
    gear, radius = side.gear, float(side.base_radius)
    form, tip = (float(at) / radius for at in (jg.geometry.outline(gear).form_roll_length, side.tip_roll_length))
    roll, height = np.meshgrid(np.linspace(form, tip, 401), np.linspace(0.0, 20.0, 401), indexing="ij")
    turn = roll + height * np.tan(float(gear.base_helix_angle)) / radius
    points = np.stack(
        [radius * (np.cos(turn) + roll * np.sin(turn)), radius * (np.sin(turn) - roll * np.cos(turn)), height], axis=-1
    )
    edges = points[1:, :-1] - points[:-1, :-1], points[:-1, 1:] - points[:-1, :-1]
    area = np.linalg.norm(np.cross(*edges), axis=-1).sum()
    assert float(manufacture.ground_area(side)) == pytest.approx(2 * 19 * area, rel=1e-4)


CLASSES = ToleranceClass.of(GEARS[15.0], 6)


def test_tolerances_are_of_the_reference_diameter_normal_module_and_true_face():
    diameter = 20 * 3.5 / np.cos(np.deg2rad(15.0))
    assert float(CLASSES.helix_slope) == pytest.approx(
        np.sqrt(2) * (0.05 * np.sqrt(diameter) + 0.35 * np.sqrt(23.0) + 4.0)
    )
    assert float(CLASSES.profile_slope) == pytest.approx(np.sqrt(2) * (0.4 * 3.5 + 0.001 * diameter + 4.0))


def test_deviations_of_helical_gears_are_those_modifications():
    """What a sample removes is what modifications of its amounts remove, where nothing slides."""
    sizes = replace(SIZES, slide_steps=0, contact_nodes=1)
    mesh = jg.prepare(pair_of(), resolution=sizes)
    tolerance = Tolerance.from_class(mesh.pair, 6, misalignment=5.0)
    drawn = ManufacturedGears(tolerance, 2, 7).on(mesh)
    one = eqx.tree_at(
        lambda of: (of.pinion.waviness, of.wheel.waviness, of.pinion.pitch, of.wheel.pitch, of.misalignment),
        jax.tree.map(lambda leaf: leaf[0], drawn),
        replace_fn=jnp.zeros_like,
    )
    flanks = [jg.ProfileSlope(gear.profile_slope) + jg.LeadSlope(gear.helix_slope) for gear in (one.pinion, one.wheel)]
    wanted = removed_material(mesh, TORQUE, pinion=flanks[0], wheel=flanks[1])
    np.testing.assert_allclose(deviated_material(mesh, TORQUE, one).amount, wanted.amount, atol=1e-12)
    assert float(jnp.ptp(wanted.amount, axis=1).max()) > 1.0
    assert abs(float(drawn.pinion.helix_slope[0])) <= float(tolerance.pinion.helix_slope)


@pytest.mark.slow
def test_manufactured_helical_pairs_scatter():
    mesh, nominal = solved()
    gears = ManufacturedGears(Tolerance.from_class(mesh.pair, 6), 16, 1)
    found = jg.monte_carlo(mesh, TORQUE, gears)
    assert found.failed == 0
    assert found.nominal_ppte == pytest.approx(float(jg.peak_to_peak(nominal.transmission_error)), rel=1e-6)
    assert found.mean > found.nominal_ppte and found.std > 0.1
    exact = jg.monte_carlo(mesh, TORQUE, ManufacturedGears(Tolerance(), 16, 1))
    np.testing.assert_allclose([exact.mean, exact.std], [found.nominal_ppte, 0.0], atol=1e-9)
