"""Contact at a prescribed approach: the same solution as under the load it carries, and zero out of contact."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from contact_problems import at_approach, random_problem, stiffness_at, with_load

from jaxgear.numerics import ContactProblem, solve_contact, tangent_stiffness

SPRINGS, SLICES, POSITIONS = 3, 4, 60
DATA = random_problem(31, SPRINGS, SLICES, POSITIONS)
solve = eqx.filter_jit(lambda data: solve_contact(data, steps=12))


@pytest.fixture(scope="module")
def loaded():
    """The problem under one load at every position."""
    return solve(with_load(DATA, jnp.asarray(400.0)))


@pytest.fixture(scope="module")
def pressed(loaded):
    """The same at the approach that this load makes."""
    return solve(at_approach(DATA, loaded.approach))


@pytest.mark.slow
def test_the_approach_under_a_load_brings_the_load_back(loaded, pressed):
    assert bool(jnp.all(loaded.converged)) and bool(jnp.all(pressed.converged))
    np.testing.assert_allclose(pressed.load, 400.0, rtol=1e-9)
    np.testing.assert_allclose(pressed.line_load, loaded.line_load, rtol=1e-9, atol=1e-9 * 400)
    np.testing.assert_allclose(pressed.opening, loaded.opening, rtol=1e-9, atol=1e-10)
    np.testing.assert_array_equal(pressed.in_contact, loaded.in_contact)


@pytest.mark.slow
def test_slope_of_the_load_is_the_tangent_stiffness_and_the_curvature_that_of_differences(pressed, loaded):
    def load(shift):
        return solve_contact(at_approach(DATA, loaded.approach + shift), steps=12).load

    def stiffness(shift):
        data = at_approach(DATA, loaded.approach + shift)
        return tangent_stiffness(data, solve_contact(data, steps=12))

    def backward(shift):
        slope = jax.vjp(load, shift)[1]
        return jax.vmap(slope)(jnp.eye(POSITIONS))[0]

    @jax.jit
    def all_of(shift):
        """Slope in both modes, curvature and stiffness."""
        slope, curvature = jax.jvp(backward, (shift,), (jnp.ones(()),))
        return slope, jax.jacfwd(load)(shift), curvature, stiffness(shift)

    zero, h = jnp.asarray(0.0), 1e-4
    slope, forward, curvature, tangent = all_of(zero)
    np.testing.assert_allclose(forward, tangent, rtol=1e-11)
    np.testing.assert_allclose(slope, forward, rtol=1e-11)
    difference = (all_of(zero + h)[0] - all_of(zero - h)[0]) / (2 * h)
    np.testing.assert_allclose(curvature, difference, rtol=1e-5, atol=1e-5)


@pytest.mark.slow
def test_derivatives_by_the_gaps_follow_from_those_under_load(loaded):
    """At fixed load dd/dg; at fixed approach dF/dg = -k dd/dg, for every gap."""

    def approach(gap):
        return jnp.sum(
            solve_contact(eqx.tree_at(lambda p: p.gap, with_load(DATA, jnp.asarray(400.0)), gap), steps=12).approach
        )

    def load(gap):
        data = eqx.tree_at(lambda p: p.gap, at_approach(DATA, loaded.approach), gap)
        return jnp.sum(solve_contact(data, steps=12).load)

    stiffness = stiffness_at(with_load(DATA, jnp.asarray(400.0)), loaded)
    expected = -stiffness[None, None] * jax.jit(jax.grad(approach))(DATA.gap)
    assert float(jnp.abs(expected).max()) > 1.0
    np.testing.assert_allclose(jax.jit(jax.grad(load))(DATA.gap), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_without_contact_loads_and_derivatives_are_exactly_zero():
    """From far apart to almost touching."""
    touching = jnp.min(DATA.gap / DATA.lever, axis=(0, 1))
    shift = jnp.linspace(-50.0, -1e-9, POSITIONS)

    def load(approach):
        return solve_contact(at_approach(DATA, approach), steps=12).load

    value, slope = jax.jit(lambda d: jax.jvp(load, (d,), (jnp.ones_like(d),)))(touching + shift)
    assert not np.any(value) and not np.any(slope)
    apart = solve(at_approach(DATA, touching + shift))
    assert bool(jnp.all(apart.converged)) and not np.any(apart.line_load) and not np.any(apart.in_contact)
    assert bool(jnp.all(apart.opening > 0))


@pytest.mark.parametrize("law", ["softening", "power"])
def test_random_approaches_satisfy_all_conditions(law):
    """Approaches from a touch to 100 um: no load is negative, nothing penetrates, what carries touches."""
    data = random_problem(32, SPRINGS, SLICES, POSITIONS, law)
    touching = jnp.min(data.gap / data.lever, axis=(0, 1))
    approach = touching + 10 ** jnp.asarray(np.random.default_rng(1).uniform(-6.0, 2.0, POSITIONS))
    solution = solve(at_approach(data, approach))
    assert bool(jnp.all(solution.converged))
    q = np.asarray(solution.line_load)
    deflection = np.asarray(jax.vmap(lambda law, row: law.deflection(row))(data.law, solution.line_load))
    distance = np.einsum("ijn,jsn->isn", data.compliance[:, :, 0], q) + deflection + np.asarray(data.gap)
    distance -= np.asarray(data.lever) * np.asarray(approach)
    tolerance = 1e-10 * np.asarray(approach)[None, None]
    assert q.min() >= 0 and np.all(q.sum(axis=(0, 1)) > 0)
    assert np.all(distance > -tolerance)
    assert np.all(np.where(q > 0, np.abs(distance), 0.0) < tolerance)


def test_nan_is_not_solved_and_one_condition_is_given():
    solution = solve(at_approach(DATA, jnp.full(POSITIONS, jnp.nan)))
    assert not bool(jnp.any(solution.converged))
    springs = DATA.compliance, DATA.law, DATA.gap, DATA.lever, DATA.weight
    for given in ({}, {"load": DATA.load, "approach": jnp.zeros(POSITIONS)}):
        with pytest.raises(ValueError, match="one of load and approach"):
            ContactProblem(*springs, **given)
