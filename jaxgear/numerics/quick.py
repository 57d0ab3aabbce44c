"""Programs that run a few times, compiled in a fraction of the time."""

import functools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, ParamSpec, TypeVar

import equinox as eqx
import jax
from jax.extend.core import get_opaque_trace_state

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")

# XLA without its optimizations and without the slower one of its code generators, where a version has two
OPTIONS: dict[str, Any] = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}

_everything = False


def compile_quickly() -> None:
    """From now on every program of this process is compiled quickly, unless the user has said how.

    For a process whose longest programs, too, take longer to compile than to run: they are compiled in a third of the
    time and run half as long again.
    """
    global _everything
    if quick_options() is not None:
        _everything = True
        jax.config.update("jax_disable_most_optimizations", True)  # for operations outside of programs


def quick_jit(function: Callable[_Given, _Found], *, always: bool = True) -> Callable[_Given, _Found]:
    """`eqx.filter_jit`, whose programs are compiled without optimization where numbers are given, not traced.

    For functions whose programs, called as they are, take a thousand times longer to compile than to run. As part of
    another program, under `jax.jit`, `jax.vmap` or `jax.grad`, they are compiled as that one is: with all
    optimizations, unless the user says otherwise.

    Args:
        function: to be compiled.
        always: False for a function that runs for longer than it compiles: quickly after `compile_quickly` only.
    """
    full = eqx.filter_jit(function)

    @functools.cache
    def quick() -> Callable[_Given, _Found]:
        options_of_jax: dict[str, Any] = {"compiler_options": quick_options()}
        return eqx.filter_jit(function, **options_of_jax)

    @functools.wraps(function)
    def run(*args: _Given.args, **options: _Given.kwargs) -> _Found:
        return (quick() if is_quick(always) and is_eager() else full)(*args, **options)

    return run


def is_quick(always: bool) -> bool:
    """Whether a function is compiled quickly, by what `quick_jit` was told of it."""
    return (always or _everything) and quick_options() is not None


@functools.cache
def quick_options() -> dict[str, Any] | None:
    """Options for JAX's compiler, as far as its version knows them; None where the user has said how to compile."""
    given = os.environ.get("XLA_FLAGS", "")
    if jax.default_backend() != "cpu" or any(option in given for option in OPTIONS):
        return None
    return known_of(OPTIONS)


def known_of(options: dict[str, Any]) -> dict[str, Any]:
    """Those of the options that the compiler knows: it refuses every program with one that it does not know."""
    if _compiles(options):
        return options
    return {name: value for name, value in options.items() if _compiles({name: value})}


def _compiles(options: dict[str, Any]) -> bool:
    try:
        jax.jit(lambda: 0.0).lower().compile(options)
    except jax.errors.JaxRuntimeError:
        return False
    return True


def is_eager() -> bool:
    """Whether nothing is being traced: JAX takes options for a program, not for a part of one."""
    return bool(get_opaque_trace_state() == _untraced())


@functools.cache
def _untraced():
    """The state in which nothing is being traced: that of a new thread."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(get_opaque_trace_state).result()
