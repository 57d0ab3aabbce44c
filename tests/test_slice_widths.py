"""Slices of unequal width: kernel, contact problem, limits, symmetry, derivatives, and end reliefs, which need them."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from catalogue import FACE, LINE
from contact_problems import coupled, influence, kernel_of, modes_of, random_problem, solved_in_20, stiffness_at

import jaxgear as jg
from jaxgear import plot
from jaxgear.compliance import face_ends, slice_basis
from jaxgear.contact import end_relief_widths
from jaxgear.io import DesignFileError, load_design
from jaxgear.metrics import edge_load_factor, face_load_factor, face_load_factors, findings_of, mean_removed_material
from jaxgear.numerics import Body, SliceCoupling
from jaxgear.shafts import Misalignment, RigidSupport, TabulatedSupport

WIDTH, CHORD, TORQUE = 18.0, 8.189371, 50.0
UNEVEN = (1, 2, 1, 3, 2, 1)
WEIGHT = np.asarray(UNEVEN) / np.mean(UNEVEN)


def pair_of(pinion=WIDTH, wheel=WIDTH):
    gears = (
        jg.Gear(19, 3.0, face_width=pinion, bore_diameter=20.0),
        jg.Gear(48, 3.0, face_width=wheel, bore_diameter=40.0),
    )
    return jg.GearPair(*gears)


def mesh_of(widths=UNEVEN, slices=None, pair=None, support=None, **sizes):
    """Few pairs and waves, which compile fast."""
    sizes = {"positions": 4, "pairs": 2, "face_modes": 3, "contact_nodes": 1} | sizes
    resolution = jg.Resolution(slices=slices or len(widths), slice_widths=widths, **sizes)
    return jg.prepare(pair_of() if pair is None else pair, resolution=resolution, support=support)


class Bent(RigidSupport):
    """Tilts and bends under the load [um/N], or not at all: one program for both."""

    softness: jax.Array = eqx.field(default_factory=lambda: jnp.asarray(1e-3))

    def influence(self, y):
        share = y / WIDTH
        return self.softness * (1.0 + share[:, None] * share[None] + 0.5 * (share**2)[:, None] * (share**2)[None])


def level():
    return Bent(pair_of(), Misalignment(), jnp.zeros(()))


@pytest.fixture(scope="module")
def mesh():
    """On a support that does not give way, whose contact the program of one that does finds."""
    return mesh_of(support=level())


def kernel(slices):
    return np.asarray(kernel_of(WIDTH, CHORD, slices))


def uneven_kernel(parts):
    """Deflections under line loads, and the symmetric form."""
    basis = slice_basis(parts)
    even, root = basis.T @ kernel(sum(parts)) @ basis, np.sqrt(parts)
    return even / root[:, None] * root[None], even


def test_sizes_by_position_keep_their_order():
    assert jg.Resolution(8, 6, 3, 1) == jg.Resolution(positions=8, slices=6, pairs=3, contact_nodes=1)


@pytest.mark.slow
def test_slices_fill_the_face(mesh):
    width, middle = np.asarray(mesh.slice_width), np.asarray(mesh.face_coordinate)
    np.testing.assert_allclose(width, 1.8 * np.asarray(UNEVEN), rtol=1e-14)
    np.testing.assert_allclose(np.diff(middle), 0.5 * (width[1:] + width[:-1]), rtol=1e-12)
    np.testing.assert_allclose([middle[0] - 0.5 * width[0], middle[-1] + 0.5 * width[-1]], [-9.0, 9.0], rtol=1e-14)


def test_kernel_is_one_of_mean_deflections_under_even_loads():
    """Rows sum to one; symmetric with the widths; of parts of equal width summed and averaged by hand."""
    found, symmetric = uneven_kernel(UNEVEN)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, rtol=1e-12)
    weighted = np.asarray(UNEVEN)[:, None] * found
    np.testing.assert_allclose(weighted, weighted.T, atol=1e-14)
    assert np.linalg.eigvalsh(symmetric)[0] > 0 and np.linalg.eigvalsh(symmetric)[-1] <= 1 + 1e-12
    fine = kernel(10)
    np.testing.assert_allclose(found[1, 3], fine[1:3, 4:7].sum() / 2, rtol=1e-12)
    np.testing.assert_allclose(uneven_kernel((1,) * 7)[0], kernel(7), atol=1e-15)


@pytest.mark.parametrize(("count", "most"), [(12, 4e-3), pytest.param(24, 1e-3, marks=pytest.mark.slow)])
def test_merged_parts_deflect_as_fine_slices_do_under_a_smooth_load(count, most):
    """Twice as wide slices in the middle against fine ones all over, and the kernel of as wide slices itself."""
    parts = (1,) * (count // 4) + (2,) * (count // 4) + (1,) * (count // 4)
    edges = np.cumsum([0, *parts]) / count - 0.5
    fine = (np.arange(count) + 0.5) / count - 0.5
    load, over = (np.exp(x) * (1 - 2 * x**2) for x in (fine, 0.5 * (edges[1:] + edges[:-1])))
    merged = uneven_kernel(parts)[0] @ over
    averaged = slice_basis(parts).T @ (kernel(count) @ load) / np.sqrt(parts)
    assert 1e-6 < np.abs(merged - averaged).max() < most
    double, equal = uneven_kernel((2,) * (count // 2))[0], kernel(count // 2)
    smooth = np.exp((np.arange(count // 2) + 0.5) / (count // 2))
    np.testing.assert_allclose(double @ smooth, equal @ smooth, rtol=4 * most)


@pytest.mark.parametrize("ends", [False, True])
def test_modes_hold_the_root_of_the_widths_and_all_of_them_the_kernel(ends):
    _, whole = uneven_kernel(parts := (2, 2, 1, 1, 4, 4, 4, 1, 1, 2, 2))
    shapes = jnp.asarray(slice_basis(parts).T) @ face_ends(WIDTH, CHORD, sum(parts)) if ends else None
    constant = np.sqrt(np.asarray(parts) / sum(parts))
    for count in (5, 20):
        modes, share, rest = map(np.asarray, modes_of(whole, count, shapes, parts))
        np.testing.assert_allclose(modes.T @ modes, np.eye(modes.shape[1]), atol=1e-11)
        np.testing.assert_allclose(modes[:, 0], constant, rtol=1e-12)
        found = rest * np.eye(len(parts)) + modes @ share @ modes.T
        np.testing.assert_allclose(found @ constant, constant, rtol=1e-11)
        assert np.linalg.eigvalsh(share)[0] > 0
        error = np.linalg.norm(found - whole) / np.linalg.norm(whole)
        assert error < 1e-13 if count > len(parts) else 1e-3 < error < 0.15


def coupled_problem(bends):
    """A random contact problem over slices of unequal width whose loads touch some of the slices only."""
    rng, root = np.random.default_rng(7), np.sqrt(WEIGHT)[:, None]
    modes, share, rest = map(np.asarray, modes_of(uneven_kernel(UNEVEN)[1], 4, None, UNEVEN))
    shapes = held = None
    if bends:
        made = rng.normal(size=(bends, bends))
        held = jnp.asarray(0.01 / 3.0 * made @ made.T)
        powers = np.linalg.qr(root * np.vander(np.linspace(-1, 1, 6), bends, increasing=True))[0] / root
        shapes = jnp.asarray(powers * np.sign(powers[0, 0]))
    problem = random_problem(3, 2, 6, 6)
    bodies = (Body(problem.compliance[:, :, 0], jnp.asarray(share) / 3.0, jnp.asarray(rest)),)
    coupling = SliceCoupling(jnp.asarray(modes / root), bodies, support_modes=shapes, support=held)
    return coupled(problem, coupling, weight=jnp.asarray(3.0 * WEIGHT), load=jnp.asarray(2000.0))


def assert_conditions(c, gap, lever, approach, load, own, opening):
    """Deflections by the whole matrix in NumPy: no overlap, no pull, closed where loaded."""
    load, lever, approach = (np.asarray(each) for each in (load, lever, approach))
    left = np.einsum("isjtx,jtx->isx", influence(c, 3.0 * WEIGHT), load)
    if c.support is not None:
        way = c.support_modes @ c.support @ c.support_modes.T @ np.diag(3.0 * WEIGHT)
        left = left + np.einsum("ix,jx,st,jtx->isx", lever, lever, way, load)
    left = left + np.asarray(gap) - (lever * approach)[:, None]
    total, scale = left + np.asarray(own) * load, 1e-9 * np.abs(approach).max()
    assert (load >= 0).all() and 0.1 < (load > 0).mean() < 0.9
    np.testing.assert_allclose(total[load > 0], 0.0, atol=scale)
    assert total[load == 0].min() > -scale
    np.testing.assert_allclose(opening, left, atol=scale)


own_deflection = jax.jit(lambda law, load: law.secant(jnp.maximum(load, 1e-9)))


@pytest.mark.slow
def test_solution_meets_the_conditions_of_the_dense_problem():
    """Of rough flanks that touch on some of the slices only, on a support that gives way under the load."""
    mesh = mesh_of(support=Bent(pair_of(), Misalignment(direct=20.0)))
    rough = np.random.default_rng(3).uniform(0.0, 30.0, (2, 6, 4))
    found = jg.contact.solve_removed(mesh, TORQUE, rough)
    assert bool(found.converged.all())
    approach = found.transmission_error - mesh.hub * found.force / mesh.pair.face_width
    own = own_deflection(mesh.law, found.line_load)
    given = mesh.coupling, mesh.held(found.gap), mesh.lever[:, 0]
    assert_conditions(*given, approach, found.line_load, own, found.opening)
    carried = np.einsum("ix,s,isx->x", mesh.lever[:, 0], mesh.slice_width, found.line_load)
    np.testing.assert_allclose(carried, float(found.force), rtol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("bends", [2, 0])
def test_random_problems_meet_the_conditions_of_the_dense_problem(bends):
    data = coupled_problem(bends)
    found = solved_in_20(data)
    assert found.converged.all()
    own = data.law.secant(np.maximum(found.line_load, 1e-9))
    given = data.coupling, data.gap, data.lever[:, 0]
    assert_conditions(*given, found.approach, found.line_load, own, found.opening)
    carried = np.einsum("ix,s,isx->x", data.lever[:, 0], data.weight, found.line_load)
    np.testing.assert_allclose(carried, 2000.0, rtol=1e-10)


@pytest.mark.slow
def test_approach_of_a_load_brings_that_load_and_its_stiffness():
    given = coupled_problem(2)
    found = solved_in_20(given)
    pressed = replace(given, load=None, approach=found.approach)
    again = solved_in_20(pressed)
    np.testing.assert_allclose(again.line_load, found.line_load, rtol=1e-8, atol=1e-8)
    step = 1e-4 * found.approach
    more, less = (solved_in_20(replace(pressed, approach=found.approach + x)) for x in (step, -step))
    np.testing.assert_allclose(stiffness_at(given, found), (more.load - less.load) / (2 * step), rtol=1e-5)


def with_equal_widths():
    return [replace(FACE, slice_widths=widths) for widths in ((3,) * 6, None)]


def test_equal_widths_are_none():
    """All that arrays depend on is the same, and none of it is of widths."""
    given, none = with_equal_widths()
    assert given.parts is None and given.slice_weights is None
    np.testing.assert_array_equal(given.slice_edges, none.slice_edges)
    for sizes in ("of_arrays", "of_material", "of_contact"):
        assert getattr(given, sizes) == getattr(none, sizes)


@pytest.mark.slow
def test_meshes_of_equal_widths_are_those_of_none():
    meshes = [jg.prepare(pair_of(), resolution=sizes) for sizes in with_equal_widths()]
    for one, other in zip(*map(jax.tree.leaves, meshes), strict=True):
        np.testing.assert_array_equal(one, other)


def test_uniform_flanks_load_all_slices_alike(mesh):
    many = jg.solve(mesh, TORQUE)
    assert bool(many.converged.all())
    load = np.asarray(many.line_load)
    np.testing.assert_allclose(load, np.repeat(load[:, :1], 6, axis=1), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(face_load_factors(many), 1.0, rtol=1e-9)


@pytest.mark.slow
def test_uniform_flanks_are_one_slice(mesh):
    many, one = jg.solve(mesh, TORQUE), jg.solve(jg.prepare(mesh.pair, resolution=LINE), TORQUE)
    error, load, stiffness = (x[..., ::4] for x in (one.transmission_error, one.line_load, one.tangent_stiffness))
    np.testing.assert_allclose(many.transmission_error, error, rtol=1e-12)
    np.testing.assert_allclose(many.line_load, np.repeat(load, 6, axis=1), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(many.tangent_stiffness, stiffness, rtol=1e-9)


@pytest.mark.parametrize("coupled", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_mirrored_slices_and_misalignment_mirror_the_load(mesh, coupled):
    sizes = {} if coupled else {"coupled_slices": False}
    given = level() if coupled else None
    one, other = (mesh_of(widths, support=given, **sizes) for widths in (UNEVEN, UNEVEN[::-1]))
    here = jg.solve(one, TORQUE, pinion=jg.LeadSlope(20.0))
    there = jg.solve(other, TORQUE, pinion=jg.LeadSlope(-20.0))
    assert bool(here.converged.all()) and float(face_load_factor(here)) > 1.5
    np.testing.assert_allclose(there.line_load, np.asarray(here.line_load)[:, ::-1], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(there.transmission_error, here.transmission_error, rtol=1e-10)
    force = np.einsum("psx,s,px->x", here.line_load, one.slice_width, one.lever[:, 0])
    np.testing.assert_allclose(force, here.force, rtol=1e-10)


def test_factors_count_widths(mesh):
    cycle = jg.solve(mesh, TORQUE, pinion=jg.LeadSlope(20.0))
    load = np.asarray(cycle.line_load)
    pair, _, position = np.unravel_index(load.argmax(), load.shape)
    row = load[pair, :, position]
    mean = np.average(row, weights=UNEVEN)
    assert abs(mean / row.mean() - 1) > 0.02
    np.testing.assert_allclose(face_load_factor(cycle), row.max() / mean, rtol=1e-12)
    np.testing.assert_allclose(edge_load_factor(cycle), max(row[0], row[-1]) / mean, rtol=1e-12)
    # a slope removes nothing on the mean of the face, whatever the slices are
    assert abs(float(mean_removed_material(cycle))) < 1e-9


def test_plots_have_the_slices(mesh):
    cycle = jg.solve(mesh, TORQUE, pinion=jg.LeadSlope(20.0))
    fields = plot.pressure_map(cycle).collections[0].get_coordinates()
    np.testing.assert_allclose(fields[:, 0, 1], np.cumsum([0, *UNEVEN]) * 1.8 - 9.0, atol=1e-12)
    heaviest = float(face_load_factor(cycle))
    texts = [text.get_text() for text in plot.line_load(cycle).get_legend().get_texts()]
    assert any(text.endswith(f"K = {heaviest:.2f}") for text in texts)
    plt.close("all")


@pytest.mark.slow
def test_support_gives_way_under_the_forces_of_the_slices():
    """A parabola over the face, which three polynomials hold exactly."""
    given = Bent(pair_of(), Misalignment(direct=20.0))
    mesh, load = mesh_of(support=given), np.random.default_rng(0).uniform(size=(2, 6, 4))
    force = np.sum(np.asarray(mesh.lever) * load, axis=0) * np.asarray(mesh.slice_width)[:, None]
    under = jax.jit(lambda held, lever, load: held.support_deflection(mesh.slice_width, lever, list(load)))
    bent = under(mesh.coupling, mesh.lever, load)
    np.testing.assert_allclose(bent, given.influence(np.asarray(mesh.face_coordinate)) @ force, rtol=1e-12)
    np.testing.assert_allclose(mesh.support_gap, 20.0 / WIDTH * np.asarray(mesh.face_coordinate), rtol=1e-12)


@pytest.mark.slow
def test_gears_of_unequal_width(mesh):
    """A flush overhang is none; a wide pinion gathers the load beside what overhangs it, as over fine equal slices."""
    sizes = {"face_modes": 12}
    none = jg.solve(mesh_of(**sizes), TORQUE)
    traced = jax.jit(lambda width: jg.solve(mesh_of(pair=pair_of(width), **sizes), TORQUE).line_load)
    np.testing.assert_allclose(traced(WIDTH), none.line_load, rtol=1e-8, atol=1e-8)
    wide, fine = traced(30.0), jg.solve(mesh_of(None, 10, pair=pair_of(30.0), **sizes), TORQUE).line_load
    pooled = np.einsum("psx,st->ptx", fine, slice_basis(UNEVEN)) / np.sqrt(UNEVEN)[None, :, None]
    assert np.ptp(wide, axis=1).max() > 0.05 * wide.max()
    np.testing.assert_allclose(wide, pooled, atol=0.004 * wide.max())


@pytest.mark.slow
def test_peak_line_load_has_the_derivatives_of_central_differences():
    def peak(width, bore, slope, end):
        pair = jg.GearPair(
            jg.Gear(19, 3.0, face_width=width, bore_diameter=bore), jg.Gear(48, 3.0, face_width=24.0, bore_diameter=40)
        )
        flank = jg.LeadSlope(slope) + jg.EndRelief(end, 3.0)
        return jnp.max(jg.solve(mesh_of(pair=pair, slide_steps=0), 150.0, pinion=flank).line_load)

    at = [jnp.asarray(x) for x in (WIDTH, 20.0, 8.0, 6.0)]
    both = jax.jit(jax.value_and_grad(peak, argnums=(0, 1, 2, 3)))  # one program for the values too
    found = both(*at)[1]
    for place in range(4):
        ends = [[x + sign * 1e-3 * (i == place) for i, x in enumerate(at)] for sign in (1.0, -1.0)]
        central = (both(*ends[0])[0] - both(*ends[1])[0]) / 2e-3
        np.testing.assert_allclose(found[place], central, rtol=1e-5)


@pytest.mark.slow
def test_gradient_by_the_flank(mesh):
    def peak(amounts):
        cycle = jg.solve(mesh, TORQUE, pinion=jg.LeadSlope(amounts[0]) + jg.LeadCrowning(amounts[1]))
        return jnp.max(cycle.line_load) + jnp.sum(cycle.transmission_error)

    at, step = jnp.asarray([12.0, 4.0]), 1e-4
    both = jax.jit(jax.value_and_grad(peak))
    found = both(at)[1]
    for place in np.eye(2):
        central = (both(at + step * place)[0] - both(at - step * place)[0]) / (2 * step)
        np.testing.assert_allclose(found @ place, central, rtol=1e-6)


@pytest.mark.parametrize("parts", [end_relief_widths(80.0, 4.0, 15), (3, 1, 1, 16, 22, 8, 12, 6, 24, 16, 1, 18)])
def test_the_share_of_the_modes_is_positive_definite_beside_an_overhang(parts):
    """Wide slices beside narrow ones give way far less than the mean of all, which as a rest would not leave it so."""
    basis, width, chord = slice_basis(parts), 80.0, 4.0
    even = basis.T @ np.asarray(kernel_of(width, chord, sum(parts), (0.0, 8.0))) @ basis
    ends = basis.T @ np.asarray(face_ends(width, chord, sum(parts)))
    modes, share, rest = map(np.asarray, modes_of(even, 5, ends, parts))
    assert np.linalg.eigvalsh(share).min() > 0 and float(rest) > 0
    np.testing.assert_allclose(
        modes @ share @ modes.T + float(rest) * modes @ modes.T, _projected(even, modes), atol=1e-12
    )


def _projected(kernel, modes):
    onto = np.asarray(modes @ modes.T)
    return onto @ kernel @ onto


def test_widths_for_an_end_relief():
    """Slices end where the relief begins, the narrowest beside it; symmetric; few whole numbers."""
    for face, length, slices in ((18.0, 3.0, 11), (18.0, 2.5, 13), (60.0, 2.0, 11), (20.0, 20.0 / 3, 9)):
        widths = np.asarray(end_relief_widths(face, length, slices))
        ends = np.cumsum(widths) / widths.sum() * face
        assert len(widths) == slices and (widths == widths[::-1]).all() and widths.sum() <= 1024
        assert np.abs(ends - length).min() < 0.005 * length
        assert widths.min() == widths[2] == widths[3] and ends[2] - ends[1] == pytest.approx(length / 6, rel=0.01)
    assert end_relief_widths(18.0, 3.0) == (9, 6, 3, 3, 22, 22, 22, 3, 3, 6, 9)


@pytest.mark.slow
def test_end_relief_is_shown_by_few_unequal_slices():
    """The peak beside the relief over 24 equal slices, each as wide as the narrowest unequal one."""
    length = 4.5

    def factor(widths, slices=None):
        found = mesh_of(widths, slices, face_modes=5, slide_steps=0, positions=4)
        cycle = jg.solve(found, 150.0, pinion=jg.EndRelief(15.0, length))
        assert bool(cycle.converged.all())
        return np.asarray(face_load_factors(cycle))

    fine, equal, unequal = factor(None, 24), factor(None, 11), factor(end_relief_widths(WIDTH, length))
    assert np.abs(equal / fine - 1).max() > 0.09
    assert np.abs(unequal / fine - 1).max() < 0.025


REFUSED = [
    ({"slices": 3, "slice_widths": (1, 2)}, "slice_widths has 2 numbers, must have one for each of the slices = 3"),
    ({"slices": 2, "slice_widths": (1, 0)}, "slice_widths = 0 must be a whole number of at least 1"),
    ({"slices": 2, "slice_widths": (1, 1.5)}, "slice_widths = 1.5 must be a whole number"),
    ({"slices": 2, "slice_widths": 2}, "slice_widths = 2 must be a list of whole numbers"),
    ({"slices": 2, "slice_widths": (1000, 25)}, "slice_widths sum to 1025, must sum to at most 1024"),
]


@pytest.mark.parametrize(("sizes", "message"), REFUSED)
def test_widths_that_cannot_be_are_refused(sizes, message):
    with pytest.raises(ValueError, match=f"^Resolution: {message}") as error:
        jg.Resolution(**sizes)
    assert "\n" not in str(error.value)


def test_refusals(mesh):
    table = TabulatedSupport(mesh.pair, np.eye(6))
    with pytest.raises(ValueError, match="support is a TabulatedSupport, over slices of equal width, the mesh has"):
        mesh_of(support=table)
    with pytest.raises(ValueError, match="length = 7 mm must be greater than 0 mm and at most 6 mm"):
        end_relief_widths(18.0, 7.0)
    with pytest.raises(ValueError, match="slices = 8 must be a whole number of at least 9"):
        end_relief_widths(18.0, 3.0, 8)
    with pytest.raises(ValueError, match="length = 0.1 mm must be at least 0.10"):
        end_relief_widths(18.0, 0.1)
    with pytest.raises(ValueError, match="slices = 40 are too many for a relief of length = 6 mm"):
        end_relief_widths(18.0, 6.0, 40)


FILE = """
[pinion]
teeth = 19
module = 3.0
face_width = 18.0
bore_diameter = 24.0
[[pinion.modification]]
type = "end_relief"
amount = 10.0
length = 3.0
[wheel]
teeth = 48
module = 3.0
face_width = 18.0
[load]
torque = 50.0
[resolution]
"""


def test_design_file(tmp_path):
    path = tmp_path / "gears.toml"
    path.write_text(FILE + "slice_widths = [1, 2, 3, 2, 1]\n")
    size = load_design(path).resolution()
    assert size.slices == 5 and size.slice_widths == (1, 2, 3, 2, 1)
    for line, problem in (
        (
            "slices = 4\nslice_widths = [1, 2, 1]",
            r": slice_widths has 3 numbers, must have one for each of the slices = 4",
        ),
        ("slice_widths = [1, 0]", r"\.slice_widths\[1\]: 0 must be at least 1"),
        ("slice_widths = 3", r"\.slice_widths: must be a list"),
        ("slice_widths = [2]", r"\.slices: must be at least 2"),
    ):
        path.write_text(FILE + line + "\n")
        with pytest.raises(DesignFileError, match=f"resolution{problem}"):
            load_design(path)


def test_few_slices_over_an_end_relief_are_a_finding(mesh):
    """Parts of 1.8 mm: one slice and a half from either end; two slices from the positive one."""
    cycle = jg.solve(mesh, TORQUE)

    def shown(*relief):
        found = findings_of(cycle, pinion=jg.EndRelief(10.0, *relief))
        return [finding.value for finding in found if finding.key == "slices over the end relief"]

    assert shown(3.6) == [1.5] and shown(5.4) == [] and shown(1.8) == [1.0]
    assert shown(5.3, jg.Linear(), "positive") == [pytest.approx(1 + 3.5 / 3.6, abs=1e-6)]
