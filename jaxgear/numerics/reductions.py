"""One number of many values, as data: the largest, the range, the mean, a harmonic.

A reduction has an exact value, whose derivative passes through the values; a soft one for methods that follow
gradients; and, where it is made of extremes, the pieces with which a linear program keeps them exact: with s = 1 where
it is to be made small and s = -1 where it is to be made large,

    s R(v) = max_i (a v_i) - min_i (b v_i).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .extremes import maximum, minimum, spread
from .fields import whole

Values = Float[Array, "... values"]
Numbers = Float[Array, "..."]


@dataclass(frozen=True)
class AbstractReduction(ABC):
    """A number that stands for the values along the last axis."""

    @abstractmethod
    def __call__(self, values: Values) -> Numbers:
        """The exact number."""

    def soft(self, values: Values, width) -> Numbers:
        """The number with soft extremes of a width in the unit of the values; towards zero it becomes the exact one."""
        return self(values)

    def factors(self, sign: int) -> tuple[float, float] | None:
        """The factors (a, b) of the pieces of `sign` times the number; None where it is not made of pieces."""
        return None


@dataclass(frozen=True)
class Value(AbstractReduction):
    """A single number, which is that number."""

    def __call__(self, values):
        if values.shape[-1] != 1:
            raise ValueError(
                f"Value: {values.shape[-1]} values are not a single number; give a reduction such as Max()"
            )
        return values[..., 0]


@dataclass(frozen=True)
class Max(AbstractReduction):
    """The largest value."""

    def __call__(self, values):
        return maximum(values, -1)

    def soft(self, values, width):
        return _soft_maximum(values, width)

    def factors(self, sign):
        return (1.0, 0.0) if sign > 0 else None


@dataclass(frozen=True)
class Min(AbstractReduction):
    """The smallest value."""

    def __call__(self, values):
        return minimum(values, -1)

    def soft(self, values, width):
        return -_soft_maximum(-values, width)

    def factors(self, sign):
        return (-1.0, 0.0) if sign < 0 else None


@dataclass(frozen=True)
class Range(AbstractReduction):
    """The largest minus the smallest value: peak to peak."""

    def __call__(self, values):
        return spread(values, -1)

    def soft(self, values, width):
        return _soft_maximum(values, width) + _soft_maximum(-values, width)

    def factors(self, sign):
        return (1.0, 1.0) if sign > 0 else None


@dataclass(frozen=True)
class Average(AbstractReduction):
    """The mean."""

    def __call__(self, values):
        return jnp.mean(values, axis=-1)


@dataclass(frozen=True)
class Rms(AbstractReduction):
    """Root mean square about the mean; its derivative is zero where all values are equal."""

    def __call__(self, values):
        return _root(jnp.mean((values - jnp.mean(values, axis=-1, keepdims=True)) ** 2, axis=-1))


@dataclass(frozen=True)
class Harmonic(AbstractReduction):
    """Amplitude of a harmonic of values at equal steps of one period: 2 |mean(v e^(-2 pi i n t))|.

    Attributes:
        order: n, less than half the number of values.
    """

    order: int

    def __post_init__(self):
        whole("Harmonic", "order", self.order, 1)

    def __call__(self, values):
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
