"""The finite-element model of a gear: outline, mesh, reciprocity, a closed form, and compliances of another program."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline, RectBivariateSpline

import jaxgear as jg
from jaxgear.compliance.assembly import with_edge
from jaxgear.compliance.finite_element.build import POINTS, _wedge, build, hub
from jaxgear.compliance.finite_element.sector import sector, shape_gradients, sines
from jaxgear.compliance.finite_element.sectors import Places, along_edge, responses
from jaxgear.compliance.finite_element.shape import Shape, Tooth
from jaxgear.compliance.hertz import contact_geometry
from jaxgear.compliance.toothload import tooth_load
from jaxgear.geometry import outline

FULL = 0.25 / (1 - np.sin(np.deg2rad(20.0)))  # root radius that leaves no flat on the tip of the rack


def shape(teeth, *, angle=20.0, shift=0.0, dedendum=1.25, radius=FULL, addendum=1.0, bore=0.5, poisson=0.3):
    """Bore as a share of the root radius."""
    pitch = teeth / 2 + shift
    return Shape(teeth, angle, shift, dedendum, radius, pitch + addendum, bore * (pitch - dedendum), poisson).rounded()


def bored(teeth, ratio, poisson):
    return shape(teeth, poisson=poisson)._replace(bore_ratio=ratio).rounded()


@jax.jit
def points(drawn, rho, g):
    curves = drawn.curves.over((5,))
    return curves.involute(rho), curves.trochoid(g)


@pytest.mark.parametrize("teeth, shift", [(9, 0.0), (19, 0.3), (150, 0.0)])
def test_the_outline_is_that_of_the_geometry(teeth, shift):
    gear = jg.Gear(teeth, 1.0, profile_shift=shift, face_width=5.0)
    drawn = outline(gear)
    tooth = Tooth(shape(teeth, shift=shift, radius=0.38))
    assert tooth.form_roll_length == pytest.approx(float(drawn.form_roll_length), rel=1e-9)
    assert tooth.root_half_angle == pytest.approx(float(drawn.root_half_angle), rel=1e-9)
    rho = np.linspace(tooth.form_roll_length, tooth.tip_roll_length, 5)
    g = np.linspace(tooth.junction, np.pi / 2, 5)
    involute, trochoid = points(drawn, rho, g)
    np.testing.assert_allclose(tooth.involute(rho), involute, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(tooth.trochoid(g), trochoid, rtol=1e-9, atol=1e-9)


SHAPES = {
    "undercut": shape(9, shift=-0.1),
    "few teeth, shifted": shape(8, shift=0.5, radius=0.38),
    "many teeth": shape(150),
    "thin rim": shape(60, bore=0.95),
    "small bore": shape(30, bore=0.02),
    "stub": shape(22, angle=25.0, addendum=0.8, dedendum=1.0, radius=0.25),
    "high": shape(40, angle=15.0, addendum=1.35, dedendum=1.6, radius=0.2),
    "sharp root": shape(20, radius=0.0),
}


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_are_meshed_without_folds(name):
    """The area of the sector is that of its outline: nothing is missing, nothing overlaps."""
    tooth = Tooth(SHAPES[name])
    mesh = sector(tooth)
    assert sines(mesh).min() > 0.02
    rho = np.linspace(tooth.tip_roll_length, tooth.form_roll_length, 4000)
    g = np.linspace(tooth.junction, np.pi / 2, 4000)
    x, y = np.concatenate([tooth.involute(rho), tooth.trochoid(g)], axis=1)
    angle, squared = np.arctan2(x, y), x**2 + y**2
    half = 0.5 * tooth.tip**2 * tooth.half_angle(tooth.tip_roll_length)
    half += np.sum(0.25 * (squared[1:] + squared[:-1]) * np.diff(angle))
    half += 0.5 * tooth.root**2 * (tooth.sector_half_angle - tooth.root_half_angle)
    half -= 0.5 * tooth.bore**2 * tooth.sector_half_angle
    assert _area(mesh) == pytest.approx(2 * half, rel=2e-5)


def _area(mesh):
    """Sum over the Gauss points of all elements."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    jacobian = np.einsum("pni,enc->epic", shape_gradients(nodes, nodes), mesh.points[mesh.elements])
    return float(np.sum(np.linalg.det(jacobian) * np.outer(weights, weights).ravel()))


