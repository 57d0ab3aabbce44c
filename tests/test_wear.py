"""Wear: Archard's law, where worn material goes, how blocks add up, and what is made of a life."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE, LINE, SLIDING, TWO_PAIRS, gear_pair, prepare

import jaxgear as jg
from jaxgear.conditions import solved
from jaxgear.contact.status import Status, status_of
from jaxgear.geometry import tooth_thickness
from jaxgear.wear import (
    life_to,
    life_to_depth,
    mean_over_life,
    over_life,
    passage_depth,
    specific_sliding,
    wear_depth,
    worn_volume,
)
from jaxgear.wear import wear as worn_flanks
from jaxgear.wear.case import case_of, marched, worn_through
from jaxgear.wear.history import history_of
from jaxgear.wear.march import WearRate, march
from jaxgear.wear.worn_volume import deposit, grid, worn

# contacts that stay at their nominal places: sliding down a kinked flank they see rounding, by up to 1e-3 um
SIZES = LINE
TORQUE, COEFFICIENT, REVOLUTIONS = 100.0, 1e-18, 4e7
BLOCKS = 8  # of lives that are gone through pair by pair; those in one program have two
POINTS = 33  # of every grid, so that one program makes all deposits
RELIEF = jg.TipRelief(5.0, 2.0)
STILL = np.zeros((2, 1, 16))  # shift of contacts that stay at their nominal places
EVERYWHERE = np.full((2, 1, 1, 1), 1e-18)  # coefficients of both gears, the same at all contacts
NONE = jg.TipRelief(0.0, 2.0)  # flanks of one kind, so that one program serves them all


def pair_of(*teeth):
    return gear_pair(teeth, face_width=20.0, bores=(None, None))


def life_of(mesh, torque=TORQUE, revolutions=REVOLUTIONS, **options):
    given = {"coefficient": COEFFICIENT, "blocks": 2, "pinion": NONE, "wheel": NONE}
    return worn_flanks(mesh, torque, revolutions, **{**given, **options})


def steps_of(mesh, **options):
    """The same life pair by pair of its blocks, for which one program serves any number of them."""
    given = {"coefficient": COEFFICIENT, "pinion": NONE, "wheel": NONE}
    given |= {} if "largest_increment" in options else {"blocks": BLOCKS}
    given |= {"callback": lambda *_: None}
    return worn_flanks(mesh, TORQUE, REVOLUTIONS, **{**given, **options})


@pytest.fixture(scope="module")
def mesh():
    return prepare(pair_of(20, 30), resolution=SIZES)


@pytest.fixture(scope="module")
def life(mesh):
    return steps_of(mesh)


@pytest.fixture(scope="module")
def equal():
    return prepare(pair_of(30, 30), resolution=SIZES)


@pytest.fixture(scope="module")
def place(mesh):
    return deposit(mesh, jnp.asarray(TORQUE), POINTS)


@eqx.filter_jit
def _told(life, limit, of):
    return over_life(life, of), life_to(life, of, limit), mean_over_life(life, of)


def told(life, limit=0.0, of="ppte"):
    """A quantity at every life, the life to a limit of it, and its mean."""
    return map(np.asarray, _told(life, np.asarray(limit), of))


sliding_of = jax.jit(specific_sliding)
thickness = jax.jit(tooth_thickness)


def test_specific_sliding_is_that_of_the_rolling_speeds(mesh):
    path = mesh.path_of_contact
    at = np.linspace(path.start, path.end, 7)
    first, second = map(np.asarray, path.rolling_speeds(at, 1000.0))
    pinion, wheel = sliding_of(path, at)
    np.testing.assert_allclose(pinion, np.abs(first - second) / first, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(wheel, np.abs(first - second) / second, rtol=1e-12, atol=1e-15)


def test_depths_of_the_50_50_pair_are_the_known_ones():
    """Two pairs share the load equally: um per million cycles of gear 1, at 200 N m and 1e-18 m2/N."""
    pair = gear_pair((50, 50), face_width=20.0, bores=(None, None), tips=(154.5709, 154.5709))
    path = prepare(pair, resolution=SIZES).path_of_contact
    assert float(pair.working_center_distance) == pytest.approx(150.0, rel=1e-12)
    at = np.array([path.start, path.inner_single, 0.0, path.outer_single, path.end])
    load = 2837.8 / 20.0 * np.array([0.5, 1.0, 1.0, 1.0, 0.5])
    depth = 1e6 * 1e9 * 1e-18 * load * np.asarray(sliding_of(path, at)[0])
    # at the two inner points the load is the full one or half of it: the full one is meant
    np.testing.assert_allclose(depth, [0.0440, 0.0346, 0.0, 0.0278, 0.0271], atol=6e-5)


def test_nothing_wears_at_the_pitch_point(life):
    cycle = jax.tree.map(lambda leaf: np.asarray(leaf)[0], life.cycles)
    pitch = np.asarray(cycle.kinematics.path)[:, 0] == 0
    assert pitch.any() and np.asarray(cycle.line_load)[:, 0][pitch].all()
    for depth in passage_depth(cycle, COEFFICIENT):
        assert (np.asarray(depth)[:, 0][pitch] == 0).all()
        assert np.asarray(depth).max() > 0


def test_flanks_slide_by_the_closed_form_and_beyond_the_path_on(mesh, place):
    path = mesh.path_of_contact
    inverse = 1 / float(path.pinion_base_radius) + 1 / float(path.wheel_base_radius)
    flank, corner = np.asarray(place.sliding).sum(axis=-1)[:, :, 0]
    np.testing.assert_allclose(flank.sum(), 0.5 * (float(path.start) ** 2 + float(path.end) ** 2) * inverse, rtol=1e-12)
    beyond = np.asarray(mesh.outside)[:, 0] > float(path.base_pitch) / 16
    assert (flank[beyond] == 0).all() and (corner[beyond] > 0).all()
    # corners begin to slide as fast as the flanks did at the end of the path
    piece = float(path.base_pitch) / 16
    nearest = np.where(beyond, np.asarray(mesh.outside)[:, 0], np.inf).argmin()
    expected = piece * inverse * max(-float(path.start), float(path.end))
    assert 0.5 * expected < corner.ravel()[nearest] < 1.2 * expected


def test_the_arcs_of_the_points_are_those_of_their_hat_functions(mesh, place):
    """An involute is ds = l dl / r_b long; of what lies between two points the one above has more."""
    for length, arc, gear in zip(
        np.asarray(place.roll_length), np.asarray(place.arc), (mesh.pair.pinion, mesh.pair.wheel)
    ):
        base_radius, first, last = float(gear.base_radius), length[0], length[-1]
        np.testing.assert_allclose(arc.sum(), (last**2 - first**2) / (2 * base_radius), rtol=1e-12)
        # hat functions interpolate l itself exactly
        np.testing.assert_allclose(arc @ length, (last**3 - first**3) / (3 * base_radius), rtol=1e-12)
        # and by Simpson's rule, exact for the parabolas that hats times l are between points
        middle, sixth = 0.5 * (length[1:] + length[:-1]), np.diff(length) / 6
        below, above = sixth * (length[:-1] + 2 * middle), sixth * (2 * middle + length[1:])
        np.testing.assert_allclose(arc, (np.append(below, 0.0) + np.append(0.0, above)) / base_radius, rtol=1e-12)


def test_every_contact_leaves_its_wear_where_it_is(mesh, place):
    """The middle of its places is its nominal one, and its shift from there: along both flanks, which turn towards each
    other; the volume stays."""
    load, moved = jnp.asarray(np.full((2, 1, 16), 0.1 * float(place.full_load))), 0.05
    shifts = [jnp.asarray(STILL + by) for by in (0.0, moved)]
    arcs_of = eqx.filter_jit(lambda place, shift: place.arcs(load, shift))
    still, shifted = (np.asarray(arcs_of(place, shift)).mean(axis=(-2, -1)) for shift in shifts)
    depths = [np.asarray(worn(load, shift, EVERYWHERE, place)) for shift in shifts]
    still_volume, volume = (np.einsum("gpsk,gk->gp", depth, place.arc) for depth in depths)
    np.testing.assert_allclose(volume, still_volume, rtol=1e-12)
    for gear, side in enumerate(mesh.sides):
        arc = np.asarray(side.contact_roll_length)[:, 0] ** 2 / (2 * float(side.base_radius))
        ends = np.asarray(place.roll_length)[gear, [0, -1]] ** 2 / (2 * float(side.base_radius))
        inner = (arc > ends[0] + 0.3) & (arc < ends[1] - 0.3) & (np.asarray(mesh.outside)[:, 0] == 0)
        assert inner.sum() > 10
        np.testing.assert_allclose(still[gear, :, 0][inner], arc[inner], atol=1e-3)
        away = (shifted - still)[gear, :, 0][inner]
        np.testing.assert_allclose(away, (moved, -moved)[gear], atol=1e-12)
        # what is worn off has moved on too, but for what is folded back at the ends
        arcs = np.asarray(place.roll_length)[gear] ** 2 / (2 * float(side.base_radius))
        before, after = (
            (depth[gear, 0, 0] * np.asarray(place.arc)[gear]) @ arcs / still_volume[gear, 0] for depth in depths
        )
        assert (after - before) / (moved, -moved)[gear] == pytest.approx(1.0, abs=0.15)


def test_contacts_on_a_slope_wear_the_flank_to_which_they_have_slid():
    """A relief lets contacts of the tip slide to where it begins: farther down its flank, up that of the wheel."""
    mesh = prepare(pair_of(20, 30), resolution=SLIDING)
    options = {"pinion": jg.TipRelief(30.0, 3.0, jg.Linear()), "wheel": None, "deviation": None, "points": POINTS}
    case = case_of(mesh, TORQUE, coefficient=COEFFICIENT, **options)
    place = jax.tree.map(lambda leaf: leaf[0], case.places())
    found = case.under(jax.tree.map(lambda leaf: leaf[0], case.loads), place, case.start())
    load, shift = (found.seen[name] for name in ("line_load", "shift"))
    assert float(shift[:, 0].min()) < -0.02
    np.testing.assert_allclose(found.rate, worn(load, shift, EVERYWHERE, place), rtol=1e-12)
    nominal = np.asarray(worn(load, STILL, EVERYWHERE, place))
    volumes = [np.asarray(rate)[:, 0, 0] * np.asarray(place.arc) for rate in (found.rate, nominal)]
    slid, stayed = (np.einsum("gk,gk->g", volume, place.roll_length) / volume.sum(axis=1) for volume in volumes)
    assert slid[0] < stayed[0] - 0.01 and slid[1] > stayed[1] + 0.01


def test_a_contact_wears_over_the_width_of_its_own_load(mesh, place):
    """Its mean square is a fourth of that of the half width, which grows with the root of the load; at the root of the
    driver, where the full load is several points wide."""
    arc = np.asarray(place.roll_length)[0] ** 2 / (2 * float(mesh.sides[0].base_radius))
    at = np.abs(np.asarray(mesh.path) - (float(mesh.path_of_contact.start) + 1.0)).argmin()
    full = float(place.full_load)
    assert full == pytest.approx(1e3 * TORQUE / float(mesh.sides[0].base_radius) / 20.0)

    def square(share):
        load = np.zeros((2, 3, 16))
        load[:, 0].flat[at] = share * full
        left = np.asarray(worn(jnp.asarray(load), STILL, EVERYWHERE, place))[0, 0, 0]
        left = left * np.asarray(place.arc)[0] / (left @ np.asarray(place.arc)[0])
        return left @ (arc - left @ arc) ** 2

    none, light, whole = (square(share) for share in (1e-12, 0.25, 1.0))
    squared = float(np.ravel(mesh.width_factor)[at]) * full  # half width under the full load
    assert whole - none == pytest.approx(squared / 4, rel=0.1)
    assert light - none == pytest.approx(squared / 16, rel=0.2)


def test_worn_volume_is_coefficient_times_force_times_sliding(mesh, place):
    load = np.random.default_rng(1).uniform(0, 100, (2, 3, 16))  # slices wear by their own loads
    coefficients = np.array([2e-18, 5e-18])
    depth = worn(jnp.asarray(load), STILL, jnp.asarray(coefficients[:, None, None, None]), place)
    width = float(mesh.slice_width[0])
    volume = 1e-3 * np.einsum("gpsk,gk->gps", np.asarray(depth), np.asarray(place.arc)) * width
    sliding = np.einsum("isj,pij->ps", load * width, np.asarray(place.sliding).sum(axis=-1)[:, :, 0])
    np.testing.assert_allclose(volume, 1e6 * coefficients[:, None, None] * sliding, rtol=1e-10)


def slid_force(mesh, life):
    """Force times sliding of the first contacts of a life [N mm], by the closed form of the sliding on the path."""
    path, piece = mesh.path_of_contact, float(mesh.path_of_contact.base_pitch) / mesh.resolution.positions
    ends = np.clip(np.asarray(mesh.path)[:, 0, :, None] + 0.5 * piece * np.array([-1, 1]), path.start, path.end)
    sliding = np.diff(0.5 * ends * np.abs(ends), axis=-1)
    sliding = sliding[..., 0] * (1 / float(path.pinion_base_radius) + 1 / float(path.wheel_base_radius))
    force = np.asarray(life.cycles.line_load)[0] * np.asarray(mesh.slice_width)[:, None]
    return (force * sliding[:, None]).sum()


@pytest.mark.parametrize(
    "teeth, module, shift, widths, torque",
    [
        ((17, 41), 1.25, (0.3, 0.0), (5.0, 5.0), 4.0),
        pytest.param((17, 41), 1.25, (0.3, 0.0), (8.0, 5.0), 4.0, marks=pytest.mark.slow),
        pytest.param((41, 23), 6.0, (-0.1, 0.35), (60.0, 75.0), 1500.0, marks=pytest.mark.slow),
    ],
)
def test_any_pair_loses_what_its_forces_slide(teeth, module, shift, widths, torque):
    """On the path of contact by the closed form of the sliding, every gear by its own coefficient and revolutions."""
    wide = gear_pair(teeth, module, shift=shift, face_width=widths[0], bores=(None, None))
    narrow = gear_pair(teeth, module, shift=shift, face_width=widths[1], bores=(None, None))
    mesh = prepare(jg.GearPair(wide.pinion, narrow.wheel), resolution=SIZES)
    coefficients, passages = np.array([1.3e-18, 0.4e-18]), 1e-3 * np.array([1.0, teeth[0] / teeth[1]])
    life = life_of(mesh, torque, revolutions=1e-3, coefficient=coefficients)
    assert life.converged.all() and float(mesh.slice_width[0]) == min(widths)
    expected = 1e6 * coefficients * passages * slid_force(mesh, life)
    np.testing.assert_allclose(np.asarray(worn_volume(life))[-1, :, 0], expected, rtol=1e-10)


def test_an_even_load_wears_by_the_formula_at_every_point(equal):
    place = deposit(equal, jnp.asarray(TORQUE), POINTS)
    depth = np.asarray(worn(jnp.asarray(np.full((2, 3, 16), 100.0)), STILL, EVERYWHERE, place))[:, 0, 0]
    path, length = equal.path_of_contact, np.asarray(place.roll_length)
    at = length[0] - np.asarray(path.pinion_pitch_roll_length), np.asarray(path.wheel_pitch_roll_length) - length[1]
    exact = 1e9 * 1e-18 * 100.0 * np.stack([sliding_of(path, s)[gear] for gear, s in enumerate(at)])
    error = np.abs(depth - exact) / exact.max()
    # the contact is as wide as a step of the grid: it sees the bend at the pitch point, and half of itself at the root
    inner = np.abs(np.stack(at)) > 1.0
    inner[:, 0] = False
    assert error[inner].max() < 0.01 and error.max() < 0.06


@pytest.mark.slow
def test_depth_does_not_depend_on_the_number_of_positions():
    def depth(sizes):
        mesh = prepare(pair_of(20, 30), resolution=sizes)
        path = mesh.path_of_contact
        # a load that rises and falls smoothly over the path of contact
        share = jnp.clip((mesh.path - path.start) / (path.end - path.start), 0.0, 1.0)
        load = 100.0 * jnp.sin(jnp.pi * share) ** 2
        return np.asarray(worn(load, jnp.zeros_like(load), 1e-18, deposit(mesh, jnp.asarray(TORQUE), 9)))[:, 0, 0]

    fine = depth(jg.Resolution(positions=96, pairs=2, slide_steps=0))
    assert np.abs(depth(SIZES) - fine).max() < 0.01 * fine.max()
    assert np.abs(depth(TWO_PAIRS) - fine).max() < 0.003 * fine.max()


@pytest.mark.slow
@pytest.mark.parametrize("amount", [0.0, 5.0])
def test_worn_flanks_do_not_depend_on_the_number_of_positions(amount):
    """With contacts that are solved, and the grid that is taken where nobody says which."""

    def worn_by(positions):
        mesh = prepare(pair_of(20, 30), resolution=jg.Resolution(positions=positions, pairs=2))
        relief = jg.TipRelief(amount, 2.0)
        life = life_of(mesh, blocks=2, pinion=relief, wheel=relief)
        return np.stack([life.pinion_depth[-1, 0], life.wheel_depth[-1, 0]]), worn_volume(life)[-1].sum(axis=-1)

    (coarse, volume), (fine, fine_volume) = worn_by(64), worn_by(128)
    change = np.abs(coarse - fine) / fine.max()
    # where load sets in at the root of the driver it changes within a position, and the flank with it
    assert change.max() < 0.06 and np.median(change) < 0.005 and change[:, 16:-3].max() < 0.015
    np.testing.assert_allclose(volume, fine_volume, rtol=0.002)


def test_equal_gears_wear_as_mirror_images(equal):
    life = life_of(equal)
    assert np.asarray(wear_depth(life))[-1] > 1.0
    np.testing.assert_allclose(life.pinion_depth, life.wheel_depth, rtol=1e-9, atol=1e-12)


def test_the_wheel_wears_by_its_own_revolutions(life):
    """In one passage both gears lose the same volume; a wheel tooth has fewer of them."""
    pinion, wheel = np.asarray(worn_volume(life))[-1].sum(axis=-1)
    assert wheel == pytest.approx(pinion * 20 / 30, rel=1e-10)


def test_wear_is_deepest_at_the_root_of_the_driver_and_least_at_the_pitch_point(mesh, life):
    depth = np.asarray(life.pinion_depth)[-1, 0]
    assert depth.argmax() == 0
    pitch = np.searchsorted(life.roll_length[0], float(mesh.sides[0].pitch_roll_length))
    assert abs(int(depth.argmin()) - pitch) <= 1 and depth.min() < 0.2 * depth.max()


def test_twice_the_coefficient_over_half_of_the_revolutions_gives_the_same_flank(mesh):
    other = life_of(mesh, revolutions=REVOLUTIONS / 2, coefficient=2 * COEFFICIENT)
    np.testing.assert_allclose(other.depth, life_of(mesh).depth, rtol=1e-12)


class Lubricated(eqx.Module):
    """Wear that grows with a power of the pressure, another one on the wheel, and some number where that is largest."""

    exponent: jax.Array
    on_wheel: jax.Array = eqx.field(converter=jnp.asarray, default=0.5)
    at_the_worst: jax.Array = eqx.field(converter=jnp.asarray, default=0.0)

    def __call__(self, pressure, sliding, temperature):
        assert pressure.shape == sliding.shape == temperature.shape == (2, 1, 16)
        grown = COEFFICIENT * (pressure / 1000.0) ** self.exponent
        grown = jnp.where(pressure == jnp.max(pressure), grown + self.at_the_worst, grown)
        return grown, self.on_wheel * grown


def lubricated(mesh, *numbers):
    """Under the load for a quarter of four times the revolutions and else idle: one program for spectra and laws."""
    law = Lubricated(*map(jnp.asarray, numbers))
    spectrum = jg.LoadSpectrum([TORQUE, 0.0], [1.0, 3.0], [1000.0, 1000.0])
    return life_of(mesh, spectrum, 4 * REVOLUTIONS, coefficient=law, blocks=2)


def test_revolutions_of_a_spectrum_without_load_wear_nothing(mesh):
    """By a coefficient that is a constant in the end."""
    part, blocks = lubricated(mesh, 0.0, 1.0), 2
    np.testing.assert_allclose(part.depth, life_of(mesh).depth, rtol=1e-9, atol=1e-12)
    means, *_ = told(part, of="mean_te")
    assert means.shape == (blocks + 1,)
    np.testing.assert_allclose(means, np.asarray(part.cycles.transmission_error).mean(-1) @ [0.25, 0.75])
    # where the contact under one of the loads was not found, nothing is known of the flanks under both
    status = np.array(part.cycles.status)
    status[1, 1] = Status.NOT_CONVERGED
    lost = eqx.tree_at(lambda life: life.cycles.status, part, jnp.asarray(status))
    values, *numbers = told(lost, 1e3)
    assert np.isnan(values).tolist() == [life == 1 for life in range(blocks + 1)] and np.isnan(numbers).all()


@pytest.mark.slow
def test_half_of_the_revolutions_of_a_spectrum_without_load_wear_nothing(mesh, life):
    spectrum = jg.LoadSpectrum([TORQUE, 0.0])
    half = life_of(mesh, spectrum, revolutions=2 * REVOLUTIONS, blocks=BLOCKS)
    np.testing.assert_allclose(half.depth, life.depth, rtol=1e-9, atol=1e-12)
    assert over_life(half, "mean_te").shape == (BLOCKS + 1,)
    np.testing.assert_allclose(over_life(half, "mean_te"), np.asarray(half.cycles.transmission_error).mean((1, 2)))


@pytest.fixture(scope="module")
def relieved(mesh):
    return steps_of(mesh, pinion=RELIEF)


def test_hours_become_shares_of_the_revolutions_by_the_speed(mesh):
    """The slow load turns the pinion a tenth as often as the fast one."""
    hours = jg.LoadSpectrum.from_hours([50.0, 150.0], [10.0, 10.0], [3000.0, 300.0])
    turns = jg.LoadSpectrum([50.0, 150.0], [10.0, 1.0])
    options = {"coefficient": COEFFICIENT, "pinion": None, "wheel": None, "deviation": None, "points": None}
    given, expected = (case_of(mesh, load, **options) for load in (hours, turns))
    np.testing.assert_allclose(given.weights, expected.weights, rtol=1e-12)
    np.testing.assert_allclose(given.weights, [10 / 11, 1 / 11], rtol=1e-12)
    np.testing.assert_array_equal(given.loads.torque, expected.loads.torque)


@pytest.mark.slow
def test_the_flanks_of_a_life_give_its_mesh_again(mesh, relieved):
    pinion, wheel = relieved.flanks()
    assert isinstance(pinion, jg.TabulatedProfile)
    again = jg.solve(mesh, TORQUE, pinion=RELIEF + pinion, wheel=wheel)
    seen = np.asarray(relieved.cycles.transmission_error)
    np.testing.assert_allclose(again.transmission_error, seen[-1], rtol=1e-9)
    pinion, wheel = relieved.flanks(0)
    first = jg.solve(mesh, TORQUE, pinion=RELIEF + pinion, wheel=wheel)
    np.testing.assert_allclose(first.transmission_error, seen[0], rtol=1e-9)


@pytest.mark.slow
def test_slices_of_an_even_load_wear_alike_and_crowning_wears_in_the_middle():
    sliced = prepare(pair_of(20, 30), resolution=FACE)
    for crowning in (0.0, 10.0):
        life = life_of(sliced, revolutions=1e-3, blocks=2, pinion=jg.LeadCrowning(crowning))
        depth = np.asarray(life.pinion_depth)[-1].max(axis=-1)
        expected = 1e-3 * 1e6 * COEFFICIENT * np.array([1.0, 20 / 30]) * slid_force(sliced, life)
        np.testing.assert_allclose(np.asarray(worn_volume(life))[-1, :, 0], expected, rtol=1e-10)
        np.testing.assert_allclose(depth, depth[::-1], rtol=1e-6)
        if crowning:
            assert depth[2] > 1.1 * depth[0]
        else:
            np.testing.assert_allclose(depth, depth[0], rtol=1e-6)


def levelling(depth):
    """d y / d n = 1 - y: wear levels the load."""
    return WearRate(1 - depth, depth, jnp.int8(Status.CONVERGED))


NEW = np.zeros((1, 1, 1, 1))
PAIRS = 20  # with blocks of no length after the last one: one program


@jax.jit
def levelled(lengths, limit=np.inf):
    """Over pairs of blocks of these lengths; no contact is found beyond a depth."""

    def lost(depth):
        return levelling(depth)._replace(status=status_of({Status.MORE_PAIRS_NEEDED: jnp.any(depth >= limit)}))

    return march(lost, jnp.asarray(NEW), lengths)


def test_blocks_are_of_second_order_and_tell_their_error():
    def end(pairs):
        found = jax.tree.map(np.asarray, levelled(np.append(np.full(pairs, 0.5 / pairs), np.zeros(PAIRS - pairs))))
        assert found.depth.shape[0] == 2 * PAIRS + 1 and (found.depth == found.seen).all() and not found.status.any()
        depth = found.depth.ravel()
        assert (depth[2 * pairs :] == depth[-1]).all() and (np.diff(depth[: 2 * pairs + 1]) > 0).all()
        return found.depth[-1].sum(), found.error.sum()

    exact = 1 - np.exp(-1)
    (few, said), (many, said_then) = end(4), end(8)
    assert (few - exact) / (many - exact) == pytest.approx(4, rel=0.1)
    # the equation itself halves errors made at its start
    assert 1 < said / (few - exact) < 3 and said / said_then == pytest.approx(4, rel=0.1)


def test_an_overlong_block_overshoots():
    """Beyond twice what the load deflects a step of wear grows what it should level."""

    def end(length):
        return np.asarray(levelled(np.full(PAIRS, length)).depth)[-1].sum()

    assert end(1.9) == pytest.approx(1, abs=0.05) and abs(end(2.1) - 1) > 1


@pytest.mark.parametrize(
    "limit, known, said",
    # depths at the ends of four blocks of 0.25: 0.219, 0.390, 0.523, 0.628; Euler sees 0.25, 0.414, 0.542, 0.643 there,
    # and 0.5, 0.695 at the ends of the double blocks
    [
        (1.0, [True] * 5, [True, True]),
        (0.67, [True] * 5, [True, False]),
        (0.635, [True] * 4 + [False], [True, False]),
        (0.45, [True] * 3 + [False] * 2, [False, False]),
        (0.4, [True] * 2 + [False] * 3, [False, False]),
        (0.23, [True] + [False] * 4, [False, False]),
    ],
)
def test_a_contact_that_is_lost_within_a_block_is_told(limit, known, said):
    found = levelled(np.full(2, 0.25), limit)
    wanted = [Status.CONVERGED if each else Status.MORE_PAIRS_NEEDED for each in known]
    assert found.status.tolist() == wanted
    # where the double block alone is lost, the depth is known and its error is not
    assert np.isfinite(np.asarray(found.error)).ravel().tolist() == said


def test_halving_the_blocks_changes_the_flank_by_what_was_said(mesh, life):
    finer = steps_of(mesh, blocks=2 * BLOCKS)
    changed = np.abs((np.asarray(finer.depth)[-1] - np.asarray(life.depth)[-1]).sum(axis=1)).max()
    error, rest = np.asarray(life.error)[-1], np.asarray(finer.error)[-1]
    assert 0.2 * error < changed < error
    assert error / rest == pytest.approx(4, rel=0.25)


@pytest.mark.slow
def test_contacts_that_slide_wear_the_same_flank_again(relieved):
    """With the default resolution: the flanks of a life give its mesh, to what rounding does on their kinks."""
    sliding = prepare(pair_of(20, 30), resolution=SLIDING)
    life = life_of(sliding, pinion=RELIEF, blocks=BLOCKS)
    pinion, wheel = life.flanks()
    again = jg.solve(sliding, TORQUE, pinion=RELIEF + pinion, wheel=wheel)
    np.testing.assert_allclose(again.transmission_error, life.cycles.transmission_error[-1], atol=2e-3)
    # the material is lost where the contact has slid to, and as much of it as of contacts at their nominal place
    assert np.abs(life.depth - relieved.depth).max() > 0.05 * float(wear_depth(life)[-1])
    volumes = [np.asarray(worn_volume(each))[-1].sum(axis=-1) for each in (life, relieved)]
    np.testing.assert_allclose(*volumes, rtol=0.05)


def test_the_life_to_a_depth_is_where_the_depth_is_reached(life):
    depths, done = np.asarray(wear_depth(life)), np.asarray(life.revolutions)
    np.testing.assert_allclose(life_to_depth(life, depths[3]), done[3], rtol=1e-12)
    middle = 0.5 * (depths[3] + depths[4])
    np.testing.assert_allclose(life_to_depth(life, middle), 0.5 * (done[3] + done[4]), rtol=1e-12)
    beyond = depths[-1] + (depths[-1] - depths[-2])
    np.testing.assert_allclose(life_to_depth(life, beyond), done[-1] + (done[-1] - done[-2]), rtol=1e-9)
    wheel = float(life_to_depth(life, 1.0, "wheel"))
    assert wheel > float(life_to_depth(life, 1.0, "pinion")) == pytest.approx(float(life_to_depth(life, 1.0)))


def test_the_life_to_a_limit_of_a_quantity(life):
    ppte, _, mean = told(life)
    np.testing.assert_allclose(ppte, np.ptp(life.cycles.transmission_error, axis=1), rtol=1e-12)
    for limit, expected in ((ppte[0] - 0.1, 0), (ppte.max() + 1, np.inf)):
        assert list(told(life, limit))[1] == expected
    # the contact ratio does not change, and is bad where it is small
    for limit, expected in ((2.0, 0), (1.0, np.inf)):
        assert list(told(life, limit, "contact_ratio"))[1] == expected
    expected = np.trapezoid(ppte, life.revolutions) / REVOLUTIONS
    assert mean == pytest.approx(expected, rel=1e-12)


def test_a_contact_that_was_not_found_is_no_number(life):
    """One at the start of a block."""
    status = np.array(life.cycles.status)
    status[2, 0] = Status.NOT_CONVERGED
    lost = eqx.tree_at(lambda life: life.cycles.status, life, jnp.asarray(status))
    values, until, _ = told(lost, 1e3)
    assert np.isnan(values).tolist() == [life == 2 for life in range(BLOCKS + 1)] and np.isnan(until)


def test_flanks_that_a_lost_contact_has_worn_are_not_known(mesh):
    """One within the second block, that no life shows."""
    life = life_of(mesh)
    options = {"pinion": NONE, "wheel": NONE, "deviation": None, "points": None}
    case = case_of(mesh, TORQUE, coefficient=COEFFICIENT, **options)
    found = marched(case, case.start(), jnp.asarray([REVOLUTIONS / 2]))
    np.testing.assert_array_equal(history_of(case, found, life.revolutions).depth, life.depth)
    unfound = found._replace(status=jnp.asarray([0, 0, Status.NOT_CONVERGED], jnp.int8))
    lost = history_of(case, unfound, life.revolutions)
    after = [False, False, True]
    errors, *numbers = told(lost, 1e3)
    for values in (errors, wear_depth(lost), np.asarray(worn_volume(lost))[:, 0, 0]):
        assert np.isnan(values).tolist() == after
    assert (~np.asarray(lost.cycles.converged)).all(axis=-1).tolist() == after
    assert np.isnan(numbers).all()
    _, middle, last = np.asarray(wear_depth(life))
    assert np.isnan(life_to_depth(lost, last))
    np.testing.assert_array_equal(life_to_depth(lost, middle), life_to_depth(life, middle))
    assert not solved(lost.cycles)[-1]  # by which quantities of the life are no numbers


def test_a_function_of_the_lubrication(mesh):
    """Below 1000 MPa a power of the pressure slows the wear down."""
    other = lubricated(mesh, 0.0, 0.0)
    assert not np.asarray(other.wheel_depth).any()
    only = life_of(mesh, coefficient=(COEFFICIENT, 0.0), blocks=2)
    np.testing.assert_allclose(other.depth, only.depth, rtol=1e-9)
    halved = life_of(mesh, coefficient=(COEFFICIENT, 0.5 * COEFFICIENT), blocks=2)
    assert float(wear_depth(only)[-1]) > float(wear_depth(halved)[-1])  # the wheel does not level the load
    lives = [lubricated(mesh, exponent) for exponent in (0.0, 0.5, 1.0)]
    for gear in ("pinion", "wheel"):
        depths = [np.asarray(wear_depth(life, gear))[-1] for life in lives]
        np.testing.assert_allclose(depths[0], np.asarray(wear_depth(halved, gear))[-1], rtol=1e-9)
        assert gear == "wheel" or (np.diff(depths) < 0).all()


def test_a_function_that_gives_no_coefficient_leaves_no_flank_known(mesh):
    """At the contact of the largest pressure alone, which is enough."""
    for value in (jnp.nan, -1e-17):
        life = lubricated(mesh, 0.0, 0.5, value)
        assert life.converged.tolist() == [True, False, False]
        values, *_ = told(life)
        assert np.isfinite(values).tolist() == [True, False, False]


@pytest.mark.slow
def test_a_function_with_numbers_of_its_own_is_mapped_and_differentiated(mesh):
    """Contacts without load have no infinite slope."""

    def depth(exponent):
        return wear_depth(lubricated(mesh, exponent), "pinion")[-1]

    exponents = jnp.linspace(0.0, 1.0, 5)
    pinion, slope = jax.jit(jax.vmap(lambda at: jax.jvp(depth, (at,), (1.0,))))(exponents)
    assert (np.diff(pinion) < 0).all() and (np.asarray(slope) < 0).all()
    # Simpson's rule takes the slopes back to the depths
    risen = slope @ np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 12
    assert float(risen) == pytest.approx(float(pinion[-1] - pinion[0]), rel=0.01)


def test_no_load_wears_nothing(mesh):
    life = life_of(mesh, 0.0)
    assert not np.asarray(life.depth).any() and np.isinf(life_to_depth(life, 1.0))


@pytest.mark.parametrize(
    "options, message",
    [
        ({"blocks": 7}, "blocks = 7 must be even: two and two are compared with one of double length"),
        ({"blocks": 0}, "blocks = 0 must be a whole number of at least 2"),
        ({"points": 2}, "points = 2 must be a whole number of at least 3"),
        ({"revolutions": 0.0}, "revolutions = 0 must be greater than 0"),
        ({"revolutions": [1.0, 2.0]}, r"revolutions has shape \(2,\), must be a single number"),
        ({"coefficient": -1e-18}, "coefficient = -1e-18 m2/N must be at least 0 m2/N"),
        ({"coefficient": [1e-18] * 3}, r"coefficient has shape \(3,\), must be one number or a pair"),
        ({"coefficient": lambda *_: 1e-18}, "coefficient is a function, which needs a speed"),
        ({"torque": jg.LoadSpectrum([1.0, 2.0], duration=3.0)}, "a load spectrum with a duration needs speeds"),
        ({"deviation": np.ones(3)}, r"deviation has shape \(3,\), must be \(2, 1, 16\) \(pairs, slices"),
        ({"deviation": np.full((2, 1, 16), np.nan)}, "deviation = nan um must be finite"),
        ({"torque": -1.0}, "torque = -1 N m must be at least 0 N m"),
        ({"pinion": jg.LeadCrowning(5.0)}, "varies along the face, which a mesh of 1 slice cannot show"),
    ],
)
def test_refuses_in_one_line(mesh, options, message):
    with pytest.raises(ValueError, match=message) as refused:
        life_of(mesh, **options)
    assert "\n" not in str(refused.value)


def test_refuses_results_that_are_not_there(life):
    with pytest.raises(ValueError, match='gear = "rack"|gear = \'rack\' must be "pinion"'):
        wear_depth(life, "rack")
    with pytest.raises(ValueError, match="limit = 0 um must be greater than 0 um"):
        life_to_depth(life, 0.0)
    with pytest.raises(
        IndexError, match=f"step = 100 must be from -{BLOCKS + 1} to {BLOCKS}, of {BLOCKS + 1} time steps"
    ):
        life.flanks(100)
    with pytest.raises(ValueError, match="coefficient = -1 m2/N"):
        passage_depth(life.cycles, -1.0)


def test_lives_of_many_designs_are_asked_one_by_one(life):
    """Otherwise the axis of the designs would be taken for that of the lives."""
    many = jax.tree.map(lambda leaf: jnp.asarray(np.stack([leaf, leaf])), life)
    asked = {
        "over_life": lambda life: over_life(life, "ppte"),
        "wear_depth": wear_depth,
        "worn_volume": worn_volume,
    }
    mapped = jax.jit(jax.vmap(lambda life: [of(life) for of in asked.values()]))(many)
    for of, found in zip(asked.values(), mapped):
        with pytest.raises(ValueError, match="history is of a batch of designs, must be of one"):
            of(many)
        np.testing.assert_array_equal(np.asarray(found)[1], of(life))
    with pytest.raises(ValueError, match="history is of a batch"):
        life_to(many, "ppte", 1.0)
    with pytest.raises(ValueError, match="history is of a batch"):
        life_to_depth(many, 1.0)


def test_steps_are_gone_through_and_kept_two_by_two(mesh, life):
    seen, kept = [], []

    def keep(made_of, make):
        kept.append(made_of)
        return make()

    steps = steps_of(mesh, keep=keep, callback=lambda *given: seen.append(given))
    assert len(kept) == BLOCKS / 2 and seen[-1] == (REVOLUTIONS, REVOLUTIONS, None)
    np.testing.assert_array_equal(steps.depth, life.depth)


@pytest.mark.slow
def test_steps_of_equal_length_are_the_blocks(mesh, life):
    blocks = life_of(mesh, blocks=BLOCKS)
    np.testing.assert_allclose(life.depth, blocks.depth, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(life.revolutions, blocks.revolutions)
    np.testing.assert_allclose(life.error, blocks.error, rtol=1e-6, atol=1e-9)


def test_no_step_wears_more_than_the_increment(mesh, life):
    steps = steps_of(mesh, largest_increment=0.7)
    worn_off = np.diff(np.asarray(steps.depth).sum(axis=2), axis=0).max(axis=(1, 2, 3))
    assert worn_off.max() < 1.1 * 0.7 and len(worn_off) < 1.4 * float(wear_depth(steps)[-1]) / 0.7
    assert steps.revolutions[-1] == REVOLUTIONS
    error = np.abs((np.asarray(steps.depth)[-1] - np.asarray(life.depth)[-1]).sum(axis=1)).max()
    assert error < np.asarray(life.error)[-1] + np.asarray(steps.error)[-1]


def test_teeth_that_are_worn_through_are_told(mesh):
    """Depth over base radius is an angle by which the flank turns; at half of the tip's it is half through."""
    lengths, through = grid(mesh, POINTS), jax.jit(worn_through)
    for number, gear in enumerate((mesh.pair.pinion, mesh.pair.wheel)):
        tip = float(thickness(gear, gear.tip_diameter))
        arc = 2e3 * tip * float(gear.base_radius) / float(gear.tip_diameter)
        for share, gone in ((0.99, False), (1.01, True)):
            # two parts of the depth, on one of two slices
            depth = np.zeros((2, 2, 2, POINTS))
            depth[number, :, 1, -1] = 0.5 * share * arc
            assert bool(through(mesh.pair, lengths, depth)) == gone


@pytest.mark.slow
def test_what_is_worn_through_is_not_worn_on(mesh):
    """A slip of four powers of ten in the coefficient ends after some blocks, with numbers up to there."""
    blocks = []
    options = {"coefficient": 1e4 * COEFFICIENT, "largest_increment": 60.0}
    life = steps_of(mesh, callback=lambda *given: blocks.append(given), **options)
    known = np.asarray(life.converged)
    tip = [float(thickness(gear, gear.tip_diameter)) for gear in life.gears]
    assert known[0] and not known[-1] and life.revolutions[-1] == REVOLUTIONS == blocks[-1][0]
    assert 100 < float(np.nanmax(wear_depth(life))) < 4e3 * max(tip)
    assert len(known) < 200 and known.tolist() == sorted(known, reverse=True)
    values, *_ = told(life)
    assert np.isnan(values).tolist() == (~known).tolist()
    assert np.isnan(life_to_depth(life, 1e6)) and 0 < float(life_to_depth(life, 5.0)) < float(
        life.revolutions[known][-1]
    )


def test_steps_refuse_in_one_line(mesh):
    with pytest.raises(ValueError, match="largest_increment = 0 um must be greater than 0 um"):
        steps_of(mesh, largest_increment=0.0)
