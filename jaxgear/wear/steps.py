"""Wear on the host, two blocks at a time: of a length that suits the wear, with progress, and to be gone on with."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..contact import Mesh
from ..dynamics import Dynamics
from ..microgeometry import AbstractModification
from ..numerics import check, quick_jit, real
from .case import Case, case_of, marched
from .life import BLOCKS, WearLife, check_blocks, checked_revolutions, life_of
from .march import BLOCKS_OF_A_PAIR, Depth, March
from .vibration import LineLoad

Make = Callable[[], March]

# Share of a life in which the first rate of wear is found: short beside any block.
_TRIAL = 1e-9
# A block that wears more than the increment by this factor is done again; the next one grows by the second at most.
_SLACK, _GROWTH = 1.1, 2.0


def wear_in_steps(
    mesh: Mesh,
    torque: Any,
    revolutions: Any,
    *,
    coefficient: Any,
    pinion: AbstractModification | None = None,
    wheel: AbstractModification | None = None,
    deviation: Any = None,
    points: int | None = None,
    dynamics: Dynamics | None = None,
    line_load: LineLoad | None = None,
    blocks: int = BLOCKS,
    largest_increment: Any = None,
    keep: Callable[[Any, Make], March] | None = None,
    callback: Callable[[float, float], None] | None = None,
) -> WearLife:
    """`wear` of concrete numbers, in blocks of equal length, or as long as their wear allows.

    Args:
        mesh, torque, revolutions, coefficient, pinion, wheel, deviation, points, dynamics, line_load,
            blocks: as for `wear`.
        largest_increment: depth that no block wears off beyond a tenth more [um], in place of `blocks`. It should stay
            below what the teeth deflect under their load.
        keep: called for every two blocks with all that they depend on and with what makes them; gives them, made now or
            before. None to make them all.
        callback: called with the revolutions so far and all of them after every two blocks.

    Raises:
        TypeError, ValueError: as `wear`, and for an increment that is not greater than 0.
    """
    owner = "wear_in_steps"
    check_blocks(owner, blocks)
    flanks: dict[str, Any] = {"pinion": pinion, "wheel": wheel, "deviation": deviation}
    vibrating: dict[str, Any] = {"dynamics": dynamics, "line_load": line_load}
    case = case_of(owner, mesh, torque, coefficient=coefficient, points=points, **flanks, **vibrating)
    total = float(checked_revolutions(owner, revolutions, mesh))
    limit = None
    if largest_increment is not None:
        check(owner, "largest_increment", real(largest_increment), "um", low=0.0, open_low=True)
        limit = float(largest_increment)
    taken = keep or (lambda _, make: make())

    def two(start: Depth, length: float) -> March:
        lengths = jnp.full((1,), length, start.dtype)
        return taken((case, start, lengths), lambda: jax.block_until_ready(marched(case, start, lengths)))

    done, depth, found, at = 0.0, case.start(), [], [0.0]
    length = total / blocks if limit is None else _first(two, case, total, limit)
    left, lost = blocks // BLOCKS_OF_A_PAIR, False
    while (left > 0) if limit is None else (done < total):
        now = length if limit is None else min(length, (total - done) / BLOCKS_OF_A_PAIR)
        pair = two(depth, now)
        if limit is not None:
            most = _most(pair)
            length = now * min(limit / most, _GROWTH) if most > 0 else _GROWTH * now
            if most > _SLACK * limit and not lost:
                continue
            lost = lost or not np.asarray(pair.known).all()
            # the rest is gone through in pairs of one length, not in a last short one
            rest = total - done - BLOCKS_OF_A_PAIR * now
            length = rest / (BLOCKS_OF_A_PAIR * max(1, np.ceil(rest / (BLOCKS_OF_A_PAIR * length) - 1e-9)))
            if lost:  # the flanks of the rest are not known, however short the blocks
                length = rest / BLOCKS_OF_A_PAIR
        at += [done + now, done + BLOCKS_OF_A_PAIR * now]
        done, left = at[-1], left - 1
        if limit is not None and (total - done) < 1e-9 * total:
            done = at[-1] = total
        depth = pair.depth[-1]
        found.append(pair)
        if callback is not None:
            callback(done, total)
    return life_of(case, _together(found), jnp.asarray(at, depth.dtype))


def _first(two: Callable[[Depth, float], March], case: Case, total: float, limit: float) -> float:
    """Length of the first block by the wear of new flanks."""
    most = _most(two(case.start(), _TRIAL * total)) / _TRIAL
    return total / (BLOCKS_OF_A_PAIR * max(1.0, np.ceil(most / (BLOCKS_OF_A_PAIR * limit))))


def _most(pair: March) -> float:
    """Largest depth that one of two blocks wears off [um]."""
    most = float(np.diff(np.asarray(pair.depth).sum(axis=2), axis=0).max())
    return most if np.isfinite(most) else 0.0


@quick_jit
def _together(pairs: list[March]) -> March:
    """One march after the other: each begins with the flank with which the one before has ended."""

    def joined(*leaves):
        return jnp.concatenate([*(leaf[:-1] for leaf in leaves), leaves[-1][-1:]])

    depth, seen = jax.tree.map(joined, *[(pair.depth, pair.seen) for pair in pairs])
    # the flank with which a march begins is as well known as that with which the one before has ended
    known = jnp.concatenate([pairs[0].known[:1], *(pair.known[1:] for pair in pairs)])
    error = jnp.concatenate([pair.error for pair in pairs])
    return March(depth, error, jnp.cumsum(~known) == 0, seen)
