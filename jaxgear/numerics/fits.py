"""Linear fits of given columns to values, and real roots of polynomials.

Columns times coefficients stand for the values: the columns of a polynomial are the powers of its argument. Both fits
are differentiable by columns and values.

The columns are few and are orthogonalized here. Those of many fits side by side would go to LAPACK in shares that wait
for threads of one pool: as many such calls at once as the pool has threads wait for each other for ever.
"""

from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

Columns = Float[Array, "points columns"]
Values = Float[Array, " points"]
Coefficients = Float[Array, " columns"]
Triangle = list[list[Float[Array, ""]]]
Criterion = Literal["least_squares", "minimax"]

_EXCHANGES = 40  # of one point each; a few columns need about ten


def fit(columns: Columns, values: Values, criterion: Criterion) -> Coefficients:
    """Coefficients of the columns.

    Args:
        columns: columns of full rank. For "minimax" every square part of them must be (Haar's condition), as for powers
            of positive numbers in increasing order.
        values: values to fit.
        criterion: "least_squares", or "minimax" for the least largest residual, by Remez' exchange of one point at a
            time; its derivative is that of the points that bear the largest residual.
    """
    # an orthonormal basis of the columns: powers are nearly dependent, and single precision would feel it
    basis, triangle = orthonormal(columns)
    return _backward(triangle, basis.T @ values if criterion == "least_squares" else _minimax(basis, values))


def orthonormal(columns: Columns) -> tuple[Columns, Triangle]:
    """Q and the columns of R of columns = Q R, by Gram and Schmidt's process.

    Every column goes through it twice, after which Q is orthonormal to rounding ("twice is enough": Parlett, The
    Symmetric Eigenvalue Problem, 1980, section 6-9).
    """
    basis: list[Values] = []
    triangle: Triangle = []
    for place in range(columns.shape[1]):
        rest, shares = columns[:, place], [jnp.zeros_like(columns[0, 0])] * place
        for _ in range(2):
            for index, direction in enumerate(basis):
                share = jnp.sum(direction * rest)
                rest, shares[index] = rest - share * direction, shares[index] + share
        length = jnp.sqrt(jnp.sum(rest**2))
        basis.append(rest / length)
        triangle.append([*shares, length])
    return jnp.stack(basis, axis=1), triangle


def _backward(triangle: Triangle, right: Float[Array, " columns"]) -> Coefficients:
    """x of R x = right."""
    rest, found = list(right), []
    for place in reversed(range(len(triangle))):
        found.append(rest[place] / triangle[place][place])
        rest = [value - triangle[place][row] * found[-1] for row, value in enumerate(rest[:place])]
    return jnp.stack(found[::-1])


def _minimax(basis: Columns, values: Values) -> Coefficients:
    points, columns = basis.shape
    fixed, wanted = jax.lax.stop_gradient((basis, values))
    # the extremes of a Chebyshev polynomial, which are close to those of the residual of a smooth function
    places = (1 - np.cos(np.pi * np.arange(columns + 1) / columns)) / 2 * (points - 1)
    start = jnp.asarray(np.round(places), jnp.int32)
    borne = jax.lax.fori_loop(0, _EXCHANGES, lambda _, at: _exchanged(at, fixed, wanted), start)
    return _levelled(borne, basis, values)[:-1]


def _levelled(reference: Int[Array, " borne"], basis: Columns, values: Values) -> Float[Array, " borne"]:
    """Coefficients that leave residuals of one size and alternating sign at the reference, and that residual."""
    signs = _signs(reference.shape[0], basis.dtype)
    matrix = jnp.concatenate([basis[reference], signs[:, None]], axis=1)
    return fit(matrix, values[reference], "least_squares")  # as many points as columns: it passes through all of them


def _exchanged(reference: Int[Array, " borne"], basis: Columns, values: Values) -> Int[Array, " borne"]:
    """The reference with the point of the largest residual in place of one whose residual has the same sign."""
    solution = _levelled(reference, basis, values)
    residual = values - basis @ solution[:-1]
    worst = jnp.argmax(jnp.abs(residual)).astype(reference.dtype)
    count = reference.shape[0]
    signs = jnp.where(solution[-1] < 0, -1, 1).astype(basis.dtype) * _signs(count, basis.dtype)
    sign = jnp.where(residual[worst] < 0, -1, 1).astype(basis.dtype)
    below = jnp.sum(reference < worst)
    left, right = jnp.clip(below - 1, 0, count - 1), jnp.clip(below, 0, count - 1)
    # inside, one of the two neighbours has the sign; beyond an end the end has it, or the points move along
    index = jnp.where(sign == signs[left], left, right)
    swapped = reference.at[index].set(worst)
    before = jnp.concatenate([worst[None], reference[:-1]])
    after = jnp.concatenate([reference[1:], worst[None]])
    moved = jnp.where((below == 0) & (sign != signs[0]), before, swapped)
    moved = jnp.where((below == count) & (sign != signs[-1]), after, moved)
    return jnp.where(jnp.any(reference == worst), reference, moved)


def _signs(count: int, dtype) -> Float[Array, " borne"]:
    return jnp.asarray((-1.0) ** np.arange(count), dtype)


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
        coefficients: coefficients from the constant one up; the last one is not zero.
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
