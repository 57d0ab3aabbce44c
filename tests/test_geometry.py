"""Gears, pairs and the path of contact against ISO 21771 and published tables."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair, high_contact_ratio_pair, kahraman_gear

import jaxgear as jg
from jaxgear.geometry import outline
from jaxgear.geometry.gear import with_diameters
from jaxgear.geometry.involute import half_tooth_angle, involute

# tip diameter of the 50/50 module 3 gear and the contact ratio it makes
KAHRAMAN_TIPS = {
    153.959: 1.20,
    154.245: 1.28,
    154.5709: 1.37,
    154.680: 1.40,
    155.047: 1.50,
    155.418: 1.60,
    156.0: 1.75467,
}
CONTACT_RATIOS = {(17, 43): 1.6211, (19, 48): 1.6456, (20, 30): 1.6052, (30, 30): 1.6535, (50, 50): 1.7547}


@pytest.fixture(scope="module")
def fzg_c():
    """FZG type C gears with untrimmed tips."""
    pinion = jg.Gear(16, 4.5, 20.0, 0.1817, face_width=14.0, tip_diameter=82.64)
    wheel = jg.Gear(24, 4.5, 20.0, 0.1715, face_width=14.0, tip_diameter=118.54)
    return jg.GearPair(pinion, wheel, center_distance=91.5)


def test_reference_circles():
    gear = jg.Gear(20, 2.5, 20.0, 0.3, face_width=10.0)
    assert float(gear.pitch_radius) == 25.0
    assert float(gear.base_radius) == pytest.approx(25.0 * np.cos(np.deg2rad(20)), rel=1e-15)
    assert float(gear.base_pitch) == pytest.approx(np.pi * 2.5 * np.cos(np.deg2rad(20)), rel=1e-15)
    assert float(gear.tip_radius) == pytest.approx(25.0 + 2.5 * 1.3, rel=1e-15)
    assert float(gear.root_circle_radius) == pytest.approx(25.0 + 2.5 * (0.3 - 1.25), rel=1e-15)
    assert float(gear.bore_radius) == pytest.approx(0.5 * float(gear.root_circle_radius), rel=1e-15)


@pytest.mark.parametrize(("teeth", "ratio"), CONTACT_RATIOS.items())
def test_contact_ratio(teeth, ratio):
    path = jg.path_of_contact(gear_pair(teeth, 3.0, bores=(None, None)))
    assert float(path.contact_ratio) == pytest.approx(ratio, abs=6e-5)


@pytest.mark.parametrize(("tip", "ratio"), KAHRAMAN_TIPS.items())
def test_contact_ratio_set_by_the_tip_diameter(tip, ratio):
    gear = kahraman_gear(tip)
    assert float(jg.path_of_contact(jg.GearPair(gear, gear)).contact_ratio) == pytest.approx(ratio, abs=2e-4)


def test_path_of_contact_table_of_the_kahraman_pair():
    gear = kahraman_gear()
    path = jg.path_of_contact(jg.GearPair(gear, gear))
    assert float(gear.base_radius) == pytest.approx(70.47695, abs=5e-6)
    assert float(gear.base_pitch) == pytest.approx(8.856394, abs=5e-7)
    points = jnp.stack([path.start, path.inner_single, jnp.zeros(()), path.outer_single, path.end])
    # with a contact ratio of 1.37 the double-contact zones are short: A, B, C, D, E in this order
    roll = path.pinion_roll_length(jnp.sort(points))
    np.testing.assert_allclose(roll, [19.5849, 22.8617, 25.6515, 28.4413, 31.7181], atol=1.5e-4)
    np.testing.assert_allclose(
        jg.geometry.roll_angle(gear, roll), [15.9220, 18.5860, 20.8540, 23.1220, 25.7860], atol=1.5e-4
    )
    np.testing.assert_allclose(
        jg.geometry.diameter(gear, roll), [146.2951, 148.1845, 150.0, 151.9988, 154.5709], atol=2e-4
    )


def test_path_of_contact_of_the_fzg_c_gears(fzg_c):
    path = jg.path_of_contact(fzg_c)
    a = float(path.start)
    assert float(path.inner_single) - a == pytest.approx(6.14, abs=0.01)
    assert -a == pytest.approx(9.68, abs=0.01)
    assert float(path.outer_single) - a == pytest.approx(13.28, abs=0.01)
    assert float(path.end) - a == pytest.approx(19.43, abs=0.01)
    assert float(path.pinion_pitch_roll_length + path.wheel_pitch_roll_length) == pytest.approx(34.93, abs=0.01)
    assert float(path.contact_ratio) == pytest.approx(1.4624, abs=3e-4)


def test_high_contact_ratio():
    assert 2.0 < float(jg.path_of_contact(high_contact_ratio_pair()).contact_ratio) < 3.0


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.5, 0.3), (0.4, -0.4), (0.3, -0.5)])
def test_backlash_free_center_distance(shift):
    """Tooth thicknesses at the operating circles fill the operating pitch exactly; ISO 21771's inv formula."""
    pair = gear_pair((20, 31), 2.0, shift=shift, bores=(None, None))
    alpha, working = np.deg2rad(20.0), float(pair.working_pressure_angle)
    inv = lambda t: np.tan(t) - t  # noqa: E731
    assert inv(working) == pytest.approx(inv(alpha) + 2 * np.tan(alpha) * sum(shift) / 51, rel=1e-12)

    distance = float(pair.working_center_distance)
    assert distance == pytest.approx(51 * np.cos(alpha) / np.cos(working), rel=1e-14)
    radii = distance * 20 / 51, distance * 31 / 51
    thickness = sum(
        2 * r * float(half_tooth_angle(gear, jg.geometry.roll_length(gear, 2 * r)))
        for r, gear in zip(radii, (pair.pinion, pair.wheel))
    )
    assert thickness == pytest.approx(2 * np.pi * radii[0] / 20, rel=1e-13)


