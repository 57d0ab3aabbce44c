"""Settled vibration, and dynamic profile modification: the relief with the least vibration at one condition."""

import dataclasses
import operator
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int8

from ..contact.status import Status, Statuses, WithStatus, status_of
from ..dynamics.orbit import Orbit, settled_orbit
from ..microgeometry import Linear, Polynomial, Power, Quadratic
from ..numerics import Checked, Given, Numbers, check, concrete, kernel, real, result, safe_divide, spread, whole
from ..numerics.pareto import decoded, halton, next_generation, random_strings
from .model import DimensionlessModel, loaded_te, with_relief
from .relief import CycleRelief

Scalar = Float[Array, ""]

# Change of the state over the recorded cycles, relative to its size, below which a vibration counts as settled
_SETTLED = 1e-5


def settled_vibration(
    model: DimensionlessModel,
    frequency: Given,
    *,
    start: Numbers | None = None,
    settling: int = 100,
    periods: int = 2,
    steps: int = 96,
) -> Orbit:
    """Steady vibration of a model from an initial state, differentiable with respect to the model and the frequency.

    The results are dimensionless: displacements in half clearances, forces over b k_mean, and the mesh frequency is
    Omega / (2 pi). The status is `Status.NO_STEADY_MOTION` if the state still changes over the recorded cycles, the
    orbit is unstable, or the vibration has left the range of a polynomial.

    Derivatives are those of the periodic orbit (implicit function theorem over the recorded cycles). If the motion has
    not settled they are those of the recorded cycles from a fixed initial state.

    Args:
        model: dimensionless model.
        frequency: Omega, mesh frequency over omega_0.
        start: state (x, x') at mesh position 0, shape (2,); None for the loaded mean at rest.
        settling: number of mesh cycles before the recorded cycles; transients decay by exp(-2 pi zeta / Omega) in each.
        periods: number of recorded mesh cycles, a multiple of the period: 2 for sub-harmonics of order 1/2.
        steps: Runge-Kutta steps of order four per mesh cycle.
    """
    check("frequency", frequency, "", low=0.0, open_low=True)
    for name, value in (("settling", settling), ("periods", periods), ("steps", steps)):
        whole(name, value)
    frequency = real(frequency).astype(model.load.dtype)
    begin = at_rest(model) if start is None else real(start)
    return _settle(model, frequency, begin, settling, periods, steps)


def at_rest(model: DimensionlessModel) -> Float[Array, " two"]:
    """State (x_m, 0) of the loaded mean without vibration, shape (2,)."""
    mean = loaded_te(model.clearance, model.load)
    shift = jnp.zeros_like(mean) if model.relief is None else jnp.mean(jax.vmap(model.relief)(_phases(64)))
    return jnp.stack([mean + shift, jnp.zeros_like(mean)])


@kernel
def _settle(model: DimensionlessModel, frequency: Scalar, begin, settling: int, periods: int, steps: int) -> Orbit:
    start = begin[:1], begin[1:]
    orbit = settled_orbit(model.oscillator(), frequency / (2 * jnp.pi), start, steps, settling, periods)
    residual = safe_divide(orbit.residual, jnp.max(jnp.abs(orbit.dte)))
    settled = jnp.isfinite(orbit.dte).all() & orbit.stable & (residual < _SETTLED)
    return dataclasses.replace(orbit, status=status_of({Status.NO_STEADY_MOTION: ~settled}))


def _phases(count: int) -> Float[Array, " positions"]:
    return real(np.arange(count) / count)


Free = Literal["amount", "length", "curve"]


def vector(relief: CycleRelief, free: Sequence[str]) -> Float[Array, " numbers"]:
    """Free parameters of a relief as a vector, shape (numbers,)."""
    parts = [jnp.ravel(leaf) for name in free for leaf in jax.tree.leaves(getattr(relief, name))]
    if not parts:
        raise ValueError(f"{type(relief.curve).__name__} has no coefficients to optimize")
    return jnp.concatenate(parts)


