"""Dense equations: as exact as LAPACK, with the derivatives of the inverse, and programs that call no LAPACK."""

import re
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from gearboxes import stage

import jaxgear as jg
from jaxgear.layout import level_load
from jaxgear.numerics import pseudo_inverse, solve_dense
from jaxgear.numerics.spline import interpolate
from jaxgear.shafts import support

EPS = np.finfo(float).eps
LEAST = 1e3 * EPS
SOLVE = jax.jit(solve_dense)
INVERSE = jax.jit(pseudo_inverse, static_argnums=1)


def random(*shape):
    return np.random.default_rng(sum(shape)).normal(size=shape)


def conditioned(size, condition):
    left, _, right = np.linalg.svd(random(size, size))
    return left * np.logspace(0, -np.log10(condition), size) @ right


@pytest.mark.parametrize("condition", [1e1, 1e8])
@pytest.mark.parametrize("size", [2, 9, 42])
def test_the_error_is_that_of_elimination(size, condition):
    """Residual by rounding of matrix and solution, whatever the condition; the error by that times the condition."""
    matrix, exact = conditioned(size, condition), random(size, 2)
    right = matrix @ exact
    found = np.asarray(SOLVE(matrix, right))
    assert np.abs(matrix @ found - right).max() < 4 * size * EPS * np.abs(matrix).max() * np.abs(found).sum()
    other = np.linalg.solve(matrix, right)
    assert np.abs(found - other).max() < 10 * size * EPS * condition * np.abs(exact).max()


@pytest.mark.parametrize("size", [3, 20])
def test_equations_in_any_order(size):
    """A permutation has nothing on its diagonal: every pivot is in another row."""
    order = np.roll(np.arange(size), 1)
    given = np.arange(size, dtype=float)
    np.testing.assert_array_equal(SOLVE(np.eye(size)[order], given)[order], given)


def test_one_equation_and_none_that_holds():
    assert float(SOLVE(np.array([[4.0]]), np.array([2.0]))[0]) == 0.5
    assert not np.isfinite(SOLVE(np.ones((3, 3)), np.arange(3.0))).any()


@pytest.mark.parametrize("size", [3, 11])
def test_derivatives_are_those_of_the_inverse(size):
    """d x = -A^-1 dA x, d2 x = 2 A^-1 dA A^-1 dA x; reverse and batched as forward and alone."""
    matrix, change, right = conditioned(size, 10.0), random(size, size), random(size)
    inverse = np.linalg.inv(matrix)

    def along(t):
        return solve_dense(jnp.asarray(matrix) + t * change, jnp.asarray(right))

    def derivatives(several):
        first = jax.jacfwd(along)
        return jax.vmap(along)(several), first(0.0), jax.jacrev(along)(0.0), jax.jacfwd(first)(0.0)

    several, step = np.array([0.0, 0.01, -0.02]), inverse @ change
    values, forward, reverse, second = jax.jit(derivatives)(several)
    x = inverse @ right
    exact = [np.linalg.solve(matrix + t * change, right) for t in several]
    np.testing.assert_allclose(values, exact, rtol=1e-10)
    np.testing.assert_allclose(forward, -step @ x, rtol=1e-10)
    np.testing.assert_allclose(reverse, -step @ x, rtol=1e-10)
    np.testing.assert_allclose(second, 2 * step @ step @ x, rtol=1e-10)


@pytest.mark.parametrize(("size", "rank"), [(1, 1), (2, 1), (5, 3), (12, 12)])
def test_pseudo_inverse_meets_penroses_conditions(size, rank):
    matrix = random(size, rank) @ random(rank, size)
    found = np.asarray(INVERSE(matrix, LEAST))
    bound = 1e3 * EPS * np.linalg.norm(found, 2) * np.linalg.norm(matrix, 2)
    np.testing.assert_allclose(matrix @ found @ matrix, matrix, atol=bound * np.linalg.norm(matrix))
    np.testing.assert_allclose(found @ matrix @ found, found, atol=bound * np.linalg.norm(found))
    np.testing.assert_allclose(matrix @ found, (matrix @ found).T, atol=bound)
    np.testing.assert_allclose(found @ matrix, (found @ matrix).T, atol=bound)


