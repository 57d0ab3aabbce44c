"""Mesh force over whole revolutions of gears with deviations of single teeth."""

from typing import Literal, get_args

import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from ..contact.status import Statuses, WithStatus
from ..numerics import count
from ..revolution import Revolution
from .force import POSITIONS, AbstractMeshForce
from .force_map import FlankSprings, Tangent

Scalar = Float[Array, ""]
RevolutionModel = Literal["varying stiffness", "tangent"]

# distance of the coast flanks [um]: none of the teeth is known to touch there
_FAR = 1e6


class RevolutionForce(WithStatus, AbstractMeshForce):
    """Mesh force over the windows of a `Revolution`; its phase is 1 after all windows.

    Oscillators with this force need the mesh frequency divided by `base_pitches`, and the steps of a mesh cycle
    multiplied by it. Their orbits repeat after all windows; `shaft_orders` takes the DTE of an orbit of even steps.

    Attributes:
        springs: mesh force over the mesh positions of all windows.
        base_pitches: number of windows.
    """

    springs: FlankSprings | Tangent
    base_pitches: int = count()

    @property
    def status(self) -> Statuses:
        """Status of the contacts in all windows."""
        return self.springs.status

    @property
    def averaged_positions(self) -> int:
        """Number of mesh positions over which stiffnesses are averaged, `POSITIONS` for every window."""
        return POSITIONS * self.base_pitches

    def at(self, phase: Scalar) -> PyTree[Array]:
        return self.springs.at(phase)

    def force(self, place: PyTree[Array], dte: Scalar) -> Scalar:
        springs: AbstractMeshForce = self.springs
        return springs.force(place, dte)


def revolution_force(revolution: Revolution, model: RevolutionModel = "varying stiffness") -> RevolutionForce:
    """Mesh force over the windows of a revolution, for oscillators.

        force = revolution_force(turn)
        oscillator = torsional(force, mesh.pair, torque, damping_ratio=0.05)
        start = turn.transmission_error[:1], jnp.zeros(1)
        orbit = steady_orbit(oscillator, mesh_frequency / turn.windows, start, settle=5, steps=64 * turn.windows)
        shaft_orders(turn, "pinion", of=orbit.dte)

    Args:
        revolution: a single revolution, not a batch, with periodic windows.
        model: model as for `mesh_force`; coast flanks are not modelled.

    Raises:
        ValueError: for another model, or for windows after which the same teeth do not meet again.
    """
    if model not in get_args(RevolutionModel):
        raise ValueError(f'model = {model!r} must be "varying stiffness" or "tangent"')
    error, windows = revolution.transmission_error, revolution.windows
    if error.ndim != 1 or not revolution.repeats:
        raise ValueError(
            f"{windows} base pitches are no whole revolutions of all gears whose teeth differ, or "
            'revolution is a batch: solve one over "hunting"'
        )
    first, status = revolution.phase[0] / windows, jnp.max(revolution.status)
    force = revolution.cycles.force[0]
    if model == "tangent":
        return RevolutionForce(Tangent(first, force, error, revolution.tangent_stiffness, status), windows)
    unloaded = revolution.unloaded_transmission_error
    start = jnp.stack([unloaded, jnp.full_like(unloaded, _FAR)])
    stiffness = force / (error - unloaded)
    return RevolutionForce(FlankSprings(first, start, jnp.stack([stiffness, stiffness]), status), windows)
