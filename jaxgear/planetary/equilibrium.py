"""Equilibrium of a planetary stage at all mesh positions: Newton's method on the motions of all members."""

import operator
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..contact.status import Status, Statuses, status_of
from ..numerics import changed, on_both
from ..numerics.implicit import jvp_of_given
from .meshes import AbstractLoadedMesh
from .springs import Central, Linkage, Motion, Springs

Curve = Float[Array, " positions"]
Meshes = tuple[AbstractLoadedMesh, AbstractLoadedMesh]

# What may be left of the forces, relative to the sum of the mesh forces: some hundred rounding errors.
_LEFT = {"float32": 2e-5, "float64": 1e-10}
_MOST = 60  # steps; six are usual, ten where planets lose contact
_LEAST_SHARE = 1e-6  # of a step, which may be long where a motion has little stiffness
_MOST_RISE = 0.5  # slope of the energy behind a step over its fall before it
# Longest step [um], beside the motions so far: springs of lost contacts have no stiffness, and say nothing of how far.
_LONGEST, _SHORTEST = 15.0, 1e-30
# Share of the regularization in the stiffness of a central motion above which neither mesh nor support holds it
_LOOSE = 0.1


class Equilibrium(eqx.Module):
    """Motions and forces of a stage in equilibrium.

    Attributes:
        motion: of central members and planets [um].
        springs: forces of the contacts with sun and ring and of the pins, radial and tangential, shape (4, planets,
            positions) [N].
        residual: largest force that is left over, relative to the sum of the mesh forces, shape (positions,).
        loose: True where no mesh and no support holds a floating member in some direction, shape (positions,).
        status: status, shape (positions,).
    """

    motion: Motion
    springs: Springs
    residual: Curve
    loose: Bool[Array, " positions"]
    status: Statuses


@eqx.filter_custom_jvp
def equilibrium(linkage: Linkage, meshes: Meshes, guess: Springs) -> Equilibrium:
    """Equilibrium of all motions at every mesh position.

    Derivatives of any order come from the implicit function theorem, in forward and in reverse mode.

    Args:
        linkage: geometry and supports.
        meshes: meshes of all planets with sun and ring.
        guess: usual stiffness of all springs [N/um], from which the search begins.
    """
    found, flexibility = _search(linkage, meshes, guess)
    converged = found.residual <= _LEFT[str(found.residual.dtype)]
    return Equilibrium(
        motion=found.motion,
        springs=found.springs,
        residual=found.residual,
        loose=jnp.max(flexibility, axis=0) * linkage.regularization > _LOOSE,
        status=status_of({Status.NOT_CONVERGED: ~converged}, found.status),
    )


@equilibrium.def_jvp
def _equilibrium_jvp(primals, tangents):
    """d motion = -H^-1 (d left at fixed motions); the forces of the springs follow from both."""
    linkage, meshes, guess = primals
    found = equilibrium(*primals)

    def at_motion(given: tuple[Linkage, Meshes]) -> tuple[Springs, Springs, Motion]:
        here = _evaluated(*given, found.motion)
        return here.stiffness, here.springs, here.left

    values, changes = jvp_of_given(at_motion, (linkage, meshes), tangents[:2])
    stiffness, (_, springs, left) = values[0], changes
    moves, _ = linkage.solve(stiffness, left)
    # once more for what the regularization has left
    missed = _minus(left, linkage.forces_on(stiffness * linkage.stretch(moves), moves))
    moves = _minus(_minus(Motion(*map(jnp.zeros_like, moves)), moves), linkage.solve(stiffness, missed)[0])
    springs = springs + stiffness * linkage.stretch(moves)
    return found, changed(found, motion=moves, springs=springs, residual=None, loose=None, status=None)


def _minus(one: Motion, other: Motion) -> Motion:
    return jax.tree.map(operator.sub, one, other)


