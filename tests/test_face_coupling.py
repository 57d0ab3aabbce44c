"""Coupled slices, and what holds the gears: kernel, contact problem, limits, symmetry, derivatives."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE, LINE
from contact_problems import coupled, influence, kernel_of, modes_of, random_problem, solved_in_20, stiffness_at
from gearboxes import two_stages

import jaxgear as jg
from jaxgear.compliance import face_kernel, few_modes
from jaxgear.contact.prescribed import solve_series
from jaxgear.contact.status import Status
from jaxgear.numerics import Body, ContactProblem, SliceCoupling
from jaxgear.optimize.refine import _with_positions
from jaxgear.optimize.verdict import verification
from jaxgear.shafts import Misalignment, RigidSupport, TabulatedSupport, support

WIDTH, CHORD = 18.0, 8.189371
SLICES, TORQUE = FACE.slices, 50.0
SLOPE = jg.LeadSlope(20.0)


def pair_of(width=WIDTH, bore=20.0):
    gears = jg.Gear(19, 3.0, face_width=width, bore_diameter=bore), jg.Gear(48, 3.0, face_width=width, bore_diameter=40)
    return jg.GearPair(*gears)


def mesh_of(given=None, pair=None, **sizes):
    return jg.prepare(pair_of() if pair is None else pair, resolution=replace(FACE, **sizes), support=given)


@pytest.fixture(scope="module")
def mesh():
    return mesh_of()


@pytest.fixture(scope="module")
def sloped(mesh):
    return jg.solve(mesh, TORQUE, pinion=SLOPE)


@pytest.fixture(scope="module")
def on_table(mesh):
    """The same gears on a support that gives way."""
    return mesh_of(table_of(mesh.pair))


def kernel(slices, width=WIDTH, chord=CHORD):
    return np.asarray(kernel_of(width, chord, slices))


def test_kernel_has_its_published_values():
    found = kernel(5)
    np.testing.assert_array_equal(kernel_of(18, CHORD, 5), found)
    expected = [
        [0.467862, 0.263222, 0.143675, 0.082932, 0.042309],
        [0.263222, 0.315249, 0.209815, 0.128782, 0.082932],
        [0.143675, 0.209815, 0.293020, 0.209815, 0.143675],
    ]
    np.testing.assert_allclose(found[:3], expected, atol=1e-6)
    np.testing.assert_allclose(np.linalg.eigvalsh(found), [0.049302, 0.089688, 0.197920, 0.522332, 1.0], atol=1e-6)


@pytest.mark.parametrize("width", [3.0, 18.0, 60.0])
@pytest.mark.parametrize("slices", [pytest.param(2, marks=pytest.mark.slow), 7, 24])
def test_kernel_is_a_stiffness_of_equal_rows(width, slices):
    found = kernel(slices, width)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(found, found.T, atol=1e-15)
    np.testing.assert_allclose(found, found[::-1, ::-1], atol=1e-14)
    values = np.linalg.eigvalsh(found)
    assert values[0] > 0 and values[-1] <= 1 + 1e-12


def test_no_load_deflects_the_face_more_than_an_even_one():
    """Up to 18 root chords; the ends of wider faces are softer than that, by little."""
    for chord in (2.7, 8.2, 13.0):
        for chords, most in ((0.5, 1.0), (7.0, 1.0), (18.0, 1.0), (40.0, 1.01)):
            values = np.linalg.eigvalsh(kernel(24, chords * chord, chord))
            assert 0 < values[0] and values[-1] <= most + 1e-12


def test_teeth_far_wider_than_thick_do_not_couple_and_thick_ones_are_rigid():
    np.testing.assert_allclose(kernel(5, 1e6), np.eye(5), atol=1e-4)
    np.testing.assert_allclose(kernel(5, 1e-3), np.full((5, 5), 0.2), atol=1e-4)


@pytest.mark.parametrize("width", [18.0, 60.0])
@pytest.mark.parametrize(
    ("slices", "count"),
    [(24, 5), *(pytest.param(*sizes, marks=pytest.mark.slow) for sizes in ((8, 3), (8, 5), (11, 3), (11, 5), (24, 3)))],
)
def test_few_modes_are_about_as_near_as_any(slices, width, count):
    """The rest replaced by one number cannot be nearer than that of the eigenvectors, but for the spectrum's tail."""
    whole = kernel(slices, width)
    modes, share, rest = map(np.asarray, modes_of(whole, count))
    found = rest * np.eye(slices) + modes @ share @ modes.T
    np.testing.assert_allclose(modes.T @ modes, np.eye(count), atol=1e-13)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, rtol=1e-12)
    assert np.linalg.eigvalsh(share)[0] > 0
    values, vectors = np.linalg.eigh(whole)
    others = values[:-count].mean()
    best = others * np.eye(slices) + (vectors[:, -count:] * (values[-count:] - others)) @ vectors[:, -count:].T
    assert np.linalg.norm(found - whole) < 1.05 * np.linalg.norm(best - whole)


