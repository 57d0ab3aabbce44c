"""Helical ring gears: the transverse section, hands, limits of the contact, stages whose meshes run over the face."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helical_pairs import SIZES

import jaxgear as jg
from jaxgear.compliance import default_compliance
from jaxgear.compliance.plate import axial_compliance
from jaxgear.compliance.tooth import Beam, tooth_load
from jaxgear.geometry import allowance_of_balls, explicit, outline, over_balls, pair_geometry, path_of_contact
from jaxgear.geometry.gear import transverse_gear, virtual_gear
from jaxgear.io import load_design
from jaxgear.metrics import nominal_root_stress, root_stress
from jaxgear.numerics import changed
from jaxgear.planetary import PlanetaryStage, StageGears, axial_loads, mesh_cycles, prepare_stage, solve_stage
from jaxgear.rexs import read_rexs, write_rexs
from jaxgear.rexs.frame import frames

BOTH = {"module": 3.0, "face_width": 20.0}
CUTTER = {"cutter_teeth": 25, "root_radius": 0.25}


def pair_of(angle, teeth=64, **ring):
    both = BOTH | {"helix_angle": angle}
    return jg.GearPair(jg.Gear(19, bore_diameter=24.0, **both), jg.RingGear(teeth, **CUTTER | ring, **both))


def test_the_transverse_section_is_a_spur_pair():
    """Path of contact, interference and measures are those of a spur pair with m_t, alpha_t and x cos(beta)."""
    pair = pair_of(15.0, profile_shift=-0.1, tooth_thickness_allowance=-30.0)
    spur = changed(pair, pinion=transverse_gear(pair.pinion), wheel=transverse_gear(pair.wheel))
    for one, other in zip(*(jax.tree.leaves(path_of_contact(each)) for each in (pair, spur))):
        assert float(one) == pytest.approx(float(other), abs=1e-10)
    found, known = (pair_geometry(explicit(each)).margins for each in (pair, spur))
    for name in ("trochoid", "cutter", "radial_assembly"):
        of_both = (float(getattr(each.ring_clearances, name)) for each in (found, known))
        assert next(of_both) == pytest.approx(next(of_both), abs=1e-12)
    assert float(found.backlash) == pytest.approx(float(known.backlash), rel=1e-9)
    for drawn in (outline(pair.wheel), outline(virtual_gear(pair.wheel))):  # the fillet meets the flank
        points = drawn.curves.trochoid(drawn.junction), drawn.curves.involute(drawn.form_roll_length)
        np.testing.assert_allclose(*points, atol=1e-9)
    assert float(pair.overlap_ratio) == pytest.approx(20.0 * np.sin(np.deg2rad(15.0)) / (3.0 * np.pi))
    # balls: D_M / (z m_n cos(alpha_n)) on the involute function, with z < 0
    wheel, ball = pair_of(15.0).wheel, 5.25
    involute = np.tan(wheel.transverse_pressure_angle) - wheel.transverse_pressure_angle
    wanted = involute - ball / (64 * 3.0 * np.cos(np.deg2rad(20.0))) + np.pi / 128
    between = over_balls(wheel, ball)
    angle = np.arccos(float(-2 * wheel.base_radius / (between + ball)))
    assert np.tan(angle) - angle == pytest.approx(float(wanted), abs=1e-12)
    assert float(allowance_of_balls(wheel, ball, between)) == pytest.approx(0.0, abs=1e-6)


def test_planet_and_ring_gear_have_the_same_hand(tmp_path):
    wheel = pair_of(15.0).wheel
    with pytest.raises(ValueError, match="helix_angle = 15 deg must be -15 deg: planet and ring gear have the same"):
        jg.GearPair(jg.Gear(19, helix_angle=-15.0, **BOTH), wheel)
    assert float(pair_of(15.0).coast.wheel.helix_angle) == -15.0
    path = tmp_path / "pair.toml"
    tables = [
        f"[{name}]\nteeth = {teeth}\nmodule = 3.0\nface_width = 20.0\n"
        for name, teeth in (("pinion", 19), ("ring", 64))
    ]
    path.write_text(f"{tables[0]}helix_angle = 15.0\n{tables[1]}[load]\ntorque = 200.0\n")
    assert float(load_design(path).pair().wheel.helix_angle) == 15.0


@pytest.mark.parametrize("hand", [1, -1])
def test_rexs_round_trip(tmp_path, hand):
    planet = jg.Gear(19, helix_angle=15.0 * hand, bore_diameter=24.0, tip_diameter=65.0, tip_edge_radius=0.1, **BOTH)
    given = CUTTER | {"rim_diameter": 250.0, "tip_diameter": 194.0, "tip_edge_radius": 0.1, "cutter_profile_shift": 0.0}
    pair = jg.GearPair(planet, jg.RingGear(64, helix_angle=15.0 * hand, **given, **BOTH), 69.8)
    lead = jg.LeadSlope(6.0)
    write_rexs(tmp_path / "pair.rexs", pair, pinion=lead, wheel=lead, torque=100.0)
    found = read_rexs(tmp_path / "pair.rexs")
    for one, other in zip(jax.tree.leaves(found.pair), jax.tree.leaves(pair), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)
    for frame, flank in zip(frames(pair), (found.pinion, found.wheel)):
        roll, face = np.full(3, frame.tip), np.array([-8.0, 0.0, 8.0])
        np.testing.assert_allclose(frame.removed(flank, roll, face), frame.removed(lead, roll, face), atol=1e-9)


@pytest.mark.slow
def test_towards_a_rack_the_tooth_is_that_of_an_external_wheel():
    """Bending of the tooth at the pitch point: of rings and wheels alike at 1 / z = 0, from both sides."""
    apart = []
    for teeth in (500, 5_000):
        wheels = [
            kind(teeth, addendum=0.8, helix_angle=20.0 * sign, **more, **BOTH)
            for kind, sign, more in ((jg.RingGear, 1, {"cutter_teeth": 0.4 * teeth}), (jg.Gear, -1, {}))
        ]
        bent = []
        for wheel in wheels:
            path = path_of_contact(jg.GearPair(jg.Gear(19, helix_angle=20.0, **BOTH), wheel))
            load = tooth_load(outline(wheel), path.wheel_roll_length(jnp.zeros(1)))
            bent.append(float(Beam().compliance(load.normal, "strain")[0]))
        apart.append(bent[1] / bent[0] - 1)
    assert 0 < apart[1] < 0.11 * apart[0] < 0.004


@pytest.mark.slow
def test_a_narrow_rim_deflects_along_the_axis_as_a_narrow_disc():
    """Held at 1.02 or at 0.98 of the loaded circle both are short cantilevers, which lean the same way."""
    sizes = {"module": 3.0, "face_width": 20.0}
    radius = 0.5 * 640 * 3.0 / np.cos(np.deg2rad(15.0))
    rim = jg.RingGear(640, rim_diameter=2.04 * radius, helix_angle=15.0, cutter_teeth=200, **sizes)
    disc = jg.Gear(640, bore_diameter=1.96 * radius, helix_angle=-15.0, **sizes)
    np.testing.assert_allclose(axial_compliance(rim), axial_compliance(disc), rtol=0.04)


def solved(angle, slices, torque=200.0, **ring):
    pair = pair_of(angle, rim_diameter=236.4, **ring)
    mesh = jg.prepare(pair, resolution=replace(SIZES, slices=slices))
    return jg.solve(mesh, torque)


@pytest.mark.slow
def test_without_helix_it_is_the_spur_pair():
    """At a ten-thousandth of a degree transmission error, forces and root stresses are those of spur gears."""
    spur, helical = solved(0.0, 3), solved(1e-4, 3)
    np.testing.assert_allclose(helical.transmission_error, spur.transmission_error, rtol=1e-6)
    np.testing.assert_allclose(helical.line_load, spur.line_load, rtol=2e-3, atol=2e-3)
    for of in (root_stress, nominal_root_stress):
        for one, other in zip(*(jax.tree.leaves(of(each)) for each in (helical, spur))):
            np.testing.assert_allclose(one, other, rtol=2e-3, atol=1e-3)
    total = np.sum(helical.pair_force, axis=0)
    np.testing.assert_allclose(total, 200e3 / helical.kinematics.pair.pinion.base_radius, rtol=1e-10)


@pytest.mark.slow
def test_a_thin_slice_is_the_spur_pair_of_the_transverse_section():
    """But for the teeth, which bend in their normal section: softer by 3 % at 15 degrees."""
    for angle, softer in ((5.0, 1.0036), (15.0, 1.033)):
        pair = pair_of(angle)
        thin = [changed(gear, face_width=jnp.asarray(0.02)) for gear in pair.gears]
        means = []
        for slices, gears in ((11, thin), (1, map(transverse_gear, thin))):
            pinion, wheel = gears
            sizes = replace(SIZES, slices=slices)
            one = changed(pair, pinion=pinion, wheel=wheel)
            mesh = jg.prepare(one, compliance=default_compliance("strain", hub_windup=False), resolution=sizes)
            means.append(float(jnp.mean(jg.solve(mesh, 0.2).transmission_error)))
        assert means[0] / means[1] == pytest.approx(softer, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("mode", [jax.jacrev, jax.jacfwd])
@pytest.mark.parametrize("double", [True, False], ids=["double", "single"])
def test_derivatives(mode, double):
    """Transmission error by helix angle, profile shift and rim diameter, against central differences.

    One position may differ: where a load line crosses the root circle, the compliance of the beam has a small step.
    """

    def curve(x):
        both = BOTH | {"helix_angle": x[0]}
        ring = jg.RingGear(64, profile_shift=-x[1], rim_diameter=x[2], **CUTTER, **both)
        pair = jg.GearPair(jg.Gear(19, bore_diameter=24.0, profile_shift=x[1], **both), ring)
        return jg.solve(jg.prepare(pair, resolution=SIZES), 200.0).transmission_error

    with jax.enable_x64(double):
        x = jnp.array([15.0, 0.1, 236.4])
        found = np.asarray(jax.jit(mode(curve))(x))
        assert found.dtype == (np.float64 if double else np.float32) and np.all(np.isfinite(found))
        if double:
            compiled, steps = jax.jit(curve), np.diag([1e-3, 1e-4, 1e-2])
            central = np.stack([(compiled(x + step) - compiled(x - step)) / (2 * step.max()) for step in steps], axis=1)
            near = np.isclose(found, central, rtol=1e-5, atol=1e-5)
            assert np.all(np.sum(~near, axis=0) <= 1)


def stage_pairs(angle):
    sun = jg.Gear(26, bore_diameter=30.0, helix_angle=angle, **BOTH)
    planet = jg.Gear(19, bore_diameter=24.0, helix_angle=-angle, **BOTH)
    return jg.GearPair(sun, planet), jg.GearPair(planet, jg.RingGear(64, helix_angle=-angle, **CUTTER, **BOTH))


def test_kinematics_of_a_helical_stage():
    pairs = stage_pairs(15.0)
    gears = StageGears.of_pairs(*pairs)
    for angle, pair in zip(gears.working_pressure_angles, pairs):
        assert float(angle) == pytest.approx(float(pair.working_pressure_angle), abs=1e-12)
    assert float(gears.phase_between_meshes) % 1 == pytest.approx(0.0, abs=1e-12)  # 19 teeth without shifts
    stage = PlanetaryStage(gears, 3, radial_pin_stiffness=400.0, tangential_pin_stiffness=400.0)
    axial, moment = axial_loads(stage, 400.0)
    per_planet = 400e3 / 3 / float(pairs[0].pinion.pitch_radius) * np.tan(np.deg2rad(15.0))
    assert float(axial) == pytest.approx(3 * per_planet)
    assert float(moment) == pytest.approx(1e-3 * per_planet * 19 * 3.0 / np.cos(np.deg2rad(15.0)))
    with pytest.raises(ValueError, match="planet has helix_angle = -15 in the mesh with the sun and -10"):
        StageGears.of_pairs(pairs[0], stage_pairs(10.0)[1])


def prepared(angle):
    pairs, sizes = stage_pairs(angle), replace(SIZES, positions=12)
    zero = np.zeros(3)
    stage = PlanetaryStage(
        StageGears.of_pairs(*pairs),
        3,
        radial_pin_stiffness=400.0,
        tangential_pin_stiffness=400.0,
        sun_support=0.0,
        tangential_pin_tilt=zero,
    )
    sun, ring = (jg.prepare(pair, resolution=sizes) for pair in pairs)
    return prepare_stage(stage, sun=sun, ring=ring)


@pytest.mark.slow
def test_contact_runs_over_the_face_of_both_meshes_alike():
    """Stages of either hand are mirror images; towards spur gears nothing jumps; the ends that enter first agree."""
    right, left, small, spur = map(prepared, (15.0, -15.0, 1e-4, 0.0))
    cycles = [solve_stage(each, 400.0) for each in (right, left, small, spur)]
    assert all(bool(np.all(cycle.converged)) for cycle in cycles)
    error = [cycle.transmission_error for cycle in cycles]
    np.testing.assert_allclose(error[0], error[1], rtol=1e-9)
    np.testing.assert_allclose(error[2], error[3], rtol=1e-6)
    meshes = [mesh_cycles(*each) for each in zip((right, left), cycles)]
    for one, other in ((getattr(each, name) for each in meshes) for name in ("sun", "ring")):
        np.testing.assert_allclose(one.line_load, other.line_load[:, :, ::-1], rtol=1e-6, atol=1e-6)
    for cycle in (meshes[0].sun, meshes[0].ring):
        assert np.all(cycle.kinematics.pair.path_slope > 0)
    # a lead slope on both central gears takes away the tilt of the pins, as in spur stages
    tilt, width = 0.5, 20.0
    tilted = changed(right, stage=changed(right.stage, tangential_pin_tilt=jnp.full(3, tilt)))
    opens = [jg.LeadSlope(-tilt * width * jnp.cos(angle)) for angle in right.stage.gears.working_pressure_angles]
    held = solve_stage(tilted, 400.0, sun=opens[0], ring=opens[1])
    np.testing.assert_allclose(held.transmission_error, error[0], rtol=1e-9)
    assert np.abs(solve_stage(tilted, 400.0).transmission_error - error[0]).max() > 0.2
