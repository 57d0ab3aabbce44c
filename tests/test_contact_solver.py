"""The contact solver against exact solutions and against the conditions that define the solution."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from contact_problems import LinearSpring, SofteningSpring, problem, random_problem, stiffness_at, with_load

from jaxgear.numerics import solve_contact

solve = eqx.filter_jit(solve_contact)
deflection_of = jax.jit(jax.vmap(lambda law, row: law.deflection(row)))
SIZES, STEPS = (3, 4, 60), 12  # springs, slices and positions of what most tests solve: one program
LOADS = jnp.asarray([1e-3, 0.1, 1.0, 30.0, 300.0, 3000.0])


def violations(data, solution):
    """Signed distance y of every spring and the unbalanced load, written out in NumPy."""
    q, d = np.asarray(solution.line_load), np.asarray(solution.approach)
    h = np.asarray(deflection_of(data.law, solution.line_load))
    y = np.einsum("ijn,jsn->isn", data.compliance[:, :, 0], q) + h + np.asarray(data.gap)
    y -= np.asarray(data.lever) * d
    return y, np.einsum("in,s,isn->n", data.lever[:, 0], data.weight, q) - np.asarray(data.load)


def exact_uncoupled(compliance, gap, weight, load):
    """Sort-based solution of max(0, d - gap) / c summing to the load: the k smallest gaps are in contact."""
    order = np.argsort(gap)
    stiffness = (weight / compliance)[order]
    d = (load + np.cumsum(stiffness * gap[order])) / np.cumsum(stiffness)
    following = np.append(gap[order][1:], np.inf)
    return d[np.argmax(d <= following)]


def test_uncoupled_linear_springs_meet_the_sort_based_solution():
    rng = np.random.default_rng(1)
    positions, slices = 200, 9
    c = rng.uniform(0.01, 0.1, positions)
    gap = rng.choice([0.0, 5.0, 50.0], (2, 1, positions)) * rng.uniform(0, 1, (2, slices, positions))
    weight = rng.uniform(0.5, 1.5, slices)
    half = np.broadcast_to(0.5 * c, (2, 1, positions))
    diagonal = np.eye(2)[:, :, None] * (0.5 * c)
    solution = solve(problem(diagonal, LinearSpring(jnp.asarray(half)), gap, weight=weight, load=60.0), steps=14)
    for n in range(positions):
        d = exact_uncoupled(np.full(2 * slices, c[n]), gap[..., n].ravel(), np.tile(weight, 2), 60.0)
        assert solution.approach[n] == pytest.approx(d, rel=1e-13)
        np.testing.assert_allclose(
            solution.line_load[..., n], np.maximum(d - gap[..., n], 0) / c[n], atol=1e-12 * 60.0 / c[n] * 0.1
        )


def test_two_coupled_springs_meet_the_closed_form():
    """Compatibility and equilibrium of two coupled pairs; the second opens where its load would be negative."""
    rng = np.random.default_rng(2)
    n, load = 500, 300.0
    a1, a2 = rng.uniform(0.02, 0.08, (2, n))
    a12 = rng.uniform(-0.2, 0.8, n) * np.minimum(a1, a2)
    e1, e2 = rng.uniform(0.0, 15.0, (2, n))
    split = rng.uniform(0.2, 0.8, (2, 1, n))  # how much of the self compliance is in the contact law
    both = np.stack([np.stack([a1 * (1 - split[0, 0]), a12]), np.stack([a12, a2 * (1 - split[1, 0])])])
    law = LinearSpring(jnp.asarray(np.stack([a1, a2])[:, None] * split))
    solution = solve(problem(both, law, np.stack([e1, e2])[:, None], load=load), steps=8)

    below = a1 + a2 - 2 * a12
    f2 = ((a1 - a12) * load + e1 - e2) / below
    d = (load * (a1 * a2 - a12**2) + (a1 - a12) * e2 + (a2 - a12) * e1) / below
    f2, d = np.where(f2 < 0, 0.0, f2), np.where(f2 < 0, e1 + a1 * load, d)
    f2, d = np.where(f2 > load, load, f2), np.where(f2 > load, e2 + a2 * load, d)
    assert 0.05 < np.mean((f2 > 0) & (f2 < load)) < 0.99, "both kinds of problem must occur"
    np.testing.assert_allclose(solution.approach, d, rtol=1e-12)
    np.testing.assert_allclose(solution.line_load[1, 0], f2, atol=1e-12 * load)


@pytest.mark.parametrize(
    ("springs", "slices", "steps", "law"),
    [
        (2, 1, 8, "power"),
        (3, 7, 12, "softening"),
        *(pytest.param(*sizes, marks=pytest.mark.slow) for sizes in ((6, 1, 10, "softening"), (3, 33, 14, "power"))),
    ],
)
def test_random_coupled_problems_satisfy_all_conditions(springs, slices, steps, law):
    data = random_problem(7 * springs + slices, springs, slices, 400, law)
    loads = LOADS * jnp.sum(data.weight)
    solutions = eqx.filter_jit(
        lambda data: jax.vmap(lambda load: solve_contact(with_load(data, load), steps=steps, tolerance=1e-14))(loads)
    )(data)
    assert float(jnp.max(solutions.residual)) < 2e-14
    for k, load in enumerate(loads):
        y, unbalance = violations(with_load(data, load), jax.tree.map(lambda leaf, k=k: leaf[k], solutions))
        q = np.asarray(solutions.line_load[k])
        # rounding of the widest gap (1000 um), which `violations` does not take out, and of the loads themselves
        tolerance = 1e-15 * 1000 + 1e-14 * np.max(solutions.approach[k])
        assert q.min() >= 0
        assert y.min() > -tolerance
        assert np.abs(np.where(q > 0, y, 0.0)).max() < tolerance
        np.testing.assert_allclose(unbalance / load, 0.0, atol=1e-13)


def test_load_follows_the_least_energy():
    """The solution minimizes 1/2 q C q + H(q) + gap q among all loads of the same sum: perturbations cost energy."""
    data = with_load(random_problem(3, *SIZES, levers=False), jnp.asarray(100.0))
    found = np.asarray(solve(data, steps=STEPS).line_load)
    nodes, parts = np.polynomial.legendre.leggauss(20)
    weight = np.asarray(data.weight)[:, None]

    def energy(q):
        # int h dq along t q
        work = sum(0.5 * w * q * np.asarray(deflection_of(data.law, 0.5 * (x + 1) * q)) for x, w in zip(nodes, parts))
        elastic = 0.5 * q * np.einsum("ijn,jsn->isn", data.compliance[:, :, 0], q)
        return np.sum(weight * (elastic + work + np.asarray(data.gap) * q), axis=(0, 1))

    least = energy(found)
    rng = np.random.default_rng(0)
    for size in (1e-2, 1.0):
        for _ in range(20):
            q = np.maximum(found + size * rng.normal(size=found.shape), 0.0)
            q = q * float(data.load) / np.sum(weight * q, axis=(0, 1), keepdims=True)
            assert np.all(energy(q) > least)


def test_zero_load_touches_at_the_smallest_gap():
    data = with_load(random_problem(5, *SIZES), jnp.asarray(0.0))
    solution = solve(data, steps=STEPS)
    np.testing.assert_allclose(solution.line_load, 0.0, atol=1e-12)
    np.testing.assert_allclose(solution.approach, (data.gap / data.lever).min(axis=(0, 1)), atol=1e-12)
    assert bool(jnp.all(solution.residual < 1e-13))


def test_vanishing_loads_are_solved_whatever_the_gaps():
    """Gaps without a common part, as of a crowned face: there is nothing large to measure a load of 1e-60 against."""
    for seed in range(14, 20):
        data = random_problem(seed, *SIZES)
        touching = np.random.default_rng(seed).integers(0, 4, 60)
        gap = np.where(np.arange(4)[:, None] == touching, 0.0, np.asarray(data.gap) + 0.1)
        gap[1:] += 5.0
        data = eqx.tree_at(lambda p: p.gap, data, jnp.asarray(gap))
        for load in (0.0, 1e-300, 1e-60, 1e-30, 1e-15, 1e-9, 1e-6):
            solution = solve(with_load(data, jnp.asarray(load)), steps=STEPS)
            assert bool(jnp.all(solution.converged))
            np.testing.assert_allclose(solution.approach, 0.0, atol=1e-6)


def test_all_but_one_spring_far_apart():
    data = random_problem(6, *SIZES, levers=False)
    gap = np.full(data.gap.shape, 1e4)
    gap[2] = 3.0
    data = with_load(eqx.tree_at(lambda p: p.gap, data, jnp.asarray(gap)), jnp.asarray(250.0))
    solution = solve(data, steps=STEPS)
    q = 250.0 / float(data.weight.sum())
    own = np.asarray(deflection_of(data.law, np.full(data.gap.shape, q)))[2, 0]
    np.testing.assert_allclose(solution.approach, 3.0 + np.asarray(data.compliance)[2, 2, 0] * q + own, rtol=1e-13)
    np.testing.assert_allclose(solution.line_load[2], q, rtol=1e-12)
    assert np.abs(solution.line_load[:2]).max() == 0.0


def test_kissing_spring_carries_nothing():
    """The second gap equals the approach of the first spring alone: it just touches."""
    c, load = 0.05, 200.0
    alone = c * load
    data = problem(np.diag([c, c])[:, :, None], LinearSpring(jnp.zeros((2, 1, 1))), [[[0.0]], [[alone]]], load=load)
    solution = solve(data, steps=8)
    np.testing.assert_allclose(solution.approach, alone, rtol=1e-15)
    np.testing.assert_allclose(solution.line_load[:, 0, 0], [load, 0.0], atol=1e-12)


def test_equal_springs_share_equally():
    law = SofteningSpring(jnp.full((3, 1, 1), 0.03), jnp.full((3, 1, 1), 0.002))
    coupling = (0.02 * np.eye(3) + 0.01)[:, :, None]
    solution = solve(problem(coupling, law, np.full((3, 5, 1), 4.0), weight=np.ones(5), load=150.0), steps=8)
    np.testing.assert_allclose(solution.line_load, 10.0, rtol=1e-14)


def test_a_common_gap_shifts_the_approach_and_nothing_else():
    """Light load, wide gaps: no digits are lost to the size of the gaps."""
    data = with_load(random_problem(8, *SIZES, levers=False), jnp.asarray(1e-2))
    wide = eqx.tree_at(lambda p: p.gap, data, data.gap + 512.0)
    narrow, shifted = solve(data, steps=STEPS), solve(wide, steps=STEPS)
    assert float(jnp.max(shifted.residual)) < 1e-14
    np.testing.assert_allclose(shifted.approach - 512.0, narrow.approach, atol=3e-13)


def test_levers_scale_what_a_spring_closes_and_what_it_carries():
    """One spring with lever l: load F gives l q = F and l d = gap + c q, the virtual work of a linkage."""
    lever, c, gap, load = 0.7, 0.05, 2.0, 100.0
    data = problem([[[0.5 * c]]], LinearSpring(jnp.full((1, 1, 1), 0.5 * c)), [[[gap]]], lever=[[lever]], load=load)
    solution = solve(data, steps=4)
    assert float(solution.line_load[0, 0, 0]) == pytest.approx(load / lever, rel=1e-14)
    assert float(solution.approach[0]) == pytest.approx((gap + c * load / lever) / lever, rel=1e-14)


def test_tangent_stiffness_is_the_slope_of_load_over_approach():
    data = random_problem(11, *SIZES)
    load, step = 200.0, 1e-3
    at = {k: solve(with_load(data, jnp.asarray(load + k * step)), steps=STEPS) for k in (-1, 0, 1)}
    slope = 2 * step / (at[1].approach - at[-1].approach)
    np.testing.assert_allclose(stiffness_at(with_load(data, jnp.asarray(load)), at[0]), slope, rtol=1e-6)


@pytest.mark.parametrize("field", ["compliance", "gap", "load"])
def test_nan_never_counts_as_solved(field):
    data = with_load(random_problem(12, *SIZES), jnp.asarray(50.0))
    broken = eqx.tree_at(lambda p: getattr(p, field), data, getattr(data, field) * jnp.nan)
    solution = solve(broken, steps=STEPS)
    assert not bool(jnp.any(solution.residual <= 1.0))
