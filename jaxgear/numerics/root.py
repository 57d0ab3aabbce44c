"""Scalar roots inside a bracket, elementwise over arrays, with exact derivatives."""

from functools import partial

import jax
import jax.numpy as jnp

_BISECTIONS = 24  # the bracket shrinks to 6e-8 of its width, from where two Newton steps reach machine precision


@partial(jax.jit, static_argnames="function", inline=True)
def bracketed_root(function, low, high, args):
    """Root of an increasing or decreasing `function(x, args)` in [low, high], elementwise.

    Bisection finds the root without being differentiated; two Newton steps then polish it. Each differentiated Newton
    step doubles the order of the derivatives that are exact, so first, second and third derivatives with respect to
    `args` are. Where the function has no sign change the end nearer to a root is returned.

    Args:
        function: (x, args) -> residual, same shape as x. A function of a module, not one made at every call, outside of
            compiled code: each compiles anew.
        low: lower end, any shape.
        high: upper end, same shape.
        args: pytree that the function depends on; derivatives flow through it only.
    """
    frozen = jax.lax.stop_gradient(args)
    low, high = jax.lax.stop_gradient((low, high))
    sign = jnp.where(function(high, frozen) >= function(low, frozen), 1.0, -1.0)

    def halve(_, bracket):
        a, b = bracket
        middle = 0.5 * (a + b)
        left = sign * function(middle, frozen) < 0
        return jnp.where(left, middle, a), jnp.where(left, b, middle)

    a, b = jax.lax.fori_loop(0, _BISECTIONS, halve, (low, high))
    x = 0.5 * (a + b)
    at_end = (x - low <= 2 * (b - a)) | (high - x <= 2 * (b - a))
    end = jnp.where(x - low < high - x, low, high)
    polished = _newton(function, _newton(function, x, args), args)
    return jnp.where(at_end & ~((polished > low) & (polished < high)), end, polished)


def _newton(function, x, args):
    value, slope = jax.jvp(lambda t: function(t, args), (x,), (jnp.ones_like(x),))
    ok = slope != 0
    return x - jnp.where(ok, value / jnp.where(ok, slope, jnp.ones_like(slope)), jnp.zeros_like(value))
