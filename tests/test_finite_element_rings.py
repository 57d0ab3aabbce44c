"""The finite-element model of a ring gear held at its rim: outline, mesh, limits, compliances of another program, and
what it is refused for.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE
from scipy.interpolate import CubicSpline, RectBivariateSpline

import jaxgear as jg
from benchmarks import internal
from jaxgear.compliance import write_table
from jaxgear.compliance.finite_element import compliance as making
from jaxgear.compliance.finite_element.build import build, hub
from jaxgear.compliance.finite_element.compliance_table import Scale, shape_of
from jaxgear.compliance.finite_element.sector import sector, shape_gradients, sines
from jaxgear.compliance.finite_element.sectors import Places, along_edge, responses
from jaxgear.compliance.finite_element.shape import Shape, Tooth
from jaxgear.geometry import ElasticFoundation, SupportArcs, outline
from jaxgear.io import load_design

BOTH = {"module": 3.0, "face_width": 20.0}
PLANET = jg.Gear(19, **BOTH)
PITCH = np.pi * np.cos(np.deg2rad(20.0))  # base pitch for unit module


def shape(teeth, *, angle=20.0, shift=0.0, addendum=0.8, dedendum=1.25, radius=0.25, rim=3.5, poisson=0.3, cutter=0.4):
    """Rim in modules; without cutter the radius is that of a given fillet."""
    pitch = -teeth / 2 + shift
    known = pitch + addendum, pitch - dedendum - rim
    return Shape(-teeth, angle, shift, dedendum, radius, *known, poisson, 0.0, round(cutter * teeth)).rounded()


def ring(**numbers):
    return jg.RingGear(
        **({"teeth": 64, "cutter_teeth": 25, "root_radius": 0.25, "rim_diameter": 220.5} | BOTH | numbers)
    )


def filleted(**numbers):
    return ring(**({"cutter_teeth": None, "root_radius": None, "fillet_radius": 0.8} | numbers))


@pytest.mark.parametrize("gear", [ring(profile_shift=-0.2), filleted(tooth_thickness_allowance=-90.0)])
def test_the_outline_is_that_of_the_geometry(gear):
    drawn, module = outline(gear), float(gear.module)
    tooth = Tooth(Shape(*np.asarray(shape_of(gear, "stress"), float)))
    assert module * tooth.form_roll_length == pytest.approx(float(drawn.form_roll_length), rel=1e-9)
    assert module * tooth.tip_roll_length == pytest.approx(float(gear.tip_roll_length), rel=1e-9)
    assert tooth.root_half_angle == pytest.approx(float(drawn.root_half_angle), rel=1e-9)
    rho = np.linspace(tooth.form_roll_length, tooth.tip_roll_length, 5)
    g = np.linspace(tooth.junction, np.pi / 2, 5)
    curves = drawn.curves.over((5,))
    np.testing.assert_allclose(module * tooth.involute(rho), curves.involute(jnp.asarray(module * rho)), rtol=1e-9)
    np.testing.assert_allclose(module * tooth.trochoid(g), curves.trochoid(jnp.asarray(g)), rtol=1e-9)


SHAPES = {
    "usual": shape(64),
    "many teeth": shape(300),
    "thin rim": shape(64, rim=0.1),
    "thick rim": shape(64, rim=40.0),
    "given fillet": shape(64, radius=0.27, cutter=0),
    "sharp root": shape(64, radius=0.0),
    "stub": shape(40, angle=30.0, addendum=0.6, dedendum=0.8, radius=0.2),
    "shifted": shape(80, shift=-0.5),
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
    angle, squared = np.arctan2(-x, -y), x**2 + y**2
    half = 0.5 * tooth.tip**2 * tooth.half_angle(tooth.tip_roll_length)
    half += np.sum(0.25 * (squared[1:] + squared[:-1]) * np.diff(angle))
    half += 0.5 * tooth.root**2 * (tooth.sector_half_angle - tooth.root_half_angle)
    half -= 0.5 * tooth.bore**2 * tooth.sector_half_angle
    nodes, weights = np.polynomial.legendre.leggauss(3)
    jacobian = np.einsum("pni,enc->epic", shape_gradients(nodes, nodes), mesh.points[mesh.elements])
    area = np.sum(np.linalg.det(jacobian) * np.outer(weights, weights).ravel())
    assert area == pytest.approx(2 * half, rel=2e-5)
    np.testing.assert_allclose(np.linalg.norm(mesh.points[mesh.held], axis=1), -tooth.bore, rtol=1e-12)


def on_flank(tooth, mesh, rho):
    angle = tooth.load_angle(rho)
    directions = np.stack([-np.cos(angle), -np.sin(angle)], axis=1)
    return Places.of_points(*along_edge(mesh.flank, mesh.flank_arc, tooth.arc(rho)), directions, len(mesh.points))


def test_displacements_are_reciprocal_around_the_whole_ring():
    tooth = Tooth(shape(30, rim=1.0, addendum=0.5))
    mesh = sector(tooth, 0.5)
    flank = on_flank(tooth, mesh, np.linspace(tooth.form_roll_length, tooth.tip_roll_length, 4))
    found = responses(mesh, 0.3, 30, flank, flank, 29)
    for k in range(30):
        np.testing.assert_allclose(found[k], found[-k % 30].T, rtol=1e-9, atol=1e-12)
    apart = abs(np.arange(30)[:, None] - np.arange(30)[None])
    np.linalg.cholesky(found[0])
    np.linalg.cholesky(found[:, 1, 1][apart])  # loads on all teeth of the ring do work


def test_the_ring_turns_as_an_annulus_held_outside():
    """All teeth loaded alike twist it: T / (4 pi G) (1 / r^2 - 1 / r_rim^2) on a circle outside the teeth."""
    tooth = Tooth(shape(64, rim=6.0))
    mesh = sector(tooth)
    radii = np.linalg.norm(mesh.points, axis=1)
    arc = mesh.centreline[mesh.points[mesh.centreline, 1] < tooth.root - 0.59][0]
    circle = np.flatnonzero(np.abs(radii - radii[arc]) < 1e-9)
    circle = circle[np.argsort(mesh.points[circle, 0])]
    share = np.full(len(circle), 1 / 3)
    share[1:-1:2], share[2:-1:2] = 4 / 3, 2 / 3
    share /= share.sum()  # Simpson over equal edges
    x, y = (mesh.points[circle] / radii[arc]).T
    # the way of the load, which turns a ring gear about its axis above the tooth
    tangents = np.stack([y, -x], axis=1)
    each = Places.of_points(circle[:, None], np.ones((len(circle), 1)), tangents, len(mesh.points)).weights
    loaded = on_flank(tooth, mesh, np.array([0.5 * (tooth.tip_roll_length + tooth.form_roll_length)]))
    found = responses(mesh, 0.3, 64, loaded, Places((each @ share)[:, None]), 63)
    radius = radii[arc]
    expected = -tooth.base * (1 + 0.3) / (2 * np.pi) * (radius**-2 - tooth.bore**-2) * radius
    assert found.mean() == pytest.approx(expected, rel=2e-5)
    torsion = (1 + 0.3) / (2 * np.pi) * (tooth.root**-2 - tooth.bore**-2) * tooth.base**2
    assert hub(tooth.shape) == pytest.approx(torsion, rel=1e-12) and torsion > 0


def heights(given):
    """Centre and coupling at points of the tooth at given heights above the reference circle."""
    numbers, tooth = build(given, 0.5), Tooth(given)
    radius = tooth.pitch + np.linspace(-0.5, 0.6, 5)
    rho = given.signed(np.sqrt(radius**2 - tooth.base**2))
    beside = RectBivariateSpline(numbers.roll_length, numbers.roll_length, numbers.neighbours[0])(rho, rho)
    return np.concatenate([CubicSpline(numbers.roll_length, numbers.center)(rho), beside.ravel()])


def test_internal_and_external_gears_of_many_teeth_are_both_the_rack():
    """Their difference is a term in 1 / z."""

    def both(teeth):
        inside = shape(teeth, radius=0.3)
        outside = inside._replace(
            teeth=float(teeth), tip_ratio=teeth / 2 + 0.8, bore_ratio=teeth / 2 - 4.75, cutter_teeth=0.0
        )
        return heights(inside), heights(outside.rounded())

    (inside, outside), (nearer, near) = both(80), both(160)
    np.testing.assert_allclose(nearer - near, 0.5 * (inside - outside), rtol=0.03)


@pytest.mark.slow
def test_a_finer_mesh_changes_nothing():
    coarse, fine = build(shape(64)), build(shape(64), 1.5)
    np.testing.assert_allclose(coarse.center, fine.center, rtol=3e-4)
    np.testing.assert_allclose(coarse.neighbours[:2], fine.neighbours[:2], rtol=3e-4, atol=3e-4)
    np.testing.assert_allclose(coarse.local[3:], fine.local[3:], atol=0.01)


# Finite elements of another program, rim clamped, plane stress, E = 206 GPa; um per N/mm at roll lengths [mm]:
# centreline, and the tooth towards which the load pushes, one base pitch further from the tip
REFERENCE = {
    "19/64, rim of three tooth heights": (6.15, [(25.11051, 0.04417, 0.00185), (28.21968, 0.02998, 0.00252)]),
    "19/64, rim of one tooth height": (2.05, [(25.11051, 0.03842, 0.00036), (28.21968, 0.02510, 0.00071)]),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_compliances_are_those_of_another_program(name):
    rim, rows = REFERENCE[name]
    numbers = build(shape(64, rim=rim)._replace(cutter_teeth=25.0))
    center, first = CubicSpline(numbers.roll_length, numbers.center), numbers.neighbours[0]
    for roll, middle, coupled in rows:
        rho = -roll / 3
        assert center(rho) == pytest.approx(206 * middle, rel=1e-3)
        beside = RectBivariateSpline(numbers.roll_length, numbers.roll_length, first)(rho, rho - PITCH)
        assert beside.item() == pytest.approx(206 * coupled, abs=206 * 1e-5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("tables")


@pytest.mark.slow
def test_a_mesh_deflects_as_in_the_reference(folder):
    """Mean transmission error and PPTE of unmodified flanks."""
    pair = internal.gear_pair("R1", "clamped")
    mesh = jg.prepare(pair, compliance=jg.finite_element_compliance(pair, "stress", cache=folder), resolution=LINE)
    curve = np.asarray(jg.solve(mesh, 100.0).transmission_error)
    truth = np.asarray(internal.stored()["pairs"]["R1"]["curves"]["clamped stress"]["100 none"])
    assert curve.mean() == pytest.approx(truth.mean(), rel=4e-3)
    assert np.ptp(curve) == pytest.approx(np.ptp(truth), rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["R1", "R2"])
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_cycles_are_those_of_the_reference(name, plane, folder):
    def structure(pair, plane):
        return jg.finite_element_compliance(pair, plane, cache=folder)

    for case, found in internal.run(name, f"clamped {plane}", structure).items():
        assert abs(found.mean) < 0.4, case
        # flanks relieved on both gears touch over wide contacts
        assert abs(found.ripple_um) < (0.02 if "both" not in case else 0.13), case


def of_ring(folder, gear):
    return making._tables(gear, "stress", None, folder)[0]


def test_tables_of_another_gear_are_told(folder):
    table, given = of_ring(folder, ring()), of_ring(folder, filleted())

    def fault(gear, table=table):
        return making.different(table, making._concrete(gear, "stress")[0])

    assert fault(ring()) is None and fault(filleted(), given) is None
    assert fault(ring(rim_diameter=230.0)) == "rim_diameter over 2 module = 38.33333 differs from 36.75 of its table"
    assert fault(ring(teeth=67)).startswith("teeth = 67 differs from 64 of its table")
    assert fault(jg.Gear(64, cutter_teeth=25, **BOTH)) == "is an external gear, its table is of a ring gear"
    assert "fillet_radius over module = 0.2333333 differs" in fault(filleted(fillet_radius=0.7), given)


@pytest.mark.parametrize(
    "wheel, problem",
    [
        (lambda: ring(support=SupportArcs(6, width=6.0)), "wheel support: must be None, finite elements hold the rim"),
        pytest.param(
            lambda: ring(support=ElasticFoundation(1e3)), "wheel support: must be None", marks=pytest.mark.slow
        ),
        pytest.param(lambda: ring(helix_angle=10.0), "helix_angle = 10 deg, must be 0 deg", marks=pytest.mark.slow),
    ],
)
def test_rings_without_finite_elements(wheel, problem):
    wheel = wheel()
    planet = PLANET if wheel.is_spur else jg.Gear(19, helix_angle=10.0, **BOTH)
    with pytest.raises(ValueError, match=problem) as refused:
        jg.finite_element_compliance(jg.GearPair(planet, wheel), "stress", cache=None)
    assert "\n" not in str(refused.value)


def test_a_rim_without_thickness_cannot_be_meshed():
    with pytest.raises(ValueError, match="^rim_diameter leaves a rim of 0.001 x module, which cannot be meshed"):
        sector(Tooth(shape(64, rim=0.001)))


@pytest.mark.parametrize(
    "name, gear, given",
    [
        ("rim_diameter", ring, 220.5),
        ("fillet_radius", filleted, 0.8),
        ("addendum", ring, 0.8),
        ("module", ring, 3.0),
    ],
)
def test_derivatives_that_a_table_cannot_know_are_refused(folder, name, gear, given):
    table = of_ring(folder, gear())
    with pytest.raises(ValueError, match=f"^no derivative by {name}: "):
        jax.grad(lambda number: Scale.of(table, gear(**{name: number}), "stress").value)(given)


def test_a_written_table_is_read_as_it_was(folder, tmp_path):
    """Roll lengths of a ring gear are negative."""
    path, table = tmp_path / "ring.csv", of_ring(folder, ring())
    assert float(table.roll_length[-1]) == pytest.approx(float(ring().tip_roll_length), rel=1e-6)
    write_table(path, table)
    (read,) = making._tables(ring(), "stress", path, None)
    assert all(np.array_equal(*leaves) for leaves in zip(jax.tree.leaves(read), jax.tree.leaves(table)))
    path.write_text(
        "kind,neighbour,loaded_mm,displaced_mm,um_mm_per_N\n" + "".join(f"center,,{x},,1\n" for x in range(1, 6))
    )
    with pytest.raises(ValueError, match="line 6: loaded_mm = 5 must be at most 0 for a ring gear"):
        making._tables(ring(), "stress", path, None)


DESIGN = """
[pinion]
teeth = 19
module = 3.0
face_width = 20.0
[ring]
teeth = 64
module = 3.0
face_width = 20.0
cutter_teeth = 25
root_radius = 0.25
rim_diameter = 220.5
[load]
torque = 100.0
[model]
{model}plane = "stress"
[resolution]
positions = 16
pairs = 3
"""


@pytest.mark.slow
def test_design_files_and_verifications(tmp_path, folder, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    path = tmp_path / "ring.toml"
    path.write_text(DESIGN.format(model='structure = "finite_element"\n'))
    file = load_design(path)
    cycle = jg.solve(file.mesh(file.resolution()), 100.0)
    path.write_text(DESIGN.format(model=""))
    closed = load_design(path)
    mesh = closed.mesh(closed.resolution())
    second = jg.optimize.structure_for(mesh, cache=folder)
    flanks = jg.microgeometry.NoModification(), jg.microgeometry.NoModification()
    found = jg.optimize.verification(mesh, second)(jg.solve(mesh, 100.0), {}, *flanks)
    assert found.ppte == pytest.approx(float(jg.peak_to_peak(cycle.transmission_error)), rel=1e-9)
    assert found.claimed == pytest.approx(found.ppte, rel=0.05)
