"""Gears of unequal width, and faces that are set off along the axis: what overhangs the load helps to carry it."""

import csv
from dataclasses import replace
from functools import partial
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import LINE
from contact_problems import influence, kernel_of

import jaxgear as jg
from jaxgear.compliance import ElasticRing, face_ends, face_kernel, few_modes
from jaxgear.compliance.plane import plane_stress_share
from jaxgear.contact.mesh import prepare_from
from jaxgear.geometry import outline
from jaxgear.layout import FlankLine
from jaxgear.metrics import face_load_factor
from jaxgear.shafts import RigidSupport, annex_e

REFERENCE = Path(__file__).parent.parent / "benchmarks" / "reference" / "face_width.csv"
CHORD, TORQUE = 8.189371, 150.0


def pair_of(pinion=18.0, wheel=18.0, offset=0.0):
    gears = (
        jg.Gear(19, 3.0, face_width=pinion, bore_diameter=20.0),
        jg.Gear(48, 3.0, face_width=wheel, bore_diameter=40),
    )
    return jg.GearPair(*gears, axial_offset=offset)


# with as many modes as slices, by which both forms of the coupling are exact
SIZES = jg.Resolution(positions=4, slices=4, pairs=2, contact_nodes=1)


def mesh_of(pair, slices=4):
    return jg.prepare(pair, resolution=replace(SIZES, slices=slices))


def overhanging(pair):
    """The mesh that carries overhangs along also where they are 0."""
    return prepare_from(np.zeros(()), pair, jg.default_compliance(), SIZES, None, False)


def solved(mesh, slope=0.0, crowning=0.0, on_wheel=0.0):
    """Slope and crowning are the pinion's, `on_wheel` is the crowning of the wheel."""
    pinion = jg.LeadSlope(slope) + jg.LeadCrowning(crowning)
    return jg.solve(mesh, TORQUE, pinion=pinion, wheel=jg.LeadCrowning(on_wheel))


def contact(pinion=18.0, wheel=18.0, offset=0.0, **amounts):
    """Mean transmission error, line loads, whether they converged, and K_Hbeta, with what overhangs carried along."""
    cycle = solved(overhanging(pair_of(pinion, wheel, offset)), **amounts)
    line_load, factor = np.asarray(cycle.line_load), float(face_load_factor(cycle))
    return float(np.mean(cycle.transmission_error)), line_load, np.asarray(cycle.converged), factor


@partial(jax.jit, static_argnums=1)
def kernels_of(width, slices, overhangs):
    """Of both gears, over their means as a mesh has them, and these means."""
    both = jnp.stack([face_kernel(width, CHORD, slices, each) for each in overhangs])
    shares = jnp.mean(jnp.sum(both, axis=2), axis=1)
    return both / shares[:, None, None], shares


@partial(jax.jit, static_argnums=2)
def by_few(kernels, width, count=5):
    """The kernels that few modes make, the modes, and their shares."""
    slices = kernels.shape[-1]
    modes, share, rest = few_modes(kernels, count, face_ends(width, CHORD, slices))
    return rest[:, None, None] * jnp.eye(slices)[None] + modes @ share @ modes.T, modes, share


