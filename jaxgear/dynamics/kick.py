"""Starts far from rest, which find orbits that hang together with no other."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .oscillator import Oscillator, State
from .static import Rest

Scalar = Float[Array, ""]

_POSITIONS = 16  # of the first harmonic of the static transmission error
_QUARTER = 0.25  # of a mesh cycle
_FLAT = 1e-6  # a static transmission error with a smaller harmonic, as part of its deflection, has no softest position


class Kick(NamedTuple):
    """How flanks are thrown apart.

    Attributes:
        apart: largest DTE less that at rest [um], negative.
        acceleration: of the DTE where the flanks are apart [um/s^2].
        phase: mesh position of the largest distance, from -1/2 to 1/2 [base pitches].
        on: whether they are thrown at all.
    """

    apart: Scalar
    acceleration: Scalar
    phase: Scalar
    on: Array


def kick_of(oscillator: Oscillator, rest: Rest, factor: Scalar) -> Kick:
    """The distance from which flanks meet again with a dynamic factor, and where on the cycle they are to have it.

    With the static deflection d of the mesh stiffness at mesh position 0, flanks that a constant force closes over a
    gap g are pressed to the deflection d + (d^2 + 2 g d)^(1/2): a dynamic factor K needs g = ((K - 1)^2 - 1) d / 2. Up
    to K = 2 contact is kept, and the DTE is released from (K - 1) d behind that at rest. Where the backlash is
    less than the gap, the coast flanks throw them back harder.

    Orbits of two mesh cycles are farthest apart a quarter of a cycle behind the softest mesh position, when the mesh
    begins to stiffen. A gap there leads to them over a band of sizes somewhat below their own dynamic factor; an
    impulse on flanks in contact does for scattered sizes only. The band narrows towards the speed at which the orbit
    ends, and moves with speed, variation, damping and relief: 3.6 to 4.0 for unmodified gears at 1.36 times the natural
    frequency, 2.5 to 2.8 for relieved ones at 1.75 times of it. One size does not do for all (`settings.KICKS`).
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
    """A start with its DTE thrown so that it would stand still, the farthest away, at the mesh position of a kick.

    At mesh position 0 the flanks are on their way there, or on their way back, under the static force alone.
    """
    x, v = start
    time = kick.phase / mesh_frequency
    fallen = jnp.minimum(0.5 * kick.acceleration * time**2, -kick.apart)  # no farther than to the DTE at rest
    along = oscillator.direction / oscillator.mass
    share = along / jnp.sum(oscillator.direction * along)
    speed = -jnp.sign(time) * jnp.sqrt(2 * kick.acceleration * fallen)
    return x + share * jnp.where(kick.on, kick.apart + fallen, 0.0), v + share * jnp.where(kick.on, speed, 0.0)
