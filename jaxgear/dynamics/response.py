"""What a recorded orbit of an oscillator says: dynamic factor, vibration, spectra, shares of contact."""

from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..numerics import Checked, result
from .integrate import Steps, one_cycle
from .oscillator import Oscillator, State

Scalar = Float[Array, ""]

# Simpson's rule over begin, middle and end of a step
_SIMPSON = (1 / 6, 4 / 6, 1 / 6)
# an order repeats after so many cycles if times their number it is whole but for rounding
_ROUNDING = 1e-6


class SpeedResponse(Checked):
    """Steady vibration over mesh frequency; `jax.vmap` puts batch axes in front of every array.

    Attributes:
        mesh_frequency: [Hz], increasing, shape (speeds,).
        dynamic_factor: largest elastic mesh force of the orbit over the static force (K_v), shape (speeds,).
        approach_rms: rms of the approach about its mean [um], shape (speeds,).
        approach_mean, approach_min, approach_max: [um], shape (speeds,).
        force_harmonics: amplitudes of the elastic mesh force at the orders [N], shape (speeds, orders); 0 at orders
            that the orbit cannot have.
        velocity_harmonics: amplitudes of the rate of the approach [um/s], shape (speeds, orders).
        no_contact: share of the time without contact, shape (speeds,).
        coast_contact: share of the time with contact of the coast flanks, shape (speeds,).
        period: mesh cycles after which the orbit repeats, 0 where it does not within the largest number tried, shape
            (speeds,).
        poincare_approach, poincare_velocity: approach [um] and its rate [um/s] at mesh position 0 of successive cycles,
            shape (speeds, points); they repeat where the orbit does.
        settled: whether a steady state was reached, shape (speeds,); where it is not, the numbers are of a motion that
            is aperiodic, or still on its way.
        state: coordinates [um] and velocities [um/s] at mesh position 0, each of shape (speeds, coordinates).
        orders: multiples of the mesh frequency of the harmonics.
        direction: in which the speeds were gone through.
    """

    mesh_frequency: Float[Array, "*batch speeds"] = result("Hz")
    dynamic_factor: Float[Array, "*batch speeds"] = result()
    approach_rms: Float[Array, "*batch speeds"] = result("um")
    approach_mean: Float[Array, "*batch speeds"] = result("um")
    approach_min: Float[Array, "*batch speeds"] = result("um")
    approach_max: Float[Array, "*batch speeds"] = result("um")
    force_harmonics: Float[Array, "*batch speeds orders"] = result("N")
    velocity_harmonics: Float[Array, "*batch speeds orders"] = result("um/s")
    no_contact: Float[Array, "*batch speeds"] = result()
    coast_contact: Float[Array, "*batch speeds"] = result()
    period: Int[Array, "*batch speeds"] = result()
    poincare_approach: Float[Array, "*batch speeds points"] = result("um")
    poincare_velocity: Float[Array, "*batch speeds points"] = result("um/s")
    settled: Bool[Array, "*batch speeds"] = result()
    state: tuple[Float[Array, "*batch speeds coordinates"], Float[Array, "*batch speeds coordinates"]] = result()
    orders: tuple[float, ...] = eqx.field(static=True)
    direction: Literal["up", "down"] = eqx.field(static=True)


class Sums(NamedTuple):
    """Of an orbit's cycles so far: extremes, and integrals over the mesh position.

    Attributes:
        peak: largest elastic mesh force [N].
        lowest, highest: of the approach [um].
        mean, square: integrals of the approach from where it began, and of its square [um, um^2].
        apart, coast: time without contact and with coast flanks [cycles].
        force, velocity: complex Fourier integrals, shape (orders,).
    """

    peak: Scalar
    lowest: Scalar
    highest: Scalar
    mean: Scalar
    square: Scalar
    apart: Scalar
    coast: Scalar
    force: Array
    velocity: Array


def no_sums(orders: Float[Array, " orders"]) -> Sums:
    """Before the first cycle."""
    zero = jnp.zeros((), orders.dtype)
    spectrum = jax.lax.complex(jnp.zeros_like(orders), jnp.zeros_like(orders))
    return Sums(zero - jnp.inf, zero + jnp.inf, zero - jnp.inf, zero, zero, zero, zero, spectrum, spectrum)


