"""Roots with exact derivatives, of one equation and of a few."""

import operator
from collections.abc import Callable, Collection
from functools import partial
from typing import Any, Literal, NamedTuple, ParamSpec, TypeVar, overload

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Bool, Float, PyTree

from .dense import pseudo_inverse
from .safe import stored

Real = Float[Array, "..."]
Vector = Float[Array, " unknowns"]
Matrix = Float[Array, "unknowns unknowns"]
Function = Callable[[Vector], Vector]
Result = TypeVar("Result")
_Given = ParamSpec("_Given")
_Tree = TypeVar("_Tree")


def jvp_of_given(
    function: Callable[[_Tree], Result], primal: _Tree, tangent: PyTree[Array | SymbolicZero | None]
) -> tuple[Result, Result]:
    """`jax.jvp` along those leaves of the tangent that are neither None nor symbolically zero: others cost nothing."""
    tangents = jax.tree.leaves(tangent, is_leaf=_nothing)
    primals, structure = jax.tree.flatten(primal, is_leaf=_nothing)
    given = [i for i, leaf in enumerate(tangents) if not _nothing(leaf)]

    def of_given(leaves):
        everything = list(primals)
        for i, leaf in zip(given, leaves):
            everything[i] = leaf
        return function(jax.tree.unflatten(structure, everything))

    return jax.jvp(of_given, ([primals[i] for i in given],), ([tangents[i] for i in given],))


# Numbers by which a chain is differentiated one by one. That leaves out what does not depend on each, and runs in two
# thirds of the time; of more numbers, all at once makes a smaller program.
_ONE_BY_ONE = 6


def by_numbers(function: Callable[_Given, Result], *, entrywise: Collection[int] = ()) -> Callable[_Given, Result]:
    """The function, with its derivative by every single number of its arguments formed in forward mode.

    Reverse mode then keeps one array per number and result, the derivative by it, and none of what led there. That pays
    where an elementwise chain follows from a few numbers. The same holds for arrays that act entry by entry. Others are
    differentiated as always.

    Args:
        function: function of positional arguments.
        entrywise: places of the arguments each entry of which acts on that entry of the results alone, or on all along
            an axis of which it has length one.
    """
    wrapped = eqx.filter_custom_jvp(function)
    of_any: Callable[..., Result] = function

    def rule(primals, tangents):
        leaves, structure = jax.tree.flatten(tangents, is_leaf=_nothing)
        values = jax.tree.leaves(primals, is_leaf=_nothing)
        single = [i in entrywise for i, each in enumerate(tangents) for _ in jax.tree.leaves(each, is_leaf=_nothing)]
        moving = [i for i, leaf in enumerate(leaves) if leaf is not None]
        numbers = [i for i in moving if single[i] or leaves[i].ndim == 0]
        arrays = [i for i in moving if i not in numbers]

        def along(directions):
            every = jax.tree.unflatten(structure, [directions.get(i) for i in range(len(leaves))])
            return jvp_of_given(lambda given: of_any(*given), primals, every)[1]

        if len(numbers) > _ONE_BY_ONE:
            basis = jnp.eye(len(numbers), dtype=values[numbers[0]].dtype)
            every = jax.vmap(lambda row: along({i: row[k] * jnp.ones_like(values[i]) for k, i in enumerate(numbers)}))
            together = every(basis)
            derivatives = [jax.tree.map(operator.itemgetter(k), together) for k in range(len(numbers))]
        else:
            derivatives = [along({i: jnp.ones_like(values[i])}) for i in numbers]
        changes = [jax.tree.map(partial(_times, leaves[i]), each) for i, each in zip(numbers, derivatives)]
        if arrays:
            changes.append(along({i: leaves[i] for i in arrays}))
        return wrapped(*primals), jax.tree.map(lambda *parts: sum(parts), *changes)

    wrapped.def_jvp(rule)
    return wrapped


