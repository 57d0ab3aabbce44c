"""Integration of wear over revolutions in blocks: contact, wear rate, new flank.

A block is a step of Heun's method for d depth / d revolutions. Two blocks of one length are compared with one block of
twice the length from the same flank: a third of the difference is the error of the two, of second order. Both are one
Runge-Kutta table with five contact analyses, in one loop, so that the contact is compiled once.
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

# Weights of the wear rates in the flank of every analysis, in blocks: at the start, at the end of the first block by
# Euler's method, after the first block, and at the ends of the second and of the double block by Euler's method.
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
_DOUBLED = _ANALYSES - 1  # the analysis that only the double block needs; the four before it are two of each block
_STARTS = 0, 2  # the analyses of flanks at the start of a block
# Local errors are of third order: if a block has the error e, two have 2 e, and the double block has 8 e.
_SHARE = 2 / (8 - 2)


class WearRate(NamedTuple):
    """Result of a contact analysis: wear rate [um per revolution], further results `seen`, and status."""

    rate: Depth
    seen: Any
    status: Statuses


class March(NamedTuple):
    """Wear depths over consecutive blocks.

    Attributes:
        depth: wear depth at the start of every block and after the last one [um], leading axis (blocks + 1,).
        error: estimated error of the depth added by every pair of blocks [um], leading axis (pairs,); NaN where the
            contact of the double block has not converged.
        status: worst status of all contacts that have worn the flanks, shape (blocks + 1,).
        seen: further results of the contact on the flanks, leading axis (blocks + 1,).
    """

    depth: Float[Array, "steps gears parts slices points"]
    error: Float[Array, "pairs gears parts slices points"]
    status: Int8[Array, " steps"]
    seen: Any


def march(analyze: Callable[[Depth], WearRate], depth: Depth, revolutions: Float[Array, " pairs"]) -> March:
    """Integrate the wear depth over pairs of blocks.

    Args:
        analyze: contact analysis of flanks with a wear depth [um]; returns wear rate, further results and status.
        depth: wear depth at the start [um], shape (gears, parts, slices, points).
        revolutions: revolutions of the pinion in each block of every pair, shape (pairs,).
    """
    pairs, dtype = len(revolutions), depth.dtype
    stages, both, double = (jnp.asarray(table, dtype) for table in (_STAGES, _BOTH, _DOUBLE))
    # the last flank is analysed too, as the first stage of a pair that is not computed
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
    # reverse mode solves the contacts again instead of storing them
    _, (flanks, seen, status, error) = jax.lax.scan(jax.checkpoint(analysis), (depth, nothing), (number, length))
    steps = np.append((np.arange(pairs)[:, None] * _ANALYSES + np.array(_STARTS)).ravel(), pairs * _ANALYSES)
    flanks, seen = jax.tree.map(lambda leaf: leaf[steps], (flanks, seen))
    of_pairs = status[:-1].reshape(pairs, _ANALYSES)
    worn_by, doubled = of_pairs[:, :_DOUBLED].reshape(2 * pairs, -1), of_pairs[:, _DOUBLED] == Status.CONVERGED
    status = jnp.append(jnp.zeros((1,), status.dtype), jax.lax.cummax(jnp.max(worn_by, axis=1)))
    error = jnp.where(doubled[:, None, None, None, None], error[_ANALYSES - 1 :: _ANALYSES], jnp.nan)
    return March(flanks, error, status, seen)
