"""Functions whose value *and* derivative stay finite where the textbook form has 0/0 or an infinite slope.

All use the double `where`: the operand is replaced before the function is evaluated, then the result is selected, since
a single `where` still multiplies the unselected NaN into the gradient.
"""

import jax.numpy as jnp


def safe_divide(numerator, denominator, default=0.0):
    """numerator / denominator, and `default` with zero gradient where the denominator is zero."""
    ok = denominator != 0
    return jnp.where(ok, numerator / jnp.where(ok, denominator, jnp.ones_like(denominator)), default)


def safe_sqrt(x):
    """sqrt(x) for x > 0, else 0 with zero gradient."""
    ok = x > 0
    return jnp.where(ok, jnp.sqrt(jnp.where(ok, x, jnp.ones_like(x))), jnp.zeros_like(x))


def safe_log(x, default=0.0):
    """log(x) for x > 0, else `default` with zero gradient."""
    ok = x > 0
    return jnp.where(ok, jnp.log(jnp.where(ok, x, jnp.ones_like(x))), default)


def safe_power(x, exponent):
    """x**exponent for x > 0, else 0 with zero gradient (also with respect to the exponent)."""
    ok = x > 0
    return jnp.where(ok, jnp.where(ok, x, jnp.ones_like(x)) ** exponent, jnp.zeros_like(x))
