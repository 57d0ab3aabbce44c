"""Roots, safe functions, quadrature, the field checks and those of annotations."""

from functools import partial

import jax
import jax.numpy as jnp
import jaxtyping
import numpy as np
import pytest

from jaxgear.numerics import (
    at_root,
    bracketed_root,
    by_numbers,
    check,
    gauss_legendre,
    optional_real,
    real,
    real_roots,
    rising_root,
    safe_divide,
    safe_power,
    safe_sqrt,
)
from jaxgear.numerics.spline import interpolate


def kepler(eccentricity):
    """E - e sin E = 1"""
    one = jnp.ones_like(eccentricity)
    return bracketed_root(lambda x, e: x - e * jnp.sin(x) - 1.0, 0 * one, 3 * one, eccentricity)


def test_root_value_and_three_derivatives():
    """The cube root as the root of x^3 - a. The third derivative is as good as the bisection's bracket, 1e-7."""

    def cube_root(a):
        return bracketed_root(lambda x, a: x**3 - a, jnp.zeros_like(a), jnp.full_like(a, 4.0), a)

    a = 5.0
    f, values = cube_root, []
    for _ in range(4):
        values.append(float(jax.jit(f)(a)))
        f = jax.grad(f)
    exact = [a ** (1 / 3), a ** (-2 / 3) / 3, -2 / 9 * a ** (-5 / 3), 10 / 27 * a ** (-8 / 3)]
    np.testing.assert_allclose(values[:3], exact[:3], rtol=1e-13)
    np.testing.assert_allclose(values[3], exact[3], rtol=1e-6)


def test_root_is_elementwise_and_solves_the_equation():
    e = np.linspace(0.0, 0.95, 50)
    x = np.asarray(jax.jit(kepler)(e))
    np.testing.assert_allclose(x - e * np.sin(x), 1.0, rtol=1e-15)
    np.testing.assert_allclose(jax.jit(jax.vmap(jax.grad(kepler)))(e), np.sin(x) / (1 - e * np.cos(x)), rtol=1e-13)


def test_root_of_a_decreasing_function():
    x = bracketed_root(lambda x, a: a - x**2, jnp.asarray(0.0), jnp.asarray(3.0), jnp.asarray(2.0))
    assert float(x) == pytest.approx(2**0.5, rel=1e-15)


def test_without_a_sign_change_the_nearer_end_is_returned():
    low, high = jnp.asarray([1.0, 1.0]), jnp.asarray([2.0, 2.0])
    roots = bracketed_root(lambda x, a: x - a, low, high, jnp.asarray([0.5, 7.0]))
    np.testing.assert_array_equal(roots, [1.0, 2.0])


def test_roots_at_the_ends_of_the_bracket_keep_their_value():
    low, high = jnp.asarray([1.0, 1.0]), jnp.asarray([2.0, 2.0])
    roots = bracketed_root(lambda x, a: x - a, low, high, jnp.asarray([1.0, 2.0]))
    np.testing.assert_allclose(roots, [1.0, 2.0], rtol=1e-15)


roots_of = jax.jit(real_roots)


def test_results_at_a_root_and_two_derivatives():
    """x + x^3 = a: of x^2 there, in both modes."""

    def squared(a):
        def function(x, a):
            return x**2, x + x**3 - a

        def search(a):
            return rising_root(lambda x: function(x, a)[-1], jnp.zeros_like(a), most=30, within=1e-12)

        return at_root(function, search, a)[0]

    x = np.asarray([-0.7, 0.4, 1.3])
    a, rise = x + x**3, 1 + 3 * x**2
    slope = 2 * x / rise
    np.testing.assert_allclose(squared(a), x**2, rtol=1e-13)
    np.testing.assert_allclose(jax.vmap(jax.grad(squared))(a), slope, rtol=1e-12)
    np.testing.assert_allclose(jax.jvp(squared, (a,), (np.ones(3),))[1], slope, rtol=1e-12)
    second = (2 * rise - 2 * x * 6 * x) / rise**3
    np.testing.assert_allclose(jax.vmap(jax.grad(jax.grad(squared)))(a), second, rtol=1e-11)


def test_secants_find_a_root_behind_kinks_and_dents():
    """Where the function falls for a while, and at kinks of 1 to 100 as steep."""
    steep = np.asarray([1.0, 10.0, 100.0, 100.0])
    offset = np.asarray([0.3, -0.2, 0.4, -5.0])

    def function(x):
        return x - offset + steep * jnp.maximum(x - 0.05, 0.0) + jnp.sin(3 * x)

    root = rising_root(function, jnp.zeros(4), most=30, within=1e-9)
    np.testing.assert_allclose(function(root), 0.0, atol=1e-9)


def test_by_numbers_leaves_out_what_varies_along_other_axes():
    """A modification of the profile does not depend on the place over the face, which may have derivatives."""

    @partial(by_numbers, entrywise=(0, 1))
    def function(x, y):
        return jnp.sin(x)

    x, y = jnp.ones((2, 1, 4)), jnp.ones((1, 3, 1))
    slopes = jax.grad(lambda x, y: function(x, y).sum(), argnums=(0, 1))(x, y)
    np.testing.assert_allclose(slopes[0], np.cos(1.0))
    np.testing.assert_array_equal(slopes[1], np.zeros((1, 3, 1)))


