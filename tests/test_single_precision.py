"""JAX's own default: values and derivatives in single precision are those in double, in both modes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue import SLIDING, gear_pair

import jaxgear as jg


@pytest.fixture(scope="module")
def mesh():
    """Contacts that slide, beyond the path of contact too, where tip corners cut them off."""
    return jg.prepare(gear_pair(), resolution=SLIDING)


AT = 7.0, 4.0, 50.0  # amount and length of a relief, and torque


def mean_error_of(mesh, dtype):
    """Mean transmission error over `AT`, with itself and what has converged."""
    given = jax.tree.map(lambda leaf: leaf.astype(dtype) if eqx.is_inexact_array(leaf) else leaf, mesh)

    def mean_error(x):
        cycle = jg.solve(given, x[2], pinion=jg.TipRelief(x[0], x[1]))
        value = jnp.mean(cycle.transmission_error)
        return value, (value, cycle.converged)

    return mean_error


def derivatives(mesh, dtype, mode):
    slope, (value, converged) = mode(mean_error_of(mesh, dtype), has_aux=True)(jnp.asarray(AT, dtype))
    assert value.dtype == slope.dtype == dtype and converged.all()
    return np.asarray(slope)


@pytest.mark.parametrize("mode", [jax.grad, pytest.param(jax.jacfwd, marks=pytest.mark.slow)])
def test_either_mode_is_that_of_double_precision(mesh, mode):
    """By central differences in double precision, whose program others have as well."""
    value, at, step = mean_error_of(mesh, "float64"), jnp.asarray(AT), 1e-3
    central = [float(value(at + way)[0] - value(at - way)[0]) / (2 * step) for way in step * jnp.eye(3)]
    np.testing.assert_allclose(derivatives(mesh, "float32", mode), central, rtol=1e-5)


@pytest.mark.slow
def test_either_mode_is_exactly_that_of_double_precision(mesh):
    exact = derivatives(mesh, "float64", jax.jacfwd)
    np.testing.assert_allclose(derivatives(mesh, "float32", jax.grad), exact, rtol=1e-5)
    np.testing.assert_allclose(derivatives(mesh, "float32", jax.jacfwd), exact, rtol=1e-5)
