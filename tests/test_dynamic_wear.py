"""Wear under the force of the steady motion: its limits over speed, what is worn off, and the dynamic factor."""

import functools
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair, prepare

import jaxgear as jg
from jaxgear.contact import removed_material
from jaxgear.contact.prescribed import solve_forces
from jaxgear.dynamics import Dynamics, natural_frequencies
from jaxgear.wear import Wear, mean_over_life, over_life, wear, wear_depth, worn_volume
from jaxgear.wear.settings import OF_HISTORY
from jaxgear.wear.worn_volume import deposit

SIZES = LINE
TORQUE, COEFFICIENT, REVOLUTIONS, BLOCKS = 100.0, 1e-18, 4e7, 2
TEETH = 20, 30
# compiles in a tenth of the time of the map; as many steps as the lowest speed needs, so that one program serves all
SETTINGS = Dynamics([1.0], damping_ratio=0.1, model="varying stiffness", positions=16, steps=256)
RELIEF = jg.TipRelief(8.0, 2.0)
FLANKS = {"pinion": RELIEF, "wheel": RELIEF}


def prepared(play):
    """With so much less tooth thickness [um]."""
    return prepare(
        gear_pair(TEETH, face_width=20.0, bores=(None, None), tooth_thickness_allowance=-play), resolution=SIZES
    )


@pytest.fixture(scope="module")
def mesh():
    return prepared(60.0)


@pytest.fixture(scope="module")
def natural(mesh):
    """Natural frequency [Hz]."""
    return float(natural_frequencies(SETTINGS.oscillator(mesh, TORQUE, **FLANKS)).mesh)


def at(frequency):
    """The load at a mesh frequency [Hz]."""
    return jg.OperatingPoint(TORQUE, 60 * frequency / TEETH[0])


def life_of(mesh, frequency, revolutions=REVOLUTIONS, **options):
    given = {"coefficient": COEFFICIENT, "blocks": BLOCKS, "dynamics": SETTINGS, **FLANKS}
    return wear(mesh, at(frequency), revolutions, **{**given, **options})


PHASES = np.linspace(0.0, 1.0, 64, endpoint=False)
OF_MESH = slice(None, None, 4)


@eqx.filter_jit
def motion_of(oscillator, frequency):
    """Forces at `PHASES`."""
    return SETTINGS.force(oscillator, frequency, jnp.asarray(PHASES), SETTINGS.steps)


def motion_at(mesh, frequency, **flanks):
    """What vibrates with new flanks or others, and its forces."""
    oscillator = SETTINGS.oscillator(mesh, TORQUE, **{**FLANKS, **flanks})
    return oscillator, jax.tree.map(np.asarray, motion_of(oscillator, jnp.asarray(frequency)))


def static_force(mesh):
    return 1e3 * TORQUE / float(mesh.pair.pinion.base_radius)


@pytest.fixture(scope="module")
def resonant(mesh, natural):
    return life_of(mesh, natural)


@pytest.mark.slow
def test_slow_gears_have_the_static_force(mesh, natural):
    """But for the vibration after every step of the stiffness."""
    _, motion = motion_at(mesh, natural / 40)
    assert motion.status == 0 and not motion.back_side_contact
    np.testing.assert_allclose(motion.force[:, OF_MESH], static_force(mesh), rtol=0.02)
    assert motion.force.std() < 0.01 * static_force(mesh)


@pytest.mark.slow
def test_slow_gears_wear_as_under_the_static_load(mesh, natural):
    slow, static = life_of(mesh, natural / 40), life_of(mesh, natural, dynamics=None)
    assert slow.converged.all() and static.dynamic_factor is None
    np.testing.assert_allclose(wear_depth(slow)[1:], wear_depth(static)[1:], rtol=0.01)
    np.testing.assert_allclose(worn_volume(slow)[-1].sum(), worn_volume(static)[-1].sum(), rtol=0.01)
    assert 1.0 < float(slow.dynamic_factor[0]) < 1.1


@pytest.mark.slow
def test_far_above_the_resonance_the_approach_stands_still(mesh, natural):
    oscillator, motion = motion_at(mesh, 12 * natural)
    force = jax.jit(jax.vmap(oscillator.mesh_force, in_axes=(0, None)))
    low, high = 0.0, 50.0
    mean = static_force(mesh)
    for _ in range(50):  # the DTE at which the mean force is the static one
        middle = 0.5 * (low + high)
        low, high = (middle, high) if np.mean(np.asarray(force(PHASES, middle))) < mean else (low, middle)
    standing = np.asarray(force(PHASES, low))
    assert np.ptp(standing) > 0.1 * standing.mean()
    np.testing.assert_allclose(motion.force[0], standing, atol=0.01 * standing.mean())


