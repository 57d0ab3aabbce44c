"""Friction, heat, film and safety of a lubricated mesh, against closed forms, limits and scaling laws."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair

import jaxgear as jg
from jaxgear import metrics
from jaxgear.contact import OperatingPoint, solve_at
from jaxgear.metrics import LUBRICANT_QUANTITIES, STRENGTH_QUANTITIES

OIL = metrics.Lubricant(220.0, 19.0, 80.0, 0.4, permissible_film=0.2, scuffing_temperature=300.0)
LINES = {"pitting_exponent": 13.0, "pitting_cycles": 5e7, "bending_exponent": 9.0, "bending_cycles": 3e6}
STRENGTH = metrics.Strength(1500.0, wheel_pitting=1400.0, bending=900.0, wheel_bending=800.0, pressure=2000.0, **LINES)
TORQUE, SPEED = 200.0, 2250.0
POINT = (TORQUE, SPEED, 12.0, 80.0, 0.4)  # torque, speed, amount of relief, temperature, roughness
PITCH = 0  # position and pair that touch at the pitch point


@pytest.fixture(scope="module")
def mesh():
    """The gears of the FZG test rig, type C, tips not cut back."""
    pinion = jg.Gear(
        16, 4.5, profile_shift=0.1817, face_width=14.0, tip_diameter=82.636, bore_diameter=30.0, root_radius=0.375
    )
    wheel = jg.Gear(
        24, 4.5, profile_shift=0.1715, face_width=14.0, tip_diameter=118.544, bore_diameter=30.0, root_radius=0.375
    )
    pair = jg.GearPair(pinion, wheel, center_distance=91.5)
    return jg.prepare(pair, resolution=LINE)


@pytest.fixture(scope="module")
def solve(mesh):
    """Solves unmodified flanks at a torque and a speed, and another coefficient of friction where it is given."""
    return lambda torque=TORQUE, *running: dataclasses.replace(
        jg.solve(mesh, torque), operating_point=OperatingPoint(torque, *(running or (SPEED,)))
    )


@pytest.fixture(scope="module")
def cycle(solve):
    return solve()


def relieved(mesh, torque, amount):
    relief = jg.TipRelief(amount, 4.0)
    return jg.solve(mesh, torque, pinion=relief, wheel=relief)


def numbers(cycle, x):
    """Of a cycle by torque, speed, amount of relief, temperature and roughness."""
    torque, speed, _, temperature, roughness = x
    cycle = dataclasses.replace(cycle, operating_point=OperatingPoint(torque, speed))
    oil = metrics.Lubricant(220.0, 19.0, temperature, roughness, permissible_film=0.2, scuffing_temperature=300.0)
    least = (
        metrics.scuffing_safety(cycle, oil),
        metrics.micropitting_safety(cycle, oil),
        *metrics.local_root_safety(cycle, STRENGTH),
        metrics.pressure_safety(cycle, STRENGTH),
    )
    return jnp.stack(
        [
            *(jnp.min(field) for field in least),
            *metrics.pitting_safety(cycle, STRENGTH),
            metrics.loss_power(cycle, oil),
            metrics.mesh_efficiency(cycle, oil),
            metrics.bulk_temperature(cycle, oil),
            metrics.bulk_temperature(cycle, dataclasses.replace(oil, bulk="loss")),
            jg.quantities["relative_ppte"](cycle),
            jg.quantities["force_excitation"](cycle),
            *metrics.pitting_damage(cycle, STRENGTH),
            *metrics.root_damage(cycle, STRENGTH),
        ]
    )


@eqx.filter_jit
def _along(cycle, x, way_of_cycle, way):
    moving, rest = eqx.partition(cycle, eqx.is_inexact_array)
    return jax.jvp(lambda moving, x: numbers(eqx.combine(moving, rest), x), (moving, x), (way_of_cycle, way))


def along(cycle, x, way, ends):
    """Numbers of a cycle, and their slope in a direction in which it changes from one cycle to another one."""
    (low, below), (high, above) = ends
    parts = (eqx.filter(end, eqx.is_inexact_array) for end in (below, above))
    change = jax.tree.map(lambda a, b: jnp.asarray((np.asarray(b) - np.asarray(a)) / (high - low)), *parts)
    return map(np.asarray, _along(cycle, jnp.asarray(x), change, jnp.asarray(way)))


@pytest.fixture(scope="module")
def with_slope(mesh):
    """Numbers with the contact behind them, and their slope in a direction."""

    def of(x):
        torque, speed, amount, *_ = x
        relief = jg.TipRelief(amount, 4.0)
        return numbers(jg.solve(mesh, OperatingPoint(torque, speed), pinion=relief, wheel=relief), x)

    return jax.jit(lambda x, way: jax.jvp(of, (x,), (way,)))


def pitch_pair(cycle):
    """Number of the pair that touches at the pitch point at position 0."""
    return int(np.argmin(np.abs(np.asarray(cycle.kinematics.path)[:, 0, PITCH])))


# oil


def test_viscosity_is_what_was_measured_and_lies_on_walthers_line():
    np.testing.assert_allclose(OIL.kinematic_viscosity(jnp.array([40.0, 100.0])), [220.0, 19.0], rtol=1e-12)
    cold, hot, asked = np.log10(np.array([40.0, 100.0, 70.0]) + 273.15)
    thick, thin = np.log10(np.log10(np.array([220.0, 19.0]) + 0.7))
    expected = 10**10 ** (thick + (thin - thick) * (asked - cold) / (hot - cold)) - 0.7
    assert float(OIL.kinematic_viscosity(70.0)) == pytest.approx(expected, rel=1e-12)


def test_density_and_pressure_viscosity_by_hand():
    density = 43.37 * np.log10(220.0) + 805.5
    assert float(OIL.density_at(16.0)) == pytest.approx(density, rel=1e-12)
    assert float(OIL.density_at(116.0)) == pytest.approx(density - 70.0, rel=1e-12)
    given = dataclasses.replace(OIL, density=900.0)
    assert float(given.viscosity(40.0)) == pytest.approx(220e-6 * (900.0 - 0.7 * 24.0), rel=1e-12)
    for base, at_38 in (("mineral", 2.657e-8 * 0.2**0.1348), ("pao", 1.466e-8 * 0.2**0.0507)):
        # thick as 0.2 Pa s at 38 degC, where the law of temperature is 1
        oil = dataclasses.replace(OIL, base=base)
        oil = dataclasses.replace(oil, density=1e6 * 0.2 / float(oil.kinematic_viscosity(38.0)) + 0.7 * 22.0)
        assert float(oil.pressure_viscosity(38.0)) == pytest.approx(at_38, rel=1e-9)
        ratio = 1 + 516 * (1 / 373 - 1 / 311)
        assert float(oil.pressure_viscosity(100.0)) == pytest.approx(at_38 * ratio, rel=1e-9)


# friction and loss


@pytest.mark.parametrize("law, factor", [("schlenk", 0.048), ("iso_6336_20", 0.060), ("iso_6336_22", 0.045)])
def test_friction_by_hand(cycle, law, factor):
    base_radius = 36.0 * np.cos(np.deg2rad(20.0))
    working = np.arccos(base_radius * 2.5 / 91.5)
    rolling = 2 * (SPEED * np.pi / 30) * 36.6e-3 * np.sin(working)  # 2 v_t sin(alpha_wt)
    radius = base_radius * np.tan(working) * 0.6  # u / (u + 1)
    load = 1e3 * TORQUE / base_radius / 14.0
    if law == "iso_6336_20":
        load *= np.cos(np.deg2rad(20.0))  # F_t / b
    eta = 1e3 * float(OIL.viscosity(80.0))
    surface = 2.2 * (0.4 / radius) ** 0.25 if law == "iso_6336_22" else 0.4**0.25
    expected = factor * (load / (rolling * radius)) ** 0.2 * eta**-0.05 * surface
    oil = dataclasses.replace(OIL, friction=law)
    assert float(metrics.friction_coefficient(cycle, oil)) == pytest.approx(expected, rel=1e-9)
    slippery = dataclasses.replace(oil, friction_factor=0.5)
    assert float(metrics.friction_coefficient(cycle, slippery)) == pytest.approx(0.5 * expected, rel=1e-9)
    pao = dataclasses.replace(oil, base="pao")
    assert float(metrics.friction_coefficient(cycle, pao)) == pytest.approx(0.8 * expected, rel=1e-9)


def test_load_factors_strain_the_film_but_do_not_heat(cycle):
    """They count for friction, flash temperature and pressure; power loss and its heat are those of the torque."""
    plain = dataclasses.replace(OIL, friction="iso_6336_22", bulk="loss")
    loaded = dataclasses.replace(plain, load_factor=1.7)
    rubs = 1.7**0.2

    def ratio(of, offset=0.0):
        before, after = (np.asarray(of(cycle, oil)) - offset for oil in (plain, loaded))
        return np.max(after) / np.max(before)

    assert ratio(metrics.friction_coefficient) == pytest.approx(rubs, rel=1e-9)
    assert ratio(metrics.loss_power) == pytest.approx(rubs, rel=1e-9)
    assert ratio(metrics.bulk_temperature, 80.0) == pytest.approx(rubs**0.72, rel=1e-9)
    assert ratio(metrics.lubricated_flash_temperature) == pytest.approx(rubs * 1.7**0.75, rel=1e-9)
    assert np.min(metrics.film_thickness(cycle, loaded)) < np.min(metrics.film_thickness(cycle, plain))
    schlenk = dataclasses.replace(loaded, friction="schlenk")
    assert float(metrics.friction_coefficient(cycle, schlenk)) == float(metrics.friction_coefficient(cycle, OIL))
    few = metrics.Strength(1500.0, bending=900.0, pressure=2000.0)
    many = dataclasses.replace(few, load_factor=1.7)
    for name, power in (("pinion_pitting_safety", 0.5), ("wheel_root_safety", 1.0), ("pressure_safety", 0.5)):
        safe, strained = (float(strength.quantity(name)(cycle)) for strength in (few, many))
        assert safe / strained == pytest.approx(1.7**power, rel=1e-9), name


def test_friction_scales_with_the_powers_of_its_law(cycle):
    def logarithm(x):
        torque, speed, roughness, density = jnp.exp(x)
        running = dataclasses.replace(cycle, operating_point=OperatingPoint(torque, speed))
        oil = metrics.Lubricant(220.0, 19.0, 16.0, roughness, density=density)  # at 16 degC it has its density
        return jnp.log(metrics.friction_coefficient(running, oil))

    exponents = jax.jit(jax.grad(logarithm))(jnp.log(jnp.array([TORQUE, SPEED, 0.4, 900.0])))
    np.testing.assert_allclose(exponents, [0.2, -0.2, 0.25, -0.05], rtol=1e-9)


def test_a_coefficient_of_the_load_takes_the_place_of_the_law(solve):
    given = solve(TORQUE, SPEED, 0.07)
    assert float(metrics.friction_coefficient(given, OIL)) == pytest.approx(0.07)
    for name in ("loss_power", "mesh_efficiency", "max_flash_temperature"):
        assert float(OIL.quantity(name)(given)) == pytest.approx(float(jg.quantities[name](given)), rel=1e-12)


def test_power_loss_is_friction_force_times_sliding(solve):
    given = solve(TORQUE, SPEED, 0.07)
    kinematics = given.kinematics
    sliding = np.abs(np.asarray(kinematics.path_of_contact.sliding_speed(kinematics.path[:, 0], SPEED)))
    watt = (0.07 * np.asarray(given.pair_force) * sliding).sum(0).mean()
    assert float(metrics.loss_power(given)) == pytest.approx(watt, rel=1e-12) and watt > 100
    efficiency = 1 - watt / (TORQUE * SPEED * np.pi / 30)
    assert float(metrics.mesh_efficiency(given)) == pytest.approx(efficiency, rel=1e-12)
    assert float(metrics.loss_power(solve(TORQUE, 0.0, 0.07))) == 0.0


# temperatures


def test_at_the_pitch_point_the_contact_is_as_hot_as_the_teeth(cycle):
    hot = np.asarray(metrics.contact_temperature(cycle, OIL)) - float(metrics.bulk_temperature(cycle, OIL))
    assert hot[pitch_pair(cycle), 0, PITCH] == pytest.approx(0.0, abs=1e-12)
    assert hot.max() > 20 and hot.min() >= 0.0
    coefficient = metrics.friction_coefficient(cycle, OIL)
    np.testing.assert_allclose(hot, metrics.flash_temperature(cycle, SPEED, friction=coefficient), atol=1e-10)


def test_bulk_temperature_rises_with_the_mean_of_flash_or_with_the_loss(cycle):
    inside = np.asarray(cycle.kinematics.outside)[:, 0] <= 0
    flash = np.asarray(metrics.lubricated_flash_temperature(cycle, OIL))[:, 0]
    rise = 0.47 * flash[inside].mean()
    # 23 of the places on the path are at positions; the path is 23.4 steps long
    assert float(metrics.bulk_temperature(cycle, OIL)) - 80.0 == pytest.approx(rise, rel=1 / inside.sum())
    spray = dataclasses.replace(OIL, bulk="loss", cooling_factor=1.2)
    kilowatt = 1e-3 * float(metrics.loss_power(cycle, OIL))
    rise = 7400 * (kilowatt / (91.5 * 14.0)) ** 0.72
    assert float(metrics.bulk_temperature(cycle, spray)) == pytest.approx(80.0 + rise, rel=1e-9)
    cold = dataclasses.replace(OIL, cooling_factor=0.0)
    assert float(metrics.bulk_temperature(cycle, cold)) == 80.0


# film


def test_film_at_the_pitch_point_is_that_of_dowson_and_higginson(cycle):
    """The classical form in line load, entrainment and radius, in SI; there is no flash there."""
    bulk = metrics.bulk_temperature(cycle, OIL)
    eta, alpha = float(OIL.viscosity(bulk)), float(OIL.pressure_viscosity(bulk))
    contact, pair = cycle.kinematics.path_of_contact, pitch_pair(cycle)
    radius = 1e-3 * float(contact.reduced_radius(0.0))
    modulus = 206e9 / (1 - 0.3**2)  # E_r = 2 E*
    entrainment = float(contact.pinion_roll_length(0.0)) * 1e-3 * SPEED * np.pi / 30
    load = 1e3 * float(cycle.line_load[pair, 0, PITCH])
    group = alpha * modulus, eta * entrainment / (modulus * radius), load / (modulus * radius)
    film = 1.6e6 * radius * group[0] ** 0.6 * group[1] ** 0.7 * group[2] ** -0.13
    found = metrics.film_thickness(cycle, OIL)
    assert float(found[pair, 0, PITCH]) == pytest.approx(film, rel=1e-9) and 0.05 < film < 1.0
    # away from it the oil is hotter in the contact than on the teeth, and the film thinner
    assert float(jnp.min(found)) < film
    apart = np.asarray(cycle.contact_pressure) == 0
    assert apart.any() and (np.asarray(found)[apart] == 1000.0).all()


def test_film_scales_with_speed_load_and_viscosity(cycle):
    pair = pitch_pair(cycle)

    def logarithm(x):
        load, speed, density = jnp.exp(x)
        running = dataclasses.replace(
            cycle, operating_point=OperatingPoint(TORQUE, speed, 0.05), line_load=cycle.line_load * load
        )
        oil = metrics.Lubricant(220.0, 19.0, 16.0, 0.4, density=density, cooling_factor=0.0)
        return jnp.log(metrics.film_thickness(running, oil)[pair, 0, PITCH])

    exponents = jax.jit(jax.grad(logarithm))(jnp.log(jnp.array([1.0, SPEED, 900.0])))
    # at 16 degC the viscosity goes with the density; its pressure coefficient with that at 38 degC
    at_38 = 0.6 * 0.1348 * 900.0 / (900.0 - 0.7 * 22.0)
    np.testing.assert_allclose(exponents, [-0.13, 0.7, 0.7 + at_38], rtol=1e-9)


def test_no_oil_is_as_hot_as_that(cycle):
    """Beyond 510 degC nothing thickens under pressure any more: there is no film, and no NaN."""
    hot = dataclasses.replace(OIL, bulk="loss", cooling_factor=10.0)
    assert float(metrics.bulk_temperature(cycle, hot)) > 250
    fast = dataclasses.replace(cycle, operating_point=OperatingPoint(TORQUE, 50 * SPEED, 0.3))
    film = np.asarray(metrics.film_thickness(fast, hot))
    assert film[cycle.contact_pressure > 0].min() == 0.0 and np.isfinite(film).all()
    assert float(hot.quantity("micropitting_safety")(fast)) == 0.0


# stresses and safety


def test_nominal_contact_stress_is_that_of_iso_6336(cycle):
    contact = cycle.kinematics.path_of_contact
    alpha, working = np.deg2rad(20.0), np.arctan(float(contact.pinion_pitch_roll_length / contact.pinion_base_radius))
    zone = np.sqrt(2 * np.cos(working) / (np.cos(alpha) ** 2 * np.sin(working)))
    elasticity = np.sqrt(206e3 / (1 - 0.3**2) / 2 / np.pi)
    ratio = float(contact.contact_ratio)
    sharing = np.sqrt((4 - ratio) / 3)
    base = np.array([72.0, 108.0]) * np.cos(alpha)
    tip = np.sqrt((np.array([82.636, 118.544]) / base) ** 2 - 1)
    single = np.tan(working) / np.sqrt((tip[0] - 2 * np.pi / 16) * (tip[1] - (ratio - 1) * 2 * np.pi / 24))
    np.testing.assert_allclose([zone, elasticity, sharing, single], [2.3419, 189.81, 0.9197, 1.0702], rtol=1e-4)
    nominal = zone * elasticity * sharing * np.sqrt(1e3 * TORQUE / 36.0 * 2.5 / (72.0 * 14.0 * 1.5))
    stress = metrics.nominal_contact_stress(cycle)
    assert float(stress.pinion) == pytest.approx(nominal * single, rel=1e-6)
    other = np.tan(working) / np.sqrt((tip[1] - 2 * np.pi / 24) * (tip[0] - (ratio - 1) * 2 * np.pi / 16))
    assert float(stress.wheel) == pytest.approx(nominal * max(other, 1.0), rel=1e-6)
    # one by one
    factors = metrics.rating_factors(cycle)
    names = "zone_factor", "elasticity_factor_sqrt_MPa", "contact_ratio_factor", "pinion_single_pair_contact_factor"
    np.testing.assert_allclose([factors[name] for name in names], [zone, elasticity, sharing, single], rtol=1e-6)
    assert float(factors["tangential_force_N"]) == pytest.approx(1e3 * TORQUE / 36.0, rel=1e-12)
    assert float(factors["nominal_contact_stress_MPa"]) == pytest.approx(nominal, rel=1e-6)
    bent = metrics.nominal_root_stress(cycle)
    for name in ("pinion", "wheel"):
        assert float(factors[f"{name}_contact_stress_MPa"]) == pytest.approx(float(getattr(stress, name)), rel=1e-12)
        product = 1e3 * TORQUE / 36.0 / (14.0 * 4.5)
        for factor in ("form", "stress_correction"):
            product *= float(factors[f"{name}_{factor}_factor"])
        assert product == pytest.approx(float(factors[f"{name}_nominal_root_stress_MPa"]), rel=1e-12)
        assert float(factors[f"{name}_root_stress_MPa"]) == pytest.approx(float(getattr(bent, name)), rel=1e-12)
        assert float(getattr(bent, name)) == pytest.approx(product, rel=1e-12)


def test_root_safety_is_that_of_iso_6336_whatever_shares_the_load(cycle):
    """By the published Y_F and Y_S at the outer point of single contact, where extended contact takes a share."""
    published = {"pinion": (900.0, 1.6889 * 1.8514), "wheel": (800.0, 1.5832 * 1.9165)}
    for gear, (strength, factors) in published.items():
        expected = strength / (1e3 * TORQUE / 36.0 / (14.0 * 4.5) * factors)
        assert float(STRENGTH.quantity(f"{gear}_root_safety")(cycle)) == pytest.approx(expected, rel=2e-4)
        assert 1.03 < float(STRENGTH.quantity(f"{gear}_local_root_safety")(cycle)) / expected < 1.07


@pytest.mark.slow
def test_uneven_load_over_the_face_counts_in_the_nominal_stresses(mesh):
    sliced = jg.prepare(mesh.pair, resolution=jg.Resolution(positions=8, pairs=2, slices=3))
    stress = []
    for slope in (0.0, 20.0):
        cycle = jg.solve(sliced, TORQUE, pinion=jg.LeadSlope(slope))
        names = "face_load_factor", "root_face_load_factor", "pinion_contact_stress", "pinion_root_stress"
        factor, of_root, contact, root = (float(jg.quantities[name](cycle)) for name in names)
        stress.append((contact / np.sqrt(factor), root / of_root))
        one = metrics.rating_factors(cycle)
        found = [float(one[key]) for key in ("face_load_factor", "pinion_contact_stress_MPa", "pinion_root_stress_MPa")]
        np.testing.assert_allclose(found, [factor, contact, root], rtol=1e-12)
    assert factor > 1.05 and stress[1] == pytest.approx(stress[0], rel=1e-9)


def test_safety_is_what_is_borne_over_what_is_there(cycle):
    def number(name):
        return float(jg.quantities[name](cycle))

    safety = {name: float(STRENGTH.quantity(name)(cycle)) for name in STRENGTH_QUANTITIES}
    expected = {
        "pinion_pitting_safety": 1500.0 / number("pinion_contact_stress"),
        "wheel_pitting_safety": 1400.0 / number("wheel_contact_stress"),
        "pinion_root_safety": 900.0 / number("pinion_root_stress"),
        "wheel_root_safety": 800.0 / number("wheel_root_stress"),
        "pinion_local_root_safety": 900.0 / number("pinion_local_root_stress"),
        "wheel_local_root_safety": 800.0 / number("wheel_local_root_stress"),
        "pressure_safety": 2000.0 / number("max_contact_pressure"),
    }
    turns = 1.0, float(cycle.kinematics.pair.pinion.teeth / cycle.kinematics.pair.wheel.teeth)
    for gear, turned in zip(("pinion", "wheel"), turns):  # by the safety factors: N = N_0 S^p
        expected[f"{gear}_pitting_damage"] = 1e6 * turned / 5e7 * expected[f"{gear}_pitting_safety"] ** -13
        expected[f"{gear}_root_damage"] = 1e6 * turned / 3e6 * expected[f"{gear}_root_safety"] ** -9
    assert safety == pytest.approx(expected, rel=1e-12)
    # S-N curves of the wheel alone
    own = {f"wheel_{name}": value + 1.0 for name, value in LINES.items()}
    other = metrics.Strength(1500.0, wheel_pitting=1400.0, bending=900.0, wheel_bending=800.0, **LINES, **own)
    for name, power, cycles in (("pitting", -14, 5e7 + 1), ("root", -10, 3e6 + 1)):
        damage = 1e6 * turns[1] / cycles * expected[f"wheel_{name}_safety"] ** power
        assert float(other.quantity(f"wheel_{name}_damage")(cycle)) == pytest.approx(damage, rel=1e-12)
        pinion = float(other.quantity(f"pinion_{name}_damage")(cycle))
        assert pinion == pytest.approx(expected[f"pinion_{name}_damage"], rel=1e-12)
    alike = metrics.Strength(1500.0, bending=900.0)
    assert float(alike.quantity("wheel_root_safety")(cycle)) == pytest.approx(900.0 / number("wheel_root_stress"))
    oiled = {name: float(OIL.quantity(name)(cycle)) for name in LUBRICANT_QUANTITIES}
    assert oiled["micropitting_safety"] == pytest.approx(oiled["min_film_thickness"] / 0.4 / 0.2, rel=1e-12)
    rise = oiled["max_contact_temperature"] - 80.0
    assert oiled["scuffing_safety"] == pytest.approx((300.0 - 80.0) / rise, rel=1e-12)


def test_damage_goes_with_a_power_of_half_the_exponent(solve):
    """Contact stress goes with the root of the torque."""
    named = STRENGTH.quantity("pinion_pitting_damage")
    low, high = (float(named(solve(torque))) for torque in (50.0, 100.0))
    assert high == pytest.approx(low * 2**6.5, rel=1e-9)


@pytest.mark.slow
def test_the_mean_of_damage_over_a_spectrum_is_the_damage_sum():
    mesh = jg.prepare(gear_pair(), resolution=LINE)
    named = STRENGTH.quantity("pinion_pitting_damage")
    load = jg.LoadSpectrum([50.0, 100.0], [3.0, 1.0])
    found = jg.sweep(
        mesh,
        load,
        lambda x: (jg.TipRelief(x["amount"], 3.0), None),
        jg.FullFactorial({"amount": (0.0, 5.0)}, 2),
        results=(named,),
    )
    low = float(named(jg.solve(mesh, 50.0)))
    np.testing.assert_allclose(found.column(named.key), low * (0.75 + 0.25 * 2**6.5), rtol=1e-9)


@pytest.mark.slow
def test_without_load_slopes_through_the_contact_are_finite(with_slope):
    values, slopes = with_slope(jnp.array([0.0, *POINT[1:]]), jnp.array([1.0, 0.0, 0.0, 0.0, 0.0]))
    assert values[:7] == pytest.approx(1000.0) and np.isfinite(values).all() and np.isfinite(slopes).all()


@pytest.mark.slow
def test_without_load_nothing_fails_and_slopes_are_finite(mesh, solve):
    """Numbers that are not finite are those of failed contacts, which count as the worst of all."""
    still, light = relieved(mesh, 0.0, POINT[2]), relieved(mesh, 1e-3, POINT[2])
    values, slopes = along(still, [0.0, *POINT[1:]], [1.0, 0.0, 0.0, 0.0, 0.0], ((0.0, still), (1e-3, light)))
    assert values[:7] == pytest.approx(1000.0) and np.isfinite(values).all() and np.isfinite(slopes).all()
    idle = solve(0.0)
    assert float(OIL.quantity("min_film_thickness")(idle)) == 1000.0
    assert float(OIL.quantity("mesh_efficiency")(idle)) == 1.0
    assert float(OIL.quantity("max_contact_temperature")(idle)) == 80.0


# what excites


def test_relative_error_and_force_of_a_constant_stiffness(cycle):
    curve = cycle.transmission_error
    relative = float(jg.quantities["relative_ppte"](cycle))
    assert relative == pytest.approx(float(np.ptp(curve)) / float(np.mean(curve)), rel=1e-12)
    spring = dataclasses.replace(cycle, tangent_stiffness=jnp.full_like(curve, 250.0))
    assert float(jg.quantities["force_excitation"](spring)) == pytest.approx(250.0 * float(np.ptp(curve)), rel=1e-12)


def test_force_excitation_is_the_force_between_gears_that_turn_uniformly(mesh):
    relief = jg.TipRelief(20.0, 5.0)
    cycle = jg.solve(mesh, TORQUE, pinion=relief, wheel=relief)
    mean, force = jnp.mean(cycle.transmission_error), jnp.full_like(cycle.transmission_error, cycle.force)
    for _ in range(6):  # the wind-up of the bodies goes with the force
        teeth = mean - mesh.hub * force / mesh.pair.face_width
        force = solve_at(mesh, teeth, torque=TORQUE, pinion=relief, wheel=relief).force
    given = metrics.force_excitation(cycle)
    np.testing.assert_allclose(cycle.force - force, given, atol=0.03 * float(np.ptp(given)))
    assert float(jg.quantities["force_excitation"](cycle)) > 0.1 * float(cycle.force)


# slopes, batches, settings


@pytest.mark.slow
def test_slopes_are_those_of_differences(mesh):
    """Of cycles that change with torque and relief as their own differences do."""
    at, step = np.array(POINT), 1e-5
    middle = relieved(mesh, TORQUE, POINT[2])
    for way in np.diag(at):
        several = [(side, at + side * way) for side in (-step, step)]
        ends = [(side, relieved(mesh, x[0], x[2])) for side, x in several]
        below, above = (next(along(cycle, x, way, ends)) for (_, cycle), (_, x) in zip(ends, several))
        _, slopes = along(middle, at, way, ends)
        np.testing.assert_allclose(slopes, (above - below) / (2 * step), rtol=2e-5, atol=2e-7)


@pytest.mark.slow
def test_slopes_through_the_contact_are_those_of_differences(with_slope):
    at, step = jnp.array(POINT), 1e-5
    for way in jnp.diag(at):
        difference = (with_slope(at + step * way, way)[0] - with_slope(at - step * way, way)[0]) / (2 * step)
        np.testing.assert_allclose(with_slope(at, way)[1], difference, rtol=2e-5, atol=2e-7)


@pytest.mark.slow
def test_slopes_backwards_are_those_forwards(mesh):
    def safety(amount):
        relief = jg.TipRelief(amount, 4.0)
        cycle = jg.solve(mesh, OperatingPoint(TORQUE, SPEED), pinion=relief, wheel=relief)
        return jnp.min(metrics.micropitting_safety(cycle, OIL)) + jnp.min(metrics.scuffing_safety(cycle, OIL))

    at = jnp.asarray(12.0)
    assert float(jax.jit(jax.grad(safety))(at)) == pytest.approx(float(jax.jit(jax.jacfwd(safety))(at)), rel=1e-9)


def test_standstill_is_never_safe(solve):
    """Without motion there is neither a film nor a coefficient of friction: a traced speed of 0 gives no numbers."""
    loaded = solve(50.0)

    @jax.jit
    def safeties(speed):
        cycle = dataclasses.replace(loaded, operating_point=OperatingPoint(50.0, speed))
        names = "scuffing_safety", "mesh_efficiency", "max_contact_temperature", "max_flash_temperature"
        return jnp.stack([OIL.quantity(name)(cycle) for name in names])

    assert np.all(np.isfinite(safeties(100.0)))
    assert not np.any(np.isfinite(safeties(0.0)))


def test_many_cycles_and_many_oils(solve):
    cycles = [solve(torque) for torque in (150.0, 250.0)]
    many = jax.tree.map(lambda *parts: jnp.stack(parts), *cycles)
    quantity = OIL.quantity("scuffing_safety")
    found = eqx.filter_jit(quantity)(many)
    np.testing.assert_allclose(found, [float(quantity(cycle)) for cycle in cycles], rtol=1e-12)
    oils = jax.vmap(lambda roughness: dataclasses.replace(OIL, roughness=roughness))(jnp.array([0.2, 0.8]))
    thinnest = jax.jit(jax.vmap(lambda oil: jnp.min(metrics.specific_film_thickness(cycles[0], oil))))
    film = thinnest(oils)
    assert float(film[0]) > 3.9 * float(film[1])


def test_equal_settings_make_equal_quantities(cycle):
    again = metrics.Lubricant(220.0, 19.0, 80.0, 0.4, permissible_film=0.2, scuffing_temperature=300.0)
    other = dataclasses.replace(OIL, friction="iso_6336_20")
    assert OIL.quantity("loss_power") == again.quantity("loss_power") != other.quantity("loss_power")
    assert OIL.quantity("scuffing_safety").better == "larger" and OIL.quantity("loss_power").key == "loss_power_W"
    thick = jax.tree.map(lambda leaf: leaf.astype("float32") if eqx.is_inexact_array(leaf) else leaf, cycle)
    assert jax.eval_shape(OIL.quantity("min_film_thickness"), thick).dtype == "float32"


def test_names_without_settings_say_what_they_need(solve, cycle):
    still = dataclasses.replace(cycle, operating_point=OperatingPoint(TORQUE))
    for name in ("min_film_thickness", "scuffing_safety", "bulk_temperature"):
        with pytest.raises(ValueError, match=f"^{name}: needs settings, give jaxgear.metrics.Lubricant"):
            jg.quantities[name](cycle)
        with pytest.raises(ValueError, match=r"needs a speed, solve with OperatingPoint\(torque, speed\)$"):
            OIL.quantity(name)(still)
    with pytest.raises(ValueError, match=r"^pinion_root_safety: needs settings, give jaxgear.metrics.Strength\(...\)"):
        jg.quantities["pinion_root_safety"](cycle)
    for name in ("loss_power", "mesh_efficiency"):
        with pytest.raises(ValueError, match=f"^{name}: needs a coefficient of friction, solve with OperatingPoint"):
            jg.quantities[name](cycle)
    with pytest.raises(ValueError, match="^speed = 0 rpm must be greater than 0 rpm"):
        metrics.friction_coefficient(solve(TORQUE, 0.0), OIL)
    bare = metrics.Lubricant(220.0, 19.0, 80.0, 0.4)
    with pytest.raises(ValueError, match=r"^needs Lubricant\.scuffing_temperature$"):
        metrics.scuffing_safety(cycle, bare)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: OIL.quantity("wear"), 'Lubricant: quantity "wear" is not known, must be one of max_flash_temp'),
        (lambda: OIL.quantity("pressure_safety"), 'Lubricant: quantity "pressure_safety" is not known'),
        (lambda: OIL.quantity("worn_ppte"), 'Lubricant: quantity "worn_ppte" is not known'),
        (lambda: STRENGTH.quantity("loss_power"), "must be one of pinion_pitting_safety, wheel_pitting_safety, pinion"),
        (lambda: metrics.Lubricant(220.0, 19.0, 80.0, 0.4).quantity("micropitting_safety"), "needs permissible_film"),
        (lambda: metrics.Strength(1500.0).quantity("wheel_root_safety"), 'quantity "wheel_root_safety" needs bending'),
        (lambda: metrics.Lubricant(19.0, 220.0, 80.0, 0.4), "viscosity_100 = 220 mm2/s must be less than viscosity_40"),
        (lambda: metrics.Lubricant(220.0, 1.0, 80.0, 0.4), "viscosity_100 = 1 mm2/s must be at least 2 mm2/s"),
        (lambda: metrics.Lubricant(220.0, 19.0, 300.0, 0.4), "temperature = 300 degC must be at least -60 degC and"),
        (lambda: metrics.Lubricant(220.0, 19.0, 80.0, 0.0), "roughness = 0 um must be greater than 0 um"),
        (lambda: metrics.Lubricant(220.0, 19.0, 80.0, 0.4, base="ester"), 'base = .ester. must be "mineral", "pao"'),
        (lambda: metrics.Lubricant(220.0, 19.0, 80.0, 0.4, friction="xu"), "friction = 'xu' must be \"schlenk\""),
        (
            lambda: metrics.Lubricant(220.0, 19.0, 80.0, 0.4, scuffing_temperature=70.0),
            "temperature = 80 degC must be less than scuffing_temperature = 70 degC",
        ),
        (lambda: metrics.Strength(-1.0), "Strength: pitting = -1 MPa must be greater than 0 MPa"),
        (lambda: metrics.Strength(wheel_bending=900.0), "Strength: bending must be given where wheel_bending is"),
        (lambda: metrics.Strength(9.0, pitting_exponent=6.0), "pitting_cycles must be given where pitting_exponent is"),
        (lambda: metrics.Strength(9.0, pitting_cycles=6.0), "pitting_exponent must be given where pitting_cycles is"),
        (lambda: metrics.Strength(bending_cycles=6.0, bending_exponent=3.0), "bending must be given where bending_exp"),
    ],
)  # fmt: skip
def test_refuses_in_one_line(make, message):
    with pytest.raises(ValueError, match=message) as refused:
        make()
    assert "\n" not in str(refused.value)
