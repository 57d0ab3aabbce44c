"""One point of a branch of periodic orbits: the orbits of a family near a place, on a plane across the branch."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..numerics import newton, solve
from .oscillator import Oscillator
from .poincare import moved, steps_at

Scalar = Float[Array, ""]
Place = Float[Array, " places"]  # the unknowns of an orbit and the parameter, each divided by its scale
Family = Callable[[Scalar], tuple[Oscillator, Scalar]]

_MOST = 10  # evaluations of a corrector: where it takes more, the step along the branch was too long


class OverSpeed(eqx.Module):
    """The family of orbits of one oscillator over the mesh frequency [Hz]."""

    oscillator: Oscillator

    def __call__(self, parameter: Scalar) -> tuple[Oscillator, Scalar]:
        return self.oscillator, parameter


class Scales(NamedTuple):
    """What makes places along a branch numbers of like size.

    Attributes:
        size: of the unknowns [um].
        parameter: of the parameter of the family, in its own unit.
    """

    size: Scalar
    parameter: Scalar

    def unknowns(self, place: Place) -> tuple[Array, Scalar]:
        """The unknowns of an orbit and the parameter at a place."""
        return place[:-1] * self.size, place[-1] * self.parameter

    def place(self, z: Array, parameter: Scalar) -> Place:
        """The place of an orbit."""
        return jnp.append(z / self.size, parameter / self.parameter)


class Corrected(NamedTuple):
    """A point of a branch.

    Attributes:
        place: where it is.
        tangent: of the branch, of length one; the last number is that of the parameter.
        monodromy: derivative of the state after the orbit by the state before, in the unknowns of the place.
        evaluations: of the Poincare map.
        converged: whether there is an orbit.
    """

    place: Place
    tangent: Place
    monodromy: Float[Array, "unknowns unknowns"]
    evaluations: Scalar
    converged: Bool[Array, ""]


def family_of(oscillator: Any) -> Family:
    """The family that an oscillator stands for, that over the mesh frequency, or the given one.

    Raises:
        TypeError: for what is neither an `Oscillator` nor a function of a parameter.
    """
    if isinstance(oscillator, Oscillator):
        return OverSpeed(oscillator)
    if not callable(oscillator):
        kind = type(oscillator).__name__
        raise TypeError(f"oscillator is of type {kind}, must be an Oscillator or a function of a parameter")
    return oscillator


def change(family: Family, place: Place, scales: Scales, nodes, periods: int) -> Array:
    """By how much the unknowns change over an orbit, divided by their scale."""
    z, parameter = scales.unknowns(place)
    oscillator, frequency = family(parameter)
    return moved(oscillator, z, steps_at(oscillator, nodes), frequency, periods) / scales.size


def corrected(family: Family, guess: Place, normal: Place, scales: Scales, nodes, periods: int) -> Corrected:
    """The point of a branch on the plane through a guess across a normal, along which the tangent points."""

    def equations(place):
        across = jnp.sum(normal * (place - guess))
        return jnp.append(change(family, place, scales, nodes, periods), across)

    found = newton(equations, guess, most=_MOST)
    ahead = jnp.zeros_like(guess).at[-1].set(1.0)
    tangent = solve(found.jacobian, ahead)
    monodromy = found.jacobian[:-1, :-1] + jnp.eye(len(guess) - 1, dtype=guess.dtype)
    return Corrected(found.root, tangent / jnp.linalg.norm(tangent), monodromy, found.steps, found.converged)


def first_direction(size: int, dtype, sign: float) -> Place:
    """The direction in which only the parameter changes."""
    return jnp.zeros(size, dtype).at[-1].set(sign)


def held(tree: Any) -> Any:
    """A tree whose arrays pass no derivative."""
    arrays, rest = eqx.partition(tree, eqx.is_array)
    return eqx.combine(jax.lax.stop_gradient(arrays), rest)
