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
from jaxgear.contact.loaded_width import loaded_material
from jaxgear.contact.slide import slid_material
from jaxgear.optimize.problem import make_problem

TORQUE = 50.0
AMOUNT, LENGTH = 15.0, 1.2


def reliefs(amount=AMOUNT):
    return {"pinion": jg.TipRelief(amount, LENGTH), "wheel": jg.TipRelief(AMOUNT, LENGTH)}


def pair(bores=(20.0, 40.0)):
    return jg.GearPair(*(jg.Gear(z, 3.0, face_width=18.0, bore_diameter=bore) for z, bore in zip((19, 48), bores)))


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    compliance = jg.finite_element_compliance(pair(), "stress", cache=tmp_path_factory.mktemp("tables"))
    return jg.prepare(pair(), compliance=compliance, resolution=SLIDING)


@pytest.fixture(scope="module")
def cycle(mesh):
    return jg.solve(mesh, TORQUE, **reliefs())


def test_a_steep_relief_on_stub_teeth_is_that_of_the_reference(tmp_path):
    """Over the width of the full load the PPTE is 7 % too small."""
    case = cases.Case("L", "stress", 300.0, "linshort")
    gears = cases.gear_pair("L")
    compliance = jg.finite_element_compliance(gears, "stress", cache=tmp_path)
    mesh = jg.prepare(gears, compliance=compliance, resolution=jg.Resolution(positions=128, pairs=4))
    pinion, wheel = cases.modifications(case)
    found = jg.solve(mesh, case.torque, pinion=pinion, wheel=wheel)
    true = np.ptp(cases.reference(case).transmission_error)
    assert bool(found.converged.all())
    assert float(jg.peak_to_peak(found.transmission_error)) == pytest.approx(true, rel=0.02)


def test_contacts_are_as_wide_as_their_loads(mesh, cycle):
    """One pair that carries all meets what it does over the width of the full load, one without load its point."""
    default = jg.prepare(mesh.pair, resolution=mesh.resolution)
    found, wide, narrow = (
        np.asarray(removed_material(each, torque, **reliefs()).amount)
        for each, torque in ((mesh, TORQUE), (default, TORQUE), (default, 0.0))
    )
    share = np.asarray(cycle.pair_force / cycle.force)[:, None]
    alone, open_, between = share == 1, share == 0, (share > 0.1) & (share < 0.9)
    assert alone.any() and open_.any() and between.any()
    np.testing.assert_allclose(found[alone], wide[alone], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(found[open_], narrow[open_], rtol=1e-9, atol=1e-12)
    assert np.abs(found - wide)[between].max() > 0.02


def test_other_models_take_one_solution_over_the_width_of_the_full_load(mesh):
    """Nothing asks for loads, and the material is what it was."""
    default = jg.prepare(mesh.pair, resolution=mesh.resolution)
    task = jnp.asarray(TORQUE), *reliefs().values()

    def none(removed):
        raise AssertionError("a first contact solution")

    found = loaded_material(default, *task, none)
    expected = slid_material(default, *task)
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(expected)):
        np.testing.assert_array_equal(one, other)


def test_where_the_first_solution_failed_nothing_converges(mesh):
    task = jnp.asarray(TORQUE), *reliefs().values()
    residual = jnp.zeros(16).at[3].set(1.0).at[5].set(jnp.nan)
    found = loaded_material(mesh, *task, lambda removed: (jnp.full((2, 1, 16), 50.0), residual))
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

    return along(jnp.asarray([[AMOUNT, TORQUE], [AMOUNT, TORQUE], [0.0, TORQUE]]), jnp.eye(3, 2))


def test_derivatives_go_through_the_first_solution(mesh, batch):
    """Central differences of the whole chain; both modes."""
    point, step = (jnp.asarray(AMOUNT), jnp.asarray(TORQUE)), 1e-5
    weights = jnp.cos(jnp.arange(16.0))
    backward = jax.jit(jax.grad(lambda *at: weights @ error(mesh, *at), (0, 1)))(*point)
    for place, slope in enumerate(batch[1][:2]):
        low, high = (
            [value + sign * step * (number == place) for number, value in enumerate(point)] for sign in (-1, 1)
        )
        central = (error(mesh, *high) - error(mesh, *low)) / (2 * step)
        np.testing.assert_allclose(slope, central, rtol=1e-6, atol=1e-8)
        assert float(backward[place]) == pytest.approx(float(weights @ slope), rel=1e-9)


def test_batches_are_their_members(batch, cycle):
    whole, _, unmodified = batch[0]
    np.testing.assert_allclose(whole, cycle.transmission_error, rtol=1e-9)
    assert np.abs(whole - unmodified).max() > 0.1


@pytest.mark.slow
def test_slopes_of_a_linearization_are_those_of_the_curve(mesh):
    """One gradient of the contact serves all positions: widths depend on the loads at their own position alone."""
    problem = make_problem(
        lambda x: tuple(reliefs(x["amount"]).values()), {"amount": (10.0, 20.0)}, mesh=mesh, torque=TORQUE
    )
    (pieces,) = problem.linearize(jnp.asarray([0.5])).objectives
    slope = jax.jacfwd(lambda amount: error(mesh, amount, TORQUE))(15.0)
    np.testing.assert_allclose(pieces.slope[0, :, 0], 10 * slope, rtol=1e-8, atol=1e-10)


def test_every_slice_has_its_own_width(mesh):
    """Equal slices are one; where a crowning leaves a slice without load it meets the relief at its point."""
    sizes = replace(FACE, patch_nodes=SLIDING.patch_nodes, slide_steps=SLIDING.slide_steps)
    sliced = jg.prepare(mesh.pair, compliance=mesh.compliance, resolution=sizes)
    flat = jg.solve(sliced, TORQUE, **reliefs())
    np.testing.assert_allclose(flat.transmission_error, error(mesh, AMOUNT, TORQUE)[::2], rtol=1e-9)
    flanks = reliefs() | {"wheel": reliefs()["wheel"] + jg.LeadCrowning(60.0)}
    crowned = jg.solve(sliced, TORQUE, **flanks)
    assert bool(crowned.converged.all()) and not np.any(crowned.line_load[:, 0]) and np.any(crowned.line_load[:, 2])
    found, narrow = (removed_material(sliced, torque, **flanks).amount for torque in (TORQUE, 0.0))
    np.testing.assert_allclose(found[:, 0], narrow[:, 0], rtol=1e-9, atol=1e-12)
    assert np.abs(found[:, 2] - narrow[:, 2]).max() > 0.02


@pytest.mark.slow
def test_a_prescribed_error_makes_its_own_widths(mesh, cycle):
    """There and back, up to what a third solution would change; the derivative is that of all that is computed."""
    teeth = cycle.transmission_error - mesh.hub * cycle.force / mesh.pair.face_width

    def force(at):
        return jg.solve_at(mesh, at, torque=TORQUE, **reliefs()).force

    np.testing.assert_allclose(force(teeth), float(cycle.force), rtol=2e-4)
    slope = jax.jvp(force, (teeth,), (jnp.ones(16),))[1]
    central = (force(teeth + 1e-5) - force(teeth - 1e-5)) / 2e-5
    np.testing.assert_allclose(slope, central, rtol=1e-6)
    assert not np.any(force(jnp.full(16, -5.0)))
