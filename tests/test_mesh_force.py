"""The force of a mesh over mesh position and DTE: its map, the coast flanks and the simpler models."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, SLIDING, gear_pair

import jaxgear as jg
from jaxgear.contact import removed_material, solve_removed
from jaxgear.contact.mesh import prepare_from
from jaxgear.contact.prescribed import solve_series
from jaxgear.dynamics import mesh_force
from jaxgear.dynamics.force_map import _coast_phase
from jaxgear.geometry.involute import half_tooth_angle

TORQUE = 30.0
ALLOWANCE = -40.0
SIZES = LINE
RELIEFS = {"pinion": jg.TipRelief(6.9, 3.4), "wheel": jg.TipRelief(5.0, 3.0)}
NO_RELIEFS = {"pinion": jg.TipRelief(0.0, 3.4), "wheel": jg.TipRelief(0.0, 3.0)}
MODIFICATIONS = {"relieved": RELIEFS, "nominal": NO_RELIEFS}


@pytest.fixture(scope="module")
def mesh():
    return prepared(SIZES)


def prepared(sizes):
    return jg.prepare(gear_pair(shift=(0.3, -0.1), tooth_thickness_allowance=ALLOWANCE), resolution=sizes)


@pytest.fixture(scope="module")
def static_force(mesh):
    return static_force_of(mesh)


def static_force_of(mesh):
    return 1e3 * TORQUE / mesh.pair.pinion.base_radius


@pytest.fixture(scope="module", params=list(MODIFICATIONS))
def case(request, mesh):
    """Modifications and the map at the positions of the mesh."""
    given = MODIFICATIONS[request.param]
    return given, mapped(mesh, given, **COARSE)


COARSE = {"positions": 16, "reach": 3.5}


def mapped(mesh, given, **options):
    made = mesh_force(mesh, torque=TORQUE, **given, **options)
    assert bool(made.converged)
    return made


@pytest.fixture(scope="module", params=list(MODIFICATIONS))
def fine(request, mesh):
    """Modifications and the map of default size."""
    given = MODIFICATIONS[request.param]
    return given, mapped(mesh, given, reach=3.5)


@eqx.filter_jit
def forces(force, phase, dte):
    return jax.vmap(force)(phase, dte)


@eqx.filter_jit
def starts(force, phase):
    return force.at(phase).start


@eqx.filter_jit
def static_errors(force, phase, load):
    return jax.vmap(lambda at: force.static_te(at, load))(phase)


@eqx.filter_jit
def solved(mesh, removed, dte, compliance):
    at = partial(solve_series, mesh, removed=removed, compliance=compliance)
    return jax.vmap(lambda q: at(jnp.full(mesh.resolution.positions, q)).force)(dte)


def direct(mesh, removed, dte, compliance=0.0):
    """Force at every DTE, shape (DTEs, positions)."""
    return np.asarray(solved(mesh, removed, jnp.asarray(dte), jnp.asarray(compliance)))


def random_dtes(random):
    return random.uniform(-5.0, 16.0, 80)


@pytest.mark.slow
def test_a_load_has_the_transmission_error_of_the_contact_analysis(case, mesh, static_force):
    given, force = case
    removed = removed_material(mesh, TORQUE, **given)
    for share in (0.2, 1.0, 3.0):
        cycle = solve_removed(mesh, share * TORQUE, removed)
        found = static_errors(force, mesh.phase, share * static_force)
        np.testing.assert_allclose(found, cycle.transmission_error, rtol=1e-3, atol=1e-3)


def errors(case, mesh, static_force, dte):
    """Of the static force, or of the force itself where that is larger; also far beyond the static deflection."""
    given, force = case
    wanted = direct(mesh, removed_material(mesh, TORQUE, **given), dte).ravel()
    phase, dte = (part.ravel() for part in np.meshgrid(mesh.phase, dte))
    assert wanted.max() > 2.5 * static_force and wanted.min() == 0
    return np.abs(np.asarray(forces(force, phase, dte)) - wanted) / np.maximum(wanted, static_force)


def test_the_map_is_that_of_the_contact_analysis(case, mesh, static_force):
    """At its positions as far as the levels let it be, and near between them."""
    random = np.random.default_rng(7)
    assert errors(case, mesh, static_force, random_dtes(random)).max() < 5e-3
    aside = prepare_from(jnp.asarray(0.5 / 16), mesh.pair, mesh.compliance, mesh.resolution, None, mesh.even)
    between = errors(case, aside, static_force, random_dtes(random))
    assert np.median(between) < 0.01 and between.max() < 0.5, (np.median(between), between.max())


@pytest.mark.slow
def test_between_its_grid_the_map_is_within_half_a_percent_of_the_contact_analysis(fine, mesh, static_force):
    random = np.random.default_rng(7)
    for first in random.uniform(0, 1 / 16, 4):
        aside = prepare_from(first, mesh.pair, mesh.compliance, mesh.resolution, None, mesh.even)
        assert errors(fine, aside, static_force, random_dtes(random)).max() < 5e-3


@pytest.mark.slow
def test_the_map_is_that_of_the_contact_analysis_where_contacts_slide():
    mesh = prepared(SLIDING)
    case = RELIEFS, mapped(mesh, RELIEFS, **COARSE)
    test_a_load_has_the_transmission_error_of_the_contact_analysis(case, mesh, static_force_of(mesh))
    test_the_map_is_that_of_the_contact_analysis(case, mesh, static_force_of(mesh))


def test_the_force_rises_outside_the_clearance_and_is_exactly_zero_in_it(case, mesh):
    force = case[1]
    backlash = float(mesh.pair.backlash)
    dte = np.linspace(-backlash - 60.0, 60.0, 2001)
    for phase in np.random.default_rng(1).uniform(-1, 2, 5):
        touch, back = np.asarray(starts(force, jnp.asarray(phase)))
        found = np.asarray(forces(force, np.full_like(dte, phase), dte))
        inside = (dte <= touch) & (dte >= -back)
        assert not np.any(found[inside]) and np.all(found[dte > touch] > 0) and np.all(found[dte < -back] < 0)
        rising = np.diff(found)
        assert np.all(rising[~(inside[1:] & inside[:-1])] > 0)
        np.testing.assert_allclose(np.diff(found, 2)[-20:], 0.0, atol=1e-9)  # linear beyond the table


@pytest.mark.slow
def test_both_flanks_are_the_same_gears_in_a_mirror(fine, mesh):
    """About the mesh position where the pinion's tooth stands on the line of centres with equal play on both sides."""
    force, backlash = fine[1], mesh.pair.backlash
    first, shift, _ = _coast_phase(mesh)
    middle = 0.5 * (first + shift / 16)
    random = np.random.default_rng(3)
    aside, dte = jnp.asarray(random.uniform(0, 1, 40)), jnp.asarray(random.uniform(0, 25.0, 40))
    drive = forces(force, middle + aside, dte)
    coast = forces(force, middle - aside, -backlash - dte)
    # each side is solved at positions of its own, between which the map is linear: at nodes it is exact, see below
    np.testing.assert_allclose(coast, -drive, rtol=5e-3, atol=10.0)


