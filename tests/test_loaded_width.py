"""Modifications averaged over the width that every contact gets from its own load, with finite-element structure."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import FACE, SLIDING

import jaxgear as jg
from benchmarks import cases
from jaxgear.contact import RemovedMaterial, removed_material
from jaxgear.contact.slide import loaded_material, slid_material

CASE = cases.Case("L", "stress", 300.0, "linshort")  # a steep relief on stub teeth
TORQUE, AMOUNT, LENGTH = CASE.torque, 15.0, 1.2


def reliefs(amount=AMOUNT):
    """Those of the case."""
    return {"pinion": jg.TipRelief(amount, LENGTH, jg.Linear()), "wheel": jg.TipRelief(AMOUNT, LENGTH, jg.Linear())}


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    pair = cases.gear_pair(CASE.pair)
    compliance = jg.finite_element_compliance(pair, "stress", cache=tmp_path_factory.mktemp("tables"))
    return jg.prepare(pair, compliance=compliance, resolution=SLIDING)


@pytest.fixture(scope="module")
def default(mesh):
    """The same mesh, of a model that averages over the width of the full load."""
    return replace(mesh, compliance=jg.default_compliance())


@pytest.fixture(scope="module")
def cycle(mesh):
    return jg.solve(mesh, TORQUE, **reliefs())


def test_a_steep_relief_on_stub_teeth_is_that_of_the_reference(cycle):
    """Over the width of the full load the PPTE is 7 % too small."""
    true = np.ptp(cases.reference(CASE).transmission_error[::4])
    assert bool(cycle.converged.all())
    assert np.ptp(cycle.transmission_error) == pytest.approx(true, rel=0.02)


@pytest.mark.slow
def test_a_steep_relief_on_stub_teeth_is_that_of_the_reference_at_every_position(mesh):
    fine = jg.prepare(mesh.pair, compliance=mesh.compliance, resolution=jg.Resolution(positions=128, pairs=4))
    pinion, wheel = cases.modifications(CASE)
    found = jg.solve(fine, TORQUE, pinion=pinion, wheel=wheel)
    true = np.ptp(cases.reference(CASE).transmission_error)
    assert bool(found.converged.all())
    assert float(jg.peak_to_peak(found.transmission_error)) == pytest.approx(true, rel=0.02)


# at the torque of the case one contact carries in the first solution only, which makes its width
@pytest.mark.parametrize("torque", [100.0, 150.0, 200.0])
def test_contacts_are_as_wide_as_their_loads(mesh, default, torque):
    """One pair that carries all meets what it does over the width of the full load, one without load its point."""
    cycle = jg.solve(mesh, torque, **reliefs())
    found, wide, narrow = (
        np.asarray(removed_material(each, load, **reliefs()).amount)
        for each, load in ((mesh, torque), (default, torque), (default, 0.0))
    )
    share = np.asarray(cycle.pair_force)[:, None] / float(cycle.force)
    alone, open_, between = share == 1, share == 0, (share > 0.1) & (share < 0.9)
    assert alone.any() and open_.any() and between.any()
    np.testing.assert_allclose(found[alone], wide[alone], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(found[open_], narrow[open_], rtol=1e-9, atol=1e-12)
    assert np.abs(found - wide)[between].max() > 0.02


def test_other_models_take_one_solution_over_the_width_of_the_full_load(default):
    """Nothing asks for loads, and the material is what it was."""
    task = jnp.asarray(TORQUE), *reliefs().values()

    def none(removed):
        raise AssertionError("a first contact solution")

    found = loaded_material(default, *task, none)
    expected = slid_material(default, *task)
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(expected)):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)  # by two programs


def test_where_the_first_solution_failed_nothing_converges(mesh, default):
    task = jnp.asarray(TORQUE), *reliefs().values()
    residual = np.zeros(16)
    residual[[3, 5]] = 1.0, np.nan
    given = jnp.full((2, 1, 16), 50.0), jnp.asarray(residual)
    met = []
    found = loaded_material(mesh, *task, lambda removed: (met.append(removed), given)[1])
    # what the first solution meets is over the width under the loads of unmodified flanks
    np.testing.assert_allclose(met[0].amount, slid_material(default, *task).amount, rtol=1e-12, atol=1e-12)
    assert isinstance(found, RemovedMaterial)
    np.testing.assert_array_equal(np.isnan(found.amount).all(axis=(0, 1)), np.isin(np.arange(16), (3, 5)))
    cycle = jg.contact.solve_removed(mesh, TORQUE, found)
    assert not cycle.converged[3] and not cycle.converged[5] and bool(cycle.converged[0])


def error(mesh, amount, torque):
    return jg.solve(mesh, torque, **reliefs(amount)).transmission_error


@pytest.fixture(scope="module")
def batch(mesh):
    """The curve and its derivatives by amount and by torque, and the curve without relief: one program."""

    @jax.jit
    @jax.vmap
    def along(at, way):
        return jax.jvp(lambda amount, torque: error(mesh, amount, torque), tuple(at), tuple(way))

    found = along(np.asarray([[AMOUNT, TORQUE], [AMOUNT, TORQUE], [0.0, TORQUE]]), np.eye(3, 2))
    return [np.asarray(part) for part in found]


@pytest.mark.slow
def test_derivatives_go_through_the_first_solution(mesh, batch):
    """Central differences of the whole chain."""
    point = AMOUNT, TORQUE
    for place, slope in enumerate(batch[1][:2]):
        step = 1e-6 * point[place]
        low, high = (
            [value + sign * step * (number == place) for number, value in enumerate(point)] for sign in (-1, 1)
        )
        central = np.subtract(error(mesh, *high), error(mesh, *low)) / (2 * step)
        np.testing.assert_allclose(slope, central, rtol=1e-6, atol=1e-8)


@pytest.mark.slow
def test_gradients_go_through_the_first_solution(mesh, batch):
    weights = np.cos(np.arange(16.0))
    backward = jax.jit(jax.grad(lambda *at: weights @ error(mesh, *at), (0, 1)))(AMOUNT, TORQUE)
    np.testing.assert_allclose(backward, batch[1][:2] @ weights, rtol=1e-9)


@pytest.mark.slow
def test_batches_are_their_members(batch, cycle):
    whole, _, unmodified = batch[0]
    np.testing.assert_allclose(whole, cycle.transmission_error, rtol=1e-9)
    assert np.abs(whole - unmodified).max() > 0.1


@pytest.mark.slow
def test_slopes_of_a_linearization_are_those_of_the_curve(mesh):
    """One gradient of the contact serves all positions: widths depend on the loads at their own position alone."""
    problem = jg.Problem(mesh, TORQUE, lambda x: tuple(reliefs(x["amount"]).values()), {"amount": (10.0, 20.0)})
    (pieces,) = problem.linearize(jnp.asarray([0.5])).objectives
    slope = jax.jacfwd(lambda amount: error(mesh, amount, TORQUE))(15.0)
    np.testing.assert_allclose(pieces.slope[0, :, 0], 10 * slope, rtol=1e-8, atol=1e-10)


def test_every_slice_has_its_own_width(mesh, cycle):
    """Equal slices are one; where a crowning leaves a slice without load it meets the relief at its point."""
    sizes = replace(mesh.resolution, slices=3, coupled_slices=False)
    width = jnp.full(3, float(mesh.pair.face_width) / 3)
    sliced = replace(mesh, kinematics=replace(mesh.kinematics, resolution=sizes), slice_width=width)

    def flanks(crowning):
        return reliefs() | {"wheel": reliefs()["wheel"] + jg.LeadCrowning(crowning)}

    flat, crowned = (jg.solve(sliced, TORQUE, **flanks(crowning)) for crowning in (0.0, 200.0))
    np.testing.assert_allclose(flat.transmission_error, cycle.transmission_error, rtol=1e-9)
    load = np.asarray(crowned.line_load)
    assert bool(crowned.converged.all()) and not load[:, 0].any() and load[:, 1].any()
    found, narrow = (np.asarray(removed_material(sliced, torque, **flanks(200.0)).amount) for torque in (TORQUE, 0.0))
    np.testing.assert_allclose(found[:, 0], narrow[:, 0], rtol=1e-9, atol=1e-12)
    assert np.abs(found[:, 1] - narrow[:, 1]).max() > 0.02


@pytest.mark.slow
def test_slices_that_feel_each_other_have_their_own_widths(mesh, cycle):
    sizes = replace(FACE, contact_nodes=SLIDING.contact_nodes, slide_steps=SLIDING.slide_steps)
    sliced = jg.prepare(mesh.pair, compliance=mesh.compliance, resolution=sizes)
    flat = jg.solve(sliced, TORQUE, **reliefs())
    np.testing.assert_allclose(flat.transmission_error, cycle.transmission_error[::2], rtol=1e-9)
    flanks = reliefs() | {"wheel": reliefs()["wheel"] + jg.LeadCrowning(200.0)}
    crowned = jg.solve(sliced, TORQUE, **flanks)
    assert bool(crowned.converged.all()) and not np.any(crowned.line_load[:, 0]) and np.any(crowned.line_load[:, 2])
    found, narrow = (removed_material(sliced, torque, **flanks).amount for torque in (TORQUE, 0.0))
    np.testing.assert_allclose(found[:, 0], narrow[:, 0], rtol=1e-9, atol=1e-12)
    assert np.abs(found[:, 2] - narrow[:, 2]).max() > 0.02


@pytest.mark.slow
def test_a_prescribed_error_makes_its_own_widths(mesh):
    """There and back, but where the first solutions under the load and at the error make other widths: at one position;
    the derivative is that of all that is computed."""
    torque = 50.0
    cycle = jg.solve(mesh, torque, **reliefs())
    teeth = cycle.transmission_error - mesh.hub * cycle.force / mesh.pair.face_width

    def force(at):
        return jg.solve_at(mesh, at, torque=torque, **reliefs()).force

    off = np.abs(force(teeth) / cycle.force - 1)
    assert off.max() < 5e-4 and np.sort(off)[-2] < 1e-9
    slope = jax.jvp(force, (teeth,), (jnp.ones(16),))[1]
    central = (force(teeth + 1e-5) - force(teeth - 1e-5)) / 2e-5
    np.testing.assert_allclose(slope, central, rtol=1e-6)
    assert not np.any(force(jnp.full(16, -5.0)))
