"""Results and mesh forces of steady vibration with derivatives, for orbits of up to four mesh cycles."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..contact.status import Status, Statuses, status_of
from .orbit import Orbit, find_orbit
from .oscillator import Oscillator, static_force
from .response import SpeedResponse

Numbers = Float[Array, "responses speeds"]
Positions = Float[Array, " positions"]
Scalar = Float[Array, ""]

# Mesh cycles of the orbits that are differentiated: an orbit of two, three or four cycles is one of twelve too.
_PERIODS = (1, 12)
_CHOICE = (len(_PERIODS), 0, 1, 1, 1)  # by the period that was found; 0 for none
# How far the orbit may be from the motion that was recorded, relative to its dynamic factor and rms.
_SAME = 1e-2


class SteadyNumbers(NamedTuple):
    """Results of steady vibration, names and units as in `SpeedResponse`; derivatives of the shares of time are zero.

    Attributes:
        exact: True for values and derivatives of an orbit; False for a motion that does not repeat.
    """

    dynamic_factor: Numbers
    dte_rms: Numbers
    contact_loss_share: Numbers
    back_side_contact: Numbers
    exact: Bool[Array, "responses speeds"]


def differentiable(oscillator: Oscillator, responses: Sequence[SpeedResponse], steps: int) -> SteadyNumbers:
    """Results of responses with derivatives with respect to every number of the oscillator, leading axis (responses,).

    Newton's method finds the orbits of the responses again, with exact derivatives. Without an orbit the recorded
    values are returned, without derivatives.

    Args:
        oscillator: oscillator of the responses.
        responses: responses at the same number of speeds each, with orbits of up to four mesh cycles.
        steps: steps of a mesh cycle.
    """
    each = [(of.mesh_frequency, *_settled_on(of), _recorded(of)) for of in responses]
    together = jax.tree.map(lambda *parts: jnp.concatenate(parts), *each)

    def of_speed(given):
        frequency, start, period, found = given

        def orbit(periods):
            return lambda: _of_orbit(oscillator, frequency, start, periods, steps, found)

        cases = [*(orbit(periods) for periods in _PERIODS), lambda: found]
        return jax.lax.switch(jnp.asarray(_CHOICE)[period], cases)

    # one after the other: only the branch of the orbit that was found is computed
    found = jax.lax.map(of_speed, together)
    return jax.tree.map(lambda part: part.reshape(len(responses), -1), found)


def _settled_on(of: SpeedResponse):
    """State at every speed, and mesh cycles of the orbit."""
    return jax.lax.stop_gradient((of.state, of.period))


def _recorded(of: SpeedResponse) -> SteadyNumbers:
    """Recorded results of a response, without derivatives."""
    found = of.dynamic_factor, of.dte_rms, of.contact_loss_share, of.back_side_contact, jnp.zeros_like(of.status, bool)
    return jax.lax.stop_gradient(SteadyNumbers(*found))


def _of_orbit(oscillator, frequency, start, periods: int, steps: int, recorded: SteadyNumbers) -> SteadyNumbers:
    orbit, same = _orbit_of(oscillator, frequency, start, periods, steps, recorded)
    exact = recorded._replace(dynamic_factor=orbit.dynamic_factor, dte_rms=orbit.dte_rms, exact=same)
    return jax.tree.map(lambda there, otherwise: jnp.where(same, there, otherwise), exact, recorded)


def _orbit_of(
    oscillator, frequency, start, periods: int, steps: int, recorded: SteadyNumbers
) -> tuple[Orbit, Bool[Array, ""]]:
    """Orbit near a settled state, and True if it agrees with the recorded motion."""
    orbit = find_orbit(oscillator, frequency, start, periods=periods, steps=steps)
    scale = recorded.dte_rms + jnp.finfo(orbit.dte_rms.dtype).eps ** 0.5 * jnp.abs(orbit.dte_mean)
    same = jnp.abs(orbit.dynamic_factor - recorded.dynamic_factor) <= _SAME * recorded.dynamic_factor
    return orbit, same & (jnp.abs(orbit.dte_rms - recorded.dte_rms) <= _SAME * scale) & orbit.converged


class SteadyForce(NamedTuple):
    """Mesh force of a periodic motion, differentiable by every number of the oscillator.

    Attributes:
        force: elastic force at mesh positions of successive cycles [N], shape (cycles, positions), negative on the
            coast flanks; the number of cycles is a common multiple of the periods of all orbits considered.
        dynamic_factor: largest force at any time over the static force.
        back_side_contact: True if the coast flanks touch at any time.
        status: status of the motion and of its mesh force; if not converged, all forces are the static force.
    """

    force: Float[Array, "cycles positions"]
    dynamic_factor: Scalar
    back_side_contact: Bool[Array, ""]
    status: Statuses


def steady_force(
    oscillator: Oscillator, frequency: Scalar, response: SpeedResponse, phase: Positions, steps: int
) -> SteadyForce:
    """Mesh force of the steady orbit of a response.

    Args:
        oscillator: oscillator of the response.
        frequency: mesh frequency [Hz].
        response: response at this single speed, with orbits of up to four mesh cycles.
        phase: mesh positions [base pitches], shape (positions,).
        steps: steps of a mesh cycle.
    """
    recorded, start, period = jax.tree.map(lambda part: part[0], (_recorded(response), *_settled_on(response)))
    even = static_force(oscillator)
    most = max(_PERIODS)

    def orbit(periods: int):
        def on_orbit() -> SteadyForce:
            orbit, same = _orbit_of(oscillator, frequency, start, periods, steps, recorded)
            force = jnp.tile(_at_positions(oscillator, orbit, phase), (most // periods, 1))
            status = status_of({Status.NO_STEADY_MOTION: ~same}, oscillator.status)
            force = jnp.where(status == Status.CONVERGED, force, even)
            return SteadyForce(force, orbit.dynamic_factor, orbit.back_side_contact > 0, status)

        return on_orbit

    def none() -> SteadyForce:
        status = status_of({Status.NO_STEADY_MOTION: True}, oscillator.status)
        return SteadyForce(
            jnp.full((most, len(phase)), even), jnp.full_like(even, jnp.nan), jnp.zeros((), bool), status
        )

    return jax.lax.switch(jnp.asarray(_CHOICE)[period], [*map(orbit, _PERIODS), none])


def _at_positions(oscillator: Oscillator, orbit: Orbit, phase: Positions) -> Float[Array, "cycles positions"]:
    """Force of an orbit of even steps at mesh positions [N], by cubic interpolation of the DTE and its rate."""
    count = len(orbit.phase)
    steps = count // orbit.periods
    place = ((phase - jnp.floor(phase))[None] + jnp.arange(orbit.periods, dtype=phase.dtype)[:, None]) * steps
    left = jnp.floor(place)
    share, first = place - left, left.astype(jnp.int32) % count
    last, step = (first + 1) % count, 1 / (steps * orbit.mesh_frequency)
    rise = step * orbit.dte_rate
    change = orbit.dte[last] - orbit.dte[first]
    bend = (1 - share) * (rise[first] - change) - share * (rise[last] - change)
    dte = orbit.dte[first] + share * (change + (1 - share) * bend)
    at = jax.vmap(oscillator.mesh_force)
    return jax.vmap(lambda cycle: at(phase, cycle))(dte)
