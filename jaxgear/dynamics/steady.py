"""Numbers of steady vibration that can be differentiated, whatever the number of cycles after which it repeats."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .orbit import find_orbit
from .oscillator import Oscillator
from .response import SpeedResponse

Numbers = Float[Array, " speeds"]

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
    exact: Bool[Array, " speeds"]


def differentiable(oscillator: Oscillator, response: SpeedResponse, nodes: Float[Array, " nodes"]) -> SteadyNumbers:
    """Numbers of a response with their derivatives by every number of the oscillator and by the mesh frequencies.

    The orbits that the motion has settled on are found again by Newton's method, whose derivatives are exact. Where it
    has settled on none, the numbers are those that were recorded, without derivatives.

    Args:
        oscillator: that the response is of.
        response: with orbits of up to four mesh cycles.
        nodes: of the steps of a mesh cycle [base pitches].
    """
    recorded = jax.lax.stop_gradient(
        SteadyNumbers(
            response.dynamic_factor,
            response.approach_rms,
            response.no_contact,
            response.coast_contact,
            jnp.zeros_like(response.settled),
        )
    )
    starts = jax.lax.stop_gradient((response.state, response.period))

    def of_speed(given):
        frequency, start, period, found = given

        def orbit(periods):
            return lambda: _of_orbit(oscillator, frequency, start, periods, nodes, found)

        cases = [*(orbit(periods) for periods in _PERIODS), lambda: found]
        return jax.lax.switch(jnp.asarray(_CHOICE)[period], cases)

    # one after the other: only the orbits that are there are worked out
    return jax.lax.map(of_speed, (response.mesh_frequency, *starts, recorded))


def _of_orbit(oscillator, frequency, start, periods: int, nodes, recorded: SteadyNumbers) -> SteadyNumbers:
    orbit = find_orbit(oscillator, frequency, start, periods=periods, steps=nodes)
    factor, rms = orbit.dynamic_factor, orbit.approach_rms
    scale = recorded.approach_rms + jnp.finfo(rms.dtype).eps ** 0.5 * jnp.abs(orbit.approach_mean)
    same = jnp.abs(factor - recorded.dynamic_factor) <= _SAME * recorded.dynamic_factor
    same &= (jnp.abs(rms - recorded.approach_rms) <= _SAME * scale) & orbit.converged
    exact = recorded._replace(dynamic_factor=factor, approach_rms=rms, exact=same)
    return jax.tree.map(lambda there, otherwise: jnp.where(same, there, otherwise), exact, recorded)
