"""Programs that are compiled without optimization where they are called as they are, and only there."""

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest

from jaxgear.numerics import quick, quick_jit


@pytest.fixture
def compiler(monkeypatch):
    """The options that every program was compiled with, for a version of JAX that knows them."""
    monkeypatch.setattr(quick, "quick_options", lambda: quick.OPTIONS)
    given, whole = [], eqx.filter_jit

    def recorded(function, **options):
        jitted = whole(function, **options)

        def run(*args):
            given.append(bool(options))
            return jitted(*args)

        return run

    monkeypatch.setattr(quick.eqx, "filter_jit", recorded)
    return given


def test_numbers_are_quickly_compiled_for_and_tracers_are_not(compiler):
    square = quick_jit(lambda x: x**2)
    one, known = jnp.ones(3), jnp.full(3, 2.0)
    assert float(square(known)[0]) == 4.0 and compiler == [True]
    compiler.clear()
    # nothing that is traced goes into the last of each: JAX takes no options there either
    assert jax.jit(lambda x: square(x) + square(known))(one).shape == (3,)
    assert jax.vmap(lambda x: square(x) + square(known).sum())(one).shape == (3,)
    assert float(jax.grad(lambda x: (square(x) * square(known)).sum())(one)[0]) == pytest.approx(8.0)
    assert jax.eval_shape(lambda x: square(x) * square(known), one).shape == (3,)
    assert compiler == 8 * [False]


def test_whoever_says_how_to_compile_is_heard(monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--xla_backend_optimization_level=2")
    assert quick.quick_options.__wrapped__() is None
    monkeypatch.setenv("XLA_FLAGS", "")
    monkeypatch.setattr(quick, "version", lambda _: "9.9.9")
    assert quick.quick_options.__wrapped__() is None
