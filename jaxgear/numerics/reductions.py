"""One number for many values: reductions (largest, range, mean, harmonic) and measures of weighted values.

The derivative of `jax.numpy.max` counts the entries that equal the maximum. A compiler may evaluate the array a second
time, with other rounding, for that comparison: then no entry equals the maximum and the derivative is 0/0, which
reverse mode spreads to everything that shares the function. Here the place of the extreme entry is found first and the
derivative is that of this entry.

A reduction has an exact value, whose derivative passes through the values; a soft one for methods that follow
gradients; and, where it is made of extremes, the pieces with which a linear program keeps them exact: with s = 1 where
it is to be made small and s = -1 where it is to be made large,

    s R(v) = max_i (a v_i) - min_i (b v_i).

A measure (mean, worst, quantile, conditional value at risk) is a spectral one (Acerbi 2002, doi
10.1016/S0378-4266(02)00281-9): a weighted mean of the sorted values. Its gradient passes through the values, with the
weights of their ranks.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jax.scipy.special import betainc
from jaxtyping import Array, Float

from .conversion import Given
from .fields import Checked, number, whole
from .programs import quick_jit

_MOST_PLACES = 1 << 16  # leaves 36 bits of the mantissa, ten digits

Axes = int | tuple[int, ...] | None


@partial(jax.jit, static_argnames="axis", inline=True)
def maximum(x: Float[Array, "..."], axis: Axes = None) -> Float[Array, "..."]:
    """Largest entry along axes; its derivative is that of the first of several equal entries.

    NaN anywhere along the axes gives NaN, also where the reductions of the backend drop it.

    Args:
        x: any array that is not empty.
        axis: axis or axes; None for all of them.
    """
    return _largest(*_together(x, axis))


@partial(jax.jit, static_argnames="axis", inline=True)
def minimum(x: Float[Array, "..."], axis: Axes = None) -> Float[Array, "..."]:
    """Smallest entry along axes, otherwise as `maximum`."""
    return -maximum(-x, axis)


@partial(jax.jit, static_argnames="axis", inline=True)
def spread(x: Float[Array, "..."], axis: Axes = None) -> Float[Array, "..."]:
    """Largest minus smallest entry along axes, otherwise as `maximum`; zero derivative where all entries are equal."""
    return maximum(x, axis) - minimum(x, axis)


def _together(x, axis: Axes):
    """An axis and the array with all given axes merged into that one."""
    given = range(x.ndim) if axis is None else axis if isinstance(axis, tuple) else (axis,)
    axes = sorted(a % x.ndim for a in given)
    if not axes:
        return 0, x[None]
    first = axes[0]
    together = jnp.moveaxis(x, axes, [first + i for i in range(len(axes))])
    rest = together.shape[first + len(axes) :]
    return first, together.reshape((*together.shape[:first], -1, *rest))


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _largest(axis: int, x):
    return jnp.where(jnp.any(jnp.isnan(x), axis), jnp.nan, jnp.max(x, axis))


@_largest.defjvp
def _largest_jvp(axis, primals, tangents):
    (x,), (x_dot,) = primals, tangents
    return _largest(axis, x), jnp.sum(jnp.where(_place(axis, x), x_dot, 0.0), axis)


def _place(axis: int, x):
    """Mask of the first largest entry; the transpose of a mask is a selection and no scatter.

    In double precision the last bits of the mantissa make way for the place: the largest integer along an axis is found
    faster than an argmax (3 % of a gradient of the PPTE), at the price that entries equal to ten digits count as equal.
    """
    size = x.shape[axis]
    if x.dtype != jnp.float64 or size > _MOST_PLACES:
        place = jnp.argmax(x, axis, keepdims=True)
        return jax.lax.broadcasted_iota(place.dtype, x.shape, axis) == place
    ordered = jax.lax.bitcast_convert_type(x, jnp.int64)
    ordered = jnp.where(ordered < 0, ordered ^ jnp.iinfo(jnp.int64).max, ordered)
    behind = size - 1 - jax.lax.broadcasted_iota(jnp.int64, x.shape, axis)
    last = (1 << (size - 1).bit_length()) - 1
    largest = jnp.max((ordered & ~last) | behind, axis, keepdims=True)
    return behind == (largest & last)


Values = Float[Array, "... values"]
Real = Float[Array, "..."]


@dataclass(frozen=True)
class AbstractReduction(ABC):
    """Reduction of the values along the last axis to one number."""

    @abstractmethod
    def __call__(self, values: Values) -> Real:
        """The exact number."""

    def soft(self, values: Values, width: Given) -> Real:
        """Reduction with soft extremes of a width in the unit of the values; exact in the limit of zero width."""
        return self(values)

    def factors(self, sign: int) -> tuple[float, float] | None:
        """Factors (a, b) of the pieces of `sign` times the reduction; None if it is not piecewise linear."""
        return None


@dataclass(frozen=True)
class Value(AbstractReduction):
    """A single number, which is that number."""

    def __call__(self, values: Values) -> Real:
        if values.shape[-1] != 1:
            raise ValueError(
                f"Value: {values.shape[-1]} values are not a single number; give a reduction such as Max()"
            )
        return values[..., 0]


@dataclass(frozen=True)
class Max(AbstractReduction):
    """The largest value."""

    def __call__(self, values: Values) -> Real:
        return maximum(values, -1)

    def soft(self, values: Values, width: Given) -> Real:
        return _soft_maximum(values, width)

    def factors(self, sign: int) -> tuple[float, float] | None:
        return (1.0, 0.0) if sign > 0 else None


@dataclass(frozen=True)
class Min(AbstractReduction):
    """The smallest value."""

    def __call__(self, values: Values) -> Real:
        return minimum(values, -1)

    def soft(self, values: Values, width: Given) -> Real:
        return -_soft_maximum(-values, width)

    def factors(self, sign: int) -> tuple[float, float] | None:
        return (-1.0, 0.0) if sign < 0 else None


@dataclass(frozen=True)
class Range(AbstractReduction):
    """The largest minus the smallest value: peak to peak."""

    def __call__(self, values: Values) -> Real:
        return spread(values, -1)

    def soft(self, values: Values, width: Given) -> Real:
        return _soft_maximum(values, width) + _soft_maximum(-values, width)

    def factors(self, sign: int) -> tuple[float, float] | None:
        return (1.0, 1.0) if sign > 0 else None


@dataclass(frozen=True)
class Average(AbstractReduction):
    """Mean of the values."""

    def __call__(self, values: Values) -> Real:
        return jnp.mean(values, axis=-1)


@dataclass(frozen=True)
class Rms(AbstractReduction):
    """Root mean square about the mean; its derivative is zero where all values are equal."""

    def __call__(self, values: Values) -> Real:
        return _root(jnp.mean((values - jnp.mean(values, axis=-1, keepdims=True)) ** 2, axis=-1))


@dataclass(frozen=True)
class Harmonic(AbstractReduction):
    """Amplitude of a harmonic of values at equal steps of one period: 2 |mean(v e^(-2 pi i n t))|.

    Attributes:
        order: n, less than half the number of values.
    """

    order: int

    def __post_init__(self) -> None:
        whole("Harmonic: order", self.order, 1)

    def __call__(self, values: Values) -> Real:
        count = values.shape[-1]
        if not self.order < count / 2:
            raise ValueError(f"Harmonic: order = {self.order} must be less than half of {count} values")
        angle = 2 * jnp.pi * self.order / count * jnp.arange(count, dtype=values.dtype)
        return 2 / count * _root((values @ jnp.cos(angle)) ** 2 + (values @ jnp.sin(angle)) ** 2)


def _soft_maximum(values, width):
    """Log-mean-exp: below the largest value by up to the width times the logarithm of their number."""
    count = jnp.log(jnp.asarray(values.shape[-1], values.dtype))
    return width * (jax.nn.logsumexp(values / width, axis=-1) - count)


def _root(squared):
    """Square root with derivative zero at zero; passes NaN on."""
    nothing = squared <= 0
    return jnp.where(nothing, 0.0, jnp.sqrt(jnp.where(nothing, 1.0, squared)))


Scalar = Float[Array, ""]
Samples = Float[Array, " values"]
Edges = Float[Array, " edges"]


class AbstractMeasure(Checked):
    """Measure that joins many values into one."""

    @abstractmethod
    def spread(self, share: Edges, count: Scalar) -> Edges:
        """How much of the result the lowest values up to a `share` of all weights carry, from 0 to 1.

        Args:
            share: ascending shares, 0 first, 1 last.
            count: effective number of values.
        """

    @quick_jit
    def shares(self, values: Samples, weights: Samples) -> Samples:
        """Weight of every value in the result, in the order of the values; the weights sum to 1."""
        order = jnp.argsort(values)
        cumulative = jnp.cumsum(weights[order])
        edges = jnp.concatenate([jnp.zeros_like(cumulative[:1]), cumulative / cumulative[-1]])
        # compiled, the quotient of two equal numbers can be just below 1, and the worst value then has no share
        rounding = 4 * values.shape[0] * jnp.finfo(edges.dtype).eps
        edges = jnp.where(edges > 1 - rounding, 1.0, edges)
        count = jnp.sum(weights) ** 2 / jnp.sum(weights**2)
        carried = jnp.where(weights[order] > 0, jnp.diff(self.spread(edges, count)), 0.0)
        return jnp.zeros_like(values).at[order].set(carried)

    @quick_jit
    def __call__(self, values: Samples, weights: Samples) -> Scalar:
        """Measure of the values; values that are not finite count if they carry a share."""
        shares = self.shares(values, weights)
        return jnp.sum(jnp.where(shares > 0, shares * values, 0.0))


class Mean(AbstractMeasure):
    """Weighted mean."""

    def spread(self, share: Edges, count: Scalar) -> Edges:
        return share


class Worst(AbstractMeasure):
    """Largest value."""

    def spread(self, share: Edges, count: Scalar) -> Edges:
        return jnp.where(share >= 1, 1.0, 0.0).astype(share.dtype)


class CVaR(AbstractMeasure):
    """Conditional value at risk: mean of the worst 1 - level of all values (Rockafellar and Uryasev 2000)."""

    level: Scalar = number("", low=0.0, high=1.0, open_high=True, default=0.95)

    def spread(self, share: Edges, count: Scalar) -> Edges:
        level = self.level.astype(share.dtype)
        return jnp.maximum(share - level, 0.0) / (1 - level)


class Quantile(AbstractMeasure):
    """Quantile after Harrell and Davis (1982, doi 10.1093/biomet/69.3.635).

    It weighs the sorted values with a beta distribution, so that its gradient follows many values and not the one that
    happens to stand at the level.
    """

    level: Scalar = number("", low=0.0, high=1.0, open_low=True, open_high=True, default=0.95)

    def spread(self, share: Edges, count: Scalar) -> Edges:
        level = self.level.astype(share.dtype)
        return betainc((count + 1) * level, (count + 1) * (1 - level), share)
