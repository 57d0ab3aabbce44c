"""The clearance as an odd polynomial, which perturbation methods can expand."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..dynamics.force import AbstractMeshForce
from ..numerics import Given, check, concrete, number, program, quick_jit, real

Scalar = Float[Array, ""]

ORDERS = 3, 5, 7
# Coefficients a_1, a_3, ... in use for |x| <= 3 (https://www.zhygear.com/?p=20816); `fit` gives nearly the same.
PUBLISHED = {
    3: (0.17386, 0.06475),
    5: (-0.052678, 0.18083, -0.01169),
    7: (-0.15549, 0.2833, -0.036636, 0.0017117),
}
_NODES = 64  # Gauss-Legendre on either part of the dead zone: exact for every order here
_BISECTIONS = 60
# Below three quarters of the true slope, 1, the fit no longer represents the dead zone.
_SOFT = 0.75


class PolynomialClearance(AbstractMeshForce):
    """f(x) = a_1 x + a_3 x^3 + ... in place of a dead zone of half width 1 and slope 1 beyond it; dimensionless.

    It is valid only for |x| <= range; beyond the range the highest power dominates (7th order, fitted over |x| <= 3:
    8.0 instead of 3 at x = 4). A concrete x out of range raises an error; in compiled code the force is NaN there: an
    orbit that leaves the range stays NaN and has not converged.

    Attributes:
        coefficients: a_1, a_3, ... of the odd powers, shape (terms,).
        range: largest |x|.

    Raises:
        ValueError: for a concrete DTE out of range.
    """

    coefficients: Float[Array, " terms"] = number("", shape=("terms",))
    range: Scalar = number("", low=1.0, open_low=True)

    @classmethod
    def fit(cls, order: int = 7, range: Given = 3.0) -> "PolynomialClearance":
        """Polynomial fitted to the dead zone by least squares over |x| <= range.

        Args:
            order: 3, 5 or 7.
            range: fitted range in half clearances, more than 1; the coefficients depend strongly on it.
        """
        if order not in ORDERS:
            raise ValueError(f"PolynomialClearance.fit: order = {order!r} must be 3, 5 or 7")
        check("PolynomialClearance.fit: range", range, "", low=1.0, open_low=True)
        return cls(_fitted(order, real(range)), real(range))

    @classmethod
    def published(cls, order: int = 7) -> "PolynomialClearance":
        """Clearance with the published coefficients `PUBLISHED` for |x| <= 3."""
        if order not in PUBLISHED:
            raise ValueError(f"PolynomialClearance.published: order = {order!r} must be 3, 5 or 7")
        return cls(real(PUBLISHED[order]), real(3.0))

    def at(self, phase: Scalar) -> tuple[()]:
        return ()

    def force(self, place: tuple[()], dte: Scalar) -> Scalar:
        known, most = concrete(dte), concrete(self.range)
        if known is not None and most is not None:
            check("PolynomialClearance: dte", known, "", low=-most, high=most)
        inside = jnp.abs(dte) <= self.range
        x = jnp.where(inside, dte, 0.0)
        return jnp.where(inside, self.polynomial(x), jnp.nan)

    def polynomial(self, x: Scalar) -> Scalar:
        """Polynomial f(x), not checked for the range."""
        value = jnp.zeros_like(x)
        for coefficient in self.coefficients[::-1]:
            value = value * x * x + coefficient
        return value * x

    def slope(self, x: Scalar) -> Scalar:
        """Slope f'(x), not checked for the range."""
        return jax.jvp(self.polynomial, (x,), (jnp.ones_like(x),))[1]

    def loaded(self, load: Given) -> Scalar:
        """Largest x in the range with f(x) = load, the mean of a loaded mesh; the range for a load beyond f(range)."""
        return _loaded(self, real(load))

    @property
    def false_zero(self) -> Scalar:
        """Positive zero of f for a fit with a_1 < 0, the false equilibrium without load; 0 if it does not exist."""
        return jnp.where(self.coefficients[0] < 0, self.loaded(0.0), 0.0)


@quick_jit
def _loaded(clearance: PolynomialClearance, load: Scalar) -> Scalar:
    def halve(_, bracket):
        low, high = bracket
        middle = 0.5 * (low + high)
        below = clearance.polynomial(middle) < load
        return jnp.where(below, middle, low), jnp.where(below, high, middle)

    # the outermost turning point of f bounds the branch that loaded gears stand on
    grid = jnp.linspace(0.0, 1.0, 257, dtype=load.dtype) * clearance.range
    falls = jax.vmap(clearance.polynomial)(grid) < load
    last = jnp.max(jnp.where(falls, jnp.arange(257), 0))
    bracket = grid[last], grid[jnp.minimum(last + 1, 256)]
    x = jax.lax.stop_gradient(jax.lax.fori_loop(0, _BISECTIONS, halve, bracket)[0])
    return x - (clearance.polynomial(x) - load) / clearance.slope(x)  # its derivative is that of the root


def warn_of_false_well(clearance: PolynomialClearance, load: Given) -> bool:
    """Warn if a load is too small for a fit with a_1 < 0, whose clearance has a false double well.

    A dead zone has slope 1 under every load. A fit with a slope below three quarters at the load is in the well or near
    its edge, and its resonances are meaningless.

    Returns:
        True if a warning was given; False for traced numbers.
    """
    first, carried, most = concrete(clearance.coefficients), concrete(real(load)), concrete(clearance.range)
    if first is None or carried is None or most is None or not first[0] < 0:
        return False
    x = clearance.loaded(load)
    slope = concrete(clearance.slope(x))
    if slope is None or slope >= _SOFT:
        return False
    warnings.warn(
        f"PolynomialClearance: coefficients a_1 = {float(first[0]):.4g} makes a false double well with zeros at x = "
        f"+-{float(clearance.false_zero):.4g}, and load = {float(carried):.4g} lies in it: its stiffness there is "
        f"{float(slope):.3g} instead of 1",
        stacklevel=3,
    )
    return True


@program
def _fitted(order: int, most: Scalar) -> Float[Array, " terms"]:
    """Coefficients of least squares: Legendre's odd polynomials of x / range are orthogonal over the range."""
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    at, share = real(0.5 * (node + 1)).astype(most.dtype), real(0.5 * weight).astype(most.dtype)
    # the dead zone on its slope only, 1 <= x <= range, in u = x / range
    u = 1 / most + (1 - 1 / most) * at
    value = (u * most - 1) * share * (1 - 1 / most)
    total = jnp.zeros((order + 1) // 2, most.dtype)
    for degree in range(1, order + 1, 2):
        power = np.polynomial.legendre.leg2poly([0.0] * degree + [1.0])[1::2]
        legendre = sum(float(part) * u ** (2 * i + 1) for i, part in enumerate(power))
        projected = (2 * degree + 1) * jnp.sum(value * legendre)
        total = total + projected * jnp.pad(real(power).astype(most.dtype), (0, len(total) - len(power)))
    return total / most ** real(np.arange(1, order + 1, 2)).astype(most.dtype)
