"""Traces of the measuring machine: places, evaluation range, tolerance band, and deviations of known errors."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import TWO_PAIRS, kahraman_gear

import jaxgear as jg
from jaxgear import manufacture, tolerance
from jaxgear.contact.kinematics import kinematics
from jaxgear.tolerance import ToleranceClass, flank_deviations, helix_trace, profile_trace

_kinematics = eqx.filter_jit(kinematics)


def pinion_of(gear):
    """Pinion of two equal gears."""
    return _kinematics(jg.GearPair(gear, gear), jnp.asarray(0.0), TWO_PAIRS, "strain").sides[0]


@pytest.fixture(scope="module")
def side():
    """Pinion of the 50/50 pair of contact ratio 1.37."""
    return pinion_of(kahraman_gear())


@pytest.fixture(scope="module")
def quality(side):
    return ToleranceClass.of(side.gear, 5.0)


# roll length [mm], roll angle [deg] and diameter [mm] of the path of contact: independent arithmetic on the involute
PLACES = np.array(
    [
        [19.5849, 15.9220, 146.2951],
        [22.8617, 18.5860, 148.1845],
        [25.6515, 20.8540, 150.0000],
        [28.4413, 23.1220, 151.9988],
        [31.7181, 25.7860, 154.5709],
    ]
)


def test_places_along_the_profile(side):
    place_of = jax.jit(tolerance.flank_place)
    for roll, angle, size in PLACES:
        place = place_of(side, roll)
        assert float(place.roll_angle) == pytest.approx(angle, abs=1e-4)
        assert float(place.diameter) == pytest.approx(size, abs=1e-4)
    trace = profile_trace(side, jg.NoModification())
    np.testing.assert_allclose([trace.roll_length[0], trace.roll_length[-1]], PLACES[[0, -1], 0], atol=1e-4)
    np.testing.assert_allclose([trace.diameter[0], trace.diameter[-1]], PLACES[[0, -1], 2], atol=1e-4)


def test_start_of_relief_as_roll_length_angle_and_diameter(side):
    """A relief from the end of single contact starts there."""
    place = manufacture.start_of_relief(side, jg.TipRelief(6.0, side.tip_roll_length - PLACES[3, 0]))
    np.testing.assert_allclose([place.roll_length, place.roll_angle, place.diameter], PLACES[3], atol=1e-4)


def test_removed_material_is_negative_and_the_nominal_involute_zero(side):
    profile = profile_trace(side, jg.TipRelief(6.0, 3.0) + jg.LeadCrowning(4.0), face_coordinate=-10.0)
    assert profile.design[0] == -4.0 and profile.design[-1] == -10.0 and profile.kind == "profile"
    helix = helix_trace(side, jg.LeadCrowning(4.0), points=5)
    np.testing.assert_allclose(helix.design, [-4.0, -1.0, 0.0, -1.0, -4.0], atol=1e-12)
    np.testing.assert_allclose(helix.face_coordinate, [-10.0, -5.0, 0.0, 5.0, 10.0])
    np.testing.assert_allclose(helix.diameter, 150.0)
    assert not (np.asarray(profile_trace(side, jg.NoModification()).design)).any()


def test_band_of_the_class_within_the_evaluation_range(side, quality):
    """F_alpha = 8.5 um of class 5 over 95 % of the profile, F_beta = 9.0 um over the face without its ends."""
    relief = jg.TipRelief(6.0, 3.0)
    profile = profile_trace(side, relief, quality, points=101)
    inside = np.isfinite(profile.upper)
    assert inside[:96].all() and not inside[96:].any(), "points 0 to 95 of 100"
    np.testing.assert_allclose(np.subtract(profile.upper, profile.lower)[inside], 8.5, atol=1e-12)
    np.testing.assert_allclose(np.add(profile.upper, profile.lower)[inside] / 2, np.asarray(profile.design)[inside])
    helix = helix_trace(side, relief, quality, points=41)
    inside = np.isfinite(helix.upper)
    np.testing.assert_allclose(np.asarray(helix.face_coordinate)[inside][[0, -1]], [-9.0, 9.0])
    np.testing.assert_allclose(np.subtract(helix.upper, helix.lower)[inside], 9.0, atol=1e-12)
    assert not np.isfinite(profile_trace(side, relief).upper).any(), "no class, no band"


def test_face_ends_of_a_wide_gear_are_a_module(side):
    """5 % of 20 mm is 1 mm; of a face of 100 mm it would be 5, more than the module of 3 mm."""
    wide = pinion_of(jg.Gear(50, 3.0, face_width=100.0, tip_diameter=154.5709, bore_diameter=50.0))
    np.testing.assert_allclose(tolerance.helix_range(wide), (-47.0, 47.0))
    np.testing.assert_allclose(tolerance.helix_range(side), (-9.0, 9.0))


def test_deviations_of_known_errors(side):
    """A slope of 10 um over the active profile is 9.5 um over its evaluation range, without any form; a wave of 2 um
    has the form of twice its amplitude; both add up, and nothing that is missing beyond the range counts."""
    design = jg.TipRelief(6.0, 3.0)
    nominal = profile_trace(side, design, points=1001)
    sloped = flank_deviations(side, nominal, profile_trace(side, design + jg.ProfileSlope(10.0), points=1001))
    assert float(sloped.slope) == pytest.approx(-9.5), "material removed at the tip is no excess there"
    assert float(sloped.form) == pytest.approx(0.0, abs=1e-9)
    assert float(sloped.total) == pytest.approx(9.5)
    roll = nominal.roll_length
    wave = jg.TabulatedProfile(roll, 2 * jnp.sin(2 * jnp.pi * 20 * (roll - roll[0]) / (0.95 * (roll[-1] - roll[0]))))
    waved = flank_deviations(side, nominal, profile_trace(side, design + wave, points=1001))
    assert float(waved.total) == pytest.approx(4.0, rel=1e-2)
    assert float(waved.form) == pytest.approx(4.0, rel=5e-2)
    chamfer = jg.TipRelief(50.0, 0.04 * (roll[-1] - roll[0]))
    assert float(flank_deviations(side, nominal, profile_trace(side, design + chamfer, points=1001)).total) < 1e-9


def test_excess_material_at_the_tip_counts(side):
    """A lip of 3 um over the last 4 % of the profile, beyond the evaluation range: the slope does not see it, form and
    total do; on a slope the lip stands on the extended mean line. A trace that runs over the tip ends there."""
    nominal = profile_trace(side, jg.NoModification(), points=1001)
    active = nominal.roll_length[-1] - nominal.roll_length[0]
    lip = jg.TabulatedProfile(nominal.roll_length[-1] - active * jnp.asarray([0.04, 0.03]), [0.0, -3.0])
    found = flank_deviations(side, nominal, profile_trace(side, lip, points=1001))
    assert float(found.slope) == pytest.approx(0.0, abs=1e-9)
    assert float(found.form) == pytest.approx(3.0) == float(found.total)
    sloped = flank_deviations(side, nominal, profile_trace(side, lip + jg.ProfileSlope(-10.0), points=1001))
    assert float(sloped.slope) == pytest.approx(9.5) and float(sloped.form) == pytest.approx(3.0)
    assert float(sloped.total) == pytest.approx(13.0), "from the start to the lip"
    over = nominal.roll_length + 0.08 * active
    beyond = [profile_trace(side, each, roll_length=over) for each in (jg.NoModification(), jg.ProfileSlope(-10.0))]
    assert float(flank_deviations(side, *beyond).slope) == pytest.approx(9.5)


def test_deviations_of_the_helix(side):
    nominal, design = helix_trace(side, jg.NoModification()), jg.LeadSlope(10.0)
    found = flank_deviations(side, nominal, helix_trace(side, design))
    assert abs(float(found.slope)) == pytest.approx(9.0) and float(found.form) == pytest.approx(0.0, abs=1e-9)
    nominal = helix_trace(side, jg.NoModification(), points=2001)
    crowned = flank_deviations(side, nominal, helix_trace(side, jg.LeadCrowning(10.0), points=2001))
    assert float(crowned.slope) == pytest.approx(0.0, abs=1e-9)
    assert float(crowned.form) == pytest.approx(8.1, rel=1e-3), "(9 / 10)^2 of the crowning within the range"


def test_traces_that_do_not_match_are_refused(side):
    profile = profile_trace(side, jg.NoModification(), points=11)
    for other in (
        helix_trace(side, jg.NoModification(), points=11),
        profile_trace(side, jg.NoModification(), points=7),
    ):
        with pytest.raises(ValueError, match="measured is a (helix|profile) trace of .* must be a prof"):
            flank_deviations(side, profile, other)


def test_places_that_do_not_match_and_too_few_points_are_refused(side):
    nominal = profile_trace(side, jg.NoModification(), points=11)
    other = profile_trace(side, jg.NoModification(), roll_length=nominal.roll_length + 0.1)
    with pytest.raises(ValueError, match="measured is 0.1 mm off the places of the design"):
        flank_deviations(side, nominal, other)
    tip = profile_trace(side, jg.NoModification(), roll_length=side.tip_roll_length - jnp.asarray([0.2, 0.1]))
    with pytest.raises(ValueError, match="0 points lie in the evaluation range, must be at least 2"):
        flank_deviations(side, tip, tip)
    with pytest.raises(ValueError, match="points = 1 must be a whole number of at least 2"):
        profile_trace(side, jg.NoModification(), points=1)
    with pytest.raises(ValueError, match="face_coordinate = nan mm"):
        profile_trace(side, jg.NoModification(), face_coordinate=np.nan)
    with pytest.raises(ValueError, match="roll_length = -1 mm must be at least 0 mm"):
        helix_trace(side, jg.NoModification(), roll_length=-1.0)


def test_deviations_are_differentiable(side):
    nominal = profile_trace(side, jg.NoModification())

    def slope(amount):
        return flank_deviations(side, nominal, profile_trace(side, jg.ProfileSlope(amount))).slope

    assert float(jax.jit(jax.grad(slope))(3.0)) == pytest.approx(-0.95, rel=1e-2)
