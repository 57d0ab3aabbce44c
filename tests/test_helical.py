"""Helical gears: geometry, the contact slice by slice and its limits, and what does not know them yet."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from contact_problems import influence
from helical_pairs import SIZES, TORQUE, flanks, pair_of, solved

import jaxgear as jg
from jaxgear import manufacture, plot
from jaxgear.compliance import finite_element_compliance
from jaxgear.compliance.laws import LinearLaw
from jaxgear.compliance.plate import axial_compliance
from jaxgear.contact import helical_slices
from jaxgear.contact.covering import pairs_alternate
from jaxgear.contact.mesh import fewer_slices, slices_left
from jaxgear.contact.solve import wider_mesh
from jaxgear.contact.status import Status
from jaxgear.geometry import path_of_contact, tooth_thickness


def test_geometry_is_that_of_published_pairs():
    """A commercial program's report of 24/95 teeth, an open tool's of 20/30, and a pair worked out by hand."""
    large = jg.GearPair(
        jg.Gear(24, 14.0, 20.0, 0.48, face_width=360.0, helix_angle=10.0, tip_diameter=380.747),
        jg.Gear(95, 14.0, 20.0, 0.6691, face_width=360.0, helix_angle=-10.0, tip_diameter=1395.376),
        center_distance=861.0,
    )
    small = jg.GearPair(
        jg.Gear(20, 3.5, 20.0, 0.1809, face_width=23.0, helix_angle=15.0, tooth_thickness_allowance=-10.0),
        jg.Gear(30, 3.5, 20.0, 0.0891, face_width=23.0, helix_angle=-15.0),
        center_distance=91.5,
    )
    wanted = (9.3913, 1.4627, 1.4213), (14.0761, 1.4716, 0.5414), (14.0761, 1.5700, 0.5492)
    for pair, numbers in zip((large, small, pair_of()), wanted):
        found = np.rad2deg(pair.pinion.base_helix_angle), path_of_contact(pair).contact_ratio, pair.overlap_ratio
        np.testing.assert_allclose(found, numbers, atol=5.1e-5)
    assert float(small.base_pitch) == pytest.approx(10.65231, abs=5e-6)
    force = 100e3 / small.pinion.base_radius
    assert float(force) == pytest.approx(2949.2, abs=0.05)
    assert float(force / jnp.cos(small.pinion.base_helix_angle)) == pytest.approx(3040.5, abs=0.05)
    assert float(pair_of().working_center_distance) == pytest.approx(104.04526, abs=5e-6)
    virtual = jg.Gear(17, 8.0, 20.0, 0.145, face_width=20.0, helix_angle=15.8).virtual_teeth
    assert float(virtual) == pytest.approx(18.9051, abs=5e-5)


def test_coast_flanks_are_the_drive_flanks_in_a_mirror():
    """The lead slope that eases one end for the drive flanks eases the other end for the coast flanks."""
    mesh, drive = solved(slope=6.0)
    behind = jg.prepare(mesh.pair.coast, compliance=mesh.compliance, resolution=mesh.resolution)
    behind = replace(behind, alternates=mesh.alternates)
    tip = jg.TipRelief(0.0, 4.0)
    coast = jg.solve(behind, TORQUE, pinion=jg.LeadSlope(-6.0) + tip, wheel=tip)
    np.testing.assert_allclose(coast.transmission_error, drive.transmission_error, rtol=1e-12)
    np.testing.assert_allclose(coast.line_load[:, ::-1], drive.line_load, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(np.sum(coast.pair_force, axis=0), coast.force, rtol=1e-12)
    same = jg.solve(behind, TORQUE, pinion=jg.LeadSlope(6.0) + tip, wheel=tip)
    assert float(jg.peak_to_peak(same.transmission_error)) != float(jg.peak_to_peak(drive.transmission_error))
    assert mesh.pair.coast.coast == mesh.pair and float(mesh.pair.coast.path_slope) == -float(mesh.pair.path_slope)


def test_in_python_a_negative_torque_says_where_the_coast_flanks_are():
    with pytest.raises(
        ValueError, match="torque = -50 N m must be at least 0 N m; for the coast flanks prepare the pair"
    ):
        jg.solve(solved()[0], -50.0)


def test_coefficients_are_of_the_normal_module():
    gear = jg.Gear(30, 2.0, 20.0, 0.4, face_width=10.0, helix_angle=20.0)
    cosine = np.cos(np.deg2rad(20.0))
    assert float(gear.pitch_radius) == pytest.approx(30.0 / cosine)
    assert float(gear.tip_radius - gear.pitch_radius) == pytest.approx(2.0 * 1.4)
    thickness = tooth_thickness(gear, 2 * gear.pitch_radius)
    assert float(thickness) == pytest.approx(2.0 * (np.pi / 2 + 0.8 * np.tan(np.deg2rad(20.0))) / cosine)
    thinner = replace(gear, tooth_thickness_allowance=-50.0)  # normal to the tooth
    assert float(thickness - tooth_thickness(thinner, 2 * gear.pitch_radius)) == pytest.approx(0.05 / cosine)


def test_backlash_is_normal_to_the_flank():
    gears = pair_of().gears
    for by in ("both", "center_distance"):
        pair = jg.geometry.pair_with_backlash(*gears, 80.0, by=by)
        assert float(pair.backlash * jnp.cos(pair.pinion.base_helix_angle)) == pytest.approx(80.0, abs=1e-3)


def test_an_angle_of_zero_is_a_spur_gear():
    assert eqx.tree_equal(jg.Gear(19, 3.0, face_width=20.0, helix_angle=0.0), jg.Gear(19, 3.0, face_width=20.0))
    assert pair_of(0.0).is_spur and helical_slices(pair_of(0.0)) == 1
    assert not pair_of().is_spur and helical_slices(pair_of()) == 22


@pytest.mark.slow
def test_a_small_angle_goes_to_the_spur_gear():
    """Nothing jumps where contact lines begin to run across the face, the largest pressure included."""
    mesh, spur = solved(None)
    assert mesh.kinematics.path.shape == (3, 1, 8) and not mesh.kinematics.helical
    _, nearly = solved(1e-6)
    np.testing.assert_allclose(nearly.transmission_error, spur.transmission_error, atol=1e-9)
    np.testing.assert_allclose(nearly.line_load, spur.line_load, atol=2e-4)
    for beta, error, pressure in ((0.01, 1e-4, 1e-3), (0.1, 2e-3, 5e-3)):
        _, small = solved(beta)
        np.testing.assert_allclose(small.transmission_error, spur.transmission_error, atol=error)
        assert float(small.corner_pressure.max()) == pytest.approx(float(spur.corner_pressure.max()), rel=pressure)
    # at a larger angle the end of the face reaches the path of contact, 0.01 mm beyond which a position happens to lie
    flank = float(solved(0.01)[1].contact_pressure.max())
    assert flank == pytest.approx(float(spur.contact_pressure.max()), rel=1e-3)


def test_the_other_hand_is_the_mirrored_face():
    _, right = solved(15.0, 20.0)
    _, left = solved(-15.0, -20.0)
    np.testing.assert_allclose(left.transmission_error, right.transmission_error, rtol=2e-11)  # each is solved to 1e-11
    np.testing.assert_allclose(left.line_load[:, ::-1], right.line_load, atol=1e-9)


def test_solution_meets_the_conditions():
    mesh, cycle = solved()
    assert bool(cycle.converged.all()) and mesh.kinematics.path.shape == (3, 5, 8)
    np.testing.assert_allclose(cycle.pair_force.sum(axis=0), cycle.force, rtol=1e-10)
    load = np.asarray(cycle.line_load)
    deflected = np.einsum("psjtn,jtn->psn", influence(mesh.coupling, mesh.slice_width), load)
    approach = np.asarray(cycle.transmission_error) - float(mesh.hub * cycle.force / mesh.pair.face_width)
    law = np.asarray(mesh.law.deflection(jnp.asarray(load)))
    force = np.sum(np.asarray(mesh.lever) * load * np.asarray(mesh.slice_width)[:, None], axis=0)
    bends, tilt = np.asarray(mesh.coupling.support_modes), np.asarray(mesh.coupling.support)
    tilted = bends @ tilt @ bends.T @ force
    assert np.abs(tilted).max() > 1e-3 and bends.shape == (5, 2)  # um
    np.testing.assert_allclose(tilt, [[0.0, tilt[1, 0]], [tilt[1, 0], 0.0]], atol=1e-12)
    left = deflected + np.asarray(mesh.lever) * tilted + law + np.asarray(cycle.gap) - np.asarray(mesh.lever) * approach
    assert left.min() > -1e-8 and np.abs(left[load > 0]).max() < 1e-8
    assert (load > 0).any(axis=1).sum(axis=0).max() >= 2  # pairs share the load
    assert str(cycle).splitlines()[-1].split() == ["overlap", "ratio", "0.549"]


@pytest.mark.slow
def test_two_pairs_in_every_slice_are_all_that_touch():
    mesh, cycle = solved()
    every = jg.solve(replace(mesh, alternates=False), TORQUE, **flanks())
    np.testing.assert_allclose(cycle.line_load, every.line_load, atol=1e-7)
    for name in ("transmission_error", "tangent_stiffness", "opening"):
        np.testing.assert_allclose(getattr(cycle, name), getattr(every, name), rtol=1e-9, atol=1e-9)


def test_flanks_that_reach_farther_than_two_pairs_are_told():
    pair, (mesh, cycle) = pair_of(), solved()
    assert pairs_alternate(pair, SIZES, None) and not pairs_alternate(pair, replace(SIZES, pairs=4), None)
    far = np.abs(mesh.kinematics.path) > float(mesh.pair.base_pitch)
    assert 0 < far.sum() and np.asarray(cycle.opening)[far].min() > 100.0
    at = np.arange(8) == 4
    removed = jg.contact.removed_material(mesh, TORQUE, **flanks()) + jnp.where(far & at, -3000.0, 0.0)
    reaching = jg.contact.solve_removed(mesh, TORQUE, removed)
    np.testing.assert_array_equal(reaching.status, np.where(at, Status.MORE_PAIRS_NEEDED, Status.CONVERGED))
    assert not wider_mesh(replace(mesh, automatic=True), reaching.status).alternates


def test_slices_far_along_the_path_touch_later():
    mesh, cycle = solved()
    path, load = np.asarray(mesh.kinematics.path), np.asarray(cycle.line_load)
    ahead = float(mesh.slice_width[0] * jnp.tan(mesh.pair.pinion.base_helix_angle))
    np.testing.assert_allclose(np.diff(path, axis=1), ahead, rtol=1e-12)  # a right hand: the positive end comes first
    start = float(mesh.path_of_contact.start)
    assert load[path < start - 0.2 * float(mesh.pair.base_pitch)].max() == 0


@pytest.mark.usefixtures("clean_figures")
def test_the_plane_of_action_has_inclined_lines_that_carry_the_force():
    mesh, cycle = solved()
    ax = plot.plane_of_action(cycle)
    stages = np.nan_to_num(np.ma.filled(ax.collections[0].get_array(), 0.0)).reshape(5, 3, 8)
    lever = np.asarray(mesh.lever)[::-1]  # the last pair comes first
    carried = np.einsum("spn,psn,s->n", stages, lever, np.asarray(mesh.slice_width))
    np.testing.assert_allclose(carried, float(cycle.force), rtol=1e-9)
    lines = [line.get_xydata() for line in ax.lines if len(line.get_xdata()) == 6]  # ends of the slices
    for line in lines:
        steps = np.diff(line[np.isfinite(line).all(axis=1)], axis=0)
        np.testing.assert_allclose(steps[:, 0] / steps[:, 1], float(mesh.pair.path_slope), rtol=1e-9)
    assert any(np.isfinite(line).all() for line in lines)  # all over the face


@pytest.mark.slow
@pytest.mark.parametrize("width, beta", [(20.0, 15.0), (36.0, 15.0)])
def test_harmonics_of_a_constant_stiffness(width, beta):
    """2 |sinc(n eps_alpha) sinc(n eps_beta)| of the mean; slices that are whole or apart leave about 1 / slices."""
    sizes = replace(SIZES, positions=64, slices=81, coupled_slices=False, slide_steps=0, extended_contact=False)
    mesh = jg.prepare(pair_of(beta, width), resolution=sizes)
    outside = mesh.kinematics.outside > 0
    plain = eqx.tree_at(
        lambda m: (m.structure, m.law, m.corner_gap, m.lever),
        mesh,
        (
            jnp.zeros_like(mesh.structure),
            LinearLaw(jnp.full_like(mesh.lever, 0.1)),
            jnp.where(outside, 1e6, 0.0),
            jnp.ones_like(mesh.lever),
        ),
    )
    stiffness = 1 / (1 / jg.solve(plain, TORQUE).tangent_stiffness - plain.hub / plain.pair.face_width)
    found = 2 * np.abs(np.fft.rfft(stiffness))[1:3] / np.sum(stiffness)
    order, ratios = np.arange(1, 3), (float(path_of_contact(mesh.pair).contact_ratio), float(mesh.pair.overlap_ratio))
    wanted = 2 * np.abs(np.sinc(order * ratios[0]) * np.sinc(order * ratios[1]))
    np.testing.assert_allclose(found, wanted, atol=0.01)


def test_the_body_tilts_under_the_axial_force():
    """Half the width makes a plate eight times as soft, but for shear; a wheel that is held far out hardly yields."""
    yielding = eqx.filter_jit(axial_compliance)
    gears = [jg.Gear(48, 3.0, face_width=b, helix_angle=15.0, bore_diameter=40.0) for b in (5.0, 10.0)]
    thin, thick = (float(yielding(gear).deflection) for gear in gears)
    assert 7.0 < thin / thick < 8.0
    held_far_out, held_far_in = (yielding(pair_of(bores=(20.0, bore)).wheel) for bore in (100.0, 40.0))
    assert float(held_far_out.deflection) < 0.3 * float(held_far_in.deflection)
    # without the tilt, of the ring alone: the same torsion as that of a spur gear of these radii
    twisted = float(solved()[0].hub) - 20.0 * float(jnp.tan(pair_of().pinion.base_helix_angle)) ** 2 * sum(
        float(yielding(gear).deflection) for gear in pair_of().gears
    )
    assert 0 < twisted < float(solved()[0].hub)


def test_a_narrow_body_bends_as_a_cantilever():
    """Of every harmonic that is longer than the ring is high: w = F l^3 / 3 D, w' = F l^2 / 2 D."""
    gear = jg.Gear(400, 1.0, face_width=0.2, helix_angle=15.0, bore_diameter=407.0)
    length = float(gear.pitch_radius - gear.bore_radius)
    found = axial_compliance(gear)
    assert 0.0 < length < 0.02 * float(gear.pitch_radius)
    assert float(found.slope * length / found.deflection) == pytest.approx(1.5, rel=0.02)


