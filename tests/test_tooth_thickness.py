"""Tooth thickness over teeth and balls: geometry of the flanks, known limits, and the way back to an allowance."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import TWO_PAIRS, gear_pair, kahraman_gear

import jaxgear as jg
from jaxgear.contact.kinematics import kinematics
from jaxgear.geometry import (
    allowance_of_balls,
    allowance_of_span,
    measures,
    outline,
    over_balls,
    path_of_contact,
    span,
    teeth_spanned,
)
from jaxgear.manufacture import space_flank
from jaxgear.metrics.stress import single_contact_factors

GEARS = {
    "plain": jg.Gear(20, 3.0, face_width=20.0),
    "shifted": jg.Gear(19, 3.0, profile_shift=0.3, face_width=20.0),
    "thin": jg.Gear(48, 2.5, profile_shift=-0.1, face_width=20.0, tooth_thickness_allowance=-120.0),
}
EVERY = pytest.mark.parametrize("name", GEARS)


@EVERY
def test_span_is_base_pitches_and_a_tooth_on_the_base_circle(name):
    gear = GEARS[name]
    teeth = teeth_spanned(gear)
    on_base = float(jg.geometry.tooth_thickness(gear, 2 * gear.base_radius))
    assert float(span(gear, teeth)) == pytest.approx((teeth - 1) * float(gear.base_pitch) + on_base, rel=1e-13)


def test_span_of_the_tables():
    """The usual table of W_k / m for 20 deg: z = 20, k = 3: 7.6604; z = 50, k = 6: 16.9370."""
    assert float(span(jg.Gear(20, 1.0, face_width=20.0), 3)) == pytest.approx(7.6604, abs=5e-5)
    assert float(span(jg.Gear(50, 1.0, face_width=20.0), 6)) == pytest.approx(16.9370, abs=5e-5)
    assert [teeth_spanned(jg.Gear(z, 1.0, face_width=20.0)) for z in (20, 50)] == [3, 6]


def test_measures_of_a_traced_gear_are_missing_where_those_of_a_concrete_one_are_refused():
    gear, of = GEARS["thin"], jax.jit(measures)
    found = of(gear, 6, 4.25)
    assert float(found.span) == pytest.approx(float(span(gear, 6)), rel=1e-14)
    assert float(found.over_balls) == pytest.approx(float(over_balls(gear, 4.25)), rel=1e-14)
    for teeth, ball in ((20, 2.5), (1, 20.0)):
        assert np.isnan(of(gear, teeth, ball).span) and np.isnan(of(gear, teeth, ball).over_balls)
        for refused, given in ((span, teeth), (over_balls, ball)):
            with pytest.raises(ValueError, match="must be"):
                refused(gear, given)


@EVERY
def test_a_ball_touches_both_flanks(name):
    """The nearest points of the tooth space are half its diameter off a centre on the centreline."""
    gear = GEARS[name]
    mate = jg.Gear(50, gear.module, face_width=20.0)
    side = kinematics(jg.GearPair(gear, mate), jnp.asarray(0.0), TWO_PAIRS, "strain").sides[0]
    ball = 1.7 * float(gear.module)
    dimension = float(over_balls(gear, ball)) - ball
    odd = int(gear.teeth) % 2
    centre = dimension / 2 / (np.cos(np.pi / (2 * float(gear.teeth))) if odd else 1.0)
    roll = jnp.linspace(0.0, gear.tip_roll_length, 20_001)
    flank = space_flank(side, jg.NoModification(), roll)
    distance = np.hypot(flank.x, np.asarray(flank.y) - centre)
    assert distance.min() == pytest.approx(ball / 2, abs=1e-6)
    assert 0 < distance.argmin() < 20_000


@EVERY
def test_allowances_come_back(name):
    gear = GEARS[name]
    wanted = float(gear.tooth_thickness_allowance)
    teeth, ball = teeth_spanned(gear), 1.75 * float(gear.module)
    assert float(allowance_of_span(gear, teeth, span(gear, teeth))) == pytest.approx(wanted, abs=1e-8)
    assert float(allowance_of_balls(gear, ball, over_balls(gear, ball))) == pytest.approx(wanted, abs=1e-6)


def test_the_tooth_that_is_analysed_is_the_mean_of_its_limits():
    gear = jg.Gear(20, 3.0, face_width=20.0, tooth_thickness_allowance=-80.0, tooth_thickness_tolerance=40.0)
    assert float(gear.mean_tooth_thickness_allowance) == 0.5 * (-80.0 - 120.0)


def test_backlash_of_a_drawing():
    """What a thinner span of both gears leaves of play on the line of action is its sum: W_k lies on base tangents."""
    gear = kahraman_gear()
    teeth = teeth_spanned(gear)
    allowance = allowance_of_span(gear, teeth, span(gear, teeth) - 0.068)
    thin = kahraman_gear(tooth_thickness_allowance=allowance)
    assert float(jg.GearPair(thin, thin).backlash) == pytest.approx(2 * 68.0, rel=1e-9)
    assert float(jg.GearPair(thin, gear).backlash) == pytest.approx(68.0, rel=1e-9)


def test_derivatives():
    """dW_k / dE = cos(alpha); M_dK against central differences."""
    gear = lambda allowance: jg.Gear(20, 3.0, face_width=20.0, tooth_thickness_allowance=allowance)  # noqa: E731
    assert float(jax.grad(lambda e: span(gear(e), 3))(-50.0)) == pytest.approx(1e-3 * np.cos(np.deg2rad(20)), rel=1e-12)
    over = lambda e: over_balls(gear(e), 5.25)  # noqa: E731
    central = float(over(-49.0) - over(-51.0)) / 2
    assert float(jax.grad(over)(-50.0)) == pytest.approx(central, rel=1e-6)


def test_what_no_measurement_gives():
    gear = GEARS["plain"]
    with pytest.raises(ValueError, match=r"ball = 0 mm must be greater than 0 mm"):
        over_balls(gear, 0.0)
    with pytest.raises(ValueError, match=r"ball = 2 mm touches no flanks above the root circle"):
        over_balls(gear, 2.0)
    with pytest.raises(ValueError, match=r"measured = 45 mm must be at least 14.* mm and at most 31"):
        allowance_of_span(gear, 3, 45.0)
    with pytest.raises(ValueError, match=r"measured = 50 mm must be greater than 61.* mm"):
        allowance_of_balls(gear, 5.25, 50.0)
    tall = jg.Gear(20, 3.0, face_width=20.0, profile_shift=0.6, addendum=1.25, dedendum=1.25)
    with pytest.raises(ValueError, match="does not protrude beyond the tip circle"):
        over_balls(tall, 4.2)
    # the gears of `gear_pair` stand for traced ones: nothing is refused while tracing
    assert np.isfinite(float(jax.jit(lambda g: over_balls(g, 5.25))(gear_pair().pinion)))


def test_anvils_and_balls_that_miss_the_involute_are_refused():
    gear = GEARS["plain"]
    with pytest.raises(ValueError, match=r"teeth = 15 would touch the flank at a roll length of 64.6.* mm"):
        span(gear, 15)
    with pytest.raises(ValueError, match=r"ball = 40 mm would touch the flank at a roll length of .* mm"):
        over_balls(gear, 40.0)
    with pytest.raises(ValueError, match=r"measured = 200 mm makes the tooth .* mm thicker, must be within 8.86 mm"):
        allowance_of_balls(gear, 5.1, 200.0)


FZG_C = [  # teeth, profile shift, tip diameter; printed: x_E, root diameter, Y_F, Y_S
    ((16, 0.1818, 82.45), (0.1559, 60.893, 2.087, 1.758)),
    ((24, 0.1714, 118.35), (0.1454, 96.799, 1.866, 1.856)),
]


def fzg_c(allowance=-85.0, **options):
    return [
        jg.Gear(z, 4.5, 20.0, x, face_width=14.0, dedendum=1.39, root_radius=0.25, tip_diameter=tip,
                tooth_thickness_allowance=allowance, **options)
        for (z, x, tip), _ in FZG_C
    ]  # fmt: skip


def test_a_thinner_tooth_is_cut_deeper():
    """A listing of the FZG gears C; the tooth is that of a gear with profile shift x_E and the same tip circle."""
    gears = fzg_c()
    pair = jg.GearPair(*gears, 91.5)
    both = single_contact_factors(pair, path_of_contact(pair))
    for gear, factors, ((*_, tip), printed) in zip(gears, both, FZG_C):
        shift = gear.generating_profile_shift
        found = [float(each) for each in (shift, 2 * gear.root_circle_radius, factors.form, factors.correction)]
        np.testing.assert_allclose(found, printed, atol=5.1e-4)
        assert float(2 * gear.tip_radius) == tip
        cut = jg.Gear(gear.teeth, 4.5, 20.0, shift, face_width=14.0, dedendum=1.39, root_radius=0.25, tip_diameter=tip)
        np.testing.assert_allclose(outline(gear).curves[:7], outline(cut).curves[:7], rtol=1e-12)
        np.testing.assert_allclose(
            [outline(gear).form_roll_length, outline(gear).junction_height],
            [outline(cut).form_roll_length, outline(cut).junction_height],
            rtol=1e-12,
        )


def test_the_basic_rack_factor_counts_the_dedendum_that_is_cut():
    stiffness = jg.sizing.iso_stiffness(jg.GearPair(*fzg_c(material=jg.Material(210_000.0)), 91.5))
    assert [float(stiffness.single), float(stiffness.mesh)] == pytest.approx([11.5, 15.2], abs=0.05)


def test_the_root_moves_with_the_allowance_of_traced_gears():
    """dr_f / dE = 1 / (2 tan(alpha_n)), also through the span of a drawing of a helical gear."""
    alpha = np.deg2rad(20.0)

    def root(allowance):
        return jg.Gear(20, 3.0, face_width=20.0, tooth_thickness_allowance=allowance).root_circle_radius

    def drawn(length):
        return jg.geometry.drawn_gear(
            teeth=17, module=8.0, profile_shift=0.14522, helix_angle=15.8, face_width=100.0, tip_diameter=159.66,
            dedendum=1.4, root_radius=0.39, span=length, teeth_spanned=2,
        ).root_circle_radius  # fmt: skip

    assert float(jax.grad(root)(-50.0)) == pytest.approx(1e-3 / (2 * np.tan(alpha)), rel=1e-12)
    value, slope = jax.value_and_grad(drawn)(38.196)
    assert float(2 * value) == pytest.approx(120.825, abs=5e-4)
    assert float(slope) == pytest.approx(1 / (2 * np.sin(alpha)), rel=1e-9)
