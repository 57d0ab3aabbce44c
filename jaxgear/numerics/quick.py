"""Programs that a script compiles and runs a few times: compiled in a fraction of the time."""

import functools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from typing import Any, ParamSpec, TypeVar

import equinox as eqx
import jax
from jax.extend.core import get_opaque_trace_state

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")

# XLA without its optimizations and without the slower one of its code generators; a version that does not know an
# option refuses to compile, so these are for the versions that were tried.
OPTIONS: dict[str, Any] = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}
TRIED = "0.10."


def quick_jit(function: Callable[_Given, _Found]) -> Callable[_Given, _Found]:
    """`eqx.filter_jit`, whose programs are compiled without optimization where numbers are given, not traced.

    For functions whose programs, called as they are, take a thousand times longer to compile than to run. As part of
    another program, under `jax.jit`, `jax.vmap` or `jax.grad`, they are compiled as that one is: with all
    optimizations, unless the user says otherwise.
    """
    options_of_jax: dict[str, Any] = {"compiler_options": OPTIONS}
    quick, full = eqx.filter_jit(function, **options_of_jax), eqx.filter_jit(function)

    @functools.wraps(function)
    def run(*args: _Given.args, **options: _Given.kwargs) -> _Found:
        return (quick if quick_options() is not None and is_eager() else full)(*args, **options)

    return run


@functools.cache
def quick_options() -> dict[str, Any] | None:
    """Options for JAX's compiler; None where it does not know them, or the user has said how to compile."""
    given = os.environ.get("XLA_FLAGS", "")
    tried = version("jaxlib").startswith(TRIED) and jax.default_backend() == "cpu"
    return OPTIONS if tried and not any(option in given for option in OPTIONS) else None


def is_eager() -> bool:
    """Whether nothing is being traced: JAX takes options for a program, not for a part of one."""
    return bool(get_opaque_trace_state() == _untraced())


@functools.cache
def _untraced():
    """The state in which nothing is being traced: that of a new thread."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(get_opaque_trace_state).result()
