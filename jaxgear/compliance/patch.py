"""Contact that a tip corner cuts off; `edge` has the formulas."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

Real = Float[Array, "..."]

# Distances from the corner below this one [mm] are clipped to it: real contacts are wider.
_SHORTEST = 1e-6
_CUT_MEAN = 0.25 * float(np.exp(0.5))  # mean distance over L


class Patch(NamedTuple):
    """A contact next to a corner, made by `cut_off`. Its properties cost operations, each time they are asked for.

    Attributes:
        distance: t, of the centre of contact from the corner [mm], negative beyond it.
        squared: a^2 of the full contact [mm^2].
        inside: t where it is positive, else 0 [mm].
        cut: whether the corner cuts the contact off.
        root: sqrt(t^2 + 3 a^2) where it does, sqrt(t^2 - a^2) elsewhere [mm].
        length: L, of the patch that is left [mm].
    """

    distance: Real
    squared: Real
    inside: Real
    cut: Bool[Array, "..."]
    root: Real
    length: Real

    @property
    def squared_extent(self) -> Real:
        """(L / 2)^2 where the contact is cut off, a^2 elsewhere [mm^2]."""
        return jnp.where(self.cut, 0.25 * self.length**2, self.squared)

    @property
    def widening(self) -> Real:
        """d ln(squared_extent) / d ln(a^2)"""
        return jnp.where(self.cut, 1 - self.distance / self.root, 1.0)

    @property
    def bending(self) -> Real:
        """a^2 (Phi - ln(2 / l) / 2) without the gap of the corner; zero where nothing is cut off [mm^2]."""
        # without distance^2 / 2 beyond the corner, where the corner gap accounts for it
        sagitta = 0.5 * self.length * (0.25 * self.length - self.distance) + 0.5 * self.inside**2
        return jnp.where(self.cut, sagitta + self.length**2 / 16 - 0.25 * self.squared, 0.0)

    @property
    def bending_slope(self) -> Real:
        """d bending / d a^2"""
        return jnp.where(self.cut, (0.375 * self.length - 0.5 * self.distance) / self.root - 0.25, 0.0)

    @property
    def mean_distance(self) -> Real:
        """Exponential of the mean of ln(distance from the corner) over a semi-ellipse on the patch [mm].

        The semi-ellipse is the Hertzian pressure of a full contact, g / 2 exp(a^2 / (2 g^2)) with g = t +
        sqrt(t^2 - a^2), and its bounded counterpart on [0, L].
        """
        growth = self.inside + self.root
        full = 0.5 * growth * jnp.exp(0.5 * self.squared / growth**2)
        return jnp.maximum(jnp.where(self.cut, _CUT_MEAN * self.length, full), _SHORTEST)

    @property
    def mean_change(self) -> Real:
        """d ln(mean_distance) / d ln(a^2)"""
        full = -0.5 * self.squared / (self.inside + self.root) ** 2
        return jnp.where(self.cut, self.squared / (self.root * self.length), full)


def cut_off(distance: Real, squared: Real) -> Patch:
    """The patch of a contact whose centre has a given distance from the corner.

    Args:
        distance: t [mm], negative beyond the corner.
        squared: a^2 of the full contact [mm^2], positive.
    """
    inside = jnp.maximum(distance, 0.0)
    cut = squared > inside**2
    root = jnp.sqrt(jnp.where(cut, distance**2 + 3 * squared, jnp.maximum(distance**2 - squared, _SHORTEST**2)))
    return Patch(distance, squared, inside, cut, root, jnp.maximum(2 / 3 * (distance + root), _SHORTEST))
