"""Modifications given as a table: measured flanks, worn flanks, iterated profiles."""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import concrete, number
from ..numerics.spline import cell, interpolate, interpolate_columns
from .base import AbstractModification, Flank


class TabulatedProfile(AbstractModification):
    """Material removed, tabulated over the profile and interpolated; constant beyond the ends of the table.

    Attributes:
        position: increasing table positions, shape (points,).
        amount: material removed, shape (points,).
        coordinate: coordinate of the positions: "roll_length" [mm] (default) or "roll_angle" [deg].
        method: "linear", or "natural_cubic" for a natural cubic spline, or "monotonic" for a shape-preserving cubic.
    """

    position: Float[Array, " points"] = number("mm or deg", shape=("points",))
    amount: Float[Array, " points"] = number("um", shape=("points",))
    coordinate: Literal["roll_length", "roll_angle"] = eqx.field(default="roll_length", static=True)
    method: Literal["linear", "natural_cubic", "monotonic"] = eqx.field(default="linear", static=True)

    varies_along_face = False

    def check_together(self) -> None:
        if self.position.shape != self.amount.shape or self.position.shape[0] < 2:
            raise ValueError(
                f"TabulatedProfile: position {self.position.shape} and amount {self.amount.shape} must be two lists of "
                "the same length, at least 2"
            )
        _check_increasing("TabulatedProfile: position", self.position)

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        x = flank.roll_length
        if self.coordinate == "roll_angle":
            x = jnp.rad2deg(x / flank.base_radius)
        return interpolate(x, self.position, self.amount, self.method)


class TabulatedFlank(AbstractModification):
    """Material removed, tabulated over the whole flank; constant beyond the ends of the table.

    Along the profile it is interpolated as in `TabulatedProfile`, over the face linearly.

    Attributes:
        roll_length: increasing roll lengths, shape (points,).
        face_coordinate: increasing face coordinates, from the middle of the face, shape (faces,).
        amount: material removed, shape (points, faces).
        method: interpolation along the profile: "linear", "natural_cubic" or "monotonic".
    """

    roll_length: Float[Array, " points"] = number("mm", shape=("points",), fewest=2)
    face_coordinate: Float[Array, " faces"] = number("mm", shape=("faces",), fewest=2)
    amount: Float[Array, "points faces"] = number("um", shape=("points", "faces"))
    method: Literal["linear", "natural_cubic", "monotonic"] = eqx.field(default="linear", static=True)

    def check_together(self) -> None:
        wanted = self.roll_length.shape + self.face_coordinate.shape
        if self.amount.shape != wanted:
            raise ValueError(
                f"TabulatedFlank: amount has shape {self.amount.shape}, must be {wanted}: one row per roll length, one "
                "column per face coordinate"
            )
        _check_increasing("TabulatedFlank: roll_length", self.roll_length)
        _check_increasing("TabulatedFlank: face_coordinate", self.face_coordinate)

    @property
    def varies_along_face(self) -> bool:
        amount = concrete(self.amount)
        return amount is None or bool((amount != amount[:, :1]).any())

    def __call__(self, flank: Flank) -> Float[Array, "..."]:
        face = self.face_coordinate.astype(flank.face_coordinate.dtype)
        y = jnp.clip(flank.face_coordinate, face[0], face[-1])
        left = cell(y, face)
        share = (y - face[left]) / (face[left + 1] - face[left])
        at = interpolate_columns(flank.roll_length, self.roll_length, self.amount, self.method)
        return (1 - share) * at(left) + share * at(left + 1)


def _check_increasing(name: str, positions: Array) -> None:
    known = concrete(positions)
    if known is not None and not (known[1:] > known[:-1]).all():
        raise ValueError(f"{name} must increase strictly")