@pytest.mark.parametrize(
    "wrong, name",
    [(shape(6, angle=14.5, shift=-0.5, addendum=1.0), "teeth = 6"), (shape(6, shift=0.5, bore=0.97), "bore_diameter")],
)
def test_what_cannot_be_meshed_is_refused_by_name(wrong, name):
    with pytest.raises(ValueError, match=f"^{name}.* cannot be meshed"):
        sector(Tooth(wrong))


def test_displacements_are_reciprocal_around_the_whole_ring():
    """Maxwell and Betti: tooth k answers tooth 0 as tooth 0 answers tooth k, which lies z - k teeth further on."""
    tooth = Tooth(shape(12))
    mesh = sector(tooth)
    rho = np.linspace(tooth.form_roll_length, tooth.tip_roll_length, 4)
    angle = tooth.load_angle(rho)
    directions = np.stack([-np.cos(angle), -np.sin(angle)], axis=1)
    flank = Places.of_points(*along_edge(mesh.flank, mesh.flank_arc, tooth.arc(rho)), directions, len(mesh.points))
    found = responses(mesh, 0.3, 12, flank, flank, 11)
    for k in range(12):
        np.testing.assert_allclose(found[k], found[-k % 12].T, rtol=1e-9)
    np.linalg.cholesky(found[0])  # every load does work


def test_the_ring_turns_as_the_closed_form_says():
    """Without its harmonics a load is pure torsion: T / (4 pi G) (1 / r_bore^2 - 1 / r^2) inside the teeth."""
    tooth = Tooth(bored(19, 10 / 3, 0.3))
    mesh = sector(tooth)
    radii = np.linalg.norm(mesh.points, axis=1)
    arc = mesh.centreline[mesh.points[mesh.centreline, 1] < tooth.root - 0.59][0]
    ring = np.flatnonzero(np.abs(radii - radii[arc]) < 1e-9)
    x, y = mesh.points[ring].T
    ring, place = ring[np.argsort(np.arctan2(x, y))], np.sort(np.arctan2(x, y))
    share = np.full(len(ring), 1 / 3)
    share[1:-1:2], share[2:-1:2] = 4 / 3, 2 / 3
    share /= share.sum()  # Simpson over equal edges
    assert np.ptp(np.diff(place)) < 1e-9
    tangents = np.stack([-np.cos(place), np.sin(place)], axis=1)
    each = Places.of_points(ring[:, None], np.ones((len(ring), 1)), tangents, len(mesh.points)).weights
    rho = np.array([0.6 * tooth.tip_roll_length])
    angle = tooth.load_angle(rho)
    directions = np.stack([-np.cos(angle), -np.sin(angle)], axis=1)
    flank = Places.of_points(*along_edge(mesh.flank, mesh.flank_arc, tooth.arc(rho)), directions, len(mesh.points))
    found = responses(mesh, 0.3, 19, flank, Places((each @ share)[:, None]), 18)
    radius = radii[arc]
    expected = tooth.base * (1 + 0.3) / (2 * np.pi) * (tooth.bore**-2 - radius**-2) * radius
    assert found.mean() == pytest.approx(expected, rel=2e-5)
    # the same on the root circle and the line of action is what every tooth has in common
    turned = (1 + 0.3) / (2 * np.pi) * (tooth.bore**-2 - tooth.root**-2) * tooth.base**2
    assert hub(tooth.shape) == pytest.approx(turned, rel=1e-12)


