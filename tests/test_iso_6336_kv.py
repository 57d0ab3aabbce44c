"""K_v, K_Halpha and K_Falpha of ISO 6336-1, method B."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helical_pairs import example, pair_of

import jaxgear as jg
from jaxgear.contact.status import Status
from jaxgear.dynamics.iso_6336 import (
    constants_of,
    factor_of,
    iso_dynamic_factor,
    resonance_speed,
    transverse_load_factors,
)
from jaxgear.tolerance import ToleranceClass


@pytest.fixture(scope="module")
def pair():
    def gear():
        return jg.Gear(50, 3.0, face_width=20.0, tip_diameter=154.5709)

    return jg.GearPair(gear(), gear())


def test_resonance_speed_is_that_of_mass_and_spring():
    """The standard's numbers have units of their own: 22.3 N/(mm um) and 0.785 kg over 20 mm."""
    speed = resonance_speed(50, 22.3, 0.785 / 20)
    assert np.isclose(speed, 4552, atol=0.5)
    assert np.isclose(speed * 50 / 60, np.sqrt(22.3e9 * 0.02 / 0.785) / (2 * np.pi))
    assert np.isclose(speed * 50 / 60, 3793.6, atol=0.05)


def test_perfect_gears_at_resonance(pair):
    found = iso_dynamic_factor(pair, torque=200.0, speed=4000.0)
    assert found.range == "main resonance"
    assert np.isclose(found.factor, 1.9)
    assert found.pitch == 0 and found.form == 0 and found.relief == 1


def test_relief_that_takes_the_deflection_leaves_no_term(pair):
    amount = jg.sizing.relief_amount(pair, 200.0)
    found = iso_dynamic_factor(pair, torque=200.0, speed=4000.0, tip_relief=amount)
    assert np.isclose(found.factor, 1.0) and np.isclose(found.relief, 0.0, atol=1e-12)


def test_terms_are_deviations_over_the_deflection_of_one_pair(pair):
    found = iso_dynamic_factor(pair, torque=200.0, speed=2000.0, quality_class=6, application_factor=1.25)
    load = 1.25 * 200e3 / 75 / 20
    assert np.isclose(found.line_load, load)
    limits = ToleranceClass.of(pair.pinion, 6)
    deflection = load / jg.sizing.iso_stiffness(pair, load).single
    assert np.isclose(found.pitch, 0.925 * limits.single_pitch * np.cos(np.deg2rad(20)) / deflection)
    assert np.isclose(found.form, 0.925 * limits.profile_form / deflection)
    ratio = 2000.0 / found.resonance_speed
    assert found.range == "subcritical"
    assert np.isclose(found.factor, 1 + ratio * (0.32 * found.pitch + 0.34 * found.form + 0.23 * found.relief))


def test_every_range_of_speed():
    terms, constants = (0.4, 0.3, 0.2), constants_of(1.37)

    def at(ratio):
        return float(factor_of(jnp.array(ratio), 0.85, *terms, constants))

    main, fast = 1 + 0.32 * 0.4 + 0.34 * 0.3 + 0.9 * 0.2, 0.47 * 0.4 + 0.47 * 0.3 + 0.75
    assert np.isclose(at(0.0), 1.0)
    assert np.isclose(at(0.85), 1 + 0.85 * (0.32 * 0.4 + 0.34 * 0.3 + 0.23 * 0.2))
    assert np.isclose(at(0.86), main) and np.isclose(at(1.15), main)
    assert np.isclose(at(1.5), fast) and np.isclose(at(3.0), fast)
    assert np.isclose(at(1.325), 0.5 * (main + fast))
    assert np.isclose(at(1.15 + 1e-9), main) and np.isclose(at(1.5 - 1e-9), fast)  # linear between, without a step


def test_constants():
    assert np.allclose(constants_of(1.37), [0.32, 0.34, 0.23, 0.90, 0.47, 0.47, 0.75])
    # C_v7 has no step at 1.5 and 2.5
    for end, value in ((1.5, 0.75), (2.5, 1.0)):
        assert np.isclose(constants_of(end)[6], value) and np.isclose(constants_of(end + 1e-9)[6], value)
    # the formulas above 2 begin near the constants below it
    assert np.allclose(constants_of(2.0 + 1e-9), constants_of(2.0), rtol=0.08)
    high = constants_of(2.2)
    assert np.allclose(high[1:4], [0.57 / 1.9, 0.096 / 0.64, 0.46 / 0.76])
    assert np.isclose(high[5], 0.12 / 0.46)


def test_main_resonance_begins_earlier_under_light_load(pair):
    assert iso_dynamic_factor(pair, torque=200.0, speed=100.0).main_resonance_begins == 0.85
    light = iso_dynamic_factor(pair, torque=37.5, speed=100.0)  # 25 N/mm
    assert np.isclose(light.line_load, 25.0)
    assert np.isclose(light.main_resonance_begins, 0.675)


def test_reduced_mass_is_that_of_discs_of_mean_diameter(pair):
    """pi rho u^2 d_m1^4 / (8 (u^2 + 1) d_b1^2), the standard's estimate for solid gears of one material."""
    found = iso_dynamic_factor(pair, torque=200.0, speed=100.0)
    mean, base = 0.5 * (154.5709 + 142.5), 2 * float(pair.pinion.base_radius)
    assert np.isclose(found.reduced_mass, np.pi * 7.85e-6 * mean**4 / (8 * 2 * base**2))
    # for an inertia of its own
    given = iso_dynamic_factor(pair, torque=200.0, speed=100.0, reduced_mass=0.785 / 20)
    assert np.isclose(given.resonance_speed / found.resonance_speed, np.sqrt(found.reduced_mass / (0.785 / 20)))


