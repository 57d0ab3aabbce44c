"""Contacts slide down the slope of a modification: closed forms, a fine search, corners, derivatives, slices."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import SLIDING, flank, gear_pair
from jax.experimental import checkify

import jaxgear as jg
from jaxgear.contact import removed_material
from jaxgear.contact.contact_width import contact_nodes, place_of, probe, terms_of, within
from jaxgear.contact.slide import nominal_material
from jaxgear.geometry import reduced_radius
from jaxgear.microgeometry import NoModification

TORQUE = 50.0


@pytest.fixture(scope="module")
def mesh():
    return jg.prepare(gear_pair(), resolution=SLIDING)


@pytest.fixture(scope="module")
def sliced(mesh):
    """The same arrays for three slices: what is removed of them asks for no more."""
    sizes = replace(mesh.kinematics, resolution=replace(SLIDING, slices=3))
    return replace(mesh, kinematics=sizes, slice_width=jnp.full(3, 6.0))


def radius(mesh):
    return np.asarray(reduced_radius(*(side.contact_roll_length for side in mesh.sides)))[:, 0]


def inner(mesh, distance=0.6):
    """Contacts on the path and farther than a distance [mm] from its ends."""
    path, contact = np.asarray(mesh.path)[:, 0], mesh.path_of_contact
    return (path > float(contact.start) + distance) & (path < float(contact.end) - distance)


class Straight(jg.microgeometry.AbstractModification):
    """A constant slope along the arc of the flank, in um per mm; exact where the arc is what the model takes it for."""

    slope: jax.Array

    varies_along_face = False

    def __call__(self, flank):
        arc = flank.roll_length**2 / (2 * flank.base_radius)
        return self.slope * arc


def test_a_slope_lets_the_gap_fall_by_half_its_square_times_the_radius(mesh):
    slope = 6.0
    found = removed_material(mesh, TORQUE, wheel=Straight(jnp.asarray(slope)))
    nominal = nominal_material(mesh, jnp.asarray(TORQUE), NoModification(), Straight(jnp.asarray(slope)))
    here, gap = inner(mesh), radius(mesh)
    gain = np.asarray(nominal - found.amount)[:, 0]
    expected = 1e3 * gap * (1e-3 * slope) ** 2 / 2
    # the roll length moves in proportion to the arc, which leaves a slope that grows along the arc by some percent
    np.testing.assert_allclose(gain[here], expected[here], rtol=0.03)
    # wheel material falls towards the pinion tip: there the flank is thicker
    np.testing.assert_allclose(np.asarray(found.shift)[:, 0][here], (1e-3 * slope * gap)[here], rtol=0.03)
    assert expected[here].min() > 0.04


def test_nothing_slides_without_a_slope(mesh, sliced):
    """Unmodified flanks, a constant, and modifications along the face alone."""
    lead = jg.LeadCrowning(5.0) + jg.LeadSlope(3.0)
    given = (mesh, None, None), (mesh, flank(constant=4.0), flank()), (sliced, lead, None)
    for prepared, pinion, wheel in given:
        found = removed_material(prepared, TORQUE, pinion=pinion, wheel=wheel)
        assert np.abs(found.shift).max() < 1e-12 and np.abs(found.relative_curvature).max() < 1e-10
        amount = np.asarray(found.amount)
        assert np.ptp(amount, axis=(0, 2)).max() < 1e-12 and (amount.max() > 1.0) == (pinion is not None)


def usual_share(mesh):
    """A third of the load at the ends of the path, all of it where a pair is alone, and linear between."""
    contact, pitch = mesh.path_of_contact, mesh.pair.base_pitch
    at = jnp.stack([contact.start, contact.end - pitch, contact.start + pitch, contact.end])
    return jnp.interp(mesh.path[:, 0], at, jnp.asarray([1 / 3, 1.0, 1.0, 1 / 3]))


def search(mesh, pinion, wheel):
    """Least gap over 1601 places of the contact along the flanks [um], with the mean over more points across it."""
    return np.asarray(_least(mesh, jnp.asarray(radius(mesh)), pinion, wheel))


@eqx.filter_jit
def _least(mesh, gap, pinion, wheel, nodes=12):
    angle = np.pi * np.arange(1, nodes + 1) / (nodes + 1)
    weights = np.sin(angle) ** 2 / np.sum(np.sin(angle) ** 2)
    force = 1e3 * TORQUE / mesh.pair.pinion.base_radius * usual_share(mesh)
    half = jnp.sqrt(mesh.width_factor[:, 0] * force / mesh.pair.face_width)
    rolls = [side.contact_roll_length[:, 0] for side in mesh.sides]
    inside = [(side.tip_roll_length**2 - at**2) / (2 * side.base_radius) for side, at in zip(mesh.sides, rolls)]
    outside, path, contact = mesh.outside[:, 0], mesh.path[:, 0], mesh.path_of_contact
    beyond = [(2 * side.tip_roll_length + outside) * outside / (2 * side.base_radius) for side in mesh.sides]
    centre = jnp.where(path > contact.end, beyond[0], 0.0) - jnp.where(path < contact.start, beyond[1], 0.0)

    def at(place):
        ends = -jnp.maximum(inside[1], 0.0), jnp.maximum(inside[0], 0.0)
        place = jnp.clip(place, *ends)

        def both(x):
            p, q = mesh.flanks(jnp.clip(place + x * half, *ends)[:, None])
            return (pinion(p) + wheel(q))[:, 0]

        mean = jnp.tensordot(weights, jax.vmap(both)(jnp.asarray(np.cos(angle))), 1)
        return 1e3 * ((place - centre) ** 2 - centre**2) / (2 * gap) + mean

    return jax.lax.map(at, jnp.linspace(-0.8, 0.8, 1601)).min(axis=0)


def linear(tip, length):
    return flank(tip=tip, tip_length=length, curve=(1.0, 0.0))


RELIEF = flank(tip=8.0, tip_length=3.0)
ROUGH = jg.TabulatedProfile(np.linspace(3.0, 15.0, 13), 4 * np.sin(np.arange(13) ** 2), method="natural_cubic")
FLANKS = {
    "parabolic": (RELIEF, flank(tip=12.0, tip_length=2.0), 0.01),
    "kinked": (linear(10.0, 1.5), linear(8.0, 4.0), 0.01),
    "crowned": (flank(barrel=8.0), flank(barrel=8.0, profile_slope=5.0), 0.01),
    "rooted": (flank(root=8.0, root_length=1.5), RELIEF, 0.04),
    "table": (ROUGH, NoModification(), 0.25),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "table" else name for name in FLANKS]
)
def test_the_gap_is_the_least_of_a_fine_search(mesh, name):
    """On the path and beyond it, as far as corners touch under usual loads (gaps up to 40 um)."""
    pinion, wheel, tolerance = FLANKS[name]
    found = np.asarray(removed_material(mesh, TORQUE, pinion=pinion, wheel=wheel).amount)[:, 0]
    near = np.asarray(mesh.corner_gap)[:, 0] < 40.0
    np.testing.assert_allclose(found[near], search(mesh, pinion, wheel)[near], atol=tolerance)
    nominal = np.asarray(nominal_material(mesh, jnp.asarray(TORQUE), pinion, wheel))[:, 0]
    # what the search is for: the nominal place is far off it
    assert (nominal - found)[near].max() > 4 * tolerance


@pytest.mark.parametrize("dtype, left", [("float64", 1e-9), ("float32", 2e-4)])
def test_contacts_rest_where_the_slope_is_zero(mesh, dtype, left):
    """On reliefs as steep as they come, corners included: in um/mm of slopes of up to 15 um/mm."""
    mesh = jax.tree.map(lambda leaf: leaf.astype(dtype) if eqx.is_inexact_array(leaf) else leaf, mesh)
    steep = linear(15.0, 1.0) + flank(root=8.0, root_length=1.5)
    torque = jnp.asarray(TORQUE, dtype)
    found = removed_material(mesh, torque, pinion=steep, wheel=steep)
    place, sided = place_of(mesh, torque), terms_of(mesh, dtype, steep, steep)
    moved = within(place.beyond + found.shift, place.lowest, place.highest)
    seen = probe(sided, place, moved, contact_nodes(SLIDING.contact_nodes))
    slope = np.asarray(1e3 / place.radius * found.shift + seen.slope)
    assert found.shift.dtype == dtype and np.abs(found.shift).max() > 0.1 and np.abs(seen.slope).max() > 10
    assert np.abs(slope).max() < left


@pytest.mark.slow
def test_more_steps_go_on_towards_the_search(mesh):
    """A relief as steep as they come: 15 um over a millimetre."""
    steep = linear(15.0, 1.0)
    expected, near = search(mesh, steep, steep), np.asarray(mesh.corner_gap)[:, 0] < 40.0

    def worst(amount):
        return np.abs(np.asarray(amount)[:, 0] - expected)[near].max()

    sizes = replace(SLIDING, slide_steps=1)
    moved = eqx.tree_at(lambda m: m.kinematics, mesh, eqx.tree_at(lambda k: k.resolution, mesh.kinematics, sizes))
    none = worst(nominal_material(mesh, jnp.asarray(TORQUE), steep, steep))
    one, two = (worst(removed_material(each, TORQUE, pinion=steep, wheel=steep).amount) for each in (moved, mesh))
    assert none > 2.0 and one < 0.5 * none and two < 0.1


def test_a_concave_or_convex_flank_changes_the_pressure(mesh):
    """p^2 goes with the relative curvature: that of a crowning adds to that of the involutes."""
    amount = 20.0
    crowned = jg.solve(mesh, TORQUE, pinion=flank(barrel=amount), wheel=flank())
    side = mesh.sides[0]
    half = 0.5 * float(side.tip_roll_length - side.start_roll_length)
    # second derivative by the arc, d rho = r_b / rho ds, at the middle of the flank
    roll, base = np.asarray(side.contact_roll_length)[:, 0], float(side.base_radius)
    middle = np.abs(roll - float(side.tip_roll_length - half)) < 0.2
    bend = 1e-3 * 2 * amount / half**2 * (base / roll) ** 2 * radius(mesh)
    np.testing.assert_allclose(np.asarray(crowned.relative_curvature)[:, 0][middle], bend[middle], rtol=0.05)
    plain = jg.contact.solve_removed(mesh, TORQUE, crowned.gap - mesh.corner_gap)
    loaded = np.asarray(crowned.line_load)[:, 0] > 0
    ratio = np.asarray(crowned.contact_pressure / plain.contact_pressure)[:, 0]
    here = middle & loaded & inner(mesh)
    assert here.any()
    np.testing.assert_allclose(ratio[here], np.sqrt(1 + bend[here]), rtol=0.01)


def test_the_corner_law_sees_where_the_contact_has_moved(mesh):
    """Moving towards the pinion tip is towards its corner and away from that of the wheel."""
    law, field = mesh.law, np.ones((2, 1, 16))
    more = eqx.filter_jit(lambda law, load, way: law.moved(way).deflection(load) - law.deflection(load))
    change = np.asarray(more(law, 100.0 * field, 0.05 * field))[:, 0]
    pinion = np.asarray(law.edge.side)[:, 0] > 0
    close = np.abs(np.asarray(law.edge.distance)[:, 0]) < 0.3
    assert (change[close & pinion] > 0).all() and (change[close & ~pinion] < 0).all()
    assert (close & pinion).any() and (close & ~pinion).any()


def curves(mesh, curve, x):
    flanks = {"pinion": jg.TipRelief(x[0], x[1], curve), "wheel": jg.TipRelief(x[2], x[3], curve)}
    return jg.solve(mesh, x[4], **flanks).transmission_error


# the parabolic and the linear curve, written as two of one class, share these programs
CURVES = jg.Quadratic(0.0, 0.44, 0.56), jg.Quadratic(0.0, 1.0, 0.0)
EACH_CURVE = pytest.mark.parametrize("curve", CURVES, ids=["parabolic", "linear"])
UNITS = np.eye(5)
# nothing removed, over no length, under no load
EDGES = (0.0, 3.0, 50.0), (5.0, 0.0, 50.0), (5.0, 3.0, 0.0), (0.0, 0.0, 0.0)


@jax.jit
def forward(mesh, curve, x, way):
    """The curve, and its derivative in one direction."""
    return jax.jvp(lambda at: curves(mesh, curve, at), (x,), (way,))


@jax.jit
def backward(mesh, curve, x, weights, way):
    """Gradient of a weighted sum of the curve, and its derivative in one direction."""
    slopes = jax.grad(lambda at: weights @ curves(mesh, curve, at))
    return jax.jvp(slopes, (x,), (way,))


def at_usual_reliefs(mesh, curve):
    """Where reliefs and torque are, derivatives of the whole curve there, and how far off differences they are."""
    x = np.asarray([7.3, 3.37, 6.1, 2.91, 50.0])
    found = np.stack([forward(mesh, curve, x, unit)[1] for unit in UNITS], axis=1)
    central = np.empty_like(found)
    for place, step in enumerate(1e-5 * x):
        high, low = (np.asarray(forward(mesh, curve, x + sign * step * UNITS[place], UNITS[0])[0]) for sign in (1, -1))
        central[:, place] = (high - low) / (2 * step)
    return x, found, np.abs(found - central).max(axis=1) / np.abs(central).max()


@EACH_CURVE
def test_derivatives_are_those_of_the_numbers(mesh, curve):
    """Of the whole curve by amount, length and torque."""
    _, found, off = at_usual_reliefs(mesh, curve)
    # a position whose contact has a node right at the start of a relief has two slopes
    assert np.sort(off)[-3] < 1e-6
    assert np.abs(found).max(axis=0).min() > 1e-3  # each of the five matters


@pytest.mark.slow
@EACH_CURVE
def test_gradients_are_derivatives_and_have_derivatives_themselves(mesh, curve):
    """Second derivatives by the first amount."""
    x, found, off = at_usual_reliefs(mesh, curve)
    weights = np.cos(np.arange(16.0))
    weights[np.argsort(off)[-2:]] = 0.0
    slopes, second = backward(mesh, curve, x, weights, UNITS[0])
    np.testing.assert_allclose(slopes, weights @ found, rtol=1e-9)
    high, low = (backward(mesh, curve, x + sign * 1e-4 * UNITS[0], weights, UNITS[0])[0] for sign in (1.0, -1.0))
    expected = np.asarray(high - low) / 2e-4
    np.testing.assert_allclose(second, expected, atol=1e-5 * np.abs(expected).max())


def at_edges():
    for amount, length, torque in EDGES:
        x = np.asarray([amount, length, amount, length, torque])
        for way in UNITS:
            yield x, way


def test_nothing_and_no_load_leave_finite_derivatives(mesh):
    for x, way in at_edges():
        value, slope = forward(mesh, CURVES[0], x, way)
        assert np.isfinite(value).all() and np.isfinite(slope).all(), x


@pytest.mark.slow
def test_nothing_and_no_load_leave_finite_gradients_and_second_derivatives(mesh):
    for x, way in at_edges():
        slopes, second = backward(mesh, CURVES[0], x, np.ones(16), way)
        assert np.isfinite(slopes).all() and np.isfinite(second).all(), x


@pytest.mark.slow
def test_nothing_is_divided_by_zero_on_the_way_to_finite_results(mesh):
    """So that a user can let JAX look for his own; its checks for NaN compile for seven times as long."""

    def checked(mesh, amount, torque):
        return jg.solve(mesh, torque, pinion=jg.TipRelief(amount, 3.4)).transmission_error

    found = jax.jit(checkify.checkify(checked, errors=checkify.div_checks))
    for amount, torque in ((7.3, 50.0), (0.0, 50.0), (7.3, 0.0)):
        error, curve = found(mesh, jnp.asarray(amount), jnp.asarray(torque))
        assert error.get() is None and np.isfinite(curve).all()


@pytest.mark.slow
def test_slices_slide_on_their_own(mesh, sliced):
    """A flank that is twisted: every slice is that of a flank of its own profile."""
    roll = np.linspace(3.0, 15.0, 13)  # as many points as of `ROUGH`
    columns = np.outer((roll - 9.0) ** 2 / 10, [0.2, 1.0, 2.0])
    twisted = jg.TabulatedFlank(roll, sliced.face_coordinate, columns, "natural_cubic")
    found = removed_material(sliced, TORQUE, pinion=twisted)
    for number in range(3):
        alone = removed_material(
            mesh, TORQUE, pinion=jg.TabulatedProfile(roll, columns[:, number], method="natural_cubic")
        )
        for name in ("amount", "shift", "relative_curvature"):
            mine, theirs = getattr(found, name)[:, number], getattr(alone, name)[:, 0]
            np.testing.assert_allclose(mine, theirs, atol=1e-9)


@pytest.mark.slow  # of one relief `test_prescribed` finds them every time
def test_a_prescribed_error_gives_the_forces_of_the_cycle(mesh):
    flanks = {"pinion": RELIEF, "wheel": linear(9.0, 2.0)}
    cycle = jg.solve(mesh, TORQUE, **flanks)
    error = cycle.transmission_error - mesh.hub * cycle.force / mesh.pair.face_width
    found = jg.contact.solve_at(mesh, error, torque=TORQUE, **flanks)
    np.testing.assert_allclose(found.pair_force, cycle.pair_force, rtol=1e-8, atol=1e-6)


def test_points_across_the_contact_have_to_see_a_slope():
    with pytest.raises(ValueError, match="slide_steps = 1 needs contact_nodes >= 3, is 2"):
        jg.Resolution(contact_nodes=2, slide_steps=1)
    assert jg.Resolution(contact_nodes=1).chosen_slide_steps == 0 and jg.Resolution().chosen_slide_steps == 20


def test_rounding_does_not_decide_where_a_contact_rests(mesh):
    """Torques that differ in their last digits alone: a place that was tried before is level up to rounding."""
    steep = jg.TipRelief(40.0, 2.5, jg.Linear())
    found = jax.vmap(lambda torque: removed_material(mesh, torque, pinion=steep).amount)
    amounts = np.asarray(found(200 * (1 + 1e-13 * jnp.arange(40.0))))
    assert np.ptp(amounts, axis=0).max() < 1e-10  # um
