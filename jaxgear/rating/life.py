"""S-N lines of the materials of ISO 6336, and load spectra after ISO 6336-6 (Palmgren and Miner).

References:
    ISO 6336-2 and -3 (life factors), ISO 6336-6:2006 with its Annex A (equivalent torque).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..metrics import SNLine
from ..numerics import Given, safe_divide
from .materials import LONG_LIFE, Knees

Scalar = Float[Array, ""]
OfGears = Float[Array, " gears"]
Bins = Float[Array, " bins"]
Points = Float[Array, " points"]

_BEYOND = 8.0  # logarithm of a stress over the static strength that one cycle does not survive
_BISECTIONS = 60


class Strengths(NamedTuple):
    """Strengths of pinion and wheel against one kind of failure.

    Attributes:
        limits: sigma_Hlim or sigma_Flim, endurance limits of the materials [MPa].
        knees: load cycles and life factors of the materials.
        reference: product of the other factors for endurance, in ISO 6336-2 Z_L Z_v Z_R Z_W Z_X.
        static: the same for static strength.
    """

    limits: OfGears
    knees: tuple[Knees, Knees]
    reference: OfGears
    static: OfGears

    def lines(self, long_life: Scalar) -> tuple[SNLine, SNLine]:
        """S-N lines; `long_life` is the life factor at 1e10 cycles."""
        pinion, wheel = (strength_line(*of, long_life) for of in zip(*self))
        return pinion, wheel

    def life_factors(self, cycles: OfGears, long_life: Scalar) -> OfGears:
        """Z_NT or Y_NT at the load cycles of both gears; `long_life` at 1e10."""
        return jnp.stack([life_factor(knees, at, long_life) for knees, at in zip(self.knees, cycles)])


def life_factor(knees: Knees, cycles: Scalar, long_life: Scalar) -> Scalar:
    """Z_NT or Y_NT at a number of load cycles; `long_life` at 1e10."""
    at, factors = _points(knees, cycles.dtype)
    return jnp.exp(jnp.interp(jnp.log(cycles), jnp.log(at), jnp.log(jnp.append(factors, long_life))))


def strength_line(limit: Scalar, knees: Knees, reference: Scalar, static: Scalar, long_life: Scalar) -> SNLine:
    """The S-N line of a gear; between static strength and endurance its factors go over from the one to the other.

    Args:
        limit: endurance limit of the material [MPa].
        knees: load cycles and life factors.
        reference: product of the other factors for endurance, in ISO 6336-2 Z_L Z_v Z_R Z_W Z_X.
        static: the same for static strength.
        long_life: life factor at 1e10 cycles.
    """
    cycles, factors = _points(knees, limit.dtype)
    way = jnp.log(cycles[:-1] / cycles[0]) / jnp.log(cycles[-2] / cycles[0])
    others = static ** (1 - way) * reference**way
    return SNLine(cycles, jnp.append(limit * factors * others, limit * long_life * reference))


def _points(knees: Knees, dtype: jnp.dtype) -> tuple[Points, Float[Array, " knees"]]:
    """Load cycles, those of the end of the line too, and life factors."""
    at, factors = zip(*knees)
    return jnp.asarray((*at, LONG_LIFE), dtype), jnp.asarray(factors, dtype)


def safety(line: SNLine, stress: Bins, cycles: Bins) -> Scalar:
    """Factor by which all stresses of a spectrum may grow until the damage sum is 1; at most to the static strength.

    At the end of the line the damage sum jumps where the stress of a bin reaches it, and the safety is that of the
    bin. Derivatives are those of the damage sum, by the implicit function theorem.

    Args:
        line: S-N line.
        stress: in every bin [MPa].
        cycles: of every bin.
    """
    most = jnp.max(stress)
    static = line.stress[0] / most
    low = jax.lax.stop_gradient(jnp.log(line.stress[-1] / most))
    high = jax.lax.stop_gradient(jnp.log(static)) + _BEYOND

    def excess(logarithm: Scalar) -> Scalar:
        total = jnp.sum(line.damage(jnp.exp(logarithm) * stress, cycles))
        return jnp.log(jnp.maximum(total, jnp.finfo(total.dtype).tiny))

    def halve(_, bracket):
        a, b = bracket
        middle = 0.5 * (a + b)
        early = jax.lax.stop_gradient(excess(middle)) < 0
        return jnp.where(early, middle, a), jnp.where(early, b, middle)

    _, at = jax.lax.fori_loop(0, _BISECTIONS, halve, (low, high))
    at = jax.lax.stop_gradient(at)
    left, slope = excess(at), jax.lax.stop_gradient(jax.grad(lambda x: excess(x))(at))
    moved = safe_divide(left - jax.lax.stop_gradient(left), slope)
    return jnp.minimum(jnp.exp(at - moved), static)


def equivalent_torque(torques: Bins, cycles: Bins, exponent: Given, reference: Given) -> Scalar:
    """T_eq [N m] of Annex A: the torque that does in `reference` cycles the damage of the bins that count.

    From the largest torque on, the cycles of every bin are carried over to the next smaller torque by the exponent,
    until they are as many as those of the endurance limit; what is below does not count.

    Args:
        torques, cycles: of every bin.
        exponent: of the S-N line over the torque: half of that over the contact stress, that over the root stress.
        reference: load cycles of the endurance limit.
    """
    order = jnp.argsort(-torques)
    torques, cycles = torques[order], cycles[order]
    largest = torques[0]
    carried = jnp.cumsum(cycles * (torques / largest) ** exponent)
    enough = carried * (largest / torques) ** exponent >= reference
    last = jnp.where(jnp.any(enough), jnp.argmax(enough), len(torques) - 1)
    return largest * (carried[last] / reference) ** (1 / exponent)