@pytest.mark.slow
def test_the_worn_volume_is_that_of_the_forces_of_the_motion(mesh, natural):
    """Of a life so short that the flanks stay what they are."""
    (_, motion), place = motion_at(mesh, natural), deposit(mesh, jnp.asarray(TORQUE), 9)
    short = life_of(mesh, natural, 1e-3)
    force = motion.force[0, OF_MESH]
    assert motion.status == 0 and motion.force.shape == (12, 64) and (force >= 0).all()
    contact = solve_forces(mesh, jnp.asarray(force), removed_material(mesh, TORQUE, **FLANKS))
    carried = np.asarray(contact.line_load)[:, 0] * float(mesh.slice_width[0])
    np.testing.assert_allclose((carried * np.asarray(mesh.lever)[:, 0]).sum(axis=0), force, rtol=1e-10)
    sliding = np.einsum("ij,pij->p", carried, np.asarray(place.sliding).sum(axis=-1)[:, :, 0])
    passages = 1e-3 * np.array([1.0, TEETH[0] / TEETH[1]])
    np.testing.assert_allclose(worn_volume(short)[-1], 1e6 * COEFFICIENT * passages[:, None] * sliding, rtol=1e-9)
    # Newton: over a cycle nothing is accelerated
    assert float(motion.force.mean()) == pytest.approx(static_force(mesh), rel=1e-3)
    assert float(motion.force.max()) == pytest.approx(float(short.dynamic_factor[0]) * static_force(mesh), rel=0.01)