@pytest.mark.parametrize("scale", [1e-25, 1e25])
def test_pseudo_inverse_knows_no_units(scale):
    """In single precision too, whose squares end at 1e38."""
    matrix = np.random.default_rng(1).normal(size=(4, 4))
    given = jnp.asarray(scale * matrix, jnp.float32)
    np.testing.assert_allclose(scale * np.asarray(INVERSE(given, 1e-6), float), np.linalg.inv(matrix), rtol=1e-3)


def test_pseudo_inverse_follows_a_matrix_of_its_rank():
    """Central differences of NumPy's along matrices that all have rank 3."""
    left, right, turn = random(6, 3), random(3, 6), random(3, 3)

    def matrix(t):
        return left @ (np.eye(3) + t * turn) @ right + t * t * left @ right

    change = left @ turn @ right
    _, found = jax.jvp(lambda a: pseudo_inverse(a, LEAST), (jnp.asarray(matrix(0.0)),), (jnp.asarray(change),))
    step = 1e-5
    there, back = (np.linalg.pinv(matrix(t), rcond=LEAST) for t in (step, -step))
    np.testing.assert_allclose(found, (there - back) / (2 * step), rtol=1e-6, atol=1e-8)


def test_nothing_stays_nothing_and_nan_stays_nan():
    np.testing.assert_array_equal(INVERSE(np.zeros((3, 3)), LEAST), 0.0)
    assert np.isnan(INVERSE(jnp.eye(3).at[1, 2].set(jnp.nan), LEAST)).all()


def over_meshes(x):
    """Slices that are coupled through gears and shafts, and their contact."""
    held = support(stage(1.0, radial=300.0 * x))
    sizes = jg.Resolution(positions=8, contact_nodes=1, slices=7, pairs=2, slide_steps=0, newton_steps=2)
    return jg.solve(jg.prepare(held.pair, support=held, resolution=sizes), 40.0).transmission_error


def over_lines(x):
    return level_load(support(stage(1.0, radial=300.0 * x)), negative_crowning=True, stations=11).slope


def over_tables(x):
    return interpolate(jnp.linspace(0.0, 3.0, 9), jnp.arange(4.0), x * jnp.array([0.0, 1.0, 0.5, 2.0]), "natural_cubic")


def test_traced_code_has_no_other_equations():
    """What runs over many designs side by side solves, inverts and factorizes by `jaxgear.numerics.dense` alone."""
    calls = re.compile(r"(?:jnp|jsp|jax\.numpy|jax\.scipy)\.linalg\.(?:solve|inv|pinv|lstsq|cho|lu|qr|tensorsolve)\w*")
    folder = Path(jg.__file__).parent
    texts = {path.name: path.read_text(encoding="utf-8") for path in folder.rglob("*.py")}
    assert "solve_dense" in texts["dense.py"]
    assert {name: found for name, text in texts.items() if (found := calls.findall(text))} == {}


SLOW = (pytest.param(each, marks=pytest.mark.slow) for each in (over_meshes, over_lines))


@pytest.mark.parametrize("designs", [*SLOW, over_tables])
def test_a_sweep_calls_no_lapack(designs):
    """Its calls of many designs at once would wait for each other's threads (see `jaxgear.numerics.dense`)."""
    program = jax.jit(jax.vmap(designs)).lower(jnp.linspace(1.0, 1.1, 3)).as_text()
    assert "stablehlo" in program and not re.findall(r"custom_call @(?:lapack|blas)\w+", program)


PROCESS = """
import jax, jax.numpy as jnp, numpy as np
jax.config.update("jax_enable_x64", True)
from gearboxes import over_shafts
print(jax.jit(jax.vmap(over_shafts))(jnp.linspace(1.0, 1.1, 300))[0].shape)
"""


@pytest.mark.slow
def test_a_sweep_over_two_gearboxes_ends():
    """Of three hundred designs LAPACK's calls for both gearboxes waited for each other for ever."""
    here = Path(__file__).parent
    done = subprocess.run([sys.executable, "-c", PROCESS], cwd=here, timeout=400, capture_output=True, text=True)
    assert done.stdout.strip() == "(300, 41, 41)", done.stderr
