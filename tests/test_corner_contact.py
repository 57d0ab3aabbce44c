"""Contact of a tip corner outside the path of contact: gap, lever, and the softening of the cut-off contact."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE, gear_pair, kahraman_gear, prepare

import jaxgear as jg
from jaxgear.compliance.laws import cut_off
from jaxgear.contact import solve_removed
from jaxgear.contact.kinematics import contacts, corner_gap
from jaxgear.contact.slide import nothing_removed
from jaxgear.io.model_table import ResolutionSection, resolution_of
from jaxgear.io.table_keys import decode

# Gap [um] of the approach corner when the mate stays, over the distance before A in base pitches, and its parabola.
TABLE = {
    "30/30 m2": {0.02: (0.515, 0.507), 0.05: (3.30, 3.17), 0.10: (13.76, 12.67), 0.20: (60.1, 50.7)},
    "50/50 m3": {0.02: (0.306, 0.303), 0.05: (1.94, 1.89), 0.10: (7.96, 7.57), 0.20: (33.5, 30.3)},
    "19/48 m3": {0.02: (1.81, 1.90), 0.05: (10.95, 11.86), 0.10: (43.2, 47.4)},
}


_gap_of = jax.jit(corner_gap)
patch_of = jax.jit(cut_off)


def gap_of(x, arguments):
    """Gap and touched roll length at up to four distances beyond the path, by one program."""
    places = jnp.asarray(np.resize(np.asarray(x, float), 4))
    return [np.asarray(part)[: np.size(x)] for part in _gap_of(places, *map(jnp.asarray, arguments))]


@pytest.fixture(scope="module")
def fine():
    """So many positions that differences tell slopes."""
    return prepare(gear_pair(), resolution=jg.Resolution(positions=512, pairs=4))


@functools.cache
def pair_of(name):
    if name == "50/50 m3":
        return jg.GearPair(kahraman_gear(156.0), kahraman_gear(156.0))
    return gear_pair((30, 30), 2.0, bores=(None, None)) if name == "30/30 m2" else gear_pair((19, 48), 3.0)


def ends(pair):
    """Arguments of `corner_gap` at A, where the wheel's tip enters, and at E, where the pinion's tip leaves."""
    path = jg.path_of_contact(pair)
    return (
        (
            pair.wheel.tip_roll_length,
            pair.wheel.base_radius,
            path.pinion_roll_length(path.start),
            pair.pinion.base_radius,
        ),
        (
            pair.pinion.tip_roll_length,
            pair.pinion.base_radius,
            path.wheel_roll_length(path.end),
            pair.wheel.base_radius,
        ),
    )


def turned_corner(x, tip_rho, tip_base, mate_rho, mate_base):
    """The corner after its gear turned back by a distance x on the line of action.

    Origin in the mate's centre, the line of action parallel to the first axis at the height of the mate's base radius.
    """
    center = np.array([mate_rho + tip_rho, mate_base + tip_base])
    turn = -x / tip_base
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return center + rotation @ np.array([-tip_rho, -tip_base])


def gap_by_turning(x, tip_rho, tip_base, mate_rho, mate_base):
    """Gap in plain geometry: the arc by which the mate turns until its involute passes through the corner."""

    def start_of_involute(point):
        """Polar angle at which the involute through a point leaves the base circle."""
        tangent = np.sqrt(point @ point - mate_base**2)
        return np.arctan2(point[1], point[0]) + np.arctan2(tangent, mate_base) - tangent / mate_base

    nominal = start_of_involute(np.array([mate_rho, mate_base])) + x / mate_base  # the mate turned back as well
    return 1e3 * abs(
        mate_base * (start_of_involute(turned_corner(x, tip_rho, tip_base, mate_rho, mate_base)) - nominal)
    )


@pytest.mark.parametrize("name", TABLE)
@pytest.mark.parametrize("where", [0, 1])
def test_gap_against_turned_gears(name, where):
    arguments = [float(a) for a in ends(pair_of(name))[where]]
    pitch = float(pair_of(name).base_pitch)
    x = np.array([0.01, 0.05, 0.1, 0.2]) * pitch
    gap, _ = gap_of(x, arguments)
    by_hand = [gap_by_turning(distance, *arguments) for distance in x]
    np.testing.assert_allclose(gap, by_hand, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("name", TABLE)
def test_gap_table(name):
    """The table holds the mate and turns the corner: its gap S solves S = gap(x + S)."""
    pair = pair_of(name)
    approach = ends(pair)[0]
    table = TABLE[name]
    x, s = np.array(list(table)) * float(pair.base_pitch), np.zeros(len(table))
    for _ in range(60):
        s = gap_of(x + 1e-3 * s, approach)[0]
    np.testing.assert_allclose(s, [exact for exact, _ in table.values()], rtol=0.006)


@pytest.mark.parametrize("name", TABLE)
def test_gap_starts_as_the_parabola_of_second_order(name):
    pair = pair_of(name)
    pitch, both = float(pair.base_pitch), [[float(part) for part in end] for end in ends(pair)]
    for tip_rho, tip_base, mate_rho, mate_base in both:
        curvature = tip_rho * (tip_rho + mate_rho) / (mate_rho * tip_base**2)
        x = np.array([1e-4, 1e-3]) * pitch
        gap, _ = gap_of(x, (tip_rho, tip_base, mate_rho, mate_base))
        relative = gap / (1e3 * 0.5 * curvature * x**2) - 1
        assert abs(relative[0]) < 1e-3 and abs(relative[1]) < 1e-2
    first = both[0]
    parabola = 1e3 * 0.5 * first[0] * (first[0] + first[2]) / (first[2] * first[1] ** 2)
    for fraction, (_, printed) in TABLE[name].items():
        assert parabola * (fraction * pitch) ** 2 == pytest.approx(printed, rel=0.005)


def test_touched_point_lies_on_the_mate():
    """The mate is touched at the distance of the corner from its centre."""
    arguments = ends(pair_of("19/48 m3"))[0]
    _, rho = gap_of([0.0, 0.3, 1.0], arguments)
    assert rho[0] == pytest.approx(float(arguments[2]), rel=1e-14)
    assert np.all(np.diff(rho) != 0.0)
    corner, mate_base = turned_corner(1.0, *map(float, arguments)), float(arguments[3])
    assert rho[2] == pytest.approx(np.sqrt(corner @ corner - mate_base**2), rel=1e-12)


def test_mesh_continues_beyond_the_path_with_continuous_slope(fine):
    """Gap and lever over the whole cycle: zero and one on the path; value and slope continuous at its ends."""
    mesh = fine
    path, contact = np.asarray(mesh.path), mesh.path_of_contact
    order = np.argsort(path, axis=None)
    s, gap, lever = (np.asarray(a).ravel()[order] for a in (path, mesh.corner_gap, mesh.lever))
    on = (s >= float(contact.start)) & (s <= float(contact.end))
    np.testing.assert_array_equal(gap[on], 0.0)
    np.testing.assert_array_equal(lever[on], 1.0)
    assert (gap[~on] > 0).all() and (lever[~on] < 1).all() and (lever > 0.5).all()
    step = s[1] - s[0]
    slope = np.diff(gap) / step
    bend = max(1e3 * float(t * (t + m) / (m * b**2)) for t, b, m, _ in ends(mesh.pair))  # second derivative at the ends
    assert np.abs(np.diff(slope)).max() < 2 * bend * step
    assert np.abs(slope[np.searchsorted(s, float(contact.end))]) < 0.05 * np.abs(slope).max()


def test_lever_is_one_minus_half_the_slope_of_the_gap(fine):
    """Energy: under a transmission error d both gears turn by d/2, so the gap changes by its slope times d/2."""
    mesh = fine
    gap, lever, path = (np.asarray(a)[0, 0] for a in (mesh.corner_gap, mesh.lever, mesh.path))
    end, pitch = float(mesh.path_of_contact.end), float(mesh.path_of_contact.base_pitch)
    after = (path > end) & (path < end + 0.35 * pitch)  # farther out the gap goes on along its tangent
    slope = np.gradient(gap[after], path[after])
    np.testing.assert_allclose(lever[after][2:-2], 1 - 0.5e-3 * slope[2:-2], atol=1e-5)


@functools.cache
def truncated_contact(tau, count=1200):
    """Approach of half planes pressed by a parabola that ends at a corner, by a boundary-element method.

    Units: half width of the full contact, its reduced radius and modulus are 1. The gap is x^2 / 2 and the corner
    stands a distance tau to the left of its vertex.
    """
    length = max(2.5, 2.2 + tau)
    edges = -tau + length * (0.5 - 0.5 * np.cos(np.linspace(0, np.pi, count + 1)))
    middle, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)

    def primitive(t):
        return t * np.log(np.abs(t)) - t

    kernel = -(primitive(edges[None, 1:] - middle[:, None]) - primitive(edges[None, :-1] - middle[:, None]))
    # in the units a = R = 1 with E* = 1: load q = pi / 4, displacement 2 / (pi E*) int p ln(1/|x - s|) ds
    kernel, load = 2 / np.pi * kernel, np.pi / 4
    active = np.ones(count, bool)
    for _ in range(100):
        n = int(active.sum())
        system = np.block([[kernel[np.ix_(active, active)], -np.ones((n, 1))], [width[active][None], np.zeros((1, 1))]])
        solution = np.linalg.solve(system, np.append(-0.5 * middle[active] ** 2, load))
        pressure = np.zeros(count)
        pressure[active] = solution[:-1]
        if (pressure >= 0).all():
            break
        active = pressure > 0
    return solution[-1]


@pytest.mark.parametrize("tau", [0.6, 0.2, -0.5, -1.5])
def test_truncated_contact_against_boundary_elements(tau):
    """The extra approach of a contact that a corner cuts off, in units of a^2 / R; beyond the corner less its gap."""
    full = truncated_contact(3.0)
    assert full == pytest.approx(0.5 * (0.5 + np.log(2)), abs=2e-3), "Hertz"
    extra = truncated_contact(tau) - full
    patch = patch_of(jnp.full(3, tau), jnp.ones(3))
    phi = (np.asarray(patch.bending) - 0.25 * np.log(patch.squared_extent))[0] + (0.5 * tau**2 if tau < 0 else 0.0)
    assert extra == pytest.approx(phi, abs=3e-3)


def test_truncation_begins_smoothly_where_the_contact_reaches_the_corner():
    tau = jnp.asarray([1.0 - 1e-4, 1.0, 1.0 + 1e-4])
    patch = patch_of(tau, jnp.ones(3))
    phi = np.asarray(patch.bending) - 0.25 * np.log(patch.squared_extent)
    assert phi[1] == 0.0 and phi[2] == 0.0
    assert abs(phi[0]) < 1e-7
    np.testing.assert_allclose(patch.mean_distance, 0.5 * np.exp(0.5), rtol=1e-3)


def test_corner_contact_is_softer_than_the_flank_and_regular(fine):
    """Deflection under load grows monotonically with the load at every position, also beyond the corner."""
    mesh = fine
    load = jnp.asarray(np.append(0.0, np.geomspace(1e-6, 1000.0, 40)))
    law, flank = mesh.law, mesh.law.flank

    def both(q):
        whole = jnp.full(mesh.path.shape, q)
        ones = jnp.ones_like(whole)
        return *jax.jvp(law.deflection, (whole,), (ones,)), flank.deflection(whole)

    deflection, slope, uncut = map(np.asarray, jax.jit(jax.vmap(both))(load))
    assert np.isfinite(slope).all() and (slope > 0).all()
    assert (deflection >= uncut * (1 - 1e-12)).all()
    middle = np.abs(mesh.path) < 0.1 * float(mesh.path_of_contact.base_pitch)
    ratio = (deflection / np.where(uncut > 0, uncut, 1.0))[:, middle]
    assert ratio[1:].max() < 1.02, "far from the corners nothing changes"


def test_without_extended_contact_pairs_carry_load_on_the_path_alone():
    """Nothing else changes: where no corner touches anyway, the transmission error is the same."""
    table = {"positions": 16, "pairs": 2, "slide_steps": 0}
    tables = [decode("resolution", table | {"extended_contact": on}, ResolutionSection) for on in (False, True)]
    pair = gear_pair()
    sizes = [resolution_of(table, [], bent=False, longest=pair) for table in tables]
    assert sizes[1] == LINE
    meshes = [prepare(pair, resolution=of) for of in sizes]
    removed = nothing_removed(LINE, meshes[0].path.dtype)
    off, on = (solve_removed(mesh, 50.0, removed) for mesh in meshes)
    assert off.converged.all() and on.converged.all()
    outside, force = np.asarray(meshes[0].outside)[:, 0] > 0, np.asarray(off.pair_force)
    assert (force[outside] == 0).all() and (force[~outside] > 0).all()
    # as many pairs on the mean as the path is base pitches long, to one position
    ratio = float(meshes[0].path_of_contact.contact_ratio)
    assert (force > 0).sum() / 16 == pytest.approx(ratio, abs=1 / 16)
    assert ratio - 2.1 / 16 < float(jg.effective_contact_ratio(off)) < ratio + 1 / 16
    assert float(jg.effective_contact_ratio(on)) > ratio + 0.05
    alone = ~((np.asarray(on.pair_force) > 0) & outside).any(axis=0)
    off, on = np.asarray(off.transmission_error), np.asarray(on.transmission_error)
    assert 0 < alone.sum() < 16 and (off[~alone] > on[~alone]).all()
    np.testing.assert_allclose(off[alone], on[alone], rtol=1e-9)


def test_the_gap_beside_either_end_of_the_path_is_that_of_its_corner():
    """To second order, x^2 rho_tip (rho_tip + rho_mate) / (2 rho_mate r_b,tip^2); it touches the mate nearby."""
    pair, beyond = gear_pair(), 1e-3
    path = jg.path_of_contact(pair)
    at = np.array([float(path.start) - beyond, float(path.end) + beyond])
    found = jax.jit(lambda at: contacts(pair, path, at))(at)
    for i, (tip, tip_base, mate, _) in enumerate(ends(pair)):
        wanted = 1e3 * beyond**2 * tip * (tip + mate) / (2 * mate * tip_base**2)
        assert float(found.corner_gap[i]) == pytest.approx(float(wanted), rel=2e-3)
        touched = (found.pinion_roll_length, found.wheel_roll_length)[i][i]
        assert float(touched) == pytest.approx(float(mate), abs=10 * beyond)