def test_a_force_is_carried_as_its_torque_is(mesh, resonant):
    """Whatever the forces are at other positions."""
    removed, full = removed_material(mesh, TORQUE, **FLANKS), static_force(mesh)
    shares = np.where(np.arange(16) < 8, 1.0, 0.5), np.where(np.arange(16) < 8, 0.5, 1.0)
    loads = []
    for share in shares:
        contact = solve_forces(mesh, jnp.asarray(full * share), removed)
        loads.append(np.asarray(contact.line_load)[:, 0])
        assert np.asarray(contact.converged).all()
        carried = loads[-1] * float(mesh.slice_width[0]) * np.asarray(mesh.lever)[:, 0]
        np.testing.assert_allclose(carried.sum(axis=0), full * share, rtol=1e-10)
    static = np.asarray(resonant.cycles.line_load)[0, :, 0]  # of the new flanks
    np.testing.assert_allclose(np.where(shares[0] == 1, *loads), static, rtol=1e-8, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("slices", [1, 7])
def test_one_force_at_every_position_is_a_torque(mesh, slices):
    """Coupled slices too."""
    mesh = mesh if slices == 1 else prepare(mesh.pair, resolution=replace(SIZES, slices=slices, face_modes=3))
    forces = jnp.asarray(static_force(mesh) * np.where(np.arange(16) < 8, 1.0, 0.5))
    contact = solve_forces(mesh, forces, removed_material(mesh, TORQUE, **FLANKS))
    full = jg.solve(mesh, TORQUE, **FLANKS)
    half = jg.contact.solve_removed(mesh, TORQUE / 2, removed_material(mesh, TORQUE, **FLANKS))
    expected = np.where(np.arange(16) < 8, full.line_load, half.line_load)
    assert contact.converged.all()
    np.testing.assert_allclose(contact.line_load, expected, rtol=1e-8, atol=1e-8)


@pytest.mark.slow
def test_wear_is_deeper_where_the_force_of_the_motion_peaks(mesh, natural):
    """Where a pair is alone, its load is the force of the motion."""
    dynamic, static = life_of(mesh, natural, 1e5), life_of(mesh, natural, 1e5, dynamics=None)
    factor = np.asarray(motion_at(mesh, natural)[1].force[0, OF_MESH]) / static_force(mesh)
    carried = np.asarray(static.cycles.pair_force[0])
    peak = np.argmax(np.where((carried > 0).sum(axis=0) == 1, factor, 0.0))
    roll = float(mesh.sides[0].contact_roll_length[carried[:, peak].argmax(), 0, peak])
    depths = [np.interp(roll, life.roll_length[0], life.pinion_depth[-1, 0]) for life in (dynamic, static)]
    assert factor[peak] > 1.2
    assert depths[0] / depths[1] == pytest.approx(factor[peak], rel=0.1)


def test_the_dynamic_factor_is_that_of_the_worn_flanks(mesh, natural, resonant):
    factors = np.asarray(resonant.dynamic_factor)
    assert np.asarray(resonant.converged).all() and factors.shape == (BLOCKS + 1,)
    worn = dict(zip(FLANKS, resonant.flanks(-1)))
    for factor, flanks in ((factors[0], FLANKS), (factors[-1], {gear: RELIEF + worn[gear] for gear in FLANKS})):
        motion = motion_at(mesh, natural, **flanks)[1]
        assert float(factor) == pytest.approx(float(motion.force.max()) / static_force(mesh), rel=0.01)
        assert float(factor) == pytest.approx(float(motion.dynamic_factor), rel=2e-3)
    assert abs(factors[-1] - factors[0]) > 0.02


@pytest.mark.slow
def test_the_dynamic_factor_is_that_of_a_run_on_the_worn_flanks(mesh, natural, resonant):
    there = replace(SETTINGS, mesh_frequencies=[natural])
    for life in (0, -1):
        worn = dict(zip(FLANKS, resonant.flanks(life)))
        flanks = {gear: RELIEF + worn[gear] for gear in FLANKS}
        run = there.run(there.oscillator(mesh, TORQUE, **flanks), "up")
        assert float(resonant.dynamic_factor[life]) == pytest.approx(float(run.dynamic_factor[0]), rel=2e-3)
    assert abs(float(resonant.dynamic_factor[-1] - resonant.dynamic_factor[0])) > 0.02


def test_the_dynamic_factor_is_a_quantity_of_the_life(mesh, natural, resonant):
    settings = Wear(REVOLUTIONS, COEFFICIENT, blocks=BLOCKS, dynamics=SETTINGS)
    factors = np.asarray(resonant.dynamic_factor)
    np.testing.assert_array_equal(over_life(resonant, "dynamic_factor"), factors)
    assert float(OF_HISTORY["worn_dynamic_factor"](resonant, settings)) == factors[-1]
    assert float(OF_HISTORY["max_dynamic_factor_over_life"](resonant, settings)) == factors.max()
    assert factors.min() < float(mean_over_life(resonant, "dynamic_factor")) < factors.max()
    quantity = settings.quantity("worn_dynamic_factor")
    again = Wear(REVOLUTIONS, COEFFICIENT, blocks=BLOCKS, dynamics=replace(SETTINGS, mesh_frequencies=[1.0]))
    assert quantity == again.quantity("worn_dynamic_factor")
    other = replace(settings, dynamics=replace(SETTINGS, damping_ratio=0.2))
    assert quantity != other.quantity("worn_dynamic_factor")
    np.testing.assert_array_equal(quantity.settings.dynamics.damping_ratio, SETTINGS.damping_ratio)


@pytest.mark.slow
def test_the_static_load_alone_gives_the_factors_of_flanks_that_it_has_worn(mesh, natural):
    static = life_of(mesh, natural, dynamics=None)
    seen = life_of(mesh, natural, line_load="static")
    np.testing.assert_allclose(seen.depth, static.depth, rtol=1e-9, atol=1e-12)
    assert seen.converged.all() and (np.asarray(seen.dynamic_factor) > 1.1).all()


def test_flanks_whose_coast_side_touches_are_not_known(natural):
    """Without play they do as soon as the teeth part."""
    tight = prepared(0.0)
    light = replace(SETTINGS, damping_ratio=0.01)
    life = life_of(tight, 0.9 * natural, dynamics=light)
    assert life.converged.tolist() == [True] + [False] * BLOCKS
    assert np.isfinite(life.dynamic_factor[0]) and np.isnan(life.dynamic_factor[1:]).all()
    assert np.isnan(wear_depth(life)[-1]) and np.isnan(over_life(life, "ppte")[-1])


@pytest.mark.slow
def test_steps_on_the_host_are_the_blocks(mesh, natural, resonant):
    made_of = []

    def keep(given, make):
        made_of.append(given)
        return make()

    options = {"coefficient": COEFFICIENT, "blocks": BLOCKS, "dynamics": SETTINGS, **FLANKS}
    steps = wear(mesh, at(natural), REVOLUTIONS, keep=keep, **options)
    np.testing.assert_array_equal(steps.depth, resonant.depth)
    np.testing.assert_array_equal(steps.dynamic_factor, resonant.dynamic_factor)
    kept = [str(leaf) for leaf in jax.tree.leaves(made_of[0])]
    assert str(SETTINGS.damping_ratio) in kept and "varying stiffness" in kept  # what a kept march is found by


@pytest.mark.parametrize(
    "options, message",
    [
        ({"torque": TORQUE}, r"dynamics needs a speed: give OperatingPoint\(torque, speed\)"),
        ({"torque": jg.OperatingPoint(TORQUE, 0.0)}, "speed with dynamics = 0 rpm must be greater than 0 rpm"),
        ({"torque": jg.OperatingPoint(0.0, 9.0)}, "torque with dynamics = 0 N m must be greater than 0 N m"),
        ({"dynamics": None, "line_load": "dynamic"}, 'line_load = "dynamic" needs dynamics'),
        ({"line_load": "quick"}, 'line_load = \'quick\' must be "static" or "dynamic"'),
        ({"dynamics": 3.0}, "dynamics is of type float, must be Dynamics"),
    ],
)
def test_refuses_in_one_line(mesh, options, message):
    given = {"torque": at(100.0), "dynamics": SETTINGS, "coefficient": COEFFICIENT, **options}
    with pytest.raises((ValueError, TypeError), match=message):
        wear(mesh, given.pop("torque"), REVOLUTIONS, **given)


def test_settings_and_lives_without_dynamics_are_refused(resonant):
    with pytest.raises(ValueError, match='line_load = "dynamic" needs dynamics'):
        Wear(REVOLUTIONS, COEFFICIENT, line_load="dynamic")
    with pytest.raises(ValueError, match='Wear: quantity "worn_dynamic_factor" needs dynamics'):
        Wear(REVOLUTIONS, COEFFICIENT).quantity("worn_dynamic_factor")
    life = replace(resonant, dynamic_factor=None)
    with pytest.raises(ValueError, match='"dynamic_factor" needs a wear history with dynamics'):
        over_life(life, "dynamic_factor")


@eqx.filter_jit
def worn(mesh, frequency, amount):
    """PPTE and dynamic factor of worn flanks with reliefs of some height."""
    relief = jg.TipRelief(amount, 2.0)
    life = life_of(mesh, frequency, pinion=relief, wheel=relief)
    return jnp.stack([over_life(life, "ppte")[-1], life.dynamic_factor[-1]])


@pytest.mark.slow
def test_designs_side_by_side_and_their_slopes_are_each_as_alone(mesh, natural):
    """One program has both designs and their slopes forward: those of differences, and the slope backward."""
    of = functools.partial(worn, mesh, 0.5 * natural)
    step, amounts = 1e-3, jnp.asarray([4.0, 8.0])
    along = jax.vmap(lambda amount: jax.jvp(of, (amount,), (jnp.ones_like(amount),)))
    together, forward = jax.jit(along)(amounts)
    np.testing.assert_allclose(together, np.stack([of(amount) for amount in amounts]), rtol=1e-7)
    difference = np.stack([(of(amount + step) - of(amount - step)) / (2 * step) for amount in amounts])
    np.testing.assert_allclose(forward, difference, rtol=1e-4)
    np.testing.assert_allclose(jax.jit(jax.jacrev(of))(amounts[1]), forward[1], rtol=1e-7)
    assert np.abs(difference).min() > 1e-4


@pytest.mark.slow
def test_loads_of_a_spectrum_wear_at_their_own_speeds(mesh, natural):
    """Of a short life the wear is the mean of both, by their shares."""
    loads = [at(frequency) for frequency in (0.4 * natural, natural)]
    spectrum = jg.LoadSpectrum([TORQUE, TORQUE], [1.0, 3.0], [float(load.speed) for load in loads])
    given = {"coefficient": COEFFICIENT, "blocks": BLOCKS, "dynamics": SETTINGS, **FLANKS}
    both = wear(mesh, spectrum, 1e4, **given)
    alone = [wear(mesh, load, 1e4, **given) for load in loads]
    assert both.dynamic_factor.shape == (BLOCKS + 1, 2)
    np.testing.assert_allclose(both.dynamic_factor[0], [life.dynamic_factor[0] for life in alone], rtol=1e-9)
    expected = 0.25 * alone[0].depth[-1] + 0.75 * alone[1].depth[-1]
    np.testing.assert_allclose(both.depth[-1], expected, rtol=1e-3, atol=1e-9)


@pytest.mark.slow
def test_slow_gears_wear_alike_by_the_map_of_forces(mesh, natural):
    """The map has the forces of the contact analysis but for what it interpolates."""
    mapped = replace(SETTINGS, model="map", positions=128, steps=512)
    slow = life_of(mesh, natural / 40, dynamics=mapped)
    static = life_of(mesh, natural, dynamics=None)
    assert slow.converged.all()
    np.testing.assert_allclose(wear_depth(slow)[1:], wear_depth(static)[1:], rtol=0.01)