def test_about_its_middle_a_grid_has_both_flanks_at_the_same_places(mesh):
    """Other gears than equal ones: where the grid begins at the middle of the mirror, nothing is interpolated."""
    first, shift, play = _coast_phase(mesh)
    middle = 0.5 * (first + shift / 16)
    steps = jnp.floor(16 * middle)
    centred = prepare_from(middle - steps / 16, mesh.pair, mesh.compliance, SIZES, None, mesh.even)
    made = mapped(centred, RELIEFS, **COARSE)
    mirrored = (2 * int(steps) - np.arange(16)) % 16
    assert not np.allclose(made.node_force[0], made.node_force[0][mirrored], rtol=0.05)
    np.testing.assert_allclose(made.start[1], made.start[0][mirrored] + play, rtol=0, atol=1e-9)
    np.testing.assert_allclose(made.node_force[1], made.node_force[0][mirrored], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(made.node_stiffness[1], made.node_stiffness[0][mirrored], rtol=1e-9, atol=1e-9)


def test_the_coast_flanks_touch_where_both_gears_turned_back_put_them(mesh):
    """From the flanks' own angles: a tooth that touches at s on one side touches at s' on the other."""
    pair, path = mesh.pair, mesh.path_of_contact
    angle, play = pair.working_pressure_angle, 1e-3 * pair.backlash
    first, shift, _ = _coast_phase(mesh)

    def centreline(gear, sign, rho):
        """Angle of the tooth that touches there beyond the line of centres, in the sense of the pinion's path."""
        return sign * (jnp.arctan(rho / gear.base_radius) - angle - half_tooth_angle(gear, rho))

    for gear, length, sign in ((pair.pinion, path.pinion_roll_length, 1), (pair.wheel, path.wheel_roll_length, -1)):
        for phase in (0.0, 0.3):
            there = centreline(gear, sign, length(phase * pair.base_pitch))
            mirrored = -centreline(gear, sign, length((first + shift / 16 - phase) * pair.base_pitch))
            # the pinion is turned back by half the play, the wheel on
            turned = there - sign * 0.5 * play / gear.base_radius
            pitches = (turned - mirrored) * gear.teeth / (2 * jnp.pi)
            assert float(jnp.abs(pitches - jnp.round(pitches))) < 1e-9


def test_equal_gears_are_their_own_mirror_image_half_a_pitch_on():
    pair = gear_pair((30, 30), bores=(None, None), tooth_thickness_allowance=ALLOWANCE)
    first, shift, play = _coast_phase(jg.prepare(pair, resolution=SIZES))
    assert float(first + shift / 16) == pytest.approx(0.5, abs=1e-12)
    assert float(play) == pytest.approx(float(pair.backlash))
    made, other = (
        mapped(jg.prepare(pair, resolution=SIZES), {"pinion": RELIEFS[first], "wheel": RELIEFS[second]}, **COARSE)
        for first, second in (("pinion", "wheel"), ("wheel", "pinion"))
    )
    # half a pitch is half of the grid: both sides are solved at the same places
    mirrored = (8 - np.arange(16)) % 16
    np.testing.assert_allclose(made.start[1], made.start[0][mirrored] + play, atol=1e-9)
    np.testing.assert_allclose(made.node_force[1], made.node_force[0][mirrored], rtol=1e-9, atol=1e-9)
    # driven by the other gear the reliefs change places, and approach and recess with them
    np.testing.assert_allclose(other.node_force[0], made.node_force[0][-np.arange(16)], rtol=1e-9, atol=1e-9)


def test_other_coast_flanks_change_nothing_on_the_drive_side(mesh):
    nominal = tuple(NO_RELIEFS.values())
    plain, other = (mapped(mesh, RELIEFS, **COARSE, coast=coast) for coast in (None, nominal))
    np.testing.assert_array_equal(plain.node_force[0], other.node_force[0])
    dte = -mesh.pair.backlash - 10.0
    assert np.any(forces(plain, mesh.phase, jnp.full(16, dte)) != forces(other, mesh.phase, jnp.full(16, dte)))


@pytest.mark.slow
@pytest.mark.parametrize("dte", [8.0, -84.0])  # on the drive flanks and, 75 um of backlash behind, the coast ones
def test_gradients_equal_central_differences(mesh, dte):
    def at(amount):
        made = mesh_force(
            mesh, torque=TORQUE, pinion=jg.TipRelief(amount, 3.4), positions=16, levels=16, compliance=1e-3
        )
        return jax.vmap(lambda phase: made(phase, jnp.asarray(dte)))(jnp.asarray([0.11, 0.42, 0.83]))

    step = 1e-4
    _, found = jax.jvp(at, (jnp.asarray(6.9),), (jnp.asarray(1.0),))
    wanted = (at(jnp.asarray(6.9 + step)) - at(jnp.asarray(6.9 - step))) / (2 * step)
    assert float(jnp.max(jnp.abs(wanted))) > 1.0
    np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-5)


