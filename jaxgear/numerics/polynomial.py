"""Real roots of polynomials."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Durand and Kerner's iteration doubles the digits of single roots, and halves the error of double ones.
_STEPS = 60
_POLISH = 3
# Roots are told from complex ones by so much of the precision: double roots have about half of its digits.
_DIGITS = 0.4


def real_roots(coefficients: Float[Array, " terms"]) -> Float[Array, " degree"]:
    """Real roots of a polynomial, smallest first and NaN where there are fewer than its degree, with derivatives.

    All complex roots are found at once (Durand, Kerner; I. O. Kerner, Numer. Math. 8, 1966), of the polynomial scaled
    by the bound of Fujiwara; Newton steps polish the real ones.

    Args:
        coefficients: from the constant one up; the last one is not zero.
    """
    fixed = jax.lax.stop_gradient(coefficients / coefficients[-1])
    degree, eps = len(coefficients) - 1, float(jnp.finfo(fixed.dtype).eps)
    power = np.arange(degree, 0, -1)
    bound = 2 * jnp.max(jnp.abs(fixed[:-1]) ** jnp.asarray(1 / power, fixed.dtype))
    scale = jnp.where(bound > 0, bound, 1.0)
    scaled = jnp.append(fixed[:-1] / scale ** jnp.asarray(power, fixed.dtype), 1.0)
    others = jnp.asarray(~np.eye(degree, dtype=bool))

    def improved(_, z):
        apart = jnp.where(others, z[:, None] - z[None], 1.0)
        product = jnp.prod(jnp.where(apart == 0, eps, apart), axis=1)
        return z - _value(jax.lax.complex(scaled, jnp.zeros_like(scaled)), z) / product

    # on a circle, none of them on the real axis or the conjugate of another
    angle = jnp.asarray((2 * np.pi * np.arange(degree) + 0.7) / degree, fixed.dtype)
    z = jax.lax.fori_loop(0, _STEPS, improved, 0.5 * jax.lax.complex(jnp.cos(angle), jnp.sin(angle)))

    def polished(_, x):
        return x - _newton(scaled, x)

    x = jax.lax.fori_loop(0, _POLISH, polished, jnp.real(z))
    tolerance = eps**_DIGITS
    is_real = (jnp.abs(jnp.imag(z)) <= tolerance) & (jnp.abs(x - jnp.real(z)) <= tolerance)
    x = jnp.sort(jnp.where(is_real, x, jnp.nan)) * scale
    known = ~jnp.isnan(x)
    x = jnp.where(known, x, 0.0)  # whose derivatives are finite
    return jnp.where(known, x - _newton(coefficients, x), jnp.nan)


def _value(coefficients, x):
    total = jnp.zeros_like(x)
    for coefficient in coefficients[::-1]:
        total = total * x + coefficient
    return total


def _newton(coefficients, x):
    """Value over slope, 0 where the polynomial is flat."""
    slope = jnp.zeros_like(x)
    for power in range(len(coefficients) - 1, 0, -1):
        slope = slope * x + power * coefficients[power]
    return jnp.where(slope == 0, 0.0, _value(coefficients, x) / jnp.where(slope == 0, 1.0, slope))