def test_helical_gears_of_the_worked_example():
    """ISO/TR 6336-30, example 1, prints 1.003."""
    found = iso_dynamic_factor(example(), torque=9000.0, speed=360.0, quality_class=5, tip_relief=70.0)
    assert float(found.factor) == pytest.approx(1.003, abs=5e-4)
    assert np.allclose(found.constants, constants_of(1.54909 + 1.08337), rtol=1e-4)
    pinion, wheel = example().gears
    angle = np.arctan(np.tan(np.deg2rad(20)) / np.cos(np.deg2rad(15.8)))  # of the transverse section
    base = 0.925 * float(ToleranceClass.of(wheel, 5).single_pitch) * np.cos(angle)
    assert float(found.pitch) == pytest.approx(base * 12.37047 / float(found.line_load), rel=1e-6)
    assert float(found.line_load) == pytest.approx(9e6 / float(pinion.pitch_radius) / 100)


def test_a_small_angle_has_the_factor_of_spur_gears():
    spur, nearly, small, large = (
        float(iso_dynamic_factor(pair_of(beta), torque=150.0, speed=6000.0, quality_class=6).factor)
        for beta in (None, 1e-6, 0.1, 15.0)
    )
    assert nearly == pytest.approx(spur, rel=1e-6) and small == pytest.approx(spur, rel=1e-5) and 1 < large < spur


def test_transverse_load_factors_of_the_worked_example():
    """ISO/TR 6336-30, example 1, prints 1 for both; coarser gears have more, up to one pair that carries all."""
    printed, rough, worst = (
        transverse_load_factors(example(), 9000.0, quality_class=of, dynamic_factor=1.003, face_load_factor=1.16)
        for of in (5, 10, 11)
    )
    assert float(printed.contact) == float(printed.root) == 1.0
    limits = ToleranceClass.of(example().wheel, 10)
    base = float(limits.single_pitch) * np.cos(np.deg2rad(20.71975))
    moved = 17.46485 * (float(limits.profile_form) - 0.075 * base) / (1273.524 * 1.003 * 1.16)
    by_hand = 0.9 + 0.4 * np.sqrt(2 * 1.632459 / 2.632459) * moved
    assert float(rough.contact) == float(rough.root) == pytest.approx(by_hand, rel=1e-4) and by_hand > 1.05
    light = transverse_load_factors(example(), 500.0, quality_class=11)
    assert float(worst.contact) > float(rough.contact)
    assert float(light.contact) == pytest.approx(2.632459, rel=1e-5)  # Z_eps^2 = 1 / eps_alpha
    assert float(light.root) == pytest.approx(2.632459 / (0.25 * 1.549090 + 0.75), rel=1e-5)
    given = transverse_load_factors(
        example(), 9000.0, deviations=(base, 0.5 * base), dynamic_factor=1.003, face_load_factor=1.16
    )
    assert float(given.contact) == pytest.approx(
        0.9 + 0.4 * np.sqrt(2 * 1.632459 / 2.632459) * 17.46485 * 0.925 * base / (1273.524 * 1.003 * 1.16), rel=1e-4
    )
    with pytest.raises(ValueError, match="deviations have no effect beside quality_class = 5, give either"):
        transverse_load_factors(example(), 9000.0, quality_class=5, deviations=(10.0, 12.0))


def test_transverse_load_factors_of_spur_gears_and_across_a_total_contact_ratio_of_two():
    spur, nearly = (float(transverse_load_factors(pair_of(b), 150.0, quality_class=9).contact) for b in (None, 1e-6))
    assert nearly == pytest.approx(spur, rel=1e-6) and spur > 1.05
    below, above = (pair_of(15.0, width) for width in (15.655, 15.658))  # eps_beta 0.43
    load = {"quality_class": 9, "torque": 150.0}
    factors = [float(transverse_load_factors(each, **load).contact) for each in (below, above)]
    assert factors[1] == pytest.approx(factors[0], rel=2e-4)


def test_slow_gears_are_told(pair):
    assert iso_dynamic_factor(pair, torque=200.0, speed=500.0).status == Status.OUT_OF_VALIDITY
    assert iso_dynamic_factor(pair, torque=200.0, speed=2000.0).status == Status.CONVERGED


def test_factor_is_differentiable(pair):
    def factor(relief):
        return iso_dynamic_factor(pair, torque=200.0, speed=2000.0, tip_relief=relief).factor

    slope = jax.grad(factor)(3.0)
    assert np.isclose(slope, (factor(3.01) - factor(2.99)) / 0.02, rtol=1e-6) and slope < 0


@pytest.mark.parametrize("name, value", [("torque", 0.0), ("speed", -1.0), ("tip_relief", -1.0), ("run_in", 1.5)])
def test_what_is_refused(pair, name, value):
    with pytest.raises(ValueError, match=f"^{name} = "):
        iso_dynamic_factor(pair, **{"torque": 200.0, "speed": 1000.0, name: value})
