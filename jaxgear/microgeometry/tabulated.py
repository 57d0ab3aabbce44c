"""Modifications given as a table: measured flanks, worn flanks, iterated profiles."""

from typing import Literal

import equinox as eqx
import interpax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import concrete, number
from .base import AbstractModification, Flank
from .curves import natural_spline


class TabulatedProfile(AbstractModification):
    """Material removed, tabulated over the profile and interpolated; constant beyond the ends of the table.

    Attributes:
        position: increasing table positions, shape (points,).
        amount: material removed, shape (points,).
        coordinate: what the positions are: "roll_length" [mm] (default) or "roll_angle" [deg].
        method: "linear", or "cubic2" for a natural cubic spline, or "monotonic" for a shape-preserving cubic.
    """

    position: Float[Array, " points"] = number("mm or deg", shape=("points",))
    amount: Float[Array, " points"] = number("um", shape=("points",))
    coordinate: Literal["roll_length", "roll_angle"] = eqx.field(default="roll_length", static=True)
    method: Literal["linear", "cubic2", "monotonic"] = eqx.field(default="linear", static=True)

    def check_together(self):
        if self.position.shape != self.amount.shape or self.position.shape[0] < 2:
            raise ValueError(
                f"TabulatedProfile: position {self.position.shape} and amount {self.amount.shape} must be two lists of "
                "the same length, at least 2"
            )
        position = concrete(self.position)
        if position is not None and not (position[1:] > position[:-1]).all():
            raise ValueError("TabulatedProfile: position must increase strictly")

    varies_along_face = False

    def __call__(self, flank: Flank):
        x = flank.roll_length
        if self.coordinate == "roll_angle":
            x = jnp.rad2deg(x / flank.base_radius)
        x = jnp.clip(x, self.position[0], self.position[-1])
        if self.method == "cubic2":
            return natural_spline(x, self.position, self.amount)
        return interpax.interp1d(x.reshape(-1), self.position, self.amount, method=self.method).reshape(x.shape)