@pytest.mark.slow
def test_derivatives_by_angle_and_width_are_central_differences():
    def ripple(x):
        mesh = jg.prepare(pair_of(x[0], x[1]), resolution=replace(SIZES, slices=3))
        return jg.peak_to_peak(jg.solve(mesh, TORQUE, pinion=jg.LeadCrowning(5.0)).transmission_error)

    at, step = jnp.array([15.0, 20.0]), 1e-4
    steps = step * jnp.eye(2)
    back = jax.jit(jax.value_and_grad(ripple))  # one program for the values too
    wanted = [(back(at + each)[0] - back(at - each)[0]) / (2 * step) for each in steps]
    for found in (back(at)[1], jax.jit(jax.jacfwd(ripple))(at)):
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-8)


@pytest.mark.slow
def test_flanks_are_found_by_gradients():
    mesh = solved()[0]
    found = jg.optimize.minimize(
        jg.Problem(
            mesh,
            TORQUE,
            lambda x: (jg.TipRelief(x["amount"], 5.0), jg.TipRelief(x["amount"], 5.0)),
            {"amount": (0.0, 20.0)},
        )
    )
    none = jg.TipRelief(0.0, 5.0)
    unmodified = jg.solve(found.mesh, TORQUE, pinion=none, wheel=none)  # by the program that solved the optimum
    assert found.positions >= 512 and found.objective < 0.5 * float(np.ptp(unmodified.transmission_error))


