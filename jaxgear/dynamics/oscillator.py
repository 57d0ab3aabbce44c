"""Oscillators with one gear mesh: vector fields for any integrator, and static equilibrium."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from ..contact.status import Status, Statuses, WithStatus
from ..numerics import Checked, Given, number, program, pseudo_inverse, safe_divide
from .force import AbstractMeshForce, te_under

Scalar = Float[Array, ""]
Coordinates = Float[Array, " coordinates"]
State = tuple[Coordinates, Coordinates]  # [um], [um/s]

# a force of 1 N gives a mass of 1 kg 1e6 um/s^2
NEWTON = 1e6


class Excitation(Checked):
    """External excitation of a mesh: harmonics of the mesh frequency.

    Attributes:
        load: amplitudes of the load relative to its mean, shape (orders,): 1 + sum load_n cos(2 pi n phase + angle_n).
        load_angle: phase angles of the load [rad], shape (orders,).
        displacement: amplitudes of a displacement between the gears [um], for instance a cumulated pitch deviation,
            shape (orders,); subtracted from the DTE of the gears to give that of the flanks.
        displacement_angle: phase angles of the displacement [rad], shape (orders,).
        orders: multiples of the mesh frequency, shape (orders,).
    """

    load: Float[Array, " orders"] = number("", shape=("orders",))
    load_angle: Float[Array, " orders"] = number("rad", shape=("orders",))
    displacement: Float[Array, " orders"] = number("um", shape=("orders",))
    displacement_angle: Float[Array, " orders"] = number("rad", shape=("orders",))
    orders: Float[Array, " orders"] = number("", shape=("orders",))


class Oscillator(WithStatus, Checked):
    """Coordinates along and across lines of action with one mesh between them, as a vector field `(t, y, args)`.

        mass x'' + damping x' + stiffness x + direction (F(phase, q) + mesh_damping q') = load
        q = direction . x - e(phase)

    The state y is (x, x'), [um] and [um/s], each of shape (coordinates,); args is the mesh frequency [Hz], or a
    function of the time that returns (phase, mesh frequency). An oscillator can be used directly in `diffrax.ODETerm`.

    Attributes:
        mesh_force: mesh force.
        mass: mass of every coordinate [kg], shape (coordinates,).
        direction: change of the DTE per unit of every coordinate, shape (coordinates,).
        load: static load on every coordinate [N], shape (coordinates,).
        mesh_damping: viscous damping of the DTE, in contact and out of it [N s/um].
        stiffness: stiffness to ground and between coordinates [N/um], shape (coordinates, coordinates).
        damping: damping to ground and between coordinates [N s/um], shape (coordinates, coordinates).
        excitation: external excitation; None for none.
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

    def __call__(self, t: Given, y: State, args: Scalar | Callable[[Given], tuple[Scalar, Scalar]]) -> State:
        phase, frequency = args(t) if callable(args) else (args * t, args)
        return self.rate(self.mesh_force.at(phase), phase, y, frequency)

    def rate(self, place: PyTree[Array], phase: Scalar, y: State, mesh_frequency: Scalar) -> State:
        """Derivative of the state [um/s], [um/s^2], with the data of the mesh force at a position from `at`."""
        x, v = y
        error, error_rate, extra = self._excited(phase, mesh_frequency)
        dte, speed = self._along(x) - error, self._along(v) - error_rate
        inner = self.mesh_force.force(place, dte) + self.mesh_damping * speed
        total = self.load * (1 + extra) - self.direction * inner - self.support_force(x, v)
        return v, self.newton * total / self.mass

    def support_force(self, x: Coordinates, v: Coordinates) -> Coordinates:
        """Force of the supports on every coordinate [N], positive against its displacement; without the mesh."""
        total = jnp.zeros_like(x)
        if self.stiffness is not None:
            total = total + self.stiffness @ x
        if self.damping is not None:
            total = total + self.damping @ v
        return total

    @property
    def status(self) -> Statuses:
        """Status of the contacts behind the mesh force; converged for a force in closed form."""
        return jnp.asarray(getattr(self.mesh_force, "status", Status.CONVERGED.value), jnp.int8)

    def dte(self, phase: Scalar, x: Coordinates) -> Scalar:
        """Dynamic transmission error of the flanks (DTE) [um]."""
        return self._along(x) - self._excited(phase, jnp.zeros_like(phase))[0]

    def dte_rate(self, phase: Scalar, v: Coordinates, mesh_frequency: Scalar) -> Scalar:
        """Velocity of the DTE [um/s]."""
        return self._along(v) - self._excited(phase, mesh_frequency)[1]

    def _along(self, x: Coordinates) -> Scalar:
        return self.direction[0] * x[0] if len(x) == 1 else self.direction @ x

    def _excited(self, phase, frequency):
        """Displacement excitation [um], its rate [um/s], and relative fluctuation of the load."""
        nothing = jnp.zeros_like(phase)
        given = self.excitation
        if given is None:
            return nothing, nothing, nothing
        turn = 2 * jnp.pi * given.orders
        angle = turn * phase + given.displacement_angle
        error = jnp.sum(given.displacement * jnp.cos(angle))
        rate = -jnp.sum(given.displacement * turn * frequency * jnp.sin(angle))
        return error, rate, jnp.sum(given.load * jnp.cos(turn * phase + given.load_angle))


# Share of the DTE that no spring holds, by mass, above which it is free: rounding of single precision is less.
_FREE = 1e-5
# Stiffness against a motion over the largest one, in rounding errors per coordinate, that is more than rounding.
_SINGULAR = 10.0


class Rest(NamedTuple):
    """Static equilibrium at one mesh position.

    Attributes:
        coordinates: coordinates [um], shape (coordinates,).
        force: mesh force [N].
        stiffness: tangent stiffness of the mesh [N/um].
    """

    coordinates: Coordinates
    force: Scalar
    stiffness: Scalar


def at_rest(oscillator: Oscillator, phase: Scalar) -> Rest:
    """Static equilibrium under the mean load at a mesh position [base pitches].

    Unbalanced loads accelerate the system as a whole; the equilibrium then refers to the DTE. If springs support every
    motion that changes the DTE, springs and mesh share the load; otherwise the mesh carries the full load.
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
        # the springs act as one spring parallel to the mesh, relaxed at the DTE of the springs without mesh
        spring = jnp.where(is_free, 0.0, safe_divide(1.0, along @ yields @ along))
        alone = along @ yields @ load - error
        wanted = jnp.where(is_free, safe_divide(free @ load, free @ along), spring * alone)
        dte = te_under(_BesideSpring(mesh_force, spring), mesh_force.at(phase), wanted)
        force, slope = _with_slope(mesh_force, phase, dte)
        held = yields @ (load - along * force)
    moved = free * safe_divide(dte + error - along @ held, free @ along)
    return Rest((held + moved) / root_mass, force, slope)


@program
def static_force(oscillator: Oscillator) -> Scalar:
    """Static mesh force [N] under the mean load, averaged over the mesh cycle; the reference of dynamic factors.

    It equals the mean mesh force of every periodic motion, unless springs share the load with the mesh.
    """
    if oscillator.stiffness is None:
        along = oscillator.direction / oscillator.mass
        return along @ oscillator.load / (along @ oscillator.direction)
    return oscillator.mesh_force.over_cycle(lambda phase: at_rest(oscillator, phase).force, oscillator.load.dtype)


class _BesideSpring(AbstractMeshForce):
    """Mesh with a parallel spring [N/um]."""

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
    """Natural frequencies with the mean stiffness of the mesh.

    Attributes:
        mesh: natural frequency of the DTE, without springs to ground and between coordinates [Hz].
        highest: highest natural frequency of all coordinates [Hz].
    """

    mesh: Scalar
    highest: Scalar


def natural_frequencies(oscillator: Oscillator) -> Natural:
    """Natural frequencies with the mesh stiffness under the static load, averaged over the cycle."""
    return _natural(oscillator, oscillator.mesh_force.mean_tangent_stiffness(static_force(oscillator)))


@program
def _natural(oscillator: Oscillator, stiffness: Scalar) -> Natural:
    along = oscillator.direction / jnp.sqrt(oscillator.mass)
    total = stiffness * along[:, None] * along[None]
    if oscillator.stiffness is not None:
        total = total + oscillator.stiffness / jnp.sqrt(oscillator.mass[:, None] * oscillator.mass[None])
    highest = jnp.max(jnp.linalg.eigvalsh((total + total.T) / 2))
    in_hertz = jnp.sqrt(jnp.asarray(oscillator.newton, stiffness.dtype)) / (2 * jnp.pi)
    return Natural(in_hertz * jnp.sqrt(stiffness * (along @ along)), in_hertz * jnp.sqrt(jnp.maximum(highest, 0.0)))
