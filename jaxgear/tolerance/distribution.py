"""How a deviation is distributed between its tolerance limits."""

from abc import abstractmethod

import jax
from jaxtyping import Array, Float, PRNGKeyArray

from ..numerics import Checked, number


class AbstractDistribution(Checked):
    """A symmetric distribution between -1 and 1; a deviation is its tolerance limit times a draw."""

    @abstractmethod
    def __call__(self, key: PRNGKeyArray, shape: tuple[int, ...], dtype) -> Float[Array, "..."]:
        """Independent draws between -1 and 1."""


class TruncatedNormal(AbstractDistribution):
    """Normal distribution with the limits at `sigmas` standard deviations, and nothing beyond: inspected parts.

    Three is the usual reading of a tolerance on a capable process (0.27 % of the parts sorted out).
    """

    sigmas: Float[Array, ""] = number("", low=0.0, open_low=True, default=3.0)

    def __call__(self, key, shape, dtype):
        sigmas = self.sigmas.astype(dtype)
        return jax.random.truncated_normal(key, -sigmas, sigmas, shape, dtype) / sigmas


class Uniform(AbstractDistribution):
    """Every value between the limits is as likely: nothing is known but the tolerance."""

    def __call__(self, key, shape, dtype):
        return jax.random.uniform(key, shape, dtype, -1.0, 1.0)