@pytest.mark.parametrize("finest", [8, pytest.param(16, marks=pytest.mark.slow)])
def test_kernel_of_a_wider_gear_is_a_part_of_its_whole_one(finest):
    """Slices over the whole face, of which the load covers some: the same up to the width of the slices."""
    errors = []
    for n in (finest // 2, finest):
        whole = np.asarray(kernel_of(30.0, CHORD, 5 * n))[n : 4 * n, n : 4 * n]
        part = np.asarray(kernel_of(18.0, CHORD, 3 * n, (6.0, 6.0)))
        errors.append(np.abs(part.sum(axis=1) - whole.sum(axis=1)).max())
        assert 3 * n * np.abs(part - whole).max() < 7e-3
    assert errors[1] < errors[0] / 3 < 6e-4 / 3 ** (finest // 16)


@pytest.mark.parametrize("overhang", [(0.0, 0.0), (3.0, 0.0), (0.0, 12.0), (100.0, 300.0)])
def test_kernel_of_a_wider_gear(overhang):
    """Symmetric and positive definite, mirrored with the overhangs, its mean that of one slice, less than without."""
    one, other = (np.asarray(kernel_of(18.0, CHORD, 9, given)) for given in (overhang, overhang[::-1]))
    np.testing.assert_allclose(one, one.T, atol=1e-15)
    np.testing.assert_allclose(one, other[::-1, ::-1], atol=1e-14)
    assert np.linalg.eigvalsh(one)[0] > 0.9 * np.linalg.eigvalsh(np.asarray(kernel_of(18.0, CHORD, 9)))[0]
    mean = float(kernel_of(18.0, CHORD, 1, overhang)[0, 0])
    assert one.sum() / 9 == pytest.approx(mean, rel=1e-12)
    assert mean == pytest.approx(1.0, abs=1e-12) if overhang == (0.0, 0.0) else mean < 0.95


def test_overhang_against_three_dimensional_finite_elements():
    """A pinion 24 mm wide under a load over its central 18 mm at the pitch point, wind-up included: 0.02521 um mm/N by
    three-dimensional elements, 0.02512 by this form of their two-dimensional compliances; 0.03179 without overhang."""
    with REFERENCE.open(newline="") as file:
        row = next(row for row in csv.DictReader(file) if row["teeth"] == "19" and row["roll_angle"] == "0.364")
    strain, stress = float(row["centre_strain"]), float(row["centre_stress"])
    tooth = outline(pair_of().pinion)
    hub = float(ElasticRing().hub(tooth))

    def compliance(width, overhang):
        structure = strain + float(plane_stress_share(tooth, jnp.asarray(width))) * (stress - strain) - hub
        share = float(kernel_of(18.0, tooth.root_chord, 1, (overhang, overhang))[0, 0])
        return structure * share + hub * 18.0 / width

    assert compliance(18.0, 0.0) == pytest.approx(0.03179, abs=1e-5)
    assert compliance(24.0, 3.0) == pytest.approx(0.02512, abs=1e-5)


def test_common_face():
    pair = pair_of(30.0, 20.0, 8.0)  # from -15 to 15 and from -2 to 18
    assert float(pair.face_width) == 17.0 and float(pair.face_overlap) == 17.0
    np.testing.assert_allclose(pair.face_middles, [6.5, -1.5])
    np.testing.assert_allclose(pair.overhangs, [[13.0, 0.0], [0.0, 3.0]], atol=1e-14)
    mesh = mesh_of(pair)
    np.testing.assert_allclose(mesh.slice_width, 4.25)
    np.testing.assert_allclose(mesh.face_coordinate, 4.25 * (np.arange(4) - 1.5), atol=1e-14)
    inside = pair_of(30.0, 20.0, 5.0)
    np.testing.assert_allclose(inside.overhangs, [[10.0, 0.0], [0.0, 0.0]], atol=1e-14)
    assert float(inside.face_width) == 20.0


def test_equal_faces_are_the_limit():
    """The form for two gears, at equal widths, is that for one, and adds nothing to the structure."""
    mesh = mesh_of(pair_of())
    one, both = (
        {jax.tree_util.keystr(path): np.asarray(leaf) for path, leaf in jax.tree_util.tree_leaves_with_path(each)}
        for each in (mesh, overhanging(pair_of()))
    )
    bodies = [{name for name in each if ".bodies" in name} for each in (one, both)]
    assert len(bodies[1]) == 2 * len(bodies[0]) and one.keys() - bodies[0] == both.keys() - bodies[1]
    for name in one.keys() - bodies[0]:
        np.testing.assert_allclose(both[name], one[name], rtol=1e-10, atol=1e-14, err_msg=name)
    of_one, of_both = (influence(each.coupling, mesh.slice_width) for each in (mesh, overhanging(pair_of())))
    np.testing.assert_allclose(of_both, of_one, rtol=1e-10, atol=1e-14)
    limit = mesh_of(pair_of(18.0 + 1e-9))
    assert mesh.even and not limit.even
    np.testing.assert_allclose(limit.structure, mesh.structure, rtol=1e-9)


@pytest.mark.slow
def test_contacts_of_equal_faces_are_the_limit():
    """As `test_equal_faces_are_the_limit`, of what the contact makes of both forms."""
    even = solved(mesh_of(pair_of()), slope=20.0)
    mean, load, *_ = contact(slope=20.0)
    assert mean == pytest.approx(float(np.mean(even.transmission_error)), rel=1e-10)
    np.testing.assert_allclose(load, even.line_load, atol=1e-7)


@pytest.mark.slow
def test_equal_faces_are_the_limit_of_one_slice():
    one, limit = (np.asarray(mesh_of(pair_of(width), 1).structure) for width in (18.0, 18.0 + 1e-9))
    np.testing.assert_allclose(limit, one, rtol=1e-9)


def test_wider_gears_are_stiffer_and_carry_more_at_the_ends():
    error, load, converged, factor = contact()
    np.testing.assert_allclose(load, np.repeat(load[:, :1], 4, axis=1), rtol=1e-9)
    assert factor == pytest.approx(1.0, abs=1e-9)
    for widths in ((24.0, 18.0), (18.0, 24.0), (24.0, 18.0, -3.0)):
        wider, ends, fine, uneven = contact(*widths)
        assert (fine & converged).all() and 0.85 * error < wider < 0.97 * error
        more = ends.sum(axis=0) / load.sum(axis=0)
        assert more.max() == more[[0, -1]].max() > 1.04
        worst = np.unravel_index(np.argmax(ends), ends.shape)
        assert uneven == pytest.approx(ends[worst] / ends[worst[0], :, worst[2]].mean(), rel=1e-9)
    # what is far away does not count
    assert contact(1000.0, 18.0)[0] == pytest.approx(contact(1001.0, 18.0)[0], rel=2e-4)


def test_offset_is_mirrored():
    right, left = (contact(24.0, 20.0, offset) for offset in (5.0, -5.0))
    assert right[0] == pytest.approx(left[0], rel=1e-9)
    np.testing.assert_allclose(right[1], left[1][:, ::-1], rtol=1e-6)


@pytest.mark.slow
def test_gradient_over_widths_and_offset():
    """Against central differences; of one slice `test_plane_state` does it every time."""
    widths = jnp.asarray([25.0, 20.0, 4.0])

    @jax.jit
    def mean_error(widths):
        return jnp.mean(solved(mesh_of(pair_of(*widths)), crowning=8.0).transmission_error)

    slope = jax.jit(lambda at, direction: jax.jvp(mean_error, (at,), (direction,))[1])
    for direction in jnp.eye(3):
        central = (mean_error(widths + 1e-4 * direction) - mean_error(widths - 1e-4 * direction)) / 2e-4
        assert float(slope(widths, direction)) == pytest.approx(float(central), rel=2e-6)
        # faces that are just equal have a kink: the mean of both sides
        even, step = jnp.asarray([18.0, 18.0, 0.0]), 1e-6 * direction
        central = (mean_error(even + step) - mean_error(even - step)) / 2e-6
        assert float(slope(even, direction)) == pytest.approx(float(central), abs=1e-3)


def test_modifications_count_over_the_face_of_their_gear():
    """Crowning of a wheel that is as wide as the common face, and the part of it that a wider pinion needs for it."""
    by_wheel, by_pinion = contact(24.0, 18.0, on_wheel=8.0), contact(24.0, 18.0, crowning=8.0 * (24.0 / 18.0) ** 2)
    np.testing.assert_allclose(by_wheel[1], by_pinion[1], rtol=1e-7)
    # of an offset gear the middle is elsewhere, and a relief at the end that overhangs the mate misses the contact
    mesh = mesh_of(pair_of(24.0, 18.0, 3.0))
    y, (pinion, wheel) = np.asarray(mesh.face_coordinate)[:, None], mesh.flanks()
    np.testing.assert_allclose(jg.LeadCrowning(8.0)(pinion)[0], 8.0 * ((y + 3.0) / 12.0) ** 2, rtol=1e-12)
    np.testing.assert_allclose(jg.LeadSlope(8.0)(wheel)[0], 8.0 * y / 18.0, rtol=1e-12)
    ends = {side: np.asarray(jg.EndRelief(15.0, 5.9, side=side)(pinion)) for side in ("negative", "positive")}
    assert not ends["negative"].any() and ends["positive"][:, -1].min() > 8


def test_flank_line_of_the_gap_on_either_gear():
    """Over the common face one line of slope and crowning is the same gap on a gear of any width and offset."""
    pair, line = pair_of(30.0, 20.0, 8.0), FlankLine(12.0, 5.0)
    found = []
    for gear in ("pinion", "wheel"):
        both = {name: line if name == gear else FlankLine(0.0, 0.0) for name in ("pinion", "wheel")}
        on = {name: given.on(pair, name).modification for name, given in both.items()}
        found.append(annex_e(RigidSupport(pair), torque=TORQUE, stations=11, **on))
    np.testing.assert_allclose(found[0].line_load, found[1].line_load, rtol=1e-9)
    share, gap = np.asarray(found[0].face_coordinate) / float(pair.face_width), np.asarray(found[0].gap)
    expected = 12.0 * share + 5.0 * (2 * share) ** 2
    np.testing.assert_allclose(gap - gap[5], expected - expected[5], atol=1e-9)


def test_faces_that_do_not_overlap_are_refused():
    with pytest.raises(ValueError, match=r"^GearPair: axial_offset = -19 mm must be greater than -18 mm and") as error:
        pair_of(18.0, 18.0, -19.0)
    assert "\n" not in str(error.value)
    # traced numbers pass: the margin tells, and how to find back
    overlap = jax.jit(jax.value_and_grad(lambda offset: jg.margins(pair_of(offset=offset)).face_overlap))
    np.testing.assert_allclose(overlap(19.0), (-1.0, -1.0))
    apart = eqx.tree_at(lambda pair: pair.axial_offset, pair_of(), jnp.asarray(19.0, float))
    assert not np.any(solved(overhanging(apart)).converged)


@pytest.mark.parametrize("width", [6.0, 18.0, 60.0, 200.0])
@pytest.mark.parametrize("slices", [pytest.param(9, marks=pytest.mark.slow), 24])
def test_few_modes_are_exact_on_an_even_load(width, slices):
    """Whatever overhangs, rows of the kernel sum to a constant and shapes that decay from the ends."""
    for overhangs in (((0.0, 0.0), (0.0, 0.0)), ((6.0, 0.0), (0.0, 0.0)), ((20.0, 5.0), (0.0, 7.0))):
        kernels, _ = kernels_of(width, slices, overhangs)
        found, modes, share = by_few(kernels, width)
        assert modes.shape == (slices, 7)
        np.testing.assert_allclose(modes.T @ modes, np.eye(7), atol=1e-11)
        np.testing.assert_allclose(found.sum(axis=2), kernels.sum(axis=2), rtol=1e-11)
        assert np.linalg.eigvalsh(share).min() > 0


@pytest.mark.parametrize(
    "width, overhangs, even, others",
    [(18.0, ((6.0, 0.0), (0.0, 0.0)), 5e-4, 2e-3), (60.0, ((10.0, 5.0), (0.0, 0.0)), 3e-3, 1.2e-2)],
)
def test_line_loads_by_few_modes_are_those_by_all(width, overhangs, even, others):
    """Of two bodies with springs between them: an even approach, a slope and crowning, over the largest line load."""
    slices, load = 24, 150.0
    kernels, shares = kernels_of(width, slices, overhangs)
    place = (np.arange(slices) + 0.5) / slices - 0.5

    def loads(kernels, gap):  # of a typical pair [um mm/N]: each gear 0.025, Hertzian contact 0.02; all touch
        matrix = np.einsum("g,gst->st", 0.025 * np.asarray(shares), kernels) + 0.02 * np.eye(slices)
        unit, bent = np.linalg.solve(matrix, np.stack([np.ones(slices), gap], axis=1)).T
        return unit * (load * slices + bent.sum()) / unit.sum() - bent

    for gap, most in ((0 * place, even), (8 * place, others), (16 * place**2, others)):
        whole, few = loads(np.asarray(kernels), gap), loads(np.asarray(by_few(kernels, width)[0]), gap)
        assert whole.min() > 0 and np.ptp(whole) > 0.02 * load
        assert np.abs(few - whole).max() < most * whole.max()


@pytest.mark.slow
def test_few_modes_of_flush_ends_have_derivatives():
    weight = np.random.default_rng(0).normal(size=(2, 9, 9))

    @jax.jit
    @partial(jax.value_and_grad, argnums=(0, 1))
    def number(width, overhang):
        kernels, _ = kernels_of(width, 9, ((overhang, 0.0), (0.0, overhang)))
        return jnp.sum(weight * by_few(kernels, width)[0])

    slopes = number(18.0, 0.0)[1]
    for index, step in ((0, 1e-4), (1, 1e-5)):
        ends = [number(*(x + sign * step * (i == index) for i, x in enumerate((18.0, 0.0))))[0] for sign in (1, -1)]
        np.testing.assert_allclose(slopes[index], (ends[0] - ends[1]) / (2 * step), rtol=1e-5)


@pytest.mark.slow
def test_models_of_two_dimensions_know_no_overhang():
    """In one plane a wider pinion is the same pinion: references in two dimensions have one width."""

    compliance = jg.default_compliance(plane="strain")
    wide, same = (jg.prepare(pair_of(width), compliance=compliance, resolution=SIZES) for width in (24.0, 18.0))
    for of in ("structure", "law", "hub", "lever", "corner_gap", "slice_width", "width_factor", "coupling"):
        one, other = (jax.tree.leaves(getattr(mesh, of)) for mesh in (wide, same))
        assert len(one) == len(other) > 0
        for each in zip(one, other):
            np.testing.assert_allclose(*each, rtol=1e-12, atol=1e-14, err_msg=of)


@pytest.mark.slow
def test_contacts_of_models_of_two_dimensions_know_no_overhang():
    compliance = jg.default_compliance(plane="strain")
    wide, same = (jg.prepare(pair_of(width), compliance=compliance, resolution=SIZES) for width in (24.0, 18.0))
    np.testing.assert_allclose(solved(wide).transmission_error, solved(same).transmission_error, rtol=1e-12)


@pytest.mark.slow
def test_one_slice_knows_what_overhangs_it_in_three_dimensions_only():
    def error(width, plane):
        mesh = jg.prepare(pair_of(pinion=width), compliance=jg.default_compliance(plane=plane), resolution=LINE)
        return np.asarray(jg.solve(mesh, TORQUE).transmission_error)

    np.testing.assert_allclose(error(24.0, "strain"), error(18.0, "strain"), rtol=1e-12)
    assert (error(24.0, "auto") < 0.95 * error(18.0, "auto")).all()
