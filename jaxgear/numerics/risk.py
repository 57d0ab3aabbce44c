"""One number for many values of different weight: mean, worst, quantile, conditional value at risk.

Every measure is a spectral one (Acerbi 2002, doi 10.1016/S0378-4266(02)00281-9): a weighted mean of the sorted values.
Its gradient passes through the values, with the weights of their ranks.
"""

from abc import abstractmethod

import jax.numpy as jnp
from jax.scipy.special import betainc
from jaxtyping import Array, Float

from .fields import Checked, number
from .programs import quick_jit

Scalar = Float[Array, ""]
Values = Float[Array, " values"]
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
    def shares(self, values: Values, weights: Values) -> Values:
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
    def __call__(self, values: Values, weights: Values) -> Scalar:
        """The number. Values that are not finite count where they carry a share."""
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
