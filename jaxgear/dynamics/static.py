"""An oscillator at rest under its static load, and the frequencies at which it vibrates about that."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics import number, program, pseudo_inverse, safe_divide
from .force import AbstractMeshForce, te_under
from .oscillator import Coordinates, Oscillator

Scalar = Float[Array, ""]

# Share of the DTE that no spring holds, by mass, above which it is free: rounding of single precision is less.
_FREE = 1e-5
# Stiffness against a motion over the largest one, in rounding errors per coordinate, that is more than rounding.
_SINGULAR = 10.0


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

    Loads that do not balance accelerate the whole; the rest is then that of the DTE. Where springs hold every
    motion that changes the DTE, they and the mesh share the load, else the mesh carries what the load demands.
    """
    mesh_force, root_mass = oscillator.mesh_force, jnp.sqrt(oscillator.mass)
    along, load = oscillator.direction / root_mass, oscillator.load / root_mass
    error = -oscillator.dte(phase, jnp.zeros_like(load))
    if oscillator.stiffness is None:
        free, held = along, jnp.zeros_like(load)
        dte = mesh_force.static_te(phase, along @ load / (along @ along))
        force, slope = _with_slope(mesh_force, phase, dte)
    else:
        ground = oscillator.stiffness / (root_mass[:, None] * root_mass[None])
        yields = pseudo_inverse((ground + ground.T) / 2, _SINGULAR * len(ground) * float(jnp.finfo(ground.dtype).eps))
        free = along - ground @ (yields @ along)
        is_free = free @ along > _FREE * (along @ along)
        free = jnp.where(is_free, free, 0.0)
        # the springs as one beside the mesh, without load at the DTE that they alone would take
        spring = jnp.where(is_free, 0.0, safe_divide(1.0, along @ yields @ along))
        alone = along @ yields @ load - error
        wanted = jnp.where(is_free, safe_divide(free @ load, free @ along), spring * alone)
        dte = te_under(_BesideSpring(mesh_force, spring), mesh_force.at(phase), wanted)
        force, slope = _with_slope(mesh_force, phase, dte)
        held = yields @ (load - along * force)
    moved = free * safe_divide(dte + error - along @ held, free @ along)
    return Rest((held + moved) / root_mass, force, slope)


def static_force(oscillator: Oscillator) -> Scalar:
    """Mesh force [N] under the mean load, averaged over the mesh cycle at rest: that of dynamic factors.

    Every periodic motion has the same mean of the whole mesh force where no spring shares the load with the mesh.
    """
    if oscillator.stiffness is None:
        along = oscillator.direction / oscillator.mass
        return along @ oscillator.load / (along @ oscillator.direction)
    return oscillator.mesh_force.over_cycle(lambda phase: at_rest(oscillator, phase).force, oscillator.load.dtype)


class _BesideSpring(AbstractMeshForce):
    """A mesh and a spring [N/um] that the same DTE deflects."""

    mesh: AbstractMeshForce
    spring: Scalar = number("N/um")

    def at(self, phase: Scalar) -> Any:
        return self.mesh.at(phase)

    def force(self, place: Any, dte: Scalar) -> Scalar:
        return self.mesh.force(place, dte) + self.spring * dte


def _with_slope(mesh_force: AbstractMeshForce, phase: Scalar, dte: Scalar) -> tuple[Scalar, Scalar]:
    place = mesh_force.at(phase)
    return jax.jvp(lambda q: mesh_force.force(place, q), (dte,), (jnp.ones_like(dte),))


class Natural(NamedTuple):
    """Natural frequencies [Hz] with the mean stiffness of the mesh.

    Attributes:
        mesh: of the DTE alone, all coordinates free.
        highest: of all coordinates.
    """

    mesh: Scalar
    highest: Scalar


@program
def natural_frequencies(oscillator: Oscillator) -> Natural:
    """Natural frequencies with the mesh stiffness under the static load, averaged over the cycle."""
    stiffness = oscillator.mesh_force.mean_tangent_stiffness(static_force(oscillator))
    along = oscillator.direction / jnp.sqrt(oscillator.mass)
    total = stiffness * along[:, None] * along[None]
    if oscillator.stiffness is not None:
        total = total + oscillator.stiffness / jnp.sqrt(oscillator.mass[:, None] * oscillator.mass[None])
    highest = jnp.max(jnp.linalg.eigvalsh((total + total.T) / 2))
    in_hertz = jnp.sqrt(jnp.asarray(oscillator.newton, stiffness.dtype)) / (2 * jnp.pi)
    return Natural(in_hertz * jnp.sqrt(stiffness * (along @ along)), in_hertz * jnp.sqrt(jnp.maximum(highest, 0.0)))
