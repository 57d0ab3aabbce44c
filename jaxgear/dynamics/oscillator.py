"""Masses on the line of action with one mesh between them: vector fields for any integrator."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..numerics import Checked, number
from .force import AbstractMeshForce

Scalar = Float[Array, ""]
Coordinates = Float[Array, " coordinates"]
State = tuple[Coordinates, Coordinates]  # [um], [um/s]

# a force of 1 N gives a mass of 1 kg 1e6 um/s^2
NEWTON = 1e6


class Excitation(Checked):
    """What drives a mesh besides its own force: harmonics of the mesh frequency.

    Attributes:
        load: amplitudes of the load relative to its mean, shape (orders,): 1 + sum load_n cos(2 pi n phase + angle_n).
        load_angle: [rad], shape (orders,).
        displacement: amplitudes of a displacement between the gears [um], for instance a cumulated pitch deviation,
            shape (orders,); it is taken off the DTE that the flanks feel.
        displacement_angle: [rad], shape (orders,).
        orders: multiples of the mesh frequency, shape (orders,).
    """

    load: Float[Array, " orders"] = number("", shape=("orders",))
    load_angle: Float[Array, " orders"] = number("rad", shape=("orders",))
    displacement: Float[Array, " orders"] = number("um", shape=("orders",))
    displacement_angle: Float[Array, " orders"] = number("rad", shape=("orders",))
    orders: Float[Array, " orders"] = number("", shape=("orders",))


class Oscillator(Checked):
    """Coordinates along and across lines of action with one mesh between them, as a vector field `(t, y, args)`.

        mass x'' + damping x' + stiffness x + direction (F(phase, q) + mesh_damping q') = load
        q = direction . x - e(phase)

    The state y is (x, x'), [um] and [um/s], each of shape (coordinates,); args is the mesh frequency [Hz], or anything
    that is called with the time and gives (phase, mesh frequency). It runs in `diffrax.ODETerm` as it is.

    Attributes:
        mesh_force: of the mesh.
        mass: [kg], shape (coordinates,).
        direction: what a unit of every coordinate adds to the DTE, shape (coordinates,).
        load: static load on every coordinate [N], shape (coordinates,).
        mesh_damping: viscous damping of the DTE, in contact and out of it [N s/um].
        stiffness: to ground and between coordinates [N/um], shape (coordinates, coordinates).
        damping: likewise [N s/um].
        excitation: None for none.
        newton: acceleration of a unit mass under a unit force; 1 in dimensionless models.
    """

    mesh_force: AbstractMeshForce
    mass: Coordinates = number("kg", low=0.0, open_low=True, shape=("coordinates",))
    direction: Coordinates = number("", shape=("coordinates",))
    load: Coordinates = number("N", shape=("coordinates",))
    mesh_damping: Scalar = number("N s/um", low=0.0, default=0.0)
    stiffness: Float[Array, "coordinates coordinates"] | None = number(
        "N/um", shape=("coordinates", "coordinates"), optional=True, default=None
    )
    damping: Float[Array, "coordinates coordinates"] | None = number(
        "N s/um", shape=("coordinates", "coordinates"), optional=True, default=None
    )
    excitation: Excitation | None = None
    newton: float = eqx.field(static=True, default=NEWTON)

    def __call__(self, t: Any, y: State, args: Any) -> State:
        phase, frequency = args(t) if callable(args) else (t * args, args)
        return self.rate(self.mesh_force.at(phase), phase, y, frequency)

    def rate(self, place: Any, phase: Scalar, y: State, mesh_frequency: Scalar) -> State:
        """Derivative of the state where the place of the mesh force is known already."""
        x, v = y
        error, error_rate, extra = self._excited(phase, mesh_frequency)
        dte, speed = self._along(x) - error, self._along(v) - error_rate
        inner = self.mesh_force.force(place, dte) + self.mesh_damping * speed
        total = self.load * (1 + extra) - self.direction * inner - self.support_force(x, v)
        return v, self.newton * total / self.mass

    def support_force(self, x: Coordinates, v: Coordinates) -> Coordinates:
        """What holds every coordinate against ground and the others [N], positive against its displacement."""
        total = jnp.zeros_like(x)
        if self.stiffness is not None:
            total = total + self.stiffness @ x
        if self.damping is not None:
            total = total + self.damping @ v
        return total

    @property
    def converged(self) -> Bool[Array, ""]:
        """Whether the contacts that its mesh force was made of have been found; a force in closed form has none."""
        return jnp.asarray(getattr(self.mesh_force, "converged", True))

    def dte(self, phase: Scalar, x: Coordinates) -> Scalar:
        """Dynamic transmission error of the flanks (DTE) [um]."""
        return self._along(x) - self._excited(phase, jnp.zeros_like(phase))[0]

    def dte_rate(self, phase: Scalar, v: Coordinates, mesh_frequency: Scalar) -> Scalar:
        """Velocity of the DTE [um/s]."""
        return self._along(v) - self._excited(phase, mesh_frequency)[1]

    def _along(self, x: Coordinates) -> Scalar:
        return self.direction[0] * x[0] if len(x) == 1 else self.direction @ x

    def _excited(self, phase, frequency):
        """Displacement [um], its rate [um/s], and fluctuation of the load relative to it."""
        nothing = jnp.zeros_like(phase)
        given = self.excitation
        if given is None:
            return nothing, nothing, nothing
        turn = 2 * jnp.pi * given.orders
        angle = turn * phase + given.displacement_angle
        error = jnp.sum(given.displacement * jnp.cos(angle))
        rate = -jnp.sum(given.displacement * turn * frequency * jnp.sin(angle))
        return error, rate, jnp.sum(given.load * jnp.cos(turn * phase + given.load_angle))