def test_given_center_distance_sets_the_working_pressure_angle(fzg_c):
    base = float(fzg_c.pinion.base_radius + fzg_c.wheel.base_radius)
    assert float(fzg_c.working_pressure_angle) == pytest.approx(np.arccos(base / 91.5), rel=1e-14)
    assert np.rad2deg(float(fzg_c.working_pressure_angle)) == pytest.approx(22.44, abs=0.01)


def test_wider_center_distance_shortens_the_path():
    gear = kahraman_gear(156.0)
    ratios = [float(jg.path_of_contact(jg.GearPair(gear, gear, a)).contact_ratio) for a in (150.0, 150.2, 150.4)]
    assert ratios[0] > ratios[1] > ratios[2]
    equal = jg.path_of_contact(jg.GearPair(gear, gear))
    assert float(equal.contact_ratio) == pytest.approx(ratios[0], rel=1e-12)


def test_half_tooth_angle_is_the_generated_thickness():
    """Half the rack's space width at the pitch circle, widened by the profile shift."""
    gear = jg.Gear(24, 2.0, 20.0, 0.4, face_width=10.0)
    rho = jg.geometry.roll_length(gear, 2 * gear.pitch_radius)
    thickness = 2 * gear.pitch_radius * half_tooth_angle(gear, rho)
    assert float(thickness) == pytest.approx(2.0 * (np.pi / 2 + 2 * 0.4 * np.tan(np.deg2rad(20))), rel=1e-14)


def test_tooth_space_coordinates():
    """Published half widths and heights of the tooth space of the 50 tooth, module 3 gear at four roll lengths."""
    gear = kahraman_gear()
    rho = jnp.asarray([18.0, 22.0, 25.6515, 29.5])
    angle, radius = jnp.pi / 50 - half_tooth_angle(gear, rho), 0.5 * jg.geometry.diameter(gear, rho)
    np.testing.assert_allclose(radius * jnp.sin(angle), [1.589749, 1.926498, 2.355805, 2.953781], atol=2e-6)
    np.testing.assert_allclose(radius * jnp.cos(angle), [72.721886, 73.805749, 74.962988, 76.344778], atol=2e-6)


def test_involute_function_and_its_derivative():
    t = jnp.asarray([0.0, 0.1, 0.5])
    np.testing.assert_allclose(involute(t), t - np.arctan(t), atol=1e-16)
    np.testing.assert_allclose(jax.vmap(jax.grad(involute))(t), t**2 / (1 + t**2), atol=1e-15)


def test_roll_length_diameter_and_angle_round_trip():
    gear = jg.Gear(19, 3.0, face_width=10.0)
    rho = jnp.linspace(0.0, float(gear.tip_roll_length), 20)
    np.testing.assert_allclose(jg.geometry.roll_length(gear, jg.geometry.diameter(gear, rho)), rho, atol=1e-12)
    np.testing.assert_allclose(jg.geometry.roll_angle(gear, rho), np.rad2deg(rho / gear.base_radius), rtol=1e-15)
    tip = jg.geometry.diameter(gear, gear.tip_roll_length)
    assert float(tip) == pytest.approx(3.0 * 21, rel=1e-15)
    assert float(jg.geometry.roll_length(gear, 2 * gear.base_radius - 1.0)) == 0.0


def test_sliding_and_rolling():
    """Pure rolling at the pitch point; in recess the pinion's surface is the faster one; rigid-body kinematics."""
    pair = gear_pair((19, 48), 3.0)
    path = jg.path_of_contact(pair)
    s, speed = jnp.asarray([float(path.start), 0.0, float(path.end)]), 1500.0
    sliding = path.sliding_speed(s, speed)
    assert float(sliding[1]) == pytest.approx(0.0, abs=1e-15)
    assert float(sliding[0]) < 0 < float(sliding[2])
    omega = 1500 * np.pi / 30
    np.testing.assert_allclose(sliding, omega * (1 + 19 / 48) * s * 1e-3, rtol=1e-13, atol=1e-15)
    pinion, wheel = path.rolling_speeds(s, speed)
    np.testing.assert_allclose(pinion, omega * path.pinion_roll_length(s) * 1e-3, rtol=1e-14)
    np.testing.assert_allclose(pinion - wheel, sliding, rtol=1e-14)


