"""Newton's method for a few equations in as many unknowns, with exact derivatives of their root."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .dense import pseudo_inverse

Vector = Float[Array, " unknowns"]
Matrix = Float[Array, "unknowns unknowns"]
Function = Callable[[Vector], Vector]

# Newton's method has converged where its next step is this power of the rounding error of the unknowns: what is left
# after that step is far below.
_CONVERGED = 2 / 3
# Directions in which the equations change by less than this many rounding errors have no say: nothing determines the
# root along them, and it stays where it is.
_SINGULAR = 1e3
_LEAST_SHARE = 1 / 64  # of a Newton step; a root that needs smaller ones is out of reach


class Found(NamedTuple):
    """What Newton's method ended with.

    Attributes:
        root: the unknowns.
        residual: of the equations there.
        jacobian: of the equations there.
        steps: that were taken.
        converged: whether the next step would have been below the tolerance.
    """

    root: Vector
    residual: Vector
    jacobian: Matrix
    steps: Array
    converged: Bool[Array, ""]


def newton(function: Function, start: Vector, *, most: int = 30) -> Found:
    """A root near the start by Newton's method; steps that make the equations worse are halved.

    It has no derivatives: those of a root are `implicit_root`'s.

    Args:
        function: the equations, scaled so that unknowns and residuals are comparable with each other.
        start: first guess.
        most: largest number of evaluations; NaN ends as not converged.
    """

    def evaluated(x):
        value, jacobian = with_jacobian(function, x)
        return value, jacobian, -solve(jacobian, value)

    def go_on(state):
        x, (_, _, step), share, count = state
        return ~_is_small(step, x) & (count < most) & (share >= _LEAST_SHARE)

    def advance(state):
        x, (value, jacobian, step), share, count = state
        ahead = x + share * step
        there = evaluated(ahead)
        # at most as large: rounding is all that is left of the residual of a root
        better = jnp.linalg.norm(there[0]) <= jnp.linalg.norm(value)
        x, here = jax.tree.map(partial(jnp.where, better), (ahead, there), (x, (value, jacobian, step)))
        return x, here, jnp.where(better, jnp.minimum(2 * share, 1.0), 0.5 * share), count + 1

    begin = start, evaluated(start), jnp.ones((), start.dtype), jnp.ones((), start.dtype)
    x, (value, jacobian, step), _, count = jax.lax.while_loop(go_on, advance, begin)
    return Found(x, value, jacobian, count, _is_small(step, x))


def implicit_root(function: Function, start: Vector, *, most: int = 30) -> Vector:
    """A root of equations, differentiable any number of times with respect to what the function encloses.

    Derivatives come from the implicit function theorem, in forward and in reverse mode, never from the iteration.
    Where that has not converged, which the residual tells, they have no meaning.

    Args:
        function, most: as for `newton`.
        start: first guess; no derivative passes through it.
    """

    def tangent_solve(linear, of):
        return solve(with_jacobian(linear, jnp.zeros_like(of))[1], of)

    return jax.lax.custom_root(
        function, jax.lax.stop_gradient(start), lambda f, x: newton(f, x, most=most).root, tangent_solve
    )


def with_jacobian(function: Callable, x: Vector, *, has_aux: bool = False) -> Any:
    """(value, Jacobian), (value, Jacobian, auxiliary result) with `has_aux`, from one evaluation in forward mode."""

    def along(direction):
        return jax.jvp(function, (x,), (direction,), has_aux=has_aux)

    axes = (None, 1, None) if has_aux else (None, 1)
    return jax.vmap(along, out_axes=axes)(jnp.eye(len(x), dtype=x.dtype))


def solve(matrix: Matrix, of: Vector) -> Vector:
    """Solution of linear equations; of a singular matrix the shortest of the best."""
    return pseudo_inverse(matrix, _SINGULAR * float(jnp.finfo(of.dtype).eps)) @ of


def _is_small(step: Vector, x: Vector) -> Bool[Array, ""]:
    return jnp.linalg.norm(step) <= jnp.finfo(x.dtype).eps ** _CONVERGED * jnp.maximum(jnp.linalg.norm(x), 1e-30)
