"""The benchmark that counts how large programs are."""

import jax
import jax.numpy as jnp
import pytest

from benchmarks import programs


def test_operations_inside_of_calls_and_loops_count_once():
    def once(x):
        return jnp.sin(jax.jit(jnp.cos)(x)) + 1.0

    def often(x):
        return jax.lax.scan(lambda y, _: (once(y), None), x, length=100)[0]

    assert [programs.operations(jax.make_jaxpr(each)(1.0).jaxpr) for each in (once, often)] == [3, 3]


@pytest.mark.parametrize("name", ["PPTE", "PPTE and gradient, evaluate"])
def test_programs_do_not_grow_unnoticed(name):
    assert programs.grown({name: programs.count(name)}, programs.recorded()) == []


def test_a_program_that_has_grown_is_named():
    sizes = {"PPTE": programs.Size(1040)}
    (line,) = programs.grown(sizes, {"PPTE": 1000})
    assert line == "PPTE: 1040 operations, at most 1000 and 3% more"
    assert programs.grown(sizes, {"PPTE": 1010}) == []
