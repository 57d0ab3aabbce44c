"""JAX's own default: values and derivatives in single precision are those in double."""

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


def test_reverse_mode_is_that_of_double_precision(mesh):
    """By amount and length of a relief, and by torque."""

    def derivatives(dtype):
        given = jax.tree.map(lambda leaf: leaf.astype(dtype) if eqx.is_inexact_array(leaf) else leaf, mesh)

        def mean_error(x):
            cycle = jg.solve(given, x[2], pinion=jg.TipRelief(x[0], x[1]))
            return jnp.mean(cycle.transmission_error), cycle.converged

        (value, converged), slope = jax.value_and_grad(mean_error, has_aux=True)(jnp.asarray([7.0, 4.0, 50.0], dtype))
        assert value.dtype == slope.dtype == dtype and converged.all()
        return np.asarray(slope)

    np.testing.assert_allclose(derivatives("float32"), derivatives("float64"), rtol=1e-5)
