"""Modifications along the face width. Names of ISO 21771: C_beta, C_H_beta, C_betaI/C_betaII."""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import check, real
from .base import AbstractModification, Flank
from .curves import AbstractCurve, Linear
from .profile import relief


class LeadCrowning(AbstractModification):
    """Lead crowning C_beta: parabola with zero in the middle of the face and `amount` [um] at both ends."""

    amount: Float[Array, ""] = eqx.field(converter=real)

    def __check_init__(self):
        check("LeadCrowning", "amount", self.amount, "um")

    def __call__(self, flank: Flank):
        return self.amount * (2.0 * flank.face_coordinate / flank.face_width) ** 2


class LeadSlope(AbstractModification):
    """Lead slope C_H_beta: straight line over the face, `amount` [um] from end to end, zero in the middle, removing
    material at positive face coordinates."""

    amount: Float[Array, ""] = eqx.field(converter=real)

    def __check_init__(self):
        check("LeadSlope", "amount", self.amount, "um")

    def __call__(self, flank: Flank):
        return self.amount * flank.face_coordinate / flank.face_width


class EndRelief(AbstractModification):
    """End relief C_beta I and II: `amount` [um] at the ends of the face, over `length` [mm].

    Attributes:
        side: "both", "negative" or "positive" (the end with negative or positive face coordinate).
    """

    amount: Float[Array, ""] = eqx.field(converter=real)
    length: Float[Array, ""] = eqx.field(converter=real)
    curve: AbstractCurve = eqx.field(default_factory=Linear)
    side: Literal["both", "negative", "positive"] = eqx.field(default="both", static=True)

    def __check_init__(self):
        check("EndRelief", "amount", self.amount, "um")
        check("EndRelief", "length", self.length, "mm", low=0.0)
        if self.side not in ("both", "negative", "positive"):
            raise ValueError(f'EndRelief: side = {self.side!r} must be "both", "negative" or "positive"')

    def __call__(self, flank: Flank):
        end = 0.5 * flank.face_width
        total = jnp.zeros_like(flank.face_coordinate)
        if self.side != "negative":
            total = total + relief(end - flank.face_coordinate, self.amount, self.length, self.curve)
        if self.side != "positive":
            total = total + relief(end + flank.face_coordinate, self.amount, self.length, self.curve)
        return total
