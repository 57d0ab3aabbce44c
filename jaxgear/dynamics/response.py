"""Results of a recorded orbit: dynamic factor, DTE, spectra, contact-loss share."""

from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Int8

from ..contact.status import WithStatus
from ..numerics import Checked, result
from .integrate import SIMPSON, Steps, history, largest, mean, one_step, share, smallest
from .oscillator import Oscillator, State

Scalar = Float[Array, ""]

FORCE_REFERENCE = 1e-6  # N, of levels (ISO 1683)
# an order repeats after so many cycles if times their number it is whole but for rounding
_ROUNDING = 1e-6


class SpeedResponse(WithStatus, Checked):
    """Steady vibration over mesh frequency; `jax.vmap` puts batch axes in front of every array.

    Attributes:
        mesh_frequency: [Hz], increasing, shape (speeds,).
        dynamic_factor: largest elastic mesh force of the orbit over the static force (K_v), shape (speeds,).
        dte_rms: rms of the dynamic transmission error (DTE) about its mean [um], shape (speeds,).
        dte_mean, dte_min, dte_max: mean and extremes of the DTE [um], shape (speeds,).
        force_harmonics: amplitudes of the elastic mesh force at the orders [N], shape (speeds, orders); 0 at orders
            that do not occur with the period of the orbit.
        velocity_harmonics: amplitudes of the rate of the DTE [um/s], shape (speeds, orders).
        contact_loss_share: share of the time without contact, shape (speeds,).
        back_side_contact: share of the time with contact of the coast flanks, shape (speeds,).
        period: number of mesh cycles after which the orbit repeats, shape (speeds,); 0 if it does not repeat within the
            largest number tried.
        poincare_dte, poincare_velocity: DTE [um] and its rate [um/s] at mesh position 0 of successive cycles, shape
            (speeds, points); they repeat with the period of the orbit.
        status: `converged` if a steady state was reached and all contacts of the mesh force have converged, shape
            (speeds,); otherwise the values belong to an aperiodic or unsettled motion, or to an invalid mesh force.
        state: coordinates [um] and velocities [um/s] at mesh position 0, each of shape (speeds, coordinates).
        orders: multiples of the mesh frequency of the harmonics.
        direction: order in which the speeds were computed, "up" or "down".
    """

    mesh_frequency: Float[Array, "*batch speeds"] = result("Hz")
    dynamic_factor: Float[Array, "*batch speeds"] = result()
    dte_rms: Float[Array, "*batch speeds"] = result("um")
    dte_mean: Float[Array, "*batch speeds"] = result("um")
    dte_min: Float[Array, "*batch speeds"] = result("um")
    dte_max: Float[Array, "*batch speeds"] = result("um")
    force_harmonics: Float[Array, "*batch speeds orders"] = result("N")
    velocity_harmonics: Float[Array, "*batch speeds orders"] = result("um/s")
    contact_loss_share: Float[Array, "*batch speeds"] = result()
    back_side_contact: Float[Array, "*batch speeds"] = result()
    period: Int[Array, "*batch speeds"] = result()
    poincare_dte: Float[Array, "*batch speeds points"] = result("um")
    poincare_velocity: Float[Array, "*batch speeds points"] = result("um/s")
    status: Int8[Array, "*batch speeds"] = result()
    state: tuple[Float[Array, "*batch speeds coordinates"], Float[Array, "*batch speeds coordinates"]] = result()
    orders: tuple[float, ...] = eqx.field(static=True)
    direction: Literal["up", "down"] = eqx.field(static=True)

    @property
    def force_levels(self) -> Float[Array, "*batch speeds orders"]:
        """Levels of the rms values of the force harmonics [dB], re 1 uN (ISO 1683); minus infinity for no force."""
        return 20 * jnp.log10(self.force_harmonics / (2**0.5 * FORCE_REFERENCE))


class Sums(NamedTuple):
    """Extremes and integrals over the mesh position, accumulated over the steps of an orbit.

    Attributes:
        peak: largest elastic mesh force [N].
        lowest, highest: extremes of the DTE [um].
        mean, square: integrals of the DTE minus its value at the start, and of the square of this difference [um,
            um^2].
        apart, coast: time without contact and with contact of the coast flanks [cycles].
        force, dte: complex Fourier integrals, shape (orders,).
    """

    peak: Scalar
    lowest: Scalar
    highest: Scalar
    mean: Scalar
    square: Scalar
    apart: Scalar
    coast: Scalar
    force: Array
    dte: Array


