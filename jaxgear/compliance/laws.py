"""Prepared contact laws: forms of the deflection over the line load, of full contacts and of those a corner cuts off.

All prepared leaves have the shape (pairs, 1, positions).
"""

from abc import abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import AbstractSpring, log
from .patch import Patch

Field = Float[Array, "pairs #slices positions"]
Real = Float[Array, "..."]


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
