"""Poincare map of a state over mesh cycles, in scaled unknowns, and corrected points on a branch of fixed points."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..numerics import Given, Numbers, check, concrete, newton, real, solve, whole
from .integrate import Steps, one_step, steps_of
from .oscillator import Oscillator, State

Scalar = Float[Array, ""]
Unknowns = Float[Array, " unknowns"]  # displacements and velocities / (2 pi mesh frequency), all [um]

STEPS = 200  # of a mesh cycle: Runge-Kutta steps of order four keep K_v to 0.1 %


def scaled(y: State, mesh_frequency: Scalar) -> Unknowns:
    """Unknowns of a state: displacements and velocities / (2 pi mesh frequency), all in um."""
    return jnp.concatenate([y[0], y[1] / (2 * jnp.pi * mesh_frequency)])


def unscaled(z: Unknowns, mesh_frequency: Scalar) -> State:
    """State from its unknowns: displacements [um] and velocities [um/s]."""
    x, v = jnp.split(z, 2)
    return x, v * (2 * jnp.pi * mesh_frequency)


def after(oscillator: Oscillator, y: State, steps: Steps, mesh_frequency: Scalar, count: int) -> State:
    """State after `count` mesh cycles, without a record."""

    def step(y, step):
        return one_step(oscillator, y, step, mesh_frequency), None

    return jax.lax.scan(lambda y, _: (jax.lax.scan(step, y, steps)[0], None), y, length=count)[0]


def moved(oscillator: Oscillator, z: Unknowns, steps: Steps, mesh_frequency: Scalar, count: int) -> Unknowns:
    """Change of the unknowns over `count` mesh cycles [um]; zero on a periodic orbit."""
    y = after(oscillator, unscaled(z, mesh_frequency), steps, mesh_frequency, count)
    return scaled(y, mesh_frequency) - z


Nodes = int | Float[Array, " nodes"]
Start = Sequence[Numbers]  # displacements [um] and velocities [um/s]
_Tree = TypeVar("_Tree")


def checked(oscillator: Oscillator, mesh_frequency: Given, start: Start, steps: Numbers) -> tuple[Scalar, State, Nodes]:
    """Mesh frequency and start as arrays of the oscillator's type, and checked steps (`nodes_of`).

    Raises:
        TypeError: for something else than an `Oscillator`.
        ValueError: for a mesh frequency that is not positive, a start of another shape or steps out of order.
    """
    if not isinstance(oscillator, Oscillator):
        raise TypeError(f"oscillator is of type {type(oscillator).__name__}, must be an Oscillator")
    frequency = real(mesh_frequency)
    if frequency.shape != ():
        raise ValueError(
            f"mesh_frequency has shape {frequency.shape}, must be a single number; make many with jax.vmap"
        )
    check("mesh_frequency", frequency, "Hz", low=0.0, open_low=True)
    shape = oscillator.mass.shape
    if not isinstance(start, tuple | list) or len(start) != 2:
        raise ValueError("start must be displacements and velocities (x, v)")
    parts = [real(part) for part in start]
    for name, part in zip(("displacements", "velocities"), parts):
        if part.shape != shape:
            raise ValueError(f"{name} of start have shape {part.shape}, must be {shape}")
    dtype = jnp.result_type(oscillator.mass, frequency)
    x, v = (part.astype(dtype) for part in parts)
    return frequency.astype(dtype), (x, v), nodes_of(steps)


def nodes_of(steps: Numbers) -> Nodes:
    """Checked input of `steps_at`: number of steps, or nodes from 0 to 1 [base pitches].

    Raises:
        ValueError: for fewer than two steps, or nodes that do not increase from 0 to 1.
    """
    if isinstance(steps, int | np.integer):
        return whole("steps", steps, 2)
    nodes = real(steps)
    if nodes.ndim != 1 or len(nodes) < 3:
        raise ValueError(f"steps have shape {nodes.shape}, must be a whole number or at least 3 nodes")
    known = concrete(nodes)
    if known is not None and (known[0] != 0 or known[-1] != 1 or (np.diff(known) <= 0).any()):
        raise ValueError("nodes of steps must increase from 0 to 1 base pitch")
    return nodes


def steps_at(oscillator: Oscillator, nodes: Nodes) -> Steps:
    """Steps between given nodes of a mesh cycle, or a number of steps placed by the mesh force."""
    if isinstance(nodes, int):
        nodes = oscillator.mesh_force.nodes(nodes)
    return steps_of(oscillator, nodes.astype(oscillator.mass.dtype))


Place = Float[Array, " places"]  # the unknowns of an orbit and the parameter, each divided by its scale
Family = Callable[[Scalar], tuple[Oscillator, Scalar]]

_MOST = 10  # evaluations of a corrector: where it takes more, the step along the branch was too long


class OverSpeed(eqx.Module):
    """Family of orbits of one oscillator with the mesh frequency [Hz] as parameter."""

    oscillator: Oscillator

    def __call__(self, parameter: Scalar) -> tuple[Oscillator, Scalar]:
        return self.oscillator, parameter


class Scales(NamedTuple):
    """Scales that bring all coordinates of a place along a branch to similar size.

    Attributes:
        size: scale of the unknowns [um].
        parameter: scale of the parameter of the family, in its own unit.
    """

    size: Scalar
    parameter: Scalar

    def unknowns(self, place: Place) -> tuple[Array, Scalar]:
        """Unknowns of an orbit [um] and parameter at a place."""
        return place[:-1] * self.size, place[-1] * self.parameter

    def place(self, z: Array, parameter: Scalar) -> Place:
        """Place of an orbit: its unknowns and the parameter, each divided by its scale."""
        return jnp.append(z / self.size, parameter / self.parameter)


class Corrected(NamedTuple):
    """A point of a branch.

    Attributes:
        place: unknowns and parameter of the point, divided by their scales.
        tangent: unit tangent of the branch; its last component is along the parameter.
        monodromy: derivative of the state after the orbit by the state before, in the unknowns of the place.
        evaluations: number of evaluations of the Poincare map.
        converged: True if an orbit was found.
    """

    place: Place
    tangent: Place
    monodromy: Float[Array, "unknowns unknowns"]
    evaluations: Scalar
    converged: Bool[Array, ""]


def family_of(oscillator: Oscillator | Family) -> Family:
    """Family of orbits of an oscillator over the mesh frequency; a function of a parameter is returned unchanged.

    Raises:
        TypeError: if the argument is neither an `Oscillator` nor a function of a parameter.
    """
    if isinstance(oscillator, Oscillator):
        return OverSpeed(oscillator)
    if not callable(oscillator):
        kind = type(oscillator).__name__
        raise TypeError(f"oscillator is of type {kind}, must be an Oscillator or a function of a parameter")
    return oscillator


def change(family: Family, place: Place, scales: Scales, nodes: Nodes, periods: int) -> Array:
    """Change of the unknowns over an orbit, divided by their scale."""
    z, parameter = scales.unknowns(place)
    oscillator, frequency = family(parameter)
    return moved(oscillator, z, steps_at(oscillator, nodes), frequency, periods) / scales.size


def corrected(family: Family, guess: Place, normal: Place, scales: Scales, nodes: Nodes, periods: int) -> Corrected:
    """Point of a branch on the plane through a guess with a given normal; its tangent points along the normal."""

    def equations(place):
        across = jnp.sum(normal * (place - guess))
        return jnp.append(change(family, place, scales, nodes, periods), across)

    found = newton(equations, guess, most=_MOST)
    ahead = jnp.zeros_like(guess).at[-1].set(1.0)
    tangent = solve(found.jacobian, ahead)
    monodromy = found.jacobian[:-1, :-1] + jnp.eye(len(guess) - 1, dtype=guess.dtype)
    return Corrected(found.root, tangent / jnp.linalg.norm(tangent), monodromy, found.steps, found.converged)


def first_direction(size: int, dtype: np.dtype, sign: float) -> Place:
    """Unit direction of the parameter, with a sign, shape (size,)."""
    return jnp.zeros(size, dtype).at[-1].set(sign)


def no_gradient(tree: _Tree) -> _Tree:
    """Tree with stopped gradients of all its arrays."""
    arrays, rest = eqx.partition(tree, eqx.is_array)
    return eqx.combine(jax.lax.stop_gradient(arrays), rest)
