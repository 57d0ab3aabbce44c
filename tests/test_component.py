"""The component that larger models hold: its modifications are trained, its prepared arrays are not."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

import jaxgear as jg

AMOUNT, LENGTH, TORQUE = 3.0, 4.0, 50.0


@pytest.fixture(scope="module")
def model(mesh):
    relief = jg.TipRelief(AMOUNT, LENGTH)
    return jg.ModifiedMesh(mesh, pinion=relief, wheel=relief)


def ppte(model):
    return jg.peak_to_peak(model(TORQUE).transmission_error)


def test_it_is_the_mesh_with_its_modifications(model, mesh):
    cycle = jg.solve(mesh, TORQUE, pinion=model.pinion, wheel=model.wheel)
    np.testing.assert_array_equal(model(TORQUE).transmission_error, cycle.transmission_error)
    for ours, theirs in zip(jax.tree.leaves(model.mesh), jax.tree.leaves(mesh), strict=True):
        np.testing.assert_array_equal(ours, theirs)
        assert ours.dtype == theirs.dtype


def test_only_the_modifications_are_trainable(model):
    trainable = eqx.filter(model, eqx.is_inexact_array)
    assert sorted(float(leaf) for leaf in jax.tree.leaves(trainable)) == [AMOUNT, AMOUNT, LENGTH, LENGTH]


@pytest.mark.slow
def test_training_lowers_ppte_and_leaves_the_mesh_alone(model, mesh):
    """With weight decay, which reaches whatever counts as a parameter, gradient or not."""
    optimizer = optax.adamw(0.3, weight_decay=0.01)

    @eqx.filter_jit
    def step(model, state):
        value, slope = eqx.filter_value_and_grad(ppte)(model)
        updates, state = optimizer.update(slope, state, eqx.filter(model, eqx.is_inexact_array))
        return eqx.apply_updates(model, updates), state, value

    state, values = optimizer.init(eqx.filter(model, eqx.is_inexact_array)), []
    with jax.numpy_dtype_promotion("standard"):  # which optax needs
        for _ in range(12):
            model, state, value = step(model, state)
            values.append(float(value))
    assert np.isfinite(values).all() and values[-1] < 0.7 * values[0]
    for ours, theirs in zip(jax.tree.leaves(model.mesh), jax.tree.leaves(mesh), strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.slow
def test_gradients_are_those_of_the_modifications(model, mesh):
    slope = eqx.filter_jit(eqx.filter_grad(ppte))(model)

    def of_amount(amount):
        relief = jg.TipRelief(amount, LENGTH)
        return jg.peak_to_peak(jg.solve(mesh, TORQUE, pinion=relief, wheel=model.wheel).transmission_error)

    np.testing.assert_allclose(slope.pinion.amount, jax.grad(of_amount)(AMOUNT), rtol=1e-12)


def test_it_maps_over_designs(model):
    amounts = jnp.asarray([0.0, 3.0, 6.0])

    def one(amount):
        return ppte(eqx.tree_at(lambda m: m.pinion.amount, model, amount))

    together = jax.jit(jax.vmap(one))(amounts)
    np.testing.assert_allclose(together[1], ppte(model), rtol=1e-12)
    assert len(set(np.asarray(together).tolist())) == 3


def test_what_is_no_mesh_is_refused(mesh):
    with pytest.raises(TypeError, match="mesh is a GearPair, must be a Mesh: jaxgear.prepare makes one"):
        jg.ModifiedMesh(mesh.pair)
