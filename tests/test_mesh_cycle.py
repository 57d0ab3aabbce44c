"""Equilibrium, symmetries, invariances and convergence of the solved mesh cycle."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import (
    FACE,
    FINITE_ELEMENT_CASES,
    FOUR_PAIRS,
    flank,
    gear_pair,
    high_contact_ratio_pair,
    kahraman_gear,
    prepare,
    solve,
)

import jaxgear as jg
from jaxgear.compliance.tooth import tooth_load
from jaxgear.geometry import outline

CASES = pytest.mark.parametrize("name", [case.name for case in FINITE_ELEMENT_CASES])


@pytest.fixture(scope="module")
def mesh():
    return prepare(gear_pair())


@pytest.fixture(scope="module")
def sliced():
    return prepare(gear_pair(), resolution=FACE)


@CASES
def test_forces_balance_the_torque(name, solved):
    case, cycle = solved[name]
    force = 1e3 * case.torque / float(cycle.kinematics.pair.pinion.base_radius)
    assert float(cycle.force) == pytest.approx(force, rel=1e-14)
    assert force / case.face_width == pytest.approx(case.line_load, abs=6e-3)
    np.testing.assert_allclose(np.sum(cycle.pair_force, axis=0), force, rtol=1e-13)
    np.testing.assert_allclose(np.sum(jg.load_sharing(cycle), axis=0), 1.0, rtol=1e-13)
    assert np.all(cycle.converged) and cycle.converged.dtype == bool


@CASES
def test_contact_conditions(name, solved):
    """No tension, no penetration, no load across a gap; loads and gaps exclude each other."""
    _, cycle = solved[name]
    load, opening = np.asarray(cycle.line_load), np.asarray(cycle.opening)
    assert load.min() >= 0.0
    assert opening[load > 0].max() < 0
    assert opening[load == 0].min() > -1e-12
    assert np.max(cycle.residual) < 1e-13


@CASES
def test_pairs_follow_each_other(name, solved):
    """After a base pitch every pair takes the place of its predecessor: force and path continue across the cycle."""
    _, cycle = solved[name]
    force, path = np.asarray(cycle.pair_force), np.asarray(cycle.kinematics.path)[:, 0]
    pitch = float(cycle.kinematics.path_of_contact.base_pitch)
    step = pitch / cycle.phase.shape[0]
    np.testing.assert_allclose(path[1:, -1] + step, path[:-1, 0], atol=1e-12)
    whole = force[::-1].ravel()  # one pair over the whole path
    jump = np.abs(np.diff(whole))
    seams = np.arange(1, force.shape[0]) * force.shape[1] - 1
    assert jump[seams].max() <= np.delete(jump, seams).max() * 1.05


def test_axes_and_shapes(sliced):
    cycle = solve(sliced, 50.0, flank(crowning=6.0))
    assert cycle.phase.shape == cycle.transmission_error.shape == cycle.unloaded_transmission_error.shape == (8,)
    assert cycle.line_load.shape == cycle.contact_pressure.shape == cycle.corner_pressure.shape == (2, 6, 8)
    assert cycle.pair_force.shape == (2, 8)
    np.testing.assert_allclose(cycle.phase, np.arange(8) / 8, atol=1e-16)
    np.testing.assert_allclose(cycle.kinematics.path[0, 0, 0], 0.0, atol=1e-15)


def test_equal_gears_are_symmetric_about_the_pitch_point():
    """Driving and driven gear change places at psi -> 1 - psi: the transmission error and the shares mirror."""
    gear = kahraman_gear(156.0)
    relief = flank(tip=4.0, tip_length=2.0, root=2.0, root_length=1.5, barrel=1.5, crowning=3.0)
    mesh = prepare(jg.GearPair(gear, gear), resolution=FACE)
    cycle = solve(mesh, 200.0, relief, relief)

    def mirrored(curve):
        return np.asarray(curve)[..., 1:][..., ::-1]

    error, unloaded = np.asarray(cycle.transmission_error), np.asarray(cycle.unloaded_transmission_error)
    np.testing.assert_allclose(mirrored(error), error[1:], rtol=1e-12)
    np.testing.assert_allclose(mirrored(unloaded), unloaded[1:], atol=1e-12)
    # pair i at phase psi stands where pair 1 - i stands at 1 - psi, on the other side of the pitch point
    share = np.asarray(jg.load_sharing(cycle))
    np.testing.assert_allclose(mirrored(share[::-1]), share[:, 1:], atol=1e-10)
    # the modification on one gear only does the same as on the other only, mirrored
    one, other = (np.asarray(solve(mesh, 200.0, **{on: relief}).transmission_error) for on in ("pinion", "wheel"))
    np.testing.assert_allclose(mirrored(other), one[1:], rtol=1e-12)


@eqx.filter_jit
def structure_and_hub(compliance, mesh):
    """What a compliance makes of the bodies and teeth of a mesh."""
    loads = [tooth_load(outline(side.gear), side.contact_roll_length[:, 0]) for side in mesh.sides]
    return jnp.sum(compliance.structure(*loads), axis=0), jnp.sum(compliance.hub(*loads))


@pytest.mark.slow
@CASES
def test_hub_windup_shifts_the_mean_and_nothing_else(name, solved):
    case, cycle = solved[name]
    mesh = prepare(case.pair())
    structure, hub = structure_and_hub(jg.default_compliance(hub_windup=False), mesh)
    np.testing.assert_allclose(structure, mesh.structure[:, :, 0], rtol=1e-12)
    assert float(hub) == 0.0 < float(mesh.hub)
    rigid = solve(dataclasses.replace(mesh, hub=hub), case.torque)
    c_hub = 0.0
    for z, bore in zip(case.teeth, case.bores):
        root = case.module * (z - 2.5)
        base = case.module * z * np.cos(np.deg2rad(20.0))
        c_hub += 1.3 * ((root / bore) ** 2 - 1) / (2 * np.pi * 206e3) * (base / root) ** 2
    shift = np.subtract(cycle.transmission_error, rigid.transmission_error)
    np.testing.assert_allclose(shift, 1e3 * c_hub * case.line_load, rtol=1e-4)
    assert np.ptp(shift) < 1e-12
    np.testing.assert_allclose(cycle.pair_force, rigid.pair_force, rtol=1e-11, atol=1e-9)
    with_hub, without = (1 / np.asarray(each.tangent_stiffness) for each in (cycle, rigid))
    np.testing.assert_allclose(with_hub - without, 1e3 * c_hub / case.face_width, rtol=1e-6)


@pytest.mark.slow
@CASES
def test_a_mesh_without_hub_windup_has_no_hub_and_the_same_structure(name, solved):
    case, cycle = solved[name]
    mesh = prepare(case.pair(), jg.default_compliance(hub_windup=False))
    assert float(mesh.hub) == 0.0
    rigid = solve(mesh, case.torque)
    assert np.ptp(np.subtract(cycle.transmission_error, rigid.transmission_error)) < 1e-12
    np.testing.assert_allclose(cycle.pair_force, rigid.pair_force, rtol=1e-11, atol=1e-9)


@pytest.mark.slow
def test_slices_without_lead_modification_are_all_alike(sliced):
    one, many = solve(prepare(gear_pair(), resolution=FOUR_PAIRS), 50.0), solve(sliced, 50.0)
    error, load = np.asarray(one.transmission_error), np.asarray(one.line_load)
    np.testing.assert_allclose(many.transmission_error, error[::4], rtol=1e-12)
    alike = np.repeat(load[1:3, :, ::4], 6, axis=1)  # those of four pairs beside the pitch point
    np.testing.assert_allclose(many.line_load, alike, rtol=1e-10, atol=1e-10)
    assert not load[[0, 3]].any()


def test_lead_slope_of_either_sign_gives_mirror_images(sliced):
    up, down = (solve(sliced, 50.0, flank(lead_slope=amount)) for amount in (8.0, -8.0))
    np.testing.assert_allclose(up.transmission_error, down.transmission_error, rtol=1e-12)
    load = np.asarray(up.line_load)
    np.testing.assert_allclose(load, np.asarray(down.line_load)[:, ::-1], atol=1e-9)
    assert load[0, 0, 0] > load[0, -1, 0], "material is gone at positive face coordinates"


def resliced(mesh, slices):
    """The same mesh with another number of slices."""
    width = mesh.pair.face_width
    return dataclasses.replace(
        mesh,
        kinematics=dataclasses.replace(mesh.kinematics, resolution=dataclasses.replace(mesh.resolution, slices=slices)),
        slice_width=jnp.full((slices,), width / slices),
    )


@pytest.mark.slow
def test_lead_crowning_converges_with_slices(mesh, sliced):
    """Midpoint rule over the face: the error falls with the square of the number of slices."""
    np.testing.assert_allclose(resliced(mesh, 6).face_coordinate, sliced.face_coordinate, atol=1e-14)
    curves = {n: solve(resliced(mesh, n), 50.0, flank(crowning=4.0)).transmission_error for n in (5, 10, 80)}
    errors = {n: float(jnp.abs(jnp.mean(curves[n] - curves[80]))) for n in (5, 10)}
    assert 1e-4 < errors[5] < 0.1
    assert errors[5] / errors[10] == pytest.approx(4.0, rel=0.25)


@pytest.mark.slow
def test_converges_with_positions(mesh):
    """The same curve at common positions whatever the resolution, and a PPTE that settles."""
    coarse = solve(mesh, 50.0).transmission_error
    fine = solve(prepare(gear_pair(), resolution=jg.Resolution(positions=256, pairs=4)), 50.0).transmission_error
    np.testing.assert_allclose(coarse, fine[::8], rtol=1e-12)
    ppte = [float(jg.peak_to_peak(curve)) for curve in (coarse, fine[::4], fine[::2], fine)]
    assert (np.diff(ppte) > -1e-12).all(), "positions are nested"
    assert ppte[3] < 1.03 * ppte[0] and ppte[3] - ppte[2] < 0.005 * ppte[3]


@pytest.mark.slow
def test_fewer_pairs_suffice_for_a_short_path():
    four = solve(prepare(gear_pair(), resolution=FOUR_PAIRS), 50.0)
    three = solve(prepare(gear_pair(), resolution=jg.Resolution(positions=32, pairs=3)), 50.0)
    # an odd number of pairs begins half a base pitch earlier
    np.testing.assert_allclose(np.roll(three.transmission_error, 16), four.transmission_error, rtol=1e-12)
    np.testing.assert_allclose(three.line_load[..., 16:], four.line_load[:3, :, :16], atol=1e-9)
    np.testing.assert_allclose(three.line_load[..., :16], four.line_load[1:, :, 16:], atol=1e-9)


def test_fewest_pairs():
    """Of two pairs `test_slices_without_lead_modification_are_all_alike` finds what four give."""
    few = jg.fewest_pairs(gear_pair(), deflection=40.0)
    assert few == 2 and jg.fewest_pairs(high_contact_ratio_pair(), deflection=40.0) > few


@pytest.mark.slow
def test_fewest_pairs_give_the_same_results(mesh):
    four = prepare(mesh.pair, resolution=FOUR_PAIRS)
    relief = flank(tip=15.0, tip_length=4.0)
    wide, same = (solve(m, 100.0, pinion=relief, wheel=relief) for m in (four, mesh))
    assert bool(jnp.all(same.converged))
    np.testing.assert_allclose(same.transmission_error, wide.transmission_error, atol=1e-9)


@pytest.mark.slow
def test_contact_beyond_the_pairs_carried_along_is_not_converged(sliced):
    torque = 50.0 * float(np.min(sliced.outer_gap)) / 4.0  # 4 um is less than the deflection at 50 N m
    cycle = solve(sliced, torque)  # of two pairs
    assert not np.all(cycle.converged) and np.max(cycle.residual) < 1e-10
    assert np.all(solve(prepare(gear_pair(), resolution=FOUR_PAIRS), torque).converged)


@pytest.mark.slow
def test_high_contact_ratio_needs_three_pairs():
    cycle = solve(prepare(high_contact_ratio_pair(), resolution=FOUR_PAIRS), 60.0)
    loaded = np.sum(np.asarray(cycle.line_load)[:, 0] > 0, axis=0)
    assert loaded.min() == 2 and loaded.max() == 3
    assert np.all(cycle.converged)
    normal = solve(prepare(gear_pair((40, 60), 2.0, bores=(40.0, 60.0))), 60.0)
    assert np.ptp(cycle.transmission_error) < np.ptp(normal.transmission_error)


def test_unloaded_transmission_error_is_the_limit_of_light_load(mesh):
    pinion, wheel = flank(tip=5.0, tip_length=3.0, barrel=2.0), flank(profile_slope=3.0)
    light, none = (solve(mesh, torque, pinion, wheel) for torque in (1e-6, 0.0))
    np.testing.assert_allclose(light.transmission_error, light.unloaded_transmission_error, atol=1e-5)
    np.testing.assert_allclose(none.transmission_error, none.unloaded_transmission_error, atol=1e-13)
    np.testing.assert_allclose(none.pair_force, 0.0, atol=1e-12)
    assert np.all(none.converged) and np.all(light.converged)
    smallest = np.min(np.asarray(none.gap) / np.asarray(mesh.lever), axis=(0, 1))
    np.testing.assert_allclose(none.unloaded_transmission_error, smallest, rtol=1e-14)


def test_common_material_removal_shifts_the_transmission_error(mesh):
    """A constant thickness off a whole flank: the wheel lags by it where no corner is in contact."""
    plain, thin = solve(mesh, 50.0), solve(mesh, 50.0, wheel=flank(constant=7.0))
    corner = np.any((np.asarray(thin.line_load)[:, 0] > 0) & (np.asarray(mesh.outside)[:, 0] > 0), axis=0)
    shift = np.subtract(thin.transmission_error, plain.transmission_error)[~corner]
    assert 8 < shift.size < 32
    np.testing.assert_allclose(shift, 7.0, atol=1e-11)


def test_more_torque_deflects_and_presses_more(mesh):
    cycles = [solve(mesh, torque, flank(tip=6.0, tip_length=4.0)) for torque in (5.0, 20.0, 80.0)]
    for light, heavy in zip(cycles, cycles[1:]):
        assert np.all(np.asarray(heavy.transmission_error) > np.asarray(light.transmission_error))
        assert np.max(heavy.contact_pressure) > np.max(light.contact_pressure)
        assert float(jg.effective_contact_ratio(heavy)) > float(jg.effective_contact_ratio(light))


@pytest.fixture(scope="module")
def in_plane(mesh):
    """Meshes by plane."""
    known = {plane: prepare(gear_pair(), jg.default_compliance(plane)) for plane in ("stress", "strain")}
    return known | {"auto": mesh}


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["auto", "stress", "strain"])
def test_structure_matrix_is_symmetric_positive_definite(plane, in_plane):
    structure = np.asarray(in_plane[plane].structure)[:, :, 0].transpose(2, 0, 1)
    np.testing.assert_allclose(structure, structure.transpose(0, 2, 1), rtol=1e-10, atol=1e-16)
    assert np.linalg.eigvalsh(structure).min() > 0


@pytest.mark.slow
def test_plane_strain_is_stiffer_and_a_gear_lies_between(in_plane):
    stress, strain, between = (
        np.asarray(solve(in_plane[plane], 50.0).transmission_error) for plane in ("stress", "strain", "auto")
    )
    assert np.all((stress / strain > 1.02) & (stress / strain < 1.10))
    assert np.all((strain < between) & (between < stress))


def test_nan_never_passes_for_a_good_design(mesh):
    from jaxgear.contact import solve_removed

    removed = jnp.zeros((2, 1, 32)).at[1, 0, 3].set(jnp.nan)
    broken = solve_removed(mesh, 50.0, removed)
    assert bool(broken.converged[2]) and not bool(broken.converged[3])
    assert np.isnan(jg.peak_to_peak(broken.transmission_error))


def test_defaults(mesh):
    assert jg.Resolution() == jg.Resolution(positions=64, slices=1, pairs=None)
    explicit = prepare(gear_pair(), jg.default_compliance("auto"))
    np.testing.assert_array_equal(mesh.structure, explicit.structure)
