"""Mesh forces simpler than the map: what the literature integrates, made of the same contact analyses."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..numerics import result
from .force import AbstractMeshForce
from .force_map import between, closing

Scalar = Float[Array, ""]
Sides = Float[Array, "sides"]
Curves = Float[Array, "sides positions"]


class Springs(NamedTuple):
    """Drive and coast flanks as two springs at one mesh position: where they touch [um], stiffness [N/um]."""

    start: Sides
    stiffness: Sides

    def force(self, dte: Scalar) -> Scalar:
        drive, closed = closing(self.start, dte)
        found = jnp.where(drive, self.stiffness[0], self.stiffness[1]) * jnp.maximum(closed, 0.0)
        return jnp.where(drive, found, -found)


def _mixed(curves: Curves, phase: Scalar, first: Scalar) -> Sides:
    lower, upper, share = between(phase, first, curves.shape[-1])
    return (1 - share) * curves[:, lower] + share * curves[:, upper]


class VaryingStiffness(AbstractMeshForce):
    """Stiffness that varies with the mesh position, beyond the unloaded transmission error: k(phase) (q - e_u(phase)).

    The stiffness is that of the whole deflection under the torque it was made for: the force is right for this load
    and every mesh position, and no other. How much of the teeth is in contact does not change with the DTE.

    Attributes:
        first_phase: mesh position with which the curves begin [base pitches].
        start: DTE at which the drive flanks touch, and the negative of that at which the coast flanks do [um],
            shape (2, positions).
        secant_stiffness: of drive and coast flanks [N/um], same shape.
        converged: whether the contacts have been found.
    """

    first_phase: Scalar = result("base pitches")
    start: Curves = result("um")
    secant_stiffness: Curves = result("N/um")
    converged: Bool[Array, ""] = result()

    def at(self, phase: Scalar) -> Springs:
        return Springs(*(_mixed(part, phase, self.first_phase) for part in (self.start, self.secant_stiffness)))

    def force(self, place: Springs, dte: Scalar) -> Scalar:
        return place.force(dte)


class LoadedError(AbstractMeshForce):
    """Mean stiffness, excited by the loaded transmission error: k (q - q_0(phase) + F_0 / k), without parametric
    excitation, as A. Kahraman and R. Singh have it.

    Attributes:
        first_phase: mesh position with which the curves begin [base pitches].
        start: static transmission error under the load less F_0 / k, of the drive flanks, and its negative for the
            coast flanks [um], shape (2, positions).
        constant_stiffness: F_0 over the mean deflection of drive and coast flanks [N/um], shape (2,).
        converged: whether the contacts have been found.
    """

    first_phase: Scalar = result("base pitches")
    start: Curves = result("um")
    constant_stiffness: Sides = result("N/um")
    converged: Bool[Array, ""] = result()

    def at(self, phase: Scalar) -> Springs:
        return Springs(_mixed(self.start, phase, self.first_phase), self.constant_stiffness)

    def force(self, place: Springs, dte: Scalar) -> Scalar:
        return place.force(dte)


class Tangent(AbstractMeshForce):
    """The force to first order about its static value: F_0 + k(phase) (q - q_0(phase)); no clearance, small vibration.

    Attributes:
        first_phase: mesh position with which the curves begin [base pitches].
        static_force: F_0 [N].
        dte: q_0, static transmission error [um], shape (positions,).
        tangent_stiffness: slope of the force there [N/um], shape (positions,).
        converged: whether the contacts have been found.
    """

    first_phase: Scalar = result("base pitches")
    static_force: Scalar = result("N")
    dte: Float[Array, " positions"] = result("um")
    tangent_stiffness: Float[Array, " positions"] = result("N/um")
    converged: Bool[Array, ""] = result()

    def at(self, phase: Scalar) -> Sides:
        return _mixed(jnp.stack([self.dte, self.tangent_stiffness]), phase, self.first_phase)

    def force(self, place: Sides, dte: Scalar) -> Scalar:
        return self.static_force + place[1] * (dte - place[0])
