"""Modifications along the face width. Names of ISO 21771: C_beta, C_H_beta, C_betaI/C_betaII.

Each counts over the face of its own gear, on which it is ground: of a gear that is wider than its mate, the ends of the
face and what is removed there may lie beyond the contact.
"""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import number
from .base import AMOUNTS, LONGEST, AbstractModification, Flank, acts
from .curves import AbstractCurve, Linear
from .profile import relief


class LeadCrowning(AbstractModification):
    """Lead crowning C_beta: parabola with zero in the middle of the face and `amount` at both ends."""

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)

    @property
    def varies_along_face(self) -> bool:
        return acts(self.amount)

    def __call__(self, flank: Flank):
        return self.amount * (2.0 * flank.face_coordinate / flank.face_width) ** 2


class LeadSlope(AbstractModification):
    """Lead slope C_H_beta: straight line over the face, `amount` from end to end, zero in the middle, removing material
    at positive face coordinates."""

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)

    @property
    def varies_along_face(self) -> bool:
        return acts(self.amount)

    def __call__(self, flank: Flank):
        return self.amount * flank.face_coordinate / flank.face_width


class EndRelief(AbstractModification):
    """End relief C_beta I and II: `amount` at the ends of the face, over `length`.

    Attributes:
        side: "both", "negative" or "positive" (the end with negative or positive face coordinate).
    """

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)
    length: Float[Array, ""] = number("mm", low=0.0, high=LONGEST)
    curve: AbstractCurve = eqx.field(default_factory=Linear)
    side: Literal["both", "negative", "positive"] = eqx.field(default="both", static=True)

    @property
    def varies_along_face(self) -> bool:
        return acts(self.amount)

    def __call__(self, flank: Flank):
        end = 0.5 * flank.face_width
        total = jnp.zeros_like(flank.face_coordinate)
        if self.side != "negative":
            total = total + relief(end - flank.face_coordinate, self.amount, self.length, self.curve)
        if self.side != "positive":
            total = total + relief(end + flank.face_coordinate, self.amount, self.length, self.curve)
        return total