def test_gears_must_have_opposite_hands():
    gear = jg.Gear(19, 3.0, face_width=20.0, helix_angle=15.0)
    with pytest.raises(ValueError, match=r"wheel helix_angle = 15 deg must be -15 deg: gears on parallel shafts"):
        jg.GearPair(gear, jg.Gear(48, 3.0, face_width=20.0, helix_angle=15.0))
    traced = jax.eval_shape(lambda beta: jg.geometry.margins(jg.GearPair(gear, replace(gear, helix_angle=beta))), -15.0)
    assert traced.backlash.shape == ()
    same = jax.jit(lambda beta: jg.geometry.margins(jg.GearPair(gear, replace(gear, helix_angle=beta))).valid)
    assert bool(same(-15.0)) and not bool(same(15.0)) and not bool(same(-14.0))


REFUSED = {
    "flank table": lambda: jg.contact.flank_table(solved()[1].kinematics, solved()[1].line_load, "pinion"),
    "finite elements": lambda: finite_element_compliance(pair_of(None)).check(pair_of()),
    "form wheel": lambda: manufacture.wheel_profile(solved()[0].sides[0], jg.TipRelief(5.0, 2.0)),
}


@pytest.mark.parametrize("ask", REFUSED.values(), ids=REFUSED)
def test_what_does_not_know_helical_gears_says_so(ask):
    with pytest.raises(ValueError, match="helical|helix_angle") as refused:
        ask()
    assert len(str(refused.value).splitlines()) == 1


