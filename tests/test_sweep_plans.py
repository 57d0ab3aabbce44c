"""Plans: which variants, in which order, and that any range of them costs no more than itself."""

import itertools
import tracemalloc

import numpy as np
import pytest
from scipy.stats import qmc

import jaxgear as jg

BOUNDS = {"amount": (0.0, 20.0), "length": (1.0, 5.5), "slope": (-3.0, 3.0)}
PLANS = {
    "factorial": lambda: jg.FullFactorial(BOUNDS, {"amount": 5, "length": [1.0, 2.5, 2.0], "slope": 7}),
    "hypercube": lambda: jg.LatinHypercube(BOUNDS, 105, seed=3),
    "sobol": lambda: jg.Sobol(BOUNDS, 105, seed=3),
    "list": lambda: jg.VariantList(list(BOUNDS), np.random.default_rng(0).random((105, 3))),
}


def unit(plan, rows):
    """Rows in the unit box."""
    low, high = np.asarray(plan.low), np.asarray(plan.high)
    return (rows - low) / (high - low)


@pytest.mark.parametrize("make", PLANS.values(), ids=PLANS)
def test_any_cut_gives_the_same_rows(make):
    whole = make().rows(0, 105)
    assert whole.shape == (105, 3) and whole.dtype == np.float64
    plan = make()
    cuts = [0, 1, 2, 9, 9, 50, 104, 105]
    np.testing.assert_array_equal(np.concatenate([plan.rows(a, b) for a, b in itertools.pairwise(cuts)]), whole)
    for start in (77, 3, 40):  # backwards, too
        np.testing.assert_array_equal(plan.rows(start, start + 20), whole[start : start + 20])
    with pytest.raises(IndexError, match="are not within the 105 variants"):
        plan.rows(100, 106)


def test_factorial_is_every_combination_with_the_last_fastest():
    plan = PLANS["factorial"]()
    expected = list(itertools.product(np.linspace(0, 20, 5), [1.0, 2.5, 2.0], np.linspace(-3, 3, 7)))
    np.testing.assert_array_equal(plan.rows(0, plan.size), expected)
    assert jg.FullFactorial(BOUNDS, 4).size == 64


@pytest.mark.parametrize("samples", [1, 2, 3, 5, 16, 97, 1000, 10_007])
def test_hypercube_hits_every_stratum_once(samples):
    plan = jg.LatinHypercube(BOUNDS, samples, seed=samples)
    strata = np.floor(unit(plan, plan.rows(0, samples)) * samples).astype(int)
    np.testing.assert_array_equal(np.sort(strata, axis=0), np.arange(samples)[:, None].repeat(3, axis=1))


def test_hypercube_is_random():
    samples = 20_000
    plan, other = (jg.LatinHypercube(BOUNDS, samples, seed=seed) for seed in (0, 1))
    points = unit(plan, plan.rows(0, samples))
    following = np.concatenate([points, np.roll(points, 1, axis=0)], axis=1)
    correlation = np.corrcoef(following.T) - np.eye(6)
    assert np.abs(correlation).max() < 5 / np.sqrt(samples)
    places = points * samples % 1
    assert np.abs(places.mean(axis=0) - 0.5).max() < 5 / np.sqrt(12 * samples)
    assert not (plan.rows(0, 100) == other.rows(0, 100)).any()
    # spread in pairs of parameters: as many of 100 x 100 cells are empty as chance leaves, 1/e^2 at 2 points per cell
    cells = np.unique(np.floor(points[:, 0] * 100) * 100 + np.floor(points[:, 1] * 100))
    assert len(cells) / 1e4 == pytest.approx(1 - np.exp(-2), abs=0.02)


def test_sobol_is_the_sequence_of_scipy():
    plan = jg.Sobol(BOUNDS, 256, seed=11)
    expected = qmc.scale(qmc.Sobol(3, rng=11).random(256), plan.low, plan.high)
    np.testing.assert_allclose(plan.rows(0, 256), expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    "make",
    [
        lambda: jg.FullFactorial(BOUNDS, 464),
        lambda: jg.LatinHypercube(BOUNDS, 100_000_000, seed=0),
        lambda: jg.Sobol(BOUNDS, 100_000_000, seed=0),
    ],
    ids=["factorial", "hypercube", "sobol"],
)
def test_a_plan_of_a_hundred_million_is_small(make):
    tracemalloc.start()
    plan = make()
    rows = plan.rows(20_000_000, 20_001_000)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert np.isfinite(rows).all() and plan.size > 99_000_000
    assert peak < 4e6


def test_a_list_keeps_numbers_that_are_not_finite():
    plan = jg.VariantList(["a", "b"], [[1.0, np.nan], [np.inf, 2.0], [3.0, 4.0]])
    assert (plan.low, plan.high) == ((1.0, 2.0), (3.0, 4.0))
    assert np.isnan(plan.rows(0, 1)[0, 1])


def test_descriptions_tell_plans_apart():
    plans = [make() for make in PLANS.values()]
    plans += [jg.Sobol(BOUNDS, 105, seed=4), jg.Sobol(BOUNDS, 106, seed=3)]
    plans += [jg.VariantList(list(BOUNDS), np.zeros((105, 3)))]
    assert len({str(plan.describe()) for plan in plans}) == len(plans)
    assert PLANS["sobol"]().describe() == PLANS["sobol"]().describe()


@pytest.mark.parametrize(
    "make, problem",
    [
        (lambda: jg.Sobol({}, 8, seed=0), "bounds must name at least one parameter"),
        (lambda: jg.Sobol({"a": (1.0, 1.0)}, 8, seed=0), "upper bound of a = 1 must be greater than 1"),
        (lambda: jg.Sobol(BOUNDS, 2**30 + 1, seed=0), "samples = 1073741825 must be at most"),
        (lambda: jg.LatinHypercube(BOUNDS, 0, seed=0), "samples = 0 must be a whole number"),
        (lambda: jg.LatinHypercube(BOUNDS, 8, seed=-1), "seed = -1 must be a whole number of at least 0"),
        (lambda: jg.FullFactorial(BOUNDS, 1), "levels of amount = 1 must be a whole number of at least 2"),
        (lambda: jg.FullFactorial(BOUNDS, {"amount": 3}), "levels must be given for amount, length, slope"),
        (lambda: jg.FullFactorial({"a": (0, 1)}, {"a": [0.5, 2.0]}), "levels of a = 2 must be at least 0 and at most"),
        (lambda: jg.FullFactorial({"a": (0, 1)}, {"a": [0.5, 0.5]}), "levels of a must be a count or a list of diff"),
        (lambda: jg.FullFactorial(BOUNDS, 10**6), "number of combinations"),
        (lambda: jg.VariantList(["a", "a"], [[1, 2]]), "names a, a must be different"),
        (lambda: jg.VariantList(["a", "b"], [1, 2]), r"values of shape \(2,\) must be \(variants, 2\)"),
    ],
)
def test_wrong_plans_are_refused(make, problem):
    with pytest.raises(ValueError, match=problem):
        make()