def test_as_many_modes_as_slices_are_the_kernel():
    modes, share, rest = map(np.asarray, modes_of(kernel(6), 9))
    assert rest == 0
    np.testing.assert_allclose(modes @ share @ modes.T, kernel(6), atol=1e-14)


def test_few_modes_follow_width_and_chord():
    weight = np.random.default_rng(0).normal(size=(7, 7))

    @jax.jit
    @jax.value_and_grad
    def number(given):
        modes, share, rest = few_modes(face_kernel(*given, 7), 4)
        return jnp.sum(weight * (rest * jnp.eye(7) + modes @ share @ modes.T))

    at, step = np.asarray([WIDTH, CHORD]), 1e-4
    slopes = number(at)[1]
    for slope, way in zip(slopes, step * np.eye(2)):
        central = (number(at + way)[0] - number(at - way)[0]) / (2 * step)
        np.testing.assert_allclose(slope, central, rtol=1e-6)


def coupled_problem(seed, springs, slices, count, bends=0):
    """A random contact problem with its coupling, whose loads touch some of the slices only."""
    rng = np.random.default_rng(seed)
    shapes = held = None
    if bends:
        root = rng.normal(size=(bends, bends))
        shapes, held = np.linalg.qr(np.vander(np.linspace(-1, 1, slices), bends, increasing=True))[0], root @ root.T
        shapes[:, 0], held = slices**-0.5, jnp.asarray(0.01 * slices / WIDTH * held)
        shapes = jnp.asarray(shapes)
    problem = random_problem(seed, springs, slices, 6)
    modes, share, rest = modes_of(kernel(slices), count)
    bodies = (Body(problem.compliance[:, :, 0], share * slices / WIDTH, rest),)
    coupling = SliceCoupling(modes, bodies, support_modes=shapes, support=held)
    return coupled(problem, coupling, weight=jnp.full(slices, WIDTH / slices), load=jnp.asarray(2000.0))


def dense(problem):
    """Influence of every load on every deflection, shape (positions, springs, slices, springs, slices)."""
    c = problem.coupling
    found = np.moveaxis(influence(c, problem.weight), -1, 0)
    if c.support is not None:
        held = c.support_modes @ c.support @ c.support_modes.T * problem.weight[None]
        found = found + np.einsum("ix,jx,st->xisjt", problem.lever[:, 0], problem.lever[:, 0], held)
    return found


def assert_conditions(problem, approach, load, own, opening):
    """Deflections by the whole matrix in NumPy: no overlap, no pull, closed where loaded."""
    approach, load, lever = map(np.asarray, (approach, load, problem.lever))
    left = np.einsum("xisjt,jtx->isx", dense(problem), load) + np.asarray(problem.gap) - lever * approach
    total = left + np.asarray(own) * load
    scale = 1e-9 * np.abs(approach).max()
    assert (load >= 0).all() and 0.1 < (load > 0).mean() < 0.9
    np.testing.assert_allclose(total[load > 0], 0.0, atol=scale)
    assert total[load == 0].min() > -scale
    np.testing.assert_allclose(opening, left, atol=scale)


def carried(problem, load):
    """Force on the line of action at every position."""
    return np.einsum("ix,s,isx->x", problem.lever[:, 0], problem.weight, load)


own_deflection = jax.jit(lambda law, load: law.secant(jnp.maximum(load, 1e-9)))


