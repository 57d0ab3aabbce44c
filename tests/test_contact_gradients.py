"""Derivatives of the contact solver: implicit function theorem against central differences, in every mode of JAX."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from contact_problems import LinearSpring, SofteningSpring, problem, random_problem, with_load

from jaxgear.numerics import solve_contact, tangent_stiffness

SPRINGS, SLICES, POSITIONS, STEPS = 3, 2, 3, 12


def base_problem():
    """Three coupled springs in two slices; one slice of one spring stays open by a wide margin."""
    data = random_problem(21, SPRINGS, SLICES, POSITIONS)
    gap = jnp.asarray(np.random.default_rng(4).uniform(0.0, 3.0, data.gap.shape)).at[2, 1].set(80.0)
    return with_load(eqx.tree_at(lambda p: p.gap, data, gap), jnp.asarray(400.0))


DATA = base_problem()
# every leaf that a design can move; the compliance moves in both of its symmetric halves
LEAVES = (
    ("load", lambda p: p.load),
    ("gap", lambda p: p.gap),
    ("lever", lambda p: p.lever),
    ("weight", lambda p: p.weight),
    ("law", lambda p: p.law.a),
    ("compliance", lambda p: p.compliance),
)


def direction(k, leaf):
    """Fixed direction, of the size of the leaf, in which the k-th component of x moves it."""
    d = np.random.default_rng(k).uniform(0.2, 1.0, leaf.shape) * np.mean(np.abs(leaf))
    return jnp.asarray(d + d.swapaxes(0, 1) if leaf.ndim == 4 else d)


def value(x):
    """A number that depends on every part of the solution, while x[k] moves the k-th leaf."""
    data = DATA
    for k, (_, select) in enumerate(LEAVES):
        data = eqx.tree_at(select, data, select(data) + x[k] * direction(k, select(DATA)))
    solution = solve_contact(data, steps=STEPS)
    rng = np.random.default_rng(5)
    weights = jnp.asarray(rng.normal(size=solution.line_load.shape))
    return jnp.sum(jnp.asarray(rng.normal(size=POSITIONS)) * solution.approach) + jnp.sum(
        weights * (0.01 * solution.line_load + solution.opening)
    )


def derivatives(model, x):
    """Value, gradient in two modes, and Hessian."""

    def backward(at):
        number, slope = jax.value_and_grad(model)(at)
        return slope, (number, slope)

    hessian, (number, slope) = jax.jacfwd(backward, has_aux=True)(x)
    return number, slope, jax.jacfwd(model)(x), hessian


X = 0.01 * jnp.asarray([1.0, -2.0, 1.5, 0.5, -1.0, 0.7])


def test_all_modes_agree_with_central_differences():
    """Batched over two points and those around them."""
    h, count = 1e-6, len(LEAVES)
    offsets = h * jnp.concatenate([jnp.zeros((1, count)), jnp.eye(count), -jnp.eye(count)])
    points = jnp.stack([X, -0.6 * X])[:, None] + offsets[None]
    batch = jax.jit(jax.vmap(lambda x: derivatives(value, x)))(points.reshape(-1, count))
    values, slopes, forward, hessian = (np.asarray(each).reshape(2, 2 * count + 1, *each.shape[1:]) for each in batch)

    difference = (values[:, 1 : count + 1] - values[:, count + 1 :]) / (2 * h)
    assert np.abs(difference).min() > 1e-2, "every leaf must matter"
    np.testing.assert_allclose(slopes[:, 0], difference, rtol=1e-6)
    np.testing.assert_allclose(forward, slopes, rtol=1e-11)

    curvature, hessian = (slopes[:, 1 : count + 1] - slopes[:, count + 1 :]) / (2 * h), hessian[:, 0]
    scale = np.abs(curvature).max()
    np.testing.assert_allclose(hessian, curvature, rtol=1e-5, atol=1e-7 * scale)
    np.testing.assert_allclose(hessian, hessian.swapaxes(1, 2), rtol=1e-8, atol=1e-11 * scale)


@pytest.mark.slow
def test_jacobians_of_approach_and_loads():
    """dd/dF = 1/k_t; reciprocity: d(approach)/d(gap_i) = w_i dq_i/dF; gaps do not change the sum of the loads."""

    def solution(load, gap):
        solved = solve_contact(eqx.tree_at(lambda p: (p.load, p.gap), DATA, (load, gap)), steps=STEPS)
        return solved.approach, solved.line_load

    @jax.jit
    def jacobians(load, gap):
        stiffness = tangent_stiffness(DATA, solve_contact(DATA, steps=STEPS))
        return jax.jacfwd(solution, (0, 1))(load, gap), jax.jacrev(lambda g: solution(load, g)[0])(gap), stiffness

    forward, approach_by_gap, stiffness = jacobians(DATA.load, DATA.gap)
    (approach_by_load, approach_by_gap_forward), (load_by_load, load_by_gap) = forward
    np.testing.assert_allclose(approach_by_gap_forward, approach_by_gap, rtol=1e-10, atol=1e-15)
    np.testing.assert_allclose(approach_by_load, 1 / stiffness, rtol=1e-12)
    own = jnp.stack([approach_by_gap[n, ..., n] for n in range(POSITIONS)], axis=-1)
    np.testing.assert_allclose(own, DATA.weight[None, :, None] * load_by_load, rtol=1e-10, atol=1e-15)
    total = jnp.einsum("in,s,isn...->n...", DATA.lever[:, 0], DATA.weight, load_by_gap)
    assert float(jnp.abs(load_by_gap).max()) > 1.0
    np.testing.assert_allclose(total, 0.0, atol=1e-11)


def two_springs(x):
    """Approach and loads of two springs, x = (load, first gap, second gap)."""
    law = SofteningSpring(jnp.full((2, 1, 1), 0.03), jnp.full((2, 1, 1), 0.002))
    coupling = jnp.asarray([[0.03, 0.01], [0.01, 0.03]])[:, :, None]
    solution = solve_contact(problem(coupling, law, x[1:, None, None], load=x[0]), steps=8)
    return solution.approach[0] + 0.01 * solution.line_load[0, 0, 0]


def linear_pair(x):
    """As `two_springs` with linear, uncoupled springs of 0.05 um/N."""
    law = LinearSpring(jnp.full((2, 1, 1), 0.05))
    solution = solve_contact(problem(jnp.zeros((2, 2, 1)), law, x[1:, None, None], load=x[0]), steps=8)
    return solution.approach[0] + 0.01 * solution.line_load[0, 0, 0]


@partial(jax.jit, static_argnums=0)
def at_a_corner(model, x, batch):
    """Derivatives at a point, and those of a batch."""
    return derivatives(model, x), jax.vmap(lambda at: derivatives(model, at))(batch)


def around(x):
    return jnp.stack([x, x + 1e-3])


AT_CORNERS = pytest.mark.parametrize(
    ("model", "x"),
    [
        pytest.param(two_springs, (0.0, 0.0, 0.0), id="no load, no gap"),
        pytest.param(two_springs, (0.0, 1.0, 3.0), id="no load"),
        pytest.param(two_springs, (100.0, 0.0, 0.0), id="equal gaps"),
        pytest.param(two_springs, (100.0, 0.0, 1e4), id="full separation"),
        pytest.param(two_springs, (1e-12, 0.0, 0.0), id="vanishing load"),
        pytest.param(linear_pair, (100.0, 0.0, 5.0), id="kissing", marks=pytest.mark.slow),
        pytest.param(linear_pair, (0.0, 2.0, 2.0), id="no load, both touching", marks=pytest.mark.slow),
    ],
)


@AT_CORNERS
def test_derivatives_stay_finite_where_contact_changes(model, x):
    x = jnp.asarray(x)
    alone, batch = at_a_corner(model, x, around(x))
    assert all(np.isfinite(result).all() for result in (*alone, *batch))
    np.testing.assert_allclose(alone[1], alone[2], rtol=1e-12, atol=1e-14)
    for found, expected in zip(batch, alone):
        np.testing.assert_allclose(found[0], expected, rtol=1e-11, atol=1e-14)


@partial(jax.jit, static_argnums=0)
def both_modes(model, x):
    return *jax.value_and_grad(model)(x), jax.jacfwd(model)(x)


@pytest.mark.slow
@AT_CORNERS
def test_so_they_do_in_single_precision(model, x):
    """As in double precision: a solution of a few equations loses some units of the last place, 6e-8 of the largest."""
    double = both_modes(model, jnp.asarray(x))
    with jax.enable_x64(False):
        single = both_modes(model, jnp.asarray(x))
    assert all(result.dtype == "float32" for result in single)
    for found, expected in zip(single, double):
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


def test_derivative_at_a_kissing_spring_is_one_of_its_two_sides():
    """Just before contact the second spring's gap does not matter; just after, both springs bear the approach."""
    points = (jnp.asarray([100.0, 0.0, gap]) for gap in (5.0 + 1e-6, 5.0, 5.0 - 1e-6))
    before, at, after = (at_a_corner(linear_pair, x, around(x))[0][1] for x in points)
    np.testing.assert_allclose(before, [0.05 + 0.01, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(after, [0.025 + 0.005, 0.5 - 0.1, 0.5 + 0.1], atol=1e-12)
    assert any(np.allclose(at, side, atol=1e-9) for side in (before, after))
