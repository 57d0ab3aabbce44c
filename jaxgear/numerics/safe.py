"""Functions whose value *and* derivative stay finite where the textbook form has 0/0 or an infinite slope.

All use the double `where`: the operand is replaced before the function is evaluated, then the result is selected, since
a single `where` still multiplies the unselected NaN into the gradient.

On CPUs XLA turns `jnp.log` of float64 into one library call per element, three times slower than the few
multiplications that follow here: x = 2^k m with m near 1, and ln m = 2 artanh((m - 1) / (m + 1)) as a series.

References:
    fdlibm, e_log.c (Sun Microsystems 1993), for the coefficients: error below 2^-58 on [sqrt(1/2), sqrt(2)].

XLA on CPUs fuses whatever is cheaper than a division into every reader. What ends with a division it stores, unless the
divisor is the same for a whole batch: then it multiplies by the inverse.
"""

from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .conversion import Given

Real = Float[Array, "..."]


def safe_divide(numerator: Given, denominator: Given, default: Given = 0.0) -> Real:
    """numerator / denominator, and `default` with zero gradient where the denominator is zero."""
    ok = denominator != 0
    return jnp.where(ok, numerator / jnp.where(ok, denominator, jnp.ones_like(denominator)), default)


def safe_sqrt(x: Given) -> Real:
    """sqrt(x) for x > 0, else 0 with zero gradient."""
    ok = x > 0
    return jnp.where(ok, jnp.sqrt(jnp.where(ok, x, jnp.ones_like(x))), jnp.zeros_like(x))


def safe_power(x: Given, exponent: Given) -> Real:
    """x**exponent for x > 0, else 0 with zero gradient (also with respect to the exponent)."""
    ok = x > 0
    return jnp.where(ok, jnp.where(ok, x, jnp.ones_like(x)) ** exponent, jnp.zeros_like(x))


_COEFFICIENTS = (
    6.666666666666735130e-01,
    3.999999999940941908e-01,
    2.857142874366239149e-01,
    2.222219843214978396e-01,
    1.818357216161805012e-01,
    1.531383769920937332e-01,
    1.479819860511658591e-01,
)
_MANTISSA_BITS = 52
_SQRT_HALF_BITS = 0x3FE6A09E667F3BCD  # of the float64 nearest to sqrt(1/2)


@jax.custom_jvp
def log(x: Real) -> Real:
    """Natural logarithm of positive normal numbers, elementwise; NaN for other inputs, infinity included."""
    value = _log_float64(x) if x.dtype == jnp.float64 else jnp.log(x)
    return jnp.where((x > 0) & (x < jnp.inf), value, jnp.nan)


@log.defjvp
def _log_jvp(primals, tangents):
    (x,), (x_dot,) = primals, tangents
    return log(x), x_dot / x


def _log_float64(x):
    bits = jax.lax.bitcast_convert_type(x, jnp.int64)
    exponent = jax.lax.shift_right_arithmetic(bits - np.int64(_SQRT_HALF_BITS), np.int64(_MANTISSA_BITS))
    mantissa_bits = bits - jax.lax.shift_left(exponent, np.int64(_MANTISSA_BITS))
    mantissa = jax.lax.bitcast_convert_type(mantissa_bits, jnp.float64)
    z = (mantissa - 1) / (mantissa + 1)
    squared = z * z
    series = jnp.full_like(x, _COEFFICIENTS[-1])
    for coefficient in reversed(_COEFFICIENTS[:-1]):
        series = series * squared + coefficient
    return exponent.astype(jnp.float64) * float(np.log(2.0)) + z * (2 + squared * series)


@jax.custom_jvp
def stored(x: Real) -> Real:
    """x, evaluated once; so are its tangents and cotangents."""
    return x / unit(x)


@stored.defjvp
def _stored_jvp(primals, tangents):
    (x,), (x_dot,) = primals, tangents
    return stored(x), x_dot / unit(x)


def unit(x: Given) -> Real:
    """Array of 1.0 that XLA cannot fold; NaN where x is NaN."""
    return jnp.where(x == x, 1.0, x)


@lru_cache
def gauss_legendre(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of the Gauss-Legendre rule of that order on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    return (nodes + 1) / 2, weights / 2
