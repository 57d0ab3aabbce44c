"""Mesh cycles until the motion at one speed repeats, shortened where it can be foreseen where they lead."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from .integrate import Cycle, nodes_of, one_step, step_of
from .oscillator import Oscillator, State

Scalar = Float[Array, ""]
Unknowns = Float[Array, " unknowns"]

# An orbit of several cycles counts as one only if its cycles differ by so many tolerances.
_APART = 30.0
# Where a state comes as near to that of some cycles before, relative to its size, the map from one to the other is
# taken as linear; what follows from that is used if it leads no farther.
_NEAR, _FARTHEST = 0.05, 0.05
# Largest multiplier of such a map, nearly: one of a motion that does not grow, whatever rounding does to it.
_STABLE = 0.995
_DIFFERENCES = 3  # that determine the map of two unknowns


class Speed(NamedTuple):
    """A mesh frequency [Hz], and the steps of its cycles."""

    frequency: Scalar
    cycle: Cycle
    steps: Int[Array, ""]
    most_steps: int

    def over_cycle(self, function, carry):
        """Folds function(carry, step, indices of the nodes of its begin, middle and end) over the steps of a cycle."""
        # a position lies in the middle of the shortest step
        stride = 2 * (self.most_steps // self.steps)

        def more(index, carry):
            return function(carry, step_of(self.cycle, index, stride), nodes_of(index, stride))

        return jax.lax.fori_loop(0, self.steps, more, carry)


class _Settling(NamedTuple):
    """Of a motion so far.

    Attributes:
        cycle: number of mesh cycles.
        period: cycles after which it repeats, 0 for none yet.
        fresh: cycles since it was last moved.
        past: scaled states at mesh position 0 [um], the last one first, shape (states, unknowns); nan before `fresh`.
    """

    cycle: Int[Array, ""]
    period: Int[Array, ""]
    fresh: Int[Array, ""]
    past: Float[Array, "states unknowns"]


def settled(
    oscillator: Oscillator, y: State, speed: Speed, tolerance: Scalar, most_cycles: Int[Array, ""], most_periods: int
) -> tuple[State, Int[Array, ""]]:
    """State after as many cycles as it takes, and the cycles of its orbit, 0 where none was found.

    Once the motion is near an orbit the differences u of successive states follow u_n = a u_(n-1) + b u_(n-2), where
    the orbit's map has two multipliers, those of one coordinate; others have faded or do not matter. Two differences
    and the last one give a and b, and the sum of those to come leads to the orbit (minimal polynomial extrapolation:
    S. Cabay, L. W. Jackson, SIAM J. Numer. Anal. 13 (1976) 734-752). It is used where the multipliers are those of a
    stable orbit, on which the motion would have settled as well, and near enough to be in the same basin.
    """
    scale = jnp.concatenate([jnp.ones_like(y[0]), jnp.full_like(y[1], 1 / (2 * jnp.pi) / speed.frequency)])

    def on(now: _Settling):
        return (now.period == 0) & (now.cycle < most_cycles)

    def cycled(now: _Settling) -> _Settling:
        y = _state(now.past[0], scale)
        y = speed.over_cycle(lambda y, step, _: one_step(oscillator, y, step, speed.frequency), y)
        past = jnp.concatenate([_scaled(y, scale)[None], now.past[:-1]])
        seen = _seen(oscillator, past)
        size = jnp.nanmax(jnp.abs(seen))
        away = jnp.max(jnp.abs(seen[1 : most_periods + 1] - seen[:1]), axis=1) / size
        period, fresh = _period(away, tolerance), now.fresh + 1
        last, far = _foreseen(past, seen, away < _NEAR, fresh)
        moved = (period == 0) & (far < _FARTHEST * size)
        afresh = jnp.full_like(past, jnp.nan).at[0].set(last)
        past = jnp.where(moved, afresh, past)
        return _Settling(now.cycle + 1, period, jnp.where(moved, 0, fresh), past)

    none = jnp.zeros_like(most_cycles)
    first = _scaled(y, scale)
    past = jnp.full((_DIFFERENCES * most_periods + 1, len(first)), jnp.nan, first.dtype).at[0].set(first)
    end = jax.lax.while_loop(on, cycled, _Settling(none, none, none, past))
    return _state(end.past[0], scale), end.period


def _scaled(y: State, scale: Unknowns) -> Unknowns:
    return jnp.concatenate(y) * scale


def _state(scaled: Unknowns, scale: Unknowns) -> State:
    x, v = jnp.split(scaled / scale, 2)
    return x, v


def _seen(oscillator: Oscillator, past: Float[Array, "states unknowns"]) -> Array:
    """What repeats, all in um: of coordinates that nothing holds only the DTE does."""
    zero = jnp.zeros((), past.dtype)
    x, v = jnp.split(past, 2, axis=1)
    dte = jax.vmap(lambda x: oscillator.dte(zero, x))(x)
    seen = jnp.stack([dte, v @ oscillator.direction], axis=1)
    return seen if oscillator.stiffness is None else jnp.concatenate([seen, past], axis=1)


def _foreseen(past, seen, near: Bool[Array, " periods"], fresh) -> tuple[Unknowns, Scalar]:
    """State on which the motion will settle, and how far it is from the last one [um], inf for none."""
    stride = jnp.argmax(near) + 1
    places = stride * jnp.arange(_DIFFERENCES + 1)
    enough = jnp.any(near) & (fresh >= _DIFFERENCES * stride)

    def differences(values):
        there = jnp.where(enough, values[jnp.where(enough, places, 0)], 0.0)
        return there[:-1] - there[1:]

    last, before, first = differences(seen)
    # last = a before + b first, by least squares
    square, mixed, other = before @ before, before @ first, first @ first
    determinant = square * other - mixed**2
    is_plane = determinant > jnp.finfo(seen.dtype).eps ** 0.5 * square * other
    both = jnp.where(is_plane, determinant, 1.0)
    a = jnp.where(is_plane, other * (last @ before) - mixed * (last @ first), 0.0) / both
    b = jnp.where(is_plane, square * (last @ first) - mixed * (last @ before), 0.0) / both
    a = jnp.where(is_plane, a, (last @ before) / jnp.where(square > 0, square, 1.0))
    # both roots of z^2 - a z - b lie in a circle of less than one (E. I. Jury)
    stable = (jnp.abs(b) < _STABLE**2) & (jnp.abs(a) < _STABLE - b / _STABLE)
    rest = jnp.where(stable, 1 - a - b, 1.0)

    def still_to_come(differences):
        return ((a + b) * differences[0] + b * differences[1]) / rest

    usable = enough & stable & (square > 0)
    far = jnp.max(jnp.abs(still_to_come(differences(seen))))
    return past[0] + still_to_come(differences(past)), jnp.where(usable, far, jnp.inf)


def _period(away: Float[Array, " periods"], tolerance: Scalar) -> Int[Array, ""]:
    """The fewest cycles after which the state repeats, 0 for none.

    Fewer cycles must be clearly apart: an orbit that is still being approached along a spiral is met from afar now and
    then.
    """
    closest: Bool[Array, " periods"] = away < tolerance
    nearer = jnp.concatenate([jnp.full((1,), jnp.inf, away.dtype), jax.lax.cummin(away)[:-1]])
    fits = closest & (nearer > _APART * tolerance)
    return jnp.where(jnp.any(fits), jnp.argmax(fits) + 1, 0)