Vector = Float[Array, " numbers"]
Bounds = Mapping[str, tuple[Numbers, Numbers]]  # lowest and highest values of what is free


def made(relief: CycleRelief, free: Sequence[str], vector: Float[Array, " numbers"]) -> CycleRelief:
    """Relief with other values of its free parameters, shape (numbers,)."""
    for name in free:
        leaves, tree = jax.tree.flatten(getattr(relief, name))
        new = []
        for leaf in leaves:
            part, vector = vector[: leaf.size], vector[leaf.size :]
            new.append(part.reshape(leaf.shape))
        relief = eqx.tree_at(operator.attrgetter(name), relief, jax.tree.unflatten(tree, new))
    return relief


def _bounds_of(
    model: DimensionlessModel, relief: CycleRelief, free: Sequence[str], given: Bounds
) -> tuple[Vector, Vector]:
    if set(given) - set(free):
        raise ValueError(f"bounds = {sorted(given)} must be of what is free, {free!r}")
    ratio = relief.contact_ratio
    usual: dict[str, tuple[Numbers, Numbers]] = {
        "amount": (jnp.zeros_like(model.load), 4 * model.load),
        "length": (0.2 * (ratio - 1), 0.5 * ratio),
        "curve": (0.5, 4.0) if isinstance(relief.curve, Power) else (-4.0, 4.0),
    }
    if isinstance(relief.curve, Polynomial | Quadratic):  # b_0 would be a step where the relief starts
        fixed = jnp.concatenate([jnp.ravel(leaf) for leaf in jax.tree.leaves(relief.curve)])
        inner = jnp.arange(len(fixed)) > 0
        usual["curve"] = (jnp.where(inner, -4.0, fixed), jnp.where(inner, 4.0, fixed))
    low, high = [], []
    for name in free:
        count = sum(leaf.size for leaf in jax.tree.leaves(getattr(relief, name)))
        least, most = given.get(name, usual[name])
        known = concrete(real(least)), concrete(real(most))
        if known[0] is not None and known[1] is not None and (known[0] > known[1]).any():
            raise ValueError(f"bounds of {name} = ({least}, {most}) must not fall")
        low.append(jnp.broadcast_to(real(least), count))
        high.append(jnp.broadcast_to(real(most), count))
    return jnp.concatenate(low), jnp.concatenate(high)


_SETTLING, _PERIODS = 60, 2  # cycles of every evaluation
_STEPS = 64  # of every evaluation over a period of omega_0, and over a cycle where that is longer
_LAST_SETTLING, _FINER = 400, 4  # cycles of the amplitudes that are reported, and their steps over those of the search
# Designs all over the bounds, and how many of them Adam starts from: near the natural frequency its valleys are narrow,
# and the best 4 of 64 lead to amplitudes three times as large. Evaluated in a second or two, compiled in twenty.
_SPREAD, _BEST = 1024, 8
_POSITIONS = 128  # of the static curve
_KICK = 0.5  # velocity over F_m of the second start, which finds a detached branch
_STATIC_ITERATIONS = 300
# Of the genetic algorithm: strings per generation and bits per number; probabilities of crossover and mutation.
_POPULATION, _BITS, _CROSSOVER, _MUTATION = 40, 10, 0.5, 0.5
_RATE, _LAST_RATE = 0.05, 0.02  # first step over the width of the bounds, and the last one over the first


class OperatingCondition(NamedTuple):
    """Operating condition of dynamic profile modification: a row of the table of the paper on dynamic modification.

    Attributes:
        name: name of the resonance.
        frequency: Omega, mesh frequency over omega_0.
        free: parameters of the relief that are optimized.
        curve: shape of the relief at the start.
        goal: goal in the words of the paper; `dynamic_profile_modification` always minimizes the amplitude, which is
            equivalent to the least velocity only for a motion of one harmonic.
    """

    name: str
    frequency: float
    free: tuple[Free, ...]
    curve: Any
    goal: str