class _State(NamedTuple):
    """Motions with the springs there, and the forces that are left over."""

    motion: Motion
    springs: Springs
    stiffness: Springs
    left: Motion
    residual: Curve
    status: Statuses


def _evaluated(linkage: Linkage, meshes: Meshes, motion: Motion) -> _State:
    stretch = linkage.stretch(motion) - linkage.offset[:, :, None]
    contacts = on_both(lambda given: given[0].forces(given[1]), (meshes[0], stretch[0]), (meshes[1], stretch[1]))
    pin = jnp.broadcast_to(linkage.pin[:, None, None], stretch[2:].shape)
    springs = jnp.concatenate([jnp.stack([mesh.force for mesh in contacts]), pin * stretch[2:]])
    stiffness = jnp.concatenate([jnp.stack([mesh.stiffness for mesh in contacts]), pin])
    left = linkage.left_over(springs, motion)
    status = jnp.max(jnp.stack([mesh.status for mesh in contacts]), axis=(0, 1))
    return _State(motion, springs, stiffness, left, _largest(left) / linkage.force, status)


def _search(linkage: Linkage, meshes: Meshes, guess: Springs) -> tuple[_State, Central]:
    """The equilibrium by Newton's method, and the diagonal of the inverse stiffness of the central motions there.

    The first step is that of springs of constant stiffness, none of which can lose contact. A later one beyond which
    the energy rises is cut to a quarter.
    """
    tolerance = _LEFT[str(linkage.force.dtype)]

    def go_on(carry):
        state, _, share, count = carry
        return (count < _MOST) & jnp.any((state.residual > tolerance) & (share >= _LEAST_SHARE))

    def advance(carry):
        state, _, share, count = carry
        step, flexibility = linkage.solve(state.stiffness, state.left)
        longest = jnp.where(count == 0, jnp.inf, _LONGEST + _largest(state.motion))
        allowed = share * jnp.minimum(1.0, longest / jnp.maximum(_largest(step), _SHORTEST))
        ahead = jax.tree.map(lambda at, back: at - _alike(allowed, at) * back, state.motion, step)
        there = _evaluated(linkage, meshes, ahead)
        # the energy is convex: a step behind which it falls or rises little was not too long
        fall, rise = _along(step, state.left), -_along(step, there.left)
        better = (there.residual <= state.residual) | (rise <= _MOST_RISE * fall)
        state = jax.tree.map(lambda new, old: jnp.where(_alike(better, new), new, old), there, state)
        return state, flexibility, jnp.where(better, jnp.minimum(2 * share, 1.0), 0.25 * share), count + 1

    begin = _at_rest(linkage, guess)
    flexibility = jnp.zeros_like(begin.motion.central)
    return jax.lax.while_loop(go_on, advance, (begin, flexibility, jnp.ones_like(begin.residual), 0))[:2]


def _at_rest(linkage: Linkage, guess: Springs) -> _State:
    """No motions, and springs of constant stiffness."""
    planets, positions = guess.shape[1:]
    central, local = jnp.zeros((len(linkage.support), positions)), jnp.zeros((3, planets, positions))
    motion = Motion(central.astype(guess.dtype), local.astype(guess.dtype))
    springs = -guess * linkage.offset[:, :, None]
    endless = jnp.full(positions, jnp.inf, guess.dtype)
    return _State(motion, springs, guess, linkage.left_over(springs, motion), endless, jnp.zeros(positions, jnp.int8))


def _alike(curve: Array, of: Array) -> Array:
    """Values of all positions in the shape of an array."""
    return jnp.broadcast_to(curve, of.shape)


def _along(step: Motion, forces: Motion) -> Curve:
    """Work of forces along a step, at every position."""
    return jnp.sum(step.central * forces.central, axis=0) + jnp.sum(step.local * forces.local, axis=(0, 1))


def _largest(motion: Motion) -> Curve:
    return jnp.maximum(jnp.max(jnp.abs(motion.central), axis=0), jnp.max(jnp.abs(motion.local), axis=(0, 1)))
