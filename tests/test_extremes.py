"""Largest and smallest entries: values, derivatives of the first of equal entries, and NaN that is never dropped."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import gear_pair

import jaxgear as jg
from jaxgear.numerics import maximum, minimum, spread

extremes = jax.jit(lambda x, axis=None: [of(x, axis) for of in (maximum, minimum, spread)], static_argnums=1)


@pytest.mark.parametrize("axis", [None, 0, -1, (0, 1), (0, 2), (1, 2), (0, 1, 2), ()])
def test_values_are_those_of_numpy(axis):
    x = np.random.default_rng(0).normal(size=(3, 4, 5))
    expected = np.max(x, axis), np.min(x, axis), np.max(x, axis) - np.min(x, axis)
    for found, wanted in zip(extremes(x, axis), expected):
        np.testing.assert_array_equal(found, wanted)


def test_derivative_is_that_of_the_first_of_equal_entries():
    x = jnp.asarray([[1.0, 3.0, 3.0], [2.0, 2.0, 2.0]])
    largest = jax.jit(jax.jacrev(lambda x: maximum(x, -1)))(x)
    np.testing.assert_array_equal(largest, [[[0, 1, 0], [0, 0, 0]], [[0, 0, 0], [1, 0, 0]]])
    np.testing.assert_array_equal(largest, jax.jit(jax.jacfwd(lambda x: maximum(x, -1)))(x))
    assert not np.any(jax.jit(jax.grad(spread))(np.full(7, 2.0)))


def test_second_derivatives_and_batches():
    """max over k of k a^2 - a^3, k = 1 ... 3: at a = 2 it is 3 a^2 - a^3 with the second derivative 6 - 6 a."""
    f = lambda a: maximum(jnp.arange(1.0, 4.0) * a**2 - a**3)  # noqa: E731
    a = np.array([2.0, 0.5])
    np.testing.assert_allclose(jax.jit(jax.vmap(jax.hessian(f)))(a), 6 - 6 * a, rtol=1e-14)
    np.testing.assert_allclose(jax.jit(jax.vmap(jax.jacfwd(jax.jacrev(f))))(a), 6 - 6 * a, rtol=1e-14)


def test_nan_is_passed_on_however_large_the_array():
    x = np.where(np.arange(40_000) == 17, np.nan, 0.0)
    assert np.isnan(extremes(x)).all(), "the reductions of the CPU drop NaN from 4096 entries on"
    assert not np.isnan(extremes(np.stack([x[:17], x[18:35]]))).any(), "NaN that is not among the entries does no harm"


@pytest.mark.slow
def test_derivatives_of_several_metrics_of_sliced_contact_are_those_of_each():
    """Compiled together, the smallest opening over the slices is evaluated twice, with other rounding each time,
    by the optimizing compiler: the slow tests run with it."""
    mesh = jg.prepare(gear_pair(), resolution=jg.Resolution(positions=16, pairs=2, slices=2))

    def metrics(x):
        relief = jg.TipRelief(x[0], x[1], jg.Parabolic())
        cycle = jg.solve(mesh, 50.0, pinion=relief + jg.LeadCrowning(x[2]), wheel=relief)
        return jnp.stack([jg.peak_to_peak(cycle.transmission_error), jg.effective_contact_ratio(cycle)])

    x = jnp.asarray([6.9, 3.4, 5.0])
    reverse, forward = jax.jit(jax.jacrev(metrics))(x), jax.jit(jax.jacfwd(metrics))(x)
    assert np.all(np.isfinite(reverse))
    np.testing.assert_allclose(reverse, forward, rtol=1e-8, atol=1e-10)