def operating_conditions(frequency: Given = 1.0) -> tuple[OperatingCondition, ...]:
    """The four operating conditions of the paper, with super-harmonics of order 2 and 3 as separate rows.

    Args:
        frequency: natural frequency about the loaded mean over omega_0, `LoadedMean.frequency`; 1 for a dead zone.
    """
    omega = float(frequency)
    # a polynomial of degree 5 with b_0 = 0: no step where the relief starts
    shape = Polynomial(real([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    return (
        OperatingCondition("primary", omega, ("amount", "curve"), Power(real(1.2)), "lower the peak"),
        OperatingCondition("super-harmonic 1/2", omega / 2, ("curve",), shape, "detune the coupling that excites it"),
        OperatingCondition("super-harmonic 1/3", omega / 3, ("curve",), shape, "detune the coupling that excites it"),
        OperatingCondition("high speed", 3 * omega, ("amount", "length"), Linear(), "least impact velocity"),
        OperatingCondition("combination", 2 * omega, ("curve",), shape, "suppress the parametric instability"),
    )


class DynamicModification(WithStatus, Checked):
    """Dynamic optimum for one operating condition, and the static optimum; amplitudes are half of the range of x.

    Attributes:
        frequency: Omega, mesh frequency over omega_0.
        static, dynamic: reliefs that minimize the static and the dynamic amplitude, with the same free parameters.
        amplitude: amplitude at this frequency without relief, with the static and with the dynamic optimum, shape (3,);
            the larger one of the vibrations from two starts.
        static_amplitude: amplitude at vanishing speed and steady torque of these three, shape (3,).
        status: status of these three, shape (3,).
    """

    frequency: Scalar = result()
    static: CycleRelief
    dynamic: CycleRelief
    amplitude: Float[Array, " three"] = result()
    static_amplitude: Float[Array, " three"] = result()
    status: Int8[Array, " three"] = result()


def dynamic_profile_modification(
    model: DimensionlessModel,
    frequency: Given,
    relief: CycleRelief,
    *,
    free: Sequence[Free] = ("amount", "curve"),
    bounds: Bounds | None = None,
    iterations: int = 60,
    method: Literal["adam", "genetic"] = "adam",
    seed: int = 0,
) -> DynamicModification:
    """Find the parameters of a relief that minimize the amplitude of a model at one frequency.

    The amplitude is half of the range of x in the steady vibration. Its gradient is exact (implicit function theorem of
    the periodic orbit). As the amplitude has several minima, projected Adam steps start from the given relief, the
    static optimum, twice the parameters of the static optimum, the relief nearest to none, and the best eight of 1024
    reliefs spread over the bounds. The genetic algorithm of the paper needs no gradient; its best relief competes with
    the first four. The static optimum minimizes the range of x at vanishing speed with the same free parameters. The
    amplitudes of the result use four times as many steps as the search.

    Without torque fluctuation and displacement, a relief that keeps the static x constant keeps x constant at every
    speed: static and dynamic optimum then coincide, except for a parametric instability about this state. C affects
    that instability only by the change of slope of a polynomial f, not for a dead zone.

    Args:
        model: dimensionless model; its own relief is ignored.
        frequency: Omega, mesh frequency over omega_0.
        relief: relief at the start, with the values of parameters that are not free.
        free: free parameters: "amount" (C_max), "length" (lambda), "curve" (all its coefficients).
        bounds: (low, high) by the name of the free parameter; defaults: `amount` 0 to 4 F_m [half clearances], `length`
            from a fifth of contact ratio - 1 to half of the contact ratio, `curve` 0.5 to 4 for an exponent and -4 to 4
            for coefficients, except b_0 of a polynomial, which is fixed. A bound of a curve may be a list, one number
            per coefficient.
        iterations: number of steps of Adam, or of generations of 40 designs.
        method: "adam", or "genetic" for a genetic algorithm with bit strings.
        seed: seed of the random numbers of "genetic".
    """
    check("frequency", frequency, "", low=0.0, open_low=True)
    whole("iterations", iterations)
    if method not in ("adam", "genetic"):
        raise ValueError(f'method = {method!r} must be "adam" or "genetic"')
    whole("seed", seed, 0)
    names = tuple(free)
    if not names or set(names) - {"amount", "length", "curve"}:
        raise ValueError(f'free = {names!r} must name "amount", "length" or "curve"')
    model = with_relief(model, None)
    low, high = _bounds_of(model, relief, names, bounds or {})
    at = real(frequency)
    width = jnp.where(high > low, high - low, 1.0)
    unit = jnp.clip((vector(relief, names) - low) / width, 0.0, 1.0)
    static = _static_search(model, relief, names, low, high, unit)
    further = jnp.clip(2 * static, 0.0, 1.0)
    none_free = jnp.clip(-low / width, 0.0, 1.0)  # no relief, where the free numbers reach it
    starts = jnp.stack([unit, static, further, none_free])
    steps = _steps(frequency)
    if method == "adam":
        ends = _dynamic_search(model, relief, names, low, high, at, (starts, _spread(low)), iterations, steps)
    else:
        ends = _genetic_search(model, relief, names, low, high, at, jax.random.key(seed), iterations, steps)[None]
    # near a threshold vibrations settle slowly: who wins is decided after many more cycles than the search takes
    none = eqx.tree_at(lambda r: r.amount, relief, jnp.zeros_like(relief.amount))
    candidates = [made(relief, names, low + (high - low) * x) for x in jnp.concatenate([starts, ends])]
    every = jax.tree.map(lambda *parts: jnp.stack(parts), none, *candidates)
    amplitude, status = _last_amplitudes(model, every, at, _FINER * steps)
    three = jnp.stack([jnp.array(0), jnp.array(2), 1 + jnp.nanargmin(amplitude[1:])])  # none, static and the best
    of_three = [jax.tree.map(lambda part, i=i: part[i], every) for i in three]
    at_rest_too = jnp.stack([_static_amplitude(model, part) for part in of_three])
    return DynamicModification(at, of_three[1], of_three[2], amplitude[three], at_rest_too, status[three])


def modification_table(rows: Sequence[tuple[OperatingCondition, DynamicModification]]) -> str:
    """Text table of the amplitudes at each condition without relief, with the static and with the dynamic optimum."""
    lines = [f"{'condition':20} {'Omega':>6} {'free':14} {'none':>8} {'static':>8} {'dynamic':>8}  static -> dynamic"]
    for condition, found in rows:
        numbers = " ".join(f"{float(value):8.5f}" for value in found.amplitude)
        before, after = (vector(part, condition.free) for part in (found.static, found.dynamic))
        change = " -> ".join("(" + ", ".join(f"{float(v):.3g}" for v in part) + ")" for part in (before, after))
        free = "+".join(condition.free)
        lines.append(f"{condition.name:20} {float(found.frequency):6.3f} {free:14} {numbers}  {change}")
    return "\n".join(lines)


def _steps(frequency) -> int:
    """Steps per mesh cycle of the search; of a frequency that is being traced those of 1 and more."""
    known = concrete(real(frequency))
    return _STEPS if known is None else _STEPS * max(round(1 / float(known)), 1)


def _spread(like: Float[Array, " numbers"]) -> Float[Array, "designs numbers"]:
    """Points of a Halton sequence in the unit box, always the same."""
    return jnp.asarray(halton(len(like), _SPREAD), like.dtype)


def _static_amplitude(model: DimensionlessModel, relief: CycleRelief) -> Scalar:
    """Half of the range of x where the mesh force equals F_m at every position: x = C + f^-1(F_m / stiffness)."""
    force = with_relief(model, relief).mesh_force
    phase = real(np.arange(_POSITIONS) / _POSITIONS)
    static = jax.vmap(force.static_te, in_axes=(0, None))(phase, model.load)
    return 0.5 * spread(static, axis=-1)


def _amplitude(
    model: DimensionlessModel, relief: CycleRelief, frequency: Scalar, steps: int, settling: int = _SETTLING
) -> tuple[Scalar, Statuses]:
    """The larger amplitude of two starts, at rest and kicked, and its status."""
    moved = with_relief(model, relief)
    rest = at_rest(moved)
    kicked = rest + jnp.stack([jnp.zeros_like(model.load), _KICK * model.load])
    starts = jnp.stack([rest, kicked])
    found = jax.vmap(lambda start: _settle(moved, frequency, start, settling, _PERIODS, steps))(starts)
    # a kick that leaves the range of a polynomial says nothing about the design
    second = jnp.where(jnp.isfinite(found.amplitude[1]), found.amplitude[1], -1.0)
    which = jnp.where(second > found.amplitude[0], 1, 0)
    return found.amplitude[which], found.status[which]


@kernel
def _last_amplitudes(model, reliefs, frequency, steps):
    return jax.vmap(lambda relief: _amplitude(model, relief, frequency, steps, _LAST_SETTLING))(reliefs)


@kernel
def _static_search(model, relief, free, low, high, unit):
    def value(x):
        return _static_amplitude(model, made(relief, free, low + (high - low) * x))

    return _adam(value, unit, _STATIC_ITERATIONS)[0]


@kernel
def _dynamic_search(model, relief, free, low, high, frequency, units, iterations, steps):
    """End points of Adam from each of the first units and from the best of the second."""

    def value(x):
        return _amplitude(model, made(relief, free, low + (high - low) * x), frequency, steps)[0]

    starts, spread = units
    found = jax.vmap(value)(spread)
    best = jnp.argsort(jnp.where(jnp.isfinite(found), found, jnp.inf))[:_BEST]
    return jax.vmap(lambda unit: _adam(value, unit, iterations)[0])(jnp.concatenate([starts, spread[best]]))


@kernel
def _genetic_search(model, relief, free, low, high, frequency, key, generations, steps):
    """Best point of the unit box found by a genetic algorithm with bit strings; the fitness is 1 / amplitude."""

    def value(x):
        return _amplitude(model, made(relief, free, low + (high - low) * x), frequency, steps)[0]

    def step(carry, key):
        strings, best, least = carry
        points = decoded(strings, _BITS).astype(low.dtype)
        found = jax.vmap(value)(points)
        found = jnp.where(jnp.isfinite(found), found, jnp.inf)
        first = jnp.argmin(found)
        best = jnp.where(found[first] < least, points[first], best)
        strings = next_generation(key, strings, 1 / found, _CROSSOVER, _MUTATION)
        return (strings, best, jnp.minimum(least, found[first])), None

    begin, key = jax.random.split(key)
    strings = random_strings(begin, _POPULATION, len(low), _BITS)
    start = strings, jnp.full_like(low, 0.5), jnp.full((), jnp.inf, low.dtype)
    (_, best, _), _ = jax.lax.scan(step, start, jax.random.split(key, generations))
    return best


def _adam(value, start, iterations: int):
    """Best point found by Adam within the unit box, and its value."""
    import optax

    method = optax.adam(optax.cosine_decay_schedule(_RATE, iterations, _LAST_RATE))

    def step(carry, _):
        x, state, best, least = carry
        found, slope = jax.value_and_grad(value)(x)
        ok = jnp.isfinite(found)
        better = ok & (found < least)
        best, least = jnp.where(better, x, best), jnp.where(better, found, least)
        slope = jnp.where(ok & jnp.isfinite(slope), slope, 0.0)
        # optax mixes its integer step count with floats, which strict promotion would forbid
        with jax.numpy_dtype_promotion("standard"):
            change, state = method.update(slope, state)
        return (jnp.clip(x + change, 0.0, 1.0), state, best, least), None

    first = (start, method.init(start), start, jnp.full((), jnp.inf, start.dtype))
    (_, _, best, least), _ = jax.lax.scan(step, first, length=iterations)
    return best, least