def _times(change, derivative):
    """Change of a result; none by a number that varies along an axis which the result does not have."""
    if jnp.broadcast_shapes(jnp.shape(change), jnp.shape(derivative)) != jnp.shape(derivative):
        return jnp.zeros_like(derivative)
    return change * stored(derivative)


def _nothing(leaf) -> bool:
    return leaf is None or isinstance(leaf, SymbolicZero)


_BISECTIONS = 24  # the bracket shrinks to 6e-8 of its width, from where two Newton steps reach machine precision
_NEWTON_STEPS = 2


@partial(jax.jit, static_argnames="function", inline=True)
def bracketed_root(function: Callable[[Real, _Tree], Real], low: Real, high: Real, args: _Tree) -> Real:
    """Root of an increasing or decreasing `function(x, args)` in [low, high], elementwise.

    Bisection finds the root, Newton steps polish it. Derivatives of any order with respect to `args` come from the
    implicit function theorem, never from the iteration. Where the function has no sign change the end nearer to a root
    is returned, with derivatives of zero.

    Args:
        function: (x, args) -> residual, same shape as x. A function of a module, not one made at every call, outside of
            compiled code: each compiles anew. It takes everything that is traced from `args`.
        low: lower end, any shape.
        high: upper end, same shape.
        args: pytree that the function depends on; derivatives flow through it only.
    """
    return _root(function, low, high, args)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _root(function, low, high, args):
    sign = jnp.where(function(high, args) >= function(low, args), 1.0, -1.0)

    def halve(_, bracket):
        a, b = bracket
        middle = 0.5 * (a + b)
        left = sign * function(middle, args) < 0
        return jnp.where(left, middle, a), jnp.where(left, b, middle)

    def polish(_, x):
        value, slope = _with_slope(function, x, args)
        return x - _quotient(value, slope)

    a, b = jax.lax.fori_loop(0, _BISECTIONS, halve, (low, high))
    x = 0.5 * (a + b)
    at_end = (x - low <= 2 * (b - a)) | (high - x <= 2 * (b - a))
    end = jnp.where(x - low < high - x, low, high)
    polished = jax.lax.fori_loop(0, _NEWTON_STEPS, polish, x)
    return jnp.where(at_end & ~((polished > low) & (polished < high)), end, polished)


@partial(_root.defjvp, symbolic_zeros=True)
def _root_jvp(function, primals, tangents):
    """dx = -(df / dargs dargs) / (df / dx) inside the bracket; its ends stay where they are."""
    (low, high, args), (_, _, args_dot) = primals, tangents
    x = _root(function, low, high, args)
    _, residual_dot = jvp_of_given(lambda args: function(x, args), args, args_dot)
    _, slope = _with_slope(function, x, args)
    inside = (x != low) & (x != high)
    return x, jnp.where(inside, -_quotient(residual_dot, slope), 0.0)


def _with_slope(function, x, args):
    return jax.jvp(lambda t: function(t, args), (x,), (jnp.ones_like(x),))


def _quotient(value, slope):
    """value / slope, 0 where the function is flat."""
    ok = slope != 0
    return jnp.where(ok, value / jnp.where(ok, slope, jnp.ones_like(slope)), jnp.zeros_like(value))


# Rise of a residual per root below which nothing tells how the root moves: two roots meet there.
_LEAST_RISE = 1e-3


def at_root(function: Callable[..., tuple[Real, ...]], search: Callable[..., Real], *given: Any) -> tuple[Real, ...]:
    """Results of a function at its root, elementwise; derivatives of any order by the implicit function theorem.

    Args:
        function: (root, *given) -> (*results, residual); the residual rises with the root.
        search: (*given) -> root, to rounding; it is never differentiated.
        given: arguments of both functions; derivatives flow through them.

    Returns:
        (*results, root)
    """

    @eqx.filter_custom_jvp
    def found(*given):
        root = search(*given)
        return *function(root, *given)[:-1], root

    def rule(primals, tangents):
        root = found(*primals)[-1]
        values, changes = jvp_of_given(lambda given: function(root, *given), primals, tangents)
        _, slopes = jax.jvp(lambda root: function(root, *primals), (root,), (jnp.ones_like(root),))
        rise = jnp.where(slopes[-1] > _LEAST_RISE, slopes[-1], jnp.ones_like(root))
        moves = -changes[-1] / stored(rise)
        following = [change + slope * moves for change, slope in zip(changes[:-1], slopes[:-1])]
        return (*values[:-1], root), (*following, moves)

    found.def_jvp(rule)
    return found(*given)


