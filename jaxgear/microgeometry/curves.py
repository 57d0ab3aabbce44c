"""Shape of a relief between its start (0) and its end (1), as a multiple of its amount.

Sources: the linear and the 0.44/0.56 parabolic forms are the usual tip-relief forms of the literature on genetic
optimisation of spur gears; power, quadratic, polynomial and sinusoidal forms are those compared for dynamic relief
design, with their coefficients b_i as free parameters; the parabola that goes on along its tangent is the single-node
spline of ground flanks that are designed from the static transmission error.
"""

from abc import abstractmethod

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Checked, number, safe_power, safe_sqrt
from ..numerics.spline import interpolate

Real = Float[Array, "..."]


class AbstractCurve(Checked):
    """Shape function of a relief."""

    @abstractmethod
    def __call__(self, d: Real) -> Real:
        """Relief divided by its amount at the relative depth d in [0, 1] into the relief; any shape."""


class Linear(AbstractCurve):
    """Linear relief, d."""

    def __call__(self, d: Real) -> Real:
        return d


class Parabolic(AbstractCurve):
    """Parabolic relief, 0.44 d + 0.56 d^2."""

    def __call__(self, d: Real) -> Real:
        return d * (0.44 + 0.56 * d)


class Power(AbstractCurve):
    """Power-law relief, d^exponent.

    Walker's form has the exponent 1.5; 1 to 2 are usual. For exponents below 1 the slope at the start is infinite.

    Attributes:
        exponent: exponent of the relative depth.
    """

    exponent: Float[Array, ""] = number("", low=0.0, open_low=True)

    def __call__(self, d: Real) -> Real:
        return safe_power(d, self.exponent)


class Quadratic(AbstractCurve):
    """Quadratic relief, b0 + b1 d + b2 d^2; a non-zero b0 is a step at the start of the relief.

    Attributes:
        b0, b1, b2: coefficients of the constant, linear and quadratic term.
    """

    b0: Float[Array, ""] = number("")
    b1: Float[Array, ""] = number("")
    b2: Float[Array, ""] = number("")

    def __call__(self, d: Real) -> Real:
        return self.b0 + d * (self.b1 + d * self.b2)


class Polynomial(AbstractCurve):
    """Polynomial relief, sum_i coefficients[i] d^i.

    Attributes:
        coefficients: coefficients of the powers of the relative depth, lowest power first, shape (terms,).
    """

    coefficients: Float[Array, " terms"] = number("", shape=("terms",))

    def __call__(self, d: Real) -> Real:
        value = jnp.zeros_like(d)
        for power in reversed(range(self.coefficients.shape[0])):
            value = value * d + self.coefficients[power]
        return value


class ParabolicLinear(AbstractCurve):
    """Parabola c d^2 up to the node n, continued by its tangent c n (2 d - n), with c = 1 / (2 n - n^2).

    Value and slope are continuous in the depth and in the node. A node of 1 is the pure parabola; towards 0 the curve
    becomes the straight line.

    Attributes:
        node: relative depth at which the parabola ends and its tangent begins.
    """

    node: Float[Array, ""] = number("", low=0.0, open_low=True, high=1.0)

    def __call__(self, d: Real) -> Real:
        inside = d < self.node
        # two divisions by the root: the derivative of one by the node has its square, which underflows for tiny nodes
        root = safe_sqrt(jnp.where(inside, self.node, 1.0))
        parabola = d * (jnp.where(inside, d, 0.0) / root / root)
        return jnp.where(inside, parabola, 2 * d - self.node) / (2 - self.node)


class Sinusoidal(AbstractCurve):
    """Sinusoidal relief, sin(b0 d + b1) + cos(b0 d + b2); it starts from zero only if sin(b1) = -cos(b2).

    Attributes:
        b0, b1, b2: factor of the relative depth, and phases of sine and cosine.
    """

    b0: Float[Array, ""] = number("rad")
    b1: Float[Array, ""] = number("rad")
    b2: Float[Array, ""] = number("rad")

    def __call__(self, d: Real) -> Real:
        return jnp.sin(self.b0 * d + self.b1) + jnp.cos(self.b0 * d + self.b2)


class Spline(AbstractCurve):
    """Natural cubic spline through `values` at equally spaced depths; the first value belongs to the start (d = 0).

    Attributes:
        values: relief divided by its amount at the knots, shape (knots,).
    """

    values: Float[Array, " knots"] = number("", shape=("knots",), fewest=3)

    def __call__(self, d: Real) -> Real:
        d = jnp.asarray(d)
        depths = jnp.linspace(0.0, 1.0, self.values.shape[0], dtype=d.dtype)
        return interpolate(d, depths, self.values, "natural_cubic")
