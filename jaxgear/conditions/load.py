"""The loads of a sweep."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import check, concrete, real


class LoadSpectrum(eqx.Module):
    """Several torques, each with the share of time or revolutions that it is run for.

    Attributes:
        torques: on the pinion [N m], shape (torques,).
        weights: shares, which sum to 1, shape (torques,).
    """

    torques: Float[Array, " torques"]
    weights: Float[Array, " torques"]

    def __init__(self, torques, weights=None):
        """Makes the spectrum.

        Args:
            torques: on the pinion [N m], all different.
            weights: of any sum; None for equal shares.

        Raises:
            ValueError: for torques or weights that are negative, not finite, repeated or of different number, or
                weights that are all zero.
        """
        check("LoadSpectrum", "torques", torques, "N m", low=0.0)
        self.torques = real(torques)
        if self.torques.ndim != 1 or not len(self.torques):
            raise ValueError("LoadSpectrum: torques must be a list of at least one torque")
        known = concrete(self.torques)
        if known is not None and len(np.unique(known)) != len(known):
            raise ValueError("LoadSpectrum: torques must be different")
        shares = jnp.ones_like(self.torques) if weights is None else real(weights)
        check("LoadSpectrum", "weights", shares, "", low=0.0)
        if shares.shape != self.torques.shape:
            raise ValueError(f"LoadSpectrum: {shares.size} weights must be as many as the {len(self.torques)} torques")
        check("LoadSpectrum", "sum of the weights", jnp.sum(shares), "", low=0.0, open_low=True)
        self.weights = shares / jnp.sum(shares)

    @staticmethod
    def of(torque) -> "LoadSpectrum":
        """A spectrum from itself or from a single torque [N m]."""
        return torque if isinstance(torque, LoadSpectrum) else LoadSpectrum(real(torque)[None])
