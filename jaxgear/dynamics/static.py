"""An oscillator at rest under its static load, and the frequencies at which it vibrates about that."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import bracketed_root, program
from .force import AbstractMeshForce, missing
from .oscillator import Coordinates, Oscillator

Scalar = Float[Array, ""]

# Approaches [um] of either sign among which the one under the static load is bracketed.
_BRACKETS = tuple(2.0**power for power in range(-20, 31))
_NEWTON_STEPS = 12
# mesh positions over which the stiffness is averaged
_POSITIONS = 32


class Rest(NamedTuple):
    """Equilibrium at one mesh position.

    Attributes:
        coordinates: [um], shape (coordinates,).
        force: of the mesh [N].
        stiffness: slope of the mesh force there [N/um].
    """

    coordinates: Coordinates
    force: Scalar
    stiffness: Scalar


def at_rest(oscillator: Oscillator, phase: Scalar) -> Rest:
    """Equilibrium under the mean load at a mesh position [base pitches].

    Loads that do not balance accelerate the whole; the rest is then that of the approach.
    """
    place = oscillator.mesh_force.at(phase)
    root_mass = jnp.sqrt(oscillator.mass)
    along = oscillator.direction / root_mass
    load = oscillator.load / root_mass
    wanted = along @ load / (along @ along)
    approach = approach_under(oscillator.mesh_force, place, wanted)
    error = -oscillator.approach(phase, jnp.zeros_like(load))
    x = along * (approach + error) / (along @ along)
    if oscillator.stiffness is not None:
        ground = oscillator.stiffness / (root_mass[:, None] * root_mass[None])

        def residual(x):
            return ground @ x + along * oscillator.mesh_force.force(place, along @ x - error) - load

        def corrected(_, x):
            return x - jnp.linalg.lstsq(jax.jacfwd(residual)(x), residual(x))[0]

        x = jax.lax.fori_loop(0, _NEWTON_STEPS, corrected, x)
    approach = along @ x - error
    force, slope = jax.jvp(lambda q: oscillator.mesh_force.force(place, q), (approach,), (jnp.ones_like(approach),))
    return Rest(x / root_mass, force, slope)


def mean_stiffness_of(mesh_force: AbstractMeshForce, static_force: Scalar) -> Scalar:
    """Slope of the mesh force under a static force [N], averaged over the mesh cycle [N/um]."""

    def slope(phase):
        return mesh_force.stiffness(phase, approach_under(mesh_force, mesh_force.at(phase), static_force))

    begin = mesh_force.nodes(_POSITIONS).astype(static_force.dtype)
    return jnp.sum(jnp.diff(begin) * jax.vmap(slope)((begin[:-1] + begin[1:]) / 2))


def approach_under(mesh_force: AbstractMeshForce, place, wanted: Scalar) -> Scalar:
    """Approach [um] at which the mesh force has a value [N]."""
    force = mesh_force.force
    tried = jnp.asarray(_BRACKETS, wanted.dtype)
    above = jax.vmap(lambda q: force(place, q))(tried) >= wanted
    below = jax.vmap(lambda q: force(place, q))(-tried) <= wanted
    high, low = tried[jnp.argmax(above)], -tried[jnp.argmax(below)]
    return bracketed_root(missing, low, high, (mesh_force, place, wanted))


class Natural(NamedTuple):
    """Natural frequencies [Hz] with the mean stiffness of the mesh.

    Attributes:
        mesh: of the approach alone, all coordinates free.
        highest: of all coordinates.
    """

    mesh: Scalar
    highest: Scalar


@program
def natural_frequencies(oscillator: Oscillator) -> Natural:
    """Natural frequencies with the mesh stiffness under the static load, averaged over the cycle."""
    rest = at_rest(oscillator, jnp.zeros((), oscillator.mass.dtype))
    stiffness = mean_stiffness_of(oscillator.mesh_force, rest.force)
    along = oscillator.direction / jnp.sqrt(oscillator.mass)
    total = stiffness * along[:, None] * along[None]
    if oscillator.stiffness is not None:
        total = total + oscillator.stiffness / jnp.sqrt(oscillator.mass[:, None] * oscillator.mass[None])
    highest = jnp.max(jnp.linalg.eigvalsh((total + total.T) / 2))
    in_hertz = jnp.sqrt(jnp.asarray(oscillator.newton, stiffness.dtype)) / (2 * jnp.pi)
    return Natural(in_hertz * jnp.sqrt(stiffness * (along @ along)), in_hertz * jnp.sqrt(jnp.maximum(highest, 0.0)))