def no_sums(orders: Float[Array, " orders"]) -> Sums:
    """Sums before the first step."""
    zero = jnp.zeros((), orders.dtype)
    spectrum = jax.lax.complex(jnp.zeros_like(orders), jnp.zeros_like(orders))
    return Sums(zero - jnp.inf, zero + jnp.inf, zero - jnp.inf, zero, zero, zero, zero, spectrum, spectrum)


def waves_of(orders: Float[Array, " orders"], phase: Float[Array, " nodes"]) -> Float[Array, "nodes waves"]:
    """Cosines and negative sines of the orders at mesh positions of one cycle [base pitches], shape (nodes, waves)."""
    turn = 2 * jnp.pi * phase[:, None] * orders[None]
    return jnp.concatenate([jnp.cos(turn), -jnp.sin(turn)], axis=1)


def with_step(
    sums: Sums,
    oscillator: Oscillator,
    y: State,
    step: Steps,
    mesh_frequency: Scalar,
    *,
    waves: Float[Array, "3 waves"],
    origin: Scalar,
) -> tuple[State, Sums]:
    """Advance state and sums by one step.

    Args:
        sums: sums of the previous steps.
        oscillator: the oscillator.
        y: state at the start of the step.
        step: the step.
        mesh_frequency: mesh frequency [Hz].
        waves: waves from `waves_of` at the start, in the middle and at the end of the step.
        origin: DTE that is subtracted for mean and square [um].
    """
    end = one_step(oscillator, y, step, mesh_frequency)
    begin = jax.tree.map(lambda part: part[None, None], y)
    of = history(oscillator, begin, end, jax.tree.map(lambda part: part[None], step), mesh_frequency)
    off = of.dte - origin

    def integral(values):
        return step.length * mean(of, values)

    # a product of matrices, so that the compiler does not evaluate the force again for every order
    weights = step.length * jnp.asarray(SIMPSON, off.dtype)
    spectra = (weights[None] * jnp.stack([of.force[:, 0], of.dte[:, 0]])) @ waves
    force, dte = jax.lax.complex(*jnp.split(spectra, 2, axis=1))

    return end, Sums(
        jnp.maximum(sums.peak, largest(of.force)),
        jnp.minimum(sums.lowest, smallest(of.dte)),
        jnp.maximum(sums.highest, largest(of.dte)),
        sums.mean + integral(off),
        sums.square + integral(off**2),
        sums.apart + step.length * share(of, of.force == 0),
        sums.coast + step.length * share(of, of.force < 0),
        sums.force + force,
        sums.dte + dte,
    )


def with_cycle(before: Sums, of_cycle: Sums, cycle: Int[Array, ""], orders: Float[Array, " orders"]) -> Sums:
    """Add a cycle to the sums; its spectra are rotated by the phase of the previous cycles.

    Args:
        before: sums of all previous cycles.
        of_cycle: sums including the new cycle, except for the spectra, which contain the new cycle only.
        cycle: number of previous cycles.
        orders: multiples of the mesh frequency.
    """
    angle = 2 * jnp.pi * orders * cycle.astype(orders.dtype)
    turn = jax.lax.complex(jnp.cos(angle), -jnp.sin(angle))
    force, dte = before.force + turn * of_cycle.force, before.dte + turn * of_cycle.dte
    return of_cycle._replace(force=force, dte=dte)


class Numbers(NamedTuple):
    """Results of an orbit; names and units as in `SpeedResponse`."""

    dynamic_factor: Scalar
    dte_rms: Scalar
    dte_mean: Scalar
    dte_min: Scalar
    dte_max: Scalar
    force_harmonics: Float[Array, " orders"]
    velocity_harmonics: Float[Array, " orders"]
    contact_loss_share: Scalar
    back_side_contact: Scalar


def numbers_of(
    sums: Sums,
    mesh_frequency: Scalar,
    *,
    cycles: Scalar,
    orders: Float[Array, " orders"],
    origin: Scalar,
    static_force: Scalar,
) -> Numbers:
    """Results of an orbit from the sums over its cycles.

    Args:
        sums: sums over all cycles.
        mesh_frequency: mesh frequency [Hz].
        cycles: number of cycles.
        orders: multiples of the mesh frequency, shape (orders,).
        origin: DTE that was subtracted for mean and square [um].
        static_force: static mesh force [N].
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
        amplitudes(sums.dte) * 2 * jnp.pi * orders * mesh_frequency,
        sums.apart / cycles,
        sums.coast / cycles,
    )
