"""Shape of a relief between its start (0) and its end (1), as a multiple of its amount.

Sources: the linear and the 0.44/0.56 parabolic forms are the usual tip-relief forms of the literature on genetic
optimisation of spur gears; power, quadratic, polynomial and sinusoidal forms are those compared for dynamic relief
design, with their coefficients b_i as free parameters; the parabola that goes on along its tangent is the single-node
spline of ground flanks that are designed from the static transmission error.
"""

from abc import abstractmethod

import equinox as eqx
import interpax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import check, real, safe_divide, safe_power


class AbstractCurve(eqx.Module):
    """Shape function of a relief."""

    @abstractmethod
    def __call__(self, d: Float[Array, "..."]) -> Float[Array, "..."]:
        """Relief divided by its amount at the relative depth d in [0, 1] into the relief; any shape."""


class Linear(AbstractCurve):
    """d"""

    def __call__(self, d):
        return d


class Parabolic(AbstractCurve):
    """0.44 d + 0.56 d^2"""

    def __call__(self, d):
        return d * (0.44 + 0.56 * d)


class Power(AbstractCurve):
    """d^exponent; 1.5 is Walker's form, 1 to 2 are usual. At exponents below 1 the slope at the start is infinite."""

    exponent: Float[Array, ""] = eqx.field(converter=real)

    def __check_init__(self):
        check("Power", "exponent", self.exponent, "", low=0.0, open_low=True)

    def __call__(self, d):
        return safe_power(d, self.exponent)


class Quadratic(AbstractCurve):
    """b0 + b1 d + b2 d^2. A non-zero b0 is a step at the start of the relief."""

    b0: Float[Array, ""] = eqx.field(converter=real)
    b1: Float[Array, ""] = eqx.field(converter=real)
    b2: Float[Array, ""] = eqx.field(converter=real)

    def __check_init__(self):
        for name in ("b0", "b1", "b2"):
            check("Quadratic", name, getattr(self, name), "")

    def __call__(self, d):
        return self.b0 + d * (self.b1 + d * self.b2)


class Polynomial(AbstractCurve):
    """sum_i coefficients[i] d^i, lowest power first."""

    coefficients: Float[Array, " terms"] = eqx.field(converter=real)

    def __check_init__(self):
        check("Polynomial", "coefficients", self.coefficients, "")

    def __call__(self, d):
        value = jnp.zeros_like(d)
        for power in reversed(range(self.coefficients.shape[0])):
            value = value * d + self.coefficients[power]
        return value


class ParabolicLinear(AbstractCurve):
    """Parabola c d^2 up to the node n, from there on its tangent c n (2 d - n), with c = 1 / (2 n - n^2).

    Value and slope are continuous in the depth and in the node. A node of 1 is the pure parabola; towards 0 the curve
    becomes the straight line.
    """

    node: Float[Array, ""] = eqx.field(converter=real)

    def __check_init__(self):
        check("ParabolicLinear", "node", self.node, "", low=0.0, open_low=True, high=1.0)

    def __call__(self, d):
        tangent = 2 * d - self.node
        return jnp.where(d < self.node, safe_divide(d * d, self.node), tangent) / (2 - self.node)


class Sinusoidal(AbstractCurve):
    """sin(b0 d + b1) + cos(b0 d + b2), phases in rad. It starts from zero only if sin(b1) = -cos(b2)."""

    b0: Float[Array, ""] = eqx.field(converter=real)
    b1: Float[Array, ""] = eqx.field(converter=real)
    b2: Float[Array, ""] = eqx.field(converter=real)

    def __check_init__(self):
        for name in ("b0", "b1", "b2"):
            check("Sinusoidal", name, getattr(self, name), "")

    def __call__(self, d):
        return jnp.sin(self.b0 * d + self.b1) + jnp.cos(self.b0 * d + self.b2)


class Spline(AbstractCurve):
    """Natural cubic spline through `values` at equally spaced depths; the first value belongs to the start (d = 0)."""

    values: Float[Array, " knots"] = eqx.field(converter=real)

    def __check_init__(self):
        if self.values.ndim != 1 or self.values.shape[0] < 3:
            raise ValueError(f"Spline: values has shape {self.values.shape}, must be a list of at least 3 numbers")
        check("Spline", "values", self.values, "")

    def __call__(self, d):
        d = jnp.asarray(d)
        knots = jnp.linspace(0.0, 1.0, self.values.shape[0], dtype=d.dtype)
        values = self.values.astype(d.dtype)
        return natural_spline(d, knots, values)


def natural_spline(x, knots, values) -> Float[Array, "..."]:
    """Natural cubic spline through `values` at `knots`, at any shape of x."""
    # interpax's own end condition is not-a-knot, which overshoots between the first knots; axis 0 because it takes the
    # boundary values of a negative axis for a whole row
    slopes = interpax.approx_df(knots, values, "cubic2", axis=0, bc_type="natural")
    return interpax.interp1d(x.reshape(-1), knots, values, method="cubic2", fx=slopes).reshape(x.shape)