def test_by_numbers_changes_how_derivatives_are_formed_and_not_what_they_are():
    """By a number, an array that acts entry by entry along an axis of length one, and one that does not; both modes."""

    def plain(number, entries, mixed):
        return jnp.sin(number * entries) * jnp.cumsum(mixed)[None]

    given = jnp.asarray(0.7), jnp.linspace(0.5, 1.5, 3)[:, None], jnp.linspace(1.0, 2.0, 4)
    every = (0, 1, 2)

    def differentiated(function):
        first = jax.jacfwd(function, every)
        return function(*given), first(*given), jax.jacrev(first, every)(*given)

    formed = by_numbers(plain, entrywise=(1,))
    found, expected = jax.jit(lambda: (differentiated(formed), differentiated(plain)))()
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14), found, expected)


def test_real_roots_of_a_polynomial_and_their_derivatives():
    """(x + 3) (x - 1e-6) (x - 2) (x^2 + x + 1) has three; a root moves by -dp / p'."""
    coefficients = np.polynomial.polynomial.polymul(np.poly([-3.0, 1e-6, 2.0])[::-1], [1.0, 1.0, 1.0])
    found = np.asarray(roots_of(coefficients))
    np.testing.assert_allclose(found[:3], [-3.0, 1e-6, 2.0], rtol=1e-12)
    assert np.isnan(found[3:]).all()
    slope = np.polyval(np.polyder(coefficients[::-1]), 2.0)
    moved = jax.jit(jax.grad(lambda c: real_roots(c)[2]))(coefficients)
    np.testing.assert_allclose(moved, -(2.0 ** np.arange(6)) / slope, rtol=1e-10)


def test_a_double_root_is_real_and_a_pair_beside_the_axis_is_not():
    assert np.isfinite(roots_of(np.array([1.0, -2.0, 1.0]))).all()
    assert np.isnan(roots_of(np.array([1.0 + 1e-8, -2.0, 1.0]))).all()


@pytest.mark.parametrize(
    ("function", "bad", "value", "good"),
    [
        (safe_sqrt, 0.0, 0.0, 4.0),
        (safe_sqrt, -1.0, 0.0, 4.0),
        (lambda x: safe_divide(3.0, x), 0.0, 0.0, 2.0),
        (lambda x: safe_power(x, 0.5), 0.0, 0.0, 4.0),
        (lambda x: safe_power(2.0 * x, 1.5), -1.0, 0.0, 4.0),
    ],
)
def test_safe_functions_have_finite_derivatives_where_the_plain_ones_have_not(function, bad, value, good):
    slope = jax.grad(function)
    derived = jax.jit(lambda x: (function(x), slope(x), jax.grad(slope)(x)))
    assert [float(part) for part in derived(bad)] == [value, 0.0, 0.0]
    h = 1e-6
    difference = (derived(good + h)[0] - derived(good - h)[0]) / (2 * h)
    assert float(derived(good)[1]) == pytest.approx(float(difference), rel=1e-8)


def test_gauss_legendre_is_exact_for_polynomials_of_degree_2n_minus_1():
    nodes, weights = gauss_legendre(6)
    for degree in range(12):
        assert np.sum(weights * nodes**degree) == pytest.approx(1 / (degree + 1), rel=1e-13)
    assert np.sum(weights * nodes**12) != pytest.approx(1 / 13, rel=1e-9)


def test_real_makes_differentiable_arrays():
    assert real(2).dtype == jnp.float64
    assert real(np.float32(2)).dtype == jnp.float32
    assert optional_real(None) is None
    assert float(jax.grad(lambda x: real(x) ** 2)(3.0)) == 6.0


def test_check_names_parameter_value_unit_and_range():
    with pytest.raises(ValueError, match=r"^module = -1 mm must be greater than 0 mm") as error:
        check("module", -1.0, "mm", low=0.0, open_low=True)
    assert "\n" not in str(error.value)
    with pytest.raises(ValueError, match=r"x = 7 must be at least 1 and at most 5"):
        check("x", jnp.asarray([2.0, 7.0]), "", low=1.0, high=5.0)
    with pytest.raises(ValueError, match="nan"):
        check("x", jnp.nan, "um")
    with pytest.raises(ValueError, match="inf"):
        check("x", jnp.inf, "um", low=0.0)


def test_check_lets_good_values_none_and_tracers_pass():
    check("x", 0.0, "", low=0.0, high=1.0)
    check("x", None, "", low=0.0)
    jax.jit(lambda x: check("x", x, "", low=0.0))(-1.0)


def test_annotations_of_arrays_are_checked_while_the_tests_run():
    """Shape, dtype and agreement of several arrays; mypy sees none of them."""
    x, positions, values = jnp.asarray([0.5]), jnp.asarray([0.0, 1.0, 2.0]), jnp.asarray([0.0, 1.0, 4.0])
    assert float(jax.jit(interpolate, static_argnums=3)(x, positions, values, "linear")[0]) == 0.5
    for wrong in ((x, positions, values[:2]), (x, positions[None], values), (x.astype(int), positions, values)):
        with pytest.raises(jaxtyping.TypeCheckError):
            interpolate(*wrong, "linear")