_FARTHEST = 10.0  # step per value of the function


class _Tried(NamedTuple):
    """A place and the value of a function there."""

    place: Real
    value: Real


def rising_root(function: Callable[[Real], Real], start: Real, *, most: int, within: float) -> Real:
    """Where a function rises through zero, elementwise; secants lead there.

    Between values of either sign the end that stays a second time counts with half its value (Illinois; M. Dowell,
    P. Jarratt, BIT 11, 1971).

    Args:
        function: falls without bound to the left and rises to the right, at a rate of about one.
        start: first guess.
        most: largest number of evaluations.
        within: step below which an entry is found.
    """

    def go_on(state):
        *_, step, count = state
        return (count < most) & ((count == 0) | jnp.any(jnp.abs(step) > within))

    def advance(state):
        x, low, high, step, count = state
        here = _Tried(x, stored(function(x)))
        falls = here.value < 0
        same, other = _either(falls, low, high), _either(falls, high, low)
        other = other._replace(value=jnp.where(falls == (step > 0), 0.5, 1.0) * other.value)
        towards = _either(jnp.isfinite(other.place), other, same)
        apart = x - towards.place
        known = jnp.isfinite(apart) & (apart != 0)
        rate = jnp.where(known, here.value - towards.value, 1.0) / jnp.where(known, apart, 1.0)
        step = -here.value / jnp.maximum(rate, 1 / _FARTHEST)
        return x + step, _either(falls, here, other), _either(falls, other, here), step, count + 1

    far = jnp.full_like(start, jnp.inf)
    state = start, _Tried(-far, -far), _Tried(far, far), jnp.zeros_like(start), 0
    return jax.lax.while_loop(go_on, advance, state)[0]


def _either(first: Bool[Array, "..."], one: _Tried, other: _Tried) -> _Tried:
    return jax.tree.map(partial(jnp.where, first), one, other)


# Newton's method has converged where its next step is this power of the rounding error of the unknowns: what is left
# after that step is far below.
_CONVERGED = 2 / 3
# Directions in which the equations change by less than this many rounding errors have no say: nothing determines the
# root along them, and it stays where it is.
_SINGULAR = 1e3
_LEAST_SHARE = 1 / 64  # of a Newton step; a root that needs smaller ones is out of reach


class NewtonRoot(NamedTuple):
    """Result of Newton's method.

    Attributes:
        root: the unknowns.
        residual: residual of the equations at the root.
        jacobian: Jacobian of the equations at the root.
        steps: number of evaluations.
        converged: True if the next step would have been below the tolerance.
    """

    root: Vector
    residual: Vector
    jacobian: Matrix
    steps: Array
    converged: Bool[Array, ""]


def newton(function: Function, start: Vector, *, most: int = 30) -> NewtonRoot:
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
    return NewtonRoot(x, value, jacobian, count, _is_small(step, x))


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


@overload
def with_jacobian(function: Function, x: Vector) -> tuple[Vector, Matrix]: ...


@overload
def with_jacobian(
    function: Callable[[Vector], tuple[Vector, Result]], x: Vector, *, has_aux: Literal[True]
) -> tuple[Vector, Matrix, Result]: ...


def with_jacobian(function: Callable[[Vector], Any], x: Vector, *, has_aux: bool = False) -> tuple[Any, ...]:
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