def test_slices_are_chosen_by_the_overlap_ratio():
    """At most a thirtieth of a base pitch apart on the path of contact; of traced gears as for an overlap of one."""
    for width, slices in ((4.0, 11), (20.0, 22), (60.0, 55)):
        pair = pair_of(width=width)
        assert helical_slices(pair) == slices and float(pair.overlap_ratio) / slices <= 1 / 30
    traced = eqx.filter_eval_shape(lambda of: jg.prepare(of, resolution=replace(SIZES, slices=1)), pair_of())
    assert traced.resolution.slices == 33


def test_slices_of_one_phase_stand_for_fewer():
    """Every three at the phase of the middle one; what is left over at that of the last slice."""
    mesh, _ = solved()
    fewer = fewer_slices(mesh)
    for name in ("corner_gap", "lever", "width_factor"):
        own, found = (np.asarray(getattr(each, name)) for each in (mesh, fewer))
        np.testing.assert_array_equal(found, own[:, [1, 1, 1, 4, 4]])
    assert fewer_slices(solved(None)[0]) is None


@pytest.mark.slow
def test_the_error_of_the_slices_is_estimated():
    """Without coupling, slices of one phase are those of a third as many; the estimate is about the true error."""
    ripple, curves = {}, {}
    for slices in (11, 33, 99):
        sizes = replace(SIZES, slices=slices, coupled_slices=False)
        mesh = jg.prepare(pair_of(), resolution=sizes)
        every = jg.solve(mesh, TORQUE), jg.solve(fewer_slices(mesh), TORQUE)
        curves[slices] = [np.asarray(cycle.transmission_error) for cycle in every]
        ripple[slices] = [float(np.ptp(curve)) for curve in curves[slices]]
    for few, many in ((11, 33), (33, 99)):
        assert ripple[many][1] == pytest.approx(ripple[few][0], rel=1e-9)
    # of the curve: extremes of two curves may agree by chance
    error, estimate = np.ptp(curves[99][0] - curves[33][0]), np.ptp(slices_left(*curves[33]))
    assert 0.5 * error < estimate < 20 * error
