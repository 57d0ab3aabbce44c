"""Modifications along the profile and along the face width, by the names of ISO 21771.

Each modification refers to the face of the gear on which it is ground: if a gear is wider than its mate, the ends of
its face and their reliefs may lie outside the contact.
"""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Given, number, safe_divide
from .base import AMOUNTS, LONGEST, AbstractModification, Flank, acts
from .curves import AbstractCurve, Linear, Parabolic

Real = Float[Array, "..."]


def relief(distance: Given, amount: Given, length: Given, curve: AbstractCurve) -> Real:
    """Relief [um] at a distance from its end [mm]; zero beyond its start, and everywhere for a length of zero."""
    inside = jnp.asarray(1 - distance * safe_divide(1.0, length))
    # no nested maxima: the derivative of a tie is a division
    d = jax.lax.clamp(inside.dtype.type(0), inside, inside.dtype.type(1))
    return jnp.where(length > 0, amount, 0.0) * jnp.where(d > 0, curve(d), 0.0)


class TipRelief(AbstractModification):
    """Tip relief C_alpha_a: `amount` at the tip, over the last `length` of roll length.

    A length of zero means no relief.

    Attributes:
        amount: material removed at the tip.
        length: roll length over which the relief runs out, from the tip.
        curve: shape of the relief over its depth.
    """

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)
    length: Float[Array, ""] = number("mm", low=0.0, high=LONGEST)
    curve: AbstractCurve = eqx.field(default_factory=Parabolic)

    varies_along_face = False

    def __call__(self, flank: Flank) -> Real:
        return relief(flank.tip_roll_length - flank.roll_length, self.amount, self.length, self.curve)


class RootRelief(AbstractModification):
    """Root relief C_alpha_f: `amount` at the start of the active profile, over the first `length`.

    Attributes:
        amount: material removed at the start of the active profile.
        length: roll length over which the relief runs out, from the start of the active profile.
        curve: shape of the relief over its depth.
    """

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)
    length: Float[Array, ""] = number("mm", low=0.0, high=LONGEST)
    curve: AbstractCurve = eqx.field(default_factory=Linear)

    varies_along_face = False

    def __call__(self, flank: Flank) -> Real:
        return relief(flank.roll_length - flank.start_roll_length, self.amount, self.length, self.curve)


class ProfileCrowning(AbstractModification):
    """Profile crowning C_alpha: parabola with zero in the middle of the active profile and `amount` at its ends.

    Attributes:
        amount: material removed at both ends of the active profile; negative for negative crowning.
    """

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)

    varies_along_face = False

    def __call__(self, flank: Flank) -> Real:
        return self.amount * _from_middle(flank) ** 2


class ProfileSlope(AbstractModification):
    """Profile slope C_H_alpha: straight line, half the `amount` removed at the tip, half added at the start of the
    active profile, so that the middle stays.

    Attributes:
        amount: difference of the material removed at the tip and at the start of the active profile.
    """

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)

    varies_along_face = False

    def __call__(self, flank: Flank) -> Real:
        return 0.5 * self.amount * _from_middle(flank)


def _from_middle(flank: Flank) -> Real:
    """-1 at the start of the active profile, +1 at the tip."""
    middle = 0.5 * (flank.tip_roll_length + flank.start_roll_length)
    half = 0.5 * (flank.tip_roll_length - flank.start_roll_length)
    return (flank.roll_length - middle) / half


class LeadCrowning(AbstractModification):
    """Lead crowning C_beta: parabola with zero in the middle of the face and `amount` at both ends.

    Attributes:
        amount: material removed at both ends of the face; negative for negative crowning.
    """

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)

    @property
    def varies_along_face(self) -> bool:
        return acts(self.amount)

    def __call__(self, flank: Flank) -> Real:
        return self.amount * (2.0 * flank.face_coordinate / flank.face_width) ** 2


class LeadSlope(AbstractModification):
    """Lead slope C_H_beta: straight line over the face, `amount` from end to end, zero in the middle, removing material
    at positive face coordinates.

    Attributes:
        amount: difference of the material removed at the end with positive and with negative face coordinate.
    """

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)

    @property
    def varies_along_face(self) -> bool:
        return acts(self.amount)

    def __call__(self, flank: Flank) -> Real:
        return self.amount * flank.face_coordinate / flank.face_width


class EndRelief(AbstractModification):
    """End relief C_beta I and II: `amount` at the ends of the face, over `length`.

    Attributes:
        amount: material removed at an end of the face.
        length: part of the face over which the relief runs out, from its end.
        curve: shape of the relief over its depth.
        side: "both", "negative" or "positive" (the end with negative or positive face coordinate).
    """

    amount: Float[Array, ""] = number("um", usual=AMOUNTS)
    length: Float[Array, ""] = number("mm", low=0.0, high=LONGEST)
    curve: AbstractCurve = eqx.field(default_factory=Linear)
    side: Literal["both", "negative", "positive"] = eqx.field(default="both", static=True)

    @property
    def varies_along_face(self) -> bool:
        return acts(self.amount)

    def __call__(self, flank: Flank) -> Real:
        end = 0.5 * flank.face_width
        total = jnp.zeros_like(flank.face_coordinate)
        if self.side != "negative":
            total = total + relief(end - flank.face_coordinate, self.amount, self.length, self.curve)
        if self.side != "positive":
            total = total + relief(end + flank.face_coordinate, self.amount, self.length, self.curve)
        return total
