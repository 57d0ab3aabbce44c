"""Scalar roots inside a bracket, elementwise over arrays, with exact derivatives."""

from functools import partial

import jax
import jax.numpy as jnp

from .tangents import jvp_of_given

_BISECTIONS = 24  # the bracket shrinks to 6e-8 of its width, from where two Newton steps reach machine precision
_NEWTON_STEPS = 2


@partial(jax.jit, static_argnames="function", inline=True)
def bracketed_root(function, low, high, args):
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