def test_curvatures_add_up_to_the_distance_of_the_base_tangent_points():
    pair = gear_pair((19, 48), 3.0, shift=(0.3, 0.2))
    path = jg.path_of_contact(pair)
    s = jnp.linspace(path.start, path.end, 7)
    first, second = path.pinion_roll_length(s), path.wheel_roll_length(s)
    tangent_points = pair.working_center_distance * jnp.sin(pair.working_pressure_angle)
    np.testing.assert_allclose(first + second, tangent_points, rtol=1e-13)
    np.testing.assert_allclose(1 / path.reduced_radius(s), 1 / first + 1 / second, rtol=1e-13)


def test_path_ends_at_the_tips():
    pair = gear_pair((19, 48), 3.0)
    path = jg.path_of_contact(pair)
    assert float(jg.geometry.diameter(pair.pinion, path.pinion_roll_length(path.end))) == pytest.approx(63.0, rel=1e-14)
    assert float(jg.geometry.diameter(pair.wheel, path.wheel_roll_length(path.start))) == pytest.approx(
        150.0, rel=1e-14
    )
    assert float(path.outer_single - path.start) == pytest.approx(float(pair.base_pitch), rel=1e-14)
    assert float(path.end - path.inner_single) == pytest.approx(float(pair.base_pitch), rel=1e-14)


def test_a_gear_prints_the_diameters_that_follow_from_others():
    """An omitted bore is a held circle all the same: of half the root diameter, 0.5 * 3 * (20 - 2.5)."""
    text = str(jg.Gear(20, 3.0, face_width=10.0))
    assert "bore_diameter=26.25 mm (half the root diameter)" in text and "tip_diameter=66 mm (of the rack)" in text
    given = str(jg.Gear(20, 3.0, face_width=10.0, bore_diameter=30.0, tip_diameter=65.5))
    assert "bore_diameter=30 mm, " in given and "tip_diameter=65.5 mm, " in given


def test_face_width_and_ratio_of_a_pair():
    pair = jg.GearPair(jg.Gear(19, 3.0, face_width=20.0), jg.Gear(48, 3.0, face_width=18.0))
    assert float(pair.face_width) == 18.0
    assert float(pair.gear_ratio) == pytest.approx(48 / 19, rel=1e-15)


def test_every_number_of_a_pair_is_a_differentiable_leaf():
    pair = gear_pair((19, 48), 3.0, tips=(63.0, 150.0))
    assert all(jnp.issubdtype(leaf.dtype, jnp.inexact) for leaf in jax.tree.leaves(pair))
    gradient = jax.grad(lambda p: jg.path_of_contact(p).contact_ratio)(pair)
    # a larger tip circle lengthens the path of contact: d rho / d (2 r) = r / (2 rho)
    rho = float(pair.pinion.tip_roll_length)
    assert float(gradient.pinion.tip_diameter) == pytest.approx(31.5 / (2 * rho) / float(pair.base_pitch), rel=1e-12)


def test_eager_calls_compile_once(caplog):
    """Root searches make no new functions at every call: a second pair without a centre distance compiles nothing."""

    def use(module):
        pair = jg.GearPair(jg.Gear(19, module, face_width=20.0), jg.Gear(48, module, face_width=18.0))
        jg.path_of_contact(pair), pair.working_center_distance, outline(pair.pinion), jg.fewest_pairs(pair)
        jg.iso_relief(pair, 50.0)

    use(3.0)
    with jax.log_compiles():
        use(3.1)
    assert [record.getMessage() for record in caplog.records if "ompil" in record.getMessage()] == []


def test_diameters_that_are_not_given_are_those_of_the_rack_and_follow_traced_numbers():
    open_ended = jg.Gear(19, 3.0, profile_shift=0.2, face_width=18.0)
    numbered = with_diameters(open_ended)
    expected = [3.0 * (19 + 2 * 0.2 + 2 * 1.0), 0.5 * 3.0 * (19 + 2 * 0.2 - 2 * 1.25)]
    np.testing.assert_allclose([numbered.tip_diameter, numbered.bore_diameter], expected, rtol=1e-15)
    assert with_diameters(numbered) is numbered and open_ended.tip_diameter is None is open_ended.bore_diameter
    radii = jax.jacfwd(lambda m: jnp.stack(_radii(with_diameters(jg.Gear(19, m, face_width=18.0)))))
    np.testing.assert_allclose(radii(3.0), [0.5 * 21, 0.25 * 16.5], rtol=1e-14)


def _radii(gear):
    return gear.tip_radius, gear.bore_radius
