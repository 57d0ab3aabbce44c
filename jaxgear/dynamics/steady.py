"""Numbers of steady vibration that can be differentiated, whatever the number of cycles after which it repeats."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .orbit import find_orbit
from .oscillator import Oscillator
from .response import SpeedResponse

Numbers = Float[Array, "responses speeds"]

# Mesh cycles of the orbits that are differentiated: an orbit of two, three or four cycles is one of twelve too.
_PERIODS = (1, 12)
_CHOICE = (len(_PERIODS), 0, 1, 1, 1)  # by the period that was found; 0 for none
# How far the orbit may be from the motion that was recorded, relative to its dynamic factor and rms.
_SAME = 1e-2


class SteadyNumbers(NamedTuple):
    """Names and units of `SpeedResponse`; the derivatives of the shares of time are zero.

    Attributes:
        exact: whether numbers and derivatives are those of an orbit, not of a motion without a period.
    """

    dynamic_factor: Numbers
    approach_rms: Numbers
    no_contact: Numbers
    coast_contact: Numbers
    exact: Bool[Array, "responses speeds"]


def differentiable(oscillator: Oscillator, responses: Sequence[SpeedResponse], steps: int) -> SteadyNumbers:
    """Numbers of responses with their derivatives by every number of the oscillator, leading axis (responses,).

    The orbits that the motion has settled on are found again by Newton's method, whose derivatives are exact. Where it
    has settled on none, the numbers are those that were recorded, without derivatives.

    Args:
        oscillator: that the response is of.
        responses: to as many speeds each, with orbits of up to four mesh cycles.
        steps: of a mesh cycle.
    """
    each = [
        (
            of.mesh_frequency,
            *jax.lax.stop_gradient((of.state, of.period)),
            jax.lax.stop_gradient(
                SteadyNumbers(
                    of.dynamic_factor, of.approach_rms, of.no_contact, of.coast_contact, jnp.zeros_like(of.settled)
                )
            ),
        )
        for of in responses
    ]
    together = jax.tree.map(lambda *parts: jnp.concatenate(parts), *each)

    def of_speed(given):
        frequency, start, period, found = given

        def orbit(periods):
            return lambda: _of_orbit(oscillator, frequency, start, periods, steps, found)

        cases = [*(orbit(periods) for periods in _PERIODS), lambda: found]
        return jax.lax.switch(jnp.asarray(_CHOICE)[period], cases)

    # one after the other: only the orbits that are there are worked out
    found = jax.lax.map(of_speed, together)
    return jax.tree.map(lambda part: part.reshape(len(responses), -1), found)


def _of_orbit(oscillator, frequency, start, periods: int, steps: int, recorded: SteadyNumbers) -> SteadyNumbers:
    orbit = find_orbit(oscillator, frequency, start, periods=periods, steps=steps)
    factor, rms = orbit.dynamic_factor, orbit.approach_rms
    scale = recorded.approach_rms + jnp.finfo(rms.dtype).eps ** 0.5 * jnp.abs(orbit.approach_mean)
    same = jnp.abs(factor - recorded.dynamic_factor) <= _SAME * recorded.dynamic_factor
    same &= (jnp.abs(rms - recorded.approach_rms) <= _SAME * scale) & orbit.converged
    exact = recorded._replace(dynamic_factor=factor, approach_rms=rms, exact=same)
    return jax.tree.map(lambda there, otherwise: jnp.where(same, there, otherwise), exact, recorded)
