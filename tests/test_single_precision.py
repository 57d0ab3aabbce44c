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


@pytest.mark.parametrize("mode", [jax.grad, pytest.param(jax.jacfwd, marks=pytest.mark.slow)])
def test_either_mode_is_that_of_double_precision(mesh, mode):
    """By amount and length of a relief, and by torque."""

    def derivatives(dtype, mode):
        given = jax.tree.map(lambda leaf: leaf.astype(dtype) if eqx.is_inexact_array(leaf) else leaf, mesh)

        def mean_error(x):
            cycle = jg.solve(given, x[2], pinion=jg.TipRelief(x[0], x[1]))
            value = jnp.mean(cycle.transmission_error)
            return value, (value, cycle.converged)

        slope, (value, converged) = mode(mean_error, has_aux=True)(jnp.asarray([7.0, 4.0, 50.0], dtype))
        assert value.dtype == slope.dtype == dtype and converged.all()
        return np.asarray(slope)

    np.testing.assert_allclose(derivatives("float32", mode), derivatives("float64", jax.jacfwd), rtol=1e-5)
