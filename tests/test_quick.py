"""Programs that are compiled without optimization where they are called as they are, and only there."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxgear.numerics import programs, quick_jit


@pytest.fixture
def compiler(monkeypatch):
    """The options that every program was compiled with, where the user has not said how to compile."""
    monkeypatch.setattr(programs, "quick_options", lambda: {"xla_backend_optimization_level": 0})
    monkeypatch.setattr(programs, "_everything", False)
    given, whole = [], eqx.filter_jit

    def recorded(function, **options):
        jitted = whole(function, **options)

        def run(*args):
            given.append(options.get("compiler_options"))
            return jitted(*args)

        return run

    monkeypatch.setattr(programs.eqx, "filter_jit", recorded)
    return given


def test_numbers_are_quickly_compiled_for_and_tracers_are_not(compiler):
    square = quick_jit(lambda x: x**2)
    one, known = jnp.ones(3), jnp.full(3, 2.0)
    assert float(square(known)[0]) == 4.0 and compiler == [{"xla_backend_optimization_level": 0}]
    compiler.clear()
    # nothing that is traced goes into the last of each: JAX takes no options there either
    assert jax.jit(lambda x: square(x) + square(known))(one).shape == (3,)
    assert jax.vmap(lambda x: square(x) + square(known).sum())(one).shape == (3,)
    assert float(jax.grad(lambda x: (square(x) * square(known)).sum())(one)[0]) == pytest.approx(8.0)
    assert jax.eval_shape(lambda x: square(x) * square(known), one).shape == (3,)
    assert compiler == 8 * [None]


def test_what_runs_for_long_is_quickly_compiled_where_all_is(compiler):
    square = quick_jit(lambda x: x**2, always=False)
    before = jax.config.read("jax_disable_most_optimizations")
    try:
        square(jnp.ones(3))
        programs.compile_quickly()
        square(jnp.ones(3))
        assert jax.config.read("jax_disable_most_optimizations")
    finally:
        jax.config.update("jax_disable_most_optimizations", before)
    assert compiler == [None, {"xla_backend_optimization_level": 0}]


def test_the_compiler_is_asked_what_it_knows(monkeypatch):
    known = {"xla_backend_optimization_level": 0}
    for options in (known, {**known, "xla_of_another_version": True}):
        assert programs.supported_options(options) == known
    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_enable_fast_math=false")
    found = programs.quick_options.__wrapped__()
    assert found["xla_backend_optimization_level"] == 0 and set(found) <= set(programs.OPTIONS)


def test_whoever_says_how_to_compile_is_heard(monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--xla_backend_optimization_level=2")
    assert programs.quick_options.__wrapped__() is None


def test_another_python_number_compiles_nothing_anew():
    traced = []

    @quick_jit
    def scaled(x, factor, *, offset=0.0, name="plain"):
        traced.append(name)
        return x["depth"] * factor + offset

    found = [float(scaled({"depth": 0.5 + n}, 2.0 * n, offset=n)) for n in range(4)]
    assert found == [n * (1 + 2 * n) + n for n in range(4)] and len(traced) == 1
    # of the type that jax.jit gives it: a Python number takes that of the array beside it
    single = scaled({"depth": jnp.ones(2, jnp.float32)}, 3.0, offset=np.float32(1))
    assert single.dtype == jnp.float32 and len(traced) == 2
    scaled({"depth": jnp.zeros(2, jnp.float32)}, 4.0, offset=np.float32(2), name="another")  # static
    assert traced == ["plain", "plain", "another"]
