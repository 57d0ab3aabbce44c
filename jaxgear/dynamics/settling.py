"""Integration at one speed until the motion repeats, and the record of its orbit."""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from .integrate import Cycle, nodes_of, one_step, step_of
from .oscillator import Oscillator, Rest, State
from .response import Numbers, no_sums, numbers_of, with_cycle, with_step

T = TypeVar("T")

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
    """Mesh frequency [Hz] and the steps of a mesh cycle at this speed."""

    frequency: Scalar
    cycle: Cycle
    steps: Int[Array, ""]
    most_steps: int

    def over_cycle(self, function: Callable[..., T], carry: T) -> T:
        """Folds function(carry, step, indices of the nodes of its begin, middle and end) over the steps of a cycle."""
        # a position lies in the middle of the shortest step
        stride = 2 * (self.most_steps // self.steps)

        def more(index, carry):
            return function(carry, step_of(self.cycle, index, stride), nodes_of(index, stride))

        return jax.lax.fori_loop(0, self.steps, more, carry)


class _Settling(NamedTuple):
    """State of the integration towards a periodic orbit.

    Attributes:
        cycle: number of mesh cycles.
        period: mesh cycles after which the motion repeats, 0 for none yet.
        fresh: cycles since the state was last set by extrapolation.
        past: scaled states at mesh position 0 [um], the last one first, shape (states, unknowns); nan before `fresh`.
    """

    cycle: Int[Array, ""]
    period: Int[Array, ""]
    fresh: Int[Array, ""]
    past: Float[Array, "states unknowns"]


def settled(
    oscillator: Oscillator, y: State, speed: Speed, tolerance: Scalar, most_cycles: Int[Array, ""], most_periods: int
) -> tuple[State, Int[Array, ""]]:
    """Integrate until the motion repeats; returns the state and the mesh cycles of its orbit, 0 if none was found.

    Near an orbit the differences u of successive states follow u_n = a u_(n-1) + b u_(n-2), with the two dominant
    multipliers of the map of the orbit; other components have decayed. Three differences give a and b, and the sum of
    all further differences leads to the orbit (minimal polynomial extrapolation: S. Cabay, L. W. Jackson, SIAM J.
    Numer. Anal. 13 (1976) 734-752). The extrapolation is used if the multipliers belong to a stable orbit, on which the
    motion would settle as well, and if the orbit is near enough to lie in the same basin of attraction.
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
    """Signals that repeat on an orbit [um]: DTE and its scaled rate, and on supports every coordinate."""
    zero = jnp.zeros((), past.dtype)
    x, v = jnp.split(past, 2, axis=1)
    dte = jax.vmap(lambda x: oscillator.dte(zero, x))(x)
    seen = jnp.stack([dte, v @ oscillator.direction], axis=1)
    return seen if oscillator.stiffness is None else jnp.concatenate([seen, past], axis=1)


def _foreseen(past, seen, near: Bool[Array, " periods"], fresh) -> tuple[Unknowns, Scalar]:
    """Extrapolated state of the orbit, and its distance from the last state [um], inf without an extrapolation."""
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
    """Smallest number of cycles after which the state repeats, 0 for none.

    States after fewer cycles must be clearly apart: a motion that spirals towards an orbit can come close to an earlier
    state by chance.
    """
    closest: Bool[Array, " periods"] = away < tolerance
    nearer = jnp.concatenate([jnp.full((1,), jnp.inf, away.dtype), jax.lax.cummin(away)[:-1]])
    fits = closest & (nearer > _APART * tolerance)
    return jnp.where(jnp.any(fits), jnp.argmax(fits) + 1, 0)


# Least dynamic factor of a steady motion: over an orbit the mesh force has the mean of the static one, but for a small
# share where springs parallel to the mesh carry some of the load. A motion so slow that a mesh cycle barely changes
# it repeats within any tolerance, and is not steady.
_BALANCED = 0.99


class AtOneSpeed(NamedTuple):
    """Steady state at one speed; names and units as in `SpeedResponse`."""

    numbers: Numbers
    period: Int[Array, ""]
    dte: Float[Array, " points"]
    velocity: Float[Array, " points"]
    state: State


def steady_state(
    oscillator: Oscillator,
    y: State,
    speed: Speed,
    limits: Any,
    sizes: Any,
    static: Scalar,
    waves: Float[Array, "nodes waves"],
) -> AtOneSpeed:
    """Steady state at one speed from a start, and the record of its orbit.

    Args:
        oscillator: a single oscillator.
        y: state at the start.
        speed: mesh frequency and steps of a mesh cycle.
        limits, sizes: limits and sizes of the sweep, from `speed_sweep.prepared`.
        static: static mesh force [N].
        waves: waves of the orders at the nodes of a cycle, from `waves_of`.
    """
    frequency = speed.frequency
    y, period = settled(oscillator, y, speed, limits.tolerance, limits.most_cycles, sizes.most_periods)
    orders = jnp.asarray(sizes.orders, frequency.dtype)
    zero = jnp.zeros((), frequency.dtype)
    origin = oscillator.dte(zero, y[0])
    cycles = jnp.where(period > 0, period, sizes.points)

    def on(carry):
        return carry[0] < cycles

    def recorded(carry):
        cycle, y, sums, dtes, velocities = carry
        q, v = oscillator.dte(zero, y[0]), oscillator.dte_rate(zero, y[1], frequency)
        # an orbit's points repeat, so that there are as many for every speed
        here = jnp.arange(sizes.points) % cycles == cycle
        dtes, velocities = jnp.where(here, q, dtes), jnp.where(here, v, velocities)

        def more(carry, step, nodes):
            y, sums = carry
            return with_step(sums, oscillator, y, step, frequency, waves=waves[nodes], origin=origin)

        nothing = no_sums(orders)
        begin = sums._replace(force=nothing.force, dte=nothing.dte)
        y, of_cycle = speed.over_cycle(more, (y, begin))
        sums = with_cycle(sums, of_cycle, cycle, orders)
        return cycle + 1, y, sums, dtes, velocities

    nothing = jnp.zeros(sizes.points, frequency.dtype)
    begin = jnp.zeros_like(cycles), y, no_sums(orders), nothing, nothing
    _, y, sums, dtes, velocities = jax.lax.while_loop(on, recorded, begin)
    count = cycles.astype(frequency.dtype)
    numbers = numbers_of(sums, frequency, cycles=count, orders=orders, origin=origin, static_force=static)
    period = jnp.where(numbers.dynamic_factor > _BALANCED, period, 0)
    return AtOneSpeed(numbers, period, dtes, velocities, y)


_POSITIONS = 16  # of the first harmonic of the static transmission error
_QUARTER = 0.25  # of a mesh cycle
_FLAT = 1e-6  # a static transmission error with a smaller harmonic, as part of its deflection, has no softest position


class Kick(NamedTuple):
    """Start of a motion with separated flanks.

    Attributes:
        apart: DTE at the largest separation minus the DTE at rest [um], negative.
        acceleration: acceleration of the DTE while the flanks are separated [um/s^2].
        phase: mesh position of the largest separation, from -1/2 to 1/2 [base pitches].
        on: True if the flanks are separated.
    """

    apart: Scalar
    acceleration: Scalar
    phase: Scalar
    on: Array


def kick_of(oscillator: Oscillator, rest: Rest, factor: Scalar) -> Kick:
    """Separation of the flanks that leads to a dynamic factor at the next contact, and its mesh position.

    With the static deflection d of the mesh stiffness at mesh position 0, flanks that a constant force closes over a
    gap g reach the deflection d + (d^2 + 2 g d)^(1/2): a dynamic factor K needs g = ((K - 1)^2 - 1) d / 2. Up to K = 2
    the flanks stay in contact, and the DTE is released at (K - 1) d below its value at rest. If the backlash is smaller
    than the gap, the rebound from the coast flanks is stronger.

    Orbits of two mesh cycles have their largest separation a quarter of a cycle after the softest mesh position, where
    the mesh begins to stiffen. A gap there leads to these orbits over a range of sizes somewhat below their own dynamic
    factor; an impulse on flanks in contact leads to them only at scattered sizes. The range narrows towards the speed
    at which the orbit ends, and moves with speed, stiffness variation, damping and relief: 3.6 to 4.0 for unmodified
    gears at 1.36 times the natural frequency, 2.5 to 2.8 for relieved gears at 1.75 times the natural frequency.
    Several sizes are therefore tried (`settings.KICKS`).
    """
    along = oscillator.direction / oscillator.mass
    deflection = jnp.abs(rest.force) / rest.stiffness
    swing = factor - 1
    apart = jnp.where(swing > 1, 0.5 * (1 + swing**2), swing) * deflection
    phases = jnp.arange(_POSITIONS, dtype=deflection.dtype) / _POSITIONS
    static = jax.vmap(lambda at: oscillator.mesh_force.static_te(at, rest.force))(phases)
    cosine, sine = (jnp.mean(static * of(2 * jnp.pi * phases)) for of in (jnp.cos, jnp.sin))
    varies = jnp.hypot(cosine, sine) > _FLAT * deflection
    softest = jnp.where(varies, jnp.arctan2(sine, cosine) / (2 * jnp.pi), -_QUARTER)
    phase = softest + _QUARTER
    acceleration = oscillator.newton * jnp.sum(oscillator.direction * along) * jnp.abs(rest.force)
    return Kick(-apart, acceleration, phase - jnp.round(phase), factor > 1)


def kicked(oscillator: Oscillator, start: State, kick: Kick, mesh_frequency: Scalar) -> State:
    """State at mesh position 0 whose DTE reaches the largest separation of a kick, at rest, at its mesh position.

    Between mesh position 0 and the largest separation the DTE moves under the static force alone.
    """
    x, v = start
    time = kick.phase / mesh_frequency
    fallen = jnp.minimum(0.5 * kick.acceleration * time**2, -kick.apart)  # no farther than to the DTE at rest
    along = oscillator.direction / oscillator.mass
    share = along / jnp.sum(oscillator.direction * along)
    speed = -jnp.sign(time) * jnp.sqrt(2 * kick.acceleration * fallen)
    return x + share * jnp.where(kick.on, kick.apart + fallen, 0.0), v + share * jnp.where(kick.on, speed, 0.0)
