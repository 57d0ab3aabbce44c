"""The map of a state over some mesh cycles, in scaled unknowns: what shooting and continuation find fixed points of."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics import check, concrete, real, whole
from .integrate import Steps, one_step, steps_of
from .oscillator import Oscillator, State

Scalar = Float[Array, ""]
Unknowns = Float[Array, " unknowns"]  # displacements and velocities / (2 pi mesh frequency), all [um]

STEPS = 200  # of a mesh cycle: Runge-Kutta steps of order four keep K_v to 0.1 %


def scaled(y: State, mesh_frequency: Scalar) -> Unknowns:
    """A state as unknowns of like size."""
    return jnp.concatenate([y[0], y[1] / (2 * jnp.pi * mesh_frequency)])


def unscaled(z: Unknowns, mesh_frequency: Scalar) -> State:
    """The state of unknowns."""
    x, v = jnp.split(z, 2)
    return x, v * (2 * jnp.pi * mesh_frequency)


def after(oscillator: Oscillator, y: State, steps: Steps, mesh_frequency: Scalar, count: int) -> State:
    """State after some cycles, of which nothing is recorded."""

    def step(y, step):
        return one_step(oscillator, y, step, mesh_frequency), None

    return jax.lax.scan(lambda y, _: (jax.lax.scan(step, y, steps)[0], None), y, length=count)[0]


def moved(oscillator: Oscillator, z: Unknowns, steps: Steps, mesh_frequency: Scalar, count: int) -> Unknowns:
    """By how much the unknowns change over some cycles: zero on a periodic orbit."""
    y = after(oscillator, unscaled(z, mesh_frequency), steps, mesh_frequency, count)
    return scaled(y, mesh_frequency) - z


Nodes = int | Float[Array, " nodes"]


def checked(owner: str, oscillator: Any, mesh_frequency: Any, start: Any, steps: Any) -> tuple[Scalar, State, Nodes]:
    """Mesh frequency and start as arrays of the oscillator's type, and what `steps_at` takes.

    Raises:
        TypeError: for something else than an `Oscillator`.
        ValueError: for a mesh frequency that is not positive, a start of another shape or steps out of order.
    """
    if not isinstance(oscillator, Oscillator):
        raise TypeError(f"{owner}: oscillator is of type {type(oscillator).__name__}, must be an Oscillator")
    frequency = real(mesh_frequency)
    if frequency.shape != ():
        raise ValueError(
            f"{owner}: mesh_frequency has shape {frequency.shape}, must be a single number; make many with jax.vmap"
        )
    check(owner, "mesh_frequency", frequency, "Hz", low=0.0, open_low=True)
    shape = oscillator.mass.shape
    if not isinstance(start, tuple | list) or len(start) != 2:
        raise ValueError(f"{owner}: start must be displacements and velocities (x, v)")
    parts = [real(part) for part in start]
    for name, part in zip(("displacements", "velocities"), parts):
        if part.shape != shape:
            raise ValueError(f"{owner}: {name} of start have shape {part.shape}, must be {shape}")
    dtype = jnp.result_type(oscillator.mass, frequency)
    x, v = (part.astype(dtype) for part in parts)
    return frequency.astype(dtype), (x, v), nodes_of(owner, steps)


def nodes_of(owner: str, steps: Any) -> Nodes:
    """What `steps_at` takes, checked.

    Raises:
        ValueError: for fewer than two steps, or nodes that do not increase from 0 to 1.
    """
    if isinstance(steps, int | np.integer):
        return whole(owner, "steps", steps, 2)
    nodes = real(steps)
    if nodes.ndim != 1 or len(nodes) < 3:
        raise ValueError(f"{owner}: steps have shape {nodes.shape}, must be a whole number or at least 3 nodes")
    known = concrete(nodes)
    if known is not None and (known[0] != 0 or known[-1] != 1 or (np.diff(known) <= 0).any()):
        raise ValueError(f"{owner}: nodes of steps must increase from 0 to 1 base pitch")
    return nodes


def steps_at(oscillator: Oscillator, nodes: Nodes) -> Steps:
    """Steps between nodes of a mesh cycle, or so many as the mesh force lays them out."""
    if isinstance(nodes, int):
        nodes = oscillator.mesh_force.nodes(nodes)
    return steps_of(oscillator, nodes.astype(oscillator.mass.dtype))