def with_cycle(
    sums: Sums,
    oscillator: Oscillator,
    y: State,
    steps: Steps,
    mesh_frequency: Scalar,
    *,
    orders: Float[Array, " orders"],
    cycle: Int[Array, ""],
    origin: Scalar,
) -> tuple[State, Sums]:
    """The state after one more cycle, and the sums with it.

    Args:
        sums: of the cycles before.
        oscillator: what vibrates.
        y: state at mesh position 0.
        steps: of the cycle.
        mesh_frequency: [Hz].
        orders: multiples of the mesh frequency.
        cycle: how many came before.
        origin: approach from which mean and square are taken [um].
    """
    end, begins = one_cycle(oscillator, y, steps, mesh_frequency)
    begins = jax.tree.map(lambda part, last: jnp.concatenate([part, last[None]]), begins, end)
    phases = jnp.append(steps.phase, jnp.ones_like(steps.phase[:1]))
    q, v = jax.vmap(lambda phase, x, v: oscillator.along(phase, (x, v), mesh_frequency))(phases, *begins)
    h = steps.length / mesh_frequency
    # the cubic through approach and rate at both ends of a step
    middle = (q[:-1] + q[1:]) / 2 + h * (v[:-1] - v[1:]) / 8
    rate = jnp.where(h > 0, 1.5 * jnp.diff(q) / jnp.where(h > 0, h, 1.0), v[:-1]) - (v[:-1] + v[1:]) / 4
    force = jax.vmap(oscillator.mesh_force.force)
    forces = (force(steps.first, q[:-1]), force(steps.middle, middle), force(steps.last, q[1:]))
    approaches, rates = (q[:-1], middle, q[1:]), (v[:-1], rate, v[1:])

    def integral(parts):
        return sum(weight * jnp.sum(steps.length * part) for weight, part in zip(_SIMPSON, parts))

    def spectrum(parts):
        shares = [weight * steps.length * part for weight, part in zip(_SIMPSON, parts)]
        turned = [share @ wave for share, wave in zip(shares, waves)]
        return sum(turned[1:], turned[0])

    at = [steps.phase + share * steps.length + cycle for share in (0.0, 0.5, 1.0)]
    waves = [jnp.exp(jax.lax.complex(jnp.zeros(()), -2 * jnp.pi) * phase[:, None] * orders[None]) for phase in at]
    off = [part - origin for part in approaches]
    return end, Sums(
        jnp.maximum(sums.peak, jnp.max(_crest(*forces))),
        jnp.minimum(sums.lowest, -jnp.max(_crest(*(-part for part in approaches)))),
        jnp.maximum(sums.highest, jnp.max(_crest(*approaches))),
        sums.mean + integral(off),
        sums.square + integral([part**2 for part in off]),
        sums.apart + integral([(part == 0).astype(q.dtype) for part in forces]),
        sums.coast + integral([(part < 0).astype(q.dtype) for part in forces]),
        sums.force + spectrum(forces),
        sums.velocity + spectrum(rates),
    )


class Numbers(NamedTuple):
    """What the sums of a whole orbit amount to; names and units of `SpeedResponse`."""

    dynamic_factor: Scalar
    approach_rms: Scalar
    approach_mean: Scalar
    approach_min: Scalar
    approach_max: Scalar
    force_harmonics: Float[Array, " orders"]
    velocity_harmonics: Float[Array, " orders"]
    no_contact: Scalar
    coast_contact: Scalar


def numbers_of(
    sums: Sums, *, cycles: Scalar, orders: Float[Array, " orders"], origin: Scalar, static_force: Scalar
) -> Numbers:
    """Numbers of an orbit from the sums over its cycles.

    Args:
        sums: over so many cycles.
        cycles: their number.
        orders: multiples of the mesh frequency.
        origin: as in `with_cycle` [um].
        static_force: [N].
    """
    mean = sums.mean / cycles
    whole = jnp.abs(orders * cycles - jnp.round(orders * cycles)) < _ROUNDING

    def amplitudes(integral):
        return jnp.where(whole, 2 * jnp.abs(integral) / cycles, 0.0)

    variance = jnp.maximum(sums.square / cycles - mean**2, 0.0)
    return Numbers(
        sums.peak / static_force,
        jnp.where(variance > 0, jnp.sqrt(jnp.where(variance > 0, variance, 1.0)), 0.0),
        origin + mean,
        sums.lowest,
        sums.highest,
        amplitudes(sums.force),
        amplitudes(sums.velocity),
        sums.apart / cycles,
        sums.coast / cycles,
    )


def _crest(begin: Any, middle: Any, end: Any):
    """Highest value within each step of the parabola through its begin, middle and end."""
    bend = 2 * (begin + end) - 4 * middle
    slope = 4 * middle - 3 * begin - end
    inside = (bend < 0) & (slope > 0) & (slope < -2 * bend)
    top = begin - slope**2 / jnp.where(inside, 4 * bend, 1.0)
    return jnp.where(inside, top, jnp.maximum(begin, end))
