"""S-N lines: bearable stress over load cycles, and the damage that load cycles do (Palmgren and Miner).

References:
    ISO 6336-2 and -3 (life factors), ISO 6336-6:2006.
"""

from typing import Self

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import Checked, Given, real, result, safe_divide

Real = Float[Array, "..."]
Scalar = Float[Array, ""]

_FAR = 1e10  # cycles of the second point of a power law, over those of the first


class SNLine(Checked):
    """Bearable stress over load cycles, straight between points on logarithmic scales.

    Attributes:
        cycles: cycles of the points, rising.
        stress: borne for so many cycles; the first is borne for fewer cycles too.
        endures: True if the last stress is borne for ever; else the line goes on beyond it.
    """

    cycles: Float[Array, " points"] = result()
    stress: Float[Array, " points"] = result("MPa")
    endures: bool = eqx.field(default=True, static=True)

    @classmethod
    def power_law(cls, stress: Scalar, cycles: Scalar, exponent: Scalar) -> Self:
        """N = `cycles` (`stress` / sigma)^p, without an endurance limit."""
        far = stress * _FAR ** (-1 / exponent)
        return cls(jnp.stack([cycles, _FAR * cycles]), jnp.stack([stress, far]), endures=False)

    def bears(self, cycles: Given) -> Real:
        """Stress [MPa] that is borne for a number of load cycles."""
        beyond = None if self.endures else "extrapolate"
        at = jnp.log(real(cycles)), jnp.log(self.cycles), jnp.log(self.stress)
        return jnp.exp(jnp.interp(*at, right=beyond))

    def log_cycles(self, stress: Given) -> Real:
        """Logarithm of the load cycles that a stress [MPa] is borne for; infinite below a line that endures.

        Above the first point the line goes on, so that no stress is borne for nothing.
        """
        given = real(stress)
        at = jnp.log(jnp.maximum(given, jnp.finfo(given.dtype).tiny))
        cycles, stresses = jnp.log(self.cycles), jnp.log(self.stress)
        exponents = safe_divide(jnp.diff(cycles), -jnp.diff(stresses))
        *pieces, found = (start + p * (high - at) for start, p, high in zip(cycles, exponents, stresses))
        if self.endures:
            found = jnp.where(at > stresses[-1], found, jnp.inf)
        for piece, low in zip(reversed(pieces), reversed(stresses[1:-1])):
            found = jnp.where(at > low, piece, found)
        return found

    def damage(self, stress: Given, cycles: Given) -> Real:
        """Share of the life that load cycles at a stress [MPa] take; none below a line that endures."""
        lasts = self.log_cycles(stress)
        none = jnp.isinf(lasts)
        return jnp.where(none, 0.0, cycles * jnp.exp(-jnp.where(none, 0.0, lasts)))
