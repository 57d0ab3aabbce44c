"""Virtual cylindrical gears of bevel pairs: closed forms, the limit of parallel shafts, derivatives, refusals."""

import jax
import numpy as np
import pytest
from catalogue import LINE

import jaxgear as jg
from jaxgear.geometry import BevelPair, virtual_load, virtual_pair


def test_dimensions_of_straight_teeth_at_a_right_angle():
    """tan(delta) = z_1 / z_2, u_v = u^2, and the pitch radii of the back cones at the mean point."""
    bevel = BevelPair(15, 30, 4.0, face_width=20.0)
    pair = virtual_pair(bevel)
    cone = np.arctan(0.5)
    np.testing.assert_allclose((bevel.pinion_pitch_angle, bevel.wheel_pitch_angle), (cone, np.pi / 2 - cone))
    outer = 0.5 * 4.0 * np.hypot(15, 30)
    assert np.isclose(bevel.outer_cone_distance, outer) and np.isclose(bevel.mean_cone_distance, outer - 10.0)
    module = 4.0 * (outer - 10.0) / outer
    assert pair.is_spur and np.isclose(pair.pinion.module, module)
    np.testing.assert_allclose([each.teeth for each in pair.gears], (15 / np.cos(cone), 30 / np.sin(cone)))
    assert np.isclose(pair.wheel.teeth / pair.pinion.teeth, 4.0)
    radii = [0.5 * module * teeth / share for teeth, share in ((15, np.cos(cone)), (30, np.sin(cone)))]
    assert np.isclose(pair.working_center_distance, sum(radii))
    torque, speed = virtual_load(bevel, 100.0, 1500.0)
    assert np.isclose(1e3 * torque / radii[0], 1e3 * 100.0 / (0.5 * module * 15))  # the same tooth force
    assert np.isclose(speed * radii[0], 1500.0 * 0.5 * module * 15)


def test_spiral_teeth_are_helical_ones_of_the_mean_spiral_angle():
    """Tooth numbers by the cones alone, module of the normal section; the hand is that of the pinion."""
    bevel = BevelPair(14, 39, 4.5, face_width=25.0, spiral_angle=35.0, profile_shift=0.3)
    pair = virtual_pair(bevel)
    share = float(bevel.mean_cone_distance / bevel.outer_cone_distance)
    assert np.isclose(pair.pinion.module, 4.5 * share * np.cos(np.deg2rad(35)))
    assert (pair.pinion.helix_angle, pair.wheel.helix_angle) == (35.0, -35.0)
    assert (pair.pinion.profile_shift, pair.wheel.profile_shift) == (0.3, -0.3)
    mean = 4.5 * share * 14  # pitch diameter of the pinion at the mean point
    cosine = np.cos(float(bevel.pinion_pitch_angle))
    assert np.isclose(pair.pinion.module * pair.pinion.teeth / np.cos(np.deg2rad(35)), mean / cosine)


def test_parallel_shafts_are_the_limit():
    """Cones of no angle are cylinders: the pair is that of the same gears, with its path of contact."""
    bevel = BevelPair(19, 48, 3.0, face_width=20.0, shaft_angle=1e-4)
    pair = virtual_pair(bevel)
    plain = jg.GearPair(jg.Gear(19, 3.0, face_width=20.0), jg.Gear(48, 3.0, face_width=20.0))
    assert np.isclose(jg.path_of_contact(pair).contact_ratio, jg.path_of_contact(plain).contact_ratio, rtol=1e-5)
    assert np.isclose(pair.working_center_distance, plain.working_center_distance, rtol=1e-6)


def test_derivatives_of_the_contact_ratio():
    """By the shaft angle and the face width, against differences."""

    def ratio(angle, width):
        bevel = BevelPair(15, 30, 4.0, face_width=width, shaft_angle=angle, spiral_angle=20.0)
        return jg.path_of_contact(virtual_pair(bevel)).contact_ratio

    found = jax.grad(ratio, (0, 1))(80.0, 20.0)
    for number, step in enumerate((1e-3, 1e-3)):
        ends = [
            ratio(*(each + sign * step * (place == number) for place, each in enumerate((80.0, 20.0))))
            for sign in (1, -1)
        ]
        assert np.isclose(found[number], (ends[0] - ends[1]) / (2 * step), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"face_width": 50.0}, "face_width = 50 mm must be at most 33.54"),
        ({"shaft_angle": 150.0}, "the pitch cone of the wheel has 126.2 deg, must be at most 85 deg: a crown gear"),
        ({"spiral_angle": 60.0}, "spiral_angle = 60 deg must be at least -45 deg and at most 45 deg"),
        ({"addendum": 2.0}, "VirtualGear: addendum"),
    ],
)
def test_refusals(options, message):
    with pytest.raises(ValueError, match=message):
        virtual_pair(BevelPair(15, 30, 4.0, **{"face_width": 20.0, **options}))


@pytest.mark.slow
def test_contact_of_virtual_gears():
    """Of tooth numbers that are not whole: between those of the neighbouring whole ones, with the same module."""
    bevel = BevelPair(17, 37, 4.0, face_width=20.0, pinion_bore_diameter=20.0, wheel_bore_diameter=40.0)
    pair = virtual_pair(bevel)
    module, teeth = float(pair.pinion.module), [float(each.teeth) for each in pair.gears]
    means = []
    for rounded in (np.floor, lambda each: each, np.ceil):
        gears = (
            (jg.geometry.VirtualGear if rounded not in (np.floor, np.ceil) else jg.Gear)(
                rounded(each), module, face_width=20.0, bore_diameter=bore
            )
            for each, bore in zip(teeth, (20.0, 40.0))
        )
        cycle = jg.solve(jg.prepare(jg.GearPair(*gears), resolution=LINE), 150.0)
        assert cycle.converged.all()
        means.append(float(np.mean(cycle.transmission_error)))
    assert min(means[0], means[2]) < means[1] < max(means[0], means[2])
