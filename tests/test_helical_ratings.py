"""Quantities, stiffness, stresses and losses of helical pairs: closed forms, published values and spur limit."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helical_pairs import SIZES, TORQUE, example, flanks, pair_of, solved

import jaxgear as jg
from jaxgear import metrics, sizing
from jaxgear.compliance import iso_stiffness
from jaxgear.contact import OperatingPoint
from jaxgear.contact.kinematics import kinematics
from jaxgear.geometry import path_of_contact
from jaxgear.metrics import MESH_QUANTITIES, contact_line_lengths
from jaxgear.metrics.stress import contact_factor_squares, root_helix_factor, single_contact_factors
from jaxgear.shafts.face_load import mesh_stiffness

OIL = metrics.Lubricant(220.0, 19.0, 80.0, 0.4, permissible_film=0.2, scuffing_temperature=300.0)
CURVE = {"pitting_exponent": 13.0, "pitting_cycles": 5e7, "bending_exponent": 9.0, "bending_cycles": 3e6}
STRENGTH = metrics.Strength(1500.0, bending=900.0, pressure=2000.0, **CURVE)
SPEED = 2250.0
NAMES = (
    "face_load_factor mean_face_load_factor edge_load_factor effective_contact_ratio corner_contact_length "
    "corner_force overlap_ratio total_contact_ratio least_contact_line_length axial_force pinion_tilting_moment "
    "shuttling_moment mean_shuttling_moment removed_material mesh_loss_factor loss_power max_flash_temperature "
    "min_film_thickness pinion_local_root_stress wheel_root_safety pinion_pitting_safety"
).split()


def running(beta=15.0, slope=0.0) -> jg.MeshCycle:
    return replace(solved(beta, slope)[1], operating_point=OperatingPoint(TORQUE, SPEED))


@eqx.filter_jit
def everything(cycle):
    settings = {metrics.Lubricant: OIL, metrics.Strength: STRENGTH}
    analysis = metrics.Analysis(cycle)
    found = {}
    for name in NAMES:
        quantity = MESH_QUANTITIES[name]
        found[name] = (quantity if quantity.takes is None else settings[quantity.takes].quantity(name))(analysis)
    return found | metrics.rating_factors(cycle)


def test_least_contact_lines_of_a_published_pair():
    large = jg.GearPair(
        jg.Gear(24, 14.0, 20.0, 0.48, face_width=360.0, helix_angle=10.0, tip_diameter=380.747),
        jg.Gear(95, 14.0, 20.0, 0.6691, face_width=360.0, helix_angle=-10.0, tip_diameter=1395.376),
        center_distance=861.0,
    )
    assert float(contact_line_lengths(large)[0]) == pytest.approx(483.685, abs=1.5e-3)


@pytest.mark.parametrize(
    "beta, width", [(15.0, 20.0), (20.0, 25.0), (15.0, 36.41), (25.0, 48.0), (1.0, 20.0), (None, 20.0)]
)
def test_contact_lines_are_as_long_as_they_are_counted(beta, width):
    """Ratios whose fractions add up to less and to more than one, whole overlap, and spur gears."""
    pair = pair_of(beta, width)
    path, slope, pitch = path_of_contact(pair), float(pair.path_slope), float(pair.base_pitch)
    y = (np.arange(2000) + 0.5) / 2000 - 0.5
    phase = np.arange(400) / 400
    at = (phase[:, None, None] + np.arange(-6, 7)[:, None]) * pitch + slope * width * y
    inside = (at >= float(path.start)) & (at <= float(path.end))
    length = inside.sum(axis=1).mean(axis=1) * width / np.cos(float(pair.pinion.base_helix_angle))
    np.testing.assert_allclose(contact_line_lengths(pair), (length.min(), length.mean()), rtol=4e-3)


def test_axial_force_and_its_moments():
    """F_t tan(beta), at the working pitch circles; the same on both gears, so that the moments are as the teeth."""
    cycle = running()
    pair, tangential = cycle.kinematics.pair, 1e3 * TORQUE / cycle.kinematics.pair.pinion.pitch_radius
    force = float(metrics.axial_force(cycle))
    assert force == pytest.approx(float(tangential) * np.tan(np.deg2rad(15.0)), rel=1e-12)
    pinion, wheel = map(float, metrics.tilting_moments(cycle))
    assert wheel / pinion == pytest.approx(48 / 19, rel=1e-12)
    assert pinion + wheel == pytest.approx(1e-3 * force * float(pair.working_center_distance), rel=1e-12)
    assert float(metrics.axial_force(running(None))) == 0.0


def test_the_load_shuttles_over_the_face():
    """By the lever of the resulting force; the other way with the other hand; not at all on spur gears."""
    cycle, mirrored = running(15.0, 20.0), running(-15.0, -20.0)
    moment = np.asarray(metrics.shuttling_moment(cycle))
    load, of = np.asarray(cycle.line_load), cycle.kinematics
    force = load.sum(axis=0) * np.asarray(of.slice_width)[:, None]
    lever = (force * np.asarray(of.face_coordinate)[:, None]).sum(axis=0) / force.sum(axis=0)
    assert np.abs(lever).max() < 10.0 and np.ptp(lever) > 1.0
    np.testing.assert_allclose(moment, 1e-3 * lever * force.sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(metrics.shuttling_moment(mirrored), -moment, atol=1e-9)
    assert float(MESH_QUANTITIES["shuttling_moment"](cycle)) == pytest.approx(np.ptp(moment), rel=1e-12)
    np.testing.assert_allclose(metrics.shuttling_moment(running(None)), 0.0, atol=1e-9)


def test_a_tip_relief_is_no_uneven_load_over_the_face():
    """K_Hbeta of helical gears is that of all pairs over the cycle; a single line is uneven by the relief."""
    _, cycle = solved(relief=12.0)
    load, most = np.asarray(cycle.line_load), np.asarray(cycle.pair_force).argmax(axis=0)
    lines = load[most, :, np.arange(len(most))]
    assert (lines.max(axis=1) / lines.mean(axis=1)).max() > 1.25 > 1.1 > float(metrics.face_load_factor(cycle)) > 1.0
    total = load.sum(axis=0)
    assert float(metrics.face_load_factor(cycle)) == pytest.approx(total.mean(axis=1).max() / total.mean(), rel=1e-12)
    np.testing.assert_allclose(metrics.face_load_factors(cycle), total.max(axis=0) / total.mean(axis=0), rtol=1e-12)
    assert float(metrics.face_load_factor(replace(cycle, line_load=0 * cycle.line_load))) == 1.0


def test_stiffness_of_the_worked_example():
    found = iso_stiffness(example(), 1000.0)
    np.testing.assert_allclose([found.theoretical, found.single, found.mesh], [17.85584, 12.37047, 17.46485], atol=5e-6)
    force = 9e6 / float(example().pinion.pitch_radius)
    assert force == pytest.approx(127352, abs=0.5)
    assert float(mesh_stiffness(example(), 1000.0)) == pytest.approx(14.84512, abs=5e-6)


@pytest.mark.parametrize("pair", [example, pair_of], ids=["whole overlap", "half overlap"])
def test_contact_stress_is_that_of_the_standard(pair):
    """ISO 6336-2 in its own symbols, with angles and diameters instead of roll lengths."""
    pair = pair()
    pinion, wheel = pair.gears
    beta, alpha_n = (np.deg2rad(float(x)) for x in (pinion.helix_angle, pinion.pressure_angle))
    alpha_t = np.arctan(np.tan(alpha_n) / np.cos(beta))
    beta_b = np.arctan(np.tan(beta) * np.cos(alpha_t))
    d1, d2 = (float(gear.module * gear.teeth) / np.cos(beta) for gear in pair.gears)
    alpha_wt = np.arccos((d1 + d2) / 2 * np.cos(alpha_t) / float(pair.working_center_distance))
    zone = np.sqrt(2 * np.cos(beta_b) * np.cos(alpha_wt) / np.sin(alpha_wt)) / np.cos(alpha_t)
    eps = float(path_of_contact(pair).contact_ratio)
    overlap = min(float(pinion.face_width) * np.sin(beta) / np.pi / float(pinion.module), 1.0)
    sharing = np.sqrt((4 - eps) / 3 * (1 - overlap) + overlap / eps)
    a1, a2 = (2 * gear.tip_radius for gear in pair.gears)
    b1, b2 = (2 * gear.base_radius for gear in pair.gears)
    one, two = np.sqrt((a1 / b1) ** 2 - 1), np.sqrt((a2 / b2) ** 2 - 1)
    t1, t2 = 2 * np.pi / pinion.teeth, 2 * np.pi / wheel.teeth
    m1 = np.tan(alpha_wt) / np.sqrt((one - t1) * (two - (eps - 1) * t2))
    m2 = np.tan(alpha_wt) / np.sqrt((two - t2) * (one - (eps - 1) * t1))
    single = [max(m - overlap * (m - 1), 1.0) for m in (m1, m2)]
    found = [float(np.sqrt(x)) for x in contact_factor_squares(pair, path_of_contact(pair))]
    wanted = [zone, 189.812, sharing, 1 / np.sqrt(np.cos(beta)), *single]
    np.testing.assert_allclose(found, wanted, rtol=1e-5)
    line = 3000.0 / np.cos(alpha_t)  # F_t = 3000 N per mm of face width
    stress = wanted[0] * wanted[1] * wanted[2] * wanted[3] * np.sqrt(3000.0 / d1 * (1 + d1 / d2))
    squares = metrics.stress.nominal_stress_squares(pair, path_of_contact(pair))
    np.testing.assert_allclose(np.sqrt(line * np.array(squares)), stress * np.array(single), rtol=1e-5)


@pytest.mark.parametrize("pair", [example, pair_of], ids=["whole overlap", "half overlap"])
def test_root_stress_is_that_of_the_virtual_gear(pair):
    """ISO 6336-3, clause 6 for helical gears: d_en by the contact ratio of the virtual gears, h_Fe by its angles.

    The section is found to 1e-5 in eight steps.
    """
    pair = pair()
    eps = float(path_of_contact(pair).contact_ratio)
    for gear, found in zip(pair.gears, single_contact_factors(pair, path_of_contact(pair))):
        beta, alpha = np.deg2rad(abs(float(gear.helix_angle))), np.deg2rad(20.0)
        m, x, z = float(gear.module), float(gear.profile_shift), float(gear.teeth)
        beta_b = np.arcsin(np.sin(beta) * np.cos(alpha))
        z_n = z / np.cos(beta_b) ** 2 / np.cos(beta)
        eps_n, d_n = eps / np.cos(beta_b) ** 2, m * z_n
        d_bn, d_an = d_n * np.cos(alpha), d_n + 2 * float(gear.tip_radius) - z * m / np.cos(beta)
        reach = np.sqrt((d_an / 2) ** 2 - (d_bn / 2) ** 2) - np.pi * z * m * np.cos(alpha) / z * (eps_n - 1)
        d_en = 2 * np.hypot(reach, d_bn / 2)
        a_en = np.arccos(d_bn / d_en)
        gamma = (np.pi / 2 + 2 * x * np.tan(alpha)) / z_n + np.tan(alpha) - alpha - np.tan(a_en) + a_en
        h_fp, rho = float(gear.dedendum), float(gear.root_radius)
        e = np.pi / 4 - h_fp * np.tan(alpha) - (1 - np.sin(alpha)) * rho / np.cos(alpha)
        g, h = rho - h_fp + x, 2 / z_n * (np.pi / 2 - e) - np.pi / 3
        theta = np.pi / 6
        for _ in range(30):
            theta = 2 * g / z_n * np.tan(theta) - h
        chord = z_n * np.sin(np.pi / 3 - theta) + np.sqrt(3) * (g / np.cos(theta) - rho)
        fillet = rho + 2 * g**2 / np.cos(theta) / (z_n * np.cos(theta) ** 2 - 2 * g)
        at = a_en - gamma
        deep = z_n * np.cos(np.pi / 3 - theta) + g / np.cos(theta) - rho
        arm = 0.5 * ((np.cos(gamma) - np.sin(gamma) * np.tan(at)) * d_en / m - deep)
        form = 6 * arm * np.cos(at) / chord**2 / np.cos(alpha)
        slender, notch = chord / arm, chord / 2 / fillet
        correction = (1.2 + 0.13 * slender) * notch ** (1 / (1.21 + 2.3 / slender))
        np.testing.assert_allclose(
            [found.form, found.correction, found.lever_arm], [form, correction, arm * m], rtol=1e-5
        )
    overlap = min(float(pair.overlap_ratio), 1.0)
    assert float(root_helix_factor(pair)) == pytest.approx(
        1 - overlap * float(pair.pinion.helix_angle) / 120, rel=1e-12
    )


def test_local_root_stress_is_of_every_slice_at_its_own_height():
    """The load of a slice and the factors of the virtual gear; a line load bends more the higher it is."""
    cycle = running()
    side = cycle.sides[0]
    found = np.asarray(metrics.root_stress(cycle).pinion)
    roll = np.asarray(side.contact_roll_length)
    height = np.hypot(roll, float(side.base_radius)) - float(side.gear.pitch_radius)
    per_load = found / np.where(np.asarray(cycle.line_load) > 0, np.asarray(cycle.line_load), np.nan)
    order = np.argsort(height[~np.isnan(per_load)])
    assert (np.diff(per_load[~np.isnan(per_load)][order]) > -1e-12).all()
    factors = single_contact_factors(cycle.kinematics.pair, cycle.kinematics.path_of_contact)[0]
    cosine = np.cos(float(side.gear.transverse_pressure_angle))
    at_outer = float(factors.form * factors.correction) * cosine / 3.0
    assert np.nanmin(per_load) < at_outer < np.nanmax(per_load)


def test_losses_of_a_constant_line_load():
    """With whole overlap the contact lines are always as long, and every height of the flank slides as often."""
    pair = pair_of(15.0, np.pi * 3.0 / np.sin(np.deg2rad(15.0)))
    assert float(pair.overlap_ratio) == pytest.approx(1.0, rel=1e-12)
    moving = kinematics(pair, jnp.zeros(()), replace(SIZES, positions=64, slices=41, pairs=4), "strain")
    load = jnp.where(moving.outside <= 0, 1.0, 0.0)
    forces = jnp.einsum("psn,s->pn", load, moving.slice_width)
    force = float(jnp.mean(jnp.sum(forces, axis=0)))
    point = OperatingPoint(1e-3 * force * pair.pinion.base_radius)
    cycle = eqx.tree_at(
        lambda c: (c.kinematics, c.line_load, c.pair_force, c.operating_point), running(), (moving, load, forces, point)
    )
    path = path_of_contact(pair)
    before, after = -float(path.start), float(path.end)
    sliding = (before**2 + after**2) / (2 * (before + after))
    curvature = 1 / float(path.pinion_base_radius) + 1 / float(path.wheel_base_radius)
    wanted = sliding * curvature / np.cos(float(pair.pinion.base_helix_angle))
    assert float(metrics.loss_factor(cycle)) == pytest.approx(wanted, rel=2e-3)
    a, e, pitch = before, after, float(path.base_pitch)
    ratios = 1 - (a + e) / pitch + (a**2 + e**2) / pitch**2
    wanted = np.pi * (1 + 19 / 48) / 19 / np.cos(float(pair.pinion.base_helix_angle)) * ratios
    assert float(metrics.ohlendorf_loss_factor(pair)) == pytest.approx(wanted, rel=1e-12)


def test_lubrication_by_the_transverse_path_and_the_normal_radius():
    """Flash temperature, film and friction of single contacts by hand."""
    cycle = running()
    of, path = cycle.kinematics, cycle.kinematics.path_of_contact
    inside = (np.asarray(of.outside) <= 0) & (np.asarray(cycle.line_load) > 0)
    where = tuple(np.argwhere(inside)[7])
    x, load = float(of.path[where]), float(cycle.line_load[where])
    omega, beta_b = SPEED * np.pi / 30, float(of.pair.pinion.base_helix_angle)
    r1, r2 = float(path.pinion_roll_length(x)), float(path.wheel_roll_length(x))
    v1, v2 = 1e-3 * omega * r1, 1e-3 * omega * 19 / 48 * r2
    normal = r1 * r2 / (r1 + r2) / np.cos(beta_b)
    modulus = 206_000.0 / (2 * (1 - 0.09))
    half = np.sqrt(4 * load * normal / np.pi / modulus) * 1e-3
    conduct = float(of.pair.pinion.material.thermal_contact_coefficient)
    flash = 1.13 * 0.05 * 1e3 * load * abs(v1 - v2) / conduct / (np.sqrt(v1) + np.sqrt(v2)) / np.sqrt(2 * half)
    assert float(metrics.flash_temperature(cycle, SPEED, friction=0.05)[where]) == pytest.approx(flash, rel=1e-9)
    pressure = float(cycle.contact_pressure[where])
    bare = np.sqrt(load * modulus / np.pi / normal)
    curvature = float(cycle.relative_curvature[where[0], 0, where[2]])
    assert pressure == pytest.approx(bare * np.sqrt(1 + curvature), rel=1e-9)
    bulk, hot = (
        float(f) for f in (metrics.bulk_temperature(cycle, OIL), metrics.contact_temperature(cycle, OIL)[where])
    )
    eta, alpha, er = OIL.viscosity(bulk), OIL.pressure_viscosity(bulk), 2e6 * modulus
    thinning = OIL.pressure_viscosity(hot) * OIL.viscosity(hot) / alpha / eta
    film = 1.6e3 * normal * (alpha * er) ** 0.6 * (eta * (v1 + v2) / (2e-3 * er * normal)) ** 0.7
    film *= (2 * np.pi * (1e6 * pressure / er) ** 2) ** -0.13 * thinning**0.22
    assert float(metrics.film_thickness(cycle, OIL)[where]) == pytest.approx(float(film), rel=1e-9)
    r1, r2 = float(path.pinion_pitch_roll_length), float(path.wheel_pitch_roll_length)
    rolling, normal = 1e-3 * omega * (r1 + 19 / 48 * r2), r1 * r2 / (r1 + r2) / np.cos(beta_b)
    line = 1e3 * TORQUE / float(path.pinion_base_radius) / 20.0
    friction = 0.048 * (line / rolling / normal) ** 0.2 * (1e3 * float(OIL.viscosity(80.0))) ** -0.05 * 0.4**0.25
    assert float(metrics.friction_coefficient(cycle, OIL)) == pytest.approx(friction, rel=1e-9)


def test_friction_and_heat_of_a_published_pair_under_load_factors():
    """A 5 MW stage: mu of ISO/TR 15144-1 is printed as .030, the bulk temperature of the nominal power as 85.0 degC."""
    pair = jg.GearPair(
        jg.Gear(24, 14.0, 20.0, 0.48, face_width=360.0, helix_angle=10.0, tip_diameter=380.747),
        jg.Gear(95, 14.0, 20.0, 0.6691, face_width=360.0, helix_angle=-10.0, tip_diameter=1395.376),
        center_distance=861.0,
    )
    moving, point = kinematics(pair, jnp.zeros(()), SIZES, "strain"), OperatingPoint(40953.0, 1165.9)
    cycle = eqx.tree_at(lambda c: (c.kinematics, c.operating_point), running(), (moving, point))
    factor = 1.25 * 1.0923 * 1.15 * 1.0693  # K_A K_v K_Hbeta K_Halpha as printed
    oil = metrics.Lubricant(220.0, 19.0, 80.0, 0.6, density=890.0, friction="iso_6336_22", load_factor=factor)
    friction = float(metrics.friction_coefficient(cycle, oil))
    assert friction == pytest.approx(0.03003, abs=5e-5)
    assert float(metrics.helical_load_factor(pair)) == pytest.approx(1.274, abs=5e-4)
    loss = 5000.0 * friction * float(metrics.ohlendorf_loss_factor(pair))  # kW
    assert 80.0 + 7400.0 * (loss / 861.0 / 360.0) ** 0.72 / 1.2 == pytest.approx(85.0, abs=0.05)


def test_rules_take_the_transverse_angle_and_the_oblique_stiffness():
    pair, torque = example(), 9000.0
    load = 127352.0 / 100.0
    assert float(sizing.relief_amount(pair, torque)) == pytest.approx(load / 12.37047, rel=1e-5)
    cosine = np.cos(np.arctan(np.tan(np.deg2rad(20.0)) / np.cos(np.deg2rad(15.8))))
    assert float(sizing.effective_relief(pair, torque)) == pytest.approx(load / cosine / 17.46485, rel=1e-5)
    assert float(sizing.end_relief_length(pair)) == 8.0  # the normal module
    path = path_of_contact(pair)
    assert float(jg.long_relief_length(pair)) == pytest.approx(float(path.end - path.outer_single), rel=1e-12)


def test_quantities_of_a_vanishing_angle_are_those_of_spur_gears():
    """All of them, with an uneven load over the face where K_Hbeta, which has another definition, is not in them."""
    even, uneven = ([everything(running(beta, slope)) for beta in (None, 1e-6, 0.01)] for slope in (0.0, 10.0))
    limit, reached = uneven[0]["mean_face_load_factor"], uneven[1]["face_load_factor"]
    assert float(reached) == pytest.approx(float(limit), rel=2e-5)
    free = [name for name in NAMES if not name.endswith(("face_load_factor", "edge_load_factor", "safety"))]
    spur, nearly, small = ({**one, **{name: other[name] for name in free}} for one, other in zip(even, uneven))
    least = {"axial_force": 1e-3, "overlap_ratio": 1e-7, "pinion_tilting_moment": 1e-5, "shuttling_moment": 1e-5}
    for name, value in spur.items():
        np.testing.assert_allclose(nearly[name], value, rtol=2e-5, atol=least.get(name, 1e-9), err_msg=name)
    # the end of the face reaches the path of contact, 0.01 mm beyond which a position happens to lie
    entering = {"corner_contact_length", "total_contact_ratio", "overlap_ratio", "axial_force"}
    for name in [name for name in spur if name not in entering and "moment" not in name]:
        np.testing.assert_allclose(small[name], spur[name], rtol=3e-3, atol=1e-6, err_msg=name)


def of_the_pair(beta):
    """Numbers that no contact analysis is needed for."""
    pair = pair_of(beta)
    return jnp.stack(
        [
            *contact_line_lengths(pair),
            *metrics.stress.nominal_stress_squares(pair, path_of_contact(pair)),
            *metrics.stress.single_contact_root_stress(pair, path_of_contact(pair)),
            metrics.ohlendorf_loss_factor(pair),
            iso_stiffness(pair, 50.0).mesh,
            sizing.relief_amount(pair, TORQUE),
            sizing.effective_relief(pair, TORQUE),
        ]
    )


def assert_central_differences(of, **precision):
    """Forward, in one program with the values, and reverse."""
    at, step = jnp.asarray(15.0), 1e-4
    along = jax.jit(lambda beta: jax.jvp(of, (beta,), (jnp.ones_like(beta),)))
    wanted = (along(at + step)[0] - along(at - step)[0]) / (2 * step)
    for found in (along(at)[1], jax.jit(jax.jacrev(of))(at)):
        np.testing.assert_allclose(found, wanted, **precision)


@pytest.mark.slow
def test_derivatives_of_the_pair_by_the_angle_are_central_differences():
    assert_central_differences(of_the_pair, rtol=1e-6, atol=1e-9)


def of_the_cycle(beta):
    mesh = jg.prepare(pair_of(beta), resolution=SIZES)
    cycle = jg.solve(mesh, OperatingPoint(TORQUE, SPEED), pinion=jg.LeadSlope(5.0))
    names = "axial_force", "shuttling_moment", "face_load_factor", "mean_face_load_factor", "mesh_loss_factor"
    names += "pinion_local_root_stress", "wheel_contact_stress", "corner_force"
    oiled = (OIL.quantity(name) for name in ("min_film_thickness", "scuffing_safety", "loss_power"))
    analysis = metrics.Analysis(cycle)
    return jnp.stack([each(analysis) for each in (*map(MESH_QUANTITIES.__getitem__, names), *oiled)])


@pytest.mark.slow
def test_derivatives_of_the_cycle_by_the_angle_are_central_differences():
    assert_central_differences(of_the_cycle, rtol=1e-5, atol=1e-7)


@pytest.mark.slow
def test_many_torques_at_once():
    mesh = solved()[0]
    one = solved()[1]
    less = jg.solve(mesh, 75.0, **flanks())
    cycles = jax.tree.map(lambda *both: jnp.stack(both), less, one)
    for name in ("axial_force", "face_load_factor", "mesh_loss_factor", "pinion_local_root_stress", "shuttling_moment"):
        quantity = MESH_QUANTITIES[name]
        np.testing.assert_allclose(quantity(cycles), [quantity(less), quantity(one)], rtol=1e-9, err_msg=name)
    assert metrics.summary(cycles)["axial_force_N"].shape == (2,)
