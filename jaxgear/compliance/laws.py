"""Prepared contact laws: forms of the deflection over the line load, of full contacts and of those a corner cuts off.

All prepared leaves have the shape (pairs, 1, positions).
"""

from abc import abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..numerics import AbstractSpring, log

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


Field = Float[Array, "pairs #slices positions"]


class Cut(NamedTuple):
    """A contact that a tip corner cuts off: the logarithm of its approach goes by another half extent than a.

    Attributes:
        patch: what is left of it.
        logarithm: what a secant loses per ln(a), 2 / (pi E*) [um per N/mm].
    """

    patch: Patch
    logarithm: Real


class AbstractLaw(AbstractSpring):
    """A prepared contact law: approach of the two flanks [um] under a line load [N/mm], of full and of cut contacts."""

    @abstractmethod
    def cut_secant(self, load: Real, cut: Cut) -> Real:
        """`secant` of a contact that is cut off."""

    @abstractmethod
    def cut_change(self, load: Real, cut: Cut) -> Real:
        """load d cut_secant / d load [um per N/mm]."""


class AbstractPlainLaw(AbstractLaw):
    """A law that does not name its half width: the logarithm of a cut contact comes on top."""

    def cut_secant(self, load: Real, cut: Cut) -> Real:
        return self.secant(load) + 0.5 * cut.logarithm * log(cut.patch.squared / cut.patch.squared_extent)

    def cut_change(self, load: Real, cut: Cut) -> Real:
        secant = self.secant(load)
        return self.slope(load, secant) - secant + 0.5 * cut.logarithm * (1 - cut.patch.widening)


class LinearLaw(AbstractPlainLaw):
    """approach = compliance * q"""

    compliance: Field

    def secant(self, load: Real) -> Real:
        return jnp.broadcast_to(self.compliance, jnp.broadcast_shapes(self.compliance.shape, load.shape))


class PowerLaw(AbstractPlainLaw):
    """approach = factor q^exponent"""

    factor: Field
    exponent: Field

    def secant(self, load: Real) -> Real:
        return self.factor * load ** (self.exponent - 1)


class LogarithmicLaw(AbstractLaw):
    """approach = q (series(a^2) - factor ln a), a^2 = width_factor q: every law with the half width in a logarithm.

    Attributes:
        factor: 2 / (pi E*) [um per N/mm].
        width_factor: a^2 / q [mm^2 per N/mm].
        span: a^2 at which the series ends [mm^2]; it stays constant beyond.
        series: coefficients over powers of 2 a^2 / span - 1, lowest first [um per N/mm].
    """

    factor: Field
    width_factor: Field
    span: Field
    series: tuple[Field, ...]

    def secant(self, load: Real) -> Real:
        return self._secant(load, self.width_factor * load)

    def slope(self, load: Real, secant: Real) -> Real:
        return secant + self._change(load, 1.0)

    def cut_secant(self, load: Real, cut: Cut) -> Real:
        return self._secant(load, cut.patch.squared_extent)

    def cut_change(self, load: Real, cut: Cut) -> Real:
        return self._change(load, cut.patch.widening)

    def _secant(self, load: Real, squared_extent: Real) -> Real:
        place = jnp.minimum(2 * self.width_factor * load / self.span - 1, 1.0)
        return polynomial(self.series, place) - 0.5 * self.factor * log(squared_extent)

    def _change(self, load: Real, widening: Real | float) -> Real:
        place = 2 * self.width_factor * load / self.span - 1
        derivative = [power * coefficient for power, coefficient in enumerate(self.series)][1:]
        stretch = jnp.where(place < 1, polynomial(derivative, place), 0.0) * (place + 1)
        return stretch - 0.5 * self.factor * widening


def polynomial(coefficients: Sequence[Real | float], x: Real) -> Real:
    """Coefficients with the lowest power first; zero without any."""
    value = jnp.zeros_like(x)
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value
