"""How wear goes on: contact, wear, new flank, and again, in blocks of revolutions.

A block is a step of Heun's method for d depth / d revolutions. Two blocks of one length are compared with one of twice
the length from the same flank: a third of what they differ by is the error of the two, of second order. All of it is
one table of Runge and Kutta with five contact analyses, in one loop, so that the contact is compiled once.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int8

from ..contact.status import Status, Statuses

Depth = Float[Array, "gears parts slices points"]

BLOCKS_OF_A_PAIR = 2

# Rates of wear that lead to the flank of every analysis, in blocks: at the start, at the end of the first block as
# Euler sees it, after that block, and at the ends of the second and of the double one as Euler sees them.
_STAGES = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [0.5, 0.5, 0.0, 0.0, 0.0],
        [0.5, 0.5, 1.0, 0.0, 0.0],
        [2.0, 0.0, 0.0, 0.0, 0.0],
    ]
)
_BOTH = np.array([0.5, 0.5, 0.5, 0.5, 0.0])
_DOUBLE = np.array([1.0, 0.0, 0.0, 0.0, 1.0])
_ANALYSES = len(_STAGES)
_DOUBLED = _ANALYSES - 1  # the analysis that the double block alone needs; before it come two of each block
_STARTS = 0, 2  # the analyses of flanks at the start of a block
# If a block makes the error e, two make 2 e, and the double one, of third order each, 8 e.
_SHARE = 2 / (8 - 2)


class WearRate(NamedTuple):
    """The contact on a flank: how fast it wears [um per revolution], what else it gives, and its status."""

    rate: Depth
    seen: Any
    status: Statuses


class March(NamedTuple):
    """Flanks over many blocks.

    Attributes:
        depth: at the start of every block and after the last one [um], leading axis (blocks + 1,).
        error: estimate of what every pair of blocks adds to the error of the depth [um], leading axis (pairs,); NaN
            where the contact of the double block was not found.
        status: the worst of all contacts that have worn these flanks, shape (blocks + 1,).
        seen: what the contact gave on these flanks, leading axis (blocks + 1,).
    """

    depth: Float[Array, "steps gears parts slices points"]
    error: Float[Array, "pairs gears parts slices points"]
    status: Int8[Array, " steps"]
    seen: Any


def march(analyze: Callable[[Depth], WearRate], depth: Depth, revolutions: Float[Array, " pairs"]) -> March:
    """Wear over pairs of blocks.

    Args:
        analyze: the contact on a flank of some depth.
        depth: at the start [um].
        revolutions: of the pinion in each block of every pair.
    """
    pairs, dtype = len(revolutions), depth.dtype
    stages, both, double = (jnp.asarray(table, dtype) for table in (_STAGES, _BOTH, _DOUBLE))
    # the last flank is analysed too: the first stage of a pair that is not gone through
    number = jnp.arange(pairs * _ANALYSES + 1) % _ANALYSES
    length = jnp.append(jnp.repeat(revolutions, _ANALYSES), jnp.zeros((), dtype))

    def analysis(state, stage):
        start, rates = state
        number, length = stage
        flank = start + length * jnp.tensordot(stages[number], rates, 1)
        contact = analyze(flank)
        rates = rates.at[number].set(contact.rate)
        end, doubled = (length * jnp.tensordot(shares, rates, 1) for shares in (both, double))
        start = jnp.where(number == _ANALYSES - 1, start + end, start)
        return (start, rates), (flank, contact.seen, contact.status, _SHARE * (doubled - end))

    nothing = jnp.zeros((_ANALYSES, *depth.shape), dtype)
    # backwards the contacts are found again instead of kept
    _, (flanks, seen, status, error) = jax.lax.scan(jax.checkpoint(analysis), (depth, nothing), (number, length))
    steps = np.append((np.arange(pairs)[:, None] * _ANALYSES + np.array(_STARTS)).ravel(), pairs * _ANALYSES)
    flanks, seen = jax.tree.map(lambda leaf: leaf[steps], (flanks, seen))
    of_pairs = status[:-1].reshape(pairs, _ANALYSES)
    worn_by, doubled = of_pairs[:, :_DOUBLED].reshape(2 * pairs, -1), of_pairs[:, _DOUBLED] == Status.CONVERGED
    status = jnp.append(jnp.zeros((1,), status.dtype), jax.lax.cummax(jnp.max(worn_by, axis=1)))
    error = jnp.where(doubled[:, None, None, None, None], error[_ANALYSES - 1 :: _ANALYSES], jnp.nan)
    return March(flanks, error, status, seen)
