"""The rating after ISO 6336: factors by closed forms and limits, S-N lines, spectra, derivatives, bad input."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rated_pairs import FZG_C, STAGE_3, rated, unlimited, with_rating

import jaxgear as jg
from jaxgear.contact.status import Status
from jaxgear.metrics import Lubricant, SNLine
from jaxgear.numerics import changed, quick_jit
from jaxgear.rating import GearRating, Rating, mesh_geometry, rate, rating_findings
from jaxgear.rating.flank import flank_factors
from jaxgear.rating.life import equivalent_torque, safety
from jaxgear.rating.load_factors import (
    constants_of,
    factor_of,
    load_factors,
    resonance_speed,
    run_in,
    transverse_load_factors,
)
from jaxgear.rating.materials import GROUPS, QUALITIES
from jaxgear.rating.root import bending_factors, rim_factor

KS3 = rated(STAGE_3)
PAIR = jg.GearPair(*STAGE_3.gears, STAGE_3.center_distance)


# load factors


def test_resonance_speed_is_that_of_mass_and_spring():
    """n z / 60 = 1 / (2 pi) sqrt(c / m), of a face width of 1 mm."""
    stiffness, mass, teeth = 20.0, 0.05, 19
    frequency = np.sqrt(stiffness * 1e6 / mass) / (2 * np.pi)
    assert float(resonance_speed(teeth, stiffness, mass)) * teeth / 60 == pytest.approx(frequency, rel=1e-12)


@pytest.mark.parametrize("begins", [0.5, 0.85])
def test_every_range_of_speed(begins):
    """The main resonance has one value up to 1.15, supercritical speeds another from 1.5 on, straight between."""
    terms = 0.4, 0.3, 0.9, constants_of(1.6)
    low, main, high = 1 + 0.4 * (0.32 * 0.4 + 0.34 * 0.3 + 0.23 * 0.9), 1 + 0.128 + 0.102 + 0.81, None
    assert float(factor_of(0.4, begins, *terms)) == pytest.approx(low, rel=1e-12)
    assert float(factor_of(1.0, begins, *terms)) == pytest.approx(main, rel=1e-12)
    high = 0.47 * 0.4 + 0.47 * 0.3 + 0.125 * np.sin(np.pi * -0.4) + 0.875
    assert float(factor_of(1.5, begins, *terms)) == pytest.approx(high, rel=1e-12)
    assert float(factor_of(1.325, begins, *terms)) == pytest.approx((main + high) / 2, rel=1e-12)


def test_constants_go_over_at_a_total_contact_ratio_of_two():
    """The table joins within its digits but for C_v3, C_v4 and C_v7 as printed."""
    low, high = (np.asarray(constants_of(ratio)) for ratio in (2.0, 2.0 + 1e-9))
    assert np.allclose(low[[0, 1, 4]], high[[0, 1, 4]], atol=0.01)
    assert np.allclose(constants_of(3.0), [0.32, 0.2111, 0.0667, 0.2692, 0.47, 0.0952, 1.0], atol=1e-4)


def test_running_in_by_material():
    soft = GearRating("through_hardened", 240.0, yield_strength=700.0)
    limit = float(soft.pitting_strength)

    def of(gear, deviation=100.0):
        return [float(run_in(gear, jnp.asarray(deviation), jnp.asarray(velocity))) for velocity in (4.0, 8.0, 20.0)]

    assert np.allclose(of(soft), [160 / limit * 100, 12_800 / limit, 6400 / limit])
    hard = GearRating("case_hardened")
    assert np.allclose(of(hard, 20.0), 1.5) and np.allclose(of(hard), 3.0)
    assert np.allclose(of(GearRating("grey_iron", 200.0)), [27.5, 22.0, 11.0])


def test_transverse_factors_lie_between_even_sharing_and_one_pair():
    geometry = KS3.geometry
    assert np.allclose(transverse_load_factors(geometry, 0.0), 1.0)
    total, along = float(geometry.total_contact_ratio), float(geometry.contact_ratio)
    contact, root = transverse_load_factors(geometry, 1e3)
    assert float(contact) == pytest.approx(total / (along * float(KS3.flank.contact_ratio) ** 2))
    assert float(root) == pytest.approx(total / (0.25 * along + 0.75))


def test_face_load_factor_by_method_c():
    """Of a published pair, from deviations that are printed without decimals; 1.32 printed."""
    rating = changed(
        FZG_C.rating, face_load_factor=None, shaft_deflection=jnp.asarray(6.0), mesh_misalignment=jnp.asarray(8.0)
    )
    pair = jg.GearPair(*FZG_C.gears, FZG_C.center_distance)
    geometry = mesh_geometry(pair, unlimited(pair))
    found = load_factors(pair, geometry, jnp.asarray(130.0), jnp.asarray(1500.0), rating)
    assert float(found.face) == pytest.approx(1.331, abs=2e-3)
    deviation = (1 - 0.15) * (1.33 * 6 + 8)
    load = float(found.line_load * found.dynamic)
    assert float(found.face) == pytest.approx(1 + deviation * float(found.face_mesh_stiffness) / (2 * load), rel=1e-9)
    with pytest.raises(ValueError, match="belong together"):
        Rating(shaft_deflection=6.0)
    with pytest.raises(ValueError, match="has no effect beside face_load_factor"):
        Rating(shaft_deflection=6.0, mesh_misalignment=8.0, face_load_factor=1.2)


def test_slow_gears_are_told():
    assert int(KS3.factors.status) == Status.CONVERGED and KS3.factors.range == "subcritical"
    slow = rated(STAGE_3._replace(speed=100.0))
    assert int(slow.factors.status) == Status.OUT_OF_VALIDITY


# flank and root


def test_factors_of_2019_of_a_helical_pair():
    """f_eps, Y_beta and sigma_F0 of the pair as the formulas of the edition give them by hand."""
    rating = with_rating(STAGE_3, edition="2019").rating
    path = jg.path_of_contact(PAIR)
    found = bending_factors(PAIR, path, KS3.geometry, rating)
    assert float(found.load_sharing) == pytest.approx(0.81575, abs=5e-5)
    assert float(found.helix_angle) == pytest.approx(0.9598, abs=1e-4)
    ratio = 0.81575 * 0.9598 / float(KS3.root.helix_angle)
    assert np.allclose(
        found.nominal_stress(KS3.geometry, STAGE_3.torque), ratio * KS3.bending.nominal_stress, rtol=1e-4
    )


def test_rim_factor_is_continuous_and_grows_as_the_rim_gets_thin():
    gear = STAGE_3.gears[1]
    height = float(gear.tip_radius - gear.root_circle_radius)
    ratios = np.array([0.3, 0.5, 0.8, 1.2, 2.0])
    factors = [float(rim_factor(changed(gear, rim_thickness=jnp.asarray(ratio * height)))) for ratio in ratios]
    assert factors[0] == factors[1] == pytest.approx(1.6 * np.log(2.242 / 0.5))
    assert factors[3] == factors[4] == 1 and factors[2] > 1
    assert 1.6 * np.log(2.242 / 1.2) == pytest.approx(1.0, abs=1e-3)


def test_work_hardening_is_of_the_soft_gear_alone():
    soft = changed(
        STAGE_3.rating.wheel, pitting_limit=None, heat_treatment="through_hardened", hardness=jnp.asarray(240.0)
    )
    rating = changed(STAGE_3.rating, wheel=soft)
    found = flank_factors(PAIR, jg.path_of_contact(PAIR), KS3.geometry, STAGE_3.speed, rating)
    assert np.allclose(found.work_hardening, [1.0, 1.2 - 110 / 1700])  # R_zH is below 3
    assert np.allclose(found.static_work_hardening, [1.0, 1.05 - 110 / 6800])
    # the film of both gears is that of the softer one
    low = 0.83 + 0.08 * (1.313 * 240 + 373 - 850) / 350 if 1.313 * 240 + 373 > 850 else 0.83
    assert float(found.lubricant) == pytest.approx(low + 4 * (1 - low) / (1.2 + 134 / 220) ** 2)


# materials


@pytest.mark.parametrize("name", GROUPS)
def test_every_group_rises_with_quality_and_hardness(name):
    group = GROUPS[name]
    for rows in (group.pitting, group.bending):
        ends = []
        for (low, high), (slope, offset, most) in zip(group.ranges, rows, strict=True):
            assert low < high and slope >= 0
            ends.append(min(slope * high + offset, most))
        assert ends == sorted(ends) and len(ends) == len(QUALITIES)
    cycles, factors = zip(*group.kind.flank, strict=True)
    assert list(cycles) == sorted(cycles) and list(factors) == sorted(factors, reverse=True) and factors[-1] == 1


def test_limits_of_named_steels():
    alloyed = GearRating("through_hardened", 246.0)
    assert float(alloyed.pitting_strength) == pytest.approx(696.0, abs=0.1)
    case = GearRating("case_hardened")
    assert (float(case.pitting_strength), float(case.bending_strength)) == (1500.0, 425.0)
    assert float(GearRating("case_hardened", core_hardness=32.0).bending_strength) == 500.0
    assert float(GearRating("case_hardened", bending_limit=461.0).bending_strength) == 461.0


# life


def test_a_line_and_its_inverse():
    line = KS3.flank_lines[0]
    cycles = jnp.array([1e5, 3e6, 5e7, 2e9])
    assert np.allclose(line.log_cycles(line.bears(cycles) * (1 + 1e-12)), jnp.log(cycles), atol=1e-6)
    assert np.isinf(line.log_cycles(line.stress[-1] * 0.999))
    assert float(line.bears(1.0)) == pytest.approx(float(line.stress[0]), rel=1e-12)
    assert np.allclose(line.damage(line.bears(cycles) * (1 + 1e-12), cycles), 1.0, atol=1e-6)


def test_a_power_law_goes_on_for_ever():
    line = SNLine.power_law(jnp.asarray(1000.0), jnp.asarray(1e6), jnp.asarray(6.0))
    stress = jnp.array([10.0, 1000.0, 3000.0])
    expected = 1e6 * (1000 / stress) ** 6
    assert np.allclose(line.damage(stress, 1.0), 1 / expected, rtol=1e-9)
    assert np.allclose(line.bears(expected[:2]), stress[:2], rtol=1e-9)
    none, slope = jax.value_and_grad(lambda stress: line.damage(stress, 1.0))(0.0)
    assert none == slope == 0


def test_worked_spectrum_with_factors_held():
    """Stresses, damages and safeties of a spectrum of four torques; damages of bins to the printed digits."""
    shares = [0.0005, 0.01, 0.10, 0.8895]
    held = {
        "dynamic_factor": KS3.factors.dynamic,
        "transverse_load_factor": KS3.factors.transverse,
        "service_life": 500.0,
        "application_factor": jnp.asarray(1.0),
        "required_root_safety": 1.0,
        "loads": jg.LoadSpectrum(np.array([7.0, 6.0, 5.0, 2.0]) * STAGE_3.torque, shares, STAGE_3.speed),
    }
    found = rated(with_rating(STAGE_3, **held))
    spectrum, pitting, bending = found.spectrum, found.pitting, found.bending
    assert np.allclose(spectrum.contact_stress[0], [1750.21, 1620.38, 1479.19, 935.52], rtol=3e-4)
    assert np.allclose(spectrum.root_stress[0], [1095.55, 939.05, 782.54, 313.02], rtol=1.2e-3)
    assert np.allclose(spectrum.pitting_damage[0], [0.00166, 0.01069, 0.00914, 0.0], rtol=0.015, atol=1e-9)
    assert np.allclose(spectrum.root_damage[0], [0.0779, 0.544, 1.56, 0.0], rtol=0.015, atol=1e-9)
    assert float(pitting.safety[0]) == pytest.approx(1.2435, rel=1e-3)
    assert float(bending.safety[0]) == pytest.approx(0.9446, rel=2e-3)
    assert float(pitting.static_safety[0]) == pytest.approx(1.3713, rel=1e-3)
    assert float(bending.static_safety[0]) == pytest.approx(2.2085, rel=2e-3)
    # grown by the safety, all bins together use up the life
    grown = found.root_lines[0].damage(bending.safety[0] * spectrum.root_stress[0], spectrum.cycles[0])
    assert float(jnp.sum(grown)) == pytest.approx(1.0, rel=1e-6)
    assert float(found.life[0]) == pytest.approx(500.0 / float(bending.damage[0]), rel=1e-6)


def test_static_strength_is_compared_with_the_load_without_application_factor():
    """K_A of the pair is 1.25, and the contact stress grows with the square root of the load."""
    for verdict, steps in ((KS3.pitting, 2), (KS3.bending, 1)):
        largest = verdict.stress / 1.25 ** (1 / steps)
        assert np.allclose(verdict.static_safety, verdict.static_limit / largest, rtol=1e-12)


def test_safety_of_a_single_bin_is_that_of_the_line():
    line = SNLine(jnp.array([1e5, 5e7, 1e10]), jnp.array([1600.0, 1000.0, 850.0]))

    def of(stress, cycles):
        return safety(line, jnp.array([stress]), jnp.array([cycles]))

    both = quick_jit(jax.value_and_grad(of))
    for cycles in (1e3, 1e6, 1e9, 1e12):  # below static strength, on both slopes, beyond the end
        found, slope = map(float, both(500.0, cycles))
        assert found == pytest.approx(float(line.bears(cycles)) / 500.0, rel=1e-9)
        assert slope == pytest.approx(-float(line.bears(cycles)) / 500.0**2, rel=1e-6)


def test_equivalent_torque():
    """Of one torque its own at so many cycles; bins that come after enough cycles do not count."""
    one = equivalent_torque(jnp.array([100.0]), jnp.array([1e6]), 6.0, 1e6)
    assert float(one) == pytest.approx(100.0)
    torques, cycles = jnp.array([10.0, 100.0, 80.0]), jnp.array([1e9, 1e6, 2e6])
    carried = 1e6 * (100 / 80) ** 6 + 2e6
    expected = 80.0 * (carried / 2e6) ** (1 / 6)
    assert float(equivalent_torque(torques, cycles, 6.0, 2e6)) == pytest.approx(expected)


# derivatives and batches

NAMES = "torque", "speed", "center_distance", "shift", "helix", "viscosity", "roughness", "application", "life", "limit"
START = np.array([40e3, 1200.0, 861.5, 0.5, 10.0, 220.0, 4.8, 1.25, 2e4, 1450.0])


def safeties(values):
    """Safeties S_H, S_F and those of static strength, of both gears."""
    of = dict(zip(NAMES, values, strict=True))
    case = jax.tree.map(lambda leaf: jnp.asarray(leaf, values.dtype), STAGE_3)
    pinion, wheel = (changed(gear, helix_angle=jnp.sign(gear.helix_angle) * of["helix"]) for gear in case.gears)
    offset = jnp.zeros((), values.dtype)
    pair = jg.GearPair(changed(pinion, profile_shift=of["shift"]), wheel, of["center_distance"], offset)
    given = case.rating
    gears = {"pinion": changed(given.pinion, flank_roughness_rz=of["roughness"], pitting_limit=of["limit"])}
    gears |= {"wheel": given.wheel, "lubricant": changed(given.lubricant, viscosity_40=of["viscosity"])}
    rating = changed(given, application_factor=of["application"], service_life=of["life"], **gears)
    found = rate(pair, of["torque"], of["speed"], rating, path=unlimited(pair))
    return jnp.concatenate(
        [found.pitting.safety, found.bending.safety, found.pitting.static_safety, found.bending.static_safety]
    )


def test_derivatives_of_every_safety():
    """Forward in double precision, backward in single, against central differences."""
    along = quick_jit(lambda values, direction: jax.jvp(safeties, (values,), (direction,)))
    directions, step = np.diag(START), 1e-5
    forward, central = [], []
    for direction in map(jnp.asarray, directions):
        forward.append(along(jnp.asarray(START), direction)[1])
        high, low = (along(START + sign * step * direction, direction)[0] for sign in (1, -1))
        central.append((high - low) / (2 * step))
    forward, central = np.stack(forward, axis=1), np.stack(central, axis=1)
    assert np.abs(forward - central).max() < 1e-6 * np.abs(central).max()
    assert (np.abs(forward[:4]).max(axis=0) > 0).all()  # every parameter counts
    against = quick_jit(lambda values, weights: jax.vjp(safeties, values)[1](weights)[0])
    weights = jnp.linspace(1.0, 2.0, len(forward), dtype=jnp.float32)
    backward = np.asarray(against(jnp.asarray(START, jnp.float32), weights)) * START
    expected = np.asarray(weights) @ forward
    assert np.abs(backward - expected).max() < 2e-4 * np.abs(expected).max()


# bad input


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"heat_treatment": "through_hardened"}, "hardness: missing.* 200 to 360 HV"),
        ({"heat_treatment": "through_hardened", "hardness": 500.0}, "hardness = 500 HV must be from 200 to 360 HV"),
        ({"material_quality": "MQ"}, "heat_treatment: missing, material_quality needs it"),
        ({"heat_treatment": "hardened"}, "heat_treatment = 'hardened' must be one of"),
        ({"heat_treatment": "case_hardened", "material_quality": "M"}, "material_quality = 'M' must be one of ML"),
        ({"pitting_limit": 0.0}, "pitting_limit = 0 MPa must be greater than 0"),
        ({"heat_treatment": "gas_nitrided", "core_hardness": 30.0}, "core_hardness has no effect"),
        ({"idler": True, "stress_ratio": -1.0}, "stress_ratio has no effect beside idler"),
        ({"grinding_notch_depth": 0.1}, "belong together"),
    ],
)
def test_settings_of_a_gear_that_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        GearRating(**given)


def test_roughnesses_of_the_same_flanks_agree():
    gears = [GearRating("case_hardened", flank_roughness_ra=roughness) for roughness in (0.4, 0.6)]
    given = {"pinion": gears[0], "wheel": gears[1]}
    Rating(lubricant=Lubricant(220.0, 19.0, 80.0, 0.5), **given)
    message = "flank_roughness_ra = 0.4 and 0.6 um must have the mean lubricant.roughness = 0.6 um"
    with pytest.raises(ValueError, match=message):
        Rating(lubricant=Lubricant(220.0, 19.0, 80.0, 0.6), **given)


def test_ratings_that_are_refused():
    pair, rating = jg.GearPair(*FZG_C.gears, FZG_C.center_distance), FZG_C.rating
    with pytest.raises(ValueError, match="rate: speed = 0 rpm must be greater than 0"):
        rate(pair, 100.0, 0.0, rating)
    with pytest.raises(ValueError, match="rate: torque"):
        rate(pair, -100.0, 100.0, rating)
    polymer = changed(FZG_C.gears[0], material=jg.Material(3000.0))
    with pytest.raises(ValueError, match="elastic_modulus of the pinion = 3000 MPa.*VDI 2736"):
        rate(changed(pair, pinion=polymer), 100.0, 1000.0, rating)
    path = unlimited(pair)
    lacking = {
        "Z_L needs the lubricant": {"lubricant": None},
        "Z_R needs flank_roughness": {
            "pinion": changed(rating.pinion, flank_roughness_rz=None, flank_roughness_ra=None)
        },
        "Y_RrelT needs root_roughness_rz": {"wheel": changed(rating.wheel, root_roughness_rz=None)},
        "K_v needs quality_class": {"wheel": changed(rating.wheel, base_pitch_deviation=None)},
        "needs heat_treatment": {"wheel": changed(rating.wheel, heat_treatment=None)},
        "Y_deltarelT needs yield_strength": {
            "pinion": changed(rating.pinion, heat_treatment="nodular_iron"),
            "wheel": changed(rating.wheel, heat_treatment="nodular_iron"),
        },
    }
    for message, fields in lacking.items():
        with pytest.raises(ValueError, match=message):
            jax.eval_shape(lambda given: rate(pair, 100.0, 1000.0, given, path=path), changed(rating, **fields))


def test_numbers_out_of_validity_are_told():
    fields = {"application_factor": jnp.asarray(0.8), "dynamic_factor": None}
    pinion = changed(STAGE_3.rating.pinion, root_roughness_rz=jnp.asarray(60.0))
    rating = changed(STAGE_3.rating, pinion=pinion, **fields)
    found = KS3.factors
    near = changed(KS3, factors=changed(found, resonance_ratio=jnp.asarray(0.9)))
    keys = {finding.key for finding in rating_findings(PAIR, rating, near)}
    expected = {"application factor K_A", "root roughness Rz", "resonance ratio N", "profile shift x1 - x2"}
    assert keys == expected