def test_what_is_in_series_adds_its_deflection(mesh):
    compliance, removed = 2e-3, removed_material(mesh, TORQUE, **RELIEFS)
    dte = np.linspace(1.0, 20.0, 80)
    with_it = direct(mesh, removed, dte, compliance)
    for row, q in zip(with_it[::13], dte[::13]):
        teeth = q - (compliance + mesh.hub / mesh.pair.face_width) * row
        found = jg.solve_at(mesh, teeth, torque=TORQUE, **RELIEFS)
        np.testing.assert_allclose(found.force, row, rtol=1e-8, atol=1e-8)


@pytest.mark.slow
def test_slices_share_what_is_in_series(mesh):
    """A load that is uniform over the face takes the force of one slice."""
    sliced = jg.prepare(mesh.pair, resolution=jg.Resolution(positions=16, pairs=2, slide_steps=0, slices=2))
    both = [
        direct(each, removed_material(each, TORQUE, **RELIEFS), np.linspace(3.0, 15.0, 80), 2e-3)
        for each in (mesh, sliced)
    ]
    np.testing.assert_allclose(*both, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("model", ["varying stiffness", "loaded error", "tangent"])
def test_simpler_models_have_the_static_transmission_error_of_their_torque(mesh, static_force, model):
    removed = removed_material(mesh, TORQUE, **RELIEFS)
    cycle = solve_removed(mesh, TORQUE, removed)
    force = mesh_force(mesh, torque=TORQUE, **RELIEFS, model=model, positions=16)
    np.testing.assert_allclose(static_errors(force, mesh.phase, static_force), cycle.transmission_error, rtol=1e-9)
    coast = np.asarray(forces(force, mesh.phase, jnp.full(16, -0.5 * mesh.pair.backlash)))
    assert model == "tangent" or not coast.any()
    if model == "tangent":
        slope = jax.vmap(force.stiffness)(mesh.phase, cycle.transmission_error)
        np.testing.assert_allclose(slope, cycle.tangent_stiffness, rtol=1e-9)
    else:
        touching = force.over_cycle(lambda phase: force.at(phase).start[0], static_force.dtype)
        np.testing.assert_allclose(touching, jnp.mean(cycle.unloaded_transmission_error), rtol=1e-9, atol=1e-9)
        loaded = force.over_cycle(lambda phase: force.static_te(phase, static_force), static_force.dtype)
        assert float(force.mean_secant_stiffness(static_force)) == pytest.approx(
            float(static_force / (loaded - touching)), rel=1e-5
        )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"torque": 0.0}, "torque = 0 N m must be greater than 0 N m"),
        ({"levels": 2}, "levels = 2 must be a whole number of at least 4"),
        ({"compliance": -1.0}, "compliance = -1 um/N must be at least 0 um/N"),
        ({"reach": 0.5}, "reach = 0.5 must be at least 1"),
        ({"model": "exact"}, "model = 'exact' must be one of \"map\""),
        (
            {"pinion": jg.TabulatedProfile([0.0, 99.0], [-50.0, -50.0])},
            "the clearance between drive and coast flanks = ",
        ),
    ],
)
def test_wrong_input_is_named(mesh, given, message):
    with pytest.raises(ValueError, match=message):
        mesh_force(mesh, **({"torque": TORQUE, "positions": 16} | given))


def test_coast_flanks_are_a_pair_of_modifications(mesh):
    with pytest.raises(TypeError, match=r"coast is TipRelief\(.*must be a tuple \(pinion, wheel\)"):
        mesh_force(mesh, torque=TORQUE, **RELIEFS, **COARSE, coast=jg.TipRelief(1.0, 2.0))


def test_thinner_teeth_leave_their_arc_on_the_line_of_action_as_backlash():
    """The 50/50 pair with teeth of 4.64 mm: 2 x 72.4 um x cos(20 deg)."""
    pair = gear_pair((50, 50), bores=(None, None), tooth_thickness_allowance=-72.4)
    assert float(pair.backlash) == pytest.approx(136.07, abs=0.005)
    assert float(gear_pair((50, 50), bores=(None, None), tooth_thickness_allowance=0.0).backlash) == pytest.approx(
        float(gear_pair((50, 50), bores=(None, None)).backlash), abs=0.0
    )


def test_thicker_teeth_are_refused():
    with pytest.raises(ValueError, match="Gear: tooth_thickness_allowance = 1 um must be at most 0 um"):
        gear_pair(tooth_thickness_allowance=1.0)
