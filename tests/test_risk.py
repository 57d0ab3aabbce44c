"""Measures of many values: against NumPy and SciPy, closed forms of distributions, invariances, limits, gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import mstats

import jaxgear as jg

MEASURES = [jg.Mean(), jg.Worst(), jg.CVaR(0.8), jg.Quantile(0.8)]
NAMES = ["mean", "worst", "cvar", "quantile"]
every_measure = pytest.mark.parametrize("measure", MEASURES, ids=NAMES)


def sample(count=23, seed=1):
    return np.random.default_rng(seed).gamma(2.0, size=count)


@jax.jit
def _of(measure, values, weights):
    """One program for each kind of measure and each number of values, for all levels."""
    return measure(values, weights)


def of(measure, values, weights=None):
    return float(_of(measure, values, np.ones_like(values) if weights is None else weights))


def tail_mean(values, weights, level):
    """Mean of the worst 1 - level of all weight, counted down from the largest value."""
    left, total = 1 - level, 0.0
    for index in np.argsort(values)[::-1]:
        taken = min(weights[index] / np.sum(weights), left)
        total, left = total + taken * values[index], left - taken
    return total / (1 - level)


def test_mean_and_worst_of_plain_and_weighted_values():
    values, weights = sample(), sample(seed=2)
    assert of(jg.Mean(), values) == pytest.approx(values.mean(), rel=1e-14)
    assert of(jg.Mean(), values, weights) == pytest.approx(np.average(values, weights=weights), rel=1e-14)
    assert of(jg.Worst(), values, weights) == values.max()


@pytest.mark.parametrize("level", [0.0, 0.3, 0.5, 0.87, 0.99])
def test_conditional_value_at_risk_is_the_mean_of_the_tail(level):
    values, weights = sample(), sample(seed=2)
    assert of(jg.CVaR(level), values) == pytest.approx(tail_mean(values, np.ones(23), level), rel=1e-12)
    assert of(jg.CVaR(level), values, weights) == pytest.approx(tail_mean(values, weights, level), rel=1e-12)


def test_conditional_value_at_risk_by_its_variational_form():
    """Rockafellar and Uryasev: the least over t of t + E[max(v - t, 0)] / (1 - level), which is met at a value."""
    values, weights, level = sample(), sample(seed=2), 0.7
    shares = weights / weights.sum()
    least = min(t + shares @ np.maximum(values - t, 0) / (1 - level) for t in values)
    assert of(jg.CVaR(level), values, weights) == pytest.approx(least, rel=1e-12)


@pytest.mark.parametrize("level", [0.05, 0.5, 0.9, 0.95])
def test_quantile_is_that_of_harrell_and_davis(level):
    values = sample()
    assert of(jg.Quantile(level), values) == pytest.approx(float(mstats.hdquantiles(values, [level])[0]), rel=1e-10)


def test_uniform_distribution():
    """Evenly spaced values on [0, 1]: mean 1/2, tail mean (1 + level) / 2, quantile level."""
    values = (np.arange(2000) + 0.5) / 2000
    assert of(jg.Mean(), values) == pytest.approx(0.5, abs=1e-12)
    for level in (0.25, 0.9):
        # the level stands on an edge between two values: exact
        assert of(jg.CVaR(level), values) == pytest.approx((1 + level) / 2, abs=1e-12)
        # the expectation of beta((n + 1) level, (n + 1) (1 - level)) is the level
        assert of(jg.Quantile(level), values) == pytest.approx(level, abs=1e-6)


def test_a_weight_counts_as_so_many_equal_values():
    values, times = sample(9), np.array([3, 1, 2, 5, 1, 1, 4, 2, 1])
    for measure in (jg.Mean(), jg.Worst(), jg.CVaR(0.7)):
        repeated = of(measure, np.repeat(values, times))
        assert of(measure, values, times.astype(float)) == pytest.approx(repeated, rel=1e-12)


@every_measure
def test_order_and_scale_of_the_weights_do_not_matter(measure):
    values, weights = sample(), sample(seed=2)
    expected = of(measure, values, weights)
    order = np.random.default_rng(3).permutation(23)
    assert of(measure, values[order], weights[order]) == pytest.approx(expected, rel=1e-12)
    assert of(measure, values, 7.5 * weights) == pytest.approx(expected, rel=1e-12)


@every_measure
def test_no_share_is_lost_to_rounding(measure):
    """Compiled, with weights whose sum is not exact."""
    weights = np.random.default_rng(4).gamma(2.0, size=(300, 3))
    shares = jax.jit(jax.vmap(measure.shares, (None, 0)))(jnp.asarray([2.0, 3.0, 1.0]), jnp.asarray(weights))
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, rtol=1e-12)
    assert np.all(shares[:, 1] > 0)


@every_measure
def test_moves_and_stretches_with_the_values(measure):
    """m(a v + b) = a m(v) + b for a > 0: it is in the unit of the values and between their extremes."""
    values, weights = sample(), sample(seed=2)
    expected = of(measure, values, weights)
    assert of(measure, 3.0 * values - 2.0, weights) == pytest.approx(3.0 * expected - 2.0, rel=1e-12)
    assert of(measure, np.full(23, 4.0), weights) == pytest.approx(4.0, rel=1e-12)
    assert values.min() < expected <= values.max()


def test_limits_of_the_level():
    values, weights = sample(), sample(seed=2)
    assert of(jg.CVaR(0.0), values, weights) == pytest.approx(of(jg.Mean(), values, weights), rel=1e-14)
    # less than the weight of any value is left
    assert of(jg.CVaR(0.9999), values, weights) == pytest.approx(values.max(), rel=1e-12)
    assert of(jg.Quantile(1 - 1e-6), values) == pytest.approx(values.max(), rel=1e-4)
    rising = [of(jg.CVaR(level), values, weights) for level in (0.0, 0.2, 0.4, 0.6, 0.8)]
    assert np.all(np.diff(rising) > 0)


@every_measure
def test_gradient_is_the_shares_of_the_values(measure):
    """Against central differences; a rise of all values alike is the rise of the result."""
    values, weights = sample(), sample(seed=2)
    gradient = np.asarray(jax.grad(measure)(jnp.asarray(values), jnp.asarray(weights)))
    assert gradient.sum() == pytest.approx(1.0, rel=1e-12)
    assert np.all(gradient >= 0)
    step = 1e-6 * np.eye(23)
    differences = [(of(measure, values + s, weights) - of(measure, values - s, weights)) / 2e-6 for s in step]
    np.testing.assert_allclose(gradient, differences, atol=1e-8)
    np.testing.assert_allclose(gradient, measure.shares(jnp.asarray(values), jnp.asarray(weights)), atol=1e-14)


@every_measure
def test_a_failed_value_is_not_forgotten(measure):
    """An infinite value is the worst one; it makes every measure infinite that looks at the tail."""
    values = sample()
    values[4] = np.inf
    assert of(measure, values) == np.inf


def test_a_value_without_share_may_be_infinite():
    values, weights = sample(), np.ones(23)
    values[4], weights[4] = np.inf, 0.0
    rest = np.delete(values, 4)
    for measure in (jg.Mean(), jg.Worst(), jg.CVaR(0.8)):
        assert of(measure, values, weights) == pytest.approx(of(measure, rest), rel=1e-12)
    values[4] = -np.inf  # the best value is far below the tail
    weights[4] = 1.0
    assert np.isfinite(of(jg.CVaR(0.8), values, weights))
    assert of(jg.Mean(), values, weights) == -np.inf


@pytest.mark.parametrize("make", [jg.CVaR, jg.Quantile])
@pytest.mark.parametrize("level", [-0.1, 1.0, 1.5, float("nan")])
def test_refuses_levels_without_meaning(make, level):
    with pytest.raises(ValueError, match=f"{make.__name__}: level"):
        make(level)


def test_a_quantile_at_level_zero_has_no_beta_distribution():
    with pytest.raises(ValueError, match="Quantile: level"):
        jg.Quantile(0.0)
    assert of(jg.CVaR(0.0), sample()) > 0