# Finite elements of another program: quadratic triangles, 0.005 module at the loaded flank, whole ring; um per N/mm at
# roll angles [rad]: (roll angle, centreline, flank under an elliptic pressure of half width 0.02 module beyond the
# logarithmic law, neighbour one pitch away)
REFERENCE = {
    "z19 m3 bore 20 mm, plane stress": (
        bored(19, 10 / 3, 0.3),
        206e3,
        [
            (0.110259, 0.02460124, None, -1, 0.01053815),
            (0.2769989, 0.02794199, 0.02851521, -1, 0.01021934),
            (0.4437389, 0.03913249, 0.03983311, +1, 0.01053643),
            (0.6104788, 0.0713715, None, +1, 0.01021115),
        ],
    ),
    "z30 m4 bore 76.6 mm, plane strain": (
        bored(30, 38.3 / 4, 0.3 / 0.7),
        206e3 / 0.91,
        [
            (0.2009385, 0.01283485, None, -1, 0.004275969),
            (0.310875, 0.01726295, 0.01799887, -1, 0.003796084),
            (0.4208115, 0.0278459, 0.02864823, +1, 0.004241525),
            (0.530748, 0.05536222, None, +1, 0.003735196),
        ],
    ),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_compliances_are_those_of_another_program(name):
    given, modulus, rows = REFERENCE[name]
    numbers, tooth = build(given), Tooth(given)
    pitch = np.pi * np.cos(np.deg2rad(20.0))
    center, local = (CubicSpline(numbers.roll_length, values) for values in (numbers.center, numbers.local))
    to_unit = modulus / 1e3
    for roll, middle, surface, step, coupled in rows:
        rho = roll * tooth.base
        assert center(rho) == pytest.approx(middle * to_unit, rel=1e-3)
        if surface is not None:
            # nearly independent of the width of the pressure, 0.02 module there and 0.06 here
            assert local(rho) == pytest.approx((surface - middle) * to_unit, abs=0.008)
        matrix = numbers.neighbours[0] if step > 0 else numbers.neighbours[0].T
        beside = RectBivariateSpline(numbers.roll_length, numbers.roll_length, matrix)(rho, rho - step * pitch)
        assert beside.item() == pytest.approx(coupled * to_unit, rel=2e-3)


def test_the_wedge_of_the_tip_that_is_taken_out_is_that_of_the_law():
    """It is read with a pressure near the tip, where the law softens too."""
    gears = jg.GearPair(*(jg.Gear(z, 1.0, face_width=5.0) for z in (19, 48)))
    tooth = Tooth(shape(19, radius=0.38))
    rho = np.sqrt(tooth.tip_roll_length**2 - 2 * tooth.base * np.array([0.13, 0.2, 0.4]))

    @jax.jit
    def softer(gears):
        pinion = tooth_load(outline(gears.pinion), jnp.asarray(rho)[None])
        wheel = tooth_load(outline(gears.wheel), jnp.full((1, 3), 3.0))
        geometry = contact_geometry(pinion, wheel, "stress", gears.face_width)
        flank = jg.compliance.DepthReferenced().prepare(geometry)
        law = with_edge(flank, geometry, pinion, wheel, jnp.zeros((1, 3)))
        load = 0.06**2 / geometry.width_factor
        return (law.secant(load) - flank.secant(load))[0, 0]

    np.testing.assert_allclose(softer(gears), 1e3 / 206e3 * _wedge(tooth, rho), rtol=1e-6)


@pytest.mark.slow
def test_a_finer_mesh_changes_nothing():
    coarse, fine = build(shape(25, bore=0.6)), build(shape(25, bore=0.6), 1.5)
    np.testing.assert_allclose(coarse.center, fine.center, rtol=3e-4)
    np.testing.assert_allclose(coarse.neighbours[:2], fine.neighbours[:2], rtol=3e-4)
    np.testing.assert_allclose(coarse.local, fine.local, atol=0.01)
    assert len(coarse.center) == POINTS and np.all(np.diff(coarse.center[5:]) > 0)