@pytest.mark.parametrize("held", [False, True], ids=["rigid", "support"])
def test_solution_meets_the_conditions_of_the_dense_problem(mesh, on_table, held):
    """Of rough flanks that touch on some of the slices only."""
    prepared = on_table if held else mesh
    rough = np.random.default_rng(3).uniform(0.0, 30.0, (2, SLICES, 8))
    found = jg.contact.solve_removed(prepared, TORQUE, rough)
    assert bool(found.converged.all())
    problem = ContactProblem(
        prepared.own_structure,
        prepared.law,
        prepared.held(found.gap),
        prepared.lever,
        prepared.slice_width,
        found.force,
        coupling=prepared.coupling,
    )
    windup = prepared.hub * found.force / prepared.pair.face_width
    own = own_deflection(prepared.law, found.line_load)
    assert_conditions(problem, found.transmission_error - windup, found.line_load, own, found.opening)
    np.testing.assert_allclose(carried(problem, found.line_load), float(found.force), rtol=1e-10)


@pytest.mark.slow
def test_approach_of_a_load_brings_that_load_and_its_stiffness(on_table):
    found = jg.solve(on_table, TORQUE, pinion=SLOPE)
    windup = on_table.hub / on_table.pair.face_width
    at = found.transmission_error - windup * found.force
    again, more, less = (
        jg.contact.solve_at(on_table, at + step, torque=TORQUE, pinion=SLOPE) for step in (0.0, 1e-3, -1e-3)
    )
    np.testing.assert_allclose(again.line_load, found.line_load, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(again.tangent_stiffness, 1 / (1 / found.tangent_stiffness - windup), rtol=1e-8)
    np.testing.assert_allclose(again.tangent_stiffness, np.subtract(more.force, less.force) / 2e-3, rtol=1e-5)
    # and the approach of teeth and bodies together: the share of either is found
    removed = jg.contact.removed_material(on_table, TORQUE, pinion=SLOPE)
    series = solve_series(on_table, found.transmission_error, removed, jnp.zeros(()))
    assert bool(series.converged.all())
    np.testing.assert_allclose(series.force, np.full_like(at, found.force), rtol=1e-6)
    np.testing.assert_allclose(series.transmission_error, at, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("springs", "slices", "count", "bends"), [(2, 4, 4, 0), (3, 7, 3, 4)])
def test_random_problems_meet_the_conditions_of_the_dense_problem(springs, slices, count, bends):
    """Under a load, and at the approach that it brings."""
    given = coupled_problem(3, springs, slices, count, bends)
    found = solved_in_20(given)
    assert found.converged.all()
    load = np.asarray(found.line_load)
    assert_conditions(given, found.approach, load, given.law.secant(np.maximum(load, 1e-9)), found.opening)
    np.testing.assert_allclose(carried(given, load), 2000.0, rtol=1e-10)
    pressed = replace(given, load=None, approach=found.approach)
    again = solved_in_20(pressed)
    np.testing.assert_allclose(again.line_load, load, rtol=1e-8, atol=1e-8)
    step = 1e-4 * found.approach
    more, less = (solved_in_20(replace(pressed, approach=found.approach + x)) for x in (step, -step))
    np.testing.assert_allclose(stiffness_at(given, found), (more.load - less.load) / (2 * step), rtol=1e-5)


@pytest.mark.slow  # `test_mesh_cycle` compares them every time
def test_uniform_flanks_are_one_slice(mesh):
    """Rows of the kernel sum to one."""
    many, one = jg.solve(mesh, TORQUE), jg.solve(jg.prepare(mesh.pair, resolution=LINE), TORQUE)
    assert bool(many.converged.all())
    error, load, stiffness = (x[..., ::2] for x in (one.transmission_error, one.line_load, one.tangent_stiffness))
    np.testing.assert_allclose(many.transmission_error, error, rtol=1e-12)
    np.testing.assert_allclose(many.line_load, np.repeat(load, SLICES, axis=1), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(many.tangent_stiffness, stiffness, rtol=1e-9)


def test_slope_is_mirrored_and_loads_the_end_more_than_slices_of_their_own(mesh, sloped):
    other = jg.solve(mesh, TORQUE, pinion=jg.LeadSlope(-20.0))
    np.testing.assert_allclose(other.line_load, sloped.line_load[:, ::-1], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(other.transmission_error, sloped.transmission_error, rtol=1e-10)
    body = mesh.coupling.bodies[0]._replace(share=1e-6 * jnp.eye(3), rest=jnp.ones(()))  # hardly any of the kernel
    own = replace(mesh.coupling, bodies=(body,))
    alone = jg.solve(replace(mesh, coupling=own), TORQUE, pinion=SLOPE)
    # three-dimensional finite elements: 292 instead of 241 N/mm
    assert 1.15 < float(sloped.line_load.max() / alone.line_load.max()) < 1.40


def test_without_coupling_nothing_of_it_is_there():
    for sizes in (replace(FACE, coupled_slices=False), LINE):
        off = eqx.filter_eval_shape(jg.prepare, pair_of(), resolution=sizes)
        assert off.coupling is None and not off.resolution.is_coupled


@pytest.mark.slow
def test_misalignment_is_a_slope_of_the_flank_and_no_support_is_none(mesh, sloped):
    """Beyond the path of contact a misalignment counts as an approach does, by the lever of the corner."""
    rigid = mesh_of(RigidSupport(mesh.pair, Misalignment(direct=20.0)))
    found = jg.solve(rigid, TORQUE)
    opened = 20.0 * np.asarray(mesh.face_coordinate)[:, None] / WIDTH
    same = jg.contact.solve_removed(mesh, TORQUE, np.asarray(mesh.lever) * opened[None])
    np.testing.assert_allclose(found.line_load, same.line_load, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(found.transmission_error, same.transmission_error, rtol=1e-10)
    np.testing.assert_allclose(found.transmission_error, sloped.transmission_error, rtol=1e-3)
    level = mesh_of(RigidSupport(mesh.pair))
    none, bare = jg.solve(level, TORQUE, pinion=SLOPE), sloped
    np.testing.assert_allclose(none.transmission_error, bare.transmission_error, rtol=1e-12)
    np.testing.assert_allclose(none.line_load, bare.line_load, rtol=1e-10, atol=1e-10)


def table_of(pair, scale=1e-3):
    """A support that tilts, bends and gives way as a whole [um/N]."""
    y = np.linspace(-1, 1, SLICES)
    matrix = scale * (2.0 + np.outer(y, y) + 0.3 * np.outer(y**2, y**2))
    return TabulatedSupport(pair, matrix, 3.0 * y + 2.0)


@pytest.mark.slow
def test_support_is_that_of_the_dense_matrix(mesh, on_table):
    """The constant part of the support is an approach of its own, what tilts levels the load."""
    given = on_table.support
    found = jg.solve(on_table, TORQUE, pinion=SLOPE)
    force = np.asarray(found.line_load) * np.asarray(mesh.slice_width)[None, :, None]
    bent = np.einsum("st,ix,itx->sx", given.matrix, mesh.lever[:, 0], force)
    removed = jg.contact.removed_material(mesh, TORQUE, pinion=SLOPE).amount
    # what the support has opened, taken as material removed of gears on rigid shafts
    lever = np.asarray(mesh.lever)
    own = bent + np.asarray(given.opening)[:, None]
    opened = removed + lever * own[None]
    again = jg.contact.solve_removed(mesh, TORQUE, opened)
    np.testing.assert_allclose(again.transmission_error, found.transmission_error, rtol=1e-8)
    np.testing.assert_allclose(again.line_load, found.line_load, rtol=1e-6, atol=1e-6)


def test_a_support_that_gives_way_as_a_whole_adds_to_the_transmission_error(mesh, sloped):
    flat = TabulatedSupport(mesh.pair, np.full((SLICES, SLICES), 2e-3), np.zeros(SLICES))
    unset = TabulatedSupport(mesh.pair, flat.matrix)
    np.testing.assert_array_equal(unset.gap(mesh.face_coordinate), flat.gap(mesh.face_coordinate))
    found = jg.solve(mesh_of(flat), TORQUE, pinion=SLOPE)
    np.testing.assert_allclose(
        found.transmission_error - sloped.transmission_error, 2e-3 * float(sloped.force), rtol=1e-9
    )
    np.testing.assert_allclose(found.line_load, sloped.line_load, rtol=1e-8, atol=1e-8)
    stiffness = 1 / (1 / sloped.tangent_stiffness + 2e-3)
    np.testing.assert_allclose(found.tangent_stiffness, stiffness, rtol=1e-8)


def test_pairs_that_are_not_there_give_way_with_the_others(mesh, sloped):
    """Gears on springs move hundreds of micrometres apart without a contact more than on rigid ones."""
    soft = TabulatedSupport(mesh.pair, np.full((SLICES, SLICES), 0.3), np.zeros(SLICES))
    found = jg.solve(mesh_of(soft), TORQUE, pinion=SLOPE)
    assert bool(found.converged.all()) and float(found.transmission_error.min()) > 500
    np.testing.assert_allclose(found.line_load, sloped.line_load, rtol=1e-6, atol=1e-6)


@pytest.mark.slow
def test_finer_and_verifying_meshes_stand_on_the_same_support(on_table):
    judged = verification(on_table, on_table.compliance)._mesh
    for other in (_with_positions(on_table, 4), judged):
        np.testing.assert_array_equal(other.support_gap, on_table.support_gap)
        np.testing.assert_array_equal(other.coupling.support, on_table.coupling.support)


@pytest.mark.slow
@pytest.mark.parametrize("derivative", [jax.jacfwd, jax.jacrev])
def test_no_load_leaves_finite_numbers_and_derivatives(mesh, derivative):
    found = jg.solve(mesh, 0.0, pinion=SLOPE)
    np.testing.assert_allclose(found.line_load, 0.0, atol=1e-6)
    slope = jax.jit(derivative(lambda t: jnp.mean(jg.solve(mesh, t, pinion=SLOPE).transmission_error)))
    assert np.isfinite(slope(0.0))
    more, less = (np.mean(jg.solve(mesh, TORQUE + step, pinion=SLOPE).transmission_error) for step in (1e-3, -1e-3))
    assert float(slope(TORQUE)) == pytest.approx(float(more - less) / 2e-3, rel=1e-6)


def peak(width, bore, slope, crowning, matrix):
    pair = pair_of(width, bore)
    given, flank = TabulatedSupport(pair, matrix), jg.LeadSlope(slope) + jg.LeadCrowning(crowning)
    cycle = jg.solve(mesh_of(given, pair), TORQUE, pinion=flank)
    return jnp.max(cycle.line_load)


@pytest.mark.slow
def test_peak_line_load_has_the_derivatives_of_central_differences():
    at = [jnp.asarray(x) for x in (WIDTH, 20.0, 12.0, 4.0)] + [table_of(pair_of()).matrix]
    both = jax.jit(jax.value_and_grad(peak, argnums=(0, 1, 2, 3, 4)))  # one program for the values too
    found = both(*at)[1]
    for place, step in enumerate((1e-3, 1e-3, 1e-3, 1e-3)):
        ends = [[x + sign * step * (i == place) for i, x in enumerate(at[:4])] + at[4:] for sign in (1.0, -1.0)]
        central = (both(*ends[0])[0] - both(*ends[1])[0]) / (2 * step)
        np.testing.assert_allclose(found[place], central, rtol=1e-5)
    way = np.zeros((SLICES, SLICES))
    way[0, 0], way[1, 0], way[0, 1] = 1.0, 0.5, 0.5
    central = (both(*at[:4], at[4] + 1e-6 * way)[0] - both(*at[:4], at[4] - 1e-6 * way)[0]) / 2e-6
    np.testing.assert_allclose(jnp.sum(found[4] * way), central, rtol=1e-5)


@pytest.mark.slow
def test_many_at_once_and_single_precision(mesh, sloped):
    slopes = jnp.asarray([-20.0, 0.0, 20.0])
    single = jax.tree.map(lambda leaf: leaf.astype("float32") if eqx.is_inexact_array(leaf) else leaf, mesh)
    found = jax.vmap(lambda slope: jg.solve(single, TORQUE, pinion=jg.LeadSlope(slope)))(slopes)
    assert bool(found.converged.all()) and found.line_load.dtype == jnp.float32
    expected = sloped.line_load[:, ::-1], jg.solve(mesh, TORQUE).line_load, sloped.line_load
    np.testing.assert_allclose(found.line_load, expected, rtol=2e-3, atol=0.05)


@pytest.mark.slow
def test_shafts_of_a_gearbox_hold_at_its_torque():
    """Two stages: the force that bends the shafts is the one that the contact finds."""
    held = support(two_stages(), 0)
    prepared = mesh_of(held, held.pair)
    found = jg.solve(prepared, held.torque)
    assert bool(found.converged.all())
    even = jg.solve(mesh_of(pair=held.pair), held.torque)
    assert found.line_load.max() > 1.02 * even.line_load.max()
    with pytest.raises(ValueError, match="torque = 80 N m, but the gearbox"):
        jg.solve(prepared, 80.0)
    with pytest.raises(ValueError, match="torque = 80 N m"):
        jg.contact.solve_at(prepared, 5.0, torque=80.0)
    with pytest.raises(ValueError, match="torque = 80 N m"):
        jg.minimize(jg.Problem(prepared, 80.0, lambda x: (jg.TipRelief(x["a"], 3.0), None), {"a": (0.0, 9.0)}))
    both = jax.vmap(lambda torque: jg.solve(prepared, torque).status)(jnp.stack([held.torque, 0.9 * held.torque]))
    assert not bool(both[0].any()) and bool((both[1] == Status.OUT_OF_VALIDITY).all())


def test_what_cannot_be_held_is_refused(mesh):
    level = RigidSupport(mesh.pair)
    with pytest.raises(ValueError, match="mesh of 1 slice"):
        mesh_of(level, slices=1)
    with pytest.raises(ValueError, match="coupled_slices=True"):
        mesh_of(level, coupled_slices=False)
    with pytest.raises(ValueError, match="another pair"):
        mesh_of(RigidSupport(pair_of(20.0)))
    with pytest.raises(TypeError, match="support is a str"):
        mesh_of("stiff")
    with pytest.raises(ValueError, match="matrix has 3 slices, the mesh has 6"):
        mesh_of(TabulatedSupport(mesh.pair, np.eye(3)))
    with pytest.raises(ValueError, match="symmetric"):
        TabulatedSupport(mesh.pair, [[1.0, 0.5], [0.0, 1.0]])
    with pytest.raises(ValueError, match="eigenvalue -1"):
        TabulatedSupport(mesh.pair, [[1.0, 2.0], [2.0, 1.0]])
    with pytest.raises(ValueError, match="2 x 3, must be square"):
        TabulatedSupport(mesh.pair, np.ones((2, 3)))
    with pytest.raises(ValueError, match="opening has 3 slices"):
        TabulatedSupport(mesh.pair, np.eye(2), np.zeros(3))
    with pytest.raises(ValueError, match="3 polynomials over the face miss .* of matrix, must miss at most 5%"):
        mesh_of(TabulatedSupport(mesh.pair, 1e-3 * np.eye(SLICES), np.zeros(SLICES)))
    with pytest.raises(ValueError, match="face_modes = 1"):
        jg.Resolution(face_modes=1)
    with pytest.raises(ValueError, match="coupled_slices"):
        jg.Resolution(coupled_slices=1.5)


@pytest.mark.slow
def test_finer_slices_and_all_modes_agree():
    flanks = jg.LeadCrowning(10.0) + SLOPE

    def factor(slices, **sizes):
        return np.asarray(
            jg.solve(mesh_of(slices=slices, **({"face_modes": 5} | sizes)), TORQUE, pinion=flanks).line_load
        )

    few, whole = factor(12), factor(12, face_modes=12)
    assert np.abs(few - whole).max() < 0.004 * whole.max()
    pooled = {n: factor(n).reshape(-1, 4, n // 4, FACE.positions).mean(axis=2) for n in (8, 24)}
    pooled[12] = few.reshape(-1, 4, 3, FACE.positions).mean(axis=2)
    for n in (8, 12):
        assert np.abs(pooled[n] - pooled[24]).max() < 0.02 * pooled[24].max()
